"""The doors of the public face: lists and arrays in, checked components out.

One item becomes Python floats without numpy; more become columns, views of the caller's array that are never
written to. Errors name the argument, the shapes and the first bad row.
"""

from __future__ import annotations

from math import isfinite

from frametool.errors import ValueInvalid, warn
from frametool.geometry import floats, matrix, quaternion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from frametool.geometry.kinds import Array, Components, Kernel, Matrix, Numbers


def single(components: Components) -> bool:
    """Say whether components are the floats of one item."""
    return all(type(part) is float for part in components)


def columns(value: Any, width: int, name: str) -> Components:
    """Take `(..., width)` numbers apart into columns; those of one item become floats and are checked to be finite.

    Raises:
        ValueInvalid: another shape, no numbers, or one item that is not finite.
    """
    if isinstance(value, (list, tuple)) and len(value) == width and all(type(part) in (float, int) for part in value):
        return finite(tuple(map(float, value)), name)
    array = as_numbers(value, name)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueInvalid(f"{name}: expected shape (..., {width}), got {array.shape}")
    return parts(array, name)


def parts(array: Array, name: str) -> Components:
    """Take the last axis of an array apart."""
    if array.ndim == 1:
        return finite(tuple(map(float, array.tolist())), name)
    return tuple(array[..., index] for index in range(array.shape[-1]))


def matrices(value: Numbers, size: int, name: str) -> Components:
    """Take `(..., size, size)` numbers apart into size * size columns, row-major.

    Raises:
        ValueInvalid: another shape, no numbers, or one item that is not finite.
    """
    array = as_numbers(value, name)
    if array.shape[-2:] != (size, size):
        raise ValueInvalid(f"{name}: expected shape (..., {size}, {size}), got {array.shape}")
    return parts(array.reshape(*array.shape[:-2], size * size), name)


def scalars(value: Any, name: str) -> Any:
    """Take one number as a float, or an array of any shape as it is.

    Raises:
        ValueInvalid: no numbers, or not finite.
    """
    if type(value) in (float, int):
        return finite((float(value),), name)[0]
    array = as_numbers(value, name)
    return finite((float(array),), name)[0] if array.ndim == 0 else _all_finite((array,), name)[0]


def as_numbers(value: Numbers, name: str) -> Array:
    """Make an array of real numbers of what is given, without a copy where it is one.

    Raises:
        ValueInvalid: ragged, or of another kind.
    """
    import numpy as np

    try:
        array = np.asarray(value)
    except ValueError:
        raise ValueInvalid(f"{name}: the rows differ in length; expected an array of numbers") from None
    if array.dtype.kind not in "fiu":
        raise ValueInvalid(f"{name}: expected real numbers, got an array of {array.dtype}")
    return array


def finite(values: tuple[float, ...], name: str) -> tuple[float, ...]:
    """Give the floats of one item back; raise ValueInvalid unless all are finite."""
    if all(map(isfinite, values)):
        return values
    raise ValueInvalid(f"{name}: {' '.join(f'{value:g}' for value in values)} is not finite; give finite numbers")


def complain_of(columns: Components, name: str) -> Callable[[], None]:
    """Make the look for the first row that is not finite, for kernels that ran into one."""

    def complain() -> None:
        _all_finite(columns, name)

    return complain


def _all_finite(columns: Components, name: str) -> Components:
    import numpy as np

    bad = ~np.logical_and.reduce([np.isfinite(column) for column in np.broadcast_arrays(*columns)])
    if bad.any():
        raise ValueInvalid(f"{at_first(name, bad)}: {shown_row(columns, bad)} is not finite; give finite numbers")
    return columns


def at_first(name: str, bad: Any) -> str:
    """Name the first bad row: `xyzw[3]`."""
    import numpy as np

    place = np.unravel_index(int(np.argmax(bad)), bad.shape)
    return f"{name}[{', '.join(str(int(index)) for index in place)}]" if place else name


