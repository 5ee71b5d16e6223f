"""What of the samples a model can predict; the others are left out and counted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fieldrl.core.domain import Domain
from fieldrl.core.parameters import Parameters
from fieldrl.measurements.sample_file import Reading
from fieldrl.measurements.table import Unreadable

_CLOSE = 1e-9  # of the extent of the positions: the same place
EARLY, LATE, OUTSIDE = "before time 0", "after the model's last time", "outside the model's domain"


def usable(reading: Reading, model: Any) -> Reading:
    """The samples that a model can predict, enough of them to fit its unknowns.

    Args:
        reading: what was read.
        model: a forward model; where it tells its ``horizon`` (last time) and ``admissible`` positions, these
            are kept to.

    Raises:
        Unreadable: too few are left.
        InvalidValue: a model that predicts at some times only does not at these.
    """
    found = reading.less(reading.samples.times >= 0.0, EARLY)
    horizon = getattr(model, "horizon", np.inf)
    found = found.less(found.samples.times <= horizon * (1 + 1e-12), LATE)
    if hasattr(model, "admissible") and len(found.samples):
        positions = found.samples.positions
        moved = np.abs(np.asarray(model.admissible(positions)) - positions).max(axis=1)
        found = found.less(moved <= _CLOSE * max(1.0, float(np.abs(positions).max())), OUTSIDE)
    _check_count(found, model.parameters, horizon)
    if hasattr(model, "check_times"):
        model.check_times(found.samples.times)
    return _told_where(found, model.domain) if hasattr(model, "domain") else found


def _told_where(found: Reading, domain: Domain) -> Reading:
    """With a note, where most samples lie outside the domain of a model that predicts there all the same."""
    positions, count = found.samples.positions, len(found.samples)
    inside = np.all((positions >= domain.lower) & (positions <= domain.upper), axis=1)
    outside = count - int(np.count_nonzero(inside))
    if 2 * outside <= count:
        return found
    (x0, y0), (x1, y1) = domain.lower, domain.upper
    where = f"outside the domain of {x0:g} to {x1:g}, {y0:g} to {y1:g}"
    note = f"{outside} of {count} samples lie {where}: are units and origin right?"
    return replace(found, notes=(*found.notes, note))


def _check_count(found: Reading, parameters: Parameters, horizon: float) -> None:
    least, count = len(parameters) + 1, len(found.samples)
    if count >= least:
        return
    lost = "; ".join(f"{number}: {reason}" for reason, number in found.dropped.items())
    lost = f" ({lost})" if lost else ""
    names = ", ".join(parameters.names)
    hint = (
        f"\nthe model ends at {horizon:g} [time]: pde.final_time extends it" if LATE in found.dropped else ""
    )
    needed = f"{names} and a fold that leaves one out need {least}{hint}"
    raise Unreadable(found.source, f"{count} usable samples of {found.rows} rows{lost};\n{needed}")
