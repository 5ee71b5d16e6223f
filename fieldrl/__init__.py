"""fieldrl: estimate a drifting field from the few samples that a learning vehicle chooses to take.

Importing it registers the Gymnasium environments ``fieldrl/Advection-v0`` and ``fieldrl/DoubleGyre-v0``.
"""

import importlib
from typing import Any

import gymnasium

__version__ = "0.1.0"

for _name, _experiment in (("Advection", "advection"), ("DoubleGyre", "double_gyre")):
    gymnasium.register(
        f"fieldrl/{_name}-v0",
        entry_point="fieldrl.cli.compose:make_environment",
        vector_entry_point="fieldrl.cli.compose:make_environments",
        kwargs={"experiment": _experiment},
    )

_LAZY = {
    "estimate": "fieldrl.cli.from_python",
    "suggest": "fieldrl.cli.from_python",
    "Samples": "fieldrl.core.samples",
}


def __getattr__(name: str) -> Any:
    """What is imported when it is first asked for, so that ``import fieldrl`` is quick."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_LAZY[name]), name)
