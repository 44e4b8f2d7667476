"""The entry points of the public API: lists and arrays in, checked components out, kernels applied, rows out.

One item becomes Python floats without numpy; more become columns, views of the caller's array that are never
written to. Errors name the argument, the shapes and the first bad row.  Many rotations are checked at once: the rules
are those for a single one (`Representation.checked`), which also words the error of a row.
"""

from __future__ import annotations

from math import inf, isfinite
from typing import TYPE_CHECKING

from frametool.errors import NamedTuple, ValueInvalid, warn
from frametool.geometry import floats
from frametool.geometry.quaternion import SILENT, TOLERATED

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from frametool.geometry import Array, Components, Indices, Kernel, Namespace, Numbers
    from frametool.geometry.representations import BatchRule, Notation


def single(components: Components) -> bool:
    """Return True if components are the floats of one item."""
    return all(type(part) is float for part in components)


def columns(value: Any, width: int, name: str, *, or_nan: bool = False) -> Components:
    """Split `(..., width)` numbers into columns; those of one item become floats, checked to be finite unless `or_nan`.

    Raises:
        ValueInvalid: another shape, not numbers, or one item that is not finite.
    """
    if isinstance(value, (list, tuple)) and len(value) == width and all(type(part) in (float, int) for part in value):
        parts = tuple(map(float, value))
    else:
        array = as_numbers(value, name)
        if array.ndim == 0 or array.shape[-1] != width:
            raise ValueInvalid(f"{name}: expected shape (..., {width}), got {array.shape}")
        if array.ndim > 1:
            return tuple(array[..., index] for index in range(width))
        parts = tuple(map(float, array.tolist()))
    return parts if or_nan else finite(parts, name)


def matrices(value: Numbers, size: int, name: str) -> Components:
    """Split `(..., size, size)` numbers into size * size columns, row-major.

    Raises:
        ValueInvalid: another shape, not numbers, or one item that is not finite.
    """
    array = as_numbers(value, name)
    if array.shape[-2:] != (size, size):
        raise ValueInvalid(f"{name}: expected shape (..., {size}, {size}), got {array.shape}")
    return columns(array.reshape(*array.shape[:-2], size * size), size * size, name)


def scalars(value: Any, name: str) -> Any:
    """Return one number as a float, or an array of any shape unchanged.

    Raises:
        ValueInvalid: not numbers, or not finite.
    """
    if type(value) in (float, int):
        return finite((float(value),), name)[0]
    array = as_numbers(value, name)
    return finite((float(array),), name)[0] if array.ndim == 0 else all_finite((array,), name)[0]


def as_numbers(value: Numbers, name: str) -> Array:
    """Return an array of real numbers, without a copy if the argument is one.

    Raises:
        ValueInvalid: ragged, masked, or of another kind.
    """
    import numpy as np

    try:
        array = np.asarray(value)
    except ValueError:
        raise ValueInvalid(f"{name}: the rows differ in length; expected an array of numbers") from None
    if array.dtype.kind not in "fiu":
        raise ValueInvalid(f"{name}: expected real numbers, got an array of {array.dtype}")
    if isinstance(value, np.ma.MaskedArray) and value.mask.any():
        raise ValueInvalid(f"{name}: some of its numbers are masked; leave their rows out, or fill them")
    return array


def finite(values: tuple[float, ...], name: str) -> tuple[float, ...]:
    """Return the floats of one item; raise ValueInvalid unless all are finite."""
    if all(map(isfinite, values)):
        return values
    raise ValueInvalid(f"{name}: {' '.join(f'{value:g}' for value in values)} is not finite; give finite numbers")


def all_finite(columns: Components, name: str) -> Components:
    """Return columns; raise ValueInvalid for the first row that is not finite."""
    import numpy as np

    bad = ~np.logical_and.reduce([np.isfinite(column) for column in np.broadcast_arrays(*columns)])
    if bad.any():
        place, row = first_bad(columns, bad, name)
        finite(row, place)
    return columns


def at_row(name: str, row: int, shape: tuple[int, ...]) -> str:
    """Return the name of a row by its number: `xyzw[3]`, `xyzw[0, 3]`."""
    import numpy as np

    place = np.unravel_index(row, shape)
    return f"{name}[{', '.join(str(int(index)) for index in place)}]" if place else name


def first_bad(columns: Components, bad: Any, name: str) -> tuple[str, tuple[float, ...]]:
    """Return the name of the first bad row and its numbers as floats."""
    import numpy as np

    row = int(np.argmax(bad))
    numbers = tuple(float(np.broadcast_to(column, bad.shape).reshape(-1)[row]) for column in columns)
    return at_row(name, row, bad.shape), numbers


