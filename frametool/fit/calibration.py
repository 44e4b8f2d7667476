"""The mean of poses, the transform between matched points, a = c R b + t, and hand-eye calibration, G X C = Z.

All are robust against outliers.  Hand-eye is solved for X and Z from pairs of poses.  G: base_from_gripper, C:
camera_from_target, X: gripper_from_camera, Z: base_from_target.  With a camera fixed to the base, inv(G) replaces G, so
that X is base_from_camera and Z gripper_from_target.
"""

from __future__ import annotations

from itertools import chain
from math import degrees, fsum, log, radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, warn
from frametool.fit import least_squares as lsq
from frametool.fit.alignment import STILL, THIN, Fit, centre, principal_axes, umeyama
from frametool.geometry import validation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import TypeAlias

    from frametool.fit.least_squares import Mask, Rows
    from frametool.geometry.types import Array, Indices, Numbers

    Batch: TypeAlias = Transform | Numbers | Sequence[Transform]


FEWEST = 3  # points, samples; of two poses that disagree neither is the outlier
MOST_TRIED = 200  # poses that are tried as the middle of the others
LEAST_GAP = 1e-9  # between the two largest eigenvalues, relative to their sum


class MeanFit(NamedTuple):
    """The mean of the inliers and their distances from it.

    rms, most: the weighted root mean square and the largest distance of the inliers, metres and radians
    used: the inliers; left_out: outliers with a weight; u: the residual of each in sigmas
    residuals: [t_i - t, Log(R_i R')], (n, 6); sigma: of each axis of a pose of weight 1, metres and radians
    dof: 3 n - 3 of the inliers, for each sigma; covariance: of one pose, 6x6 as in ROS, None for a single pose
    """

    transform: Transform
    rms: tuple[float, float]
    most: tuple[float, float]
    used: Mask
    left_out: Mask
    u: Array
    residuals: Array
    sigma: tuple[float, float]
    dof: int
    covariance: Array | None


def solve_mean(
    poses: Transform | Numbers | Sequence[Transform], *, weights: Numbers | None = None, robust: bool = True
) -> MeanFit:
    """Return the mean of poses, transforms or matrices (n, 4, 4); outliers are rejected.

    weights: (n,), proportional to 1 / variance; a pose of weight 0 is ignored
    Without outliers exactly the mean of `Transform.mean`.
    Raises ValueInvalid if there is no pose, and if the rotations are so different that they have no mean.
    """
    poses = lsq.batch_of(poses, "poses")
    mass = validation.masses(weights, poses.shape)
    counts, roots = mass > 0.0, np.sqrt(mass)[:, None]
    own, weight, robust = poses[counts], mass[counts], robust and counts.sum() >= FEWEST

    def apart(at: int) -> float:
        """Return how far a pose is from the others, by the medians of metres and radians."""
        return sum(log(max(np.median(roots[counts, 0] * off), lsq.LEAST)) for off in own[at].distance(own))

    def mean_of(_: Transform, kept: Array) -> Transform:
        return own[kept > 0.0].mean(weight[kept > 0.0])

    tried = range(len(own)) if len(own) <= MOST_TRIED else next(lsq.draws(1, MOST_TRIED, len(own)))
    start = own[min(tried, key=apart)] if robust else own[0]
    found = lsq.robust_fit(
        start, lambda middle: roots[counts] * lsq.errors(own, middle),
        lambda _, weights: own.mean(weights * weight), mean_of, unknown=3, robust=robust,
    )  # fmt: skip
    used, mean = counts.copy(), found.model
    used[counts] = found.kept
    inliers, shares = poses[used], mass[used]
    *_, second, first = np.linalg.eigvalsh(np.array(validation.second_moment(inliers.components[3:], shares)))
    if first - second <= LEAST_GAP * (first + second):  # two eigenvectors of sum(w q q^T) are equally good
        raise ValueInvalid("the rotations lie so far apart that none is their mean; leave some out, or give weights")
    distances = np.stack(mean.distance(inliers))
    rms, most = np.sqrt((shares * distances**2).sum(1) / shares.sum()), distances.max(1)
    off = lsq.errors(poses, mean)
    count, kept = int(used.sum()), roots[used] * off[used]
    covariance = kept.T @ kept * (count / shares.sum() / (count - 1)) if count > 1 else None
    s_t, s_r = found.sigmas.tolist()
    return MeanFit(
        mean, tuple(rms.tolist()), tuple(most.tolist()), used, counts & ~used,
        lsq.deviations(roots * off, found.sigmas), off, (s_t, s_r), 3 * count - 3, covariance,
    )  # fmt: skip


