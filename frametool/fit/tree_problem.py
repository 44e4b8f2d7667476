"""The least-squares problem of measurements between bodies, which are groups of frames fixed to each other.

The graph: spanning trees and bridges.  The problem: initial poses, Gauss-Newton steps, noise and inliers.
"""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, alternatives, bare, first_of, printable, shown
from frametool.fit import least_squares as lsq
from frametool.frames.topology import Groups, Snapshot
from frametool.geometry.rigid import IDENTITY, compose
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.fit.blunders import Measurement
    from frametool.frames.lookups import Frames
    from frametool.geometry import Array

    Pairs = Sequence[tuple[int, int]]

MOST = 1000  # frames
TREES = 200  # spanning trees that are tried for initial poses
SINGULAR = 1e-12  # least eigenvalue of the correlations of a valid covariance
STEPS = 100
MOST_DAMPED = 1e12
CONVERGED = 1e-12  # size of the last step relative to the extent, in radians, and relative to a sigma
BORROWED = 0.3  # degrees of freedom of metres that radians add, and vice versa, if loops are few
LEAST_SHARE = 0.04  # least share of the variance that a fit leaves in the rows in loops


class SpanningTree(NamedTuple):
    """Rows that connect every body to the root by one path.

    order: the bodies, each after its parent
    parent: the parent of each body, itself for the root; row: the row that joins them, -1 for the root
    depth: the number of rows from the root
    """

    order: list[int]
    parent: list[int]
    row: list[int]
    depth: list[int]

    def rows_between(self, a: int, b: int) -> list[int]:
        """Return the rows on the path between two bodies."""
        rows = []
        while a != b:
            if self.depth[a] < self.depth[b]:
                a, b = b, a
            rows.append(self.row[a])
            a = self.parent[a]
        return rows


def spanning_tree(count: int, pairs: Pairs, rows: Iterable[int]) -> SpanningTree:
    """Return the tree of the first rows that close no loop (Kruskal); the rows must connect all bodies."""
    groups = Groups[int]()
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for row in rows:
        a, b = pairs[row]
        if groups.join(a, b):
            near[a].append((b, row))
            near[b].append((a, row))
    order, parent, by, depth = [0], [0] * count, [-1] * count, [0] * count
    for body in order:  # grows during the loop
        for other, row in near[body]:
            if row != by[body]:
                parent[other], by[other], depth[other] = body, row, depth[body] + 1
                order.append(other)
    return SpanningTree(order, parent, by, depth)


def bridges(tree: SpanningTree, pairs: Pairs, rows: Iterable[int]) -> set[int]:
    """Return the rows of a spanning tree that are in no loop with any of these rows."""
    found = {row for row in tree.row if row >= 0}
    for row in set(rows) - found:
        found.difference_update(tree.rows_between(*pairs[row]))
    return found


class Bodies(NamedTuple):
    """The bodies formed by measured and fixed frames.

    frames: in order of first mention; number: the body of each frame, 0 for the root's
    pose: of each frame in the first frame of its body, which is the root for body 0
    """

    root: str
    frames: tuple[str, ...]
    number: dict[str, int]
    pose: dict[str, Transform]