def joined(shift: Components, turn: Components, name: str) -> Components:
    """Broadcast translations and rotations to one shape; the translations are copied, and checked to be finite."""
    if single((*shift, *turn)):
        return (*shift, *turn)
    import numpy as np

    from frametool.geometry import arrays

    shape = arrays.batch_shape((*shift, *turn))
    moved = tuple(np.array(np.broadcast_to(part, shape), np.float64, order="C") for part in shift)
    if not all(isfinite(arrays.furthest(part)) for part in moved):
        all_finite(moved, name)
    return *moved, *(part if np.shape(part) == shape else np.broadcast_to(part, shape).copy() for part in turn)


def checked(kernel: Kernel, count: int, inputs: Components, name: str, check: Callable[..., object]) -> Components:
    """Run a kernel that not every finite input suits; `check` validates one item, and the first row that fails."""
    if single(inputs):
        check(*inputs)
        return kernel(*inputs, floats)
    import numpy as np

    from frametool.geometry import arrays

    def refuse() -> None:
        all_finite(inputs, name)
        bad = ~np.logical_and.reduce([np.isfinite(part) for part in arrays.run(kernel, count, inputs, arrays)])
        place, row = first_bad(inputs, bad, name)
        try:
            check(*row)
        except ValueInvalid as error:
            raise ValueInvalid(f"{place}: {error}") from None

    return arrays.run(arrays.guarded(kernel, refuse), count, inputs, arrays)


def run(kernel: Kernel, count: int, inputs: Components, *, functions: bool = True) -> Components:
    """Run a kernel on trusted components; a kernel of arithmetic alone takes no namespace of functions."""
    if single(inputs):
        return kernel(*inputs, floats) if functions else kernel(*inputs)
    from frametool.geometry import arrays

    return arrays.run(kernel, count, inputs, arrays) if functions else arrays.run(kernel, count, inputs)


def number(kernel: Callable[..., Any], inputs: Components) -> Any:
    """Run a kernel that returns one number."""
    return run(lambda *parts: (kernel(*parts),), 1, inputs)[0]


def rows(
    kernel: Kernel, inner: tuple[int, ...], inputs: Components, *args: object, out: Array | None = None
) -> Array:
    """Run a kernel that needs functions; return its components as rows (..., *inner), in `out` if passed."""
    if single(inputs):
        return _one_row(kernel(*inputs, *args, floats), inner, out)
    from frametool.geometry import arrays

    return arrays.rows(kernel, inner, inputs, *args, arrays, out=out)


def moved(
    kernel: Kernel, mover: Components, inputs: Components, name: str, *, out: Array | None = None
) -> Array:
    """Transform vectors, each by its own mover or all by one.

    If a vector is not finite, vectors that would be overwritten are unchanged.
    """
    parts, inner = (*mover, *inputs), (len(inputs),)
    if single(parts):
        return _one_row(kernel(*parts), inner, out)
    from frametool.geometry import arrays

    return arrays.rows(arrays.guarded(kernel, lambda: all_finite(inputs, name)), inner, parts, out=out)


def _one_row(components: Components, inner: tuple[int, ...], out: Array | None) -> Array:
    """Return the components of one item as an array, in `out` if passed."""
    row = stacked(components).reshape(inner)
    if out is None:
        return row
    from frametool.geometry import arrays

    arrays.require_fitting(out, inner)
    out[...] = row
    return out


def stacked(components: Components) -> Array:
    """Return components as rows of a new array."""
    import numpy as np

    return np.stack(components, axis=-1)


def second_moment(components: Components, mass: Array) -> Array:
    """Return sum(w q q^T) over the first axis of the components and the weights: (..., 4, 4)."""
    import numpy as np

    q = np.stack(components, axis=-1)
    moment: Array = np.einsum("n,n...i,n...j->...ij", mass, q, q)
    return moment


def mean_quaternion(components: Components, mass: Array) -> Components:
    """Return the rotation with the least weighted sum of squared matrix differences, over the first axis.

    Source: Markley et al. 2007: the eigenvector of the largest eigenvalue of the second moment.
    """
    import numpy as np

    found = np.linalg.eigh(second_moment(components, mass))[1][..., -1]
    return tuple(found.tolist() if found.ndim == 1 else np.moveaxis(found, -1, 0))


