"""Errors of an aligned trajectory: absolute, relative over a distance between poses, and over segments as in KITTI."""

from __future__ import annotations

import re
from math import sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, shown
from frametool.fit.least_squares import length
from frametool.frames.trajectory import way

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.trajectory import Trajectory
    from frametool.geometry import Array, Indices

CHORD = 0.1  # metres of path before and after a pose that define its direction
ROUNDING = 1e-9  # share of a delta by which a distance may be shorter
X = np.array([1.0, 0.0, 0.0])


class Delta(NamedTuple):
    """The distance between two poses: metres, seconds, degrees of rotation, or frames."""

    amount: float
    unit: str

    def __str__(self) -> str:
        """Return the delta in the notation of `parse_delta`."""
        return f"{self.amount:g}{self.unit}"

    def along(self, each: Trajectory) -> Array | None:
        """Return the cumulative distance at each pose, in `unit`; None if it needs missing stamps or rotations."""
        if self.unit == "frames":
            return np.arange(each.size, dtype=float)
        if self.unit == "m":
            return way(each.xyz)
        if self.unit == "s":
            return None if each.stamps_ns is None else (each.stamps_ns - each.stamps_ns[0]) / 1e9
        rotation = each.rotation
        return None if rotation is None else np.degrees(np.append(0.0, np.cumsum(rotation[:-1].distance(rotation[1:]))))


def parse_delta(text: str, units: Sequence[str] = ("m", "s", "deg", "frames")) -> Delta:
    """Parse `1m`, `10frames`, `1s` or `5deg`; raises ValueInvalid."""
    found = re.fullmatch(r"(\d+(?:\.\d*)?|\.\d+)\s*([a-z]+)", text.strip())
    if not found or found[2] not in units or not float(found[1]) > 0:
        raise ValueInvalid(f"{shown(text)} is not a distance between poses; write a number with {', '.join(units)}")
    if found[2] == "frames" and not float(found[1]).is_integer():
        raise ValueInvalid(f"{shown(text)}: frames are counted whole")
    return Delta(float(found[1]), found[2])


def statistics(values: Array | None) -> Any:
    """Return the statistics of numbers; None for None; std divides by n, p95 is interpolated linearly."""
    if values is None:
        return None
    sse = float((values**2).sum())
    return {
        "rmse": sqrt(sse / len(values)), "mean": float(values.mean()), "median": float(np.median(values)),
        "std": float(values.std()), "min": float(values.min()), "max": float(values.max()), "sse": sse,
        "p95": float(np.percentile(values, 95)),
    }  # fmt: skip


class AbsoluteErrors(NamedTuple):
    """Absolute errors of each pair, metres: the distance, and its signed parts along, across and above the path.

    rad: the angle of inv(ref) est, None without rotations of both
    """

    m: Array
    rad: Array | None
    along: Array
    across: Array
    up: Array


def absolute_errors(ref: Trajectory, est: Trajectory, up: Array) -> AbsoluteErrors:
    """Compare an aligned estimate with its reference pose by pose."""
    path = way(ref.xyz)
    behind = (np.searchsorted(path, path - CHORD, "right") - 1).clip(0)
    ahead = np.searchsorted(path, path + CHORD).clip(0, len(path) - 1)
    chord = ref.xyz[ahead] - ref.xyz[behind]
    size = length(chord)
    moving = np.flatnonzero(size > 0.0)
    along = np.tile(X, (len(path), 1))
    if len(moving):
        last = moving[(np.searchsorted(moving, np.arange(len(path)), "right") - 1).clip(0)]
        along = chord[last] / size[last, None]
    above = up - (along @ up)[:, None] * along  # normal to the path; if up is parallel to it, from x instead
    parallel = length(above) < ROUNDING
    above[parallel] = X - along[parallel, :1] * along[parallel]
    above /= length(above)[:, None]
    gap, turned = est.xyz - ref.xyz, (ref.rotation, est.rotation)
    rad = None if turned[0] is None or turned[1] is None else turned[0].distance(turned[1])
    return AbsoluteErrors(length(gap), rad, *((gap * axis).sum(-1) for axis in (along, np.cross(above, along), above)))


class RelativeErrors(NamedTuple):
    """Relative errors from pose `start` to pose `end`: of translation (m), angle (rad) and distance covered (metres).

    m and rad are None without rotations of both.
    """

    start: Indices
    end: Indices
    m: Array | None
    rad: Array | None
    distance: Array


def relative_errors(ref: Trajectory, est: Trajectory, start: Indices, end: Indices) -> RelativeErrors:
    """Compare relative poses: E = inv(inv(ref_i) ref_j) inv(est_i) est_j."""
    covered = [length(each.xyz[end] - each.xyz[start]) for each in (ref, est)]
    distance = np.abs(covered[1] - covered[0])
    if ref.xyzw is None or est.xyzw is None:
        return RelativeErrors(start, end, None, None, distance)
    steps = [each.poses[start].relative(each.poses[end]) for each in (ref, est)]
    error = steps[0].relative(steps[1])
    return RelativeErrors(start, end, length(error.xyz), error.rotation.angle(), distance)


def chained(along: Array, delta: float) -> tuple[Indices, Indices]:
    """Return pairs (i, j) end to end: j is the first pose that is delta further along than i."""
    following = np.searchsorted(along, along + delta * (1 - ROUNDING)).tolist()
    found = [0]
    while (after := following[found[-1]]) < len(along):
        found.append(after)
    chain = np.array(found)
    return chain[:-1], chain[1:]


def all_pairs(along: Array, delta: float, tolerance: float) -> tuple[Indices, Indices]:
    """Return for each i the first j whose distance from i is nearest to delta, only within `tolerance` * delta."""
    wanted = along + delta
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    nearest = np.where(wanted - along[after - 1] <= along[after] - wanted, after - 1, after)
    end = np.searchsorted(along, along[nearest])
    fits = (np.abs(along[end] - wanted) <= tolerance * delta) & (end > np.arange(len(along)))
    return np.flatnonzero(fits), end[fits]


class SegmentErrors(NamedTuple):
    """Errors over path segments: the first and last pose and the length of each, and its errors per metre.

    share: metres per metre
    """

    start: Indices
    end: Indices
    length: Array
    share: Array
    rad_per_m: Array


def segment_errors(ref: Trajectory, est: Trajectory, lengths: Sequence[float], step: int) -> SegmentErrors | None:
    """Compare path segments from every `step`-th pair, as the KITTI benchmark does; None without rotations.

    Source: Geiger, Lenz, Urtasun 2012, and its devkit: a segment ends at the first pose beyond the length.
    """
    if not lengths or ref.xyzw is None or est.xyzw is None:
        return None
    path, firsts = way(ref.xyz), np.arange(0, ref.size, step)
    found: list[tuple[Any, ...]] = []
    for metres in lengths:  # one by one, which needs an eighth of the memory
        ends = np.searchsorted(path, path[firsts] + metres, "right")
        there = ends < ref.size
        start, end, *errors, _ = relative_errors(ref, est, firsts[there], ends[there])
        found.append((start, end, np.full(len(start), metres), *(np.asarray(each) / metres for each in errors)))
    columns = [*map(np.concatenate, zip(*found, strict=True))]
    order = np.argsort(columns[0], kind="stable")  # those from one pose together
    return SegmentErrors(*(column[order] for column in columns))
