"""Estimate a tree from measurements: the pose of each frame in the root, its covariance, and the outliers.

Frames that are fixed to each other are one body; bodies are numbered, 0 is the root's.  A row measures a frame of one
body in a frame of another: r = [t(P) - t(M), Log(R(P) R(M)')], P = inv(X_a) X_b.  The poses of the bodies are robust
least squares: Gauss-Newton, outlier rejection.  Outliers are explained by common mistakes; if another row of the loop
has one, that row is rejected instead; a loop whose outlier cannot be identified is an error.  Covariances are first
order, the inverse of the normal equations.
"""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid, alternatives, first_of, printable, shown, warn
from frametool.fit import least_squares as lsq
from frametool.fit.blunders import best_blunder
from frametool.fit.tree_problem import Noise, TreeModel, TreeProblem, bodies_of, bridges, by_body_step, jacobians
from frametool.frames.lookups import FrameTree
from frametool.frames.topology import Groups, Snapshot
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.fit.blunders import Measurement
    from frametool.fit.tree_problem import Bodies
    from frametool.frames.lookups import Frames
    from frametool.geometry import Array


class TreeFit:
    """A fit and its inliers: residuals, rows in no loop, covariances, and explanations of the outliers."""

    def __init__(self, problem: TreeProblem, found: lsq.RobustFit[TreeModel]) -> None:
        """Store a fit; covariances are not computed yet."""
        self.problem, self.found = problem, found
        kept = np.flatnonzero(found.kept).tolist()
        self.tree = problem.tree(kept)
        self.unchecked = bridges(self.tree, problem.pairs, kept)
        self.parents, self.children = problem.ends(found.model.bodies)
        self.poses = self.parents.inverse() @ self.children
        self.errors = lsq.errors(self.poses, problem.measured)
        self._known = Groups[int]()
        for row in np.flatnonzero(found.kept & (problem.stated | found.model.estimated)).tolist():
            self._known.join(*problem.pairs[row])

    def covariance(self, target: tuple[int, Transform], source: tuple[int, Transform]) -> Array | None:
        """Return the covariance (6, 6) of the pose of source in target, along target's axes.

        target, source: a frame each: the number of its body, and its pose in the root
        Returns None if it depends on rows whose noise is neither stated nor observable from a loop.
        """
        if target[0] == source[0]:
            return np.zeros((6, 6))
        if self._known.of(target[0]) != self._known.of(source[0]):
            return None
        by_ends = zip((target, source), jacobians(target[1], source[1], np.zeros(3)), strict=True)
        slopes = np.hstack([by_body_step(by, self.found.model.bodies[body], frame) for (body, frame), by in by_ends])
        ends = [target[0], source[0]]
        found: Array = slopes @ self._of_bodies[ends][:, :, ends].reshape(12, 12) @ slopes.T
        return (found + found.T) / 2.0

    @cached_property
    def _of_bodies(self) -> Array:
        """Return the covariance of all bodies, (bodies, 6, bodies, 6); zeros for the root."""
        problem, found = self.problem, self.found
        information = problem.information(found.model.noise) * found.kept[:, None, None]
        whole = np.zeros((problem.count, 6, problem.count, 6))
        if problem.unknown:
            normal = problem.normal_equations(found.model.bodies, information)[0]
            whole[1:, :, 1:] = lsq.inverse(normal).reshape(problem.unknown, 6, problem.unknown, 6)
        return whole

    def explain_outliers(self) -> tuple[TreeFit, list[str | None]]:
        """Explain the rejected rows by mistakes; where a rival has a mistake instead, reject the rival and fit again.

        Returns the fit, and the mistake of each row or None.
        Raises ValueInvalid if none of a row and its rivals, or more than one, has a mistake that fits.
        """
        fit, problem = self, self.problem
        tried = {fit.found.kept.tobytes()}
        while True:
            fits, noise, swaps, undecided = fit.try_blunders()
            for back, out in ((noise, []), *(([row], [rival]) for row, rival in swaps)):
                kept = fit.found.kept.copy()
                kept[back], kept[out] = True, False
                if kept.tobytes() not in tried:
                    break
            else:
                break
            tried.add(kept.tobytes())
            bodies = problem.poses_along(problem.tree(np.flatnonzero(kept).tolist()))
            start = lsq.RobustFit(TreeModel(bodies, fit.found.model.noise), kept)
            fit = TreeFit(problem, lsq.refit_inliers(start, problem.refitted, robust=True))
        if undecided:
            row, rivals = undecided
            off = lsq.off_text(*lsq.length(fit.errors[row].reshape(2, 3)))
            places = [problem.place(each) for each in sorted([row, *rivals])]
            leave = f" (--without {problem.place(row)})" if problem.measurements[row].place else ""
            loop = f"{first_of(places, 2)} form a loop open by {off}"
            raise ValueInvalid(f"undecided: {loop}; measure again or leave one out{leave}")
        return fit, fits

    def try_blunders(self) -> tuple[list[str | None], list[int], list[tuple[int, int]], tuple[int, list[int]] | None]:
        """Try the mistakes on each rejected row, and on its rivals: used rows that only this row checks.

        Returns the mistake of each row; the rows without one that the uncertainty of the fit explains; the rows to
        exchange, (rejected, rival); and the first row whose loop does not identify the outlier, with its rivals.
        """
        measurements, noise_found = self.problem.measurements, self.found.model.noise
        information = self.problem.information(noise_found, noise_found.factor)
        floor = noise_found.at_least(Noise()) if self.found.model.few_loops else noise_found
        least_information = self.problem.information(floor, floor.factor)
        fits: list[str | None] = [None] * self.problem.size
        noise, swaps, undecided = list[int](), list[tuple[int, int]](), None
        for row in np.flatnonzero(~self.found.kept).tolist():
            rivals = sorted(self.unchecked.intersection(self.tree.rows_between(*self.problem.pairs[row])))
            words = {row: best_blunder(measurements[row], self.poses[row], information[row])}
            for rival in rivals:
                pose = self._pose_without(rival, row)
                words[rival] = best_blunder(measurements[rival], pose, information[rival])
            mistaken = [each for each, blunder in words.items() if blunder]
            unsure = self._with_fit_uncertainty(row, least_information[row])
            if not mistaken and self.errors[row] @ unsure @ self.errors[row] <= 6 * lsq.KEPT**2:
                noise.append(row)
            if not rivals:
                uncertain = self._with_fit_uncertainty(row, information[row])
                fits[row] = words[row] or best_blunder(measurements[row], self.poses[row], uncertain)
            elif mistaken == [row]:
                fits[row] = words[row]
            elif len(mistaken) == 1:
                swaps.append((row, mistaken[0]))
            else:
                undecided = undecided or (row, rivals)
        return fits, noise, swaps, undecided

    def _with_fit_uncertainty(self, row: int, information: Array) -> Array:
        """Return the information (6, 6) of a row, reduced by the uncertainty of the fit between the row's frames."""
        parent, child = self.problem.pairs[row]
        uncertainty = self.covariance((parent, self.parents[row]), (child, self.children[row]))
        return information if uncertainty is None else lsq.inverse(lsq.inverse(information) + uncertainty)

    def _pose_without(self, rival: int, row: int) -> Transform:
        """Return the pose that a rival would measure if the rejected row placed the bodies beyond the rival."""
        measured, pairs, below = self.problem.measured[row], self.problem.pairs, set[int]()
        for body in self.tree.order:
            if self.tree.row[body] == rival or self.tree.parent[body] in below:
                below.add(body)
        parent, child = self.parents[row], self.children[row]
        if pairs[row][1] in below:
            moved = parent @ measured @ child.inverse()
        else:
            moved = child @ measured.inverse() @ parent.inverse()
        ends = self.parents[rival], self.children[rival]
        parent, child = (moved @ end if body in below else end for end, body in zip(ends, pairs[rival], strict=True))
        return parent.inverse() @ child


