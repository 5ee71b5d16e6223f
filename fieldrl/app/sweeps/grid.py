"""Every combination of the values given: ``hydra/sweeper=grid``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig

from fieldrl.app.sweeps.composing import Composer
from fieldrl.app.sweeps.conduct import Conductor, Runner
from fieldrl.app.sweeps.drawing import draw_grid
from fieldrl.app.sweeps.objective import Objective
from fieldrl.core.checks import FieldrlError


def run(
    master: DictConfig, loader: Any, runner: Runner, arguments: Sequence[str], objective: Objective
) -> None:
    """Run every combination.

    Args:
        master: the sweep's configuration, Hydra's node included.
        loader: Hydra's loader of configurations.
        runner: who does the jobs.
        arguments: the overrides as typed.
        objective: what jobs are compared by.

    Raises:
        FieldrlError: the command line is refused, or a job failed.
    """
    parsed = OverridesParser.create(config_loader=loader).parse_overrides(list(arguments))
    jobs = combinations(parsed)
    varied = tuple(
        override.get_key_element().lstrip("+~") for override in parsed if override.is_sweep_override()
    )
    conductor = Conductor(
        Composer(loader, master), runner, objective, tuple(arguments), varied, {}, len(jobs)
    )
    try:
        conductor.batch(jobs)
        conductor.finish(lambda rows, folder: draw_grid(rows, varied, objective, folder))
    finally:
        conductor.close()


def combinations(overrides: Sequence[Override]) -> list[tuple[str, ...]]:
    """The overrides of each job, the last key varying fastest; of a key given twice, the last counts."""
    values: dict[str, list[str]] = {}
    for override in overrides:
        key = override.get_key_element()
        if not override.is_sweep_override():
            values[key] = [f"{key}={override.get_value_element_as_str()}"]
        elif override.is_discrete_sweep():
            values[key] = [f"{key}={value}" for value in override.sweep_string_iterator()]
        else:
            raise FieldrlError(
                f"{override.input_line}: an interval has no end of values; "
                "hydra/sweeper=gp searches it, or list values: KEY=1,2,3"
            )
    return list(itertools.product(*values.values()))
