"""Errors of an estimate relative to its reference: statistics as a mapping and as rows, and limits on them.

Limits are for continuous integration: `ate>5cm,rpe:10m>1%,paired<90%`.
"""

from __future__ import annotations

import operator
import re
from math import degrees, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.fit.alignment import SCALED
from frametool.fit.least_squares import length
from frametool.frames.trajectory import Trajectory, way
from frametool.geometry import arrays
from frametool.geometry.floats import half_sincos

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.fit.comparison import Comparison
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Array, Indices


CHORD = 0.1  # metres of path before and after a pose that define its direction
ROUNDING = 1e-9  # of a delta
X = np.array([1.0, 0.0, 0.0])


def statistics(values: Array | None) -> Any:
    """Return the statistics of numbers, if any: std is the population's (n), p95 the linear percentile."""
    if values is None:
        return None
    sse = float((values**2).sum())
    return {
        "rmse": sqrt(sse / len(values)), "mean": float(values.mean()), "median": float(np.median(values)),
        "std": float(values.std()), "min": float(values.min()), "max": float(values.max()), "sse": sse,
        "p95": float(np.percentile(values, 95)),
    }  # fmt: skip


class AbsoluteErrors(NamedTuple):
    """Absolute errors, one per pair: the distance and, signed, its parts along, across and above the path, metres.

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
    above = up - (along @ up)[:, None] * along  # normal to the path; if up is parallel to it, x is made so
    parallel = length(above) < ROUNDING
    above[parallel] = X - along[parallel, :1] * along[parallel]
    above /= length(above)[:, None]
    gap, turned = est.xyz - ref.xyz, (ref.rotation, est.rotation)
    rad = None if turned[0] is None or turned[1] is None else turned[0].distance(turned[1])
    return AbsoluteErrors(length(gap), rad, *((gap * axis).sum(-1) for axis in (along, np.cross(above, along), above)))


class RelativeErrors(NamedTuple):
    """Relative errors from pose `start` to pose `end`: of translation and angle, and of the distance covered.

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
    """Return pairs (i, j), each from the end of the previous one: j is the first that is delta further along."""
    following = np.searchsorted(along, along + delta * (1 - ROUNDING)).tolist()
    found = [0]
    while (after := following[found[-1]]) < len(along):
        found.append(after)
    chain = np.array(found)
    return chain[:-1], chain[1:]


def all_pairs(along: Array, delta: float, tolerance: float) -> tuple[Indices, Indices]:
    """Return for each i the j whose distance from there is the nearest to delta, within a share of it."""
    wanted = along + delta
    after = np.searchsorted(along, wanted).clip(1, len(along) - 1)
    end = np.where(wanted - along[after - 1] <= along[after] - wanted, after - 1, after)
    start = np.arange(len(along))
    fits = (np.abs(along[end] - wanted) <= tolerance * delta) & (end > start)
    return start[fits], end[fits]


class SegmentErrors(NamedTuple):
    """Errors over path segments of some lengths: the ends and length of each, and its errors per metre."""

    start: Indices
    end: Indices
    length: Array
    share: Array
    rad_per_m: Array


