"""Estimate a tree from measurements: the pose of each frame in the root, its covariance, and the outliers.

Frames that are fixed to each other form bodies, numbered, 0 is the root.  A row measures a frame of one body in a frame
of another: r = [t(P) - t(M), Log(R(P) R(M)')], P = inv(X_a) X_b.  The poses of the bodies are robust least squares:
Gauss-Newton, outlier rejection.  Outliers are explained by common mistakes; if another row of the loop has one, that
row is rejected instead; a loop whose outlier cannot be identified is an error.  Covariances are first order, the
inverse of the normal equations.
"""

from __future__ import annotations

import math
import random
import re
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import Finding, NotConnected, ValueInvalid, alternatives, bare, first_of, printable, shown, warn
from frametool.fit import least_squares as lsq
from frametool.frames.lookups import Frames, FrameTree
from frametool.frames.topology import Groups, Snapshot
from frametool.geometry.conventions import axes_change
from frametool.geometry.rigid import IDENTITY, compose
from frametool.geometry.transform import Rotation, Transform
from frametool.lint.tree_diff import Tolerance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any

    from frametool.geometry.types import Array, Rigid

    Pairs = Sequence[tuple[int, int]]


class Measurement(NamedTuple):
    """The pose of a child in its parent, as somebody measured it.

    components: tx, ty, tz, x, y, z, w; metres
    covariance: 36 numbers as ROS orders them, in the parent's axes; None where nobody gave it
    place: where it is, `m.yaml:12`, and its column behind that where several are on a line
    written: how its rotation was written, "rpy" or "rotvec", with the three numbers as read, in radians
    """

    parent: str
    child: str
    components: Rigid
    covariance: tuple[float, ...] | None = None
    place: str = ""
    id: str | None = None
    written: tuple[str, tuple[float, float, float]] | None = None

    @property
    def transform(self) -> Transform:
        """Return parent_from_child."""
        return Transform.of(*self.components)

    def turned(self, x: float, y: float, z: float, w: float) -> Transform:
        """Return it with another quaternion."""
        return Transform.of(*self.components[:3], x, y, z, w)

    def shifted(self, factor: float) -> Transform:
        """Return it with its translation times a factor."""
        x, y, z, *turn = self.components
        return Transform.of(x * factor, y * factor, z * factor, *turn)

    def reread(self, change: Callable[[Array], Array], *kinds: str) -> Transform | None:
        """Return it with its angles changed; None where its rotation was not written in one of these kinds."""
        kind, angles = self.written or ("", ())
        if kind not in kinds:
            return None
        read = Rotation.from_rpy if kind == "rpy" else Rotation.from_rotvec
        return self.turned(*read(change(np.array(angles))).components)


NEAR = Tolerance(0.01, math.radians(1.0))  # the tolerance without any sigmas
FITTING = 4.0  # sigmas: a mistake explains a measurement that it brings this near
ALIKE = 0.5  # sigmas: mistakes with so similar results are equally good
TIE = 1e-9  # of u: an improvement below this does not count
O = Transform(axes_change("flu", "optical"), (0.0, 0.0, 0.0))  # body_from_optical, in the notation of papers


