"""Models that take long before they predict are made ready before a run, by one process at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from filelock import FileLock

from fieldrl.core.checks import InvalidValue
from fieldrl.runs.folder import lock_folder


def prepare(water: Any, output_dir: Path) -> None:
    """Have a run's model, and the true field's where a mission simulates it, built and kept.

    Args:
        water: a forward model; what has no ``prepare`` is ready.
        output_dir: whose processes wait for each other.

    Raises:
        InvalidValue: the model is refused, with the full key.
        SolveFailed: one of its solves.
    """
    simulates = hasattr(water, "truth") and water.parameters.truth_known
    for model in (water, water.truth()) if simulates else (water,):
        if hasattr(model, "prepare"):
            with FileLock(lock_folder(output_dir) / "models.lock"):
                _prepare(model)


def _prepare(model: Any) -> None:
    try:
        model.prepare()
    except InvalidValue as error:
        raise error.within("pde") from None
