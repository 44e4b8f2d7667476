"""Numbers as people paste them from other tools, turned into the mappings that `read_pose` takes.

`pasted_objects` knows what says by its names what its numbers are, `pasted_rows` takes prints of numbers apart; here
rows get their meaning: 3x3, 3x4 and 4x4 are matrices, others what the caller says.

Each number stays the text it was.  None stands for a text that is nothing of the kind; what is and leaves its
meaning open comes out as the bare list that the grammar refuses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.geometry.representations import notation
from frametool.grammar.pasted_objects import named_values
from frametool.grammar.pasted_rows import number_rows
from frametool.grammar.rotation import spelled
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.representations import Notation
    from frametool.grammar.pasted_rows import Rows


def pasted_poses(text: str, given: Notation | None = None) -> list[Any] | None:
    """Return the values that a pasted text stands for, as documents give them; None for no such text.

    given: the notation of numbers that do not say theirs.
    Raises ValueInvalid for what is known and cannot be taken.
    """
    if (found := named_values(text)) is not None:
        return found
    rows = number_rows(text, any_text=given is not None)
    return None if rows is None else _meant(rows, given)


def _meant(rows: Rows, given: Notation | None) -> list[Any]:
    """Turn rows into the values they stand for; bare lists where nothing says what they are."""
    form = given or notation("matrix")
    if form.representation.whole:
        if (value := matrix_pose(rows, form, told=given is not None)) is not None:
            return [value]
    elif (found := _spelled_rows(rows, form)) is not None:
        return found
    if given is not None:
        size = len(form.columns)
        counts = " and ".join(map(str, dict.fromkeys(map(len, rows))))
        expected = f"{size} numbers ({' '.join(form.columns)}), or {size + 3} with x y z before them"
        several = f"{len(rows)} rows of " * (len(rows) > 1)
        raise ValueInvalid(f"{form.spec} has {expected}; found {several}{counts}")
    return [rows[0] if len(rows) == 1 else rows]


def matrix_pose(rows: Rows, form: Notation, *, told: bool = False) -> dict[str, Any] | None:
    """Return a 3x3, a 3x4 or a 4x4 matrix, or its numbers row by row, as a mapping; None for another size.

    told: somebody said `matrix`; then 12 numbers in one row may also be x y z and nine numbers.
    """
    key = form.spec
    sizes = {len(row) for row in rows}
    cells = [cell for row in rows for cell in row]
    if (len(rows), sizes) in ((3, {3}), (4, {4})):
        return {key: rows}
    if (len(rows), sizes) not in ((3, {4}), (1, {9}), (1, {12}), (1, {16})):
        return None
    if len(cells) != 12:
        size = 3 if len(cells) == 9 else 4
        return {key: [cells[at : at + size] for at in range(0, len(cells), size)]}
    as_rows = cells[3::4], [cells[at : at + 3] for at in (0, 4, 8)]
    behind = cells[:3], [cells[at : at + 3] for at in (3, 6, 9)]
    fitting = [each for each in (behind, as_rows) if is_rotation(each[1])] if told and len(rows) == 1 else [as_rows]
    if len(fitting) > 1:
        hint = "write {xyz: [..], matrix: [..]}"
        raise ValueInvalid(f"12 numbers may be x y z and a matrix, or the rows of a 3x4 pose; {hint}")
    xyz, turned = fitting[0] if fitting else behind
    return {"xyz": xyz, key: turned}


def is_rotation(rows: Rows) -> bool:
    """Tell whether the texts of 3x3 numbers make a rotation to 1e-3."""
    try:
        m = [[parse_number(cell) for cell in row] for row in rows]
    except ValueInvalid:
        return False
    products = [(sum(a * b for a, b in zip(m[i], m[j], strict=True)), i == j) for i in range(3) for j in range(3)]
    return all(abs(product - same) < 1e-3 for product, same in products)


def _spelled_rows(rows: Rows, form: Notation) -> list[Any] | None:
    """Return the poses of rows in a notation: one a row, or one column, or a position and a rotation."""
    size = len(form.columns)
    lengths = [len(row) for row in rows]
    if len(rows) > 1 and set(lengths) == {1}:
        rows = [[cell for (cell,) in rows]]
        lengths = [len(rows[0])]
    if lengths == [3, size]:
        if size == 3:
            hint = f"write {{xyz: [..], {form.representation.name}: ..}}"
            raise ValueInvalid(f"two rows of 3 may be a pose or two rotations; {hint}")
        rows, lengths = [[*rows[0], *rows[1]]], [3 + size]
    if not set(lengths) <= {size, size + 3}:
        return None
    return [_entry(row, form) for row in rows]


def _entry(cells: Sequence[str], form: Notation) -> dict[str, Any]:
    """Return the mapping of a rotation, behind x y z if there are so many numbers."""
    row = form.representation
    size = len(row.columns)
    for index, cell in enumerate(cells[-size:]):
        (parse_angle if index in row.angles else parse_number)(cell)
    unit = "" if form.degrees is None else "_deg" if form.degrees else "_rad"
    form.bound_axes()
    entry = {f"{row.name}{unit}": spelled(form, list(cells[-size:]))}  # type: ignore[arg-type]
    return {"xyz": list(cells[:-size]), **entry} if len(cells) > size else entry
