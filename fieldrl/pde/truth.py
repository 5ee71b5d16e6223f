"""The model that generates the true field, where it differs from the one that is fitted.

Data from the very model that is fitted to them flatter the fit (an "inverse crime"). So the true field's
model may have another initial feature, flow or diffusivity, and another scheme, than the one that is fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from fieldrl.core import checks

Model = TypeVar("Model")


def differing(model: Model, changes: Any, changeable: Sequence[str], **besides: Any) -> Model:
    """``model`` with some fields changed.

    Args:
        model: the model that is fitted.
        changes: new values by field; for a field that is a component, a mapping of its own fields
            ({"flow": {"amplitude": 0.12}}) or another component.
        changeable: the fields that may differ.
        besides: new values that the model itself wants.

    Raises:
        InvalidValue: with the key below true_model.
    """
    try:
        return _changed(model, changes, changeable, besides)
    except checks.InvalidValue as error:
        raise error.within("true_model") from None


def _changed(component: Any, changes: Any, changeable: Sequence[str], besides: Mapping[str, Any]) -> Any:
    """A component with new values of some fields; raises InvalidValue with the key relative to it."""
    if not isinstance(changes, Mapping):
        raise checks.InvalidValue("", changes, "must be a mapping of what differs, such as {order: 5}")
    new = {}
    for key, value in changes.items():
        if key not in changeable:
            remedy = f"what may differ here: {', '.join(changeable)}"
            raise checks.InvalidValue(str(key), value, "cannot differ in the true field's model", "", remedy)
        try:
            new[key] = _value(getattr(component, key), value)
        except checks.InvalidValue as error:
            raise error.within(key) from None
    return replace(component, **new, **besides)


def _value(old: Any, new: Any) -> Any:
    """What takes the place of ``old``."""
    old = getattr(old, "wrapped", old)  # of an ordinary flow
    component = is_dataclass(old) and not isinstance(old, type)
    if isinstance(new, Mapping):
        if not component:
            raise checks.InvalidValue("", new, "has no component to change", "", "give one with _target_")
        return _changed(old, new, [item.name for item in fields(old) if item.init], {})
    if component and new is not None and not is_dataclass(new):
        raise checks.InvalidValue("", new, "must be a mapping of what differs in it, or a component")
    return new
