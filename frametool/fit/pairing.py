"""Two trajectories in time: pairs of poses at common or nearest stamps, stamps to resample at, and clock offsets.

The offset between the clocks of two recordings of one motion is t_ref - t_est.
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit.alignment import FEWEST, Unaligned, centre, fitted
from frametool.fit.least_squares import length, require_near
from frametool.frames.stamps import BILLION

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.fit.trajectory_errors import Delta
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry import Array, Indices
    from frametool.geometry.transform import Transform

GAP = 3  # median intervals: the longest gap to interpolate over by default
MOST = 100_000_000  # poses
LIMIT_S = 10.0
REFINED_S = 1e-7
STEPS = 8
NEARBY = 1.2  # steps of the grid: the largest error of the best lag
DOUBT = 0.25  # steps of the grid: the largest acceptable standard error of least squares
TINY = 1e-12
AS_GOOD = 0.99  # share of the best score from which another lag may be the true one
DIGITS = 9  # decimals of a score, and of seconds: stamps are whole nanoseconds


class Pairs(NamedTuple):
    """Paired poses of the reference and of the estimate, at the stamps of the reference's clock.

    possible: the largest possible number of pairs: all poses of the estimate, or if the reference is the one whose
        stamps are used, its poses within the time of the estimate
    shared: the number of pairs whose partner is already that of another pair
    interpolated: "ref", "est" or None; max_gap_s: the longest gap to interpolate over
    offset_ns: what was added to the estimate's stamps; offset_score: its score if it was estimated
    mount: the pose by which the estimate's poses were multiplied
    """

    ref: Trajectory
    est: Trajectory
    possible: int
    shared: int = 0
    interpolated: str | None = None
    max_gap_s: float | None = None
    offset_ns: int = 0
    offset_score: float | None = None
    mount: Transform | None = None

    def at(self, index: Array | slice) -> Pairs:
        """Select pairs by a numpy index, mask or slice."""
        return self._replace(ref=self.ref.at(index), est=self.est.at(index))


def paired(
    ref: Trajectory, est: Trajectory, max_gap_ns: float | None = None, max_diff_ns: float | None = None
) -> Pairs:
    """Pair poses of two trajectories: one is interpolated, that with the shorter intervals, at the stamps of the other.

    Interpolation is linear and slerp, never beyond the ends, nor over gaps longer than max_gap_ns (None: 3 median
    intervals); equal stamps need none.
    max_diff_ns: instead pair each pose of the trajectory with fewer poses with the nearest stamp of the other, at most
        this far away; of two equally near ones the earlier
    Poses without stamps are paired by index.
    """
    if ref.stamps_ns is None or est.stamps_ns is None:
        count = slice(min(ref.size, est.size))
        return Pairs(ref.at(count), est.at(count), est.size)
    walks_est = est.size <= ref.size
    if max_diff_ns is None:
        walks_est = interval(ref.stamps_ns) <= interval(est.stamps_ns)
    walked, other = (est, ref) if walks_est else (ref, est)
    shared, name, gap_s = 0, None, None
    if max_diff_ns is None:
        gap_ns = GAP * interval(other.stamps_ns) if max_gap_ns is None else max_gap_ns
        made, has_partner = between(other, walked.stamps_ns, gap_ns)
        kept = walked if has_partner.all() else walked.at(has_partner)
        name, gap_s = "ref" if walks_est else "est", gap_ns / 1e9 if isfinite(gap_ns) else None
    else:
        other = other.at(np.argsort(other.stamps_ns, kind="stable"))
        index, off = nearest(other.stamps_ns, walked.stamps_ns)
        index, kept = index[off <= max_diff_ns], walked.at(off <= max_diff_ns)
        made, shared = other.at(index), len(index) - len(np.unique(index))
    is_inside = (est.stamps_ns.min() <= ref.stamps_ns) & (ref.stamps_ns <= est.stamps_ns.max())
    possible = est.size if walks_est else int(np.count_nonzero(is_inside))
    return Pairs(*((made, kept) if walks_est else (kept, made)), possible, shared, name, gap_s)


def between(dense: Trajectory, stamps_ns: Array, max_gap_ns: float | None = None) -> tuple[Trajectory, Array]:
    """Interpolate a trajectory at stamps, linearly and by slerp; stamps outside of it or in a gap are left out.

    max_gap_ns: the longest gap to interpolate over; None: 3 median intervals
    Returns the poses, and the mask of the stamps that have one.
    """
    own = dense.stamps_ns
    max_gap_ns = GAP * interval(own) if max_gap_ns is None else max_gap_ns
    after = np.searchsorted(own, stamps_ns).clip(0, len(own) - 1)
    before = np.where(own[after] == stamps_ns, after, (after - 1).clip(0))
    gap = own[after] - own[before]
    found = (own[before] <= stamps_ns) & (stamps_ns <= own[after]) & (gap <= max_gap_ns)
    after, before, gap, at = after[found], before[found], gap[found], stamps_ns[found]
    fraction = (at - own[before]) / np.maximum(gap, 1)
    start, end = dense.at(before), dense.at(after)
    if start.xyzw is None:
        xyz = start.xyz + fraction[:, None] * (end.xyz - start.xyz)
        return start._replace(stamps_ns=at, xyz=xyz), found
    return start.with_poses(start.poses.interpolate(end.poses, fraction))._replace(stamps_ns=at), found


def nearest(own: Array, stamps_ns: Array) -> tuple[Indices, Array]:
    """Return the index of the sorted stamp nearest to each stamp, the earlier of two equally near, and the difference.

    own: the sorted stamps; stamps_ns: those to look up
    """
    after = np.searchsorted(own, stamps_ns).clip(0, len(own) - 1)
    before = (after - 1).clip(0)
    index = np.where(stamps_ns - own[before] <= np.abs(own[after] - stamps_ns), before, after)
    return index, np.abs(own[index] - stamps_ns)


def interval(stamps_ns: Array) -> float:
    """Return the median interval between stamps; infinite for a single one."""
    return float(np.median(np.diff(stamps_ns))) if len(stamps_ns) > 1 else float("inf")


def stamps_at_rate(each: Trajectory, rate_hz: float) -> Array:
    """Return stamps at a rate from the first pose to the last, each rounded to nanoseconds independently."""
    first, last = int(each.stamps_ns[0]), int(each.stamps_ns[-1])
    count = _count((last - first) * rate_hz / BILLION)
    stamps: Array = first + np.rint(np.arange(count) * (BILLION / rate_hz)).astype(np.int64)
    return stamps[stamps <= last]


def _count(steps: float) -> int:
    """Return the number of poses at whole steps, the first at 0; raises ValueInvalid for too many."""
    count = int(steps * (1 + 1e-12)) + 1
    if count > MOST:
        raise ValueInvalid(f"{count} poses are more than {MOST}; give a lower rate or longer steps")
    return count


def stamps_every(each: Trajectory, delta: Delta) -> Array:
    """Return the stamps at which a trajectory has covered whole multiples of a step of path or rotation.

    Raises ValueInvalid if the step needs rotations and there are none.
    """
    require_near(each.xyz, each.body)
    along = delta.along(each)
    if along is None:
        raise ValueInvalid(f"steps of {delta} need rotations")
    count = _count(along[-1] / delta.amount)
    wanted = np.minimum(np.arange(count) * delta.amount, along[-1])
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    step = along[after] - along[after - 1]
    part = np.divide(wanted - along[after - 1], step, out=np.zeros(count), where=step > 0.0)
    gaps = each.stamps_ns[after] - each.stamps_ns[after - 1]
    stamps: Array = each.stamps_ns[after - 1] + np.rint(part * gaps).astype(np.int64)
    return stamps


class ClockOffset(NamedTuple):
    """The offset in seconds, the correlation of speeds at it (1 is perfect), and another offset that fits as well."""

    seconds: float
    score: float
    rival: float | None = None


def clock_offset(
    ref: Trajectory, est: Trajectory, *, limit_s: float = LIMIT_S, kind: str = "sim3", by_turning: bool = False
) -> ClockOffset:
    """Estimate a clock offset: the lag at which angular speeds or speeds correlate best, refined by least squares.

    limit_s: the largest lag that is tried; kind: alignment for the refinement
    by_turning: use angular speeds only, if both rotate, because they do not depend on the sensor's position
    If the two spans do not overlap, their first stamps are aligned and every lag is tried.
    """
    if min(ref.size, est.size) < FEWEST:
        return ClockOffset(0.0, -1.0)
    unit = np.ldexp(1.0, np.frexp(max(np.abs(ref.xyz).max(), np.abs(est.xyz).max()))[1])  # so that no square overflows
    ref, est = (each._replace(xyz=each.xyz / unit) for each in (ref, est))
    first = int(ref.stamps_ns[0])
    shift = 0
    if est.stamps_ns[0] > ref.stamps_ns[-1] or est.stamps_ns[-1] < ref.stamps_ns[0]:
        shift, limit_s = first - int(est.stamps_ns[0]), np.inf
    times = [(ref.stamps_ns - first) / 1e9, (est.stamps_ns + shift - first) / 1e9]
    step = min(float(np.median(np.diff(each))) for each in times) / 2
    best = ClockOffset(0.0, -1.0)
    for turning in (True, False):
        speeds: list[tuple[Array, Array]] = []  # the middle of each interval, and the angular speed or speed there
        for each, at in zip((ref, est), times, strict=True):
            rotation = each.rotation if turning else None
            if turning and rotation is None:
                continue
            moved = length(np.diff(each.xyz, axis=0)) if rotation is None else rotation[:-1].distance(rotation[1:])
            speed = moved / np.diff(at)
            if not np.std(speed) < 1e-6 * max(TINY, np.max(speed)):  # a constant speed shows no lag
                speeds.append(((at[1:] + at[:-1]) / 2, speed))
        if len(speeds) < len(times):
            continue
        best = max(best, _best_lag(speeds[0], speeds[1], step, limit_s), key=lambda found: found.score)
        if by_turning and turning and best.score > 0:
            seconds = _refined_by_speeds(speeds[0], speeds[1], best.seconds, step)
            break
    else:
        seconds = _refined_by_path(ref, est, shift, best.seconds, step, kind) if best.score > 0 else 0.0
    return ClockOffset(seconds + shift / 1e9, best.score, None if best.rival is None else best.rival + shift / 1e9)


def _best_lag(a: tuple[Array, Array], b: tuple[Array, Array], step: float, limit_s: float) -> ClockOffset:
    """Return the lag of the highest correlation, normalised over the overlap, refined between samples by a parabola.

    a, b: times in seconds and speeds of the two; step: of the grid.  At least half of the shorter signal overlaps.
    All sums are correlations of signals, masks and squares, by FFT.
    """
    low, high = min(a[0][0], b[0][0]), max(a[0][-1], b[0][-1])
    grid = low + step * np.arange(int((high - low) / step) + 1)
    size = 1 << (2 * len(grid) - 1).bit_length()
    masks = [((grid >= at[0]) & (grid <= at[-1])).astype(float) for at, _ in (a, b)]
    speeds = [np.interp(grid, at, speed) * mask for (at, speed), mask in zip((a, b), masks, strict=True)]
    speeds = [each - mask * (each.sum() / mask.sum()) for each, mask in zip(speeds, masks, strict=True)]

    def correlated(x: Array, y: Array) -> Array:
        found: Array = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return found

    count = np.maximum(correlated(*masks), 1e-9)
    sums = correlated(speeds[0], masks[1]), correlated(masks[0], speeds[1])
    squares = correlated(speeds[0] ** 2, masks[1]), correlated(masks[0], speeds[1] ** 2)
    covariance = correlated(*speeds) - sums[0] * sums[1] / count
    spread = [np.maximum(square - total**2 / count, TINY) for square, total in zip(squares, sums, strict=True)]
    lags = np.arange(size)
    lags[size // 2 :] -= size
    shortest = min(at[-1] - at[0] for at, _ in (a, b))
    tried = (np.abs(lags * step) <= limit_s) & (count * step >= shortest / 2)
    score = np.where(tried, covariance / np.sqrt(spread[0]) / np.sqrt(spread[1]), -1.0)
    score = np.round(score, DIGITS)  # further digits are those of the FFT, which depend on the processor
    at = int(np.argmax(score))
    before, here, after = score[at - 1], score[at], score[(at + 1) % size]
    bend = before - 2 * here + after
    part = 0.5 * (before - after) / bend if bend < 0 and min(before, after) > -1 else 0.0
    score, middle, rival = np.fft.fftshift(score), size // 2, None
    near = score >= AS_GOOD * here
    peaks = np.cumsum(~near)  # numbers the peaks: the lags of one peak have the same number
    near &= peaks != peaks[(at + middle) % size]
    if near.any() and here > 0:  # another peak is about as high
        rival = round(float((np.argmax(np.where(near, score, -np.inf)) - middle) * step), DIGITS)
    return ClockOffset(round(float((lags[at] + part) * step), DIGITS), float(here), rival)


def _newton(start: float, step: float, change_of: Callable[[float], float]) -> float:
    """Refine a lag by Gauss-Newton until it does not change, by at most one step of the grid at a time.

    change_of: returns the change of a lag.  If the lag leaves the neighbourhood of the start, the start is returned.
    """
    seconds = start
    for _ in range(STEPS):
        change = change_of(seconds)
        seconds += min(max(change, -step), step)
        if abs(change) < REFINED_S:
            break
    return seconds if abs(seconds - start) < NEARBY * step else start


def _refined_by_speeds(a: tuple[Array, Array], b: tuple[Array, Array], seconds: float, step: float) -> float:
    """Refine a lag by least squares between the speeds a and the shifted speeds b."""

    def change_of(found: float) -> float:
        at = b[0] + found
        inside = (at >= a[0][0] + step) & (at <= a[0][-1] - step)
        sooner, here, later = (np.interp(at[inside] + lag, *a) for lag in (-step, 0.0, step))
        slope = (later - sooner) / (2.0 * step)
        return float(slope @ (b[1][inside] - here)) / max(float(slope @ slope), TINY)

    return _newton(seconds, step, change_of)


def _refined_by_path(ref: Trajectory, est: Trajectory, shift: int, seconds: float, step: float, kind: str) -> float:
    """Refine a lag from the residuals along the velocity after the fit.

    Drift is along the velocity too, but correlated from pose to pose.  The lag is returned unchanged if the residuals
    are so correlated that they are less accurate than the correlation, or if they require a lag outside of its
    uncertainty (as with a lever arm).
    """
    plain, doubt = ref._replace(xyzw=None), np.inf
    half, gap_ns = round(step * 1e9), GAP * interval(ref.stamps_ns)

    def change_of(found: float) -> float:
        nonlocal doubt
        at = est.stamps_ns + shift + round(found * 1e9)
        inside = np.logical_and.reduce([between(plain, at + lag, gap_ns)[1] for lag in (-half, 0, half)])
        own = est.at(inside)._replace(xyzw=None)
        sooner, here, later = (between(plain, at[inside] + lag, gap_ns)[0].xyz for lag in (-half, 0, half))
        velocity = (later - sooner) / (2e-9 * half)
        fit = fitted(kind, plain._replace(xyz=here), own, np.array([0.0, 0.0, 1.0]))
        left, unsteady = ((fit.moved(own).xyz - here) * velocity).sum(-1), velocity - centre(velocity)
        squared = max(float((unsteady**2).sum()), TINY)  # a constant velocity is equivalent to a shift of the fit
        centred = left - left.mean()
        alike = float(centred[1:] @ centred[:-1]) / max(float(centred @ centred), TINY)
        doubt = sqrt(float(left @ left) * (1 + alike) / max(1 - alike, TINY)) / squared
        return float(left.sum()) / squared

    try:
        found = _newton(seconds, step, change_of)
    except Unaligned:
        return seconds
    return found if doubt < DOUBT * step else seconds
