"""The tree that measurements mean: where each frame is in the root, how sure that is, what was left out and why."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, alternatives, printable, shown
from frametool.fit.bodies import bodies_of, require_connected
from frametool.fit.graph import Groups, bridges
from frametool.fit.measurements import best_blunder
from frametool.fit.rigid_arrays import Poses
from frametool.fit.tree_solver import Fitted, Noise, Rows, TreeProblem, jacobians, of_body
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.fit.bodies import Bodies, Fixed
    from frametool.fit.elimination import Factor
    from frametool.fit.measurements import Measurement
    from frametool.geometry.types import Array, Indices

ONE_LINE = 200  # characters
SINGULAR = 1e-12  # of the correlations: the least eigenvalue that a covariance has


def solve_tree(
    measurements: Sequence[Measurement],
    *,
    root: str | None = None,
    fixed: Fixed = (),
    robust: bool = True,
    progress: Callable[[float], None] | None = None,
) -> TreeSolution:
    """Find the tree that fits measurements best.

    root: the frame that the others are given in; else the first that is never a child
    fixed: (parent, child, components) of exact edges, whose frames move as one body
    robust: leave out what does not agree with the rest; progress: called with the share that is done
    Raises ValueInvalid: nothing or not everything is connected, an unknown root, undecided.
    """
    if not measurements:
        raise ValueInvalid("no measurements")
    for row, each in enumerate(measurements):
        if each.parent == each.child:
            raise ValueInvalid(f"{_place(measurements, row)}: {shown(each.child)} is measured from itself")
    told = progress or (lambda _: None)
    bodies = bodies_of(measurements, root, fixed)
    rows = _rows(measurements, bodies)
    require_connected(bodies, zip(rows.parent.tolist(), rows.child.tolist(), strict=True))
    problem = TreeProblem(rows, bodies.count)
    found, fits = _judged(problem, measurements, problem.fitted(robust=robust, told=told))
    told(1.0)
    return TreeSolution(measurements, bodies, problem, found, fits)


def _rows(measurements: Sequence[Measurement], bodies: Bodies) -> Rows:
    """Return measurements as arrays."""
    parents, children = [m.parent for m in measurements], [m.child for m in measurements]
    information = np.zeros((len(measurements), 6, 6))
    for row, each in enumerate(measurements):
        if each.covariance is not None:
            covariance = np.array(each.covariance, float).reshape(6, 6)
            _require_regular(covariance, _place(measurements, row))
            information[row] = np.linalg.inv(covariance)
    return Rows(
        np.array([bodies.number[name] for name in parents]),
        np.array([bodies.number[name] for name in children]),
        _poses([bodies.pose[name] for name in parents]),
        _poses([bodies.pose[name] for name in children]),
        _poses([m.transform for m in measurements]),
        np.array([m.covariance is not None for m in measurements]),
        (information + information.swapaxes(1, 2)) / 2,
    )


def _require_regular(covariance: Array, place: str) -> None:
    sigmas = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    if not sigmas.all() or np.linalg.eigvalsh(covariance / np.outer(sigmas, sigmas))[0] < SINGULAR:
        raise ValueInvalid(f"{place}: the covariance is exact in some direction; exact: --fix")


def _poses(transforms: list[Transform]) -> Poses:
    parts = zip(*(each.components for each in transforms), strict=True)
    return Poses.of(Transform.of(*(np.array(part, float) for part in parts)))


def _place(measurements: Sequence[Measurement], row: int) -> str:
    return printable(measurements[row].place) or f"measurement {row + 1}"


# what was left out, and why


class _Loop(NamedTuple):
    """A row that was left out, and the kept ones that only it checks."""

    row: int
    rivals: list[int]


def _judged(problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted) -> tuple[Fitted, list[str | None]]:
    """Name the blunders in what was left out; where a rival has one instead, leave out the rival.

    Raises ValueInvalid where none of a row and its rivals, or more than one, has a blunder that fits.
    """
    seen = set()
    while True:
        fits, swaps, undecided = _verdicts(problem, measurements, found)
        seen.add(found.kept.tobytes())
        kept = found.kept.copy()
        for row, rival in swaps:
            kept[row], kept[rival] = True, False
        if not swaps or kept.tobytes() in seen:
            break
        bodies = problem.placed([problem.tree(np.flatnonzero(kept).tolist())]).at(0)
        found = problem.selected(bodies, kept, found.noise, robust=True)
    if undecided:
        raise ValueInvalid(_undecided(problem, measurements, found, undecided[0]))
    return found, fits


def _verdicts(
    problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted
) -> tuple[list[str | None], list[tuple[int, int]], list[_Loop]]:
    """Return the words for each row, the (left out, rival) to exchange, and the loops where nothing tells which."""
    kept = np.flatnonzero(found.kept).tolist()
    tree = problem.tree(kept)
    alone = bridges(tree, problem.pairs, kept)
    parents, children = problem.ends(found.bodies)
    poses = parents.inverse @ children
    information = problem.information(found.noise, found.noise.factor)
    fits: list[str | None] = [None] * problem.size
    swaps, undecided = [], []
    for row in np.flatnonzero(~found.kept).tolist():
        rivals = sorted(alone.intersection(tree.way(*problem.pairs[row])))
        words = {row: best_blunder(measurements[row], poses.at(row), information[row])}
        for rival in rivals:
            beyond = set(tree.beyond(rival))
            pose = _without(problem, (parents, children), row, rival, beyond)
            words[rival] = best_blunder(measurements[rival], pose, information[rival])
        blamed = [each for each, blunder in words.items() if blunder]
        if not rivals or blamed == [row]:
            fits[row] = words[row]
        elif len(blamed) == 1:
            swaps.append((row, blamed[0]))
        else:
            undecided.append(_Loop(row, rivals))
    return fits, swaps, undecided


def _without(
    problem: TreeProblem, ends: tuple[Poses, Poses], row: int, rival: int, beyond: set[int]
) -> Poses:
    """Return the pose that a rival would measure, were the bodies beyond it placed by a row that was left out."""
    measured = problem.rows.measured.at(row)
    parent, child = (side.at(row) for side in ends)
    moved = parent @ measured @ child.inverse if problem.pairs[row][1] in beyond else child @ measured.inverse @ parent.inverse
    parent, child = (
        moved @ side.at(rival) if body in beyond else side.at(rival)
        for side, body in zip(ends, problem.pairs[rival], strict=True)
    )
    return parent.inverse @ child


def _undecided(problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted, loop: _Loop) -> str:
    """Say which rows form a loop, and how far it is open, on one line."""
    error = problem.errors(found.bodies)[loop.row]
    open_by = f"{1e3 * np.linalg.norm(error[:3]):.1f} mm {np.degrees(np.linalg.norm(error[3:])):.1f} deg"
    places = [_place(measurements, row) for row in sorted([loop.row, *loop.rivals])]
    advice = f" (--without {_place(measurements, loop.row)})" if measurements[loop.row].place else ""
    for most in range(len(places), 0, -1):
        more = f" and {len(places) - most} more" if most < len(places) else ""
        text = f"undecided: {', '.join(places[:most])}{more} form a loop open by {open_by}; measure again or leave one out{advice}"
        if len(text) <= ONE_LINE:
            break
    return text


class TreeSolution:
    """A tree of measured frames, and what the measurements say about it.

    root, frames: the frame that all are given in; all, in order of first mention
    parents: of each frame, the one its entry names: the root, or the frame that it is fixed in (`fixed`)
    residuals (n, 6), u, used, checked, fits: of each measurement
    sigma: estimated (metres, radians) of those without a covariance, or None; sigma_factor: 1, or how much too small
    the given sigmas are; they are believed all the same
    dof: degrees of freedom of either half; rms_distance, rms_angle: of those used
    rows: how many measurements of each frame are used; frame_checked: whether its pose in the root rests on loops only
    """

    def __init__(
        self,
        measurements: Sequence[Measurement],
        bodies: Bodies,
        problem: TreeProblem,
        found: Fitted,
        fits: list[str | None],
    ) -> None:
        """Look at a fit from all sides."""
        self.measurements, self.fits = tuple(measurements), fits
        self.root, self.frames, self.fixed = bodies.root, bodies.frames, frozenset(bodies.parent)
        self._of, self._problem, self._found = bodies, problem, found
        self.residuals: Array = problem.errors(found.bodies)
        self.used = found.kept
        noise = found.noise if found.estimated else None
        self.u: Array = problem.u(self.residuals, found.noise)
        self.sigma = noise and (noise.place, noise.turn)
        self.sigma_factor = found.noise.factor
        self.dof = max(3 * (int(self.used.sum()) - problem.unknown), 0)
        self.rms_distance, self.rms_angle = (
            math.sqrt((part[self.used] ** 2).sum() / self.used.sum())
            for part in (self.residuals[:, :3], self.residuals[:, 3:])
        )
        kept = np.flatnonzero(self.used).tolist()
        tree = problem.tree(kept)
        alone = bridges(tree, problem.pairs, kept)
        self.checked = ~np.isin(np.arange(problem.size), list(alone))
        sure = [True] * bodies.count
        for body in tree.order[1:]:
            sure[body] = sure[tree.above[body]] and tree.row[body] not in alone
        self.frame_checked = {name: sure[bodies.number[name]] for name in self.frames}
        ends = [name for row in kept for name in (measurements[row].parent, measurements[row].child)]
        self.rows = {name: ends.count(name) for name in self.frames}
        self.parents = self._entries()
        number = np.array([bodies.number[name] for name in self.frames])
        self._poses = found.bodies.at(number) @ _poses([bodies.pose[name] for name in self.frames])
        components = zip(*(part.tolist() for part in self._poses.transform.components), strict=True)
        self.poses = {name: Transform.of(*each) for name, each in zip(self.frames, components, strict=True)}

    @property
    def count(self) -> int:
        """Return how many measurements there were."""
        return len(self.measurements)

    def pose(self, frame: str, parent: str | None = None) -> Transform:
        """Return the pose of a frame in the root, or in another."""
        pose = self.poses[self._known(frame)]
        return pose if parent is None else self.poses[self._known(parent)].inverse() @ pose

    def covariance(self, target: str, source: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of source in target, all loops in; None where it is not known.

        As in ROS: x, y, z, turns about X, Y, Z, in metres and radians along the axes of target.
        """
        (t, a), (s, b) = (self._at(name) for name in (target, source))
        if t == s:
            return np.zeros((6, 6))
        if self._noise_known.of(t) != self._noise_known.of(s):
            return None
        right = np.zeros((self._problem.count, 6, 6))
        for body, frame, by in zip((t, s), (a, b), jacobians(a, b, np.zeros(3)), strict=True):
            right[body] = of_body(by, self._found.bodies.at(body), frame).T
        covariance: Array = np.einsum("nij,nik->jk", right[1:], self._factor.solve(right[1:]))
        return (covariance + covariance.T) / 2

    def marginal(self, frame: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of a frame in the root; None where it is not known."""
        body, pose = self._at(frame)
        if not body:
            return np.zeros((6, 6))
        if self._noise_known.of(body) != self._noise_known.of(0):
            return None
        arm = of_body(np.eye(6), self._found.bodies.at(body), pose)
        covariance: Array = arm @ self._marginals[body - 1] @ arm.T
        return (covariance + covariance.T) / 2

    def _known(self, frame: str) -> str:
        if frame not in self.poses:
            raise ValueInvalid(f"unknown frame {shown(frame)}{alternatives(frame, self.frames, 'frames')}")
        return frame

    def _at(self, frame: str) -> tuple[int, Poses]:
        return self._of.number[self._known(frame)], self._poses.at(self.frames.index(frame))

    def _entries(self) -> dict[str, str]:
        """Return the parent of every frame but one: the root, or what the root itself hangs from if that is fixed."""
        fixed = self._of.parent
        top = self.root
        while top in fixed:
            top = fixed[top]
        return {name: fixed.get(name, self.root) for name in self.frames if name != top}

    @cached_property
    def _noise_known(self) -> Groups:
        """Bodies in groups that rows of known noise join."""
        known = self.used & (self._problem.rows.given | self._found.estimated)
        return Groups(self._problem.count, (self._problem.pairs[row] for row in np.flatnonzero(known).tolist()))

    @cached_property
    def _factor(self) -> Factor:
        information = self._problem.information(self._found.noise) * self.used[:, None, None]
        return self._problem.elimination.factored(self._problem.normal_equations(self._found.bodies, information)[0])

    @cached_property
    def _marginals(self) -> Array:
        return self._factor.inverse_diagonal()