def masses(value: Numbers | None, shape: tuple[int, ...]) -> Array:
    """Return weights of a batch's shape, 1 each if none are passed.

    Raises:
        ValueInvalid: the batch is empty, or the weights are not of its shape, finite, not negative and not all 0.
    """
    import numpy as np

    if 0 in shape:
        raise ValueInvalid("mean of no rotations; give at least one")
    if value is None:
        return np.ones(shape)
    array = as_numbers(value, "weights").astype(np.float64)
    if array.shape != shape:
        raise ValueInvalid(f"weights: expected shape {shape}, got {array.shape}")
    all_finite((array,), "weights")
    if (array < 0.0).any() or not array.any():
        raise ValueInvalid("weights: expected none negative and not all 0")
    return array


# --- many rotations: which rows are invalid and why, and which were normalised ---


class Rotations(NamedTuple):
    """Unit quaternions of n rows, the reasons why rows are invalid, and the rows that were normalised.

    off: the largest deviation from a rotation among the accepted rows
    """

    quaternions: Components
    reasons: dict[int, str]
    mended: Indices
    off: float


def read_rotations(
    notation: Notation, numbers: Sequence[Array], *, degrees: bool = False, normalize: bool = False
) -> Rotations:
    """Return the quaternions of rows of numbers in column order; invalid rows get the identity."""
    import numpy as np

    from frametool.geometry import arrays

    inputs, row = tuple(numbers), notation.representation
    rule = row.batch
    shape = arrays.batch_shape(inputs)
    quaternions = np.empty((4, int(np.prod(shape))))
    off: Array = np.empty(0)  # the deviation of each row, inf if it is refused; empty: nothing to report
    worst = 0.0
    with np.errstate(all="ignore"):
        for place, block in arrays.cut(inputs):
            grades, right, furthest = _repaired(rule, block, arrays, normalize) if rule else (None, block, 0.0)
            worst = max(worst, furthest)
            results = notation.to_quaternion(right, arrays, degrees=degrees)
            if rule is None and not arrays.all_finite(results):
                grades = np.where(np.isfinite(sum(results)), 0.0, np.inf)
            for target, result in zip(quaternions, results, strict=True):
                target[place] = result
            if grades is not None:
                off = off if off.size else np.zeros(quaternions.shape[1])
                off[place] = grades
    refused = np.flatnonzero(off == np.inf)
    flat = [np.broadcast_to(column, shape).reshape(-1) for column in inputs] if refused.size else []
    reasons = dict.fromkeys(refused.tolist(), "the numbers are not a rotation")
    for index in reasons:
        try:
            row.checked([float(column[index]) for column in flat], normalize=normalize)
        except ValueInvalid as error:
            reasons[index] = str(error)
    quaternions[:, refused] = [[0.0], [0.0], [0.0], [1.0]]
    return Rotations(tuple(quaternions), reasons, np.flatnonzero((off > SILENT) & (off < np.inf)), worst)


def _repaired(
    rule: BatchRule, block: Components, xp: Namespace, normalize: bool  # noqa: FBT001 - as of the caller
) -> tuple[Array | None, Components, float]:
    """Return the deviations of a block's rows (None: nothing to report), the block made rotations, and the worst."""
    off = rule.deviation(*block, xp)
    worst = xp.furthest(off)
    if worst <= min(rule.exact, SILENT):
        return None, block, worst
    refused = ~(off < inf) if normalize else ~(off <= TOLERATED)
    (rough,) = ((off > rule.exact) & ~refused).nonzero()
    if rough.size:
        some = rough if rough.size < len(off) else slice(None)
        mended = rule.repair(*(column[some] for column in block), xp)
        block = tuple(column.copy() for column in block)
        for column, values in zip(block, mended, strict=True):
            column[some] = values
    grades = None if worst <= SILENT else xp.where(refused, inf, 0.0 if normalize else off)
    return grades, block, float(off[~refused].max(initial=0.0))


def require_rotations(notation: Notation, inputs: Components, name: str, *, normalize: bool = False) -> Components:
    """Return the quaternions of columns of any shape; warn once about all rows that were normalised.

    Raises:
        ValueInvalid: rows are not rotations; names the first one and how many there are.
    """
    from frametool.geometry import arrays

    shape = arrays.batch_shape(inputs)
    found = read_rotations(notation, inputs, normalize=normalize)
    for row, reason in found.reasons.items():
        more = f" ({len(found.reasons)} such rows)" if len(found.reasons) > 1 else ""
        raise ValueInvalid(f"{at_row(name, row, shape)}: {reason}{more}")
    if found.mended.size and (rule := notation.representation.batch):
        share = f"{found.mended.size} of {found.quaternions[0].size} {rule.what}"
        first = at_row(name, found.mended[0], shape)
        warn(f"{name}: {share} are off by up to {found.off:.2g} (first: {first}) and were normalised")
    return tuple(part.reshape(shape) for part in found.quaternions)
