"""Table 2 with its spread: mu and omega as every replicate learns them, beside the paper's and the truth.

python -m pipelines.paper.learned [scale=small]

``pipelines.paper.table_2`` adds what the method costs against the paper's, with more replicates.

Takes seconds, and its run four minutes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fieldrl.figures import style
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres
from pipelines.paper.table_2 import PAPER, cramer_rao
from pipelines.report import spread


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run of table 2."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, draw the estimates and their table."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    record = run.record
    found = {"best episode": best(record), "all samples": record["pooled"].values}
    bounds = cramer_rao_bounds(run)
    drawing = style.figure(style.PAGE, 2.7)
    left, right = drawing.subplots(1, 2, width_ratios=(1, 1.7))
    _draw_estimates(left, record, found)
    rows = table(record, found, bounds)
    _draw_table(right, rows)
    numbers = {
        "estimates": found,
        "cramer_rao": bounds,
        "best_episode": record["best_episode"].values + 1,
        "rows": rows,
    }
    artefacts.save(settings, "table_2", drawing, _caption(record), [run], numbers, "learned")


def best(record: xr.Dataset) -> NDArray[np.float64]:
    """The estimate of every replicate's episode of least total error, (replicates, p)."""
    final = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    return final[np.arange(len(final)), record["best_episode"].values.astype(int)]


def cramer_rao_bounds(run: Found) -> dict[str, NDArray[np.float64]]:
    """Least standard deviations from the best episode's samples, and from all, (replicates, p) each."""
    record, task = run.record, run.mission
    replicates, everything = range(record.sizes["replicate"]), np.arange(record.sizes["episode"])
    chosen = record["best_episode"].values.astype(int)
    return {
        "best episode": np.array([cramer_rao(task, record, i, chosen[i : i + 1]) for i in replicates]),
        "all samples": np.array([cramer_rao(task, record, i, everything) for i in replicates]),
    }


def table(record: xr.Dataset, found: dict[str, NDArray], bounds: dict[str, NDArray]) -> list[list[str]]:
    """Rows of text: what, true, paper, ours, 1000 times |error| and its Cramer-Rao bound."""
    rows = []
    for kind, estimates in found.items():
        for k, name in enumerate(str(name) for name in record["parameter"].values):
            true = float(record["true"][k])
            paper = f"{PAPER[name]:.4f}" if kind == "best episode" else ""
            error = spread(1e3 * np.abs(estimates[:, k] - true), 2)
            bound = f"{1e3 * np.median(bounds[kind][:, k]):.2g}"
            low, middle, high = np.percentile(estimates[:, k], [25, 50, 75])
            ours = f"{middle:.4f} [{low:.4f}, {high:.4f}]"
            rows.append([f"{name}, {kind}", f"{true:.4f}", paper, ours, error, bound])
    return rows


def _draw_estimates(axes: Axes, record: xr.Dataset, found: dict[str, NDArray]) -> None:
    """Every replicate's two estimates in the plane of mu and omega."""
    look: dict[str, Any] = {"linestyle": "", "zorder": 3, "markersize": 5}
    axes.plot(*found["best episode"].T, "o", color=style.BLUE, label="best episode", **look)
    axes.plot(*found["all samples"].T, ".", color=style.INK, label="all samples", **look)
    axes.plot(
        *(PAPER[str(name)] for name in record["parameter"].values),
        "s",
        color=style.SERIES[1],
        label="paper",
        **look,
    )
    axes.plot(*record["true"].values, "P", color=style.VERMILLION, label="true", **look)
    style.dress(axes)
    style.open_frame(axes)
    axes.margins(0.15)
    axes.locator_params(nbins=5)
    style.label(axes, "$\\mu$ [1]", "$\\omega$ [rad/time]")
    style.legend(axes)


def _draw_table(axes: Axes, rows: list[list[str]]) -> None:
    axes.axis("off")
    heads = ["", "true", "paper", "learned", "$10^3$ |error|", "$10^3$ bound"]
    widths = [0.24, 0.085, 0.085, 0.28, 0.18, 0.13]
    cells = axes.table(
        rows, colLabels=heads, colWidths=widths, loc="center", cellLoc="left", edges="horizontal"
    )
    cells.auto_set_font_size(False)
    cells.set_fontsize(style.SMALL - 1)
    cells.scale(1.0, 1.3)
    for cell in cells.get_celld().values():
        cell.set_linewidth(0.4)
        cell.PAD = 0.03


def _caption(record: xr.Dataset) -> str:
    replicates, episodes, steps = (record.sizes[name] for name in ("replicate", "episode", "step"))
    return (
        f"Table 2. Parameters of the double gyre as {replicates} replicates of {episodes} episodes of "
        f"{steps} samples learn them: the episode of least total error, as the paper reports it, and the "
        "estimate from the samples of all episodes. Median [quartiles]; bound: the Cramer-Rao bound of the "
        "standard deviation for the same samples, median over the replicates; it knows nothing of the "
        "choice of the best episode. The paper reports one run."
    )


if __name__ == "__main__":
    experiments.command(make)
