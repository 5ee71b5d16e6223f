"""A sweep's command line in Hydra's syntax: every combination of the values given, or a space to search."""

from __future__ import annotations

from collections.abc import Sequence

from hydra.core.override_parser.types import IntervalSweep, Override

from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.sweeps.grid import combinations
from fieldrl.sweeps.space import Dimension, Space, of_choices


def jobs(overrides: Sequence[Override]) -> list[tuple[str, ...]]:
    """The overrides of each job, the last key varying fastest; of a key given twice, the last counts."""
    values: dict[str, list[str]] = {}
    for override in overrides:
        if not override.is_sweep_override():
            values[override.get_key_element()] = [override.get_value_element_as_str()]
        elif override.is_discrete_sweep():
            values[override.get_key_element()] = list(override.sweep_string_iterator())
        else:
            raise FieldrlError(
                f"{override.input_line}: an interval has no end of values; "
                "hydra/sweeper=gp searches it, or list values: KEY=1,2,3"
            )
    return combinations(values)


def varied(overrides: Sequence[Override]) -> tuple[str, ...]:
    """The keys that have several values, without + and ~."""
    return tuple(item.get_key_element().lstrip("+~") for item in overrides if item.is_sweep_override())


def space(overrides: Sequence[Override]) -> Space:
    """The space of a search; of a key given twice, the last counts.

    Raises:
        FieldrlError: an interval is impossible, or no key is searched.
    """
    dimensions: dict[str, Dimension] = {}
    fixed: dict[str, str] = {}
    for override in overrides:
        key = override.get_key_element()
        fixed.pop(key, None)
        dimensions.pop(key, None)
        if override.is_sweep_override():
            dimensions[key] = _dimension(key, override)
        else:
            fixed[key] = f"{key}={override.get_value_element_as_str()}"
    return Space(tuple(dimensions.values()), tuple(fixed.values()))


def _dimension(key: str, override: Override) -> Dimension:
    value = override.value()
    if not isinstance(value, IntervalSweep):
        return of_choices(key, list(override.sweep_string_iterator()))
    start, end = value.start, value.end
    if start is None or end is None:
        raise InvalidValue(key, override.input_line, "an interval has two ends")
    whole = isinstance(start, int) and isinstance(end, int)
    return Dimension(key, start, end, whole=whole, log="log" in value.tags)
