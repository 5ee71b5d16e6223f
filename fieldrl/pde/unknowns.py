"""Unknowns by name: which scalars of a model are to be found, and its parts at values of them.

The names are flat: those of the flow's parameters, of the model's own numbers, and of the source's and the
initial feature's (``LocalisedSource.scalars``, ``InitialFeature.scalars``). What is not named stays as it is.

| symbol | meaning | shape | unit |
|---|---|---|---|
| theta | the unknowns, in the order flow, model, source, initial feature | (p,) | each its own |
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.parameters import Parameters, known

_KEYS = ("true", "lower", "upper")


class Scalar(NamedTuple):
    """A number of a model.

    Args:
        part: where it is: "flow", "source", "initial", or a name of the model's own.
        field: of the part, or the number of the flow's parameter; "" for the model's own.
        place: which item of the field, or None where that is a number.
        unit: of it.
    """

    part: str
    field: str | int
    place: int | None
    unit: str


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns of a model.

    Args:
        parameters: their names, units, bounds and true values.
        scalars: what each is, (p,).
        flow: the flow's parameters where they are not unknown, NaN where they are, (k,).
        parts: the model's source, initial feature and own numbers as they are configured, by name.
    """

    parameters: Parameters
    scalars: tuple[Scalar, ...]
    flow: tuple[float, ...]
    parts: Mapping[str, Any]

    @cached_property
    def of_flow_alone(self) -> bool:
        """Whether nothing but the flow depends on them."""
        return all(scalar.part == "flow" for scalar in self.scalars)

    @cached_property
    def _of_flow(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Places among the unknowns and among the flow's parameters."""
        pairs = [(i, scalar.field) for i, scalar in enumerate(self.scalars) if scalar.part == "flow"]
        table = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        return table[:, 0], table[:, 1]

    def flow_parameters(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The flow's parameters, (k,), at theta (p,)."""
        values, (here, there) = np.array(self.flow), self._of_flow
        values[there] = np.asarray(theta)[here]
        return values

    def parts_at(self, theta: NDArray[np.float64]) -> dict[str, Any]:
        """The model's parts at theta (p,); raises InvalidValue where one refuses its value."""
        parts, fields = dict(self.parts), {}
        for scalar, value in zip(self.scalars, np.asarray(theta).tolist(), strict=True):
            if scalar.part == "flow":
                continue
            if not scalar.field:
                parts[scalar.part] = value
                continue
            changed = fields.setdefault(scalar.part, {})
            old = changed.get(scalar.field, getattr(parts[scalar.part], str(scalar.field)))
            changed[scalar.field] = value if scalar.place is None else _with(old, scalar.place, value)
        return parts | {part: replace(parts[part], **values) for part, values in fields.items()}


def unknowns(
    given: Mapping[str, Any] | None,
    flow: Any,
    bounds: tuple[Sequence[float | None], Sequence[float], Sequence[float]],
    own: Mapping[str, tuple[float, str]],
    **parts: Any,
) -> Unknowns:
    """The unknowns that a configuration names.

    Args:
        given: {name: {true, lower, upper}}, true optional; None or empty: the flow's parameters.
        flow: has names and units.
        bounds: true values (None where unknown), lower and upper bounds of the flow's parameters.
        own: the model's own numbers and their units, by name.
        parts: source and initial feature, or None.

    Raises:
        InvalidValue: with the key below ``unknown``.
    """
    everything = {name: value for name, (value, _) in own.items()} | parts
    true, lower, upper = bounds
    if not given:
        parameters = Parameters(flow.names, flow.units, tuple(lower), tuple(upper), known(true))
        scalars = tuple(Scalar("flow", i, None, unit) for i, unit in enumerate(flow.units))
        return Unknowns(parameters, scalars, (math.nan,) * len(scalars), everything)
    offered = _offered(flow, own, parts)
    for name, value in given.items():
        if (parts_of := _parts_with(name, flow, own, parts)) and len(parts_of) > 1:
            rule = f"is the name of two numbers, one of the {parts_of[0]}'s and one of the {parts_of[1]}'s"
            raise checks.InvalidValue(f"unknown.{name}", value, rule, remedy="rename the flow's parameter")
        if name not in offered:
            remedy = f"what may be unknown here: {', '.join(offered)}"
            raise checks.InvalidValue(f"unknown.{name}", value, "no such number", "", remedy)
    names = tuple(name for name in offered if name in given)
    rows = [_row(name, given[name], offered[name].unit) for name in names]
    columns = (tuple(column) for column in zip(*rows, strict=True))
    lower, upper, true_values = columns
    units = tuple(offered[name].unit for name in names)
    fixed = _fixed(flow, true, names)
    return Unknowns(
        Parameters(names, units, lower, upper, true_values),
        tuple(offered[name] for name in names),
        fixed,
        everything,
    )


def _offered(flow: Any, own: Mapping[str, Any], parts: Mapping[str, Any]) -> dict[str, Scalar]:
    """What may be unknown, by name."""
    offered = {
        name: Scalar("flow", i, None, unit)
        for i, (name, unit) in enumerate(zip(flow.names, flow.units, strict=True))
    }
    for name, (_, unit) in own.items():
        offered.setdefault(name, Scalar(name, "", None, unit))
    for part, component in parts.items():
        for name, (field, place, unit) in getattr(component, "scalars", {}).items():
            offered.setdefault(name, Scalar(part, field, place, unit))
    return offered


def _parts_with(name: str, flow: Any, own: Mapping[str, Any], parts: Mapping[str, Any]) -> list[str]:
    """What has a number of that name."""
    having = {"flow": flow.names, "model": own}
    having |= {part: getattr(component, "scalars", {}) for part, component in parts.items()}
    return [part for part, names in having.items() if name in names]


def _row(name: str, given: Any, unit: str) -> tuple[float, float, float]:
    """(lower, upper, true) of an unknown, true NaN where it is not told."""
    key = f"unknown.{name}"
    if not isinstance(given, Mapping) or not {"lower", "upper"} <= set(given) <= set(_KEYS):
        raise checks.InvalidValue(
            key, given, "must be {true: .., lower: .., upper: ..}; true may be left out"
        )
    lower, upper = (checks.number(f"{key}.{side}", given[side], unit) for side in ("lower", "upper"))
    (true,) = checks.truth(f"{key}.true", [given.get("true")], 1, unit)
    if not lower < upper:
        raise checks.InvalidValue(f"{key}.upper", upper, f"must exceed lower={lower:g}", unit)
    if true is not None and not lower < true < upper:
        raise checks.InvalidValue(
            f"{key}.true", true, f"must lie between lower={lower:g} and upper={upper:g}"
        )
    return lower, upper, math.nan if true is None else true


def _fixed(flow: Any, true: Sequence[float | None], names: Sequence[str]) -> tuple[float, ...]:
    """The flow's parameters that are not unknown, NaN for the others."""
    for name, value in zip(flow.names, true, strict=True):
        if name not in names and value is None:
            rule = f"{name} is not among the unknowns and needs its value here"
            raise checks.InvalidValue("true", list(true), rule)
    pairs = zip(flow.names, known(true), strict=True)
    return tuple(math.nan if name in names else value for name, value in pairs)


def _with(values: Sequence[float], place: int, value: float) -> tuple[float, ...]:
    """The values with one of them changed."""
    return tuple(value if i == place else old for i, old in enumerate(values))


def check_sides(found: Unknowns) -> None:
    """Raises InvalidValue, with the key below ``unknown``, where a part refuses bounds of its unknowns."""
    parameters = found.parameters
    sides = np.array([parameters.lower, parameters.upper])
    own = [i for i, scalar in enumerate(found.scalars) if scalar.part != "flow"]
    single = [(i, side) for i in own for side in (0, 1)]
    for i, side in single:
        theta = parameters.centre.copy()
        theta[i] = sides[side, i]
        _check(found, theta, f"{parameters.names[i]}.{('lower', 'upper')[side]}", float(theta[i]))
    for part in {found.scalars[i].part for i in own}:
        of_part = [i for i in own if found.scalars[i].part == part]
        for corner in itertools.product((0, 1), repeat=len(of_part)):
            theta = parameters.centre.copy()
            theta[of_part] = sides[list(corner), of_part]
            _check(found, theta, ", ".join(parameters.names[i] for i in of_part), theta[of_part].tolist())


def _check(found: Unknowns, theta: NDArray[np.float64], name: str, value: Any) -> None:
    try:
        found.parts_at(theta)
    except checks.InvalidValue as error:
        rule = f"{error.key} {error.rule}" if isinstance(value, list) else error.rule
        raise checks.InvalidValue(f"unknown.{name}", value, rule, error.unit) from None


def check_truth(fitted: Unknowns, truth: Unknowns) -> None:
    """Raises InvalidValue where the true field's model changes a number that is unknown, to no effect."""
    for name, scalar in zip(fitted.parameters.names, fitted.scalars, strict=True):
        if scalar.part == "flow" or _value(fitted, scalar) == (value := _value(truth, scalar)):
            continue
        key = ".".join(part for part in ("true_model", scalar.part, str(scalar.field)) if part)
        rule = f"changes {name}, which is unknown"
        raise checks.InvalidValue(key, value, rule, scalar.unit, f"give its true value, unknown.{name}.true")


def _value(found: Unknowns, scalar: Scalar) -> Any:
    """The number as it is configured."""
    part = found.parts[scalar.part]
    value = getattr(part, str(scalar.field)) if scalar.field else part
    return value if scalar.place is None else value[scalar.place]


def steepest(found: Unknowns) -> Iterator[tuple[str, Any]]:
    """The initial feature where it is steepest within the bounds, with words that say where that is."""
    parameters, theta = found.parameters, found.parameters.centre.copy()
    chosen = [name for name in ("scale", "exponent") if name in parameters.names]
    if "scale" not in chosen:
        yield "", found.parts["initial"]
    if not chosen:
        return
    sides = {"scale": ("lower",), "exponent": ("lower", "upper")}
    for corner in itertools.product(*(sides[name] for name in chosen)):
        for name, side in zip(chosen, corner, strict=True):
            i = parameters.names.index(name)
            theta[i] = getattr(parameters, side)[i]
        if "amplitude" in parameters.names:  # it does not matter, but it must not be 0
            theta[parameters.names.index("amplitude")] = 1.0
        where = ", ".join(f"unknown.{name}.{side}" for name, side in zip(chosen, corner, strict=True))
        yield f" at {where}", found.parts_at(theta)["initial"]
