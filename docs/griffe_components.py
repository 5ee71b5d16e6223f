"""Griffe's view of the code: a ``@component`` is a dataclass, its fields are the constructor's arguments."""

from __future__ import annotations

from typing import Any

import griffe


class Components(griffe.Extension):
    """Shows ``fieldrl.core.kinds.component`` as ``dataclasses.dataclass``."""

    def on_class_instance(self, *, cls: griffe.Class, **_: Any) -> None:
        """Called for every class, before dataclasses get their constructors."""
        for decorator in cls.decorators:
            if decorator.callable_path.endswith("component"):
                decorator.value = griffe.ExprName("dataclasses.dataclass")
