"""Two sources in the plane: the model of ``location_finding``, and what measurements tell of it.

| symbol | meaning | shape | unit |
|---|---|---|---|
| z | coordinates of the sources x_1, y_1, x_2, y_2, each N(0, 1) | (m, 4) | length |
| theta | their levels Phi(z), the unknowns: uniform on (0, 1) | (m, 4) | 1 |
| xi | sensors | (n, 2) | length |
| mu | log(b + sum over sources of 1 / (c + |z_k - xi|^2)), b = 0.1, c = 1e-4 | (m, n) | log of a signal |
| sigma | noise of a value, 0.5 | | log of a signal |

The information that n values h tell of z is bracketed in expectation, with L contrasts z_l from the prior:

    sPCE = log p(h | z) - log((p(h | z) + sum of p(h | z_l)) / (L + 1))  <=  log(L + 1)
    sNMC = log p(h | z) - log(sum of p(h | z_l) / L)

With contrasts from another density q(. ; h), each p(h | .) in the sums counts w = prior / q times: sACE and
sVNMC, which have no such limit. Task, model and all four: Foster, Ivanova, Malik and Rainforth 2021, "Deep
Adaptive Design", arXiv 2103.02438.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtr, ndtri

from fieldrl.core.compiled import MODEL
from fieldrl.core.parameters import Parameters

NOISE = 0.5
UNKNOWNS = 4
_BASE, _CORE = 0.1, 1e-4  # b, c
_OUTSIDE = 1e-6  # probability beyond each bound
_SWAPPED = [2, 3, 0, 1]
_SHARE, _SCALES = 0.25, (1.0, 2.0, 4.0)  # of the prior in q; how wide the normals in it are
_ROOT_2_PI = math.sqrt(2.0 * math.pi)


class Sources:
    """The model, in levels; also one with derivatives, and compiled."""

    parameters = Parameters(
        names=("x_1", "y_1", "x_2", "y_2"),
        units=("1",) * UNKNOWNS,
        lower=(_OUTSIDE,) * UNKNOWNS,
        upper=(1.0 - _OUTSIDE,) * UNKNOWNS,
    )
    constants = np.empty(0)

    @property
    def kernel(self) -> int:
        """Address of the compiled MODEL function."""
        return int(_model.address or 0)

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """mu at levels theta (m, 4) and sensors (n, 2); times (n,) play no part. (m, n)."""
        return self._evaluate(theta, positions)[0]

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Derivatives of mu by the levels, (m, n, 4)."""
        return self._evaluate(theta, positions)[1]

    def _evaluate(self, theta: NDArray, positions: NDArray) -> tuple[NDArray, NDArray]:
        mu = np.empty((len(theta), len(positions)))
        slopes = np.empty((*mu.shape, UNKNOWNS))
        _means_and_slopes(np.ascontiguousarray(theta), np.ascontiguousarray(positions), mu, slopes)
        return mu, slopes


def places(theta: NDArray) -> NDArray[np.float64]:
    """The coordinates z of levels."""
    return ndtri(theta)


def levels(z: NDArray) -> NDArray[np.float64]:
    """The levels theta of coordinates."""
    return ndtr(z)


def means(z: NDArray, sensors: NDArray) -> NDArray[np.float64]:
    """mu at coordinates z (m, 4) and sensors (n, 2), (m, n)."""
    dx = np.stack([z[:, None, 0::2] - sensors[:, 0, None], z[:, None, 1::2] - sensors[:, 1, None]])
    return np.log(_BASE + np.sum(1.0 / (_CORE + np.sum(dx**2, axis=0)), axis=-1))


def log_likelihoods(z: NDArray, sensors: NDArray, values: NDArray) -> NDArray[np.float64]:
    """log p(h | z) of coordinates (m, 4), less what they have in common, (m,)."""
    found = np.empty(len(z))
    _log_likelihoods(np.ascontiguousarray(z), np.ascontiguousarray(sensors), values, found)
    return found


def slopes_at(z: NDArray, sensors: NDArray) -> NDArray[np.float64]:
    """Derivatives of mu by the coordinates z (m, 4), (m, n, 4)."""
    stretch = np.sqrt(2.0 * np.pi) * np.exp(0.5 * z**2)  # dz / dtheta
    return Sources().jacobian(levels(z), sensors, np.empty(0)) / stretch[:, None]


def log_prior(z: NDArray) -> NDArray[np.float64]:
    """Log density of coordinates (m, 4), (m,)."""
    return -0.5 * np.sum(z**2, axis=1) - 0.5 * UNKNOWNS * math.log(2.0 * math.pi)


