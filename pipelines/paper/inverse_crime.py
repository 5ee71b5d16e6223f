"""What the second experiment owes to a true field that comes from the very model that is fitted to it.

    python -m pipelines.paper.inverse_crime [scale=small] [jobs=N]

The shipped truth has the model's scheme, on a grid twice as fine; its initial feature, diffusivity and flow
amplitude are known exactly; its mu is the centre of the bounds, where the search begins and towards which the
Tikhonov term pulls. Here each of these is taken away in turn. The tables are printed, and left with their
numbers as outputs/paper/inverse_crime.md and .json.

Eight replicates of three episodes of the experiment's ten, everything else as shipped; the noise of the
samples is the same in every row.

Takes ten minutes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines import artefacts, experiments, measures, report
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper.learned import best

_SIZE = ("replicates=8", "episodes=3", "evaluation_episodes=0")


def _true_model(changes: str) -> tuple[str, ...]:
    return (f"pde.true_model={{{changes}}}",)


TRUTHS: Mapping[str, tuple[str, ...]] = {
    "as shipped: order 9, grid twice as fine": (),
    "on the model's own grid": ("pde.truth_refinement=1",),
    "order 3": _true_model("order:3"),
    "semi-Lagrangian, another method": _true_model("scheme:semi_lagrangian"),
    "amplitude of h + 5 %": _true_model("initial:{amplitude:105}"),
    "amplitude of h + 20 %": _true_model("initial:{amplitude:120}"),
    "scale of h + 5 %": _true_model("initial:{scale:21}"),
    "scale of h + 20 %": _true_model("initial:{scale:24}"),
    "centre of h, x + 5 % of its scale": _true_model("initial:{centre:[61,40]}"),
    "centre of h, x + 20 % of its scale": _true_model("initial:{centre:[64,40]}"),
    "rho + 5 %": _true_model("diffusivity:1.05"),
    "rho + 20 %": _true_model("diffusivity:1.2"),
    "A + 5 %": _true_model("flow:{amplitude:0.105}"),
    "A + 20 %": _true_model("flow:{amplitude:0.12}"),
    "mu = 0.1, off the centre": ("pde.true=[0.1,0.6283185307179586]",),
    "mu = 0.4, off the centre": ("pde.true=[0.4,0.6283185307179586]",),
}
"""What the true field comes from, as overrides of the experiment."""

_EVERY = 4  # of the rows, at the small scale


def plan(settings: Settings) -> dict[str, Wanted]:
    """A run for each truth; some of them at the small scale."""
    names = list(TRUTHS)[:: _EVERY if settings.small else 1]
    size = () if settings.small else _SIZE
    return {name: Wanted("double_gyre", (*size, *TRUTHS[name])) for name in names}


def make(settings: Settings) -> dict[str, dict[str, Any]]:
    """Compute what is missing, print the tables, write them; returns the numbers by truth."""
    runs = experiments.find(plan(settings), settings)
    numbers = {name: measure(run) for name, run in runs.items()}
    texts = []
    for title, columns, rows in tables(numbers):
        title = f"{title}; median [quartiles] over {_size(runs)}"
        report.show(title, columns, rows)
        texts.append(f"{title}:\n\n{report.markdown(columns, rows)}")
    artefacts.put(settings, "inverse_crime.md", "\n".join(texts).encode())
    artefacts.note(settings, "inverse_crime", {"caption": _size(runs)}, runs.values(), numbers)
    return numbers


def measure(run: Found) -> dict[str, NDArray[np.float64]]:
    """Of each replicate: estimate - true, (replicates, p); mean errors of the episodes' ends; field error."""
    record = run.record
    true = record["true"].values
    errors = {name: measures.final(record, name).mean(axis=1) for name in ("e_f", "e_cv", "e_total")}
    return {
        "best": best(record) - true,
        "pooled": record["pooled"].values - true,
        "field": measures.field_error(record),
        **errors,
    }


def tables(
    numbers: Mapping[str, Mapping[str, NDArray]],
) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Title, columns and rows of text: the estimates, then what the fits say of themselves."""
    estimates = [
        (name, *_estimate(np.abs(values["best"])), *_estimate(values["pooled"]))
        for name, values in numbers.items()
    ]
    names = ("e_f", "e_cv", "e_total", "field")
    errors = [(name, *(report.spread(values[k]) for k in names)) for name, values in numbers.items()]
    return [
        (
            "Estimates: size of the error in the best episode; signed error from all samples",
            ("the true field", "mu, best", "omega, best", "mu, all samples", "omega, all samples"),
            estimates,
        ),
        (
            "Errors at the episodes' ends, their mean",
            ("the true field", "e_f", "e_cv", "e_total", "rms error of the field / peak"),
            errors,
        ),
    ]


def _estimate(errors: NDArray) -> list[str]:
    """Errors of an estimate, parameter by parameter."""
    return [report.spread(column, 2) for column in errors.T]


def _size(runs: Mapping[str, Found]) -> str:
    sizes = next(iter(runs.values())).record.sizes
    return f"{sizes['replicate']} replicates of {sizes['episode']} episodes of {sizes['step']} samples"


if __name__ == "__main__":
    experiments.command(make)