def bodies_of(measurements: Sequence[Measurement], root: str | None, fixed: Frames) -> Bodies:
    """Group frames into bodies; raises ValueInvalid for an unknown root, and if frames are not connected."""
    edges = [*((m.parent, m.child) for m in measurements), *((each.parent, each.child) for each in fixed.tracks())]
    frames = tuple(dict.fromkeys(name for edge in edges for name in edge))
    if len(frames) > MOST:
        raise ValueInvalid(f"{len(frames)} frames; solve takes at most {MOST}")
    if root is None:
        children = {child for _, child in edges}
        root = next((name for name in frames if name not in children), frames[0])
    elif root not in frames:
        raise ValueInvalid(f"unknown root {shown(root)}{alternatives(root, frames, 'frames')}")
    joined, groups = Groups[str](), dict[str, list[str]]()
    for edge in edges:
        joined.join(*edge)
    for name in frames:
        groups.setdefault(joined.of(name), []).append(name)
    if len(groups) > 1:
        texts = [first_of(sorted(group), 3, quote=bare) for group in groups.values()]
        raise ValueInvalid(f"no measurement connects {first_of(texts, 3, gap=' | ')}")
    tops = {name: name for name in frames} | Snapshot(fixed).roots
    first: dict[str, str] = {}  # the first frame of each body, by the root of its fixed tree
    for name in (root, *frames):
        first.setdefault(tops[name], name)
    number = {top: at for at, top in enumerate(first)}
    anchors = {name: first[tops[name]] for name in frames}
    pose = {name: Transform.identity() if name == at else fixed.lookup(at, name) for name, at in anchors.items()}
    return Bodies(root, frames, {name: number[tops[name]] for name in frames}, pose)


class Noise(NamedTuple):
    """The sigmas of measurements without a covariance, metres and radians, and the factor for those of the others."""

    translation: float = 0.01
    rotation: float = math.radians(1.0)
    factor: float = 1.0

    def at_least(self, other: Noise) -> Noise:
        """Return the larger of both sigmas each, with this factor."""
        return Noise(*map(max, self, other._replace(factor=self.factor)))


LOWEST = Noise(0.001, math.radians(0.1))  # of medians if loops are few: most rows of a tree have no residual


class TreeModel(NamedTuple):
    """The poses of the bodies, and the noise of measurements.

    estimated: True if the noise was estimated from the used rows
    few_loops: True if rotations can close all loops, so that metres alone do not determine their sigma
    """

    bodies: Transform
    noise: Noise
    estimated: bool = False
    few_loops: bool = False


def jacobians(parent: Transform, child: Transform, turned: Array) -> tuple[Array, Array]:
    """Return dr/da, dr/db, (n, 6, 6), of rows between frames a and b.

    parent, child: the poses of a and b in the root; turned: the rotation part of the errors, (n, 3)
    """
    back = parent.rotation.inverse().as_matrix()
    turn = lsq.inverse_left_jacobian(turned) @ back
    by_parent, by_child = np.zeros((2, *turned.shape[:-1], 6, 6))
    by_child[..., :3, :3], by_child[..., 3:, 3:] = back, turn
    by_parent[..., :3, :3], by_parent[..., 3:, 3:] = -back, -turn
    by_parent[..., :3, 3:] = back @ lsq.skew(child.xyz - parent.xyz)
    return by_parent, by_child


def by_body_step(jacobian: Array, body: Transform, frame: Transform) -> Array:
    """Convert the Jacobian by the step of a frame to that by the step of the body it is fixed to, by its lever arm."""
    moved = jacobian.copy()
    moved[..., 3:] -= jacobian[..., :3] @ lsq.skew(frame.xyz - body.xyz)
    return moved


