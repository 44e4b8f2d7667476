"""Estimate a tree from measurements: the pose of each frame in the root, its covariance, and the outliers.

Outliers are explained by common mistakes; if another row of the loop has one, that row is rejected instead; a loop
whose outlier cannot be identified is an error.  Covariances are first order, the inverse of the normal equations.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import Finding, NotConnected, ValueInvalid, alternatives, first_of, printable, shown, warn
from frametool.fit.graph import bodies_of, bridges, require_connected, top_of
from frametool.fit.least_squares import KEPT, NotSettled, applied, errors, inverse, length, stacked
from frametool.fit.tree_solver import Fitted, Noise, TreeProblem, TreeRows, jacobians, of_body
from frametool.frames.lookups import Frames, FrameTree
from frametool.frames.topology import Groups
from frametool.geometry.conventions import axes_change
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.lint.tree_diff import Tolerance
from frametool.stream.measurements import Measurement, parted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.fit.graph import Bodies
    from frametool.geometry.types import Array


class Uncertainty:
    """Covariances (6, 6) of poses between frames of bodies, along the axes of the target frame.

    None if a pose depends on rows whose noise is neither stated nor observable from a loop.
    """

    def __init__(self, problem: TreeProblem, found: Fitted) -> None:
        """Store a fit; nothing is computed yet."""
        self._problem, self._found = problem, found
        self._known = Groups[int]()
        for row in np.flatnonzero(found.kept & (problem.rows.stated | found.estimated)).tolist():
            self._known.join(*problem.pairs[row])

    def between(self, target: tuple[int, Transform], source: tuple[int, Transform]) -> Array | None:
        """Return the covariance of source in target, each a body and the pose of a frame of it."""
        if target[0] == source[0]:
            return np.zeros((6, 6))
        if self._known.of(target[0]) != self._known.of(source[0]):
            return None
        by_ends = zip((target, source), jacobians(target[1], source[1], np.zeros(3)), strict=True)
        slopes = np.hstack([of_body(by, self._found.bodies[body], frame) for (body, frame), by in by_ends])
        ends = [target[0], source[0]]
        found: Array = slopes @ self._of_bodies[ends][:, :, ends].reshape(12, 12) @ slopes.T
        return (found + found.T) / 2.0

    @cached_property
    def _of_bodies(self) -> Array:
        """Return the covariance of all bodies, (bodies, 6, bodies, 6); zeros for the root."""
        problem, found = self._problem, self._found
        information = problem.information(found.noise) * found.kept[:, None, None]
        whole = np.zeros((problem.count, 6, problem.count, 6))
        if problem.unknown:
            normal = problem.normal_equations(found.bodies, information)[0]
            whole[1:, :, 1:] = inverse(normal).reshape(problem.unknown, 6, problem.unknown, 6)
        return whole


NEAR = Tolerance(0.01, math.radians(1.0))  # the tolerance without any sigmas
LEAST = 1e-9  # metres, radians
FITTING = 4.0  # sigmas: a mistake explains a measurement that it brings this near
ALIKE = 0.5  # sigmas: mistakes with so similar results are equally good
TIE = 1e-9  # of u: an improvement below this does not count
O = Transform(axes_change("flu", "optical"), (0.0, 0.0, 0.0))  # body_from_optical, in the notation of papers


def _translation_of_inverse(m: Measurement) -> Transform:
    rotation = m.transform.rotation
    return Transform(rotation, -rotation.apply(m.components[:3]))


def _yaw_first(m: Measurement) -> Transform | None:
    if m.written is None or m.written[0] != "rpy":
        return None
    return m.turned(*Rotation.from_rpy(m.written[1][::-1]).components)


# the intended measurement, if this mistake was made
BLUNDERS: dict[str, Callable[[Measurement], Transform | None]] = {
    "inverted": lambda m: m.transform.inverse(),
    "rotation inverted": lambda m: m.turned(*m.transform.rotation.inverse().components),
    "translation of the inverse": _translation_of_inverse,
    "wxyz taken for xyzw": lambda m: m.turned(*m.components[4:], m.components[3]),
    "xyzw taken for wxyz": lambda m: m.turned(m.components[6], *m.components[3:6]),
    "millimetres": lambda m: m.shifted(1e-3), "metres taken for millimetres": lambda m: m.shifted(1e3),
    "degrees taken for radians": lambda m: m.reread(math.radians),
    "radians taken for degrees": lambda m: m.reread(math.degrees),
    "yaw, pitch, roll taken for roll, pitch, yaw": _yaw_first,
    "optical axes of the child": lambda m: m.transform @ O.inverse(),
    "optical axes of the parent": lambda m: O @ m.transform, "body axes of the child": lambda m: m.transform @ O,
    "body axes of the parent": lambda m: O.inverse() @ m.transform,
}  # fmt: skip


def best_blunder(measurement: Measurement, pose: Transform, information: Array) -> str | None:
    """Return the mistake that best explains a measurement of a pose; None if none does.

    pose: of the child in the parent; information: the inverse covariance (6, 6) of the measurement
    It must bring the measurement within 4 sigmas, and nearer than it is.  Of mistakes that noise cannot distinguish
    from
    the best, the first is returned: a rotation by 180 degrees is its own inverse.
    """
    meant = {words: made for words, blunder in BLUNDERS.items() if (made := blunder(measurement)) is not None}
    tried = [*meant.values(), measurement.transform]
    off = errors(pose, stacked(tried))
    u = _sigmas(off, information)
    best = int(u[:-1].argmin())
    if u[best] > FITTING or u[best] >= u[-1] * (1 - TIE):
        return None
    as_good = (_sigmas(off - off[best], information) <= ALIKE) & (u <= FITTING)
    return list(meant)[int(as_good.argmax())]


def loops(
    tree: FrameTree, measurements: Sequence[Measurement], tolerance: Tolerance | None
) -> tuple[list[Finding], list[str], int]:
    """Compare measurements with a tree: findings for those that differ, missing frames, number of unconnected rows.

    tolerance: of agreement; None: 3 sigmas if a measurement has a covariance, else 10 mm and 1 deg
    """
    findings, lacking, apart = [], dict[str, None](), 0
    for each in measurements:
        unknown = [name for name in each[:2] if name not in tree.frames]
        lacking |= dict.fromkeys(unknown)
        if unknown:
            continue
        try:
            pose = tree.lookup(each.parent, each.child)
        except NotConnected:
            apart += 1
            continue
        error = errors(pose, each.transform)
        metres, radians = map(float, length(error.reshape(2, 3)))
        if tolerance is None and each.covariance is not None:
            information = np.linalg.pinv(np.reshape(each.covariance, (6, 6)), hermitian=True)
            u = _sigmas(error[None], information)[0]
            agrees, sigmas = u <= KEPT, f" ({u:.1f} sigmas)"
        else:
            near = tolerance or NEAR
            agrees, sigmas = metres <= near.metres and radians <= near.radians, ""
            # `FITTING` sigmas are reached if both parts reach the tolerance
            sigma = np.maximum(np.repeat([near.metres, near.radians], 3), LEAST) / FITTING / 3**0.5
            information = np.diag(sigma**-2.0)
        if not agrees:
            words = best_blunder(each, pose, information)
            off = f"{1e3 * metres:.1f} mm {math.degrees(radians):.1f} deg{sigmas} off the tree"
            message = f"{printable(each.parent)}<-{printable(each.child)} is {off}"
            message += f"; fits when {words}" if words else ""
            findings.append(Finding("loop", message, *parted(each.place)))
    return findings, [*lacking], apart


def _sigmas(errors: Array, information: Array) -> Array:
    squares = (errors * applied(information, errors)).sum(-1)
    found: Array = np.sqrt(np.maximum(squares, 0.0) / 6)
    return found


ONE_LINE = 200  # characters


def judged(problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted) -> tuple[Fitted, list[str | None]]:
    """Explain the rejected rows; if a rival has a mistake instead, reject the rival.

    Raises ValueInvalid if none of a row and its rivals, or more than one, has a mistake that fits.
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
        bodies = problem.placed([problem.tree(np.flatnonzero(kept).tolist())])[0]
        found = problem.selected(bodies, kept, found.noise, robust=True)
    if undecided:
        raise ValueInvalid(case.open_loop(*undecided))
    return found, fits


