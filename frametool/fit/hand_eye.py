"""Hand-eye calibration, G X C = Z, solved for X and Z from pairs of poses, robust against outliers.

G: base_from_gripper, C: camera_from_target, X: gripper_from_camera, Z: base_from_target.  With a camera fixed to the
base, inv(G) replaces G, so that X is base_from_camera and Z gripper_from_target.
"""

from __future__ import annotations

from itertools import chain
from math import degrees, fsum, log, radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, warn
from frametool.fit import least_squares as lsq
from frametool.fit.alignment import FEWEST
from frametool.fit.matched_points import BETTER, FEWEST_ROBUST, ONE
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import TypeAlias

    from frametool.fit.least_squares import Mask, Rows
    from frametool.geometry import Array, Indices, Numbers

    Batch: TypeAlias = Transform | Numbers | Sequence[Transform]

NAMES = ("base", "gripper", "camera", "target")
FEWEST_APART = 4  # with three, rotations alone can fit all positions: the closed form is the result
FEWEST_CERTAIN = 6  # with fewer the sigmas are rough: with 8 they are within a few per cent on average
DRAWS, DRAWN = 60, 5  # random subsets for initial models, and samples of each
MOST_PAIRS = 10_000  # pairs that are used, but at least one of each sample
STEPS, ROUGH_STEPS = 100, 4
CONVERGED = 1e-12  # size of a step relative to the extent, and in radians
MOST_DAMPED = 1e9  # damping
UNDAMPED = 1e-12
OBSERVABLE = 1e-8  # singular values below this share of the largest are zeros
CLEARLY_BETTER = 2.0  # ratio by which both metres and radians of the other setting must be better
LEAST_TURN, LEAST_SHARE = radians(0.5), 0.02  # smallest rotation about the second axis, also as a share of the first
SMALL_TURN = radians(5.0)
CERTAIN_AXIS = (radians(1.0), radians(175.0))  # angles between which the axis of a pair's rotation is certain


