"""What learning changes: the paper's learner beside a random agent and a reward for knowing the flow.

python -m pipelines.paper.learning [scale=small]

Takes seconds, and its runs four minutes.
"""

from __future__ import annotations

from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fieldrl.figures import curves, style
from fieldrl.figures.learning import draw_expectation, window
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.measures import error_of_theta
from pipelines.paper import figure_3

PLAN = {
    "learner": Wanted("advection"),
    "random": Wanted("advection", ("agent=random",)),
    "informed": Wanted("advection", ("reward=information_gain",)),
    "learner, one start": Wanted("advection", ("estimator.starts=1",)),
    "random, one start": Wanted("advection", ("estimator.starts=1", "agent=random")),
}
_GLOBAL = {"learner": "learner, Eq. 19", "random": "random agent", "informed": "learner, information gain"}
_ONE_START = {"learner, one start": "learner, Eq. 19", "random, one start": "random agent"}


def plan(settings: Settings) -> dict[str, Wanted]:
    """Learners and random agents."""
    return PLAN


def make(settings: Settings) -> None:
    """Find the runs, draw total error with both estimators and the error of b."""
    runs = experiments.find(PLAN, settings)
    drawing = style.figure(style.PAGE, 2.6)
    panels = style.panels(drawing, 3)
    numbers = {
        "e_total, one start": _draw_errors(panels[0], runs, _ONE_START),
        "e_total, global": _draw_errors(panels[1], runs, _GLOBAL),
        "error of b, global": _draw_accuracy(panels[2], runs),
    }
    panels[1].set_ylim(panels[0].get_ylim())
    style.legend(panels[1], "upper right")
    for axes, letter in zip(panels, "ABC", strict=True):
        style.letter(axes, letter)
    style.title(panels[0], "every fit from one start")
    style.title(panels[1], "every fit at its global minimum")
    style.title(panels[2], "every fit at its global minimum")
    artefacts.save(settings, "learning", drawing, _caption(runs["learner"].record), runs.values(), numbers)


def _draw_errors(axes: Axes, runs: dict[str, Found], names: dict[str, str]) -> dict[str, NDArray]:
    drawn = {}
    for number, (name, label) in enumerate(names.items()):
        record = runs[name].record
        values = figure_3.series(record, "e_total")
        drawn[label] = curves.draw_compared(axes, curves.episode_numbers(record), values, label, number)
        noise = float(record.attrs["noise"])
    draw_expectation(axes, noise)
    _dress(axes, f"Total error {style.E_TOTAL} [(field unit)$^{{2}}$]")
    return drawn


def _draw_accuracy(axes: Axes, runs: dict[str, Found]) -> dict[str, NDArray]:
    drawn = {}
    for number, (name, label) in enumerate(_GLOBAL.items()):
        errors = xr.DataArray(error_of_theta(runs[name].record), dims=("replicate", "episode"))
        length = window(errors.sizes["episode"])
        smooth = errors.rolling(episode=length, center=True, min_periods=(length + 1) // 2).median()
        episodes = curves.episode_numbers(runs[name].record)
        drawn[label] = curves.draw_compared(axes, episodes, smooth.values, label, number)
    _dress(axes, "$|\\mathbf{b} - \\hat{\\mathbf{b}}|$ [length/time]")
    return drawn


def _dress(axes: Axes, quantity: str) -> None:
    style.logarithmic(axes, 1.0)
    style.open_frame(axes)
    style.count_along_x(axes)
    style.label(axes, "Episode", quantity)


def _caption(record: xr.Dataset) -> str:
    texts: dict[str, Any] = {
        "replicates": record.sizes["replicate"],
        "length": window(record.sizes["episode"]),
    }
    return (
        "What learning changes. A: total error with one start for each fit; the learner of Eq. 19 against "
        "an agent that chooses at random. B: the same with every fit at its global minimum, and a learner "
        "that is paid for information (reward=information_gain). C: error of b in the runs of B. Median and "
        "interquartile range over {replicates} replicates, each smoothed over {length} episodes (A, B: "
        "mean; C: median). Waves that all curves share are the noise of the samples, which is the same in "
        "all runs."
    ).format(**texts)


if __name__ == "__main__":
    experiments.command(make)