def place_of(measurements: Sequence[Measurement], row: int) -> str:
    """Return the place of a measurement, else its number."""
    return printable(measurements[row].place) or f"measurement {row + 1}"


class _Case:
    """A fit, and its inliers and outliers."""

    def __init__(self, problem: TreeProblem, measurements: Sequence[Measurement], found: Fitted) -> None:
        self.problem, self.measurements, self.found = problem, measurements, found
        kept = np.flatnonzero(found.kept).tolist()
        self.tree = problem.tree(kept)
        self.alone = bridges(self.tree, problem.pairs, kept)
        self.parents, self.children = problem.ends(found.bodies)
        self.poses = self.parents.inverse() @ self.children
        self.errors = errors(self.poses, problem.rows.measured)
        self.information = problem.information(found.noise, found.noise.factor)
        noise = found.noise.at_least(Noise()) if found.few_loops else found.noise
        self.least_information = problem.information(noise, noise.factor)
        self.uncertainty = Uncertainty(problem, found)

    def verdicts(self) -> tuple[list[str | None], list[int], list[tuple[int, int]], tuple[int, list[int]] | None]:
        """Try the mistakes on each rejected row, and on its rivals: used rows that only it checks.

        Returns the mistake of each row; rows without one that the uncertainty of the fit explains; rows to exchange,
        (rejected, rival); and the first row whose loop does not identify the outlier, with its rivals.
        """
        fits: list[str | None] = [None] * self.problem.size
        noise, swaps, undecided = list[int](), list[tuple[int, int]](), None
        for row in np.flatnonzero(~self.found.kept).tolist():
            rivals = sorted(self.alone.intersection(self.tree.way(*self.problem.pairs[row])))
            words = {row: best_blunder(self.measurements[row], self.poses[row], self.information[row])}
            for rival in rivals:
                pose = self._pose_without(rival, row)
                words[rival] = best_blunder(self.measurements[rival], pose, self.information[rival])
            blamed = [each for each, blunder in words.items() if blunder]
            unsure = self._with_doubt(row, self.least_information[row])
            if not blamed and self.errors[row] @ unsure @ self.errors[row] <= 6 * KEPT**2:
                noise.append(row)
            if not rivals:
                doubted = self._with_doubt(row, self.information[row])
                fits[row] = words[row] or best_blunder(self.measurements[row], self.poses[row], doubted)
            elif blamed == [row]:
                fits[row] = words[row]
            elif len(blamed) == 1:
                swaps.append((row, blamed[0]))
            else:
                undecided = undecided or (row, rivals)
        return fits, noise, swaps, undecided

    def _with_doubt(self, row: int, information: Array) -> Array:
        """Return the information of a row relative to the fit, whose own uncertainty between the frames is included."""
        parent, child = self.problem.pairs[row]
        doubt = self.uncertainty.between((parent, self.parents[row]), (child, self.children[row]))
        return information if doubt is None else inverse(inverse(information) + doubt)

    def _pose_without(self, rival: int, row: int) -> Transform:
        """Return the pose that a rival would measure if the rejected row placed the bodies below it."""
        measured, pairs = self.problem.rows.measured[row], self.problem.pairs
        hanging = set(self.tree.beyond(rival))
        parent, child = self.parents[row], self.children[row]
        if pairs[row][1] in hanging:
            moved = parent @ measured @ child.inverse()
        else:
            moved = child @ measured.inverse() @ parent.inverse()
        ends = self.parents[rival], self.children[rival]
        parent, child = (moved @ end if body in hanging else end for end, body in zip(ends, pairs[rival], strict=True))
        return parent.inverse() @ child

    def open_loop(self, row: int, rivals: list[int]) -> str:
        """Return the rows of a loop and its closure error, on one line."""
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


