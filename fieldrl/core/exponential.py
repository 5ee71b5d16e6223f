"""exp(x) of many x <= 0 at once: the digits of the C library's exp, several numbers at a time.

LLVM computes several numbers at a time of a loop, unless there is a call in it. So this is the algorithm of
the C library (Szabolcs Nagy, ARM optimized routines, math/exp.c; glibc has it since 2.28), which needs none:

    exp(x) = 2^(k/N) exp(r),  k = round(N x / ln 2),  r = x - k ln 2 / N,  2^(j/N) = head_j (1 + tail_j)

with a polynomial of fifth order for exp(r) - 1, and multiplications and additions fused. Where its result or
what it is made of may be no normal number, the C library is called.

| symbol | meaning | shape |
|---|---|---|
| head | bits of 2^(j/N), less those that k adds to its exponent | (N,) |
| tail | what 2^(j/N) is more than that, relative to it | (N,) |
"""

from __future__ import annotations

import math
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from fieldrl.core.compiled import loop

_BITS = 7
_N = 1 << _BITS
_LEAST = -512.0  # below it, the C library scales its result twice
_PER_LN2 = float.fromhex("0x1.71547652b82fep0") * _N
_LN2_HIGH, _LN2_LOW = float.fromhex("-0x1.62e42fefa0000p-8"), float.fromhex("-0x1.cf79abc9e3b39p-47")
_ROUND = float.fromhex("0x1.8p52")  # added and taken away again, it rounds to whole numbers
_C2, _C3 = float.fromhex("0x1.ffffffffffdbdp-2"), float.fromhex("0x1.555555555543cp-3")
_C4, _C5 = float.fromhex("0x1.55555cf172b91p-5"), float.fromhex("0x1.1111167a4d017p-7")
_LAST, _SHIFT = np.uint64(_N - 1), np.uint64(52 - _BITS)


def _table() -> tuple[NDArray[np.uint64], NDArray[np.float64]]:
    """head and tail."""
    head, tail = np.empty(_N), np.empty(_N)
    with localcontext() as context:
        context.prec = 60
        for j in range(_N):
            exact = (Decimal(2).ln() * j / _N).exp()
            head[j] = float(exact)
            tail[j] = float(exact / Decimal(head[j].item()) - 1)
    return head.view(np.uint64) - (np.arange(_N, dtype=np.uint64) << _SHIFT), tail


_HEAD, _TAIL = _table()


def _fused(typing, a, b, c):
    """a b + c, rounded once."""

    def codegen(context, builder, signature, args):
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), codegen


def _bits_of(typing, number):
    """The bits of a number as an integer."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.uint64(types.float64), codegen


def _number_of(typing, bits):
    """The number that has these bits."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.uint64), codegen


_fma: Any = intrinsic(_fused)
_bits: Any = intrinsic(_bits_of)
_number: Any = intrinsic(_number_of)


@loop
def _exponential(x):
    rounded = _fma(_PER_LN2, x, _ROUND)
    k, whole = _bits(rounded), rounded - _ROUND
    r = _fma(whole, _LN2_LOW, _fma(whole, _LN2_HIGH, x))
    j = np.int64(k & _LAST)
    square = r * r
    more = _fma(square, _fma(r, _C3, _C2), _TAIL[j] + r)
    more = _fma(square * square, _fma(r, _C5, _C4), more)
    scale = _number(_HEAD[j] + (k << _SHIFT))
    return _fma(scale, more, scale)


@loop
def exponential(x):
    """exp(x) of one x <= 0."""
    return _exponential(x) if x > _LEAST else math.exp(x)


@loop
def exponentials(x, result):
    """exp of x (n,), all <= 0, written into ``result`` (n,)."""
    rare = 0
    for i in range(x.size):
        rare += not x[i] > _LEAST
        result[i] = _exponential(x[i])
    if rare:
        for i in range(x.size):
            if not x[i] > _LEAST:
                result[i] = math.exp(x[i])
