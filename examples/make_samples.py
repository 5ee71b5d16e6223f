"""Makes examples/samples.csv: what a boat measures on a zigzag course through a patch that drifts.

    python examples/make_samples.py

The patch is that of ``experiment=advection``, its true flow (4.2, 3.1); the noise has a standard
deviation of 1.
"""

from pathlib import Path

import numpy as np

from fieldrl.pde.advection import Advection

TRUE_FLOW, NOISE = (4.2, 3.1), 1.0
FILE = Path(__file__).parent / "samples.csv"


def text() -> str:
    """The file's content: 30 samples, 0.4 apart in time."""
    time = 0.4 * np.arange(1, 31)
    across = 25 * np.sin(0.9 * time)  # to both sides of a line through the patch
    position = np.column_stack([20 + 7 * time - across, 35 + 3 * time + across])
    value = Advection().predict(np.array([TRUE_FLOW]), position, time)[0]
    value += np.random.default_rng(0).normal(0, NOISE, time.size)
    rows = (f"{t:.1f},{x:.2f},{y:.2f},{v:.2f}" for t, (x, y), v in zip(time, position, value, strict=True))
    return "\n".join(["time,x,y,value", *rows]) + "\n"


if __name__ == "__main__":
    FILE.write_text(text())
