"""How far two clocks are apart, from the motion that both trajectories show: t_ref = t_est + offset."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.alignment import Unaligned, centre, fitted
from frametool.fit.least_squares import length
from frametool.fit.pairs import GAP, between, interval

if TYPE_CHECKING:
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array

LIMIT_S = 10.0
REFINED_S = 1e-7
STEPS = 8
LEAST = 3  # poses: two speeds make the least course
NEARBY = 1.2  # of a step: what the best of all lags and its neighbours may miss
DOUBT = 0.25  # of a step: the standard error that least squares may have
TINY = 1e-12
AS_GOOD = 0.99  # of the best score: another lag may be the true one
DIGITS = 9  # of a score, and of seconds: stamps are whole nanoseconds


class ClockOffset(NamedTuple):
    """The offset in seconds, how well speeds agree there (1 is perfectly), and another that is about as good."""

    seconds: float
    score: float
    rival: float | None = None

    def shifted(self, change: float, shift_ns: int) -> ClockOffset:
        """Return it refined by a change, on clocks that had been shifted."""
        rival = None if self.rival is None else self.rival + shift_ns / 1e9
        return ClockOffset(self.seconds + change + shift_ns / 1e9, self.score, rival)


def clock_offset(
    ref: Trajectory, est: Trajectory, *, limit_s: float = LIMIT_S, kind: str = "sim3", by_turning: bool = False
) -> ClockOffset:
    """Find the lag at which angular speeds, or else speeds, correlate best; refine it by least squares.

    by_turning: by angular speeds alone if both turn, as those do not depend on where a body is measured
    Where the two spans do not meet, their first stamps are put together and every lag is tried.
    """
    if min(ref.size, est.size) < LEAST:
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
        speeds = [_speeds(each, at, turning=turning) for each, at in zip((ref, est), times, strict=True)]
        courses = [each for each in speeds if each is not None]
        if len(courses) < len(speeds):
            continue
        best = max(best, _best_lag(courses[0], courses[1], step, limit_s), key=lambda found: found.score)
        if by_turning and turning and best.score > 0:
            return best.shifted(_refined_speeds(courses[0], courses[1], best.seconds, step) - best.seconds, shift)
    change = _refined(ref, est, shift, best.seconds, step, kind) - best.seconds if best.score > 0 else 0.0
    return best.shifted(change, shift)


def _speeds(each: Trajectory, times: Array, *, turning: bool) -> tuple[Array, Array] | None:
    """Return the times between poses and the angular speed or speed there; None where there is none to speak of."""
    if turning and each.rotation is None:
        return None
    if turning:
        rotation = each.rotation
        moved = rotation[:-1].distance(rotation[1:])  # type: ignore[index]
    else:
        moved = length(np.diff(each.xyz, axis=0))
    speed = moved / np.diff(times)
    return None if np.std(speed) < 1e-6 * max(TINY, np.max(speed)) else ((times[1:] + times[:-1]) / 2, speed)


def _best_lag(a: tuple[Array, Array], b: tuple[Array, Array], step: float, limit_s: float) -> ClockOffset:
    """Return the lag of the highest correlation, normalised over what overlaps at it; between samples by a parabola.

    At least half of the shorter course overlaps.  All sums are correlations of courses, masks and squares: by FFT.
    """
    low, high = min(a[0][0], b[0][0]), max(a[0][-1], b[0][-1])
    grid = low + step * np.arange(int((high - low) / step) + 1)
    size = 1 << (2 * len(grid) - 1).bit_length()
    masks = [((grid >= at[0]) & (grid <= at[-1])).astype(float) for at, _ in (a, b)]
    courses = [np.interp(grid, at, speed) * mask for (at, speed), mask in zip((a, b), masks, strict=True)]
    courses = [course - mask * (course.sum() / mask.sum()) for course, mask in zip(courses, masks, strict=True)]

    def correlated(x: Array, y: Array) -> Array:
        found: Array = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return found

    count = np.maximum(correlated(*masks), 1e-9)
    sums = correlated(courses[0], masks[1]), correlated(masks[0], courses[1])
    squares = correlated(courses[0] ** 2, masks[1]), correlated(masks[0], courses[1] ** 2)
    covariance = correlated(*courses) - sums[0] * sums[1] / count
    spread = [np.maximum(square - total**2 / count, TINY) for square, total in zip(squares, sums, strict=True)]
    lags = np.arange(size)
    lags[size // 2 :] -= size
    shortest = min(at[-1] - at[0] for at, _ in (a, b))
    tried = (np.abs(lags * step) <= limit_s) & (count * step >= shortest / 2)
    score = np.where(tried, covariance / np.sqrt(spread[0]) / np.sqrt(spread[1]), -1.0)
    score = np.round(score, DIGITS)  # further digits are those of the FFT, which adds as the processor likes
    at = int(np.argmax(score))
    before, here, after = score[at - 1], score[at], score[(at + 1) % size]
    bend = before - 2 * here + after
    part = 0.5 * (before - after) / bend if bend < 0 and min(before, after) > -1 else 0.0
    other = _rival(np.fft.fftshift(score), (at + size // 2) % size)
    rival = None if other is None else round(float((other - size // 2) * step), DIGITS)
    return ClockOffset(round(float((lags[at] + part) * step), DIGITS), float(here), rival)


def _rival(score: Array, best: int) -> int | None:
    """Return the index of another peak that is as good to a per cent, None where the best stands alone."""
    near = score >= AS_GOOD * score[best]
    valleys = np.flatnonzero(~near)
    at = np.searchsorted(valleys, best)
    near[valleys[at - 1] if at else 0 : valleys[at] if at < len(valleys) else len(near)] = False  # the same peak
    return int(np.argmax(np.where(near, score, -np.inf))) if near.any() and score[best] > 0 else None


def _refined_speeds(a: tuple[Array, Array], b: tuple[Array, Array], seconds: float, step: float) -> float:
    """Refine a lag until the speeds a agree best with the speeds b (Gauss-Newton on one number)."""
    found = seconds
    for _ in range(STEPS):
        at = b[0] + found
        inside = (at >= a[0][0] + step) & (at <= a[0][-1] - step)
        sooner, here, later = (np.interp(at[inside] + lag, *a) for lag in (-step, 0.0, step))
        slope = (later - sooner) / (2.0 * step)
        change = float(slope @ (b[1][inside] - here)) / max(float(slope @ slope), TINY)
        found += min(max(change, -step), step)
        if abs(change) < REFINED_S:
            break
    return found if abs(found - seconds) < NEARBY * step else seconds


def _refined(ref: Trajectory, est: Trajectory, shift: int, seconds: float, step: float, kind: str) -> float:
    """Let what is left along the velocity after the fit be time: Gauss-Newton on one number.

    Drift is along the velocity too, but alike from pose to pose: where what is left is so alike that it says less
    than the correlation did, or wants a lag beyond what that leaves open (a lever arm does), the lag stays.
    """
    up = np.array([0.0, 0.0, 1.0])
    plain = ref._replace(xyzw=None)
    half, gap_ns = round(step * 1e9), GAP * interval(ref.stamps_ns)
    found = seconds
    for _ in range(STEPS):
        at = est.stamps_ns + shift + round(found * 1e9)
        inside = np.logical_and.reduce([between(plain, at + lag, gap_ns)[1] for lag in (-half, 0, half)])
        own = est.at(inside)._replace(xyzw=None)
        sooner, here, later = (between(plain, at[inside] + lag, gap_ns)[0].xyz for lag in (-half, 0, half))
        velocity = (later - sooner) / (2e-9 * half)
        try:
            fit = fitted(kind, plain._replace(xyz=here), own, up)
        except Unaligned:
            return seconds
        left, unsteady = ((fit.moved(own).xyz - here) * velocity).sum(-1), velocity - centre(velocity)
        squared = max(float((unsteady**2).sum()), TINY)  # a constant velocity is a shift of the fit
        change = min(max(float(left.sum()) / squared, -step), step)
        found += change
        if abs(change) < REFINED_S:
            break
    centred = left - left.mean()
    alike = float(centred[1:] @ centred[:-1]) / max(float(centred @ centred), TINY)
    doubt = sqrt(float(left @ left) * (1 + alike) / max(1 - alike, TINY)) / squared
    return found if doubt < DOUBT * step and abs(found - seconds) < NEARBY * step else seconds
