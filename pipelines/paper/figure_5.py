"""Figure 5: the feature spreads under the double gyre, with streamlines, at several times.

python -m pipelines.paper.figure_5 [scale=small]

Takes seconds, and its run four minutes.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from fieldrl.figures import maps, style
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres

_PANELS = 6


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run whose true field is drawn."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, solve the true field at the times, draw."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    fields = true_fields(settings, run)
    norm = Normalize(*maps.value_range(fields))
    drawing = style.figure(style.PAGE, 3.0, layout="compressed")
    panels = drawing.subplots(2, _PANELS // 2, sharex=True, sharey=True)
    image = None
    for number, axes in enumerate(panels.flat):
        style.dress(axes)
        maps.prepare(axes, run.record, first=number % panels.shape[1] == 0)
        if number < panels.shape[1]:
            axes.set_xlabel("")
        image = maps.draw_field(axes, fields.isel(time=number), norm)
        time = float(fields.time[number])
        draw_streamlines(axes, run, time)
        axes.axvline(float(gyres.line_of(run, time)), color=style.INK, linewidth=0.8, linestyle=(0, (4, 2)))
        style.title(axes, f"$t$ = {time:g}")
    for axes in panels[:, -1]:
        style.colour_bar(image, axes, maps.bar_label(run.record, "$f$"))
    numbers = {"times": fields.time.values, **spread(fields)}
    artefacts.save(settings, "figure_5", drawing, _caption(numbers), [run], numbers)


def true_fields(settings: Settings, run: Found) -> xr.DataArray:
    """The true field at equal times from 0 to the end of an episode, (time, x, y)."""
    times = np.linspace(0.0, float(run.record["time"].max()), _PANELS)
    true = run.record["true"].values
    return gyres.fields(
        settings, run, "figure_5", [true] * _PANELS, times, True, 48 if settings.small else 240
    )


def spread(fields: xr.DataArray) -> dict[str, NDArray[np.float64]]:
    """Total, peak and root mean square distance from the centre of mass at each time."""
    mass = fields.sum(("x", "y"))
    x, y = ((fields * fields[axis]).sum(("x", "y")) / mass for axis in ("x", "y"))
    square = ((fields * ((fields.x - x) ** 2 + (fields.y - y) ** 2)).sum(("x", "y")) / mass).values
    cell = float((fields.x[1] - fields.x[0]) * (fields.y[1] - fields.y[0]))
    return {
        "mass": mass.values * cell,
        "peak": fields.max(("x", "y")).values,
        "radius": np.sqrt(np.maximum(square, 0.0)),
    }


def draw_streamlines(axes: Axes, run: Found, time: float) -> None:
    """Streamlines of the true flow at a time."""
    flow, true = run.mission.water.flow, run.record["true"].values
    (x0, y0), (x1, y1) = run.record.attrs["domain_lower"], run.record.attrs["domain_upper"]
    x, y = np.linspace(x0, x1, 41), np.linspace(y0, y1, 21)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    u, v = flow.velocity(true, places, time).reshape(y.size, x.size, 2).transpose(2, 0, 1)  # type: ignore[attr-defined]
    look = {"color": style.GREY, "linewidth": 0.4, "arrowsize": 0.5, "density": 0.7}
    axes.streamplot(x, y, u, v, **look)


def _caption(numbers: dict) -> str:
    return (
        "Figure 5. The true feature under the double gyre (mu = 0.25, omega = pi/5) at several times, with "
        "the streamlines of the moment and the line that separates the gyres (dashed). Its root mean square "
        f"radius goes from {numbers['radius'][0]:.1f} to {numbers['radius'][-1]:.1f} length units, its peak "
        f"from {numbers['peak'][0]:.0f} to {numbers['peak'][-1]:.0f} field units."
    )


if __name__ == "__main__":
    experiments.command(make)
