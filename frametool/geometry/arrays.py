"""The functions kernels find in `xp` when their components are numpy arrays, and the walk over long ones in blocks.

The array that a caller wants results in may have any strides, and may lie where the input lies: the results are those
of a fresh array all the same.  The only module of the core that needs numpy at import.
"""

from __future__ import annotations

import math

import numpy as np
from numpy import fmod, frexp, ldexp, maximum, minimum, sqrt

from frametool.errors import ValueInvalid
from frametool.geometry import floats

__all__ = [
    "canonical_sign", "copysign", "doubled_arctan", "doubled_sincos", "first_nonzero", "fmod", "frexp", "furthest",
    "ldexp", "least", "mask", "maximum", "minimum", "reduced_exactly", "some", "sqrt", "where",
]  # fmt: skip

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from frametool.geometry.types import Array, Components, Condition, Four, Indices, Kernel, Number, Two

BLOCK = 16384  # rows: numpy's calls cost little beside their work, and the temporaries of a kernel stay in the cache
WIDE = 12  # columns in and out: kernels with more have more temporaries, and get three quarters of the rows
SIGN_BIT = np.int64(-(2**63))
np.empty(2**21)  # 16 MiB given back untouched: from then on glibc reuses the memory of blocks instead of mapping anew


def furthest(x: Array, centre: float = 0.0) -> float:
    """Return how far the furthest value is from a number, NaN if one is NaN.

    The guard of all kernels: a minimum and a maximum cost 0.13 ns a row each, half of `abs` and its maximum, and
    say of finiteness, norm and magnitude at once all that a block needs where nothing is odd.
    """
    values = np.asarray(x)
    least, most = values.min(initial=centre), values.max(initial=centre)
    return float(max(most - centre, centre - least))


def mask(condition: Condition) -> Any:
    """Return what `where` needs of a condition, made once for several choices."""
    return condition if isinstance(condition, bool) else -condition.astype(np.int64)


def where(condition: Any, yes: Array | float, no: Array | float) -> Array:
    """Choose element by element, by a condition or its `mask`.

    By bits: `np.where` branches, which costs 4 ns where neighbours differ; this 0.9, or 0.5 by a mask.
    """
    if isinstance(condition, (bool, np.bool_)):
        return np.where(condition, yes, no)
    bits = condition if condition.dtype == np.int64 else mask(condition)
    other = np.asarray(no, np.float64).view(np.int64)
    chosen: Indices = (np.asarray(yes, np.float64).view(np.int64) ^ other) & bits
    chosen ^= other
    return chosen.view(np.float64)


def least(x: Array) -> float:
    """Return the least value, NaN if one is NaN."""
    return float(np.asarray(x).min(initial=np.inf))


def some(condition: Condition) -> bool:
    """Tell whether a condition holds anywhere; the method of arrays costs half of `np.any`."""
    return condition if isinstance(condition, bool) else bool(condition.any())


def copysign(size: Array | float, sign: Array) -> Array:
    """Return numbers of a size, which is not negative, and a sign; by bits it costs half of `np.copysign`."""
    return (_sign_bits(sign) | np.asarray(size, np.float64).view(np.int64)).view(np.float64)


def _sign_bits(x: Array | float) -> Indices:
    """Return the sign bit of every number, all other bits 0."""
    bits: Indices = np.asarray(x, np.float64).view(np.int64) & SIGN_BIT
    return bits


def first_nonzero(*values: Array) -> Array:
    """Return element by element the first value that is not zero, or the last."""
    found = values[0]
    for value in values[1:]:
        if np.asarray(found).all():
            break
        found = where(found == 0.0, value, found)
    return found


def canonical_sign(x: Array, y: Array, z: Array, w: Array) -> Four[Array]:
    """Return q or -q: w > 0, or w == 0 and the first non-zero of x, y, z positive; zeros of what is negated are +0.

    Flipping bits costs 0.2 ns a number, `where` 0.85.  The zero that is added is +0 where the sign was flipped, and
    -0 elsewhere, which changes nothing.
    """
    flip = _sign_bits(first_nonzero(w, x, y, z))
    zero = (flip ^ SIGN_BIT).view(np.float64)
    signed = []
    for part in (x, y, z, w):
        turned = (np.asarray(part, np.float64).view(np.int64) ^ flip).view(np.float64)
        turned += zero
        signed.append(turned)
    return signed[0], signed[1], signed[2], signed[3]