class TreeProblem:
    """The measurements between bodies, and the poses of the bodies that fit them."""

    def __init__(self, measurements: Sequence[Measurement], bodies: Bodies) -> None:
        """Store the measurements as arrays: body numbers, poses of measured frames in the bodies, inverse covariances.

        Raises ValueInvalid for a singular covariance.
        """
        self.measurements, self.size, self.unknown = measurements, len(measurements), max(bodies.number.values())
        self.count = self.unknown + 1
        sides = [[each.parent for each in measurements], [each.child for each in measurements]]
        self.parent, self.child = (np.array([bodies.number[name] for name in side]) for side in sides)
        self.in_parent, self.in_child = (lsq.stacked(bodies.pose[name] for name in side) for side in sides)
        self.measured = lsq.stacked(each.transform for each in measurements)
        self.stated = np.array([each.covariance is not None for each in measurements])
        self._stated = np.zeros((self.size, 6, 6))  # inverses of the stated covariances
        for row in np.flatnonzero(self.stated).tolist():
            covariance = np.array(measurements[row].covariance, float).reshape(6, 6)
            sigmas = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
            if not sigmas.all() or np.linalg.eigvalsh(covariance / np.outer(sigmas, sigmas))[0] < SINGULAR:
                raise ValueInvalid(f"{self.place(row)}: the covariance is exact in some direction; exact: --fix")
            self._stated[row] = lsq.inverse(covariance)
        self.pairs = list(zip(self.parent.tolist(), self.child.tolist(), strict=True))
        self.arm = max(float(np.median(lsq.length(self.measured.xyz))), lsq.LEAST)
        across = self.in_parent @ self.measured @ self.in_child.inverse()  # parent_from_child, of bodies
        both = across.inverse(), across
        self._across = [[*zip(*(part.tolist() for part in each.components), strict=True)] for each in both]
        self._has_effect = (self.parent != self.child)[:, None, None]  # a row within a body has no effect

    def place(self, row: int) -> str:
        """Return the file and line of a measurement, else its number, for messages."""
        return printable(self.measurements[row].place) or f"measurement {row + 1}"

    def ends(self, bodies: Transform) -> tuple[Transform, Transform]:
        """Return the poses of the parent and of the child frame of each row in the root."""
        return bodies[self.parent] @ self.in_parent, bodies[self.child] @ self.in_child

    def errors(self, bodies: Transform) -> Array:
        """Return the residuals, (n, 6)."""
        parent, child = self.ends(bodies)
        return lsq.errors(parent.inverse() @ child, self.measured)

    def information(self, noise: Noise, factor: float = 1.0) -> Array:
        """Return the inverse covariances, (n, 6, 6); factor: that of stated sigmas."""
        diagonal = [noise.translation**-2] * 3 + [noise.rotation**-2] * 3
        return np.where(self.stated[:, None, None], self._stated / factor**2, np.diag(diagonal))

    def u(self, errors: Array, noise: Noise) -> Array:
        """Return the residual of each row in sigmas: the root mean square of its six numbers."""
        return lsq.sigmas(errors, self.information(noise, noise.factor))

    def tree(self, rows: Iterable[int]) -> SpanningTree:
        """Return the spanning tree of the first rows that close no loop."""
        return spanning_tree(self.count, self.pairs, rows)

    # initial values

    def initial_bodies(self, trees: int) -> Transform:
        """Return the poses of the bodies by the spanning tree with which most other rows agree.

        trees: the number of trees to try: of the rows in their order, then shuffled, and last sorted by the least
        residual that each row had in any tree; that of outliers is never small.
        """
        shuffled = random.Random(0)  # noqa: S311 - random() gives the same numbers in every Python
        rows = range(self.size)
        best = lsq.stacked([Transform.identity()] * self.count)
        least, closest = math.inf, np.full(self.size, math.inf)

        for at in range(trees + (trees > 1)):
            order: Sequence[int] = rows
            if at:
                by = closest.tolist() if at == trees else [shuffled.random() for _ in rows]
                order = sorted(rows, key=by.__getitem__)
            tree = self.tree(order)
            placed = self.poses_along(tree)
            off = np.log1p(self.u(self.errors(placed), Noise()) ** 2)
            if (sum_off := float(off.sum())) < least:
                best, least = placed, sum_off
            off[tree.row[1:]] = math.inf  # the rows of the tree itself have no residual
            closest = np.minimum(closest, off)
        return best

    def poses_along(self, tree: SpanningTree) -> Transform:
        """Return the poses of the bodies, composed from the measurements along a tree."""
        poses = [IDENTITY] * self.count
        for body in tree.order[1:]:
            row = tree.row[body]
            poses[body] = compose(*poses[tree.parent[body]], *self._across[self.pairs[row][1] == body][row])
        return Transform.of(*map(np.array, zip(*poses, strict=True)))

    # Gauss-Newton

    def normal_equations(self, bodies: Transform, information: Array) -> tuple[Array, Array, float]:
        """Return J'LJ and J'Lr, with six rows for each unknown body, and r'Lr."""
        (parent, child), count = self.ends(bodies), self.count
        off = lsq.errors(parent.inverse() @ child, self.measured)
        by_parent, by_child = (self._has_effect * by for by in jacobians(parent, child, off[:, 3:]))
        sides = [
            (self.parent, by_body_step(by_parent, bodies[self.parent], parent)),
            (self.child, by_body_step(by_child, bodies[self.child], child)),
        ]
        weighed = lsq.applied(information, off)
        normal, gradient = np.zeros((count, count, 6, 6)), np.zeros((count, 6))
        for body, by in sides:
            np.add.at(gradient, body, lsq.applied(by.swapaxes(1, 2), weighed))
            for other, by_other in sides:
                np.add.at(normal, (body, other), by.swapaxes(1, 2) @ information @ by_other)
        size = 6 * self.unknown
        matrix = normal[1:, 1:].swapaxes(1, 2).reshape(size, size)
        return matrix, gradient[1:].reshape(size), float((off * weighed).sum())

    def damped_step(self, bodies: Transform, information: Array, damping: float) -> tuple[Transform, float, float]:
        """Take one Gauss-Newton step, damped until it helps; return the bodies, the step's size and the damping."""
        normal, gradient, before = self.normal_equations(bodies, information)
        diagonal = np.diagonal(normal).copy()
        extent = max(float(np.abs(bodies.xyz).max()), lsq.LEAST)
        while damping < MOST_DAMPED:
            np.fill_diagonal(normal, diagonal * (1.0 + damping))
            step = np.zeros((self.count, 6))
            step[1:] = -lsq.solve_normal(normal, gradient[:, None]).reshape(-1, 6)
            moved, size = lsq.stepped(bodies, step), float(np.abs(step / ([extent] * 3 + [1.0] * 3)).max())
            off = self.errors(moved)
            after = float((off * lsq.applied(information, off)).sum())
            if size <= CONVERGED or after <= before * (1 + 1e-12):
                return moved, size, damping / 10 if damping > 1e-9 else 0.0
            damping = max(damping * 10, 1e-6)
        return bodies, 0.0, 0.0

    # noise, and selection of rows

    def estimated_noise(self, bodies: Transform, kept: Any, noise: Noise, *, estimate: bool, few_loops: bool) -> Noise:
        """Estimate the noise of the used rows: sums of squares over their degrees of freedom.

        noise: the previous estimate; few_loops: as in TreeModel
        estimate: also the sigmas of measurements without a covariance
        """
        dof = 3.0 * (kept.sum() - self.unknown)
        if dof <= 0:
            return Noise()
        errors = self.errors(bodies)
        free, stated = kept & ~self.stated, kept & self.stated
        factor = 1.0
        if stated.any():
            chi2 = 6 * float((self.u(errors, Noise())[stated] ** 2).sum())
            factor = max(1.0, math.sqrt(chi2 / (2 * dof * stated.sum() / kept.sum())))
        if not estimate:
            return Noise(factor=factor)
        squares = [float((part[free] ** 2).sum()) for part in np.hsplit(errors, 2)]
        dofs = [dof * free.sum() / kept.sum()] * 2
        if few_loops:
            # with the degrees of freedom of metres and of radians the sigmas converge to the maximum of the restricted
            # likelihood (REML); source: Foerstner 1979
            information = self.information(noise) * kept[:, None, None]
            covariance = lsq.inverse(self.normal_equations(bodies, information)[0])
            information *= ~self.stated[:, None, None]
            for at, half in enumerate(np.kron(np.eye(2), np.ones(3))):
                own = self.normal_equations(bodies, information * np.outer(half, half))[0]
                dofs[at] = BORROWED + (3.0 * free.sum() - float((covariance * own).sum()))
            squares[0] += BORROWED * (noise.rotation * self.arm) ** 2
            squares[1] += BORROWED * (noise.translation / self.arm) ** 2
        s_t, s_r = (max(float(np.sqrt(each / own)), lsq.LEAST) for each, own in zip(squares, dofs, strict=True))
        return Noise(s_t, s_r, factor)

    def median_noise(self, errors: Array, looped: Any) -> Noise:
        """Return the noise from the medians of the rows in loops."""
        unknown = self.unknown - (self.size - looped.sum())  # every row in no loop determines one body
        share = math.sqrt(max(1 - unknown / looped.sum(), LEAST_SHARE))
        free, stated = looped & ~self.stated, looped & self.stated
        noise = Noise()
        if stated.any():
            factor = float(np.median(_odd_count(self.u(errors, noise)[stated]))) / (lsq.MEDIAN_OF_SIX * share)
            noise = noise._replace(factor=max(1.0, factor))
        if free.any():
            s_t, s_r = (lsq.median_sigma(_odd_count(each), share) for each in lsq.lengths(errors[free]).T)
            noise = Noise(s_t, s_r, noise.factor)
        return noise.at_least(LOWEST) if looped.sum() <= 2 * unknown else noise

    def fitted(self, *, robust: bool) -> lsq.RobustFit[TreeModel]:
        """Fit the bodies by least squares, to the inliers if robust, else to all rows."""
        every = range(self.size)
        bodies, noise = self.initial_bodies(TREES if robust and self.size > self.unknown else 1), Noise()
        kept = np.ones(self.size, bool)
        looped = kept.copy()
        looped[list(bridges(self.tree(every), self.pairs, every))] = False

        def by_medians(bodies: Transform) -> Array:
            errors = self.errors(bodies)
            return self.u(errors, self.median_noise(errors, looped))

        def rough(bodies: Transform, weights: Array) -> Transform:
            information = self.information(self.median_noise(self.errors(bodies), looped))
            return self.damped_step(bodies, information * weights[:, None, None], 0.0)[0]

        if robust and looped.any():
            bodies, kept = lsq.first_inliers(bodies, by_medians, rough)
            noise = self.median_noise(self.errors(bodies), looped)
        return lsq.refit_inliers(lsq.RobustFit(TreeModel(bodies, noise), kept), self.refitted, robust=robust)

    def refitted(self, found: lsq.RobustFit[TreeModel], kept: Any) -> lsq.RobustFit[TreeModel]:
        """Fit the used rows, and the best of the others that are needed to connect all frames.

        Bodies and noise are iterated until both converge.
        """
        bodies, noise, *_ = found.model
        u = self.u(self.errors(bodies), noise)
        tree = self.tree(np.lexsort((u, ~kept)).tolist() if not kept.all() else range(self.size))
        reached = np.isin(np.arange(self.size), tree.row)
        if (reached & ~kept).any():
            kept, bodies = kept | reached, self.poses_along(tree)
        alone = np.isin(np.arange(self.size), list(bridges(tree, self.pairs, np.flatnonzero(kept).tolist())))
        estimate = bool((kept & ~alone & ~self.stated).any()) and kept.sum() > self.unknown
        few_loops = bool((kept & ~alone).sum() <= 2 * (self.unknown - alone.sum()))
        damping = 0.0
        for _ in range(STEPS):
            information = self.information(noise) * kept[:, None, None]
            bodies, size, damping = self.damped_step(bodies, information, damping)
            before, noise = noise, self.estimated_noise(bodies, kept, noise, estimate=estimate, few_loops=few_loops)
            changes = (abs(new / old - 1) for new, old in zip(noise, before, strict=True))
            if size <= CONVERGED and max(changes) <= CONVERGED:
                break
        model = TreeModel(bodies, noise, estimate, few_loops)
        return lsq.RobustFit(model, kept, u=self.u(self.errors(bodies), noise))


def _odd_count(values: Array) -> Array:
    """Return the values, an even number of them without the largest: of two rows that disagree one is wrong."""
    return values if len(values) % 2 else np.sort(values)[:-1]
