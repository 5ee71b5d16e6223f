"""The performance profile: the share of problems that a method has solved, against the solves it took."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fieldrl.figures import style
from fieldrl.runs.atomic import write

_COLOURS = (style.VERMILLION, style.BLUE, "#56B4E9", "#009E73", style.GREY, "#CC79A7", "#E69F00")
_LIMIT = 150


def draw(needed: Mapping[str, Sequence[float | None]], path: Path) -> Path:
    """Draw the profile.

    Args:
        needed: for each method, the solves that each problem took, None where it was not solved.
        path: where to, ending in .png.

    Returns:
        The path.
    """
    import io

    drawing = style.figure(style.PAGE * 0.7, 2.8)
    axes = style.panels(drawing, 1)[0]
    for (name, solves), colour in zip(needed.items(), _COLOURS, strict=False):
        reached = np.sort([float("inf") if one is None else one for one in solves])
        share = np.arange(1, len(reached) + 1) / len(reached)
        done = np.isfinite(reached)
        x = np.concatenate([[1.0], reached[done], [_LIMIT]])
        y = np.concatenate([[0.0], share[done], [share[done][-1] if done.any() else 0.0]])
        axes.step(x, 100 * y, where="post", color=colour, linewidth=1.4, label=name)
    axes.set(xscale="log", xlim=(3, _LIMIT), ylim=(0, 102))
    axes.set_xticks([3, 5, 10, 20, 50, 100], labels=["3", "5", "10", "20", "50", "100"])
    axes.set_xlabel("forward solves", fontsize=style.TEXT)
    axes.set_ylabel("problems within 1 % of the minimum [%]", fontsize=style.TEXT)
    axes.legend(fontsize=style.SMALL, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    content = io.BytesIO()
    drawing.savefig(content, format="png", dpi=style.DPI, metadata={"Software": None})
    write(path, content.getvalue())
    return path
