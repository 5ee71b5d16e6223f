"""Ordinary classes as flows: compiled by numba where that works, as Python where it does not.

A class has ``velocity(self, theta, x, y, t) -> (u, v)``. For numba, ``self`` becomes a named tuple of the
numbers and arrays that the instance holds, so that a method may use ``self.length`` but not other methods.
Solver and vehicle see ``Ordinary``: velocities at many points, and the address of a function for one.
"""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import warnings
from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np
from numba import carray, cfunc, float64, njit  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import ArrayLike, NDArray

from fieldrl.core import checks
from fieldrl.core.compiled import FLOW

_NUMBERS = ctypes.POINTER(ctypes.c_double)
_CALLBACK = ctypes.CFUNCTYPE(
    None, _NUMBERS, _NUMBERS, ctypes.c_double, ctypes.c_double, ctypes.c_double, _NUMBERS
)
_SIGNATURE = (float64[::1], float64, float64, float64)
_said: set[type] = set()
_kept: dict[Any, tuple[tuple[Any, Any] | None, str]] = {}  # what was compiled in this process
_adapted: dict[int, AdaptedFlow] = {}  # by the flow's id, which it holds; the newest
_MOST = 64


class UncompiledFlow(UserWarning):
    """A flow that numba cannot compile and that runs as Python."""


def adapted(flow: Any) -> Any:
    """The flow as solver and vehicle work with it; itself, where it is so already or is no flow."""
    if hasattr(type(flow), "kernel"):
        return flow
    if id(flow) not in _adapted:
        if not _is_ordinary(flow):
            return flow
        while len(_adapted) >= _MOST:
            _adapted.pop(next(iter(_adapted)))
        _adapted[id(flow)] = _adaptation(flow)
    return _adapted[id(flow)]


def _adaptation(flow: Any) -> AdaptedFlow:
    found = AdaptedFlow(flow, _code(type(flow)))
    if found.reason and type(flow) not in _said and not getattr(flow, "in_python", False):
        _said.add(type(flow))
        warnings.warn(
            f"{type(flow).__name__}.velocity does not compile and runs as Python, which is slower "
            f"({found.reason})",
            UncompiledFlow,
            stacklevel=2,
        )
    return found