def first_row(columns: Components, bad: Any) -> tuple[float, ...]:
    """Give the numbers of the first bad row as floats."""
    import numpy as np

    row = int(np.argmax(bad))
    return tuple(float(np.broadcast_to(column, bad.shape).reshape(-1)[row]) for column in columns)


def shown_row(columns: Components, bad: Any) -> str:
    """Show the numbers of the first bad row."""
    return " ".join(f"{value:g}" for value in first_row(columns, bad))


class _Irregular(Exception):  # noqa: N818 - never leaves this module
    """A block holds rows that are not plainly rotations."""


def unit_quaternions(given: Components, name: str, *, normalize: bool) -> Components:
    """Check many quaternions and give them unit; those unit to 4 eps keep their bits.

    The rules are those of `quaternion.check`; warnings are one for all rows.

    Raises:
        ValueInvalid: naming the first row that is no rotation.
    """
    from frametool.geometry import arrays

    try:
        return arrays.run(_plainly_unit, 4, given)
    except _Irregular:
        return arrays.run(_quaternion_sifter(given, name, normalize=normalize), 4, given)


def _plainly_unit(x: Any, y: Any, z: Any, w: Any) -> Components:
    """Pass a block whose rows need no word; most are unit already."""
    from frametool.geometry import arrays

    off = arrays.largest(quaternion.squared_norm(x, y, z, w) - 1.0)
    if off <= quaternion.UNIT:
        return x, y, z, w
    if off <= quaternion.SILENT:
        return quaternion.unit(x, y, z, w, arrays)
    raise _Irregular


def _quaternion_sifter(given: Components, name: str, *, normalize: bool) -> Kernel:
    """Refuse or warn about whatever must be, over all rows; give the kernel that then normalises."""
    import numpy as np

    from frametool.geometry import arrays

    def grade(x: Any, y: Any, z: Any, w: Any) -> Components:
        squared = quaternion.squared_norm(x, y, z, w)
        if normalize:
            largest = np.maximum(np.maximum(abs(x), abs(y)), np.maximum(abs(z), abs(w)))
            return (np.where((largest > 0.0) & (largest < np.inf), 0.0, np.inf),)
        return (abs(np.sqrt(squared) - 1.0),)

    (off,) = arrays.run(grade, 1, given)
    refuse_or_warn(off, given, name, "quaternions", lambda row: quaternion.check(*row, normalize=normalize))

    def kernel(x: Any, y: Any, z: Any, w: Any) -> Components:
        unit = abs(quaternion.squared_norm(x, y, z, w) - 1.0) <= quaternion.UNIT
        after = quaternion.normalized(x, y, z, w, arrays)
        return tuple(np.where(unit, old, new) for old, new in zip((x, y, z, w), after, strict=True))

    return kernel


def refuse_or_warn(off: Any, given: Components, name: str, what: str, check: Callable[..., object]) -> None:
    """Raise for the first row that is off beyond what is tolerated; warn once for those off beyond silence."""
    import numpy as np

    bad = ~(off <= quaternion.TOLERATED)
    if bad.any():
        try:
            check(first_row(given, bad))
        except ValueInvalid as error:
            count = int(bad.sum())
            more = f" ({count} such rows)" if count > 1 else ""
            raise ValueInvalid(f"{at_first(name, bad)}: {error}{more}") from None
    odd = (off > quaternion.SILENT) & ~bad
    if odd.any():
        largest = float(np.max(off, where=odd, initial=0.0))
        count = f"{int(odd.sum())} of {odd.size} {what}"
        warn(f"{name}: {count} are off by up to {largest:.2g} (first: {at_first(name, odd)}) and were normalised")


def rotation_quaternions(given: Components, name: str, *, normalize: bool) -> Components:
    """Check many matrices, nine columns, and give the quaternions of the nearest rotations.

    The rules are those of `matrix.check`; warnings are one for all rows.

    Raises:
        ValueInvalid: naming the first row that is no rotation.
    """
    from frametool.geometry import arrays

    try:
        return arrays.run(_plainly_rotations, 4, given)
    except _Irregular:
        return arrays.run(_matrix_sifter(given, name, normalize=normalize), 4, given)