FEWEST_ROBUST = 5  # three points always fit, so that with four the outlier cannot be identified
TRIPLES = 500
MOST = 2000  # points on which a triple is tested
ROUNDING = 1e-12  # relative to the largest coordinate: no distance is more accurate
BETTER = 5.0  # ratio: an alternative that fits this much better was meant
UNITS = {1000.0: "millimetres?", 100.0: "centimetres?"}
ABOUT = 0.05  # of a scale: still a unit conversion
ONE = Transform.identity()
MIRROR = np.array([1.0, 1.0, -1.0])


class PointsFit(NamedTuple):
    """target_from_source and the scale c, with their covariance (6x6, as in ROS) and the scale's sigma.

    used: the inliers; left_out: outliers with a weight
    residuals: target - (c R source + t), (n, 3); u: the residual of each in sigmas; sigma: of each axis for weight 1
    dof: 3 n - 6, with a scale 3 n - 7; rms: of the inliers, metres and None
    """

    transform: Transform
    scale: float
    scale_sigma: float | None
    covariance: Array
    used: Mask
    left_out: Mask
    residuals: Array
    u: Array
    sigma: float
    dof: int
    rms: tuple[float, None]


def solve_points(
    target: Numbers, source: Numbers, *, weights: Numbers | None = None, scale: bool = False, robust: bool = True,
    names: tuple[str, str] = ("A", "B"),
) -> PointsFit:  # fmt: skip
    """Estimate the transform from source points to the matching target points, (n, 3) each; outliers are rejected.

    weights: (n,), proportional to 1 / variance; a pair of weight 0 is ignored
    scale: estimate one too, target = scale R source + t; names: of target and source, for messages
    Returns .transform (target_from_source), .scale, .covariance, .used and more.
    Raises ValueInvalid if the points are too few, on a line, or mirrored.
    """
    a, b = _points(target, "target"), _points(source, "source")
    if len(a) != len(b):
        raise ValueInvalid(f"target has {len(a)} points, source {len(b)}")
    mass = np.ones(len(a)) if weights is None or not len(a) else validation.masses(weights, a.shape[:1])
    if (count := int((mass > 0.0).sum())) < FEWEST:
        raise ValueInvalid(f"{count} matched point{'s'[: count != 1]}; {FEWEST} are needed, not on a line")
    pairs = _Pairs(a[mass > 0.0], b[mass > 0.0], mass[mass > 0.0])
    pairs.require_plane()
    robust = robust and count >= FEWEST_ROBUST
    start, typical = pairs.start(with_scale=scale, robust=robust)
    mirrored = pairs._replace(source=pairs.source * MIRROR).start(with_scale=scale, robust=robust)[1]
    if BETTER * mirrored <= typical:
        off = f"{1000.0 * mirrored:.1f} mm, not {1000.0 * typical:.1f} mm"
        raise ValueInvalid(f"a mirror image fits ({off}): one set is left-handed")

    def rough(_: Fit, weights: Array) -> Fit:
        return umeyama(*pairs[:2], pairs.mass * weights, with_scale=scale)

    def fit(_: Fit, kept: Array) -> Fit:
        chosen = pairs.at(kept > 0.0)
        chosen.require_plane()
        return umeyama(*chosen, with_scale=scale)

    found = lsq.robust_fit(start, pairs.weighted_residuals, rough, fit, unknown=6 + scale, robust=robust)
    best, sigma, kept = found.model, float(found.sigmas[0]), found.kept
    covariance, scale_sigma = pairs.at(kept).covariance(best, sigma, with_scale=scale)
    used = mass > 0.0
    used[used] = kept
    residuals = _Pairs(a, b, mass).residuals(best)
    if not scale:
        scaled, its_typical = pairs.start(with_scale=True, robust=robust)
        if BETTER * its_typical <= typical and scaled.scale > 0.0:
            is_great = scaled.scale > 1.0
            (great, small), ratio = (names, scaled.scale) if is_great else (names[::-1], 1.0 / scaled.scale)
            unit = next((unit for unit in UNITS if abs(ratio / unit - 1.0) < ABOUT), ratio)
            warn(f"{great} is {unit:.4g} times {small}: {UNITS.get(unit, 'a scale?')}")
    return PointsFit(
        best.transform.canonical(), best.scale, scale_sigma, covariance, used, (mass > 0.0) & ~used, residuals,
        np.sqrt(mass / 3.0) * lsq.length(residuals) / sigma, sigma, 3 * int(kept.sum()) - 6 - scale,
        (sqrt((residuals[used] ** 2).sum() / used.sum()), None),
    )  # fmt: skip