def doubled_sincos(y: Array) -> Two[Array]:
    """Return sine and cosine of 2y, |y| <= pi/4.

    The rounding of sin y is added to its square, so that the cosine of a right angle vanishes to half an eps.
    """
    squared = y * y
    bend = floats.polynomial(squared, floats.SINE)
    bend *= squared
    bend *= y
    sine = y + bend
    rounding = y - sine
    rounding += bend
    rounding *= sine
    rounding *= 2.0
    squared = sine * sine
    squared += rounding
    root = sqrt(1.0 - squared)
    root *= 2.0
    root *= sine
    squared *= -2.0
    squared += 1.0
    level = squared < floats.LEVEL
    if some(level):
        squared = where(level, floats.RIGHT_ANGLE - abs(y + y) + floats.RIGHT_ANGLE_REST, squared)
    return root, squared


def doubled_arctan(tangent: Array) -> Array:
    """Return 2 atan(t), |t| <= 1, at most 1 eps off; of 1 it is pi/2 to the bit."""
    squared = tangent * tangent
    rest = floats.polynomial(squared, floats.ARC_ABOVE)
    rest /= floats.monic_polynomial(squared, floats.ARC_BELOW)
    rest *= squared
    rest *= tangent
    rest = tangent - rest
    rest *= 2.0
    return rest


def reduced_exactly(x: Array) -> Two[Array]:
    """Return what is left of angles less the nearest whole numbers of quarter turns, and those numbers modulo 2.

    Rows near enough for `floats.reduced` have what they have among their like.
    """
    x = np.atleast_1d(x)
    rest, turns = floats.reduced(x)
    for row in np.argwhere(~(abs(x) < floats.FAR)).tolist():
        rest[*row], turns[*row] = floats.reduced_exactly(float(x[*row]))
    return rest, turns


def run(kernel: Kernel, count: int, parts: Components, *args: object) -> Components:
    """Apply a kernel to components, some or all of them arrays; return `count` component arrays."""
    shape = batch_shape(parts)
    out = np.empty((count, *shape))
    walk(kernel, parts, out.reshape(count, -1), *args)
    return tuple(out)


def rows(
    kernel: Kernel, inner: tuple[int, ...], parts: Components, *args: object, out: Array | None = None
) -> Array:
    """Apply a kernel to components; return rows (..., *inner), in `out` where the caller gives one.

    Where rows are written over components that are still to be read, a fresh array is made first.
    """
    shape = (*batch_shape(parts), *inner)
    if out is not None:
        require_fitting(out, shape)
        columns = flat_columns(out, len(inner))
        touched = tuple(part for part in parts if shares_memory(out, (part,)))
        if columns is not None and (not touched or in_step(out, len(inner), touched)):
            walk(kernel, parts, columns, *args)
            return out
    fresh = np.empty(shape)
    walk(kernel, parts, fresh.reshape(-1, int(np.prod(inner))).T, *args)
    if out is None:
        return fresh
    out[...] = fresh
    return out


def batch_shape(parts: Components) -> tuple[int, ...]:
    """Return the shape components broadcast to.

    Raises:
        ValueInvalid: they do not.
    """
    shapes: dict[tuple[int, ...], None] = dict.fromkeys(getattr(part, "shape", ()) for part in parts)
    if len(shapes) == 1:
        return next(iter(shapes))
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValueInvalid(f"batch shapes {' and '.join(map(str, shapes))} do not broadcast") from None


def walk(kernel: Kernel, parts: Components, targets: Sequence[Array] | Array, *args: object) -> None:
    """Fill flat targets block by block with what the kernel makes of the parts."""
    with np.errstate(all="ignore"):
        for place, block in cut(parts, len(targets)):
            for target, result in zip(targets, kernel(*block, *args), strict=True):
                target[place] = result


