"""The numbers of a comparison as a mapping, as rows, and as limits that are kept or passed."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.fit.metrics import statistics
from frametool.frames.trajectory import way
from frametool.geometry import arrays
from frametool.geometry.floats import half_sincos

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.fit.comparison import Comparison
    from frametool.frames.trajectory import Trajectory
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Array

SQRT8 = 8**0.5


def numbers(found: Comparison) -> dict[str, Any]:
    """Return every setting and number of a comparison; what does not apply is None."""
    pairs, ate = found.pairs, found.ate
    stamps = pairs.ref.stamps_ns
    return {
        "ref": found.names[0],
        "est": found.names[1],
        "settings": _settings(found),
        "poses": {
            "ref": found.sizes[0], "est": found.sizes[1], "possible": pairs.possible, "paired": pairs.ref.size,
            "shared": pairs.shared,
        },
        "ref_duration_s": None if stamps is None else found.ref_duration_ns / 1e9,
        "duration_s": None if stamps is None else int(stamps[-1] - stamps[0]) / 1e9,
        "path_m": {"ref": float(way(pairs.ref.xyz)[-1]), "est": float(way(found.moved.xyz)[-1])},
        "offset_s": found.offset_ns / 1e9,
        "offset_score": found.offset_score,
        "transform": transform_entry(found),
        "ate_by_alignment": found.ate_by_alignment,
        "ate": {
            **_errors(ate.m, ate.rad, evo=found.settings.evo),
            "along_m": _summed(ate.along),
            "across_m": _summed(ate.across),
            "up_m": _summed(ate.up),
            "end_m": float(ate.m[-1]),
        },
        "rpe": [_relative(found, at) for at in range(len(found.relative))],
        "kitti": _kitti(found),
        "hints": found.hints,
    }  # fmt: skip


def worlds(found: Comparison) -> tuple[str, str]:
    """Name the worlds of the reference and of the estimate; what is called alike is `ref` and `est`."""
    ref, est = found.pairs.ref.world, found.pairs.est.world
    return ("ref", "est") if ref == est else (ref, est)


def whole_estimate(found: Comparison) -> Trajectory:
    """Return all of the estimate as it was compared: on the reference's clock, mounted and moved."""
    est = found.est
    if est.stamps_ns is not None:
        est = est._replace(stamps_ns=est.stamps_ns + found.offset_ns)
    return found.fit.moved(est if found.mount is None else est.with_poses(est.poses @ found.mount))


def transform_entry(found: Comparison) -> dict[str, Any]:
    """Return the alignment as an entry of a tree, EST's world in REF's; its scale only where one was fitted."""
    parent, name = worlds(found)
    entry = _pose(found.fit.transform) | ({"scale": found.fit.scale} if found.settings.align == "sim3" else {})
    return {"name": name, "parent": parent, **entry}


def _pose(pose: Transform) -> dict[str, Any]:
    return {"xyz": pose.xyz.tolist(), "quaternion": dict(zip("xyzw", pose.xyzw.tolist(), strict=True))}


def _settings(found: Comparison) -> dict[str, Any]:
    settings, pairs = found.settings, found.pairs
    is_nearest = settings.match == "nearest"
    has_stamps = pairs.ref.stamps_ns is not None
    return {
        "match": settings.match if has_stamps else "number",
        "interpolated": pairs.interpolated,
        "max_gap_s": pairs.max_gap_s,
        "max_diff_s": settings.max_diff_ns / 1e9 if is_nearest and has_stamps else None,
        "min_match": settings.min_match,
        "offset": settings.offset if settings.offset == "auto" else found.offset_ns / 1e9,
        "align": settings.align,
        "align_first": settings.align_first and str(settings.align_first),
        "mount": None if found.mount is None else _pose(found.mount),
        "up": list(settings.up),
        "delta": [str(delta) for delta, _ in found.relative],
        "all_pairs": settings.all_pairs,
        "tolerance": settings.tolerance if settings.all_pairs else None,
        "pairs_from": settings.pairs_from,
        "segments_m": list(settings.segments),
        "segment_step": settings.segment_step,
        "start_s": _limit(settings.start),
        "end_s": _limit(settings.end),
        "as": "evo" if settings.evo else None,
    }


