"""What the samples tell and what not, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fieldrl.uncertainty.assessment import Assessment
from fieldrl.uncertainty.identifiability import at_bounds, combination

_MOST = 4  # solutions that are listed


def verdict(assessed: Assessment) -> str:
    """Sentences that a reader of the numbers must know: what is told, what is not, what is wrong."""
    return " ".join(_sentences(assessed))


def _sentences(assessed: Assessment) -> Iterator[str]:
    yield from _of_solutions(assessed)
    yield from _of_unknowns(assessed)
    yield from _of_combination(assessed)
    yield from _of_bounds(assessed)
    yield from _of_the_fit(assessed)


def _of_solutions(assessed: Assessment) -> Iterator[str]:
    if assessed.surpassed:
        best = _values(assessed.solutions[0], _precision(assessed))
        yield f"The estimate is not the best: {_names(assessed)} = {best} fits better."
    several = assessed.solutions
    if len(several) > 1:
        listed = " and ".join(_values(one, _precision(assessed)) for one in several[:_MOST])
        count = {2: "Two", 3: "Three", 4: "Four"}.get(len(several), str(len(several)))
        yield f"{count} solutions fit: {_names(assessed)} = {listed}{' ...' if len(several) > _MOST else ''}."


def _of_unknowns(assessed: Assessment) -> Iterator[str]:
    names, told = assessed.parameters.names, assessed.identified
    if told.all():
        yield f"Told by the samples: {', '.join(_interval(assessed, k) for k in range(len(names)))}."
        return
    for k in np.flatnonzero(told):
        yield f"{_interval(assessed, int(k))} is told by the samples."
    for k in np.flatnonzero(~told):
        parts = " and in ".join(f"({short(low)}, {short(high)})" for low, high in assessed.pieces[k])
        yield f"{names[k]} is not told by these samples: every value in {parts} fits as well."


def _of_combination(assessed: Assessment) -> Iterator[str]:
    found = combination(assessed.axes, assessed.parameters)
    if found is None:
        return
    names, text = assessed.parameters.names, ""
    for k in np.flatnonzero(np.abs(found.weights) > 1e-12):
        weight = found.weights[k]
        sign = ("" if weight > 0 else "-") if not text else (" + " if weight > 0 else " - ")
        times = f"{abs(weight):.2g} "
        text += f"{sign}{'' if times == '1 ' else times}{names[k]}"
    other = f"{found.other:.1g}" if math.isfinite(found.other) else "nothing"
    yield f"{text} is known to {found.std:.1g}, the other direction to {other}."


def _of_bounds(assessed: Assessment) -> Iterator[str]:
    parameters = assessed.parameters
    for k, (low, high) in enumerate(at_bounds(assessed.profile)):
        if not assessed.identified[k] or not (low or high):
            continue
        side, value = ("lower", parameters.lower[k]) if low else ("upper", parameters.upper[k])
        yield f"The interval of {parameters.names[k]} ends at its {side} bound {value:g}."


def _of_the_fit(assessed: Assessment) -> Iterator[str]:
    found = assessed.misfit
    if not assessed.noise_known:
        size = float(np.sqrt(np.mean(assessed.noise**2))) if len(assessed.noise) else math.inf
        if math.isfinite(size):
            yield f"The noise was not known; the residuals say {short(size)}."
        else:
            yield "The noise is not known, and there are too few samples to estimate it."
    if not found.wrong:
        return
    chi = 2.0 * min(found.p_large, found.p_small)
    tests = {"size": chi, "runs": found.p_runs, "outlier": found.p_outlier}
    cause = min((name for name in tests if math.isfinite(tests[name])), key=lambda name: tests[name])
    yield f"{_cause(found, cause)} (p = {found.p:.1g}): {_remedy(found, cause)}."


def _cause(found, cause: str) -> str:
    if cause == "runs":
        return "Residuals that follow each other have the same sign too often"
    if cause == "outlier":
        return f"Sample {found.outlier + 1} is far off"
    return f"The squared residuals sum up to {found.chi_square:.3g} where {found.expected:.3g} is expected"


def _remedy(found, cause: str) -> str:
    if cause == "outlier":
        return "an outlier, or the model is wrong there"
    if cause == "size" and found.p_small < found.p_large:
        return "the stated noise is too large"
    return "the model or the stated noise is wrong, and the intervals with them"


def _names(assessed: Assessment) -> str:
    names = assessed.parameters.names
    return names[0] if len(names) == 1 else f"({', '.join(names)})"


def _values(theta: NDArray, precision: NDArray) -> str:
    texts = [rounded(value, spread) for value, spread in zip(theta, precision, strict=True)]
    return texts[0] if len(texts) == 1 else f"({', '.join(texts)})"


def _precision(assessed: Assessment) -> NDArray[np.float64]:
    """How far each unknown is known, (p,)."""
    return np.minimum(assessed.std, assessed.parameters.half_width)


def _interval(assessed: Assessment, k: int) -> str:
    (low, high), name = assessed.interval[k], assessed.parameters.names[k]
    spread = (high - low) / 4
    value, low, high = (rounded(x, spread) for x in (assessed.estimate[k], low, high))
    return f"{name} = {value} ({low} to {high})"


def rounded(value: float, spread: float) -> str:
    """``value`` with as many digits as its ``spread`` allows: two of its own."""
    if not (math.isfinite(spread) and spread > 0):
        return f"{value:.4g}"
    digits = 1 - math.floor(math.log10(spread))
    return f"{value:.{min(max(digits, 0), 12)}f}"


def short(value: float) -> str:
    """Three significant digits."""
    return f"{value:.3g}"