def bounds(of_truth: float, of_contrasts: NDArray, weight: float = 0.0) -> tuple[float, float]:
    """Lower and upper bound, in expectation, of the information [nat].

    Args:
        of_truth: log p(h | z).
        of_contrasts: log(w p(h | .)) of L contrasts, (L,).
        weight: log w of the truth.
    """
    count, others = len(of_contrasts), float(np.logaddexp.reduce(of_contrasts))
    lower = of_truth - float(np.logaddexp(of_truth + weight, others)) + math.log(count + 1)
    return lower, of_truth - others + math.log(count)


class Near:
    """The density q: a quarter the prior, the rest normal about what explains the values, in either order.

    Args:
        z: coordinates that do, (k, 4).
        sensors: of the values, (n, 2).
    """

    def __init__(self, z: NDArray, sensors: NDArray) -> None:
        centres = np.concatenate([z, z[:, _SWAPPED]])
        slopes = slopes_at(centres, sensors) / NOISE
        information = np.eye(UNKNOWNS) + np.swapaxes(slopes, 1, 2) @ slopes
        roots = np.linalg.cholesky(np.linalg.inv(information))
        self.centres = np.repeat(centres, len(_SCALES), axis=0)
        self.roots = np.concatenate([[scale * root for scale in _SCALES] for root in roots])

    def drawn(self, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Coordinates, (count, 4)."""
        z = rng.standard_normal((count, UNKNOWNS))
        about = rng.integers(len(self.centres), size=count)
        moved = self.centres[about] + np.einsum("mij,mj->mi", self.roots[about], z)
        return np.where(rng.random((count, 1)) < _SHARE, z, moved)

    def log_weight(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log of prior / q at coordinates (m, 4), (m,)."""
        prior = log_prior(z)
        parts = [math.log(_SHARE) + prior]
        share = math.log((1.0 - _SHARE) / len(self.centres))
        for centre, root in zip(self.centres, self.roots, strict=True):
            u = np.linalg.solve(root, (z - centre).T).T
            parts.append(share + log_prior(u) - np.log(np.diag(root)).sum())
        return prior - logsumexp(parts, axis=0)


def distance(z: NDArray, other: NDArray) -> float:
    """Root mean square distance of two sources from two others, in the better order [length]."""
    return math.sqrt(min(np.sum((other - one) ** 2) / 2 for one in (z, z[_SWAPPED])))


@njit(cache=True, error_model="numpy")
def _log_likelihoods(z, sensors, values, found):
    for i in range(len(z)):
        total = 0.0
        for j in range(len(values)):
            x, y = sensors[j, 0], sensors[j, 1]
            near = 1.0 / (_CORE + (z[i, 0] - x) ** 2 + (z[i, 1] - y) ** 2)
            far = 1.0 / (_CORE + (z[i, 2] - x) ** 2 + (z[i, 3] - y) ** 2)
            total += (math.log(_BASE + near + far) - values[j]) ** 2
        found[i] = -0.5 * total / NOISE**2


@njit(cache=True, error_model="numpy")
def _quantile(p):
    """z with Phi(z) = p: Shore's approximation, then Halley's method; exact to rounding from 1e-6 on."""
    odds = min(p, 1.0 - p) / max(p, 1.0 - p)
    z = -5.5556 * (1.0 - odds**0.1186)
    for _ in range(3):
        step = (0.5 * math.erfc(-z / math.sqrt(2.0)) - min(p, 1.0 - p)) * _ROOT_2_PI * math.exp(0.5 * z * z)
        z -= step / (1.0 + 0.5 * step * z)
    return z if p < 0.5 else -z


@njit(cache=True, error_model="numpy")
def _means_and_slopes(theta, sensors, mu, slopes):
    z, stretch = np.empty(4), np.empty(4)
    for i in range(len(theta)):
        for k in range(4):
            z[k] = _quantile(theta[i, k])
            stretch[k] = _ROOT_2_PI * math.exp(0.5 * z[k] * z[k])  # dz / dtheta
        for j in range(len(sensors)):
            total = _BASE
            for k in range(0, 4, 2):
                dx, dy = z[k] - sensors[j, 0], z[k + 1] - sensors[j, 1]
                signal = 1.0 / (_CORE + dx * dx + dy * dy)
                total += signal
                slopes[i, j, k] = -2.0 * signal * signal * dx * stretch[k]
                slopes[i, j, k + 1] = -2.0 * signal * signal * dy * stretch[k + 1]
            mu[i, j] = math.log(total)
            for k in range(4):
                slopes[i, j, k] /= total


@cfunc(MODEL, cache=True)
def _model(theta, m, positions, times, n, constants, prediction, jacobian):
    _means_and_slopes(
        carray(theta, (m, 4)),
        carray(positions, (n, 2)),
        carray(prediction, (m, n)),
        carray(jacobian, (m, n, 4)),
    )
