"""Hydra's part: compose the configuration from the command line, and start one job or a sweep of them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import hydra
from hydra._internal.hydra import Hydra
from hydra._internal.utils import get_args_parser
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from fieldrl.cli import hydra_settings
from fieldrl.cli.bad_overrides import refused
from fieldrl.core.checks import FieldrlError
from fieldrl.runs import configuration, options
from fieldrl.runs.explain import explain

_MULTIRUN = ("-m", "--multirun")
_FULL = "HYDRA_FULL_ERROR"


def launch(arguments: Sequence[str], full_error: bool = False) -> None:
    """Compose and run.

    Args:
        arguments: the command line.
        full_error: raise the errors of Hydra and of a sweep's jobs as they are.

    Raises:
        FieldrlError: the command line is refused, or a job of a sweep failed.
        Exception: whatever a single job raises.
    """
    arguments = sorted(arguments, key=lambda text: text not in _MULTIRUN)  # anywhere, as people write it
    _check_usage(arguments)
    failures: list[Exception] = []

    def job(config: DictConfig) -> None:
        sweep = HydraConfig.get().mode == RunMode.MULTIRUN
        try:
            one_job(config)
        except Exception as error:
            if not sweep:  # raised below; Hydra would print a line of its own about it
                failures.append(error)
            else:  # Hydra goes on with the others and raises the first failure at the end
                raise error if full_error else FieldrlError(explain(error)) from error

    try:
        with _command_line(arguments):
            hydra.main(config_path=str(options.directory()), config_name="config", version_base="1.3")(job)()
    except (HydraException, OmegaConfBaseException, ValueError, TypeError, YAMLError) as error:
        if full_error or isinstance(error, FieldrlError):
            raise
        raise refused(error, arguments) from error
    if failures:
        raise failures[0]


def one_job(config: DictConfig) -> None:
    """One run, as Hydra starts it."""
    from fieldrl.cli.terminal import Terminal
    from fieldrl.runs.job import Job, perform

    composed = hydra_settings.current_job(config)
    perform(Job.of(composed.config, composed.experiment, composed.files()), Terminal())


def _check_usage(arguments: Sequence[str]) -> None:
    """Refuse options that Hydra does not have, and groups without an option."""
    parser = get_args_parser()

    def refuse(message: str) -> None:
        raise FieldrlError(f"{message}; fieldrl --help shows how the command is used")

    parser.error = refuse  # type: ignore[method-assign, assignment]
    for override in parser.parse_args(list(arguments)).overrides:
        key, _, option = override.partition("=")
        group = key.lstrip("+~")
        if group in (*configuration.GROUPS, "experiment") and (option in ("", "null") or key.startswith("~")):
            choices = ", ".join(options.options(group))
            raise FieldrlError(f"{override}: a run needs an option of this group; choose one of {choices}")


@contextmanager
def _command_line(arguments: Sequence[str]) -> Iterator[None]:
    """Hydra reads sys.argv, raises errors instead of printing them, and loads what is trusted only."""
    argv, full, compose = sys.argv, os.environ.get(_FULL), Hydra.compose_config

    def compose_trusted(*args: Any, with_log_configuration: bool = False, **kwargs: Any) -> DictConfig:
        config = compose(*args, with_log_configuration=False, **kwargs)
        if with_log_configuration:  # it is about to be used, not only to be shown
            hydra_settings.check_trust(config.hydra)
        return config

    sys.argv, os.environ[_FULL] = ["fieldrl", *arguments], "1"
    Hydra.compose_config = compose_trusted  # type: ignore[method-assign]
    GlobalHydra.instance().clear()
    try:
        yield
    finally:
        sys.argv, Hydra.compose_config = argv, compose  # type: ignore[method-assign]
        os.environ.pop(_FULL)
        if full is not None:
            os.environ[_FULL] = full
