"""A reduced-order model of advection-diffusion: some thousand solves, once, then predictions in microseconds.

Proper orthogonal decomposition of the solves' snapshots, one for each time, and tensor splines of the
coefficients over the unknowns (``reduced_order/``). It predicts at the times of a solve's snapshots only. Its
error is measured at solves that it has not seen, and what errs by more than a share of the sensor's noise is
refused. The solves and the model are kept on disk by all that they depend on.
"""

from __future__ import annotations

import copy
import shutil
import threading
import warnings
from collections.abc import Sequence
from dataclasses import field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.cost import Cost, Extent
from fieldrl.core.kinds import component
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.finite_volumes.inside import check_inside
from fieldrl.pde.finite_volumes.resolution import CoarseGrid
from fieldrl.pde.reduced_order import build, kernel, splines
from fieldrl.pde.reduced_order.nodes import nodes, pilot_axes
from fieldrl.pde.reduced_order.packing import packed, with_memo
from fieldrl.pde.solutions import Solutions, key

_METHOD = "graded quintic splines of POD coefficients 1"
_SAMPLE = 2e-7  # time of a prediction [s]
_BEYOND = 1e-3  # half widths by which theta may lie outside the bounds
_IN_MEMORY = 4  # models that a process has read or built


class Building(UserWarning):
    """What a reduced model takes, and what came of it."""


class Reduced(NamedTuple):
    """What its compiled functions read; its errors at fresh solves, all times, (solves, k) [field unit]."""

    constants: NDArray[np.float64]
    errors: NDArray[np.float64]


_READY: dict[str, Reduced] = {}
_LOCK = threading.RLock()