def _limit(limit: tuple[bool, int] | None) -> str | None:
    return None if limit is None else "+" * limit[0] + f"{limit[1] / 1e9:.9f}"


def _summed(values: Array | None) -> dict[str, float] | None:
    return None if values is None else statistics(values)._asdict()


def _errors(m: Array | None, rad: Array | None, *, evo: bool) -> dict[str, Any]:
    """Sum up distances and angles, and as evo does the norm of R - I and of the whole matrix."""
    found = {"m": _summed(m), "deg": None if rad is None else _summed(np.degrees(rad))}
    if evo and m is not None and rad is not None:
        rot = SQRT8 * half_sincos(rad, arrays)[0]
        found |= {"rot": _summed(rot), "full": _summed(np.sqrt(m * m + rot * rot))}
    return found


def _relative(found: Comparison, at: int) -> dict[str, Any]:
    delta, errors = found.relative[at]
    summed = _errors(errors.m, errors.rad, evo=found.settings.evo)
    share = 100 * summed["m"]["rmse"] / delta.amount if summed["m"] and delta.unit == "m" else None
    return {
        "delta": str(delta), "pairs": len(errors.start), **summed, "percent": share,
        "distance_m": _summed(errors.distance),
    }  # fmt: skip


def _kitti(found: Comparison) -> dict[str, Any] | None:
    segments = found.segments
    if segments is None or not len(segments.start):
        return None

    def mean(chosen: Any) -> dict[str, Any]:
        return {
            "segments": int(np.count_nonzero(chosen)),
            "percent": 100 * statistics(segments.share[chosen]).mean,
            "deg_per_m": degrees(statistics(segments.rad_per_m[chosen]).mean),
        }

    lengths = [
        {"length_m": length, **mean(chosen)}
        for length in found.settings.segments
        if (chosen := segments.length == length).any()
    ]
    return {**mean(np.ones(len(segments.start), bool)), "lengths": lengths}


def rows(found: Comparison, which: str = "ate") -> Iterator[dict[str, Any]]:
    """Yield one row for each pair (`ate`), each two poses of a delta (`rpe`) or each stretch of path (`kitti`)."""
    stamps = found.pairs.ref.stamps_ns
    counted = np.arange(found.pairs.ref.size) if stamps is None else stamps
    if which == "ate":
        yield from _rows(_ate_columns(found, counted))
    elif which == "rpe":
        for delta, errors in found.relative:
            yield from _rows({
                "stamp_ns": counted[errors.start], "end_ns": counted[errors.end],
                "delta": [str(delta)] * len(errors.start), "m": errors.m,
                "deg": None if errors.rad is None else np.degrees(errors.rad), "distance_m": errors.distance,
            })  # fmt: skip
    elif found.segments is not None:
        segments = found.segments
        yield from _rows({
            "stamp_ns": counted[segments.start], "end_ns": counted[segments.end], "length_m": segments.length,
            "percent": 100 * segments.share, "deg_per_m": np.degrees(segments.rad_per_m),
        })  # fmt: skip


def _ate_columns(found: Comparison, counted: Any) -> dict[str, Any]:
    ref, est, ate = found.pairs.ref, found.moved, found.ate
    return {
        "stamp_ns": counted, "ref_x": ref.xyz[:, 0], "ref_y": ref.xyz[:, 1], "ref_z": ref.xyz[:, 2],
        "x": est.xyz[:, 0], "y": est.xyz[:, 1], "z": est.xyz[:, 2], "path_m": way(ref.xyz), "ate_m": ate.m,
        "ate_deg": None if ate.rad is None else np.degrees(ate.rad), "along_m": ate.along, "across_m": ate.across,
        "up_m": ate.up,
    }  # fmt: skip


def _rows(columns: dict[str, Any]) -> Iterator[dict[str, Any]]:
    size = len(columns["stamp_ns"])
    cells = [[None] * size if column is None else np.asarray(column).tolist() for column in columns.values()]
    return (dict(zip(columns, row, strict=True)) for row in zip(*cells, strict=True))
