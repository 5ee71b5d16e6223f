"""Named random streams: every source of chance has its own generator, derived from the run's seed.

The stream depends on its name and indices alone, so neither the number of workers nor the order in
which the others are used changes what it yields.
"""

from __future__ import annotations

from zlib import crc32

import numpy as np


def stream(seed: int, name: str, *indices: int) -> np.random.Generator:
    """The generator of the stream ``name``, e.g. ``stream(seed, "sensor", replicate)``.

    Args:
        seed: the run's seed, >= 0.
        name: what the chance is for ("sensor", "exploration", ...).
        indices: which one of its kind, each >= 0 (usually the replicate).
    """
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(crc32(name.encode()), *indices))
    return np.random.Generator(np.random.PCG64(sequence))
