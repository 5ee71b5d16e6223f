"""A file of samples -> the parameters, how far they may be trusted, and where to sample next.

    python examples/my_samples.py

The same on the command line:
    fieldrl suggest examples/samples.csv experiment=advection count=5 times=18 apart=20
"""

from pathlib import Path

import fieldrl
from fieldrl.figures.estimates import field_figure
from fieldrl.figures.suggestions import suggestion_figure

SAMPLES = Path(__file__).parent / "samples.csv"


def main(folder: Path = Path("outputs/examples")) -> None:
    """Print the estimate and the next samples; draw both into ``folder``."""
    found = fieldrl.estimate(SAMPLES, "advection")
    print(found)
    suggested = fieldrl.suggest(found, count=5, times=18.0, apart=20.0)
    print(suggested)
    folder.mkdir(parents=True, exist_ok=True)
    field_figure(found.record).savefig(folder / "my_samples.png")
    suggestion_figure(suggested).savefig(folder / "my_samples_next.png")


if __name__ == "__main__":
    main()