FEW_LOOPS = 6  # with fewer the sigmas are rough if rotations can close them
SINGULAR = 1e-12  # of the correlations: the least eigenvalue of a valid covariance


def solve_tree(
    measurements: Sequence[Measurement], *, root: str | None = None, fixed: Frames | None = None,
    robust: bool = True, progress: Callable[[float], None] | None = None,
) -> TreeSolution:  # fmt: skip
    """Find the tree that fits measurements best.

    root: the frame in which the others are expressed; default the first that is never a child
    fixed: a tree of exact edges, whose frames move as one body
    robust: reject outliers; progress: called with the finished share
    Raises ValueInvalid: frames are not connected, an unknown root, undecided.
    """
    if not measurements:
        raise ValueInvalid("no measurements")
    for row, each in enumerate(measurements):
        if each.parent == each.child:
            raise ValueInvalid(f"{place_of(measurements, row)}: {shown(each.child)} is measured from itself")
    report = progress or (lambda _: None)
    fixed = fixed or FrameTree()
    bodies = bodies_of(measurements, root, fixed)
    require_connected(bodies, [(bodies.number[each.parent], bodies.number[each.child]) for each in measurements])
    try:
        with np.errstate(over="raise", invalid="raise"):
            problem = TreeProblem(_rows(measurements, bodies), bodies.size)
            found, fits = judged(problem, measurements, problem.fitted(robust=robust, report=report))
            report(1.0)
            solution = TreeSolution(measurements, bodies, problem, found, fits, fixed)
    except (NotSettled, FloatingPointError):
        far = max(abs(part) for each in measurements for part in each.components[:3])
        raise ValueInvalid(f"translations (up to {far:.3g} m) or sigmas differ too much in size to be solved") from None
    for hint in solution.hints:
        warn(hint)
    return solution