def _plainly_rotations(*given: Any) -> Components:
    """Convert a block of matrices that need no word."""
    from frametool.geometry import arrays

    entries: Matrix = given
    off = matrix.defect(*entries, arrays)
    if not arrays.largest(off) <= quaternion.SILENT or not matrix.determinant(*entries).min(initial=1.0) > 0.0:
        raise _Irregular
    return matrix.to_quaternion(*_projected(entries, off > matrix.ORTHONORMAL), arrays)


def _projected(entries: Matrix, rough: Any) -> Matrix:
    """Replace the rough rows of a block by their nearest rotations."""
    from frametool.geometry import arrays

    if not rough.any():
        return entries
    chosen_rows: Matrix = tuple(entry[rough] for entry in entries)
    nearest = matrix.nearest(*matrix.scaled(*chosen_rows, arrays), arrays)
    after: Matrix = tuple(entry.copy() for entry in entries)
    for column, values in zip(after, nearest, strict=True):
        column[rough] = values
    return after


def _matrix_sifter(given: Components, name: str, *, normalize: bool) -> Kernel:
    """Refuse or warn about whatever must be, over all rows; give the kernel that then projects and converts."""
    import numpy as np

    from frametool.geometry import arrays

    def grade(*block: Any) -> Components:
        entries: Matrix = block
        off = matrix.defect(*entries, arrays)
        volume = matrix.relative_volume(*entries, arrays)
        return (np.where(volume > matrix.SINGULAR, 0.0 if normalize else off, np.inf),)

    (off,) = arrays.run(grade, 1, given)
    refuse_or_warn(off, given, name, "matrices", lambda row: matrix.check(*row, normalize=normalize))

    def kernel(*block: Any) -> Components:
        entries: Matrix = block
        rough = matrix.defect(*entries, arrays) > matrix.ORTHONORMAL
        return matrix.to_quaternion(*_projected(entries, rough), arrays)

    return kernel


def convert(kernel: Kernel, count: int, given: Components, name: str, *args: object) -> Components:
    """Run a kernel over what came in: floats for one item, else guarded blocks."""
    if single(given):
        return kernel(*given, *args, floats)
    from frametool.geometry import arrays

    return arrays.run(arrays.guarded(kernel, complain_of(given, name)), count, given, *args, arrays)


def checked(kernel: Kernel, count: int, given: Components, name: str, check: Callable[..., object]) -> Components:
    """Run a kernel that not every finite input suits; `check` looks at one item, and at the first row that fails."""
    if single(given):
        check(*given)
        return kernel(*given, floats)
    from frametool.geometry import arrays

    return arrays.run(arrays.guarded(kernel, lambda: _recheck(kernel, count, given, name, check)), count, given, arrays)


def _recheck(kernel: Kernel, count: int, given: Components, name: str, check: Callable[..., object]) -> None:
    """Find the first row a kernel failed on and say why."""
    import numpy as np

    from frametool.geometry import arrays

    _all_finite(given, name)
    bad = ~np.logical_and.reduce([np.isfinite(part) for part in arrays.run(kernel, count, given, arrays)])
    if bad.any():
        try:
            check(*first_row(given, bad))
        except ValueInvalid as error:
            raise ValueInvalid(f"{at_first(name, bad)}: {error}") from None


def run(kernel: Kernel, count: int, given: Components) -> Components:
    """Run an arithmetic kernel on trusted components."""
    if single(given):
        return kernel(*given)
    from frametool.geometry import arrays

    return arrays.run(kernel, count, given)


def run_with_xp(kernel: Kernel, count: int, given: Components) -> Components:
    """Run a kernel that needs functions on trusted components."""
    if single(given):
        return kernel(*given, floats)
    from frametool.geometry import arrays

    return arrays.run(kernel, count, given, arrays)


def number(kernel: Callable[..., Any], given: Components) -> Any:
    """Run a kernel that gives one number."""
    return run_with_xp(lambda *parts: (kernel(*parts),), 1, given)[0]


