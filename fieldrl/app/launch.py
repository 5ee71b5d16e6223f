"""Hydra's part: compose the configuration from the command line, and start one job or a sweep of them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from fieldrl.app import config as configuration
from fieldrl.app import places
from fieldrl.core.checks import FieldrlError, InvalidValue


def launch(arguments: Sequence[str]) -> None:
    """Compose and run.

    Raises:
        Exception: whatever Hydra, OmegaConf or a component raise, unrendered.
    """
    _check_usage(arguments)
    failures: list[Exception] = []

    def job(config: DictConfig) -> None:
        if HydraConfig.get().mode == RunMode.MULTIRUN:
            one_job(config)  # a sweep goes on and raises the first failure at its end
            return
        try:
            one_job(config)
        except Exception as error:  # Hydra would print a line of its own about it
            failures.append(error)

    with _command_line(arguments):
        hydra.main(config_path=str(places.directory()), config_name="config", version_base="1.3")(job)()
    if failures:
        raise failures[0]


def one_job(config: DictConfig) -> None:
    """One run, as Hydra starts it."""
    from fieldrl.app.job import Job, perform

    settings = HydraConfig.get()
    experiment = settings.runtime.choices.get("experiment")
    if not experiment:
        available = ", ".join(places.options("experiment"))
        raise InvalidValue("experiment", experiment, "must be an experiment", remedy=f"choose one of {available}")
    plain = configuration.plain(config)
    files = {
        "config.yaml": OmegaConf.to_yaml(config),
        "hydra.yaml": OmegaConf.to_yaml(OmegaConf.create({"hydra": settings})),
        "overrides.yaml": OmegaConf.to_yaml(settings.overrides.task),
    }
    perform(Job.of(plain, experiment, files))


def _check_usage(arguments: Sequence[str]) -> None:
    parser = get_args_parser()

    def refuse(message: str) -> None:
        raise FieldrlError(f"{message}\nfieldrl --help shows how the command is used")

    parser.error = refuse  # type: ignore[method-assign, assignment]
    parser.parse_args(list(arguments))


@contextmanager
def _command_line(arguments: Sequence[str]) -> Iterator[None]:
    """Hydra reads sys.argv, and raises errors instead of printing them when HYDRA_FULL_ERROR is set."""
    argv, full = sys.argv, os.environ.get("HYDRA_FULL_ERROR")
    sys.argv, os.environ["HYDRA_FULL_ERROR"] = ["fieldrl", *arguments], "1"
    GlobalHydra.instance().clear()
    try:
        yield
    finally:
        sys.argv = argv
        if full is None:
            del os.environ["HYDRA_FULL_ERROR"]
        else:
            os.environ["HYDRA_FULL_ERROR"] = full
