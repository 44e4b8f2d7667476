"""How far an estimate is from its reference: in place, from pose to pose, over stretches of the path."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.fit.least_squares import length
from frametool.frames.trajectory import way

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.types import Array, Indices

CHORD = 0.1  # metres of path before and behind a pose that say which way it goes
ROUNDING = 1e-9  # of a delta


class Statistics(NamedTuple):
    """What is said of many numbers: std is that of all of them (n), p95 the linear percentile."""

    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float
    sse: float
    p95: float


def statistics(values: Array) -> Statistics:
    """Sum numbers up."""
    count, sse, mean = len(values), float((values**2).sum()), float(values.mean())
    return Statistics(
        sqrt(sse / count), mean, float(np.median(values)), float(values.std()),
        float(values.min()), float(values.max()), sse, float(np.percentile(values, 95)),
    )  # fmt: skip


class AbsoluteErrors(NamedTuple):
    """Errors in place, one a pair: the distance and, signed, its parts along, across and above the path, metres.

    rad: the angle of inv(ref) est, None without rotations of both
    """

    m: Array
    rad: Array | None
    along: Array
    across: Array
    up: Array


def absolute_errors(ref: Trajectory, est: Trajectory, up: Array) -> AbsoluteErrors:
    """Compare an estimate, as it was aligned, with its reference pose by pose."""
    gap = est.xyz - ref.xyz
    along, above = _path_axes(ref.xyz, up)
    across = np.cross(above, along)
    turned = ref.rotation, est.rotation
    rad = None if turned[0] is None or turned[1] is None else turned[0].distance(turned[1])
    return AbsoluteErrors(length(gap), rad, *((gap * axis).sum(-1) for axis in (along, across, above)))


def _path_axes(xyz: Array, up: Array) -> tuple[Array, Array]:
    """Return which way the path goes at each position, and up at right angles to it; where that is parallel, x."""
    path = way(xyz)
    behind = (np.searchsorted(path, path - CHORD, "right") - 1).clip(0)
    ahead = np.searchsorted(path, path + CHORD).clip(0, len(path) - 1)
    chord = xyz[ahead] - xyz[behind]
    size = length(chord)
    moving = np.flatnonzero(size > 0.0)
    if not len(moving):
        along = np.tile([1.0, 0.0, 0.0], (len(xyz), 1))
    else:
        last = moving[(np.searchsorted(moving, np.arange(len(xyz)), "right") - 1).clip(0)]
        along = chord[last] / size[last, None]
    above = up - (along @ up)[:, None] * along
    size = length(above)
    parallel = size < ROUNDING
    if parallel.any():
        x = np.array([1.0, 0.0, 0.0])
        above[parallel] = x - along[parallel, :1] * along[parallel]
        size = length(above)
    return along, above / size[:, None]


class RelativeErrors(NamedTuple):
    """Errors of the way from pose `start` to pose `end`: of its translation and angle, and of the distance covered.

    m and rad are None without rotations of both.
    """

    start: Indices
    end: Indices
    m: Array | None
    rad: Array | None
    distance: Array


def relative_errors(ref: Trajectory, est: Trajectory, start: Indices, end: Indices) -> RelativeErrors:
    """Compare the ways from pose to pose: E = inv(inv(ref_i) ref_j) inv(est_i) est_j."""
    covered = [length(each.xyz[end] - each.xyz[start]) for each in (ref, est)]
    distance = np.abs(covered[1] - covered[0])
    if ref.xyzw is None or est.xyzw is None:
        return RelativeErrors(start, end, None, None, distance)
    steps = [each.poses[start].relative(each.poses[end]) for each in (ref, est)]
    error = steps[0].relative(steps[1])
    return RelativeErrors(start, end, length(error.xyz), error.rotation.angle(), distance)


def chained(along: Array, delta: float) -> tuple[Indices, Indices]:
    """Return pairs (i, j), each from the end of the one before: j is the first that is delta further along."""
    following = np.searchsorted(along, along + delta * (1 - ROUNDING)).tolist()
    found = [0]
    while (after := following[found[-1]]) < len(along):
        found.append(after)
    chain = np.array(found)
    return chain[:-1], chain[1:]


def is_lost(along: Array, delta: float) -> bool:
    """Return True if a delta is so short beside the path that adding it changes nothing."""
    return bool(along[-1] + delta * (1 - ROUNDING) == along[-1])


def all_pairs(along: Array, delta: float, tolerance: float) -> tuple[Indices, Indices]:
    """Return for each i the j whose way from there is the nearest to delta, within a share of it."""
    wanted = along + delta
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    end = np.where(wanted - along[after - 1] <= along[after] - wanted, after - 1, after)
    start = np.arange(len(along))
    fits = (np.abs(along[end] - wanted) <= tolerance * delta) & (end > start)
    return start[fits], end[fits]


class SegmentErrors(NamedTuple):
    """Errors over stretches of path of some lengths: each one's ends, length, and errors a metre of it."""

    start: Indices
    end: Indices
    length: Array
    share: Array
    rad_per_m: Array


def segment_errors(ref: Trajectory, est: Trajectory, lengths: Sequence[float], step: int) -> SegmentErrors | None:
    """Compare stretches of path from every so-manieth pair, as the KITTI benchmark does; None without rotations.

    Source: Geiger, Lenz, Urtasun 2012, and its devkit: up to the first pose that is more than the length further.
    """
    if ref.xyzw is None or est.xyzw is None:
        return None
    path = way(ref.xyz)
    firsts = np.arange(0, ref.size, step)
    ends = [np.searchsorted(path, path[firsts] + length, "right") for length in lengths]
    start, length = np.repeat(firsts[:, None], len(lengths), 1), np.broadcast_to(lengths, (len(firsts), len(lengths)))
    end = np.stack(ends, -1)
    there = end < ref.size
    start, end, length = start[there], end[there], length[there]
    errors = relative_errors(ref, est, start, end)
    assert errors.m is not None  # noqa: S101 - both have rotations
    return SegmentErrors(start, end, length, errors.m / length, errors.rad / length)
