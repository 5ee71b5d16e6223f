"""Does a learner learn to search? Its return and its error by episode, paid by information and by Eq. 19.

python -m pipelines.contest.learning_curve [scale=small] [output_dir=FOLDER] [jobs=N]

Every replicate of experiment=search has truths, noise and exploration of its own; the three agents share
truths and noise. The greedy policy is tested in episodes of its own at the end. Leaves learning_curve.png and
.json in outputs/contest/.

Takes a quarter of an hour.
"""

from __future__ import annotations

import io
import json

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from fieldrl.figures import curves, style
from fieldrl.runs import atomic
from pipelines import artefacts, experiments, report
from pipelines.contest.statistics import bootstrap, interquartile_mean
from pipelines.experiments import Found, Settings, Wanted
from pipelines.measures import final

PLAN = {
    "information gain": Wanted("search"),
    "total error, Eq. 19": Wanted("search", ("reward=total_error",)),
    "random agent": Wanted("search", ("agent=random",)),
}
COLUMNS = {
    "first": "return, first tenth",
    "last": "last tenth",
    "width": "interquartile width",
    "rise": "rise / width",
    "error": "error of the greedy policy",
    "interval": "95 %",
}
"""What is printed of ``measured``."""
_SHARE = 10  # of the episodes a window is the tenth part


def make(settings: Settings) -> None:
    """Find the runs, print what they learned, draw it."""
    runs = experiments.find(PLAN, settings)
    numbers = {name: measured(run.record) for name, run in runs.items()}
    rows = [[name, *(cell(row[key]) for key in COLUMNS)] for name, row in numbers.items()]
    report.show("Learning in the search", ("", *COLUMNS.values()), rows)
    content, look = io.BytesIO(), {"dpi": artefacts.DPI[settings.scale], "metadata": {"Software": None}}
    drawing(runs).savefig(content, format="png", **look)
    folder = settings.folder.parent / "contest"
    atomic.write(folder / "learning_curve.png", content.getvalue())
    described = {
        "command": f"python -m pipelines.contest.learning_curve{' scale=small' if settings.small else ''}",
        "runs": [run.description for run in runs.values()],
        "numbers": artefacts.plain(numbers),
    }
    atomic.write(folder / "learning_curve.json", (json.dumps(described, indent=1) + "\n").encode())


def cell(value: object) -> str:
    """A number in three digits, text as it is."""
    return value if isinstance(value, str) else f"{value:.3g}"


def measured(record: xr.Dataset) -> dict[str, object]:
    """What a run shows of its learning.

    Args:
        record: with ``truth`` by episode.

    Returns:
        Medians over replicates of the mean return in the first and last tenth of the episodes, and the
        interquartile width over replicates of the latter; the rise from first to last in such widths; the
        interquartile mean error of the greedy policy [length/time] with its 95 % interval.
    """
    returns = record["return"].transpose("replicate", "episode").values
    window = max(1, returns.shape[1] // _SHARE)
    first, last = returns[:, :window].mean(axis=1), returns[:, -window:].mean(axis=1)
    width = float(np.subtract(*np.quantile(last, [0.75, 0.25])))
    rise = float(np.median(last) - np.median(first))
    scores = errors(record, "evaluation_")
    low, high = bootstrap(scores, stream(0, "contest bootstrap"))
    return {
        "first": float(np.median(first)),
        "last": float(np.median(last)),
        "width": width,
        "rise": rise / width if width > 0 else np.nan,
        "error": interquartile_mean(scores),
        "interval": f"[{low:.3g}, {high:.3g}]",
    }


def errors(record: xr.Dataset, prefix: str = "") -> NDArray[np.float64]:
    """|estimate - true| after the last sample of every episode, (replicates, episodes) [length/time]."""
    episode = f"{prefix}episode"
    estimate = record[f"{prefix}theta"].isel(step=-1)
    difference = estimate - record[f"{prefix}truth"]
    return ((difference**2).sum("parameter") ** 0.5).transpose("replicate", episode).values


def drawing(runs: dict[str, Found]) -> Figure:
    """Return (of what information pays) and error by episode."""
    figure = style.figure(style.PAGE, 2.6)
    left, right = style.panels(figure, 2)
    for number, (name, run) in enumerate(runs.items()):
        record, episodes = run.record, curves.episode_numbers(run.record)
        length = max(1, len(episodes) // _SHARE) | 1
        if not any("reward" in key for key in run.wanted.overrides):  # another reward is in another unit
            _draw(left, episodes, curves.rolling_mean(final(record, "return"), length), name, number)
        _draw(right, episodes, _rolling_median(errors(record), length), name, number)
    style.label(left, "Episode", "Return: information gained")
    style.label(right, "Episode", "Error of the flow [length/time]")
    style.logarithmic(right, 1.0)
    style.legend(right, "center right")
    for axes, letter in zip((left, right), "AB", strict=True):
        style.letter(axes, letter)
    return figure


def _draw(axes: Axes, episodes: NDArray, values: NDArray, name: str, number: int) -> None:
    style.open_frame(axes)
    style.count_along_x(axes)
    curves.draw_compared(axes, episodes, values, name, number)


def _rolling_median(values: NDArray, length: int) -> NDArray:
    rows = xr.DataArray(values, dims=("replicate", "episode"))
    return rows.rolling(episode=length, center=True, min_periods=(length + 1) // 2).median().values


if __name__ == "__main__":
    experiments.command(make)
