"""What was left out of a fitted tree, and why: blunders by name, rivals exchanged, and loops where nothing tells."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, first_of, printable
from frametool.fit.graph import bridges
from frametool.fit.least_squares import inverse
from frametool.fit.measurements import best_blunder
from frametool.fit.robust import KEPT
from frametool.fit.tree_solver import Noise
from frametool.fit.uncertainty import Uncertainty

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.fit.rigid_arrays import PoseArrays
    from frametool.fit.tree_solver import Fitted, TreeProblem
    from frametool.geometry.types import Array
    from frametool.stream.measurements import Measurement

ONE_LINE = 200  # characters


class Verdicts(NamedTuple):
    """The words for each row, and what is not settled.

    noise: rows without a blunder that the doubt about the fit explains; swaps: rows to exchange, (left out, rival)
    undecided: the first row of whose loop nothing tells which is wrong, with its rivals
    """

    fits: list[str | None]
    noise: list[int]
    swaps: list[tuple[int, int]]
    undecided: tuple[int, list[int]] | None


def judged(problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted) -> tuple[Fitted, list[str | None]]:
    """Name the blunders in what was left out; where a rival has one instead, leave out the rival.

    Raises ValueInvalid where none of a row and its rivals, or more than one, has a blunder that fits.
    """
    tried = {found.kept.tobytes()}
    while True:
        case = _Case(problem, measurements, found)
        fits, noise, swaps, undecided = case.verdicts()
        for taken, left in ((noise, []), *(([row], [rival]) for row, rival in swaps)):
            kept = found.kept.copy()
            kept[taken], kept[left] = True, False
            if kept.tobytes() not in tried:
                break
        else:
            break
        tried.add(kept.tobytes())
        bodies = problem.placed([problem.tree(np.flatnonzero(kept).tolist())]).at(0)
        found = problem.selected(bodies, kept, found.noise, robust=True)
    if undecided:
        raise ValueInvalid(case.open_loop(*undecided))
    return found, fits


def place_of(measurements: Sequence[Measurement], row: int) -> str:
    """Return where a measurement stands, else its number."""
    return printable(measurements[row].place) or f"measurement {row + 1}"


class _Case:
    """A fit, and the rows that it keeps and leaves out."""

    def __init__(self, problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted) -> None:
        self.problem, self.measurements, self.found = problem, measurements, found
        kept = np.flatnonzero(found.kept).tolist()
        self.tree = problem.tree(kept)
        self.alone = bridges(self.tree, problem.pairs, kept)
        self.parents, self.children = problem.ends(found.bodies)
        self.poses = self.parents.inverse @ self.children
        self.errors = self.poses.errors(problem.rows.measured)
        self.information = problem.information(found.noise, found.noise.factor)
        noise = found.noise.at_least(Noise()) if found.few_loops else found.noise
        self.least_information = problem.information(noise, noise.factor)
        self.uncertainty = Uncertainty(problem, found)

    def verdicts(self) -> Verdicts:
        """Try the blunders on each row left out, and on its rivals: kept rows that only it checks."""
        fits: list[str | None] = [None] * self.problem.size
        noise, swaps, undecided = [], [], None
        for row in np.flatnonzero(~self.found.kept).tolist():
            rivals = sorted(self.alone.intersection(self.tree.way(*self.problem.pairs[row])))
            words = {row: best_blunder(self.measurements[row], self.poses.at(row), self.information[row])}
            for rival in rivals:
                pose = self._pose_without(rival, row)
                words[rival] = best_blunder(self.measurements[rival], pose, self.information[rival])
            blamed = [each for each, blunder in words.items() if blunder]
            unsure = self._beside_doubt(row, self.least_information[row])
            if not blamed and self.errors[row] @ unsure @ self.errors[row] <= 6 * KEPT**2:
                noise.append(row)
            if not rivals:
                doubted = self._beside_doubt(row, self.information[row])
                fits[row] = words[row] or best_blunder(self.measurements[row], self.poses.at(row), doubted)
            elif blamed == [row]:
                fits[row] = words[row]
            elif len(blamed) == 1:
                swaps.append((row, blamed[0]))
            else:
                undecided = undecided or (row, rivals)
        return Verdicts(fits, noise, swaps, undecided)

    def _beside_doubt(self, row: int, information: Array) -> Array:
        """Return the information on a row beside the doubt about the pose that the fit has between its frames."""
        parent, child = self.problem.pairs[row]
        doubt = self.uncertainty.between((parent, self.parents.at(row)), (child, self.children.at(row)))
        return information if doubt is None else inverse(inverse(information) + doubt)

    def _pose_without(self, rival: int, row: int) -> PoseArrays:
        """Return the pose that a rival would measure, were the bodies that hang by it placed by a row left out."""
        measured, pairs = self.problem.rows.measured.at(row), self.problem.pairs
        hanging = set(self.tree.beyond(rival))
        parent, child = self.parents.at(row), self.children.at(row)
        if pairs[row][1] in hanging:
            moved = parent @ measured @ child.inverse
        else:
            moved = child @ measured.inverse @ parent.inverse
        ends = self.parents.at(rival), self.children.at(rival)
        parent, child = (moved @ end if body in hanging else end for end, body in zip(ends, pairs[rival], strict=True))
        return parent.inverse @ child

    def open_loop(self, row: int, rivals: list[int]) -> str:
        """Return which rows form a loop, and how far it is open, on one line."""
        error = self.errors[row]
        open_by = f"{1e3 * np.linalg.norm(error[:3]):.1f} mm {np.degrees(np.linalg.norm(error[3:])):.1f} deg"
        places = [place_of(self.measurements, each) for each in sorted([row, *rivals])]
        advice = "measure again or leave one out"
        if self.measurements[row].place:
            advice += f" (--without {place_of(self.measurements, row)})"
        for most in range(len(places), 0, -1):
            text = f"undecided: {first_of(places, most)} form a loop open by {open_by}; {advice}"
            if len(text) <= ONE_LINE:
                break
        return text