def guarded(kernel: Kernel, complain: Callable[[], object]) -> Kernel:
    """Watch a kernel's results for what is not finite.

    `complain` then looks at the input itself, raises if that is to blame, and else lets pass.
    """

    def watched(*block: object) -> Components:
        results = kernel(*block)
        if not all_finite(results):
            complain()
        return results

    return watched


def all_finite(results: Components) -> bool:
    """Tell whether all results are finite, by the first and the last: what goes wrong in a row shows in one of them."""
    return math.isfinite(np.asarray(results[0]).sum() + np.asarray(results[-1]).sum())


def finite_throughout(parts: Components) -> bool:
    """Tell whether all components are finite."""
    return all(np.isfinite(np.min(part)) and np.isfinite(np.max(part)) for _, block in cut(parts, 0) for part in block)


def cut(parts: Components, targets: int) -> Iterator[tuple[slice, Components]]:
    """Cut components, flat, into blocks of contiguous float64 for a kernel that fills so many targets."""
    shape = batch_shape(parts)
    columns = [_flat(part, shape) if isinstance(part, np.ndarray) else float(part) for part in parts]
    for start, stop in blocks(int(np.prod(shape)), len(parts) + targets):
        yield slice(start, stop), tuple(_cut(column, start, stop) for column in columns)


def _flat(part: Array, shape: tuple[int, ...]) -> Array:
    """Return a column of a shape as one axis; the calls that most columns need not cost microseconds each."""
    if part.shape != shape:
        part = np.broadcast_to(part, shape)
    return part if part.ndim == 1 else part.reshape(-1)


def blocks(size: int, columns: int = 0) -> Iterator[tuple[int, int]]:
    """Cut a length into blocks, shorter ones for a kernel with many columns in and out."""
    rows = BLOCK if columns <= WIDE else BLOCK * 3 // 4
    for start in range(0, size, rows):
        yield start, min(start + rows, size)


def _cut(column: Number, start: int, stop: int) -> Number:
    """Return a block of a column as contiguous float64; a float stands for every row."""
    return column if isinstance(column, float) else np.ascontiguousarray(column[start:stop], dtype=np.float64)


def require_fitting(out: object, shape: tuple[int, ...]) -> None:
    """Raise ValueInvalid unless `out` is a numpy array of float64, writable and of this shape."""
    if not isinstance(out, np.ndarray):
        found = f"a {type(out).__name__}"
    elif out.dtype != np.float64:
        found = f"one of {out.dtype}"
    elif out.shape != shape:
        found = f"shape {out.shape}"
    elif not out.flags.writeable:
        found = "a read-only one"
    else:
        return
    raise ValueInvalid(f"out: expected a writable float64 array of shape {shape}, got {found}")


def flat_columns(out: Array, axes: int) -> Sequence[Array] | None:
    """Return flat views of each component of rows that fill the last axes; None where strides allow no such view."""
    out, shape = out.view(np.ndarray), out.shape[out.ndim - axes :]  # of a np.matrix no component has one axis
    if out.flags.c_contiguous:
        return list(out.reshape(-1, int(np.prod(shape))).T)
    columns = [out[(..., *place)].reshape(-1) for place in np.ndindex(*shape)]
    return columns if np.may_share_memory(columns[0], out) else None


def shares_memory(out: Array, parts: Components) -> bool:
    """Tell whether writing to `out` changes components that are arrays."""
    return any(not isinstance(part, float) and np.shares_memory(out, part) for part in parts)


def in_step(out: Array, axes: int, parts: Components) -> bool:
    """Tell whether components are those of `out` itself, in their order: a row is read before it is written."""
    own = [out[(..., *place)] for place in np.ndindex(*out.shape[out.ndim - axes :])]
    return len(own) == len(parts) and all(_place(part) == _place(mine) for part, mine in zip(parts, own, strict=True))


def _place(part: Array) -> tuple[object, ...]:
    return part.dtype, part.__array_interface__["data"][0], part.shape, part.strides
