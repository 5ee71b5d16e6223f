"""An episode under the double gyre as an animation: the vehicle, the true field and what is believed of it.

python -m pipelines.paper.animation [scale=small]

Writes animation.gif and, as animation.png and .pdf, its last frame.

Takes seconds, and its run four minutes.
"""

from __future__ import annotations

import io

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fieldrl.figures import maps, style
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres

_FRAMES = {"paper": 4, "small": 1}  # for each time unit
_MILLISECONDS = 160  # between frames
_LAST = 1500  # of the last frame [ms]
_DPI = 110
_COLOURS = 96


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run of table 2."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, solve the fields between its samples, write the animation."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    episode = int(run.record["best_episode"][0])
    scene = Scene(settings, run, episode)
    frames = [scene.frame(number) for number in range(len(scene.times))]
    artefacts.put(settings, "animation.gif", gif(frames))
    numbers = {"episode": episode + 1, "times": scene.times, "theta": scene.believed, "rms": scene.rms}
    caption = (
        f"Episode {episode + 1} of replicate 0 (its best) of the run of table 2: the true feature, and the "
        "one that the estimate of the moment predicts; before the first sample, the centre of the bounds. "
        "Dashed: the line between the gyres."
    )
    artefacts.save(
        settings, "animation", scene.drawing, caption, [run], numbers, moving="animation.gif",
    )  # fmt: skip


class Scene:
    """The two maps of the animation, drawn anew for each frame.

    Args:
        settings: where the fields are kept.
        run: of the double gyre.
        episode: which one of replicate 0.
    """

    def __init__(self, settings: Settings, run: Found, episode: int) -> None:
        self.run, self.record = run, run.record.isel(replicate=0, episode=episode)
        last = float(self.record["time"].max())
        self.times = np.linspace(0.0, last, round(last * _FRAMES[settings.scale]) + 1)
        true, cells = run.record["true"].values, 48 if settings.small else 160
        self.believed = beliefs(self.record, self.times, run)
        everywhere = [true] * len(self.times)
        self.true = gyres.fields(settings, run, "animation_true", everywhere, self.times, True, cells)
        self.estimate = gyres.fields(
            settings, run, "animation_estimate", list(self.believed), self.times, False, cells
        )
        self.rms = np.sqrt(((self.estimate - self.true) ** 2).mean(("x", "y")).values)
        self.drawing = style.figure(*maps.size(run.record, 2, beside=1.2, above=0.6), layout="compressed")
        self.panels = style.panels(self.drawing, 2, shared=True)
        self.norm = Normalize(*maps.value_range(self.true))

    def frame(self, number: int) -> Image.Image:
        """The picture at a time."""
        time = float(self.times[number])
        for axes, fields, first in zip(self.panels, (self.true, self.estimate), (True, False), strict=True):
            axes.clear()
            maps.prepare(axes, self.run.record, first=first)
            image = maps.draw_field(axes, fields.isel(time=number), self.norm)
            axes.axvline(
                float(gyres.line_of(self.run, time)), color=style.INK, linewidth=0.8, linestyle=(0, (4, 2))
            )
            self._draw_vehicle(axes, time)
        style.title(self.panels[0], f"True, $t$ = {time:.2f}")
        mu, omega = self.believed[number]
        style.title(
            self.panels[1],
            f"Believed, $\\mu$ = {mu:.3f}, $\\omega$ = {omega:.3f}, rms {self.rms[number]:.2g}",
        )
        style.colour_bar(image, self.panels[1], maps.bar_label(self.run.record, "$f$"))
        return picture(self.drawing, steady=number > 0)

    def _draw_vehicle(self, axes: Axes, time: float) -> None:
        """The path so far; samples as dots, the vehicle as a diamond."""
        times = np.append(0.0, self.record["time"].values)
        places = np.vstack(
            [self.run.record["start"].values, self.record["position"].transpose("step", "axis").values]
        )
        x, y = (np.interp(time, times, places[:, axis]) for axis in (0, 1))
        past = places[times <= time]
        axes.plot(*np.vstack([past, [x, y]]).T, color=style.INK, linewidth=0.8, zorder=4)
        axes.plot(*past[1:].T, "o", color=style.INK, markersize=2.6, zorder=5)
        axes.plot(x, y, "D", color=style.VERMILLION, markersize=5, markeredgecolor="white", zorder=6)


def beliefs(episode: xr.Dataset, times: NDArray, run: Found) -> NDArray[np.float64]:
    """The estimate that is held at each time, (k, p): from the last sample, or the centre of the bounds."""
    centre = run.mission.water.parameters.centre
    theta = np.vstack([centre, episode["theta"].transpose("step", "parameter").values])
    taken = np.searchsorted(episode["time"].values, times + 1e-9, side="right")
    return theta[taken]


def picture(drawing: Figure, steady: bool) -> Image.Image:
    """The figure as an image; ``steady`` keeps the layout that it has."""
    if steady:
        drawing.set_layout_engine("none")
    content = io.BytesIO()
    drawing.savefig(content, format="png", dpi=_DPI)
    return Image.open(content).convert("RGB")


def gif(frames: list[Image.Image]) -> bytes:
    """An animated GIF that repeats; all frames share one set of colours."""
    palette = _together(frames[:: max(1, len(frames) // 4)]).quantize(_COLOURS, dither=Image.Dither.NONE)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [_MILLISECONDS] * (len(small) - 1) + [_LAST]
    content = io.BytesIO()
    small[0].save(content, "GIF", save_all=True, append_images=small[1:], duration=durations, loop=0)
    return content.getvalue()


def _together(frames: list[Image.Image]) -> Image.Image:
    """Frames side by side, and as much of the vehicle's colour, which is rare, as one of them."""
    width, height = frames[0].size
    sheet = Image.new("RGB", (width * (len(frames) + 1), height), style.VERMILLION)
    for number, frame in enumerate(frames):
        sheet.paste(frame, (number * width, 0))
    return sheet


if __name__ == "__main__":
    experiments.command(make)
