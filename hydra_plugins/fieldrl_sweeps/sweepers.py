"""Sweepers: which jobs a sweep has. The work is done in ``fieldrl.sweeps``."""

from typing import Any

from hydra.core.plugins import Plugins
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig


class Fieldrl(Sweeper):
    """What fieldrl's sweepers share.

    Args:
        objective: what jobs are compared by, a dotted path into summary.json.
        direction: minimise or maximise.
    """

    def __init__(self, objective: str, direction: str, **settings: Any) -> None:
        self.objective, self.direction, self.settings = objective, direction, settings

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Keep what Hydra gives; the launcher is asked for when the sweep begins."""
        self.hydra_context, self.config = hydra_context, config
        self._context, self._master = hydra_context, config

    def _parsed(self, arguments: list[str]) -> Any:
        from hydra.core.override_parser.overrides_parser import OverridesParser

        return OverridesParser.create(config_loader=self._context.config_loader).parse_overrides(arguments)

    def _execution(
        self, arguments: list[str], varied: tuple[str, ...], total: int, search: Any = None
    ) -> Any:
        """The sweep, with the workers of the launcher that was chosen."""
        from fieldrl.cli import launchers
        from fieldrl.cli.compose_jobs import Composer
        from fieldrl.cli.sweep_terminal import SweepTerminal
        from fieldrl.sweeps.execution import Execution

        launcher = Plugins.instance().instantiate_launcher(
            hydra_context=self._context, task_function=launchers.job_of_a_sweep, config=self._master
        )
        compose, workers = Composer(self._context.config_loader, self._master), launchers.workers(launcher)  # type: ignore[arg-type]
        method = search.method(workers.size) if search else {}
        objective = self._objective()
        return Execution(
            compose, workers, SweepTerminal(), objective, tuple(arguments), varied, method, total
        )

    def _objective(self) -> Any:
        from fieldrl.sweeps.objective import Objective

        return Objective(self.objective, self.direction)


class Grid(Fieldrl):
    """``hydra/sweeper=grid``: every combination of the values given."""

    def __init__(self, objective: str, direction: str) -> None:
        super().__init__(objective, direction)

    def sweep(self, arguments: list[str]) -> None:
        """Run every combination."""
        from fieldrl.cli import sweep_overrides
        from fieldrl.sweeps import grid

        self._objective()
        parsed = self._parsed(arguments)
        jobs = sweep_overrides.jobs(parsed)
        grid.run(self._execution(arguments, sweep_overrides.varied(parsed), len(jobs)), jobs)


class GaussianProcess(Fieldrl):
    """``hydra/sweeper=gp``: Bayesian optimisation of the values given as intervals, ranges and choices.

    Args:
        settings: see ``fieldrl.sweeps.gp.Search``, with objective and direction apart.
    """

    def sweep(self, arguments: list[str]) -> None:
        """Search until there have been enough trials."""
        from fieldrl.cli import sweep_overrides
        from fieldrl.sweeps import gp

        search = gp.Search(self._objective(), **self.settings)
        space = sweep_overrides.space(self._parsed(arguments))
        gp.run(self._execution(arguments, space.keys, search.n_trials, search), space, search)
