"""Which column of a table is which: by the setting, by name, by CF standard name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

from fieldrl.measurements.table import Column, Unreadable
from fieldrl.measurements.units import DEGREES

ROLES = ("time", "x", "y", "value", "std", "censored")
NEEDED = ("time", "x", "y", "value")

_NAMES: dict[str, tuple[str, ...]] = {
    "time": ("time", "t"),
    "x": ("x", "longitude", "lon"),
    "y": ("y", "latitude", "lat"),
    "value": ("value",),
    "std": ("std",),
    "censored": ("censored",),
}
_STANDARD: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "x": ("projection_x_coordinate", "longitude"),
    "y": ("projection_y_coordinate", "latitude"),
}


def chosen(
    columns: Mapping[str, Column],
    given: Mapping[str, str | None],
    source: str,
    needed: Sequence[str] = NEEDED,
) -> dict[str, str]:
    """The key of the column that has each role; those that are not needed may be missing.

    Args:
        columns: of the table, by key.
        given: name of a column by role, None where it is to be found.
        source: the file, for messages.
        needed: roles.

    Raises:
        Unreadable: a named column is not there, or a needed one is not found.
    """
    found = {}
    for role in ROLES:
        name = given.get(role)
        key = _named(columns, name) if name else _found(columns, role)
        if name and key is None and (role in needed or needed == NEEDED):
            raise Unreadable(
                source, f"measurements.columns.{role}={name}: no such column{_those(columns, name)}"
            )
        if key is not None:
            found[role] = key
        elif role in needed:
            way_out = f"; say which it is: measurements.columns.{role}=NAME"
            if any(_is_number(column.name) for column in columns.values()):
                way_out = f"; the first line must name the columns: {','.join(needed)}"
            raise Unreadable(source, f"no column {role}{_those(columns, role)}{way_out}")
    return found


def in_degrees(column: Column) -> bool:
    """Whether a column holds longitudes or latitudes."""
    named = column.name.lower() in ("longitude", "lon", "latitude", "lat")
    if column.standard_name in ("longitude", "latitude") or (named and not column.unit):
        return True
    return bool(column.unit) and DEGREES.fullmatch(column.unit) is not None


def _named(columns: Mapping[str, Column], name: str) -> str | None:
    """The key of a column by key or by name."""
    if name in columns:
        return name
    return next((key for key, column in columns.items() if column.name == name), None)


def _found(columns: Mapping[str, Column], role: str) -> str | None:
    """The key of the column that has a role by its name, else by its standard name."""
    for name in _NAMES[role]:
        for key, column in columns.items():
            if column.name.lower() == name:
                return key
    for standard in _STANDARD.get(role, ()):
        for key, column in columns.items():
            if column.standard_name == standard:
                return key
    return None


def _is_number(name: str) -> bool:
    try:
        return bool(float(name) or True)
    except ValueError:
        return False


def _those(columns: Mapping[str, Column], name: str) -> str:
    """ "; the columns are ..." with the likely ones first."""
    names = [column.name for column in columns.values()]
    near = difflib.get_close_matches(name, names, 2)
    listed = [*near, *(other for other in names if other not in near)]
    more = f" and {len(listed) - 12} more" if len(listed) > 12 else ""
    return f"; the columns are {', '.join(listed[:12])}{more}" if listed else "; there are no columns"
