"""The functions kernels find in `xp` when their components are numpy arrays, and the walk over long ones in blocks.

The only module of the core that needs numpy at import.
"""

from __future__ import annotations

import numpy as np
from numpy import any as some
from numpy import cbrt, copysign, degrees, frexp, ldexp, maximum, minimum, radians, sqrt, where

from frametool.errors import ValueInvalid
from frametool.geometry.trig import doubled_arctan, half_sincos, largest

__all__ = [
    "all_near_one", "bearing", "canonical_sign", "cbrt", "copysign", "degrees", "first_nonzero", "frexp",
    "half_sincos", "half_sincos_deg", "incline", "largest", "ldexp", "length", "maximum", "minimum", "radians", "some",
    "sqrt", "where",
]  # fmt: skip

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.geometry.types import Array, Components, Kernel, Number, Pair, Quaternion

BLOCK = 16384  # rows: numpy's calls cost little beside their work, and the temporaries of a kernel stay in the cache
WIDE = 12  # columns in and out: kernels with more have more temporaries, and get three quarters of the rows
SQRT_HALF = float(np.sqrt(0.5))
np.empty(2**21)  # 16 MiB given back untouched: from then on glibc reuses the memory of blocks instead of mapping anew


def length(x: Number, y: Number, z: Number) -> Number:
    """Return the length of a vector; np.hypot takes two numbers and six times as long."""
    return sqrt(x * x + y * y + z * z)


def all_near_one(values: Number, tolerance: float) -> bool:
    """Say whether all values are within a tolerance of 1; none, and NaN is not."""
    least, most = np.min(values, initial=1.0), np.max(values, initial=1.0)
    return bool(1.0 - tolerance <= least and most <= 1.0 + tolerance)


def first_nonzero(*values: Number) -> Number:
    """Return element by element the first value that is not zero, or the last."""
    found = values[0]
    for value in values[1:]:
        if np.all(found):
            break
        found = where(found == 0.0, value, found)
    return found


def canonical_sign(x: Number, y: Number, z: Number, w: Number) -> Quaternion:
    """Return q or -q: w > 0, or w == 0 and the first non-zero of x, y, z positive; zeros of what is negated are +0.

    A product with +-1 costs a quarter of `where`; only exact zeros need the longer way.
    """
    sign = copysign(1.0, first_nonzero(w, x, y, z))
    return tuple(part * sign if np.all(part) else where(sign < 0.0, 0.0 - part, part) for part in (x, y, z, w))


def incline(rise: Number, run: Number) -> Number:
    """Return the angle of a direction of length 1 to 1e-8, run >= 0.

    Twice that whose tangent is rise / (length + run), which is at most 1; even parts are exactly pi/4.
    """
    length = 0.5 + 0.5 * (rise * rise + run * run)
    angle = doubled_arctan(rise / (length + run))
    even = rise == run
    return where(even, 0.25 * np.pi, angle) if np.any(even) else angle


def bearing(y: Number, x: Number, radius: Number) -> Number:
    """Return the angle of a direction of this length in [-pi, pi], NaN for none."""
    angle = doubled_arctan(y / (radius + abs(x)))
    angle *= copysign(1.0, x)
    angle += np.signbit(x) * copysign(np.pi, y)
    return angle


def half_sincos_deg(angle: Number) -> Pair:
    """Return sine and cosine of half an angle in degrees, exact at multiples of 90 as that of `floats` is."""
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
    """Return the shape components broadcast to.

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
        for start, stop in blocks(int(np.prod(shape)), len(parts) + len(targets)):
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


def blocks(size: int, columns: int = 0) -> Iterator[tuple[int, int]]:
    """Cut a length into blocks, shorter ones for a kernel with many columns in and out."""
    rows = BLOCK if columns <= WIDE else BLOCK * 3 // 4
    for start in range(0, size, rows):
        yield start, min(start + rows, size)


def _cut(column: Number, start: int, stop: int) -> Number:
    """Return a block of a column as contiguous float64; a float stands for every row."""
    return column if isinstance(column, float) else np.ascontiguousarray(column[start:stop], dtype=np.float64)
