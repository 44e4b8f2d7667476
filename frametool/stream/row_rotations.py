"""The rotations of a block of rows, checked: which rows are none and why, which were mended and by how much.

The rules are those of one rotation (`Representation.checked`); whatever a block's arithmetic does not settle is put
to that, row by row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, overheard
from frametool.geometry import arrays, floats, matrix, quaternion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Array, Components
    from frametool.text.array_types import Ints

QUATERNIONS = frozenset(("quaternion", "xyzw", "wxyz"))
LARGEST = 1e150  # numbers beyond, whose squares overflow, are looked at singly
ALWAYS_SINGLE = frozenset(("six_d",))  # rare, and its condition is no simple threshold


class Rotations(NamedTuple):
    """Unit quaternions of n rows, the reasons of those that are no rotation, and the rows that were off."""

    quaternions: Components
    reasons: dict[int, str]
    mended: Ints


def read_rotations(form: Notation, numbers: Sequence[Array], *, degrees: bool, normalize: bool) -> Rotations:
    """Return the quaternions of rows of numbers in column order."""
    name = form.representation.name
    if name in QUATERNIONS:
        parts, doubtful, mended = _unit(form.to_quaternion(tuple(numbers), arrays))
    elif name == "matrix":
        parts, doubtful, mended = _orthonormal(tuple(numbers))
    else:
        parts, doubtful = _converted(form, tuple(numbers), degrees=degrees)
        mended = np.zeros(0, np.int64)
    if not doubtful.size:
        return Rotations(parts, {}, mended)
    return _settle_singly(form, numbers, Rotations(parts, {}, mended), doubtful, degrees=degrees, normalize=normalize)


def _unit(parts: Components) -> tuple[Components, Ints, Ints]:
    """Normalise rows near norm 1; give also the rows that are not, and those that were off beyond silence."""
    x, y, z, w = parts
    squared = quaternion.squared_norm(x, y, z, w)
    none = np.zeros(0, np.int64)
    if arrays.largest(squared - 1.0) <= quaternion.UNIT:
        return parts, none, none
    off = abs(np.sqrt(squared) - 1.0)
    unit = quaternion.unit(x, y, z, w, arrays)
    if off.max(initial=0.0) <= quaternion.SILENT:
        return unit, none, none
    doubtful = np.flatnonzero(~(off <= quaternion.TOLERATED))
    mended = np.flatnonzero((off > quaternion.SILENT) & (off <= quaternion.TOLERATED))
    return unit, doubtful, mended


def _orthonormal(entries: Components) -> tuple[Components, Ints, Ints]:
    """Convert matrices that are rotations to 1e-6; the others are doubtful."""
    a, b, c, d, e, f, g, h, i = entries
    off = matrix.defect(a, b, c, d, e, f, g, h, i, arrays)
    good = (off <= quaternion.SILENT) & (matrix.determinant(a, b, c, d, e, f, g, h, i) > 0.0)
    rough = np.flatnonzero(good & (off > matrix.ORTHONORMAL))
    if rough.size:
        _project(rough, columns := [np.array(entry) for entry in entries])
        a, b, c, d, e, f, g, h, i = columns
    return matrix.to_quaternion(a, b, c, d, e, f, g, h, i, arrays), np.flatnonzero(~good), np.zeros(0, np.int64)


def _project(rows: Ints, columns: list[Array]) -> None:
    """Replace some rows of matrices, in place, by their nearest rotations."""
    a, b, c, d, e, f, g, h, i = (column[rows] for column in columns)
    a, b, c, d, e, f, g, h, i = matrix.scaled(a, b, c, d, e, f, g, h, i, arrays)
    nearest = matrix.nearest(a, b, c, d, e, f, g, h, i, arrays)
    for column, values in zip(columns, nearest, strict=True):
        column[rows] = values


def _converted(form: Notation, numbers: Components, *, degrees: bool) -> tuple[Components, Ints]:
    """Convert by the notation's own kernel; rows without a finite result are doubtful, and those with huge numbers."""
    parts = form.to_quaternion(numbers, arrays, degrees=degrees)
    if form.representation.name in ALWAYS_SINGLE:
        return parts, np.arange(len(numbers[0]))
    doubtful = ~np.isfinite(sum(parts))
    for number in numbers:
        doubtful |= abs(number) > LARGEST
    return parts, np.flatnonzero(doubtful)


def _settle_singly(
    form: Notation,
    numbers: Sequence[Array],
    found: Rotations,
    doubtful: Ints,
    *,
    degrees: bool,
    normalize: bool,
) -> Rotations:
    """Put doubtful rows to the rule for one rotation."""
    parts = tuple(np.array(part) for part in found.quaternions)
    reasons, mended = {}, []
    for row in doubtful.tolist():
        given = [float(number[row]) for number in numbers]
        try:
            after, warned = overheard(form.checked_quaternion, given, floats, degrees=degrees, normalize=normalize)
        except ValueInvalid as error:
            reasons[row] = str(error)
            after, warned = (0.0, 0.0, 0.0, 1.0), []
        mended += [row] * bool(warned)
        for part, value in zip(parts, after, strict=True):
            part[row] = value
    return Rotations(parts, reasons, np.union1d(found.mended, np.array(mended, np.int64)))
