"""An agent of your own, in a whole run: record, page and MLflow as for any other.

    python examples/my_agent.py

The same on the command line:
    export FIELDRL_PACKAGES=my_agent PYTHONPATH=examples
    fieldrl --config-dir examples/conf experiment=advection agent=spiral
"""

import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np

from fieldrl.agent.fixed import Fixed
from fieldrl.core.kinds import component

HERE = Path(__file__).parent


@component
class Spiral(Fixed):
    """Full speed; a turn after every ``straight`` samples. Its option is examples/conf/agent/spiral.yaml."""

    straight: int = 3

    def begin(self, low, high, actions):
        """The state when learning begins: a dict of arrays."""
        return {"count": np.zeros(1)}

    def act(self, state, observation, rng, greedy=False):
        """0 is full speed ahead, 3 full speed turning counter-clockwise, Eq. (12) of the paper."""
        state["count"] += 1
        return 3 if state["count"][0] % (self.straight + 1) == 0 else 0


def main(folder: Path = Path("outputs/examples"), *settings: str) -> None:
    """Run the agent and the lawnmower on the same truth and budget; keep the picture of the agent's paths."""
    from fieldrl.cli.main import main as fieldrl

    os.environ["FIELDRL_PACKAGES"] = "my_agent"  # whose classes a configuration may name
    sys.path.insert(0, str(HERE))
    output = Path(folder) / "my_agent"
    budget = ("episodes=4", "replicates=1", "evaluation_episodes=0")
    common = ("experiment=advection", *budget, f"output_dir={output}", *settings)
    for agent in ("spiral", "lawnmower"):
        if fieldrl([f"--config-dir={HERE / 'conf'}", f"agent={agent}", *common]):
            raise SystemExit(f"the run of {agent} failed")
    for run in (output / "runs").iterdir():
        agent = "spiral" if "spiral" in (run / ".hydra" / "overrides.yaml").read_text() else "lawnmower"
        pooled = json.loads((run / "summary.json").read_text())["replicates_table"][0]["pooled"]["parameters"]
        std = {name: round(one["std"], 4) for name, one in pooled.items()}
        print(f"{agent}: all samples tell the flow with standard deviations of {std}")
        if agent == "spiral":
            shutil.copy(run / "figures" / "path.png", Path(folder) / "my_agent.png")


if __name__ == "__main__":
    main()
