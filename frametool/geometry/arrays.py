"""The functions that kernels find in `xp` for numpy arrays, and the loop over long arrays in blocks.

An output array passed by the caller may have any strides and may overlap the input; the results are the same as for a
new array.  This is the only module of the core that imports numpy at import time.
"""

from __future__ import annotations

import math

import numpy as np

from frametool.errors import ValueInvalid
from frametool.geometry import floats

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from frametool.geometry import Array, Components, Condition, Four, Indices, Kernel, Number, Two

BLOCK = 12288  # rows: amortises the cost of numpy calls, and a kernel's temporaries stay in the cache
fmod, frexp, ldexp, maximum, minimum, sqrt = np.fmod, np.frexp, np.ldexp, np.maximum, np.minimum, np.sqrt
SIGN_BIT = np.int64(-(2**63))
np.empty(2**21)  # allocate and free 16 MiB once: glibc then reuses the memory of blocks instead of mapping it again


def furthest(x: Array, centre: float = 0.0) -> float:
    """Return the largest distance of a value from a number, NaN if one value is NaN.

    All kernels use it as a guard: minimum and maximum cost 0.13 ns per row each, half of `abs` and its maximum, and
    check finiteness, norm and magnitude at once, which is all that a regular block needs.
    """
    values = np.asarray(x)
    least, most = values.min(initial=centre), values.max(initial=centre)
    return float(max(most - centre, centre - least))


def mask(condition: Condition) -> Any:
    """Return what `where` needs of a condition, computed once for several choices."""
    return condition if isinstance(condition, bool) else -condition.astype(np.int64)


def where(condition: Any, yes: Array | float, no: Array | float) -> Array:
    """Choose element by element, by a condition or its `mask`.

    On the bits: `np.where` branches, which costs 4 ns where neighbours differ; this costs 0.9, or 0.5 with a mask.
    """
    if isinstance(condition, (bool, np.bool_)):
        return np.where(condition, yes, no)
    bits = condition if condition.dtype == np.int64 else mask(condition)
    other = np.asarray(no, np.float64).view(np.int64)
    chosen: Indices = (np.asarray(yes, np.float64).view(np.int64) ^ other) & bits
    chosen ^= other
    return chosen.view(np.float64)


def least(x: Array) -> float:
    """Return the minimum, NaN if one value is NaN."""
    return float(np.asarray(x).min(initial=np.inf))


def some(condition: Condition) -> bool:
    """Return True if a condition holds anywhere; the method of arrays costs half of `np.any`."""
    return condition if isinstance(condition, bool) else bool(condition.any())


def copysign(size: Array | float, sign: Array) -> Array:
    """Return numbers with a magnitude >= 0 and the sign of another; on the bits this costs half of `np.copysign`."""
    return (_sign_bits(sign) | np.asarray(size, np.float64).view(np.int64)).view(np.float64)


def _sign_bits(x: Array | float) -> Indices:
    """Return the sign bit of every number, all other bits 0."""
    bits: Indices = np.asarray(x, np.float64).view(np.int64) & SIGN_BIT
    return bits


def canonical_sign(x: Array, y: Array, z: Array, w: Array) -> Four[Array]:
    """Return q or -q such that w > 0, or w == 0 and the first non-zero of x, y, z is positive; no -0 where negated.

    Flipping bits costs 0.2 ns per number, `where` 0.85.  The added zero is +0 where the sign was flipped, and
    -0 elsewhere, which changes nothing.
    """
    found = w
    for part in (x, y, z):  # where all before are zero
        if np.asarray(found).all():
            break
        found = where(found == 0.0, part, found)
    flip = _sign_bits(found)
    zero = (flip ^ SIGN_BIT).view(np.float64)
    signed = []
    for part in (x, y, z, w):
        turned = (np.asarray(part, np.float64).view(np.int64) ^ flip).view(np.float64)
        turned += zero
        signed.append(turned)
    return signed[0], signed[1], signed[2], signed[3]