@component
class ReducedAdvectionDiffusion(AdvectionDiffusion):
    """``AdvectionDiffusion`` without its solves; a forward model that is compiled.

    Args, besides those of ``AdvectionDiffusion``:
        nodes: solves along each unknown, (p,), at least 6 each.
        left_out: what the decomposition may leave out of the snapshots, root mean square [field unit].
        held_out: fresh solves that it is compared with, at random places within the bounds.
        noise: standard deviation of the sensor's noise, which the error is compared with [field unit].
        share: an error above this share of the noise is refused. The error is the root mean square over the
            domain, at the time and the fresh solve where it is largest.
        reduced_truth: whether the true field is of a reduced model, too, on its grid; else of full solves.
        reduced_models: where models and the solves of one that is being built are kept.
    """

    nodes: Sequence[int] = (24, 88)
    left_out: float = 0.025
    held_out: int = 100
    noise: float = 1.0
    share: float = 0.1
    reduced_truth: bool = False
    reduced_models: Solutions = field(default_factory=Solutions, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        names, found = self.parameters.names, self.nodes
        if len(found) != len(names):
            rule = f"must be {len(names)} numbers, one for each of {', '.join(names)}"
            raise checks.InvalidValue("nodes", found, rule)
        counts = tuple(checks.integer("nodes", one, splines.WIDTH) for one in found)
        object.__setattr__(self, "nodes", counts)
        checks.positive("left_out", self.left_out, "field unit")
        checks.integer("held_out", self.held_out, 1)
        remedy = "give pde.noise: what an error is small against"
        if not checks.finite(self.noise) or self.noise <= 0:
            raise checks.InvalidValue("noise", self.noise, "must be > 0", "field unit", remedy)
        checks.positive("share", self.share)
        if self.positive:
            rule = "a reduced model may undershoot"
            raise checks.InvalidValue("positive", True, rule, remedy="use false, or pde=double_gyre")

    @property
    def kernel(self) -> int:
        """Address of the compiled MODEL function."""
        return int(kernel.kernel.address or 0)

    @property
    def constants(self) -> NDArray[np.float64]:
        """The model as the compiled function reads it; builds it where nobody did before."""
        return self.reduced.constants

    @property
    def errors(self) -> NDArray[np.float64]:
        """Root mean square over the domain at each fresh solve and time, (held_out, k) [field unit]."""
        return self.reduced.errors

    @property
    def reduced(self) -> Reduced:
        """The model: in memory, else from disk, else built.

        Raises:
            InvalidValue: its error is more than ``share`` of the noise.
            SolveFailed: a solve that it needs.
        """
        found = _READY.get(self._name_of_model)
        if found is None:
            with _LOCK:
                found = _READY.get(self._name_of_model) or self._read_or_build()
                _READY[self._name_of_model] = found
                while len(_READY) > _IN_MEMORY:
                    _READY.pop(next(iter(_READY)))
        self._judge(found)
        return found

    def prepare(self) -> None:
        """Build it now, where nobody did before; errors as ``reduced``."""
        _ = self.reduced

    def compare(self, solves: int, seed: int) -> NDArray[np.float64]:
        """``errors`` at so many other fresh solves, (solves, k) [field unit]."""
        solve = self._solver_of(replace(self.full(), solutions=Solutions(memory=0.0)))
        return build.errors(self.constants, solve, solves, self.parameters, seed)

    def with_truth(self, true: NDArray[np.float64]) -> ReducedAdvectionDiffusion:
        """The same model with other true values (p,), within the bounds: nothing is checked again."""
        found, values = copy.copy(self), [float(value) for value in true]
        if self.unknown:
            about = zip(self.parameters.names, values, strict=True)
            object.__setattr__(
                found, "unknown", {name: {**self.unknown[name], "true": one} for name, one in about}
            )
        else:
            object.__setattr__(found, "true", tuple(values))
        vars(found).pop("_unknowns", None)
        return found

    def full(self) -> AdvectionDiffusion:
        """The model that it stands for."""
        names = [one.name for one in fields(AdvectionDiffusion) if one.init]
        return AdvectionDiffusion(**{name: getattr(self, name) for name in names})

    def truth(self) -> AdvectionDiffusion:
        """The model that generates the true field: with ``reduced_truth`` a reduced one."""
        true = np.array(self.parameters.true)
        return self._truth.with_truth(true) if self.reduced_truth else self._truth.with_truth(true).full()

    def check_times(self, times: NDArray[np.float64]) -> None:
        """Raises InvalidValue where a time (n,) is none of a solve's snapshots."""
        _, between = self._nearest(np.asarray(times, dtype=float))
        if between.any():
            rule = (
                f"a reduced model predicts at these intervals only, not at {np.asarray(times)[between][0]:g}"
            )
            raise checks.InvalidValue("interval", self.interval, rule, "time", "another interval")

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """The field of m candidates (m, p) at n samples, (m, n) [field unit].

        Raises:
            OutsideDomain: a sample outside the domain or the time that is solved.
            InvalidValue: theta is outside the bounds, or a time is none of the solves'.
        """
        return self._evaluate(theta, positions, times)[0]

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Derivatives of ``predict`` by the unknowns, (m, n, p); errors as there."""
        return self._evaluate(theta, positions, times)[1]

    def solve_seconds(self, samples: int) -> float:
        """Time to predict one candidate at so many samples [s]."""
        return samples * _SAMPLE

    def cost(self, extent: Extent) -> Cost:
        """The true field's solve, and the solves that the model is built from."""
        full, solves = self.full(), float(np.prod(self.nodes))
        plain, one = full.cost(extent), full.solve_seconds(1)
        memory = 4.0 * solves * self.snapshots * np.prod(self.cells)
        seconds = plain.seconds + solves * one / build.threads()
        return Cost(plain.memory + memory, seconds, (*plain.by, "nodes"))

    def _evaluate(self, theta: NDArray, positions: NDArray, times: NDArray) -> tuple[NDArray, NDArray]:
        candidates = self._checked(theta)
        positions = np.ascontiguousarray(positions, dtype=float).reshape(-1, 2)
        times = np.ascontiguousarray(times, dtype=float).reshape(-1)
        check_inside(positions, times, self.domain, self.final_time)
        self._check_bounds(candidates)
        found = kernel.evaluate(candidates, positions, times, self.constants)
        if np.isnan(found[0]).any():
            self.check_times(times)
        return found

    def _check_bounds(self, candidates: NDArray[np.float64]) -> None:
        u = np.abs(candidates - self.parameters.centre) / self.parameters.half_width
        if len(u) and np.max(u) > 1 + _BEYOND:
            rule = "must lie within the bounds that the reduced model was built for"
            worst = candidates[np.argmax(u.max(axis=1))]
            raise checks.InvalidValue("theta", worst.tolist(), rule, remedy="wider pde.lower and pde.upper")

    def _state(self, candidate: Any, time: float) -> NDArray[np.float64]:
        """Cell averages at a time of a solve, (nx, ny)."""
        self.check_times(np.array([time]))
        self._check_bounds(candidate.theta[None])
        which = int(self._nearest(np.array([time]))[0][0])
        return kernel.state(candidate.theta, which, self.constants).reshape(self.cells)

    @cached_property
    def _truth(self) -> Any:
        """``truth`` but for the true values: a reduced model, built only where somebody asks it."""
        if self.truth_refinement == 1 and self.true_model is None:
            return self
        return super().truth()

    @cached_property
    def _name_of_model(self) -> str:
        """All that the model depends on."""
        found, parameters = self._unknowns, self.parameters
        bounds = parameters.lower, parameters.upper, found.scalars, found.flow
        return key(_METHOD, self._key, *bounds, self.nodes, self.left_out)

    @property
    def _folder(self) -> Path | None:
        """Where the solves of a build are kept meanwhile."""
        directory = self.reduced_models.directory
        return None if directory is None else Path(str(directory)) / f"{self._name_of_model}.solves"

    def _read_or_build(self) -> Reduced:
        name, store = self._name_of_model, self.reduced_models
        kept = store.get(name, self._build)
        of_errors = key(name, "errors", self.held_out)
        errors = store.get(of_errors, lambda: self._compare(kept))
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        return Reduced(with_memo(kept), errors)

    def _build(self) -> NDArray[np.float64]:
        """The model from solves, see ``packing``."""
        pilot = pilot_axes(self.nodes)
        points = np.stack(np.meshgrid(*pilot, indexing="ij"), axis=-1).reshape(-1, len(pilot))
        coarse = build.solved(self._solver_of(self._coarse()), points)
        where = nodes(self.nodes, pilot, coarse.reshape(*map(len, pilot), -1))
        self._tell(len(where.points))
        found = build.solved(self._solver_of(self._keeping()), where.points)
        axes, times = [splines.axis(one) for one in where.axes], self.snapshot_times.tolist()
        parts = build.decomposed(found, where, axes, times, self.left_out)
        scales = list(zip(self.parameters.centre, self.parameters.half_width, strict=True))
        walls, (nx, ny) = (self.domain.lower, self.domain.upper), self.cells
        return packed(axes, scales, walls, (nx, ny), parts)

    def _tell(self, solves: int) -> None:
        seconds = solves * self.full().solve_seconds(1) / build.threads()
        where = self.reduced_models.directory
        kept = "" if where is None else f"; kept in {where}"
        text = f"reduced model: {solves} solves, about {seconds:.0f} s on {build.threads()} threads{kept}"
        warnings.warn(text, Building, stacklevel=2)

    def _compare(self, kept: NDArray[np.float64]) -> NDArray[np.float64]:
        solve = self._solver_of(self._keeping())
        found = build.errors(with_memo(kept), solve, self.held_out, self.parameters)
        worst, text = found.max(), f"at {self.held_out} fresh solves, {len(found[0])} times each"
        percent = 100 * worst / self.noise
        told = f"reduced model: its largest error {text}, is {worst:.2g}, {percent:.2g} % of the noise"
        warnings.warn(told, Building, stacklevel=2)
        return found

    def _judge(self, found: Reduced) -> None:
        worst = float(found.errors.max())
        if worst > self.share * self.noise:
            above = f"more than share={self.share:g} of the noise {self.noise:g}"
            rule = f"the reduced model errs by {worst:.2g}, {above}"
            remedy = "more nodes, narrower bounds, or a larger pde.share"
            raise checks.InvalidValue("nodes", list(self.nodes), rule, remedy=remedy)

    def _keeping(self) -> AdvectionDiffusion:
        """The full model, which keeps its solves until the build is done."""
        return replace(
            self.full(), solutions=replace(self.reduced_models, memory=0.0, directory=self._folder)
        )

    def _coarse(self) -> AdvectionDiffusion:
        """The full model on half the cells each way, for the pilot."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CoarseGrid)
            coarser = tuple(max(9, n // 2) for n in self.cells)
            return replace(self.full(), cells=coarser, true_model=None, solutions=Solutions(memory=0.0))

    def _solver_of(self, model: AdvectionDiffusion) -> build.Solve:
        """Solves of a model at scaled unknowns, with water's values in dry cells."""
        centre, half_width = self.parameters.centre, self.parameters.half_width
        x, y = model._scheme.nearest_water

        def solve(u: NDArray[np.float64]) -> NDArray[np.float32]:
            theta = centre + half_width * u
            snapshots = model.solve(theta)
            return snapshots[:, x, y].reshape(len(snapshots), -1).astype(np.float32)

        return solve
