"""Proper orthogonal decomposition of snapshots: few fields whose combinations are all of them.

| symbol | meaning | shape | unit |
|---|---|---|---|
| X | snapshots, X ~ A Phi | (s, cells) | field |
| A | coefficients, orthonormal columns | (s, r) | 1 |
| Phi | modes, the most important first | (r, cells) | field |
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

_BLOCK = 2048  # cells whose products are summed in double precision at a time


def modes(snapshots: NDArray[np.float32], left_out: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A (s, r) and Phi (r, cells); the least r that leaves out at most ``left_out``, rms [field unit]."""
    gram = np.zeros((len(snapshots),) * 2)
    blocks = range(0, snapshots.shape[1], _BLOCK)
    for begin in blocks:
        block = snapshots[:, begin : begin + _BLOCK].astype(float)
        gram += block @ block.T
    values, vectors = eigh(gram, overwrite_a=True, check_finite=False)
    rest = np.sqrt(np.cumsum(np.maximum(values, 0.0)) / snapshots.size)
    rank = max(1, int(np.sum(rest > left_out)))
    found = vectors[:, ::-1][:, :rank]
    return found, np.concatenate(
        [found.T @ snapshots[:, begin : begin + _BLOCK].astype(float) for begin in blocks], axis=1
    )
