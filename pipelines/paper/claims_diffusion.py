"""The claim that diffusion is needed for numerical reasons: the second experiment without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipelines.experiments import Found, Settings
from pipelines.paper import companions, gyres, information, rules
from pipelines.paper.claim import Claim, counted
from pipelines.paper.rules import Finding


def claims(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """rho is needed."""
    usual, still = runs[gyres.RUN], runs[companions.STILL]
    return [
        Claim(
            name="Diffusion",
            where="section 5",
            text="a small diffusivity is added because pure advection is numerically difficult to solve",
            hypotheses={"": [_failures(still), _estimates(usual, still), *_solves(usual, still)]},
            why=(
                "Upwind finite volumes are stable without diffusion. What the water draws out thinner than a "
                "cell is smeared by the grid instead, which shows in single solves."
            ),
            replicates=counted(still),
        )
    ]


def _failures(still: Found) -> Finding:
    """Whether solves fail without diffusion."""
    asked = np.isfinite(still.record["trace_theta"].values).all(axis=-1)
    failed = int((asked & ~np.isfinite(still.record["trace_loss"].values)).sum())
    return rules.fact("solves that fail without it", f"{failed} of {asked.sum()}", failed > 0)


def _estimates(usual: Found, still: Found) -> Finding:
    """Whether estimates are worse without diffusion."""
    before, after = (np.median(information.errors(run.record, run.mission), axis=1) for run in (usual, still))
    return rules.change("error of an episode's estimate, with → without", before, after, 1)


def _solves(usual: Found, still: Found) -> list[Finding]:
    """What the grid makes of the true field at the final time, with diffusion and without."""
    (error, least), (error_still, least_still) = (_quality(run) for run in (usual, still))
    return [
        rules.fact(
            "rms difference from a grid twice as fine / peak, with → without",
            f"{error:.2g} → {error_still:.2g}",
            error_still >= (1 + rules.NEAR) * error,
        ),
        rules.fact(
            "deepest undershoot / peak, with → without",
            f"{least:.2g} → {least_still:.2g}",
            least_still >= (1 + rules.NEAR) * least,
        ),
    ]


def _quality(run: Found) -> tuple[float, float]:
    """Error of the model's grid and its deepest undershoot at the final time, as shares of the peak."""
    water: Any = run.mission.water
    true, end = run.record["true"].values, run.mission.duration
    coarse, fine = (model.field(true, end, water.grid) for model in (water, water.truth()))
    peak = float(fine.max())
    return float(np.sqrt(np.mean((coarse - fine) ** 2))) / peak, max(0.0, -float(coarse.min())) / peak
