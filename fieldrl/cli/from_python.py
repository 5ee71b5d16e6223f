"""``fieldrl.estimate`` and ``fieldrl.suggest``: from samples to unknowns, and to the next samples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from fieldrl.core.checks import InvalidValue
from fieldrl.core.kinds import check_part
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import Compiled, ForwardModel
from fieldrl.loss.squared import Squared
from fieldrl.measurements.sample_file import SampleFile
from fieldrl.measurements.usable import usable
from fieldrl.mission.environment import Estimator
from fieldrl.mission.from_samples import Estimate
from fieldrl.mission.from_samples import estimate as concluded
from fieldrl.mission.robust_residuals import Loss
from fieldrl.mission.suggestion import Suggestion
from fieldrl.mission.suggestion import suggest as next_samples


def estimate(
    samples: Any, model: Any = "advection", estimator: Any = None, loss: Any = None, **reading: Any
) -> Estimate:
    """Fit a model's unknowns to samples, and say how far the estimate may be trusted.

    Args:
        samples: the path of a file (CSV, Parquet, NetCDF, a run's record), a pandas DataFrame or mapping with
            columns time, x, y, value and optionally std, or ``Samples``.
        model: a forward model, or the name of an experiment whose model and estimator are meant.
        estimator: what fits; None: least squares for a compiled model, composite Bayesian optimisation else.
        loss: of a residual, such as ``fieldrl.loss.huber.Huber()``; None: squared.
        reading: how the samples are read, see ``fieldrl.measurements.sample_file.SampleFile``.

    Returns:
        The estimate, its errors and intervals; printing it says all of this.

    Raises:
        FieldrlError: samples, model or settings are refused.
    """
    forward, default = _of_experiment(model) if isinstance(model, str) else _own(model)
    estimator = default if estimator is None else estimator
    loss = Squared() if loss is None else loss
    check_part("estimator", estimator, Estimator)
    check_part("loss", loss, Loss)
    reader = SampleFile(**reading)
    found = reader.read(samples) if isinstance(samples, str | Path) else reader.of(samples)
    used = usable(found, forward)
    return replace(concluded(used.samples, forward, estimator, loss), left_out=used.dropped)


def suggest(found: Estimate, count: int = 5, **settings: Any) -> Suggestion:
    """Where to sample next: the samples that are expected to tell most of the unknowns of an estimate.

    Args:
        found: what ``estimate`` gave.
        count: how many samples.
        settings: times, places, reach, apart of ``fieldrl.mission.suggestion.suggest``.

    Returns:
        Positions, times, expected values and gains, the best first, and the standard deviations after each;
        printing it gives the table, ``fieldrl.figures.suggestions.suggestion_figure`` the picture.

    Raises:
        FieldrlError: a setting is refused.
    """
    return next_samples(found.record, found.model, count, **settings)


def _own(model: Any) -> tuple[ForwardModel, Any]:
    """A model of somebody's own, and an estimator that suits it."""
    for name in ("parameters", "predict"):
        if not hasattr(model, name):
            rule = f"a forward model needs {name}; see fieldrl.estimator.problem.ForwardModel"
            raise InvalidValue("model", type(model).__name__, rule)
    return model, LeastSquares() if isinstance(model, Compiled) else Composite()


def _of_experiment(name: str) -> tuple[ForwardModel, Any]:
    """Model and estimator of an experiment."""
    from fieldrl.cli.compose import composed
    from fieldrl.runs import components
    from fieldrl.runs.options import options

    if name not in options("experiment"):
        known = ", ".join(options("experiment"))
        raise InvalidValue("model", name, f"must be a forward model or one of the experiments {known}")
    config = composed([f"experiment={name}"])
    return components.model(config), components.build(config["estimator"], "estimator")
