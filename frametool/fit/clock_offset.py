"""The offset between the clocks of two trajectories of one motion: t_ref = t_est + offset."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.alignment import FEWEST, Unaligned, centre, fitted
from frametool.fit.least_squares import length
from frametool.fit.pairing import GAP, between, interval

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.frames.trajectory import Trajectory
    from frametool.geometry import Array

LIMIT_S = 10.0
REFINED_S = 1e-7
STEPS = 8
NEARBY = 1.2  # of a step: the largest error of the best of all lags and its neighbours
DOUBT = 0.25  # of a step: the largest acceptable standard error of least squares
TINY = 1e-12
AS_GOOD = 0.99  # of the best score: another lag may be the true one
DIGITS = 9  # of a score, and of seconds: stamps are whole nanoseconds


class ClockOffset(NamedTuple):
    """The offset in seconds, the correlation of speeds there (1 is perfect), and another offset about as good."""

    seconds: float
    score: float
    rival: float | None = None


def clock_offset(
    ref: Trajectory, est: Trajectory, *, limit_s: float = LIMIT_S, kind: str = "sim3", by_turning: bool = False
) -> ClockOffset:
    """Find the lag at which angular speeds, or else speeds, correlate best; refine it by least squares.

    by_turning: use angular speeds only if both rotate, because they do not depend on the sensor's position
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
        speeds: list[tuple[Array, Array]] = []  # the intervals between poses, and the angular speed or speed there
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

    At least half of the shorter signal overlaps.  All sums are correlations of signals, masks and squares, by FFT.
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
    peaks = np.cumsum(~near)  # the number of each: between two valleys it is the same
    near &= peaks != peaks[(at + middle) % size]
    if near.any() and here > 0:  # another one is as good
        rival = round(float((np.argmax(np.where(near, score, -np.inf)) - middle) * step), DIGITS)
    return ClockOffset(round(float((lags[at] + part) * step), DIGITS), float(here), rival)


def _newton(start: float, step: float, change_of: Callable[[float], float]) -> float:
    """Refine a lag until it does not change: Gauss-Newton on one number, at most a step of the grid at a time.

    A lag that leaves the neighbourhood of the start is not believed: the start is returned.
    """
    seconds = start
    for _ in range(STEPS):
        change = change_of(seconds)
        seconds += min(max(change, -step), step)
        if abs(change) < REFINED_S:
            break
    return seconds if abs(seconds - start) < NEARBY * step else start


def _refined_by_speeds(a: tuple[Array, Array], b: tuple[Array, Array], seconds: float, step: float) -> float:
    """Refine a lag until the speeds a match the speeds b best."""

    def change_of(found: float) -> float:
        at = b[0] + found
        inside = (at >= a[0][0] + step) & (at <= a[0][-1] - step)
        sooner, here, later = (np.interp(at[inside] + lag, *a) for lag in (-step, 0.0, step))
        slope = (later - sooner) / (2.0 * step)
        return float(slope @ (b[1][inside] - here)) / max(float(slope @ slope), TINY)

    return _newton(seconds, step, change_of)


def _refined_by_path(ref: Trajectory, est: Trajectory, shift: int, seconds: float, step: float, kind: str) -> float:
    """Refine the offset from the residuals along the velocity after the fit.

    Drift is along the velocity too, but correlated from pose to pose: if the residuals are so correlated that they are
    less accurate than the correlation, or require a lag outside of its uncertainty (as with a lever arm), it is
    unchanged.
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