class HandEye(NamedTuple):
    """X and Z with their covariances (6x6, as in ROS), and the fit of the samples.

    noise_at: the frame in which the noise most likely is, None if the samples fit exactly
    used: the inliers; u: the residual of each sample in sigmas; residuals: (n, 6), metres and radians
    sigma: of each axis, metres and radians; dof: 3 n - 6 for each of them; rms: of the inliers, metres and radians
    turns: rms rotation about the two main axes of the pairs of inliers, radians
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
    start, medians = _initial_model(samples, robust=robust)
    others = _initial_model(other, robust=robust)[1]
    _refuse_other_setting(medians, others, f"{'without' if eye_to_hand else 'with'} --eye-to-hand", names)

    def likeliest(model: _Model, weights: Array) -> _Model:
        if (kept := weights > 0.0).sum() < FEWEST:
            raise _misfit_error(medians)
        _require_two_axes(_turns(hand[kept]), 0.0, holder, names[2])
        begin, steps = (model, STEPS) if kept.sum() >= FEWEST_APART else (start, 0)
        models = (samples.fitted(begin._replace(noise_at=noise_at), weights, steps) for noise_at in FACTORS)
        return min(models, key=lambda fit: fit.misfit)

    def rough(model: _Model, weights: Array) -> _Model:
        return samples.fitted(model._replace(noise_at="target"), weights, ROUGH_STEPS)

    found = lsq.robust_fit(start, samples.residuals, rough, likeliest, count=count, unknown=6, robust=robust)
    model = found.model
    s_t, s_r = found.sigmas.tolist()
    rms = np.sqrt((lsq.lengths(found.residuals[found.kept]) ** 2).mean(0))
    turns = _turns(hand[found.kept])
    if turns[0] < lsq.KEPT * s_r * sqrt(2.0):
        raise _misfit_error(rms)
    _require_two_axes(turns, s_r, holder, names[2])
    covariance = lsq.inverse(model.hessian)
    both = " fit with and without --eye-to-hand, and" * bool(others.prod() <= BETTER**2 * medians.prod())
    _warn_of_limits(samples.at(found.kept), model.x, turns, holder, both)
    noise_at = "base" if eye_to_hand and model.noise_at == "gripper" else model.noise_at
    return HandEye(
        model.x.canonical(), model.z.canonical(), covariance[:6, :6], covariance[6:, 6:],
        None if s_t == s_r == lsq.LEAST else noise_at, found.kept, found.u, found.residuals, (s_t, s_r),
        3 * int(found.kept.sum()) - 6, (float(rms[0]), float(rms[1])), turns[:2],
    )  # fmt: skip


class _Model(NamedTuple):
    """X and Z, the frame of the noise; of a fit also the Hessian (12, 12), and the cost 2 ln s_t + 2 ln s_r."""

    x: Transform
    z: Transform
    noise_at: str = "target"
    hessian: Array = np.eye(12)
    misfit: float = 0.0


# the errors E = left X right = before inv(Z) after for each frame of the noise: the factors around X and Z
Factors = tuple[Transform, Transform, Transform, Transform]
FACTORS: dict[str, Callable[[Transform, Transform, Transform, Transform], Factors]] = {
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
        """Return the errors [t(E), Log R(E)] of a model, (n, 6)."""
        left, right, _, _ = FACTORS[model.noise_at](*self, model.x, model.z)
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
            if tried.misfit <= now.misfit + CONVERGED:
                now, gradient, damping = tried, its_gradient, max(damping / 10.0, UNDAMPED)
                if (np.abs(step) <= CONVERGED * units).all():
                    break
            elif (damping := max(10.0 * damping, 1e-6)) > MOST_DAMPED:
                break
        return now

    def _linear(self, model: _Model, weights: Array) -> tuple[_Model, Array]:
        """Return the model with its Hessian and its cost, and the gradient."""
        left, right, before, after = FACTORS[model.noise_at](*self, model.x, model.z)
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


def _initial_model(samples: _Samples, *, robust: bool) -> tuple[_Model, Array]:
    """Return the closed-form model with the least median errors, of all samples or of a random subset, and these."""
    count = len(samples.gripper)
    best = (np.inf, _Model(ONE, ONE), np.full(2, np.inf))
    fives: Iterable[Rows] = lsq.draws(DRAWS * robust, min(DRAWN, count - 1), count)
    for few in chain([slice(None)], fives):
        chosen = samples.at(few)
        if _turns(chosen.gripper)[1] < LEAST_TURN:
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
    if (clear := (angle > CERTAIN_AXIS[0]) & (angle < CERTAIN_AXIS[1])).sum() > 1:
        a, b, alpha, beta = a[clear], b[clear], alpha[clear], beta[clear]
    turn = lsq.align_vectors(beta, alpha)
    wanted = (turn.apply(b.xyz) - a.xyz).reshape(-1)
    place, _ = _least_squares((a.rotation.as_matrix() - np.eye(3)).reshape(-1, 3), wanted)
    return Transform(turn, place)


def _motions(gripper: Transform, camera: Transform) -> tuple[Transform, Transform]:
    i, j = _pairs(len(gripper))
    return gripper[i].inverse() @ gripper[j], camera[i] @ camera[j].inverse()


def _refuse_other_setting(medians: Array, others: Array, setting: str, names: Sequence[str]) -> None:
    """Raise ValueInvalid if the samples fit the other setting (eye-to-hand or not) clearly better, by median errors."""
    if (CLEARLY_BETTER * others <= medians).all() and BETTER**2 * others.prod() <= medians.prod():
        raise ValueInvalid(
            f"the samples do not fit ({lsq.off_text(*medians)}); they do ({lsq.off_text(*others)}) "
            f"{setting}, or with TARGET inverted ({names[3]}<-{names[2]})"
        )


def _warn_of_limits(samples: _Samples, x: Transform, turns: tuple[float, float, str], holder: str, both: str) -> None:
    """Warn of what limits the result: small rotations, few samples, a scale of the target's translations.

    both: text for the warning of few samples, if they fit the other setting too, else ""
    """
    if turns[1] < SMALL_TURN:
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
    """Return the least-squares solution of slopes x = wanted, and the norm of the residuals."""
    found: Any = np.linalg.lstsq(slopes, wanted, rcond=OBSERVABLE)[0]  # unobservable components are 0
    return found, float(lsq.length(slopes @ found - wanted))


def _pairs(count: int) -> tuple[Indices, Indices]:
    """Return the indices of all pairs of samples; of many samples, each paired with those at some random distances."""
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
    if first < LEAST_TURN:
        raise ValueInvalid(f"{holder} does not turn ({degrees(first):.2f} deg); hand-eye needs turns about two axes")
    if second < max(LEAST_TURN, LEAST_SHARE * first, lsq.KEPT * s_r * sqrt(2.0)):
        raise ValueInvalid(
            f"all turns are about one axis ({axis} in {holder}): where {camera} is along it cannot be known; "
            "turn about a second one"
        )


def _misfit_error(off: Array) -> ValueInvalid:
    text = lsq.off_text(*off)
    return ValueInvalid(f"the samples do not fit ({text}); does each row of GRIPPER belong to that of TARGET?")
