"""Every pipeline of the paper, and all of them made together with the page."""

from __future__ import annotations

from types import ModuleType

from fieldrl.cli import terminal
from pipelines import experiments
from pipelines.experiments import Settings
from pipelines.paper import (
    animation,
    claims,
    convergence,
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
    print(f"page: {terminal.near(page.make(settings).resolve())}")
