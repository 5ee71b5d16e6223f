"""Who does the jobs of a sweep, by the Hydra launcher that was chosen.

Hydra's basic and joblib launchers answer when all jobs are over, and lose them all where a worker is killed.
For these two fieldrl does the jobs itself, in this process or in a ``Pool``. Any other launcher (Slurm's,
for instance) does them in its own way, a batch at a time.
"""

from __future__ import annotations

from typing import Any

from hydra._internal.core_plugins.basic_launcher import BasicLauncher
from hydra.core.utils import JobStatus
from hydra_plugins.hydra_joblib_launcher.joblib_launcher import JoblibLauncher
from omegaconf import DictConfig

from fieldrl.cli import hydra_settings
from fieldrl.parallel.loky import Pool
from fieldrl.parallel.serial import Serial
from fieldrl.parallel.workers import Begun, Results, Tasks, Workers, nobody
from fieldrl.runs.explain import explain
from fieldrl.sweeps import task as sweep_task
from fieldrl.sweeps.task import Outcome


def workers(launcher: Any) -> Workers:
    """Who does the jobs for a Hydra launcher."""
    if isinstance(launcher, JoblibLauncher):
        return Pool(launcher.joblib.get("n_jobs", -1))
    return Serial() if isinstance(launcher, BasicLauncher) else Launcher(launcher)


class Launcher(Workers):
    """A launcher that knows nothing of fieldrl.

    Args:
        launcher: Hydra's.
    """

    def __init__(self, launcher: Any) -> None:
        self.launcher = launcher

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """Yield (number, outcome) of each job when all are finished."""
        if not tasks:
            return
        for number in tasks:
            begun(number)
        overrides = [task.composed.overrides for task in tasks.values()]  # type: ignore[attr-defined]
        answers = self.launcher.launch(overrides, initial_job_idx=min(tasks))
        for number, answer in zip(tasks, answers, strict=True):
            yield number, _outcome(answer)


def job_of_a_sweep(config: DictConfig) -> Outcome:
    """What the launcher calls for each job, wherever that is."""
    return sweep_task.Task(hydra_settings.current_job(config), alone=False)()


def _outcome(answer: Any) -> Outcome:
    if answer.status == JobStatus.COMPLETED:
        return answer.return_value
    return Outcome({}, explain(answer._return_value))