class _Pairs(NamedTuple):
    """Matched points (n, 3) and their weights."""

    target: Array
    source: Array
    mass: Array

    def at(self, index: Rows) -> _Pairs:
        return _Pairs(*(part[index] for part in self))

    def residuals(self, fit: Fit) -> Array:
        placed: Array = fit.transform.rotation.apply(fit.scale * self.source) + fit.transform.xyz
        return self.target - placed

    def weighted_residuals(self, fit: Fit) -> Array:
        found: Array = np.sqrt(self.mass)[:, None] * self.residuals(fit)
        return found

    def start(self, *, with_scale: bool, robust: bool) -> tuple[Fit, float]:
        """Return the fit of all or of a triple with the least typical distance, and that distance.

        The typical distance is the median, but at least the fourth: three always fit.  It is never below rounding.
        """
        count = len(self.mass)
        seen = self.at(next(lsq.draws(1, MOST, count))) if count > MOST else self
        middle = min(max(len(seen.mass) // 2, 3), len(seen.mass) - 1)
        best = (np.inf, Fit(ONE))
        triples: Iterable[Rows] = lsq.draws(TRIPLES * robust, 3, count)
        for few in chain([slice(None)], triples):
            chosen = self.at(few)
            if chosen.is_line():
                continue
            fit = umeyama(*chosen, with_scale=with_scale)
            off = (seen.weighted_residuals(fit) ** 2).sum(-1)
            best = min(best, (float(np.partition(off, middle)[middle]), fit), key=lambda each: each[0])
        return best[1], max(sqrt(best[0]), ROUNDING * max(np.abs(self.target).max(), np.abs(self.source).max()))

    def is_line(self) -> bool:
        """Return True if target or source are on a line, or in one point."""
        for xyz in self[:2]:
            first, second, _ = principal_axes(xyz)
            if second <= max(THIN * first, STILL * np.abs(xyz).max()):
                return True
        return False

    def require_plane(self) -> None:
        if len(self.mass) < FEWEST or self.is_line():
            raise ValueInvalid("the points lie on a line: the turn about it cannot be known")

    def covariance(self, fit: Fit, sigma: float, *, with_scale: bool) -> tuple[Array, float | None]:
        """Return the inverse Hessian of pose and scale: the pose's part, and the scale's sigma if it is estimated.

        At the points' centre position, rotation and scale are independent; the lever arm transforms it to the source's
        origin.
        """
        middle = centre(self.source, self.mass)
        arms = fit.transform.rotation.apply(self.source - middle)
        unit = np.broadcast_to(np.eye(3), (len(arms), 3, 3))
        slopes = np.concatenate([unit, -lsq.skew(fit.scale * arms), arms[:, :, None]], 2)[:, :, : 6 + with_scale]
        about = lsq.inverse(np.einsum("n,nij,nik->jk", self.mass, slopes, slopes))
        lever = fit.transform.rotation.apply(middle)
        levers = np.eye(6 + with_scale)
        levers[:3, 3:6], levers[:3, 6:] = lsq.skew(fit.scale * lever), -lever[:, None]
        found = levers @ about @ levers.T
        found = sigma**2 / 2.0 * (found + found.T)
        return found[:6, :6], sqrt(found[6, 6]) if with_scale else None


def _points(values: Numbers, name: str) -> Array:
    xyz = np.stack(np.atleast_1d(*validation.columns(values, 3, name)), -1)
    if xyz.ndim != 2:
        raise ValueInvalid(f"{name}: expected shape (n, 3), got {xyz.shape}")
    validation.all_finite((xyz,), name)
    lsq.require_near(xyz, name)
    return xyz


# --- hand-eye ---

NAMES = ("base", "gripper", "camera", "target")
FEWEST_APART = 4  # with three, rotations alone can fit all positions: the closed form is the result
FEWEST_CERTAIN = 6  # with fewer the sigmas are rough: with 8 they are within a few per cent on average
DRAWS, DRAWN = 60, 5
MOST_PAIRS = 10_000  # pairs that are used, or one of each sample
STEPS, ROUGH_STEPS = 100, 4
DONE = 1e-12  # of the extent, and radians
STUCK = 1e9  # damping
UNDAMPED = 1e-12
OBSERVABLE = 1e-8  # of the largest singular value
CLEARLY = 2.0  # ratio by which both metres and radians must be better
FLAT, FLAT_SHARE = radians(0.5), 0.02  # about the second axis: none, also relative to the first
SLIGHT = radians(5.0)
CLEAR = (radians(1.0), radians(175.0))  # rotations of a pair whose axis is certain


class HandEye(NamedTuple):
    """X and Z with their covariances (6x6, as in ROS), and the fit of the samples.

    noise_at: the frame in which errors are equal, None if there are none
    used: the inliers; u: the residual of each sample in sigmas; residuals: (n, 6), metres and radians
    sigma: of each axis, metres and radians; dof: 3 n - 6 for each of them; rms: of the inliers, metres and radians
    turns: rms about the two main axes of the pairs of inliers, radians
    """

    x: Transform
    z: Transform
    covariance_x: Array
    covariance_z: Array
    noise_at: str | None
    used: Mask
    u: Array
    residuals: Array
    sigma: tuple[float, float]
    dof: int
    rms: tuple[float, float]
    turns: tuple[float, float]


def solve_hand_eye(
    gripper: Batch, target: Batch, *, eye_to_hand: bool = False, robust: bool = True,
    names: tuple[str, str, str, str] = NAMES,
) -> HandEye:  # fmt: skip
    """Estimate the pose of a camera on a gripper, and of the target; outliers are rejected.

    gripper: base_from_gripper; target: camera_from_target; as many, transforms or matrices (n, 4, 4)
    eye_to_hand: the camera is fixed to the base, the target is on the gripper; names: of the frames, for messages
    Returns .x (gripper_from_camera, or base_from_camera), .z (base_from_target, or gripper_from_target),
    .covariance_x, .covariance_z, .noise_at, .used and more: least squares with the most likely location of the noise.
    Raises ValueInvalid if the samples are too few, rotate about one axis only, or fit the inverse setting.
    """
    gripper, target = lsq.batch_of(gripper, "gripper"), lsq.batch_of(target, "target")
    if len(gripper) != len(target):
        raise ValueInvalid(f"gripper has {len(gripper)} poses, target {len(target)}")
    if (count := len(gripper)) < FEWEST:
        raise ValueInvalid(f"{count} sample{'s'[: count != 1]}; hand-eye needs {FEWEST}, turned about two axes")
    hand = gripper.inverse() if eye_to_hand else gripper
    samples, other = _Samples(hand, target), _Samples(hand.inverse(), target)
    holder = names[0] if eye_to_hand else names[1]
    robust = robust and count >= FEWEST_ROBUST
    _require_two_axes(_turns(hand), 0.0, holder, names[2])
    start, medians = _start(samples, robust=robust)
    others = _start(other, robust=robust)[1]
    if (CLEARLY * others <= medians).all() and BETTER**2 * others.prod() <= medians.prod():
        raise ValueInvalid(
            f"the samples do not fit ({lsq.off_text(*medians)}); they do ({lsq.off_text(*others)}) "
            f"{'without' if eye_to_hand else 'with'} --eye-to-hand, or with TARGET inverted ({names[3]}<-{names[2]})"
        )

    def likeliest(model: _Model, weights: Array) -> _Model:
        if (kept := weights > 0.0).sum() < FEWEST:
            raise _unfitting(medians)
        _require_two_axes(_turns(hand[kept]), 0.0, holder, names[2])
        begin, steps = (model, STEPS) if kept.sum() >= FEWEST_APART else (start, 0)
        models = (samples.fitted(begin._replace(cut=cut), weights, steps) for cut in CUTS)
        return min(models, key=lambda fit: fit.misfit)

    def rough(model: _Model, weights: Array) -> _Model:
        return samples.fitted(model._replace(cut="target"), weights, ROUGH_STEPS)

    found = lsq.robust_fit(start, samples.residuals, rough, likeliest, unknown=6, robust=robust)
    model = found.model
    s_t, s_r = found.sigmas.tolist()
    rms = np.sqrt((lsq.lengths(found.residuals[found.kept]) ** 2).mean(0))
    turns = _turns(hand[found.kept])
    if turns[0] < lsq.KEPT * s_r * sqrt(2.0):
        raise _unfitting(rms)
    _require_two_axes(turns, s_r, holder, names[2])
    covariance = lsq.inverse(model.hessian)
    both = " fit with and without --eye-to-hand, and" * bool(others.prod() <= BETTER**2 * medians.prod())
    _warn_of(samples.at(found.kept), model.x, turns, holder, both)
    noise_at = "base" if eye_to_hand and model.cut == "gripper" else model.cut
    return HandEye(
        model.x.canonical(), model.z.canonical(), covariance[:6, :6], covariance[6:, 6:],
        None if s_t == s_r == lsq.LEAST else noise_at, found.kept, found.u, found.residuals, (s_t, s_r),
        3 * int(found.kept.sum()) - 6, (float(rms[0]), float(rms[1])), turns[:2],
    )  # fmt: skip


class _Model(NamedTuple):
    """X and Z, the location of the noise, and what a fit found: Hessian (12, 12) and 2 ln s_t + 2 ln s_r."""

    x: Transform
    z: Transform
    cut: str = "target"
    hessian: Array = np.eye(12)
    misfit: float = 0.0


# the errors E = left X right = before inv(Z) after, by the location of the noise: the factors around X and Z
Factors = tuple[Transform, Transform, Transform, Transform]
CUTS: dict[str, Callable[[Transform, Transform, Transform, Transform], Factors]] = {
    "target": lambda g, c, x, z: (z.inverse() @ g, c, ONE, g @ x @ c),
    "camera": lambda g, c, x, z: (c @ z.inverse() @ g, ONE, c, g @ x),
    "gripper": lambda g, c, x, z: (ONE, c @ z.inverse() @ g, x @ c, g),
}


class _Samples(NamedTuple):
    """Pairs of poses: of the gripper, and of the target in the camera."""

    gripper: Transform
    camera: Transform

    def at(self, index: Rows) -> _Samples:
        return _Samples(self.gripper[index], self.camera[index])

    def residuals(self, model: _Model) -> Array:
        """Return [t(E), Log R(E)] of a model."""
        left, right, _, _ = CUTS[model.cut](*self, model.x, model.z)
        off = left @ model.x @ right
        return np.concatenate([off.xyz, off.rotation.as_rotvec()], 1)

    def fitted(self, model: _Model, weights: Array, steps: int) -> _Model:
        """Minimise ln S_t + ln S_r by Gauss-Newton steps with updated sigmas, damped if a step does not help."""
        extent = max(np.abs(poses.xyz).max() for poses in self)
        units = np.repeat([extent or 1.0, 1.0, extent or 1.0, 1.0], 3)
        now, gradient = self._linear(model, weights)
        damping = UNDAMPED
        for _ in range(steps):
            bent = now.hessian + damping * np.diag(np.diag(now.hessian))
            step = -lsq.solve_normal(bent, gradient[:, None])[:, 0]
            moved = now._replace(x=lsq.stepped(now.x, step[:6]), z=lsq.stepped(now.z, step[6:]))
            tried, its_gradient = self._linear(moved, weights)
            if tried.misfit <= now.misfit + DONE:
                now, gradient, damping = tried, its_gradient, max(damping / 10.0, UNDAMPED)
                if (np.abs(step) <= DONE * units).all():
                    break
            elif (damping := max(10.0 * damping, 1e-6)) > STUCK:
                break
        return now

    def _linear(self, model: _Model, weights: Array) -> tuple[_Model, Array]:
        """Return a model with its Hessian and its cost, and the gradient."""
        left, right, before, after = CUTS[model.cut](*self, model.x, model.z)
        errors = self.residuals(model)
        turn, back = left.rotation.as_matrix(), (before.rotation @ model.z.rotation.inverse()).as_matrix()
        bent = lsq.inverse_left_jacobian(errors[:, 3:])
        slopes: Array = np.zeros((len(errors), 6, 12))  # the derivatives of the errors by steps of X and of Z
        slopes[:, :3, :3] = turn
        slopes[:, :3, 3:6] = -turn @ lsq.skew(model.x.rotation.apply(right.xyz))
        slopes[:, 3:, 3:6] = bent @ turn
        slopes[:, :3, 6:9] = -back
        slopes[:, :3, 9:] = back @ lsq.skew(after.xyz - model.z.xyz)
        slopes[:, 3:, 9:] = -bent @ back
        sigmas = lsq.fitted_sigmas(errors, weights, 6)
        weighed = (weights[:, None] / np.repeat(sigmas**2, 3)).reshape(-1, 1)
        slopes = slopes.reshape(-1, 12)
        gradient = slopes.T @ (weighed * errors.reshape(-1, 1))
        misfit = 2.0 * fsum(map(log, sigmas.tolist()))
        return model._replace(hessian=slopes.T @ (weighed * slopes), misfit=misfit), gradient[:, 0]


def _start(samples: _Samples, *, robust: bool) -> tuple[_Model, Array]:
    """Return the best closed form of all samples and of small random subsets, with the medians of its errors."""
    count = len(samples.gripper)
    best = (np.inf, _Model(ONE, ONE), np.full(2, np.inf))
    fives: Iterable[Rows] = lsq.draws(DRAWS * robust, min(DRAWN, count - 1), count)
    for few in chain([slice(None)], fives):
        chosen = samples.at(few)
        if _turns(chosen.gripper)[1] < FLAT:
            continue
        x = park_martin(*chosen)
        z = (chosen.gripper @ x @ chosen.camera).mean()
        medians = np.maximum(np.median(lsq.lengths(samples.residuals(_Model(x, z))), axis=0), lsq.LEAST)
        best = min(best, (log(medians[0]) + log(medians[1]), _Model(x, z), medians), key=lambda each: each[0])
    return best[1:]


def park_martin(gripper: Transform, camera: Transform) -> Transform:
    """Return the X of A X = X B, in closed form: first the rotation, then the position; source: Park and Martin 1994.

    A and B are the motions of gripper and camera between two samples: R_X rotates the rotation vectors of B to those
    of A, and (R_A - I) t_X = R_X t_B - t_A.
    """
    a, b = _motions(gripper, camera)
    alpha, beta = a.rotation.as_rotvec(), b.rotation.as_rotvec()
    angle = lsq.lengths(alpha)[:, 0]
    if (clear := (angle > CLEAR[0]) & (angle < CLEAR[1])).sum() > 1:
        a, b, alpha, beta = a[clear], b[clear], alpha[clear], beta[clear]
    turn = lsq.align_vectors(beta, alpha)
    wanted = (turn.apply(b.xyz) - a.xyz).reshape(-1)
    place, _ = _least_squares((a.rotation.as_matrix() - np.eye(3)).reshape(-1, 3), wanted)
    return Transform(turn, place)


def _motions(gripper: Transform, camera: Transform) -> tuple[Transform, Transform]:
    i, j = _pairs(len(gripper))
    return gripper[i].inverse() @ gripper[j], camera[i] @ camera[j].inverse()


def _warn_of(samples: _Samples, x: Transform, turns: tuple[float, float, str], holder: str, both: str) -> None:
    """Warn of what limits the result; both: of a few samples that another setting fits too, else ""."""
    if turns[1] < SLIGHT:
        small = f"{degrees(turns[1]):.1f} deg rms, first axis {turns[2]} in {holder}"
        warn(f"turns about a second axis are small ({small}): turn more")
    if (count := len(samples.gripper)) < FEWEST_CERTAIN:
        warn(f"{count} samples{both} say little of their own noise: the sigmas are rough; take 8 or more")
    # does a factor on the target's translations fit better?  (R_A - I) t_X - s R_X t_B = -t_A
    a, b = _motions(*samples)
    lever, turned = (a.rotation.as_matrix() - np.eye(3)).reshape(-1, 3), x.rotation.apply(b.xyz).reshape(-1)
    place, plain = _least_squares(lever, turned - a.xyz.reshape(-1))
    place, scaled = _least_squares(np.column_stack([lever, -turned]), -a.xyz.reshape(-1))
    if place[3] > 0.0 and plain > max(BETTER * scaled, lsq.LEAST):
        warn(f"TARGET fits better with its places times {place[3]:.4g}: another unit, or the size of a marker?")


def _least_squares(slopes: Array, wanted: Array) -> tuple[Array, float]:
    """Return the least-squares solution, and the norm of the residuals."""
    found: Any = np.linalg.lstsq(slopes, wanted, rcond=OBSERVABLE)[0]  # unobservable components are 0
    return found, float(lsq.length(slopes @ found - wanted))


def _pairs(count: int) -> tuple[Indices, Indices]:
    """Return all pairs of samples; of many, each with others at some random distances."""
    if count * count <= 2 * MOST_PAIRS:
        return np.triu_indices(count, 1)
    lags = np.array(next(lsq.draws(1, max(MOST_PAIRS // count, 1), count - 1))) + 1
    i = np.tile(np.arange(count), len(lags))
    return i, (i + np.repeat(lags, count)) % count


def _turns(gripper: Transform) -> tuple[float, float, str]:
    """Return the rms of the rotations of pairs of samples about two main axes, radians, and the first axis as text."""
    i, j = _pairs(len(gripper))
    turns = (gripper[i].rotation.inverse() @ gripper[j].rotation).as_rotvec()
    squares, axes = np.linalg.eigh(turns.T @ turns / len(turns))
    axis = axes[:, 2] * np.sign(axes[np.abs(axes[:, 2]).argmax(), 2])
    _, second, first = np.sqrt(np.maximum(squares, 0.0)).tolist()
    return first, second, " ".join(f"{part:.3f}" for part in np.round(axis, 3) + 0.0)


def _require_two_axes(turns: tuple[float, float, str], s_r: float, holder: str, camera: str) -> None:
    first, second, axis = turns
    if first < FLAT:
        raise ValueInvalid(f"{holder} does not turn ({degrees(first):.2f} deg); hand-eye needs turns about two axes")
    if second < max(FLAT, FLAT_SHARE * first, lsq.KEPT * s_r * sqrt(2.0)):
        raise ValueInvalid(
            f"all turns are about one axis ({axis} in {holder}): where {camera} is along it cannot be known; "
            "turn about a second one"
        )


def _unfitting(off: Array) -> ValueInvalid:
    text = lsq.off_text(*off)
    return ValueInvalid(f"the samples do not fit ({text}); does each row of GRIPPER belong to that of TARGET?")
