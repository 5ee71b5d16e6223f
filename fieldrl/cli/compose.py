"""Compose a configuration in Python, as the command line does; runs and environments of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.runs import configuration, options
from fieldrl.runs.configuration import Composed

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.mission.environment import FieldSampling
    from fieldrl.mission.vector import FieldSamplingVector
    from fieldrl.runs.job import Job


def composed(overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The plain, checked configuration for command-line overrides such as ``["steps=10"]``.

    Raises:
        FieldrlError: a key, option or value is refused; HydraException: an override cannot be read.
    """
    config = plain(unresolved(overrides))
    configuration.check(config)
    return config


def recorded(experiment: str, overrides: Sequence[str] = ()) -> tuple[xr.Dataset, dict[str, Any]]:
    """The record and the summary of a run, computed now where no run of this configuration is finished.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line.
    """
    import xarray as xr

    job, summary = performed(experiment, overrides)
    return xr.load_dataset(job.run.folder / "record.nc", engine="netcdf4"), summary


def performed(experiment: str, overrides: Sequence[str] = ()) -> tuple[Job, dict[str, Any]]:
    """The same without reading the record: the job, whose run has the folder, and the summary."""
    from fieldrl.cli.terminal import Terminal
    from fieldrl.runs.job import Job, perform

    config = composed([f"experiment={experiment}", *overrides])
    job = Job.of(config, experiment, Composed(config, experiment, tuple(overrides)).files())
    return job, perform(job, Terminal())


def make_environment(
    experiment: str, overrides: Sequence[str] = (), render_mode: str | None = None
) -> FieldSampling:
    """What ``gymnasium.make("fieldrl/Advection-v0")`` builds.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line, e.g. ``["vehicle.max_speed=5", "estimator.starts=1"]``.
        render_mode: "rgb_array", "human" or None.
    """
    from fieldrl.runs.components import mission

    return mission(composed([f"experiment={experiment}", *overrides])).environment(render_mode)


def make_environments(
    experiment: str,
    overrides: Sequence[str] = (),
    render_mode: str | None = None,
    num_envs: int = 1,
    autoreset_mode: str = "NextStep",
) -> FieldSamplingVector:
    """What ``gymnasium.make_vec("fieldrl/Advection-v0", num_envs=64)`` builds.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line.
        render_mode: "rgb_array", "human" (the first environment is shown) or None.
        num_envs: how many environments.
        autoreset_mode: when one that has ended begins anew: "NextStep", "SameStep" or "Disabled".
    """
    from fieldrl.runs.components import mission

    config = composed([f"experiment={experiment}", *overrides])
    return mission(config).environments(num_envs, render_mode, autoreset_mode)


def unresolved(overrides: Sequence[str]) -> DictConfig:
    """What Hydra composes; raises what Hydra raises."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(options.directory()), version_base="1.3"):
        return compose(config_name="config", overrides=list(overrides))


def plain(config: DictConfig) -> dict[str, Any]:
    """The configuration as plain dicts and lists, interpolations resolved.

    Raises:
        FieldrlError: a value that must be given is missing, or an interpolation leads nowhere.
    """
    try:
        content = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    except MissingMandatoryValue as error:
        raise InvalidValue(str(error.full_key), "???", "must be given") from error
    except OmegaConfBaseException as error:
        reason = str(error).splitlines()[0]
        raise FieldrlError(f"{error.full_key}: {reason}") from error
    found: dict[str, Any] = {str(key): value for key, value in dict(content).items()}  # type: ignore[arg-type]
    return found | {"unknown": _told(found["unknown"])} if isinstance(found.get("unknown"), dict) else found


def _told(unknown: dict[Any, Any]) -> dict[Any, Any]:
    """The unknowns, where the bare key ``true``, which YAML and Hydra read as no text, is one."""
    return {
        name: {"true" if key is True else key: item for key, item in value.items()}
        if isinstance(value, dict)
        else value
        for name, value in unknown.items()
    }