def _rows(measurements: Sequence[Measurement], bodies: Bodies) -> TreeRows:
    """Return measurements as arrays."""
    parents, children = [m.parent for m in measurements], [m.child for m in measurements]
    information = np.zeros((len(measurements), 6, 6))
    for row, each in enumerate(measurements):
        if each.covariance is not None:
            covariance = np.array(each.covariance, float).reshape(6, 6)
            sigmas = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
            if not sigmas.all() or np.linalg.eigvalsh(covariance / np.outer(sigmas, sigmas))[0] < SINGULAR:
                what = "the covariance is exact in some direction; exact: --fix"
                raise ValueInvalid(f"{place_of(measurements, row)}: {what}")
            information[row] = inverse(covariance)
    return TreeRows(
        np.array([bodies.number[name] for name in parents]), np.array([bodies.number[name] for name in children]),
        stacked(bodies.pose[name] for name in parents), stacked(bodies.pose[name] for name in children),
        stacked(m.transform for m in measurements), np.array([m.covariance is not None for m in measurements]),
        information,
    )  # fmt: skip


def _noise_hints(problem: TreeProblem, found: Fitted) -> list[str]:
    """Return a warning if there are too few loops to separate the sigma of metres from that of radians."""
    loops = int(found.kept.sum()) - problem.unknown
    if not (found.estimated and found.few_loops and loops < FEW_LOOPS):
        return []
    verb = "loop does" if loops == 1 else "loops do"
    return [f"{loops} {verb} not tell metres from radians: the sigmas are rough; give sigma"]


