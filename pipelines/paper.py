"""Every figure and table of the paper, and the page that puts what was measured beside what was printed.

python -m pipelines.paper                  the paper's scale, 8 replicates
python -m pipelines.paper scale=small      seconds, for CI

What is finished is not computed again; see ``pipelines.experiments`` for the options.
"""

from __future__ import annotations

from types import ModuleType

from fieldrl.app import console
from pipelines import (
    animation,
    claims,
    convergence,
    experiments,
    figure_2,
    figure_3,
    figure_4,
    figure_5,
    figure_6,
    landscape,
    learned,
    learning,
    page,
    table_1,
)
from pipelines.experiments import Settings

PIPELINES: tuple[ModuleType, ...] = (
    figure_2,
    figure_3,
    learning,
    figure_4,
    figure_5,
    figure_6,
    table_1,
    learned,
    convergence,
    landscape,
    animation,
    claims,
)


def make(settings: Settings) -> None:
    """Compute all missing runs together, so that no worker idles; then draw."""
    plan = [wanted.at(settings) for pipeline in PIPELINES for wanted in pipeline.plan(settings).values()]
    experiments.ensure(plan, settings)
    for pipeline in PIPELINES:
        pipeline.make(settings)
    print(f"page: {console.near(page.make(settings).resolve())}")


if __name__ == "__main__":
    experiments.command(make)
