"""Check many rotations at once: pass what is plainly right block by block, and look at all rows if one is not.

The rules are those of `quaternion.check` and `matrix.check`, which also word the error of the first bad row.
"""

from __future__ import annotations

import numpy as np

from frametool.errors import ValueInvalid, warn
from frametool.geometry import arrays, matrix, quaternion
from frametool.geometry.validation import at_first, first_row

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from frametool.geometry.types import Array, Components, Kernel, Matrix


class _Irregular(Exception):
    """A block holds rows that are not plainly rotations."""


def unit_quaternions(given: Components, name: str, *, normalize: bool) -> Components:
    """Check many quaternions and give them unit; those unit to 4 eps keep their bits.

    The rules are those of `quaternion.check`; warnings are one for all rows.

    Raises:
        ValueInvalid: naming the first row that is no rotation.
    """
    copied = np.empty((4, *given[0].shape))
    columns, flat = [column.reshape(-1) for column in given], copied.reshape(4, -1)
    for start, stop in arrays.blocks(flat.shape[1]):
        block = flat[:, start:stop]
        for target, column in zip(block, columns, strict=True):
            target[...] = column[start:stop]
        if not _made_unit(block):
            return arrays.run(_quaternion_sifter(given, name, normalize=normalize), 4, given)
    return tuple(copied)


def _made_unit(block: Array) -> bool:
    """Make a block unit if its rows need no word; most are already."""
    x, y, z, w = block
    with np.errstate(over="ignore", invalid="ignore"):
        squared = quaternion.squared_norm(x, y, z, w)
    if not arrays.all_near_one(squared, quaternion.SILENT):
        return False
    if not arrays.all_near_one(squared, quaternion.UNIT):
        block[...] = quaternion.unit(x, y, z, w, arrays)
    return True


def _quaternion_sifter(given: Components, name: str, *, normalize: bool) -> Kernel:
    """Refuse or warn about whatever must be, over all rows; give the kernel that then normalises."""

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
        share = f"{int(odd.sum())} of {odd.size} {what}"
        warn(f"{name}: {share} are off by up to {largest:.2g} (first: {at_first(name, odd)}) and were normalised")


def rotation_quaternions(given: Components, name: str, *, normalize: bool) -> Components:
    """Check many matrices, nine columns, and give the quaternions of the nearest rotations.

    The rules are those of `matrix.check`; warnings are one for all rows.

    Raises:
        ValueInvalid: naming the first row that is no rotation.
    """
    try:
        return arrays.run(_plainly_rotations, 4, given)
    except _Irregular:
        return arrays.run(_matrix_sifter(given, name, normalize=normalize), 4, given)


def _plainly_rotations(*given: Any) -> Components:
    """Convert a block of matrices that need no word."""
    entries: Matrix = given
    off = matrix.defect(*entries, arrays)
    if not arrays.largest(off) <= quaternion.SILENT or not matrix.determinant(*entries).min(initial=1.0) > 0.0:
        raise _Irregular
    return matrix.to_quaternion(*_projected(entries, off > matrix.ORTHONORMAL), arrays)


def _projected(entries: Matrix, rough: Any) -> Matrix:
    """Replace the rough rows of a block by their nearest rotations."""
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

    def grade(*block: Any) -> Components:
        entries: Matrix = block
        off = matrix.defect(*entries, arrays)
        volume = matrix.relative_volume(*entries, arrays)
        return (np.where(volume > matrix.SINGULAR, 0.0 if normalize else off, np.inf),)

    (off,) = arrays.run(grade, 1, given)
    refuse_or_warn(off, given, name, "matrices", lambda row: matrix.check(*row, normalize=normalize))

    def kernel(*block: Any) -> Components:
        entries: Matrix = block
        rough = ~(matrix.defect(*entries, arrays) <= matrix.ORTHONORMAL)
        return matrix.to_quaternion(*_projected(entries, rough), arrays)

    return kernel
