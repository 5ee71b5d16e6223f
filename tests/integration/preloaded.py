"""Imported where commands are forked: modules and compiled loops are loaded once, not by every command."""

from __future__ import annotations

import os

os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"  # before MLflow is imported

import mlflow.store.tracking.sqlalchemy_store  # noqa: F401

from pipelines.faults.__main__ import warm

warm()
