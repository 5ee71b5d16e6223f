"""Many missions at once, as a Gymnasium VectorEnv: one compiled batch a step, where that is possible."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

from fieldrl.core.checks import FieldrlError, one_of
from fieldrl.mission.batch import Batch, Told, serves
from fieldrl.mission.environment import FieldSampling

_MODES = tuple(mode.value for mode in AutoresetMode)


class FieldSamplingVector(SyncVectorEnv):
    """B environments of one mission: what Gymnasium's SyncVectorEnv gives, bit for bit, but quicker.

    A step is one compiled batch for ``pde=advection`` with ``estimator=least_squares`` (from two starts on),
    the unicycle, ``scenario`` fixed or drawn, ``reward`` total_error or information_gain (or one of your own
    with ``many``), ``observation`` paper or informed (or one with ``see_many``), and no ``stop``. Everything
    else, and what has been changed by ``set_attr``, is stepped one environment after the other.

    Seed s means s + i for environment i. A ``reset`` is done by the environments themselves, and so are
    pictures; with ``render_mode="human"`` the first environment is shown.

    Args:
        makers: make the environments.
        autoreset_mode: "NextStep", "SameStep" or "Disabled", see Gymnasium's AutoresetMode.
    """

    envs: list[FieldSampling]  # type: ignore[assignment]

    def __init__(
        self, makers: Sequence[Callable[[], FieldSampling]], autoreset_mode: str | AutoresetMode = "NextStep"
    ) -> None:
        mode = getattr(autoreset_mode, "value", autoreset_mode)
        super().__init__(makers, autoreset_mode=one_of("autoreset_mode", mode, _MODES))
        self.batch = Batch(self.envs) if serves(self.envs[0]) else None

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Reset all environments, or those of ``options["reset_mask"]`` (B,)."""
        mask = (options or {}).get("reset_mask")
        found = super().reset(seed=seed, options=options)
        self._load(np.arange(self.num_envs) if mask is None else np.flatnonzero(mask))
        return found

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[
        NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Take one action (B,) in each environment; raises FieldrlError as the single environment does."""
        if self.batch is None:
            return super().step(actions)
        resets = self._autoreset_envs & (self.autoreset_mode == AutoresetMode.NEXT_STEP)
        which, actions = np.flatnonzero(~resets), np.asarray(actions)
        self._check(self.batch, which, actions)
        self._begin_anew(np.flatnonzero(resets))
        rewards, told = self.batch.step(which, actions[which])
        over = self._autoreset_envs = self.batch.over
        if self.render_mode == "human":
            self._store([0])
            self.envs[0].show()
        infos = self._infos(told, ~resets, over & (self.autoreset_mode == AutoresetMode.SAME_STEP))
        return self.batch.seen.copy(), rewards, over.copy(), np.zeros_like(over), infos

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every environment, or take an attribute."""
        self._store(range(self.num_envs))
        return super().call(name, *args, **kwargs)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every environment; from now on they are stepped one after the other."""
        self._store(range(self.num_envs))
        self.batch = None
        super().set_attr(name, values)

    def render(self) -> tuple[Any, ...]:
        """The pictures of all environments."""
        self._store(range(self.num_envs))
        return super().render()

    def _check(self, batch: Batch, which: NDArray[np.int64], actions: NDArray[np.int64]) -> None:
        if any(draw is None for draw in batch.draws):
            raise FieldrlError("nothing has begun yet: call reset()")
        known = (actions[which] >= 0) & (actions[which] < len(batch.vehicle.actions))
        for i in which[batch.over[which] | ~known]:
            self._store([i])
            self.envs[i].step(actions[i])  # which raises

    def _begin_anew(self, which: NDArray[np.int64]) -> None:
        """Reset some environments."""
        for i in which:
            self._env_obs[i], _ = self.envs[i].reset()
        self._load(which)

    def _load(self, which: NDArray[np.int64]) -> None:
        """Take into the batch what has been reset; what the batch sees is from now on what is seen there."""
        if self.batch is not None:
            for i in which:
                self.batch.load(i, self.envs[i])
                self.batch.seen[i] = self._env_obs[i]
                self._env_obs[i] = self.batch.seen[i]

    def _store(self, which: Sequence[int] | range) -> None:
        """Bring environments to where the batch is."""
        if self.batch is not None:
            for i in which:
                self.batch.store(i, self.envs[i])

    def _infos(self, told: Told, stepped: NDArray[np.bool_], ended: NDArray[np.bool_]) -> dict[str, Any]:
        """``info`` in the layout of SyncVectorEnv; missions that ended in this step and begin anew in it have
        theirs, and what they saw last, below ``final_info`` and ``final_obs``."""
        infos = _masked(told, stepped & ~ended)
        if ended.any():
            assert self.batch is not None
            seen = np.full(self.num_envs, None, dtype=object)
            for i in np.flatnonzero(ended):
                seen[i] = self.batch.seen[i].copy()
            final = {"final_obs": seen, "final_info": _masked(told, ended)}
            infos |= final | {f"_{name}": ended.copy() for name in final}
            self._begin_anew(np.flatnonzero(ended))
        return infos


def _masked(told: Told, where: NDArray[np.bool_]) -> dict[str, Any]:
    """What is told of some missions, 0 or None for the others; beside each array which they are."""
    infos: dict[str, Any] = {}
    for name, array in told.items() if where.any() else ():
        kept = array.copy()
        kept[~where] = None if kept.dtype == object else 0
        infos[name], infos[f"_{name}"] = kept, where.copy()
    return infos