def segment_errors(ref: Trajectory, est: Trajectory, lengths: Sequence[float], step: int) -> SegmentErrors | None:
    """Compare path segments from every n-th pair, as the KITTI benchmark does; None without rotations.

    Source: Geiger, Lenz, Urtasun 2012, and its devkit: up to the first pose that is more than the length further.
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


SQRT8 = 8**0.5


def numbers(found: Comparison) -> dict[str, Any]:
    """Return every setting and number of a comparison; inapplicable ones are None."""
    pairs, ate, (_, fitting, reporting) = found.pairs, found.ate, found.settings
    stamps, (parent, name) = pairs.ref.stamps_ns, worlds(found)
    scale = {"scale": found.fit.scale} if fitting.align in SCALED else {}  # only if one was estimated
    relative = []
    for delta, errors in found.relative:
        summed = _errors(errors.m, errors.rad, evo=reporting.evo)
        share = 100 * summed["m"]["rmse"] / delta.amount if summed["m"] and delta.unit == "m" else None
        counted = {"delta": str(delta), "pairs": len(errors.start)}
        relative.append(counted | summed | {"percent": share, "distance_m": statistics(errors.distance)})
    return {
        "ref": found.names[0],
        "est": found.names[1],
        "settings": _settings(found),
        "poses": {
            "ref": found.ref.size, "est": found.est.size, "possible": pairs.possible, "paired": pairs.ref.size,
            "shared": pairs.shared,
        },
        "ref_duration_s": None if stamps is None else int(np.ptp(found.ref.stamps_ns)) / 1e9,
        "duration_s": None if stamps is None else int(stamps[-1] - stamps[0]) / 1e9,
        "path_m": {"ref": float(way(pairs.ref.xyz)[-1]), "est": float(way(found.moved.xyz)[-1])},
        "offset_s": pairs.offset_ns / 1e9,
        "offset_score": pairs.offset_score,
        "transform": {"name": name, "parent": parent, **_pose(found.fit.transform), **scale},
        "ate_by_alignment": found.ate_by_alignment,
        "ate": {
            **_errors(ate.m, ate.rad, evo=reporting.evo), "along_m": statistics(ate.along),
            "across_m": statistics(ate.across), "up_m": statistics(ate.up), "end_m": float(ate.m[-1]),
        },
        "rpe": relative,
        "kitti": _kitti(found),
        "hints": found.hints,
    }  # fmt: skip


def worlds(found: Comparison) -> tuple[str, str]:
    """Return the names of the worlds of reference and estimate; equal ones become `ref` and `est`."""
    ref, est = found.pairs.ref.world, found.pairs.est.world
    return ("ref", "est") if ref == est else (ref, est)


def _pose(pose: Transform) -> dict[str, Any]:
    return {"xyz": pose.xyz.tolist(), "quaternion": dict(zip("xyzw", pose.xyzw.tolist(), strict=True))}


def _settings(found: Comparison) -> dict[str, Any]:
    (pairing, fitting, reporting), pairs = found.settings, found.pairs
    is_nearest = pairing.match == "nearest"
    has_stamps = pairs.ref.stamps_ns is not None
    limits = ("+" * limit[0] + f"{limit[1] / 1e9:.9f}" if limit else None for limit in (pairing.start, pairing.stop))
    return {
        "match": pairing.match if has_stamps else "number", "interpolated": pairs.interpolated,
        "max_gap_s": pairs.max_gap_s, "max_diff_s": pairing.max_diff_ns / 1e9 if is_nearest and has_stamps else None,
        "min_match": pairing.min_match,
        "offset": pairing.offset if pairing.offset == "auto" else pairs.offset_ns / 1e9, "align": fitting.align,
        "align_first": fitting.align_first and str(fitting.align_first), "tie_first": fitting.tie_first,
        "mount": None if pairs.mount is None else _pose(pairs.mount), "up": list(fitting.up),
        "delta": [str(delta) for delta, _ in found.relative], "all_pairs": reporting.all_pairs,
        "tolerance": reporting.tolerance if reporting.all_pairs else None, "pairs_from": reporting.pairs_from,
        "segments_m": list(reporting.segments), "segment_step": reporting.segment_step,
        **dict(zip(("start_s", "end_s"), limits, strict=True)), "as": "evo" if reporting.evo else None,
    }  # fmt: skip


def _errors(m: Array | None, rad: Array | None, *, evo: bool) -> dict[str, Any]:
    """Return the statistics of distances and angles, and as evo does the norm of R - I and of the whole matrix."""
    found = {"m": statistics(m), "deg": statistics(None if rad is None else np.degrees(rad))}
    if evo and m is not None and rad is not None:
        rot = SQRT8 * half_sincos(rad, arrays)[0]
        found |= {"rot": statistics(rot), "full": statistics(np.sqrt(m * m + rot * rot))}
    return found


def _kitti(found: Comparison) -> dict[str, Any] | None:
    segments = found.segments
    if segments is None or not len(segments.start):
        return None

    def mean(chosen: Any) -> dict[str, Any]:
        return {
            "segments": int(np.count_nonzero(chosen)),
            "percent": 100 * float(segments.share[chosen].mean()),
            "deg_per_m": degrees(float(segments.rad_per_m[chosen].mean())),
        }

    lengths = [
        {"length_m": length, **mean(chosen)}
        for length in found.settings.reporting.segments
        if (chosen := segments.length == length).any()
    ]
    return {**mean(np.ones(len(segments.start), bool)), "lengths": lengths}


def rows(found: Comparison, which: str = "ate") -> Iterator[dict[str, Any]]:
    """Yield one row per pair (`ate`), two poses of a delta (`rpe`) or path segment (`kitti`)."""
    ref, est, ate, segments = found.pairs.ref, found.moved, found.ate, found.segments
    counted: Any = np.arange(ref.size) if ref.stamps_ns is None else ref.stamps_ns
    tables: list[dict[str, Any]] = []
    if which == "ate":
        tables = [{
            "stamp_ns": counted, **dict(zip(("ref_x", "ref_y", "ref_z"), ref.xyz.T, strict=True)),
            **dict(zip("xyz", est.xyz.T, strict=True)), "path_m": way(ref.xyz), "ate_m": ate.m,
            "ate_deg": None if ate.rad is None else np.degrees(ate.rad),
            "along_m": ate.along, "across_m": ate.across, "up_m": ate.up,
        }]  # fmt: skip
    elif which == "rpe":
        tables = [{
            "stamp_ns": counted[errors.start], "end_ns": counted[errors.end],
            "delta": [str(delta)] * len(errors.start), "m": errors.m,
            "deg": None if errors.rad is None else np.degrees(errors.rad), "distance_m": errors.distance,
        } for delta, errors in found.relative]  # fmt: skip
    elif segments is not None:
        tables = [{
            "stamp_ns": counted[segments.start], "end_ns": counted[segments.end], "length_m": segments.length,
            "percent": 100 * segments.share, "deg_per_m": np.degrees(segments.rad_per_m),
        }]  # fmt: skip
    for columns in tables:
        absent = [None] * len(columns["stamp_ns"])
        cells = [absent if column is None else np.asarray(column).tolist() for column in columns.values()]
        yield from (dict(zip(columns, row, strict=True)) for row in zip(*cells, strict=True))


SHORT = {
    "ate": "ate.m.rmse", "max": "ate.m.max", "deg": "ate.deg.rmse", "along": "ate.along_m.rmse",
    "across": "ate.across_m.rmse", "up": "ate.up_m.rmse", "kitti": "kitti.percent", "scale": "transform.scale",
    "paired": "poses.paired", "offset": "offset_s",
}  # fmt: skip
UNITS = {"": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "deg": 1.0, "rad": 57.29577951308232, "s": 1.0,
         "ms": 0.001, "%": 1.0}  # fmt: skip
SIGNS: dict[str, Callable[..., bool]] = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
_LIMIT = r"([\w:.]+?)\s*(>=|<=|>|<)\s*([-+]?(?:\d++\.?\d*+|\.\d++)(?:e[-+]?\d+)?)\s*([a-z]*|%)"


class Limit(NamedTuple):
    """A number by its name or its path in the JSON, and its limit."""

    text: str
    name: str
    sign: str
    bound: float
    unit: str

    def passed(self, found: dict[str, Any]) -> float | None:
        """Return the number of a comparison if it exceeds the limit, else None.

        Raises ValueInvalid if there is no such number.
        """
        kind, _, delta = self.name.partition(":")
        if kind == "rpe" and delta:
            row = next((row for row in found["rpe"] if row["delta"] == delta), None)
            value = number_at(row, {"%": "percent", "deg": "deg.rmse", "rad": "deg.rmse"}.get(self.unit, "m.rmse"))
        else:
            value = number_at(found, SHORT.get(self.name, self.name))
            if self.name == "paired" and self.unit == "%" and value is not None:
                value = 100.0 * value / max(found["poses"]["possible"], 1)
        if not isinstance(value, int | float):
            raise ValueInvalid(f"{self.text}: {found['est']} has no such number; -f json shows those there are")
        return float(value) if SIGNS[self.sign](value, self.bound) else None


def parse_limits(text: str) -> list[Limit]:
    """Parse limits separated by commas: a name or path, > >= < or <=, a number with its unit.

    Bare numbers are metres, degrees, poses, and percent of KITTI.  Raises ValueInvalid.
    """
    found = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = re.fullmatch(_LIMIT, part)
        if match is None or match[4] not in UNITS:
            raise ValueInvalid(f"{shown(part)} is not a limit; write a name, > or <, and a bound: ate>5cm, paired<90%")
        name = match[1]
        if "." not in name and not name.startswith("rpe:") and name not in SHORT:
            raise ValueInvalid(f"no number is called {shown(name)}{alternatives(name, [*SHORT, 'rpe:10m'], 'numbers')}")
        found.append(Limit(part, name, match[2], float(match[3]) * UNITS[match[4]], match[4]))
    if not found:
        raise ValueInvalid("no limit; write one as ate>5cm")
    return found


def number_at(value: Any, path: str) -> Any:
    """Follow a path of keys and indices into a mapping; None if it ends."""
    for step in path.split("."):
        try:
            value = value[int(step) if isinstance(value, list) else step]
        except (KeyError, IndexError, TypeError, ValueError):
            return None
    return value
