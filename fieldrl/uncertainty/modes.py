"""Modes of the likelihood: all distinct minima of the deviance, and points of the box that fit as well.

Descents begin at the estimate and at the lowest of many points that cover the box. With very many samples
the search looks at some of them first: a place that cannot explain these explains not all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.samples import Samples
from fieldrl.estimator.designs import cover
from fieldrl.estimator.problem import FitProblem
from fieldrl.estimator.surrogate.minima import apart
from fieldrl.uncertainty.deviance import Deviance, minima
from fieldrl.uncertainty.noise import Noise
from fieldrl.uncertainty.predictions import OfModel

_COVER = 9  # two to this: points of the box
_STARTS, _APART = 12, 0.1  # descents from the cover, and how far apart they begin [half-width]
_SAME = 1e-4  # minima closer than this are one [half-width]
_SCREEN = 300  # samples that the search looks at first
_HOPELESS = 100.0  # a deviance so far above the least is not worth a descent on all samples


class Modes(NamedTuple):
    """What explains the samples.

    Args:
        minima: the distinct ones, the lowest first, (k, p) [half-width].
        deviances: D there, (k,).
        box: points of the box that were looked at, (m, p); none where there are very many samples.
        box_deviances: D there, (m,).
    """

    minima: NDArray[np.float64]
    deviances: NDArray[np.float64]
    box: NDArray[np.float64]
    box_deviances: NDArray[np.float64]

    def fitting(self, bar: float) -> NDArray[np.float64]:
        """Minima with D <= bar, then the outermost points of the box with it, by unknown and side, (j, p).

        The first minimum is always among them.
        """
        lowest = self.minima[self.deviances <= max(bar, self.deviances[0])]
        points = self.box[self.box_deviances <= bar]
        if not len(points):
            return lowest
        outermost = {int(i) for i in (*points.argmin(axis=0), *points.argmax(axis=0))}
        return np.concatenate([lowest, points[sorted(outermost)]])


def modes(problem: FitProblem, noise: Noise, deviance: Deviance, estimate: NDArray[np.float64]) -> Modes:
    """Search the box for everything that explains the samples.

    Args:
        problem: what is fitted.
        noise: of the samples.
        deviance: of all samples.
        estimate: u of the fit, (p,).
    """
    box, coarse = np.array(cover(_COVER, len(estimate))), _screen(problem, noise, deviance)
    losses = coarse.at(box)
    lowest = box[apart(box, np.argsort(losses, kind="stable"), _STARTS, _APART)]
    starts = np.concatenate([estimate[None], lowest])
    if coarse is deviance:
        return Modes(*minima(deviance, starts, _SAME), box, losses)
    ends, reached = minima(coarse, starts, _SAME)
    promising = ends[reached <= reached[0] + _HOPELESS]
    return Modes(*minima(deviance, np.vstack([estimate[None], promising]), _SAME), box[:0], losses[:0])


def _screen(problem: FitProblem, noise: Noise, deviance: Deviance) -> Deviance:
    """The deviance of evenly spread samples, where there are many of them and the model is cheap."""
    samples = problem.samples
    if len(samples) <= _SCREEN or not isinstance(deviance.predictions, OfModel):
        return deviance
    some = np.linspace(0, len(samples) - 1, _SCREEN).astype(int)
    few = Samples.of(samples.positions[some], samples.times[some], samples.values[some])
    censored = None if samples.censored is None else samples.censored[some]
    return Deviance(OfModel(problem.model, few), few.values, noise.std[some], censored)
