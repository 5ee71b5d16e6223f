"""Configurations of many jobs, quickly: Hydra composes each choice of options once.

Hydra takes about 50 ms to compose a configuration, nearly all of it for the files of its options. Jobs of a
sweep mostly differ in values: those are set on a copy, by Hydra's own function and in the order given.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException
from omegaconf import DictConfig, open_dict, read_write
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from fieldrl.cli import hydra_settings
from fieldrl.cli.bad_overrides import refused
from fieldrl.cli.compose import plain
from fieldrl.runs.configuration import Composed


@dataclass
class Composer:
    """Composes the jobs of one sweep.

    Args:
        loader: Hydra's loader of configurations.
        master: the configuration of the whole sweep, Hydra's node included.
    """

    loader: ConfigLoaderImpl
    master: DictConfig
    _bases: dict[tuple[str, ...], tuple[DictConfig, str, str]] = field(default_factory=dict)

    def __call__(self, overrides: Sequence[str]) -> Composed:
        """The configuration of a job.

        Args:
            overrides: KEY=VALUE, one value each.

        Raises:
            FieldrlError: an override is refused, or a value that must be given is missing.
        """
        try:
            choices, values = self._split(overrides)
            base, experiment, hydra = self._base(choices)
            config = copy.deepcopy(base)
            ConfigLoaderImpl._apply_overrides_to_config(values, config)
        except (HydraException, OmegaConfBaseException, ValueError, TypeError, YAMLError) as error:
            raise refused(error, overrides) from error
        return Composed(plain(config), experiment, tuple(overrides), hydra)

    def _split(self, overrides: Sequence[str]) -> tuple[tuple[str, ...], list[Override]]:
        """Overrides that choose options (or need Hydra for another reason), and those that set values."""
        choices, values = [], []
        for text in overrides:
            override = _parsed(text)
            simple = override.package is None and not override.is_hydra_override() and "/" not in text
            if simple and not self.loader.repository.group_exists(override.key_or_group):
                values.append(override)
            else:
                choices.append(text)
        return tuple(choices), values

    def _base(self, choices: tuple[str, ...]) -> tuple[DictConfig, str, str]:
        """The configuration of a choice of options, the experiment's name, Hydra's settings as YAML."""
        if choices not in self._bases:
            config = self.loader.load_sweep_config(self.master, list(choices))
            hydra_settings.check_trust(config.hydra)
            settings = hydra_settings.as_yaml(config.hydra)
            experiment = str(config.hydra.runtime.choices["experiment"])
            with read_write(config), open_dict(config):
                del config["hydra"]
            self._bases[choices] = config, experiment, settings
        return self._bases[choices]


@lru_cache(maxsize=4096)
def _parsed(text: str) -> Override:
    return OverridesParser.create().parse_override(text)
