"""How experiments read in MLflow."""

from __future__ import annotations

import json

from fieldrl.tracking import presentation

RUN = {"parameters": {"mu": {}}}
ESTIMATE = RUN | {"samples": {"used": 30}}


def columns(summary):
    found = json.loads(presentation.view(summary))["selectedColumns"]
    return [name.removeprefix("metrics.").strip("`") for name in found]


def test_runs_are_listed_with_their_late_error_and_estimates_with_their_fits():
    assert columns(RUN) == ["e_total", "late_e_total", "theta_error", "pooled/mu", "seconds"]
    assert columns(ESTIMATE) == ["e_total", "e_f", "e_cv", "samples", "pooled/mu", "seconds"]


def test_an_experiment_is_described_by_its_file_and_estimates_by_what_they_are():
    assert "plume" in presentation.experiment_note("advection", RUN)
    assert "late_e_total" in presentation.experiment_note("advection", RUN)
    assert presentation.experiment_note("estimate", ESTIMATE).startswith("Estimates from files of samples")
