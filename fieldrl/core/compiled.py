"""Compiled functions that are passed between rooms by their address.

numba caches a caller on disk only if what it calls is not part of its type. A forward model or a flow
therefore hands over the address of a C function, and the estimator's or the vehicle's compiled loop
calls it: one cached loop serves every model.

Two signatures are in use (all arrays C-ordered float64):

``MODEL``   (theta (m, p), m, positions (n, 2), times (n,), n, constants, prediction (m, n),
             jacobian (m, n, p))
``FLOW``    (theta (p,), constants, x, y, t, velocity (2,))
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core.event import Listener, install_listener
from numba.extending import intrinsic

_POINTER = types.CPointer(types.float64)
MODEL = types.void(_POINTER, types.int64, _POINTER, _POINTER, types.int64, _POINTER, _POINTER, _POINTER)
FLOW = types.void(_POINTER, _POINTER, types.float64, types.float64, types.float64, _POINTER)


def _call(builder, signature, args):
    """Call the C function at the address args[0] with the rest of the arguments."""
    address, *rest = args
    function = ir.FunctionType(ir.VoidType(), [value.type for value in rest])
    builder.call(builder.inttoptr(address, function.as_pointer()), rest)


def _call_model(typing, address, theta, m, positions, times, n, constants, prediction, jacobian):
    """Call a MODEL function by address; the array arguments are pointers (``array.ctypes``)."""
    signature = types.void(types.int64, *MODEL.args)

    def codegen(context, builder, _signature, args):
        _call(builder, _signature, args)
        return context.get_dummy_value()

    return signature, codegen


def _call_flow(typing, address, theta, constants, x, y, t, velocity):
    """Call a FLOW function by address; the array arguments are pointers (``array.ctypes``)."""
    signature = types.void(types.int64, *FLOW.args)

    def codegen(context, builder, _signature, args):
        _call(builder, _signature, args)
        return context.get_dummy_value()

    return signature, codegen


call_model: Any = intrinsic(_call_model)
call_flow: Any = intrinsic(_call_flow)


@njit(cache=True, error_model="numpy")
def predict_many(kernel, constants, theta, positions, times):
    """Predictions and derivatives of B models, each at n samples of its own.

    Args:
        kernel: address of their MODEL function.
        constants: what it needs of each, (B, k).
        theta: (B, p).
        positions: (B, n, 2) [length].
        times: (B, n) [time].

    Returns:
        (B, n) and (B, n, p).
    """
    (count, p), n = theta.shape, times.shape[1]
    prediction, jacobian = np.empty((count, n)), np.empty((count, n, p))
    for b in range(count):
        call_model(
            kernel, theta[b].ctypes, 1, positions[b].ctypes, times[b].ctypes, n, constants[b].ctypes,
            prediction[b].ctypes, jacobian[b].ctypes,
        )  # fmt: skip
    return prediction, jacobian


def loop(function: Any) -> Any:
    """Compile a loop that allocates nothing, into its callers; numba then need not count references.

    Counting, and calling with many arrays, takes longer than the arithmetic where arrays are as small as the
    unknowns of a fit. An allocation in such a function is refused when it is compiled.
    """
    options = {"cache": True, "error_model": "numpy", "_nrt": False, "forceinline": True}
    return njit(**options)(function)  # pyright: ignore[reportCallIssue]


def told(say: Callable[[], object]) -> AbstractContextManager[object]:
    """Call ``say`` when the body is about to compile a loop of ours that numba has not kept on disk; once."""
    return install_listener("numba:compile", _First(say))


class _First(Listener):
    def __init__(self, say: Callable[[], object]) -> None:
        self._say: Callable[[], object] | None = say

    def on_start(self, event: Any) -> None:
        if self._say and event.data["dispatcher"].py_func.__module__.startswith("fieldrl."):
            say, self._say = self._say, None
            say()

    def on_end(self, event: Any) -> None:
        pass
