"""What errors of the measured positions, Eq. (14) with Sigma > 0, do to the estimates.

    python -m pipelines.paper.position_errors [scale=small] [jobs=N]

The fit takes measured positions for exact. What that costs is measured here: bias and spread of the estimates
from all samples of a replicate, against the standard deviation of x and y. Beside it stands what a fit would
give that knows Sigma, with the effective variance

    s_i^2 = sigma^2 + grad f(x_i, t_i)^T Sigma grad f(x_i, t_i)

of each sample at the estimate (Orear 1982). The vehicle acts at random, so that its paths are the same in
every row. The tables are printed, and left with their numbers as outputs/paper/position_errors_EXPERIMENT.md
and .json.

Takes ten minutes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.samples import Samples
from fieldrl.mission.environment import Water
from pipelines import artefacts, experiments, measures, report
from pipelines.experiments import Found, Settings, Wanted

DEVIATIONS = (0.0, 0.5, 1.0, 2.0, 4.0)  # of measured x and y [length]
SIZES = {
    "advection": ("replicates=32", "episodes=50", "evaluation_episodes=0", "agent=random"),
    "double_gyre": ("replicates=16", "episodes=3", "evaluation_episodes=0", "agent=random"),
}
_STEP = 1e-3  # of the differences, in half-widths of the bounds
_APART = 0.5  # of the differences along x and y [length]
_ITERATIONS = 4  # of Gauss-Newton from the fit that takes positions for exact


class Row(NamedTuple):
    """What is found with one Sigma.

    Args:
        pooled: estimate - true from all samples of each replicate, as shipped, (r, p).
        effective: the same with effective variances, (r, p).
        episode: root mean square of estimate - true at the episodes' ends, (r, p).
        e_total: its mean at the episodes' ends, (r,) [field unit^2].
    """

    pooled: NDArray[np.float64]
    effective: NDArray[np.float64]
    episode: NDArray[np.float64]
    e_total: NDArray[np.float64]


def plan(settings: Settings) -> dict[str, Wanted]:
    """A run for each experiment and Sigma; the extremes at the small scale."""
    return {name: wanted for experiment in SIZES for name, wanted in rows_of(experiment, settings).items()}


def rows_of(experiment: str, settings: Settings) -> dict[str, Wanted]:
    """The runs of one experiment, by the standard deviation of x and y."""
    chosen = DEVIATIONS[::4] if settings.small else DEVIATIONS
    size = () if settings.small else SIZES[experiment]
    return {
        f"{experiment} {deviation:g}": Wanted(experiment, (*size, _noise(deviation))) for deviation in chosen
    }


def make(settings: Settings) -> dict[str, Row]:
    """Compute what is missing, print and write a table for each experiment; returns the rows by name."""
    found: dict[str, Row] = {}
    for experiment in SIZES:
        runs = experiments.find(rows_of(experiment, settings), settings)
        rows = {name: measure(run) for name, run in runs.items()}
        columns, lines = table(rows, runs)
        size = next(iter(runs.values())).record.sizes
        title = f"{experiment}, {size['replicate']} replicates of {size['episode']} episodes"
        report.show(title, columns, lines)
        name = f"position_errors_{experiment}"
        text = f"{title}:\n\n{report.markdown(columns, lines)}"
        artefacts.put(settings, f"{name}.md", text.encode())
        numbers = {key: row._asdict() for key, row in rows.items()}
        artefacts.note(settings, name, {"caption": title}, runs.values(), numbers, "position_errors")
        found |= rows
    return found


def measure(run: Found) -> Row:
    """Errors of the estimates of a run."""
    record, true = run.record, run.record["true"].values
    final = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    variance = np.array(run.mission.vehicle.sensor.covariance[:2])  # type: ignore[attr-defined]
    noise = run.mission.vehicle.sensor.noise
    pooled = record["pooled"].values
    effective = [
        reweighted(run.mission.water, _samples(run, i), theta, noise, variance)
        for i, theta in enumerate(pooled)
    ]
    return Row(
        pooled - true,
        np.array(effective) - true,
        np.sqrt(((final - true) ** 2).mean(axis=1)),
        measures.final(record, "e_total").mean(axis=1),
    )


def reweighted(
    water: Water, samples: Samples, theta: NDArray, noise: float, variance: NDArray
) -> NDArray[np.float64]:
    """The weighted least-squares estimate with effective variances, by Gauss-Newton from ``theta``.

    Args:
        water: the model.
        samples: n of them, at measured positions.
        theta: where to begin, (p,).
        noise: sigma [field unit].
        variance: of measured x and y, (2,) [length^2].

    Returns:
        (p,), within the bounds.
    """
    parameters, positions, times = water.parameters, samples.positions, samples.times
    scale = parameters.half_width
    shift = _STEP * np.diag(scale)
    for _ in range(_ITERATIONS):
        inside = np.clip(theta, parameters.centre - 0.998 * scale, parameters.centre + 0.998 * scale)
        middle, up, down = (
            water.predict(at, positions, times) for at in (inside[None], inside + shift, inside - shift)
        )
        spread = noise**2 + _slopes(water, inside, positions, times) ** 2 @ variance
        jacobian = (up - down).T / (2 * _STEP) / np.sqrt(spread)[:, None]
        residuals = (samples.values - middle[0]) / np.sqrt(spread)
        theta = inside + scale * np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
    return np.clip(theta, parameters.centre - scale, parameters.centre + scale)


def table(rows: Mapping[str, Row], runs: Mapping[str, Found]) -> tuple[list[str], list[list[str]]]:
    """Heads and lines of text, one for each Sigma and parameter."""
    heads = [
        "std of x, y", "", "bias", "spread", "bias, effective variance", "spread", "rms, episode", "e_total"
    ]  # fmt: skip
    lines = []
    for name, row in rows.items():
        for k, parameter in enumerate(runs[name].record["parameter"].values):
            rms = f"{np.sqrt((row.episode[:, k] ** 2).mean()):.2g}"
            both = [*_bias(row.pooled[:, k]), *_bias(row.effective[:, k])]
            total = "" if k else report.spread(row.e_total)
            lines.append(["" if k else name.split()[1], str(parameter), *both, rms, total])
    return heads, lines


def _bias(errors: NDArray) -> list[str]:
    """Mean with its standard error, and the standard deviation."""
    spread = float(np.std(errors, ddof=1))
    return [f"{errors.mean():+.2g} ± {spread / np.sqrt(errors.size):.1g}", f"{spread:.2g}"]


def _slopes(water: Water, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
    """Gradient of the field at the samples, (n, 2) [field unit/length]."""
    slopes = np.empty(positions.shape)
    for axis in range(2):
        ahead, behind = (
            water.admissible(positions + sign * _APART * np.eye(2)[axis]) for sign in (1.0, -1.0)
        )
        change = water.predict(theta[None], ahead, times)[0] - water.predict(theta[None], behind, times)[0]
        slopes[:, axis] = change / (ahead - behind)[:, axis]
    return slopes


def _samples(run: Found, replicate: int) -> Samples:
    """All samples of a replicate, where they were measured."""
    record = run.record.isel(replicate=replicate)
    positions = record["measured_position"].transpose("episode", "step", "axis").values
    times, values = (record[name].transpose("episode", "step").values for name in ("time", "value"))
    return Samples.of(positions, times, values)


def _noise(deviation: float) -> str:
    variance = deviation**2
    return f"vehicle.sensor.covariance=[{variance:g},{variance:g},0]"


if __name__ == "__main__":
    experiments.command(make)