# the intended measurement, if this mistake was made
BLUNDERS: dict[str, Callable[[Measurement], Transform | None]] = {
    "inverted": lambda m: m.transform.inverse(),
    "rotation inverted": lambda m: m.turned(*m.transform.rotation.inverse().components),
    "translation of the inverse": lambda m: m.turned(*m.transform.rotation.inverse().components).inverse(),
    "wxyz taken for xyzw": lambda m: m.turned(*m.components[4:], m.components[3]),
    "xyzw taken for wxyz": lambda m: m.turned(m.components[6], *m.components[3:6]),
    "millimetres": lambda m: m.shifted(1e-3), "metres taken for millimetres": lambda m: m.shifted(1e3),
    "degrees taken for radians": lambda m: m.reread(np.radians, "rpy", "rotvec"),
    "radians taken for degrees": lambda m: m.reread(np.degrees, "rpy", "rotvec"),
    "yaw, pitch, roll taken for roll, pitch, yaw": lambda m: m.reread(np.flip, "rpy"),
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
    off = lsq.errors(pose, lsq.stacked(tried))
    u = lsq.sigmas(off, information)
    best = int(u[:-1].argmin())
    if u[best] > FITTING or u[best] >= u[-1] * (1 - TIE):
        return None
    as_good = (lsq.sigmas(off - off[best], information) <= ALIKE) & (u <= FITTING)
    return list(meant)[int(as_good.argmax())]


def parted(place: str) -> tuple[str, int, int]:
    """Take a place apart: file, line, column; 0 where it does not say that."""
    file, line, column = re.fullmatch(r"(?s)(.*?)(?::(\d+))?(?::(\d+))?", place).groups("0")  # type: ignore[union-attr]
    return file, int(line), int(column)


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
        error = lsq.errors(pose, each.transform)
        metres, radians = map(float, lsq.length(error.reshape(2, 3)))
        if tolerance is None and each.covariance is not None:
            information = np.linalg.pinv(np.reshape(each.covariance, (6, 6)), hermitian=True)
            u = lsq.sigmas(error[None], information)[0]
            agrees, sigmas = u <= lsq.KEPT, f" ({u:.1f} sigmas)"
        else:
            near = tolerance or NEAR
            agrees, sigmas = metres <= near.metres and radians <= near.radians, ""
            # `FITTING` sigmas are reached if both parts reach the tolerance
            sigma = np.maximum(np.repeat([near.metres, near.radians], 3), lsq.LEAST) / FITTING / 3**0.5
            information = np.diag(sigma**-2.0)
        if not agrees:
            words = best_blunder(each, pose, information)
            off = f"{lsq.off_text(metres, radians)}{sigmas} off the tree"
            message = f"{printable(each.parent)}<-{printable(each.child)} is {off}"
            message += f"; fits when {words}" if words else ""
            findings.append(Finding("loop", message, *parted(each.place)))
    return findings, [*lacking], apart


# --- the graph of measurements, and its bodies ---


class SpanningTree(NamedTuple):
    """Rows that connect every body to the root by one path.

    order: the bodies, each after its parent
    above: the parent of each body, itself for the root; row: the row that joins them, -1 for the root
    depth: the number of rows from the root
    """

    order: list[int]
    above: list[int]
    row: list[int]
    depth: list[int]

    def way(self, a: int, b: int) -> list[int]:
        """Return the rows between two bodies."""
        rows = []
        while a != b:
            if self.depth[a] < self.depth[b]:
                a, b = b, a
            rows.append(self.row[a])
            a = self.above[a]
        return rows


def spanning_tree(count: int, pairs: Pairs, rows: Iterable[int]) -> SpanningTree:
    """Return the tree of the first rows that close no loop (Kruskal); together the rows join all bodies."""
    groups = Groups[int]()
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for row in rows:
        a, b = pairs[row]
        if groups.join(a, b):
            near[a].append((b, row))
            near[b].append((a, row))
    order, above, by, depth = [0], [0] * count, [-1] * count, [0] * count
    for body in order:  # grows during the loop
        for other, row in near[body]:
            if row != by[body]:
                above[other], by[other], depth[other] = body, row, depth[body] + 1
                order.append(other)
    return SpanningTree(order, above, by, depth)


def bridges(tree: SpanningTree, pairs: Pairs, rows: Iterable[int]) -> set[int]:
    """Return the rows of a spanning tree that are in no loop with any of these rows."""
    found = {row for row in tree.row if row >= 0}
    for row in set(rows) - found:
        found.difference_update(tree.way(*pairs[row]))
    return found


MOST = 1000  # frames


class Bodies(NamedTuple):
    """The bodies formed by measured and fixed frames.

    frames: in order of first mention; number: the body of each, 0 for the root's
    pose: of each frame in its body; in the root's body, in the root
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
    first: dict[str, str] = {}  # of each body, by the top of its tree
    for name in (root, *frames):
        first.setdefault(tops[name], name)
    number = {top: at for at, top in enumerate(first)}
    anchors = {name: first[tops[name]] for name in frames}
    pose = {name: Transform.identity() if name == at else fixed.lookup(at, name) for name, at in anchors.items()}
    return Bodies(root, frames, {name: number[tops[name]] for name in frames}, pose)


TREES = 200
SINGULAR = 1e-12  # of the correlations: the least eigenvalue of a valid covariance
STEPS = 100
MOST_DAMPED = 1e12
REST = 1e-12  # of the extent, radians, and of a sigma: convergence of steps
BORROWED = 0.3  # degrees of freedom of metres that radians add, and vice versa, if loops are few
LEAST_SHARE = 0.04  # of the rows in loops, relative to the unknowns


class Noise(NamedTuple):
    """The sigmas of measurements without their own, and the factor by which stated ones are too small."""

    place: float = 0.01
    turn: float = math.radians(1.0)
    factor: float = 1.0

    def at_least(self, other: Noise) -> Noise:
        """Return sigmas that are at least those of another."""
        return self._replace(place=max(self.place, other.place), turn=max(self.turn, other.turn))


LOWEST = Noise(0.001, math.radians(0.1))  # medians if loops are few: most rows of a tree have no residual


class Fitted(NamedTuple):
    """Bodies that fit the inliers best.

    estimated: whether these rows determine their own noise
    few_loops: whether rotations can close all loops, so that metres alone do not determine their sigma
    u: the residual of each row in sigmas
    """

    bodies: Transform
    kept: Any
    noise: Noise
    estimated: bool = False
    few_loops: bool = False
    u: Array = np.ones(0)


def jacobians(parent: Transform, child: Transform, turned: Array) -> tuple[Array, Array]:
    """Return dr/da, dr/db, (n, 6, 6), of rows between frames at a and b; turned: the errors of the rotations."""
    back = parent.rotation.inverse().as_matrix()
    turn = lsq.inverse_left_jacobian(turned) @ back
    by_parent, by_child = np.zeros((2, *turned.shape[:-1], 6, 6))
    by_child[..., :3, :3], by_child[..., 3:, 3:] = back, turn
    by_parent[..., :3, :3], by_parent[..., 3:, 3:] = -back, -turn
    by_parent[..., :3, 3:] = back @ lsq.skew(child.xyz - parent.xyz)
    return by_parent, by_child


def of_body(jacobian: Array, body: Transform, frame: Transform) -> Array:
    """Return the Jacobian by the step of a body from that by the step of a frame in it, by its lever arm."""
    moved = jacobian.copy()
    moved[..., 3:] -= jacobian[..., :3] @ lsq.skew(frame.xyz - body.xyz)
    return moved


class TreeProblem:
    """Rows between bodies, and the poses that fit them."""

    def __init__(self, measurements: Sequence[Measurement], bodies: Bodies) -> None:
        """Store measurements as arrays: of bodies, of the poses of the measured frames in them, of covariances."""
        self.measurements, self.size, self.unknown = measurements, len(measurements), max(bodies.number.values())
        self.count = self.unknown + 1
        sides = [[each.parent for each in measurements], [each.child for each in measurements]]
        self.parent, self.child = (np.array([bodies.number[name] for name in side]) for side in sides)
        self.in_parent, self.in_child = (lsq.stacked(bodies.pose[name] for name in side) for side in sides)
        self.measured = lsq.stacked(each.transform for each in measurements)
        self.stated = np.array([each.covariance is not None for each in measurements])
        self._stated = np.zeros((self.size, 6, 6))  # the inverses of their covariances
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
        self._moves = (self.parent != self.child)[:, None, None]  # a row within a body has no effect

    def place(self, row: int) -> str:
        """Return the place of a measurement, else its number."""
        return printable(self.measurements[row].place) or f"measurement {row + 1}"

    def ends(self, bodies: Transform) -> tuple[Transform, Transform]:
        """Return the poses of the frames of each row."""
        return bodies[self.parent] @ self.in_parent, bodies[self.child] @ self.in_child

    def errors(self, bodies: Transform) -> Array:
        """Return the residuals, (n, 6)."""
        parent, child = self.ends(bodies)
        return lsq.errors(parent.inverse() @ child, self.measured)

    def information(self, noise: Noise, factor: float = 1.0) -> Array:
        """Return the inverse covariances, (n, 6, 6); factor: of stated sigmas."""
        diagonal = [noise.place**-2] * 3 + [noise.turn**-2] * 3
        return np.where(self.stated[:, None, None], self._stated / factor**2, np.diag(diagonal))

    def u(self, errors: Array, noise: Noise) -> Array:
        """Return the residual of each row in sigmas: the root mean square of its six numbers."""
        return lsq.sigmas(errors, self.information(noise, noise.factor))

    def tree(self, rows: Iterable[int]) -> SpanningTree:
        """Return the spanning tree of the first rows that close no loop."""
        return spanning_tree(self.count, self.pairs, rows)

    # initial values

    def start(self, trees: int) -> Transform:
        """Place the bodies by the spanning tree with which most other rows, including outliers, agree.

        The rows are tried in their order, shuffled, and last sorted by how well each ever closed a loop: outliers never
        do.
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
            placed = self.placed(tree)
            off = np.log1p(self.u(self.errors(placed), Noise()) ** 2)
            if (sum_off := float(off.sum())) < least:
                best, least = placed, sum_off
            off[tree.row[1:]] = math.inf  # a tree agrees with its own rows
            closest = np.minimum(closest, off)
        return best

    def placed(self, tree: SpanningTree) -> Transform:
        """Return the poses of the bodies in a tree of rows."""
        poses = [IDENTITY] * self.count
        for body in tree.order[1:]:
            row = tree.row[body]
            poses[body] = compose(*poses[tree.above[body]], *self._across[self.pairs[row][1] == body][row])
        return Transform.of(*map(np.array, zip(*poses, strict=True)))

    # Gauss-Newton

    def normal_equations(self, bodies: Transform, information: Array) -> tuple[Array, Array, float]:
        """Return J'LJ and J'Lr, six rows for each unknown body, and r'Lr."""
        (parent, child), count = self.ends(bodies), self.count
        off = lsq.errors(parent.inverse() @ child, self.measured)
        by_parent, by_child = (self._moves * by for by in jacobians(parent, child, off[:, 3:]))
        sides = [
            (self.parent, of_body(by_parent, bodies[self.parent], parent)),
            (self.child, of_body(by_child, bodies[self.child], child)),
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

    def improved(self, bodies: Transform, information: Array, damping: float) -> tuple[Transform, float, float]:
        """Take one step, damped until it helps; return the bodies, the size of the step and the damping."""
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
            if size <= REST or after <= before * (1 + 1e-12):
                return moved, size, damping / 10 if damping > 1e-9 else 0.0
            damping = max(damping * 10, 1e-6)
        return bodies, 0.0, 0.0

    # noise, and selection of rows

    def estimated(self, bodies: Transform, kept: Any, noise: Noise, *, estimate: bool, few_loops: bool) -> Noise:
        """Return the noise of the used rows: sums of squares over their degrees of freedom."""
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
            squares[0] += BORROWED * (noise.turn * self.arm) ** 2
            squares[1] += BORROWED * (noise.place / self.arm) ** 2
        place, turn = (max(float(np.sqrt(each / own)), lsq.LEAST) for each, own in zip(squares, dofs, strict=True))
        return Noise(place, turn, factor)

    def medians(self, errors: Array, looped: Any) -> Noise:
        """Return the noise from the medians of the rows in loops."""
        unknown = self.unknown - (self.size - looped.sum())  # every row in no loop determines one
        share = math.sqrt(max(1 - unknown / looped.sum(), LEAST_SHARE))
        free, stated = looped & ~self.stated, looped & self.stated
        noise = Noise()
        if stated.any():
            factor = float(np.median(_odd_count(self.u(errors, noise)[stated]))) / (lsq.MEDIAN_OF_SIX * share)
            noise = noise._replace(factor=max(1.0, factor))
        if free.any():
            place, turn = (lsq.median_sigma(_odd_count(each), share) for each in lsq.lengths(errors[free]).T)
            noise = noise._replace(place=place, turn=turn)
        return noise.at_least(LOWEST) if looped.sum() <= 2 * unknown else noise

    def fitted(self, *, robust: bool) -> Fitted:
        """Select the rows that agree, or all, and fit them by plain least squares."""
        every = range(self.size)
        bodies, noise = self.start(TREES if robust and self.size > self.unknown else 1), Noise()
        kept = np.ones(self.size, bool)
        looped = kept.copy()
        looped[list(bridges(self.tree(every), self.pairs, every))] = False

        def by_medians(bodies: Transform) -> Array:
            errors = self.errors(bodies)
            return self.u(errors, self.medians(errors, looped))

        def rough(bodies: Transform, weights: Array) -> Transform:
            information = self.information(self.medians(self.errors(bodies), looped))
            return self.improved(bodies, information * weights[:, None, None], 0.0)[0]

        if robust and looped.any():
            bodies, kept = lsq.first_inliers(bodies, by_medians, rough)
            noise = self.medians(self.errors(bodies), looped)
        return lsq.reselected(Fitted(bodies, kept, noise), self.refitted, robust=robust)

    def refitted(self, found: Fitted, kept: Any) -> Fitted:
        """Fit the used rows, and the nearest of the others if frames would be disconnected.

        Bodies and noise are those of the least-squares solution, both converged.
        """
        bodies, noise = found.bodies, found.noise
        u = self.u(self.errors(bodies), noise)
        tree = self.tree(np.lexsort((u, ~kept)).tolist() if not kept.all() else range(self.size))
        reached = np.isin(np.arange(self.size), tree.row)
        if (reached & ~kept).any():
            kept, bodies = kept | reached, self.placed(tree)
        alone = np.isin(np.arange(self.size), list(bridges(tree, self.pairs, np.flatnonzero(kept).tolist())))
        estimate = bool((kept & ~alone & ~self.stated).any()) and kept.sum() > self.unknown
        few_loops = bool((kept & ~alone).sum() <= 2 * (self.unknown - alone.sum()))
        damping = 0.0
        for _ in range(STEPS):
            information = self.information(noise) * kept[:, None, None]
            bodies, size, damping = self.improved(bodies, information, damping)
            before, noise = noise, self.estimated(bodies, kept, noise, estimate=estimate, few_loops=few_loops)
            changes = (abs(new / old - 1) for new, old in zip(noise, before, strict=True))
            if size <= REST and max(changes) <= REST:
                break
        return Fitted(bodies, kept, noise, estimate, few_loops, self.u(self.errors(bodies), noise))


def _odd_count(values: Array) -> Array:
    """Return an odd number of values, without the largest if necessary: of two rows that disagree one is wrong."""
    return values if len(values) % 2 else np.sort(values)[:-1]


# --- the fit with its inliers, and the result ---


class TreeFit:
    """A fit with its inliers: residuals, rows in no loop, covariances; and the verdicts on its outliers."""

    def __init__(self, problem: TreeProblem, found: Fitted) -> None:
        """Store a fit; covariances are not computed yet."""
        self.problem, self.found = problem, found
        kept = np.flatnonzero(found.kept).tolist()
        self.tree = problem.tree(kept)
        self.alone = bridges(self.tree, problem.pairs, kept)
        self.parents, self.children = problem.ends(found.bodies)
        self.poses = self.parents.inverse() @ self.children
        self.errors = lsq.errors(self.poses, problem.measured)
        self._known = Groups[int]()
        for row in np.flatnonzero(found.kept & (problem.stated | found.estimated)).tolist():
            self._known.join(*problem.pairs[row])

    def covariance(self, target: tuple[int, Transform], source: tuple[int, Transform]) -> Array | None:
        """Return the covariance (6, 6) of source in target, along its axes, each a body and the pose of a frame of it.

        None if it depends on rows whose noise is neither stated nor observable from a loop.
        """
        if target[0] == source[0]:
            return np.zeros((6, 6))
        if self._known.of(target[0]) != self._known.of(source[0]):
            return None
        by_ends = zip((target, source), jacobians(target[1], source[1], np.zeros(3)), strict=True)
        slopes = np.hstack([of_body(by, self.found.bodies[body], frame) for (body, frame), by in by_ends])
        ends = [target[0], source[0]]
        found: Array = slopes @ self._of_bodies[ends][:, :, ends].reshape(12, 12) @ slopes.T
        return (found + found.T) / 2.0

    @cached_property
    def _of_bodies(self) -> Array:
        """Return the covariance of all bodies, (bodies, 6, bodies, 6); zeros for the root."""
        problem, found = self.problem, self.found
        information = problem.information(found.noise) * found.kept[:, None, None]
        whole = np.zeros((problem.count, 6, problem.count, 6))
        if problem.unknown:
            normal = problem.normal_equations(found.bodies, information)[0]
            whole[1:, :, 1:] = lsq.inverse(normal).reshape(problem.unknown, 6, problem.unknown, 6)
        return whole

    def judged(self) -> tuple[TreeFit, list[str | None]]:
        """Explain the rejected rows; if a rival has a mistake instead, reject the rival.

        Raises ValueInvalid if none of a row and its rivals, or more than one, has a mistake that fits.
        """
        fit, problem = self, self.problem
        tried = {fit.found.kept.tobytes()}
        while True:
            fits, noise, swaps, undecided = fit.verdicts()
            for back, out in ((noise, []), *(([row], [rival]) for row, rival in swaps)):
                kept = fit.found.kept.copy()
                kept[back], kept[out] = True, False
                if kept.tobytes() not in tried:
                    break
            else:
                break
            tried.add(kept.tobytes())
            bodies = problem.placed(problem.tree(np.flatnonzero(kept).tolist()))
            start = Fitted(bodies, kept, fit.found.noise)
            fit = TreeFit(problem, lsq.reselected(start, problem.refitted, robust=True))
        if undecided:
            row, rivals = undecided
            off = lsq.off_text(*lsq.length(fit.errors[row].reshape(2, 3)))
            places = [problem.place(each) for each in sorted([row, *rivals])]
            leave = f" (--without {problem.place(row)})" if problem.measurements[row].place else ""
            loop = f"{first_of(places, 2)} form a loop open by {off}"
            raise ValueInvalid(f"undecided: {loop}; measure again or leave one out{leave}")
        return fit, fits

    def verdicts(self) -> tuple[list[str | None], list[int], list[tuple[int, int]], tuple[int, list[int]] | None]:
        """Try the mistakes on each rejected row, and on its rivals: used rows that only it checks.

        Returns the mistake of each row; rows without one that the uncertainty of the fit explains; rows to exchange,
        (rejected, rival); and the first row whose loop does not identify the outlier, with its rivals.
        """
        measurements, noise_found = self.problem.measurements, self.found.noise
        information = self.problem.information(noise_found, noise_found.factor)
        floor = noise_found.at_least(Noise()) if self.found.few_loops else noise_found
        least_information = self.problem.information(floor, floor.factor)
        fits: list[str | None] = [None] * self.problem.size
        noise, swaps, undecided = list[int](), list[tuple[int, int]](), None
        for row in np.flatnonzero(~self.found.kept).tolist():
            rivals = sorted(self.alone.intersection(self.tree.way(*self.problem.pairs[row])))
            words = {row: best_blunder(measurements[row], self.poses[row], information[row])}
            for rival in rivals:
                pose = self._pose_without(rival, row)
                words[rival] = best_blunder(measurements[rival], pose, information[rival])
            blamed = [each for each, blunder in words.items() if blunder]
            unsure = self._with_doubt(row, least_information[row])
            if not blamed and self.errors[row] @ unsure @ self.errors[row] <= 6 * lsq.KEPT**2:
                noise.append(row)
            if not rivals:
                doubted = self._with_doubt(row, information[row])
                fits[row] = words[row] or best_blunder(measurements[row], self.poses[row], doubted)
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
        doubt = self.covariance((parent, self.parents[row]), (child, self.children[row]))
        return information if doubt is None else lsq.inverse(lsq.inverse(information) + doubt)

    def _pose_without(self, rival: int, row: int) -> Transform:
        """Return the pose that a rival would measure if the rejected row placed the bodies below it."""
        measured, pairs, hanging = self.problem.measured[row], self.problem.pairs, set[int]()
        for body in self.tree.order:
            if self.tree.row[body] == rival or self.tree.above[body] in hanging:
                hanging.add(body)
        parent, child = self.parents[row], self.children[row]
        if pairs[row][1] in hanging:
            moved = parent @ measured @ child.inverse()
        else:
            moved = child @ measured.inverse() @ parent.inverse()
        ends = self.parents[rival], self.children[rival]
        parent, child = (moved @ end if body in hanging else end for end, body in zip(ends, pairs[rival], strict=True))
        return parent.inverse() @ child


FEW_LOOPS = 6  # with fewer the sigmas are rough if rotations can close them


def solve_tree(
    measurements: Sequence[Measurement], *, root: str | None = None, fixed: Frames | None = None, robust: bool = True
) -> TreeSolution:
    """Find the tree that fits measurements best.

    root: the frame in which the others are expressed; default the first that is never a child
    fixed: a tree of exact edges, whose frames move as one body
    robust: reject outliers
    Raises ValueInvalid: frames are not connected, an unknown root, undecided.
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
            return TreeSolution(*TreeFit(problem, problem.fitted(robust=robust)).judged(), bodies, fixed)
    except (lsq.NotSettled, FloatingPointError):
        far = max(abs(part) for each in measurements for part in each.components[:3])
        raise ValueInvalid(f"translations (up to {far:.3g} m) or sigmas differ too much in size to be solved") from None


class TreeSolution:
    """A tree of measured frames, and the results for the measurements.

    root, frames: the reference frame; all frames, in order of first mention
    residuals (n, 6), u, used, checked, fits: of each measurement
    sigma: estimated (metres, radians) of those without a covariance, or None; sigma_factor: 1, or the factor by which
        the stated sigmas are too small, without changing them
    dof: degrees of freedom of metres and of radians; rms: of the inliers, metres and radians
    tree: all of that as a tree with covariances: frames in the root, or in the frame that they are fixed in
    poses: of all frames in the root; rows: the number of used measurements of each frame
    frame_checked: whether its pose in the root depends only on loops
    """

    def __init__(self, fit: TreeFit, fits: list[str | None], bodies: Bodies, fixed: Frames) -> None:
        """Compute the results of a fit."""
        problem, found = fit.problem, fit.found
        self.measurements, self.fits = tuple(problem.measurements), fits
        self.root, self.frames = bodies.root, bodies.frames
        self._number, self._fit = bodies.number, fit
        self.residuals, self.used = fit.errors, found.kept
        self.u = found.u
        self.sigma = (found.noise.place, found.noise.turn) if found.estimated else None
        self.sigma_factor = found.noise.factor
        loops = int(found.kept.sum()) - problem.unknown
        self.dof = max(3 * loops, 0)
        if found.estimated and found.few_loops and loops < FEW_LOOPS:
            verb = "loop does" if loops == 1 else "loops do"
            warn(f"{loops} {verb} not tell metres from radians: the sigmas are rough; give sigma")
        squares = (fit.errors[found.kept] ** 2).reshape(-1, 2, 3).sum((0, 2))
        self.rms: tuple[float, float] = tuple(np.sqrt(squares / found.kept.sum()).tolist())
        self.checked = ~np.isin(np.arange(problem.size), list(fit.alone))
        sure = [True] * problem.count
        for body in fit.tree.order[1:]:
            sure[body] = sure[fit.tree.above[body]] and fit.tree.row[body] not in fit.alone
        self.frame_checked = {name: sure[bodies.number[name]] for name in self.frames}
        used = (each for each, kept in zip(problem.measurements, found.kept, strict=True) if kept)
        ends = Counter(name for each in used for name in each[:2])
        self.rows = {name: ends[name] for name in self.frames}
        number = np.array([bodies.number[name] for name in self.frames])
        self._poses = found.bodies[number] @ lsq.stacked(bodies.pose[name] for name in self.frames)
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
