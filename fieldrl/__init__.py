"""fieldrl: estimate a drifting field from the few samples that a learning vehicle chooses to take.

Importing it registers the Gymnasium environments ``fieldrl/Advection-v0`` and ``fieldrl/DoubleGyre-v0``.
"""

import gymnasium

__version__ = "0.1.0"

for _name, _experiment in (("Advection", "advection"), ("DoubleGyre", "double_gyre")):
    gymnasium.register(
        f"fieldrl/{_name}-v0",
        entry_point="fieldrl.app.environments:make_environment",
        kwargs={"experiment": _experiment},
    )
