"""The functions kernels find in `xp` when their components are numpy arrays, and the walk over long ones in blocks.

The only module of the core that needs numpy at import.
"""

from __future__ import annotations

import numpy as np
from numpy import any as some
from numpy import arctan2 as atan2
from numpy import cbrt, ceil, copysign, degrees, frexp, ldexp, maximum, minimum, radians, sqrt, where

from frametool.errors import ValueInvalid

__all__ = [
    "atan2", "cbrt", "ceil", "copysign", "degrees", "first_nonzero", "frexp", "half_sincos", "half_sincos_deg",
    "largest", "ldexp", "length", "maximum", "minimum", "negated_where", "radians", "some", "sqrt", "where",
]  # fmt: skip

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.geometry.kinds import Array, Components, Kernel, Number, Pair

BLOCK = 8192  # rows: the two dozen temporaries of a kernel stay in a second-level cache of 1 MB
SQRT_HALF = float(np.sqrt(0.5))


def length(x: Number, y: Number, z: Number) -> Number:
    """Give the length of a vector; np.hypot takes two numbers and six times as long."""
    return sqrt(x * x + y * y + z * z)


def largest(x: Number) -> float:
    """Give the largest magnitude."""
    return float(np.abs(x).max(initial=0.0))


def first_nonzero(*values: Number) -> Number:
    """Give element by element the first value that is not zero, or the last."""
    found = values[0]
    for value in values[1:]:
        zero = found == 0.0
        if not np.any(zero):
            break
        found = where(zero, value, found)
    return found


def negated_where(condition: Number, *values: Number) -> Components:
    """Give the values negated where the condition holds, zeros there as +0; else as they are.

    A product with +-1 costs a quarter of `where`; only exact zeros need the longer way.
    """
    sign = 1.0 - 2.0 * condition
    return tuple(
        where(condition, 0.0 - value, value) if np.any(value == 0.0) else value * sign for value in values
    )  # fmt: skip


def half_sincos(angle: Number) -> Pair:
    """Give sine and cosine of half an angle in radians, from the tangent of its quarter.

    One tangent is at least twice as fast as sine and cosine, and at most one eps worse.
    """
    tangent = np.tan(0.25 * angle)
    squared = tangent * tangent
    scale = 1.0 / (1.0 + squared)
    return 2.0 * tangent * scale, (1.0 - squared) * scale


def half_sincos_deg(angle: Number) -> Pair:
    """Give sine and cosine of half an angle in degrees, exact at multiples of 90 as that of `floats` is."""
    half = 0.5 * np.fmod(angle, 720.0)
    quarter = np.rint(half / 90.0)
    rest = half - 90.0 * quarter
    sine, cosine = half_sincos(np.radians(2.0 * rest))
    diagonal = abs(rest) == 45.0
    sine, cosine = where(diagonal, copysign(SQRT_HALF, rest), sine), where(diagonal, SQRT_HALF, cosine)
    turns = quarter.astype(np.int64)
    odd, back = (turns & 1) == 1, (turns & 2) == 2
    sine, cosine = where(odd, cosine, sine), where(odd, 0.0 - sine, cosine)
    return where(back, 0.0 - sine, sine), where(back, 0.0 - cosine, cosine)


def run(kernel: Kernel, count: int, parts: Components, *args: object) -> Components:
    """Apply a kernel to components, some or all of them arrays; give `count` component arrays."""
    shape = batch_shape(parts)
    out = np.empty((count, *shape))
    walk(kernel, parts, out.reshape(count, -1), *args)
    return tuple(out)


def rows(kernel: Kernel, count: int, parts: Components, *args: object) -> Array:
    """Apply a kernel to components; give an array (..., count) of rows."""
    shape = batch_shape(parts)
    out = np.empty((*shape, count))
    walk(kernel, parts, out.reshape(-1, count).T, *args)
    return out


def batch_shape(parts: Components) -> tuple[int, ...]:
    """Give the shape components broadcast to.

    Raises:
        ValueInvalid: they do not.
    """
    try:
        return np.broadcast_shapes(*(np.shape(part) for part in parts))
    except ValueError:
        shapes = " and ".join(dict.fromkeys(str(np.shape(part)) for part in parts))
        raise ValueInvalid(f"batch shapes {shapes} do not broadcast") from None


def walk(kernel: Kernel, parts: Components, targets: Sequence[Array] | Array, *args: object) -> None:
    """Fill flat targets block by block with what the kernel makes of the parts."""
    shape = batch_shape(parts)
    columns = [part if isinstance(part, float) else np.broadcast_to(part, shape).reshape(-1) for part in parts]
    with np.errstate(all="ignore"):
        for start, stop in blocks(int(np.prod(shape))):
            results = kernel(*(_cut(column, start, stop) for column in columns), *args)
            for target, result in zip(targets, results, strict=True):
                target[start:stop] = result


def guarded(kernel: Kernel, complain: Callable[[], None]) -> Kernel:
    """Watch a kernel's first and last component: what is not finite in a row's input is not finite in one of them.

    `complain` then looks at the input itself, raises if that is to blame, and else lets pass.
    """

    def watched(*block: object) -> Components:
        results = kernel(*block)
        if not np.isfinite(np.sum(results[0]) + np.sum(results[-1])):
            complain()
        return results

    return watched


def blocks(size: int) -> Iterator[tuple[int, int]]:
    """Cut a length into blocks."""
    for start in range(0, size, BLOCK):
        yield start, min(start + BLOCK, size)


def _cut(column: Number, start: int, stop: int) -> Number:
    """Give a block of a column as contiguous float64; a float stands for every row."""
    return column if isinstance(column, float) else np.ascontiguousarray(column[start:stop], dtype=np.float64)
