"""A Hydra sweep from Python: every combination of agents and seeds, its table, its picture.

python examples/sweep.py
"""

import csv
import shutil
from pathlib import Path

from fieldrl.cli.main import main as fieldrl


def main(folder: Path = Path("outputs/examples"), *settings: str, seeds: int = 3) -> None:
    """Sweep, read the table that it leaves, keep its picture."""
    output = Path(folder) / "sweep"
    words = ["-m", "experiment=advection", "agent=sarsa_lambda,lawnmower,random", f"seed=range({seeds})"]
    budget = ["episodes=40", "replicates=1", "evaluation_episodes=0", f"output_dir={output}"]
    if fieldrl([*words, *budget, *settings]):  # as on the command line; 0: every job is done
        raise SystemExit("a job failed; its reason stands in results.csv")
    (sweep,) = (output / "sweeps").glob("*-sweep-*")
    with (sweep / "results.csv").open() as file:
        for row in csv.DictReader(file):
            print(row["agent"], row["seed"], row["late_e_total"])
    shutil.copy(sweep / "figures" / "results.png", Path(folder) / "sweep.png")


if __name__ == "__main__":
    main()
