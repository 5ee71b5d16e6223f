"""An estimate from a file of samples: like a run, with a key, a folder, a record, a summary, and tracked."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fieldrl import __version__
from fieldrl.core import compiled
from fieldrl.core.checks import FieldrlError
from fieldrl.core.kinds import check_part
from fieldrl.measurements.sample_file import Reading, SampleFile
from fieldrl.measurements.usable import usable
from fieldrl.mission.environment import Estimator
from fieldrl.mission.from_samples import estimate, estimate_record
from fieldrl.mission.robust_residuals import Loss
from fieldrl.mission.summary import summarise
from fieldrl.runs import components, configuration, limits, netcdf, warning_lines
from fieldrl.runs.display import Display
from fieldrl.runs.folder import Run
from fieldrl.runs.identity import identity
from fieldrl.runs.job import Job
from fieldrl.runs.preparation import prepare

_ARRAYS = 5  # of a number for each sample in each fold, at a time


@dataclass(frozen=True)
class EstimateJob:
    """An estimate that may begin.

    Args:
        job: its configuration, identity and place, as of a run.
        reading: the samples that are used, and what became of the others.
        command: the command line that gives the same.
        loss: its configuration.
    """

    job: Job
    reading: Reading
    command: str
    loss: Mapping[str, Any]

    @classmethod
    def of(
        cls,
        path: str,
        config: Mapping[str, Any],
        measurements: Mapping[str, Any],
        loss: Mapping[str, Any],
        hydra: Mapping[str, str],
        command: str,
    ) -> EstimateJob:
        """Check the configuration, read the samples.

        Args:
            path: the file.
            config: plain; what it says of vehicle, agent, reward and budget has no effect.
            measurements: how the file is read, with ``_target_``.
            loss: of a residual, with ``_target_``.
            hydra: what Hydra knows of it: content of ``.hydra/``.
            command: the command line that gives the same.

        Raises:
            FieldrlError: the configuration or the file is refused.
        """
        configuration.check(config)
        reader = components.build(measurements, "measurements")
        check_part("measurements", reader, SampleFile)
        check_part("loss", components.build(loss, "loss"), Loss)
        model = components.model(config)
        reading = usable(reader.read(path), model)
        budget = {"replicates": 1, "episodes": 1, "steps": len(reading.samples), "evaluation_episodes": 0}
        job = Job.of({**config, **budget}, "estimate", hydra)
        _check_memory(reading)
        run = Run("estimate", _key({**config, "loss": loss}, reading), job.run.output_dir)
        return cls(replace(job, run=run), reading, command, loss)

    def told(self) -> dict[str, Any]:
        """What a tracker hears of it."""
        name = f"estimate {Path(self.reading.source).name}"
        return self.job.told(name=name) | {"command": self.command}


def perform(given: EstimateJob, display: Display) -> dict[str, Any]:
    """Make an estimate, or find it made; show its result.

    Returns:
        The summary.
    """
    run, forced = given.job.run, given.job.config["force"]
    with warning_lines.told(display.note), run.held(display.waiting):
        summary = None if forced else run.summary()
        if summary is not None:
            display.result(summary, run, given.job.publish(given.told()), reused=True)
            return summary
        with compiled.told(display.compiling):
            return _compute(given, display)


def _compute(given: EstimateJob, display: Display) -> dict[str, Any]:
    """Compute, write everything with the summary last, then tell the tracker."""
    started, job, reading = time.time(), given.job, given.reading
    run = job.run
    run.tidy()
    display.beginning(run, job.config, 1, 0)
    model = components.model(job.config, job.checkpoints.solves)
    prepare(model, run.output_dir)
    estimator = components.build(job.config["estimator"], "estimator")
    check_part("estimator", estimator, Estimator)
    loss = components.build(given.loss, "loss")
    check_part("loss", loss, Loss)
    found = estimate(reading.samples, model, estimator, loss)
    known = {"experiment": "estimate", "key": run.key, "seed": job.config["seed"], "version": __version__}
    record = estimate_record(found).assign_attrs(known)
    netcdf.write(record, run.folder / "record.nc")
    job.draw(record)
    used = {"source": reading.source, "rows": reading.rows, "used": len(reading.samples)}
    used |= {"dropped": sum(reading.dropped.values()), "dropped_because": reading.dropped}
    noise = {"noise": found.noise, "noise_stated": found.noise_stated, "outliers": list(found.outliers)}
    expected = {"late_e_total": [found.errors.e_total], "greedy": []}
    summary = known | summarise(record) | expected | noise
    used |= {"notes": list(reading.notes), "time_zero": reading.time_zero, "degrees": reading.degrees}
    summary |= {"samples": used, "seconds": round(time.time() - started, 3)}
    summary = _finite(summary) | run.checksums(record)
    job.conclude(record, summary, given.told())
    display.result(summary, run, job.publish(given.told(), again=job.config["force"]))
    return summary


def _key(config: Mapping[str, Any], reading: Reading) -> str:
    """Of what an estimate depends on: model, unknowns, estimator, loss, and the content of the samples."""
    samples = reading.samples
    content = hashlib.blake2b(digest_size=16)
    for part in (samples.positions, samples.times, samples.values, samples.std, samples.censored):
        content.update(b"none" if part is None else np.ascontiguousarray(part).tobytes())
    parts = {name: config[name] for name in ("pde", "unknown", "estimator", "loss")}
    return identity({**parts, "samples": content.hexdigest(), "dropped": reading.dropped})


def _check_memory(reading: Reading) -> None:
    """Refuse what does not fit: every sample has a fold with residuals at all samples."""
    count = len(reading.samples)
    needed, free = _ARRAYS * 8.0 * count**2, limits.available()
    if needed > free:
        thin = int(np.ceil(np.sqrt(needed / free)))
        problem = (
            f"{count} samples need {needed / 1e9:.3g} GB of memory for their folds, {free / 1e9:.3g} are free"
        )
        raise FieldrlError(f"{reading.source}: {problem};\nobservations.thin={thin} uses every {thin}th")


def _finite(value: Any) -> Any:
    """``value`` with null for numbers that JSON has not."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
