"""Hydra's own settings: what a job keeps of them, and that they load nothing that is not trusted."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from fieldrl.cli.compose import plain
from fieldrl.runs import trust
from fieldrl.runs.configuration import Composed

_LOADED = ("_target_", "()", "class")  # by Hydra's callbacks and plugins, and by logging
_HYDRA = ("hydra", "hydra_plugins", "logging", "colorlog")


def current_job(config: DictConfig) -> Composed:
    """The job that Hydra has just started."""
    settings = HydraConfig.get()
    overrides: Any = OmegaConf.to_container(settings.overrides.task)  # type: ignore[arg-type]
    experiment = str(settings.runtime.choices["experiment"])
    return Composed(plain(config), experiment, tuple(overrides), as_yaml(settings))


def as_yaml(settings: Any) -> str:
    """The settings as they are kept in ``.hydra/``."""
    return OmegaConf.to_yaml(OmegaConf.create({"hydra": settings}))


def check_trust(settings: DictConfig) -> None:
    """Refuse settings that would load a Python name of neither Hydra nor a package that the user allows."""
    for path, key, value in trust.walk(_resolved(settings), "hydra"):
        if key in _LOADED and isinstance(value, str):
            trust.check_target(value, path, _HYDRA)


def _resolved(node: Any) -> Any:
    """Plain dicts and lists with interpolations resolved, without what is still missing."""
    if isinstance(node, ListConfig):
        return [_resolved(item) for item in node]
    if not isinstance(node, DictConfig):
        return node
    found = {}
    for key in node:
        with suppress(OmegaConfBaseException):
            found[str(key)] = _resolved(node[key])
    return found