def doubled_sincos(y: Array) -> Two[Array]:
    """Return sine and cosine of 2y, |y| <= pi/4.

    The rounding error of sin y is added to its square, so that the cosine of a right angle vanishes to half an eps.
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
    """Return 2 atan(t), |t| <= 1, at most 1 eps off; exactly pi/2 for t = 1."""
    squared = tangent * tangent
    rest = floats.polynomial(squared, floats.ARC_ABOVE)
    rest /= floats.polynomial(squared, floats.ARC_BELOW)
    rest *= squared
    rest *= tangent
    rest = tangent - rest
    rest *= 2.0
    return rest


def reduced_exactly(x: Array) -> Two[Array]:
    """Return angles minus the nearest multiples of a quarter turn, and these multiples modulo 2.

    Rows that are small enough for `floats.reduced` give the same bits as with it.
    """
    x = np.atleast_1d(x)
    rest, turns = floats.reduced(x)
    for row in np.argwhere(~(abs(x) < floats.FAR)).tolist():
        rest[*row], turns[*row] = floats.reduced_exactly(float(x[*row]))
    return rest, turns


def run(kernel: Kernel, count: int, parts: Components, *args: object) -> Components:
    """Apply a kernel to components, some or all of them arrays; return `count` component arrays."""
    out = np.empty((count, *batch_shape(parts)))
    walk(kernel, parts, out.reshape(count, -1), *args)
    return tuple(out)


def rows(
    kernel: Kernel, inner: tuple[int, ...], parts: Components, *args: object, out: Array | None = None
) -> Array:
    """Apply a kernel to components; return rows (..., *inner), in `out` if the caller passes it.

    If `out` is not contiguous or overlaps components, the result is computed in a new array first.
    """
    shape = (*batch_shape(parts), *inner)
    direct = False  # whether an output array can be filled row by row while components are read
    if out is not None:
        require_fitting(out, shape)
        overlaps = any(np.shares_memory(out, part) for part in parts if not isinstance(part, float))
        direct = out.flags.c_contiguous and not overlaps
    made = out if out is not None and direct else np.empty(shape)
    walk(kernel, parts, np.asarray(made).reshape(-1, int(np.prod(inner))).T, *args)
    if out is None or direct:
        return made
    out[...] = made
    return out


def batch_shape(parts: Components) -> tuple[int, ...]:
    """Return the shape to which components broadcast.

    Raises:
        ValueInvalid: they do not broadcast.
    """
    shapes: dict[tuple[int, ...], None] = dict.fromkeys(getattr(part, "shape", ()) for part in parts)
    if len(shapes) == 1:
        return next(iter(shapes))
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValueInvalid(f"batch shapes {' and '.join(map(str, shapes))} do not broadcast") from None


def walk(kernel: Kernel, parts: Components, targets: Sequence[Array] | Array, *args: object) -> None:
    """Fill flat targets block by block with the results of a kernel."""
    with np.errstate(all="ignore"):
        for place, block in cut(parts):
            for target, result in zip(targets, kernel(*block, *args), strict=True):
                target[place] = result


def guarded(kernel: Kernel, complain: Callable[[], object]) -> Kernel:
    """Watch a kernel's results for values that are not finite.

    `complain` then checks the input itself and raises an error if the input is the reason.
    """

    def watched(*block: object) -> Components:
        results = kernel(*block)
        if not all_finite(results):
            complain()
        return results

    return watched


def all_finite(results: Components) -> bool:
    """Return True if all results are finite; the first and the last suffice: an error in a row shows in one of them."""
    return math.isfinite(np.asarray(results[0]).sum() + np.asarray(results[-1]).sum())


def cut(parts: Components) -> Iterator[tuple[slice, Components]]:
    """Cut flat components into blocks of contiguous float64."""
    shape = batch_shape(parts)
    columns: list[Number] = []  # without the calls that most columns do not need: they take microseconds each
    for part in parts:
        if isinstance(part, np.ndarray):
            part = part if part.shape == shape else np.broadcast_to(part, shape)  # noqa: PLW2901
            columns.append(part if part.ndim == 1 else part.reshape(-1))
        else:
            columns.append(float(part))
    for start, stop in blocks(int(np.prod(shape))):
        yield slice(start, stop), tuple(
            column if isinstance(column, float) else np.ascontiguousarray(column[start:stop], dtype=np.float64)
            for column in columns
        )


def blocks(size: int) -> Iterator[tuple[int, int]]:
    """Cut a length into blocks."""
    for start in range(0, size, BLOCK):
        yield start, min(start + BLOCK, size)


def require_fitting(out: Any, shape: tuple[int, ...]) -> None:
    """Raise ValueInvalid unless `out` is a writable numpy array of float64 of this shape."""
    is_array = isinstance(out, np.ndarray)
    if is_array and out.dtype == np.float64 and out.shape == shape and out.flags.writeable:
        return
    found = f"a {type(out).__name__}"
    if is_array:
        found = f"{out.dtype} of shape {out.shape}" + ", read-only" * (not out.flags.writeable)
    raise ValueInvalid(f"out: expected a writable float64 array of shape {shape}, got {found}")