FEW_LOOPS = 6  # with fewer loops the sigmas are rough if rotations can close them


def solve_tree(
    measurements: Sequence[Measurement], *, root: str | None = None, fixed: Frames | None = None, robust: bool = True
) -> TreeSolution:
    """Find the tree that fits measurements best.

    root: the frame in which the others are expressed; default the first that is never a child
    fixed: a tree of exact edges, whose frames move as one body
    robust: reject outliers
    Raises ValueInvalid if frames are not connected, the root is unknown, or loops do not identify an outlier.
    """
    if not measurements:
        raise ValueInvalid("no measurements")
    for row, each in enumerate(measurements, 1):
        if each.parent == each.child:
            place = printable(each.place) or f"measurement {row}"
            raise ValueInvalid(f"{place}: {shown(each.child)} is measured from itself")
    fixed = fixed or FrameTree()
    bodies = bodies_of(measurements, root, fixed)
    try:
        with np.errstate(over="raise", invalid="raise"):
            problem = TreeProblem(measurements, bodies)
            return TreeSolution(*TreeFit(problem, problem.fitted(robust=robust)).explain_outliers(), bodies, fixed)
    except (lsq.Undetermined, FloatingPointError):
        far = max(abs(part) for each in measurements for part in each.components[:3])
        raise ValueInvalid(f"translations (up to {far:.3g} m) or sigmas differ too much in size to be solved") from None


