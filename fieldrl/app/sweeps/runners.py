"""Who does the jobs of a sweep, by the Hydra launcher that was chosen.

Hydra's basic and joblib launchers answer when all jobs are over, and lose them all where a worker is killed.
For these two fieldrl does the jobs itself, in this process or in its ``Pool``. Any other launcher (Slurm's,
for instance) does them in its own way, a batch at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from hydra._internal.core_plugins.basic_launcher import BasicLauncher
from hydra.core.hydra_config import HydraConfig
from hydra.core.utils import JobStatus
from hydra_plugins.hydra_joblib_launcher.joblib_launcher import JoblibLauncher
from omegaconf import DictConfig, OmegaConf

from fieldrl.app import config as configuration
from fieldrl.app.errors import explain
from fieldrl.app.sweeps.composing import Composed
from fieldrl.app.sweeps.pool import Here, Pool
from fieldrl.app.sweeps.task import Outcome, Task


def runner(launcher: Any) -> Here | Pool | Foreign:
    """Who does the jobs for a Hydra launcher."""
    if isinstance(launcher, JoblibLauncher):
        return Pool(launcher.joblib.get("n_jobs", -1))
    return Here() if isinstance(launcher, BasicLauncher) else Foreign(launcher)


class Foreign:
    """A launcher that knows nothing of fieldrl.

    Args:
        launcher: it.
    """

    def __init__(self, launcher: Any) -> None:
        self.launcher = launcher
        self.workers = 1

    def warm(self) -> None:
        """Nothing to start."""

    def run(self, tasks: Mapping[int, Task], begun: Callable[[int], Any]) -> Iterator[tuple[int, Outcome]]:
        """Yield (number, outcome) of each task when all are finished."""
        if not tasks:
            return
        for number in tasks:
            begun(number)
        overrides = [task.composed.overrides for task in tasks.values()]
        answers = self.launcher.launch(overrides, initial_job_idx=min(tasks))
        for number, answer in zip(tasks, answers, strict=True):
            yield number, _outcome(answer)

    def close(self) -> None:
        """Nothing to stop."""


def job_of_a_sweep(config: DictConfig) -> Outcome:
    """What the launcher calls for each job, wherever that is."""
    settings = HydraConfig.get()
    experiment = str(settings.runtime.choices["experiment"])
    hydra = OmegaConf.to_yaml(OmegaConf.create({"hydra": settings}))
    overrides = tuple(settings.overrides.task)
    return Task(Composed(configuration.plain(config), experiment, overrides, hydra))()


def _outcome(answer: Any) -> Outcome:
    if answer.status == JobStatus.COMPLETED:
        return answer.return_value
    return Outcome({}, explain(answer._return_value))
