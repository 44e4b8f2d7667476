"""Matrices in derivations: those of quaternions, the rotation nearest to what is given, and the whole pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.explain.formula_tree import Value
from frametool.geometry import floats
from frametool.geometry import matrix as kernel
from frametool.geometry.quaternion import to_matrix

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.calc.explain.sheet import Matrix, Sheet
    from frametool.grammar.readers import Quaternion

LAST_STEP = 1e-9  # the convergence is quadratic: what comes after such a step is rounding
MOST_STEPS = 60


def rows(entries: Sequence[float]) -> Matrix:
    """Return nine numbers as three rows."""
    return [list(entries[at : at + 3]) for at in (0, 3, 6)]


def of_quaternion(sheet: Sheet, q: Quaternion) -> Matrix:
    """Return the matrix of a quaternion as the steps after it take it."""
    return rows([sheet.settled(Value(entry, 1.0)) for entry in to_matrix(*q)])


def nearest_rotation(sheet: Sheet, entries: Sequence[float]) -> Sequence[float]:
    """Return the rotation nearest to a matrix, with the steps to it; what is one already stays as it is."""
    if kernel.defect(*kernel.nine(entries), floats) <= kernel.ORTHONORMAL:
        return entries
    sheet.heading("The nearest rotation")
    off = kernel.defect(*kernel.nine(entries), floats)
    sheet.say(f"The rows are orthonormal only to {off:.1e}. Newton's way to the nearest rotation (Higham 1986): the "
              "mean of M and of its inverse transposed, again and again; each step doubles the right digits.")
    here = rows(kernel.balanced(*kernel.nine(entries), floats))
    if here != rows(entries):
        sheet.say("M is divided by a power of two first; its rotation stays.")
    for count in range(1, MOST_STEPS + 1):
        there = rows(kernel.newton(*kernel.nine(part for row in here for part in row)))
        other = [[2.0 * b - a for a, b in zip(*pair, strict=True)] for pair in zip(here, there, strict=True)]
        sheet.grid(f"M{count}", f"1/2 (M{count - 1 or ''} + M{count - 1 or ''}^-T)",
                   r"\tfrac{1}{2}\left(M + M^{-\mathsf{T}}\right)",
                   ["1/2·(", here, "+", other, ")", "=", there])  # fmt: skip
        step = max(abs(a - b) for pair in zip(here, there, strict=True) for a, b in zip(*pair, strict=True))
        here = there
        if step < LAST_STEP:
            break
    return [part for row in here for part in row]
