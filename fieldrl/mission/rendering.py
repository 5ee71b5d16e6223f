"""What an environment shows: the true field now, obstacles, samples, the vehicle and its heading.

A picture is rows of pixels from the top, (height, width, 3), 8 bits; the longer side has ``SIDE`` of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Domain, Grid

Field = Callable[[Grid], NDArray[np.float64]]

SIDE = 400
_CELLS = 100  # of the field along the longer side
_STOPS = np.array([(247, 251, 255), (158, 202, 225), (66, 146, 198), (8, 69, 148), (4, 25, 60)], dtype=float)
_INK, _OBSTACLE, _VEHICLE = (34, 34, 34), (140, 140, 140), (213, 94, 0)  # Okabe and Ito's vermillion
_DOT, _BODY, _NOSE = 2.5, 5.0, 12.0  # radii and length [pixel]


def picture(domain: Domain, field: Field, positions: NDArray, state: NDArray) -> NDArray[np.uint8]:
    """A domain as it is now.

    Args:
        domain: its sides and obstacles.
        field: of a grid, (nx, ny) [field unit].
        positions: of the samples, (n, 2) [length].
        state: of the vehicle: x, y, heading, (3,) [length, length, rad].
    """
    scale = SIDE / max(np.subtract(domain.upper, domain.lower))
    width, height = np.maximum(1, np.round(np.subtract(domain.upper, domain.lower) * scale)).astype(int)
    image = _coloured(domain, field, int(width), int(height))
    points = domain.grid(int(width), int(height)).points
    for shape in domain.obstacles:
        image[shape.contains(points).reshape(width, height)] = _OBSTACLE
    places = (positions - np.array(domain.lower)) * scale
    for place in places:
        _disc(image, place, _DOT, _INK)
    x, y, heading = state
    at, ahead = (np.array([x, y]) - domain.lower) * scale, np.array([np.cos(heading), np.sin(heading)])
    for step in np.linspace(0, _NOSE, 25):
        _disc(image, at + step * ahead, 1.0, _VEHICLE)
    _disc(image, at, _BODY, _VEHICLE)
    return np.ascontiguousarray(image.transpose(1, 0, 2)[::-1])


def _coloured(domain: Domain, field: Field, width: int, height: int) -> NDArray[np.uint8]:
    """The field's colours, (width, height, 3), x first and y upwards."""
    nx, ny = (max(1, round(_CELLS * n / max(width, height))) for n in (width, height))
    values = np.nan_to_num(field(domain.grid(nx, ny)), nan=0.0)
    low, high = min(values.min(), 0.0), max(values.max(), 1e-12)
    cells = (values - low) / (high - low) * (len(_STOPS) - 1)
    stops = np.arange(len(_STOPS))
    colours = np.stack([np.interp(cells, stops, channel) for channel in _STOPS.T], axis=-1).astype(np.uint8)
    across, along = (np.arange(n) * cells // n for n, cells in ((width, nx), (height, ny)))
    return colours[across][:, along]


def _disc(image: NDArray[np.uint8], place: NDArray, radius: float, colour: tuple[int, int, int]) -> None:
    """Draw a disc round a place [pixel], which may lie at the edge."""
    reach = int(np.ceil(radius))
    i, j = (int(np.floor(value)) for value in place)
    for x in range(max(i - reach, 0), min(i + reach + 1, image.shape[0])):
        for y in range(max(j - reach, 0), min(j + reach + 1, image.shape[1])):
            if (x + 0.5 - place[0]) ** 2 + (y + 0.5 - place[1]) ** 2 <= radius**2:
                image[x, y] = colour


class Window:
    """A window of matplotlib's that shows pictures one after the other.

    Args:
        pyplot: matplotlib.pyplot.

    Raises:
        FieldrlError: its backend has no windows.
    """

    def __init__(self, pyplot: Any = None) -> None:
        if pyplot is None:
            from matplotlib import pyplot
        if pyplot.get_backend().lower() in ("agg", "pdf", "ps", "svg", "cairo", "template", "pgf"):
            problem = f"render_mode=human: matplotlib's backend {pyplot.get_backend()} shows no windows"
            raise FieldrlError(f"{problem}; use render_mode=rgb_array, or another backend (MPLBACKEND)")
        self.pyplot, self.figure, self.shown = pyplot, pyplot.figure("fieldrl"), None

    def show(self, image: NDArray[np.uint8]) -> None:
        """Show a picture and let the window react."""
        if self.shown is None:
            axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set_axis_off()
            self.shown = axes.imshow(image)
            self.pyplot.show(block=False)
        self.shown.set_data(image)
        self.pyplot.pause(0.001)

    def close(self) -> None:
        """Close it."""
        self.pyplot.close(self.figure)