def rows(kernel: Kernel, count: int, given: Components, *args: object) -> Array:
    """Run a kernel that needs functions; give its components as rows (..., count)."""
    if single(given):
        return stacked(kernel(*given, *args, floats))
    from frametool.geometry import arrays

    return arrays.rows(kernel, count, given, *args, arrays)


def moved(kernel: Kernel, mover: Components, flatten: Kernel, given: Components, name: str) -> Array:
    """Move vectors: each by its own mover, or all by the matrix of one."""
    import numpy as np

    if single(given) and single(mover):
        return np.array(kernel(*mover, *given))
    from frametool.geometry import arrays

    parts = (*mover, *given)
    if single(mover):
        kernel, parts = _matrix_kernel(flatten(*mover)), given
    return arrays.rows(arrays.guarded(kernel, complain_of(given, name)), 3, parts)


def _matrix_kernel(entries: Components) -> Kernel:
    """Make the kernel of one matrix, three rows of three or of four."""
    width = len(entries) // 3
    a, b, c = entries[:width], entries[width : 2 * width], entries[2 * width :]

    def kernel(x: Any, y: Any, z: Any) -> Components:
        return tuple(sum(row[3:], row[0] * x + row[1] * y + row[2] * z) for row in (a, b, c))

    return kernel


def stacked(components: Components) -> Array:
    """Give components as rows of a fresh array."""
    import numpy as np

    return np.stack(components, axis=-1)


def joined(given: Components, name: str) -> Components:
    """Bring components to one kind and shape, the first three finite, nothing shared with the caller."""
    if single(given):
        return given
    import numpy as np

    from frametool.geometry import arrays

    out = np.empty((len(given), *arrays.batch_shape(given)))
    for target, part in zip(out, given, strict=True):
        target[...] = part
    if not np.isfinite(out[:3].sum()):
        _all_finite(tuple(out[:3]), name)
    return tuple(out)


def chosen(components: Components, index: Any) -> Components:
    """Index every component; what is left of one element becomes floats."""
    return tuple(part[index] if getattr(part[index], "shape", ()) else float(part[index]) for part in components)


def check_last_row(entries: Components, name: str) -> None:
    """Raise ValueInvalid unless the last rows of homogeneous matrices are 0 0 0 1, to 1e-6."""
    off = sum(abs(entry - wanted) for entry, wanted in zip(entries[12:], (0.0, 0.0, 0.0, 1.0), strict=True))
    bad = ~(off <= quaternion.SILENT) if not isinstance(off, float) else not off <= quaternion.SILENT
    if bad if isinstance(bad, bool) else bad.any():
        import numpy as np

        mask = np.asarray(bad)
        raise ValueInvalid(f"{at_first(name, mask)}: last row {shown_row(entries[12:], mask)}; expected 0 0 0 1")


def weights(value: Numbers, shape: tuple[int, ...]) -> Array:
    """Check weights: of the batch's shape, finite, none negative, not all 0."""
    import numpy as np

    array = as_numbers(value, "weights").astype(np.float64)
    if array.shape != shape:
        raise ValueInvalid(f"weights: expected shape {shape}, got {array.shape}")
    _all_finite((array,), "weights")
    if (array < 0.0).any() or not array.any():
        raise ValueInvalid("weights: expected none negative and not all 0")
    return array


def second_moment(components: Components, heavy: Array | None) -> Array:
    """Give sum(w q q^T), 4 by 4, walked in blocks."""
    import numpy as np

    from frametool.geometry import arrays

    flat = [part.reshape(-1) for part in components]
    mass = None if heavy is None else heavy.reshape(-1)
    total = np.zeros((4, 4))
    for start, stop in arrays.blocks(flat[0].size):
        block = np.stack([part[start:stop] for part in flat])
        total += (block if mass is None else block * mass[start:stop]) @ block.T
    return total


def mean_rows(components: Components, heavy: Numbers | None) -> Array:
    """Give the weighted mean of each component."""
    import numpy as np

    mass = None if heavy is None else weights(heavy, components[0].shape)
    return np.array([np.average(part, weights=mass) for part in components])