class TreeSolution:
    """A tree of measured frames, and the results for the measurements.

    root, frames: the reference frame; all frames, in order of first mention
    parents: of each frame, the one its entry names: the root, or the frame that it is fixed in (`fixed`)
    residuals (n, 6), u, used, checked, fits: of each measurement
    sigma: estimated (metres, radians) of those without a covariance, or None; sigma_factor: 1, or the factor by which
    the
        stated sigmas are too small, without changing them
    dof: degrees of freedom of metres and of radians; rms_distance, rms_angle: of the inliers
    tree: all of that as a tree with covariances
    hints: warnings about the sigmas
    rows: the number of used measurements of each frame; frame_checked: whether its pose in the root depends only on
    loops
    """

    def __init__(
        self, measurements: Sequence[Measurement], bodies: Bodies, problem: TreeProblem, found: Fitted,
        fits: list[str | None], fixed: Frames,
    ) -> None:  # fmt: skip
        """Compute the results of a fit."""
        self.measurements, self.fits = tuple(measurements), fits
        self.root, self.frames = bodies.root, bodies.frames
        self.fixed = frozenset(track.child for track in fixed.tracks())
        self._of, self._uncertainty = bodies, Uncertainty(problem, found)
        self.residuals: Array = problem.errors(found.bodies)
        self.used = found.kept
        noise = found.noise if found.estimated else None
        self.u: Array = problem.u(self.residuals, found.noise)
        self.sigma = noise and (noise.place, noise.turn)
        self.sigma_factor = found.noise.factor
        self.hints = _noise_hints(problem, found)
        self.dof = max(3 * (int(self.used.sum()) - problem.unknown), 0)
        self.rms_distance, self.rms_angle = (
            math.sqrt((part[self.used] ** 2).sum() / self.used.sum())
            for part in (self.residuals[:, :3], self.residuals[:, 3:])
        )
        rows = np.flatnonzero(self.used).tolist()
        tree = problem.tree(rows)
        alone = bridges(tree, problem.pairs, rows)
        self.checked = ~np.isin(np.arange(problem.size), list(alone))
        sure = [True] * bodies.size
        for body in tree.order[1:]:
            sure[body] = sure[tree.above[body]] and tree.row[body] not in alone
        self.frame_checked = {name: sure[bodies.number[name]] for name in self.frames}
        ends = Counter(name for row in rows for name in measurements[row][:2])
        self.rows = {name: ends[name] for name in self.frames}
        top = top_of(fixed, self.root)
        above = {name: track.parent if (track := fixed.track(name)) else self.root for name in self.frames}
        self.parents = {name: parent for name, parent in above.items() if name != top}
        number = np.array([bodies.number[name] for name in self.frames])
        self._poses = found.bodies[number] @ stacked(bodies.pose[name] for name in self.frames)
        self.poses = dict(zip(self.frames, self._poses.canonical(), strict=True))
        self.tree = FrameTree("the result")
        for name in self.frames:
            if (track := fixed.track(name)) is not None:
                self.tree.add(track.parent, name, Transform.of(*track.components), fixed.covariances.get(name))
            elif name in self.parents:
                self.tree.add(self.root, name, self.pose(name), self.marginal(name))
            else:
                self.tree.add_root(name)

    @property
    def count(self) -> int:
        """Return the number of measurements."""
        return len(self.measurements)

    def pose(self, frame: str, parent: str | None = None) -> Transform:
        """Return the pose of a frame in the root, or in another."""
        pose = self.poses[self._known(frame)]
        return pose if parent is None else self.poses[self._known(parent)].inverse() @ pose

    def covariance(self, target: str, source: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of source in target, from all loops; None if it is not known.

        As in ROS: x, y, z, rotation about X, Y, Z, in metres and radians along the axes of target.
        """
        return self._uncertainty.between(self._at(target), self._at(source))

    def marginal(self, frame: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of a frame in the root; None if it is not known."""
        return self._uncertainty.between((0, Transform.identity()), self._at(frame))

    def _known(self, frame: str) -> str:
        if frame not in self.poses:
            raise ValueInvalid(f"unknown frame {shown(frame)}{alternatives(frame, self.frames, 'frames')}")
        return frame

    def _at(self, frame: str) -> tuple[int, Transform]:
        return self._of.number[self._known(frame)], self._poses[self.frames.index(frame)]
