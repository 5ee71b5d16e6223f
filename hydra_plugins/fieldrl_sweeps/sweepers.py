"""Sweepers: which jobs a sweep has. The work is done in ``fieldrl.app.sweeps``."""

from typing import Any

from hydra.core.plugins import Plugins
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig


class Fieldrl(Sweeper):
    """What fieldrl's sweepers share."""

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Keep what Hydra gives; the launcher is asked for when the sweep begins."""
        self.hydra_context, self.config = hydra_context, config
        self._context, self._master = hydra_context, config

    def _runner(self) -> Any:
        """Who does the jobs, by the launcher that was chosen."""
        from fieldrl.app.sweeps.runners import job_of_a_sweep, runner

        launcher = Plugins.instance().instantiate_launcher(
            hydra_context=self._context, task_function=job_of_a_sweep, config=self._master
        )
        return runner(launcher)


class Grid(Fieldrl):
    """``hydra/sweeper=grid``: every combination of the values given.

    Args:
        objective: what jobs are compared by, a dotted path into summary.json.
        direction: minimise or maximise.
    """

    def __init__(self, objective: str, direction: str) -> None:
        self.objective, self.direction = objective, direction

    def sweep(self, arguments: list[str]) -> None:
        """Run every combination."""
        from fieldrl.app.sweeps import grid
        from fieldrl.app.sweeps.objective import Objective

        objective = Objective(self.objective, self.direction)
        grid.run(self._master, self._context.config_loader, self._runner(), arguments, objective)


class GaussianProcess(Fieldrl):
    """``hydra/sweeper=gp``: Bayesian optimisation of the values given as intervals, ranges and choices.

    Args:
        settings: see ``fieldrl.app.sweeps.search.Settings``, with objective and direction apart.
    """

    def __init__(self, objective: str, direction: str, **settings: Any) -> None:
        self.objective, self.direction, self.settings = objective, direction, settings

    def sweep(self, arguments: list[str]) -> None:
        """Search until there have been enough trials."""
        from fieldrl.app.sweeps import search
        from fieldrl.app.sweeps.objective import Objective

        settings = search.Settings(Objective(self.objective, self.direction), **self.settings)
        search.run(self._master, self._context.config_loader, self._runner(), arguments, settings)
