"""The tree that measurements mean: where each frame is in the root, how sure that is, what was left out and why."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.fit.graph import bodies_of, bridges, require_connected
from frametool.fit.least_squares import NotSettled, PoseArrays, inverse
from frametool.fit.tree_solver import Fitted, TreeProblem, TreeRows
from frametool.fit.verdicts import Uncertainty, judged, place_of
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.fit.graph import Bodies, Fixed
    from frametool.frames.lookups import FrameTree
    from frametool.geometry.types import Array
    from frametool.stream.measurements import Measurement

ROOT = PoseArrays(np.eye(3), np.zeros(3))
FEW_LOOPS = 6  # fewer leave the sigmas rough where rotations can close them
SINGULAR = 1e-12  # of the correlations: the least eigenvalue that a covariance has


def solve_tree(
    measurements: Sequence[Measurement], *, root: str | None = None, fixed: Fixed = (), robust: bool = True,
    progress: Callable[[float], None] | None = None,
) -> TreeSolution:  # fmt: skip
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
            raise ValueInvalid(f"{place_of(measurements, row)}: {shown(each.child)} is measured from itself")
    told = progress or (lambda _: None)
    bodies = bodies_of(measurements, root, fixed)
    require_connected(bodies, [(bodies.number[each.parent], bodies.number[each.child]) for each in measurements])
    try:
        with np.errstate(over="raise", invalid="raise"):
            problem = TreeProblem(_rows(measurements, bodies), bodies.size)
            found, fits = judged(problem, measurements, problem.fitted(robust=robust, told=told))
            told(1.0)
            return TreeSolution(measurements, bodies, problem, found, fits)
    except (NotSettled, FloatingPointError):
        far = max(abs(part) for each in measurements for part in each.components[:3])
        raise ValueInvalid(f"translations (up to {far:.3g} m) or sigmas differ too much in size to be solved") from None


def _rows(measurements: Sequence[Measurement], bodies: Bodies) -> TreeRows:
    """Return measurements as arrays."""
    parents, children = [m.parent for m in measurements], [m.child for m in measurements]
    information = np.zeros((len(measurements), 6, 6))
    for row, each in enumerate(measurements):
        if each.covariance is not None:
            covariance = np.array(each.covariance, float).reshape(6, 6)
            _require_regular(covariance, place_of(measurements, row))
            information[row] = inverse(covariance)
    return TreeRows(
        np.array([bodies.number[name] for name in parents]), np.array([bodies.number[name] for name in children]),
        _poses([bodies.pose[name] for name in parents]), _poses([bodies.pose[name] for name in children]),
        _poses([m.transform for m in measurements]), np.array([m.covariance is not None for m in measurements]),
        information,
    )  # fmt: skip


def _require_regular(covariance: Array, place: str) -> None:
    sigmas = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    if not sigmas.all() or np.linalg.eigvalsh(covariance / np.outer(sigmas, sigmas))[0] < SINGULAR:
        raise ValueInvalid(f"{place}: the covariance is exact in some direction; exact: --fix")


def _poses(transforms: list[Transform]) -> PoseArrays:
    parts = zip(*(each.components for each in transforms), strict=True)
    return PoseArrays.of(Transform.of(*(np.array(part, float) for part in parts)))


def _noise_hints(problem: TreeProblem, found: Fitted) -> list[str]:
    """Return a warning where too few loops separate the sigma of metres from that of radians."""
    loops = int(found.kept.sum()) - problem.unknown
    if not (found.estimated and found.few_loops and loops < FEW_LOOPS):
        return []
    verb = "loop does" if loops == 1 else "loops do"
    return [f"{loops} {verb} not tell metres from radians: the sigmas are rough; give sigma"]


class TreeSolution:
    """A tree of measured frames, and what the measurements say about it.

    root, frames: the frame that all are given in; all, in order of first mention
    parents: of each frame, the one its entry names: the root, or the frame that it is fixed in (`fixed`)
    residuals (n, 6), u, used, checked, fits: of each measurement
    sigma: estimated (metres, radians) of those without a covariance, or None; sigma_factor: 1, or how much too small
    the given sigmas are; they are believed all the same
    dof: degrees of freedom of either half; rms_distance, rms_angle: of those used
    tree: all of that as a tree with covariances, where `frametool.solve` made it
    hints: what a person should know of the sigmas
    rows: how many measurements of each frame are used; frame_checked: whether its pose in the root rests on loops only
    """

    tree: FrameTree

    def __init__(
        self, measurements: Sequence[Measurement], bodies: Bodies, problem: TreeProblem, found: Fitted,
        fits: list[str | None],
    ) -> None:  # fmt: skip
        """Look at a fit from all sides."""
        self.measurements, self.fits = tuple(measurements), fits
        self.root, self.frames, self.fixed = bodies.root, bodies.frames, frozenset(bodies.parent)
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
        kept = np.flatnonzero(self.used).tolist()
        tree = problem.tree(kept)
        alone = bridges(tree, problem.pairs, kept)
        self.checked = ~np.isin(np.arange(problem.size), list(alone))
        sure = [True] * bodies.size
        for body in tree.order[1:]:
            sure[body] = sure[tree.above[body]] and tree.row[body] not in alone
        self.frame_checked = {name: sure[bodies.number[name]] for name in self.frames}
        ends = Counter(name for row in kept for name in measurements[row][:2])
        self.rows = {name: ends[name] for name in self.frames}
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
        return self._uncertainty.between(self._at(target), self._at(source))

    def marginal(self, frame: str) -> Array | None:
        """Return the covariance (6, 6) of the pose of a frame in the root; None where it is not known."""
        return self._uncertainty.between((0, ROOT), self._at(frame))

    def _known(self, frame: str) -> str:
        if frame not in self.poses:
            raise ValueInvalid(f"unknown frame {shown(frame)}{alternatives(frame, self.frames, 'frames')}")
        return frame

    def _at(self, frame: str) -> tuple[int, PoseArrays]:
        return self._of.number[self._known(frame)], self._poses.at(self.frames.index(frame))

    def _entries(self) -> dict[str, str]:
        """Return the parent of every frame but one: the root, or what the root itself hangs from if that is fixed."""
        fixed = self._of.parent
        top = self.root
        while top in fixed:
            top = fixed[top]
        return {name: fixed.get(name, self.root) for name in self.frames if name != top}
