"""Check and convert many rotations at once: which rows are invalid and why, and which were normalised.

The rules are those for a single rotation (`Representation.checked`), which also words the error of a row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, warn
from frametool.geometry import arrays
from frametool.geometry.quaternion import SILENT, TOLERATED
from frametool.geometry.validation import at_row

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.representations import BatchRule, Notation
    from frametool.geometry.types import Array, Components, Indices

IDENTITY = 0.0, 0.0, 0.0, 1.0
NONE = np.empty(0, np.int64)


class Rotations(NamedTuple):
    """Unit quaternions of n rows, the reasons why rows are invalid, and the rows that were normalised.

    off: the largest deviation from a rotation among the accepted rows
    """

    quaternions: Components
    reasons: dict[int, str]
    mended: Indices
    off: float = 0.0


def read_rotations(
    notation: Notation, numbers: Sequence[Array], *, degrees: bool = False, normalize: bool = False
) -> Rotations:
    """Return the quaternions of rows of numbers in column order; invalid rows get the identity."""
    inputs = tuple(numbers)
    shape = arrays.batch_shape(inputs)
    quaternions = np.empty((4, int(np.prod(shape))))
    off, worst = None, 0.0  # the deviation of each row, inf if it is refused; None: nothing to report
    with np.errstate(all="ignore"):
        for place, block in arrays.cut(inputs):
            grades, right, furthest = _repaired(notation.representation.batch, block, normalize=normalize)
            worst = max(worst, furthest)
            results = notation.to_quaternion(right, arrays, degrees=degrees)
            if notation.representation.batch is None and not arrays.all_finite(results):
                grades = np.where(np.isfinite(sum(results)), 0.0, np.inf)
            for target, result in zip(quaternions, results, strict=True):
                target[place] = result
            if grades is not None:
                off = np.zeros(quaternions.shape[1]) if off is None else off
                off[place] = grades
    if off is None:
        return Rotations(tuple(quaternions), {}, NONE, worst)
    refused = np.flatnonzero(off == np.inf)
    flat = [np.broadcast_to(column, shape).reshape(-1) for column in inputs] if refused.size else []
    reasons = dict.fromkeys(refused.tolist(), "the numbers are not a rotation")
    for row in reasons:
        try:
            notation.representation.checked([float(column[row]) for column in flat], normalize=normalize)
        except ValueInvalid as error:
            reasons[row] = str(error)
    quaternions[:, refused] = np.reshape(IDENTITY, (4, 1))
    return Rotations(tuple(quaternions), reasons, np.flatnonzero((off > SILENT) & (off < np.inf)), worst)


def require_rotations(notation: Notation, inputs: Components, name: str, *, normalize: bool = False) -> Components:
    """Return the quaternions of columns of any shape; warn once about all rows that were normalised.

    Raises:
        ValueInvalid: rows are not rotations; names the first one and how many there are.
    """
    shape = arrays.batch_shape(inputs)
    found = read_rotations(notation, inputs, normalize=normalize)
    for row, reason in found.reasons.items():
        more = f" ({len(found.reasons)} such rows)" if len(found.reasons) > 1 else ""
        raise ValueInvalid(f"{at_row(name, row, shape)}: {reason}{more}")
    if found.mended.size and (rule := notation.representation.batch):
        share, first = f"{found.mended.size} of {np.prod(shape)} {rule.what}", at_row(name, found.mended[0], shape)
        warn(f"{name}: {share} are off by up to {found.off:.2g} (first: {first}) and were normalised")
    return tuple(part.reshape(shape) for part in found.quaternions)


def _repaired(
    rule: BatchRule | None, block: Components, *, normalize: bool
) -> tuple[Array | None, Components, float]:
    """Return the deviations of a block's rows (None: nothing to report), the block made rotations, and the worst."""
    if rule is None:
        return None, block, 0.0
    off = rule.deviation(*block, arrays)
    worst = arrays.furthest(off)
    if worst <= min(rule.exact, SILENT):
        return None, block, worst
    refused = ~(off < np.inf) if normalize else ~(off <= TOLERATED)
    rough = np.flatnonzero((off > rule.exact) & ~refused)
    grades = None if worst <= SILENT else np.where(refused, np.inf, 0.0 if normalize else off)
    kept = float(off[~refused].max(initial=0.0))
    return grades, _with_repaired(rule, block, rough) if rough.size else block, kept


def _with_repaired(rule: BatchRule, block: Components, rough: Indices) -> Components:
    """Replace the rows of a block that deviate by rotations."""
    if len(rough) == len(block[0]):
        return rule.repair(*block, arrays)
    after = tuple(column.copy() for column in block)
    for column, values in zip(after, rule.repair(*(column[rough] for column in block), arrays), strict=True):
        column[rough] = values
    return after