class TreeSolution:
    """A tree of measured frames, and the results for the measurements.

    root, frames: the reference frame; all frames, in order of first mention
    residuals (n, 6), u, used, checked, fits: of each measurement; checked: it is in a loop; fits: its mistake
    sigma: estimated (metres, radians) of measurements without a covariance, or None
    sigma_factor: 1, or the factor by which the stated sigmas are too small; they are not changed
    dof: degrees of freedom of metres and of radians; rms: of the inliers, metres and radians
    tree: the result as a tree with covariances: frames in the root, or in the frame that they are fixed in
    poses: of all frames in the root; rows: the number of used measurements of each frame
    frame_checked: True if every measurement between a frame and the root is in a loop
    """

    def __init__(self, fit: TreeFit, fits: list[str | None], bodies: Bodies, fixed: Frames) -> None:
        """Compute the results of a fit."""
        problem, found = fit.problem, fit.found
        self.measurements, self.fits = tuple(problem.measurements), fits
        self.root, self.frames = bodies.root, bodies.frames
        self._number, self._fit = bodies.number, fit
        self.residuals, self.used = fit.errors, found.kept
        self.u = found.u
        self.sigma = (found.model.noise.translation, found.model.noise.rotation) if found.model.estimated else None
        self.sigma_factor = found.model.noise.factor
        loops = int(found.kept.sum()) - problem.unknown
        self.dof = max(3 * loops, 0)
        if found.model.estimated and found.model.few_loops and loops < FEW_LOOPS:
            verb = "loop does" if loops == 1 else "loops do"
            warn(f"{loops} {verb} not tell metres from radians: the sigmas are rough; give sigma")
        squares = (fit.errors[found.kept] ** 2).reshape(-1, 2, 3).sum((0, 2))
        self.rms: tuple[float, float] = tuple(np.sqrt(squares / found.kept.sum()).tolist())
        self.checked = ~np.isin(np.arange(problem.size), list(fit.unchecked))
        sure = [True] * problem.count
        for body in fit.tree.order[1:]:
            sure[body] = sure[fit.tree.parent[body]] and fit.tree.row[body] not in fit.unchecked
        self.frame_checked = {name: sure[bodies.number[name]] for name in self.frames}
        used = (each for each, kept in zip(problem.measurements, found.kept, strict=True) if kept)
        ends = Counter(name for each in used for name in each[:2])
        self.rows = {name: ends[name] for name in self.frames}
        number = np.array([bodies.number[name] for name in self.frames])
        self._poses = found.model.bodies[number] @ lsq.stacked(bodies.pose[name] for name in self.frames)
        self.poses = dict(zip(self.frames, self._poses.canonical(), strict=True))
        self.tree, top = FrameTree("the result"), Snapshot(fixed).roots.get(self.root, self.root)
        for name in self.frames:
            if (track := fixed.track(name)) is not None:
                self.tree.add(track.parent, name, Transform.of(*track.components), fixed.covariances.get(name))
            elif name == top:
                self.tree.add_root(name)
            else:
                self.tree.add(self.root, name, self.poses[name], self.covariance(self.root, name))

    def covariance(self, target: str, source: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of source in target, from all loops; None if it is not known.

        As in ROS: x, y, z, rotation about X, Y, Z, in metres and radians along the axes of target.
        """
        for frame in (target, source):
            if frame not in self.poses:
                raise ValueInvalid(f"unknown frame {shown(frame)}{alternatives(frame, self.frames, 'frames')}")
        ends = ((self._number[frame], self._poses[self.frames.index(frame)]) for frame in (target, source))
        return self._fit.covariance(*ends)