@dataclass(frozen=True)
class AdaptedFlow:
    """An ordinary flow, adapted.

    Args:
        wrapped: the flow.
        code: a digest of its source, so that stored solves are those of this code.
    """

    wrapped: Any
    code: str

    def __getstate__(self) -> dict[str, Any]:
        return {"wrapped": self.wrapped, "code": self.code}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)

    @property
    def names(self) -> tuple[str, ...]:
        """Of its parameters, (p,)."""
        return tuple(self.wrapped.names)

    @property
    def units(self) -> tuple[str, ...]:
        """Of its parameters, (p,)."""
        return tuple(self.wrapped.units)

    def velocity(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """Velocity [length/time] at positions (n, 2) [length], (n, 2)."""
        values, places = parameters(theta, len(self.names)), np.ascontiguousarray(points(positions))
        found = np.empty(places.shape)
        if self._compiled is None:
            found[:] = self._in_python(values, places, float(time))
        else:
            self._compiled[1](values, places, float(time), found)
        return found

    @property
    def streamfunction(self) -> Callable[[ArrayLike, ArrayLike, float], NDArray[np.float64]] | None:
        """psi(theta, positions (n, 2), time) -> (n,) [length^2/time]; None where the flow has none."""
        own = getattr(self.wrapped, "streamfunction", None)
        if own is None:
            return None

        def psi(theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
            x, y = points(positions).T
            found = own(parameters(theta, len(self.names)), x, y, float(time))
            return np.array(np.broadcast_to(np.asarray(found, dtype=float), x.shape))

        return psi

    @property
    def kernel(self) -> int:
        """Address of the FLOW function."""
        return self._function[1]

    @cached_property
    def constants(self) -> NDArray[np.float64]:
        """None, (0,)."""
        return np.empty(0)

    @property
    def reason(self) -> str:
        """Why it is not compiled; "" where it is."""
        return self._made[1]

    @property
    def _compiled(self) -> tuple[Any, Any] | None:
        return self._made[0]

    @cached_property
    def _made(self) -> tuple[tuple[Any, Any] | None, str]:
        """velocity(theta, x, y, t) and the same at many points, both compiled, or None and why not."""
        if getattr(self.wrapped, "in_python", False):
            return None, "it is a composition"
        method, constants = type(self.wrapped).velocity, _constants(self.wrapped)
        name = method, constants._fields, tuple(np.asarray(value).tobytes() for value in constants)
        if name not in _kept:
            _kept[name] = _tried(method, constants)
        return _kept[name]

    @cached_property
    def _function(self) -> tuple[Any, int]:
        """What must be kept while its address is in use, and the address."""
        if self._compiled is None:
            callback = _CALLBACK(self._called)
            return callback, int(ctypes.cast(callback, ctypes.c_void_p).value or 0)
        native = _native(self._compiled[0], len(self.names))
        return native, int(native.address)

    def _called(self, theta: Any, _: Any, x: float, y: float, t: float, velocity: Any) -> None:
        """The FLOW function in Python; NaN where the flow raises."""
        velocity[0] = velocity[1] = np.nan
        values = np.array(theta[: len(self.names)])
        velocity[0], velocity[1] = self._in_python(values, np.array([[x, y]]), t)[0]

    def _in_python(self, theta: NDArray, places: NDArray, time: float) -> NDArray[np.float64]:
        """Velocities (n, 2): with arrays, or point by point where the method takes numbers only."""
        x, y = places.T
        try:
            return self._pair(self.wrapped.velocity(theta, x, y, time), len(x))
        except (TypeError, ValueError) as error:
            if isinstance(error, checks.FieldrlError):
                raise
        each = (self.wrapped.velocity(theta, float(a), float(b), time) for a, b in places)
        return np.concatenate([self._pair(one, 1) for one in each])

    def _pair(self, found: Any, size: int) -> NDArray[np.float64]:
        """What ``velocity`` returned, as (size, 2)."""
        if not isinstance(found, Sequence | np.ndarray) or len(found) != 2:
            raise checks.InvalidValue("velocity", found, "must return (u, v), two numbers or arrays")
        return np.stack([np.broadcast_to(np.asarray(part, dtype=float), size) for part in found], axis=-1)


def parameters(theta: ArrayLike, size: int) -> NDArray[np.float64]:
    """theta as an array (size,); raises InvalidValue otherwise."""
    return np.array(checks.vector("theta", np.asarray(theta, dtype=float).tolist(), size))


def points(positions: ArrayLike) -> NDArray[np.float64]:
    """Positions as an array, (n, 2) [length]."""
    return np.asarray(positions, dtype=float).reshape(-1, 2)


def _is_ordinary(flow: Any) -> bool:
    """Whether its velocity takes (theta, x, y, t)."""
    try:
        return len(inspect.signature(flow.velocity).parameters) == 4
    except (TypeError, ValueError, AttributeError):
        return False


def _code(kind: type) -> str:
    try:
        text = inspect.getsource(kind)
    except (OSError, TypeError):
        text = repr(getattr(getattr(kind, "velocity", None), "__code__", kind))
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _constants(flow: Any) -> Any:
    """The numbers and arrays of an instance, as a named tuple that numba understands."""
    kept: dict[str, Any] = {"number_of_parameters": len(flow.names)}
    for name, value in getattr(flow, "__dict__", {}).items():
        if isinstance(value, bool | Real):
            kept[name] = value
        elif isinstance(value, list | tuple | np.ndarray) and not name.startswith("_"):
            array = np.asarray(value)
            if array.dtype.kind in "fib" and array.size:
                kept[name] = np.ascontiguousarray(array, dtype=float)
    kept = {name: value for name, value in kept.items() if not name.startswith("_")}
    return namedtuple("Constants", list(kept))(**kept)


def _tried(method: Any, constants: Any) -> tuple[tuple[Any, Any] | None, str]:
    """What ``_compile`` gives, or None and why it does not."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _compile(method, constants), ""
    except Exception as error:  # whatever numba raises
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        return None, (lines[0] if lines else type(error).__name__)[:160]


def _compile(method: Any, constants: Any) -> tuple[Any, Any]:
    """(velocity(theta, x, y, t), the same at many points); raises what numba raises."""
    method = njit(error_model="numpy")(method)

    @njit(error_model="numpy")
    def velocity(theta, x, y, t):
        u, v = method(constants, theta, x, y, t)
        return float(u), float(v)

    @njit(error_model="numpy")
    def at_points(theta, places, t, out):
        for i in range(places.shape[0]):
            out[i, 0], out[i, 1] = velocity(theta, places[i, 0], places[i, 1], t)

    velocity.compile(_SIGNATURE)
    return velocity, at_points


def _native(velocity: Any, size: int) -> Any:
    """The C function of a compiled velocity."""

    @cfunc(FLOW)
    def native(theta, _, x, y, t, out):
        u, v = velocity(carray(theta, (size,)), x, y, t)
        out[0] = u
        out[1] = v

    return native
