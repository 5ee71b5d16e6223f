"""Compose a configuration in Python, as the command line does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from fieldrl.app import config as configuration
from fieldrl.app import places


def composed(overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The plain, checked configuration for command-line overrides such as ``["steps=10"]``.

    Raises:
        FieldrlError: a key, option or value is refused; HydraException: an override cannot be read.
    """
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(places.directory()), version_base="1.3"):
        plain = configuration.plain(compose(config_name="config", overrides=list(overrides)))
    configuration.check(plain)
    return plain
