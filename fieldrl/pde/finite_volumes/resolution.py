"""Whether a grid can follow the feature that it is given."""

from __future__ import annotations

import warnings

from fieldrl.pde.finite_volumes import sampling
from fieldrl.pde.finite_volumes.discretisation import Discretisation
from fieldrl.pde.initial import Feature

_CELLS_PER_FEATURE = 5.0


class CoarseGrid(UserWarning):
    """A grid on which the initial feature cannot be followed."""


def check_feature(scheme: Discretisation, initial: Feature, which: str = "") -> None:
    """Warns, with the number, where the feature rises over too few cells; ``which`` says which one it is."""
    resolved = sampling.cells_per_rise(sampling.cell_averages(initial.value, *scheme.edges))
    if resolved < _CELLS_PER_FEATURE:
        warnings.warn(
            f"cells={list(scheme.cells)}: the initial feature{which} rises over {resolved:.1f} cells; "
            f"the solver needs at least {_CELLS_PER_FEATURE:g} to follow it",
            CoarseGrid,
            stacklevel=5,
        )
