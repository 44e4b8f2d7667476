"""Compare a trajectory with a reference: settings, hints, and the results as a mapping and as rows."""

from __future__ import annotations

from math import degrees, radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.fit import trajectory_errors
from frametool.fit.alignment import ALIGNMENTS, SCALED, Fit, Unaligned, fitted, lever_arm, principal_axes
from frametool.fit.least_squares import require_near
from frametool.fit.pairing import LIMIT_S, Pairs, clock_offset, interval, paired
from frametool.fit.trajectory_errors import Delta, statistics
from frametool.frames.stamps import format_stamp
from frametool.frames.trajectory import Trajectory, way
from frametool.geometry import arrays, earth
from frametool.geometry.floats import half_sincos
from frametool.geometry.place import ENU, Origin
from frametool.geometry.representations import EARTH_FRAMES
from frametool.geometry.transform import Rotation, Transform, in_notebook

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.fit.trajectory_errors import AbsoluteErrors, RelativeErrors, SegmentErrors
    from frametool.geometry import Array

AUTO = "auto"
CLEAR = 0.5  # lowest score of a reliable clock offset
SURE = 0.8  # score above which a clock offset is reported that was not requested
MOST_TRIED = 20_000  # grid points up to which it is estimated without being requested
FEW = 0.5  # share of the possible pairs below which a hint is added
NOTABLE = radians(2.0)  # a common rotation is reported above this, if it is also
STEADY = 5.0  # this many times as large as its spread
NEAR_A_LINE = 3.0  # residuals: positions whose second axis is shorter are on a line, if it is also shorter than
SLENDER = 0.1  # this share of the first axis


class Pairing(NamedTuple):
    """How poses are paired.

    match: "interpolate" or "nearest"
    max_gap_ns, max_diff_ns: longest gap to interpolate over, largest difference of nearest stamps
    min_match: least share of the possible pairs
    offset: nanoseconds by which EST's clock lags; "auto": estimated within offset_limit_s; None: 0, but a hint is added
        if the clocks seem to differ
    start, stop: (True, nanoseconds after the first pair), or (False, a stamp on REF's clock)
    """

    match: str = "interpolate"
    max_gap_ns: float | None = None
    max_diff_ns: float = 10_000_000
    min_match: float = 0.1
    offset: int | str | None = None
    offset_limit_s: float = LIMIT_S
    start: tuple[bool, int] | None = None
    stop: tuple[bool, int] | None = None


class Fitting(NamedTuple):
    """How pairs are aligned.

    align: one of ALIGNMENTS or origin+scale; up: the axis of yaw
    align_first: only the pairs up to this delta are used; tie_first: the first positions are aligned exactly
    mount: pose of REF's body in EST's, or "auto"
    """

    align: str = "se3"
    align_first: Delta | None = None
    tie_first: bool = False
    mount: Transform | str | None = None
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)


class Reporting(NamedTuple):
    """Which errors are computed.

    deltas: of relative errors; None for 1m, 10m and 100m up to the length of the path
    all_pairs, tolerance: from every pose to the one about a delta further, within this share of it, not end to end
    pairs_from: "reference" or "estimate": the path along which deltas are measured
    segments: lengths of KITTI's segments, metres, starting at every segment_step-th pair
    evo: evo's defaults, and its two additional numbers
    """

    deltas: tuple[Delta, ...] | None = None
    all_pairs: bool = False
    tolerance: float = 0.1
    pairs_from: str = "reference"
    segments: tuple[float, ...] = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0)
    segment_step: int = 10
    evo: bool = False


class Settings(NamedTuple):
    """The settings of a comparison."""

    pairing: Pairing = Pairing()
    fitting: Fitting = Fitting()
    reporting: Reporting = Reporting()

    def changed(self, **values: Any) -> Settings:
        """Return settings with new values for some fields of the three groups; other names are ignored."""
        groups: tuple[Any, ...] = self
        own = [{name: values[name] for name in each._fields if name in values} for each in groups]
        return Settings(*(each._replace(**new) for each, new in zip(groups, own, strict=True)))


SETTINGS = tuple(name for group in Settings() for name in group._fields)
EVO = Settings().changed(
    match="nearest", align="none", deltas=(Delta(1.0, "frames"),), pairs_from="estimate", offset=0, evo=True
)
DELTAS = (Delta(1.0, "m"), Delta(10.0, "m"), Delta(100.0, "m"))


class Comparison(NamedTuple):
    """The errors of an estimate relative to its reference.

    names: of reference and estimate, for messages
    ref, est: all poses as read; pairs: the compared ones, each trajectory in its own world
    moved: the aligned poses of the estimate
    ate_by_alignment: the rmse under each of ALIGNMENTS, None if it is not determined
    relative: relative errors for each delta; segments: KITTI's, None without rotations
    hints: warnings
    """

    names: tuple[str, str]
    settings: Settings
    ref: Trajectory
    est: Trajectory
    pairs: Pairs
    moved: Trajectory
    fit: Fit
    ate_by_alignment: dict[str, float | None]
    ate: AbsoluteErrors
    relative: list[tuple[Delta, RelativeErrors]]
    segments: SegmentErrors | None
    hints: list[str]

    def _repr_html_(self) -> str | None:
        """Return the comparison for a notebook, formatted as on a terminal."""
        return in_notebook(self)

    def whole_estimate(self) -> Trajectory:
        """Return the whole estimate as it was compared: on the reference's clock, mounted and aligned."""
        est, mount = self.est if self.settings.reporting.evo else self.est.in_order(), self.pairs.mount
        if est.stamps_ns is not None:
            est = est._replace(stamps_ns=est.stamps_ns + self.pairs.offset_ns)
        return self.fit.moved(est if mount is None else est.with_poses(est.poses @ mount))

    def as_dict(self) -> dict[str, Any]:
        """Return every setting and number, as `frametool compare -f json` prints them; inapplicable ones are None."""
        pairs, ate, (_, fitting, reporting) = self.pairs, self.ate, self.settings
        stamps, (parent, name) = pairs.ref.stamps_ns, worlds(self)
        scale = {"scale": self.fit.scale} if fitting.align in SCALED else {}  # only if a scale was estimated
        relative = []
        for delta, errors in self.relative:
            summed = _errors(errors.m, errors.rad, evo=reporting.evo)
            share = 100 * summed["m"]["rmse"] / delta.amount if summed["m"] and delta.unit == "m" else None
            counted = {"delta": str(delta), "pairs": len(errors.start)}
            relative.append(counted | summed | {"percent": share, "distance_m": statistics(errors.distance)})
        return {
            "ref": self.names[0],
            "est": self.names[1],
            "settings": _settings(self),
            "poses": {
                "ref": self.ref.size, "est": self.est.size, "possible": pairs.possible, "paired": pairs.ref.size,
                "shared": pairs.shared,
            },
            "ref_duration_s": None if stamps is None else int(np.ptp(self.ref.stamps_ns)) / 1e9,
            "duration_s": None if stamps is None else int(stamps[-1] - stamps[0]) / 1e9,
            "path_m": {"ref": float(way(pairs.ref.xyz)[-1]), "est": float(way(self.moved.xyz)[-1])},
            "offset_s": pairs.offset_ns / 1e9,
            "offset_score": pairs.offset_score,
            "transform": {"name": name, "parent": parent, **_pose(self.fit.transform), **scale},
            "ate_by_alignment": self.ate_by_alignment,
            "ate": {
                **_errors(ate.m, ate.rad, evo=reporting.evo), "along_m": statistics(ate.along),
                "across_m": statistics(ate.across), "up_m": statistics(ate.up), "end_m": float(ate.m[-1]),
            },
            "rpe": relative,
            "kitti": _kitti(self),
            "hints": self.hints,
        }  # fmt: skip


def compared(
    ref: Trajectory, est: Trajectory, settings: Settings, names: tuple[str, str] = ("ref", "est")
) -> Comparison:
    """Compare an estimate with its reference.

    Raises ValueInvalid if they have no stamps in common, or a requested quantity is not determined.
    """
    hints: list[str] = []
    pairing, fitting, reporting = settings
    for each, name in zip((ref, est), names, strict=True):
        require_near(each.xyz, name)
    both = ref, est = _in_local_axes((ref, est), names, hints)
    if not reporting.evo:
        hints += [*ref.disorder(names[0]), *est.disorder(names[1])]
        both = ref.in_order(), est.in_order()
    pairs = _mounted(_in_window(_paired(*both, settings, names, hints), pairing), fitting)
    up, first = np.array(fitting.up), pairs
    if (limit := fitting.align_first) is not None:
        along = limit.along(pairs.ref)
        if along is None:
            raise ValueInvalid(f"poses without stamps have no times; the first {limit} is not known")
        is_first = along < limit.amount if limit.unit == "frames" else along <= limit.amount
        first = pairs.at(slice(int(np.count_nonzero(is_first))))
    fit = fitted(fitting.align, first.ref, first.est, up, names, tied=fitting.tie_first)
    moved = fit.moved(pairs.est)
    ate = trajectory_errors.absolute_errors(pairs.ref, moved, up)
    if fitting.mount is None and not reporting.evo:
        _hint_at_rotation(pairs.ref, moved, fitting, hints)
    by_alignment: dict[str, float | None] = {}
    for kind in ALIGNMENTS:
        try:
            gap = fitted(kind, first.ref, first.est, up).moved(pairs.est._replace(xyzw=None)).xyz - pairs.ref.xyz
            by_alignment[kind] = sqrt((gap**2).sum() / len(gap))
        except Unaligned:
            by_alignment[kind] = None
    noise = by_alignment["sim3"]  # the smallest residuals, those of the fit with a scale
    if fitting.align in ("se3", "sim3") and noise is not None:
        long, second, _ = principal_axes(first.ref.xyz)
        if second < min(NEAR_A_LINE * noise, SLENDER * long):
            hints.append("positions lie nearly on a line: the turn about it rests on noise")
    path_of = pairs.ref if reporting.pairs_from == "reference" else moved
    return Comparison(
        names, settings, ref, est, pairs, moved, fit, by_alignment, ate,
        list(_relative(pairs.ref, moved, path_of, reporting, hints)),
        trajectory_errors.segment_errors(pairs.ref, moved, reporting.segments, reporting.segment_step), hints,
    )  # fmt: skip


def _in_local_axes(
    both: tuple[Trajectory, Trajectory], names: tuple[str, str], hints: list[str]
) -> tuple[Trajectory, Trajectory]:
    """Convert trajectories in Earth-centred frames to east, north, up at the first position, so that z is up."""
    on_earth = [each.world in EARTH_FRAMES and each.size > 0 for each in both]
    if not any(on_earth):
        return both
    first = on_earth.index(True)
    origin = Origin()
    origin.settle(*both[first].xyz.T)
    pose = origin.pose(ENU)
    turn = Transform.of(*pose).rotation.inverse()
    lat, lon, alt = origin.place or (0.0, 0.0, 0.0)
    there = f"lat {lat!r}, lon {lon!r}, alt {alt!r}, the first of {names[first]}"
    hints.append(f"compared along east, north, up of {there}")
    found = list(both)
    for at, each in enumerate(both):
        if on_earth[at]:
            xyz = np.stack(earth.seen_from(*pose, *each.xyz.T), -1)
            xyzw = None if each.rotation is None else np.stack((turn @ each.rotation).components, -1)
            found[at] = each._replace(xyz=xyz, xyzw=xyzw, world=ENU)
    return found[0], found[1]


def _paired(ref: Trajectory, est: Trajectory, settings: Settings, names: tuple[str, str], hints: list[str]) -> Pairs:
    """Return the pairs, with the offset of the clocks, and its score if it was estimated."""
    pairing, is_nearest = settings.pairing, settings.pairing.match == "nearest"
    if ref.stamps_ns is None or est.stamps_ns is None:
        if (ref.stamps_ns is None) != (est.stamps_ns is None):
            raise ValueInvalid(f"{names[ref.stamps_ns is not None]} has no stamps; give them with --stamps FILE")
        if pairing.offset:
            raise ValueInvalid("poses that are counted have no clock; leave the offset out")
        return paired(ref, est)
    offset_ns, score = 0, None
    if pairing.offset == AUTO:
        kind = "sim3" if settings.fitting.align in SCALED else "se3"
        by_turning = settings.fitting.mount == AUTO
        found = clock_offset(ref, est, limit_s=pairing.offset_limit_s, kind=kind, by_turning=by_turning)
        if found.score < CLEAR:
            raise ValueInvalid(f"no clear clock offset (score {found.score:.2f}); give one: --offset T")
        offset_ns, score = round(found.seconds * 1e9), found.score
        if found.rival is not None:
            both = f"{found.seconds:.3f} s and {found.rival:.3f} s"
            hints.append(f"the motion repeats: clock offsets of {both} fit about as well; --offset auto:LIMIT or T")
    elif pairing.offset is not None:
        offset_ns = int(pairing.offset)
    shifted = est._replace(stamps_ns=est.stamps_ns + offset_ns)
    pairs = paired(ref, shifted, pairing.max_gap_ns, pairing.max_diff_ns if is_nearest else None)
    share = pairs.ref.size / max(pairs.possible, 1)
    counted = f"{pairs.ref.size} of {pairs.possible} poses have a partner in {names[0]}"
    if not pairs.ref.size or share < pairing.min_match:
        spans = ", ".join(_time_span(each, name) for each, name in zip((ref, shifted), names, strict=True))
        more = f"try --offset auto, {'--max-diff' if is_nearest else '--max-gap'}, --min-match 0"
        raise ValueInvalid(f"{names[1]}: {counted} ({100 * share:.1f} %): {spans}; {more}")
    if share < FEW:
        hints.append(f"{names[1]}: only {counted} ({100 * share:.1f} %)")
    if pairs.shared:
        hints.append(f"{pairs.shared} poses have more than one partner")
    if pairing.offset is None:
        _hint_at_clock(ref, est, names[1], hints)
    return pairs._replace(offset_ns=offset_ns, offset_score=score)


def _time_span(each: Trajectory, name: str) -> str:
    first, last = (format_stamp(int(each.stamps_ns[at]))[:-6] for at in (0, -1))
    return f"{name} {first} .. {last} s"


def _hint_at_clock(ref: Trajectory, est: Trajectory, name: str, hints: list[str]) -> None:
    """Add a hint if the clock offset is clearly larger than half an interval, provided that estimating it is cheap."""
    intervals = [interval(each.stamps_ns) for each in (ref, est)]
    span = max(ref.stamps_ns[-1], est.stamps_ns[-1]) - min(ref.stamps_ns[0], est.stamps_ns[0])
    if span > MOST_TRIED * min(intervals) / 2:
        return
    found = clock_offset(ref, est)
    if abs(found.seconds) * 1e9 > max(intervals) / 2 and found.score > SURE:
        side = "behind" if found.seconds > 0 else "ahead"
        by = f"{abs(found.seconds):.3f} s {side} (score {found.score:.3f})"
        hints.append(f"the clock of {name} seems {by}; --offset auto")


def _in_window(pairs: Pairs, pairing: Pairing) -> Pairs:
    """Return the pairs between `start` and `stop`, both inclusive."""
    if pairing.start is pairing.stop is None:
        return pairs
    stamps = pairs.ref.stamps_ns
    if stamps is None:
        raise ValueInvalid("poses that are counted have no times; leave --start and --stop out")
    begin, end = (
        default if limit is None else limit[1] + limit[0] * int(stamps[0])
        for limit, default in ((pairing.start, stamps[0]), (pairing.stop, stamps[-1]))
    )
    found = pairs.at((begin <= stamps) & (stamps <= end))
    if not found.ref.size:
        window = f"{format_stamp(int(begin))} to {format_stamp(int(end))} s"
        raise ValueInvalid(f"no pair from {window}; there are some in{_time_span(pairs.ref, '')}")
    return found


def _mounted(pairs: Pairs, fitting: Fitting) -> Pairs:
    """Multiply EST's poses by the mount X, est_i X: the poses of REF's body; "auto" estimates X."""
    ref, est, mount = pairs.ref, pairs.est, fitting.mount
    if mount is None:
        return pairs
    if est.rotation is None:
        raise ValueInvalid("a mount needs rotations of the estimate")
    if isinstance(mount, str):  # "auto": the lever arm from the fit, and a rotation common to all pairs
        up, shared = np.array(fitting.up), None
        arm = lever_arm(fitting.align, ref, est, up)
        shifted = est.with_poses(est.poses @ Transform(Rotation.identity(), arm))
        placed = fitted(fitting.align, ref, shifted, up).moved(shifted)
        if ref.rotation is not None and placed.rotation is not None:
            shared = _common_rotation(placed.rotation.inverse() @ ref.rotation)
        mount = Transform(Rotation.identity() if shared is None else shared, arm)
    return pairs._replace(est=est.with_poses(est.poses @ mount), mount=mount)


def _spread(rotations: Rotation) -> float:
    """Return the rms angle of rotations from their mean."""
    return sqrt((rotations.distance(rotations.mean()) ** 2).mean())


def _hint_at_rotation(ref: Trajectory, moved: Trajectory, fitting: Fitting, hints: list[str]) -> None:
    """Add a hint if there is a constant rotation between the bodies, or between worlds that were not aligned."""
    if ref.rotation is None or moved.rotation is None:
        return
    of_bodies, of_worlds = moved.rotation.inverse() @ ref.rotation, moved.rotation @ ref.rotation.inverse()
    is_of_worlds = fitting.align == "none" and _spread(of_worlds) < _spread(of_bodies)
    shared = _common_rotation(of_worlds if is_of_worlds else of_bodies)
    if shared is None:
        return
    apart = f"{np.degrees(float(shared.angle())):.1f} deg apart"
    rpy = ", ".join(f"{number:.4g}" for number in np.degrees(shared.as_rpy()))
    hints.append(
        f"the worlds are {apart}; --align se3" if is_of_worlds
        else f"the bodies are {apart}; --mount '{{rpy_deg: [{rpy}]}}'"
    )  # fmt: skip


def _common_rotation(rotations: Rotation) -> Rotation | None:
    """Return the mean of rotations if it is large, and large relative to their spread; else None."""
    mean = rotations.mean()
    return mean if float(mean.angle()) > max(NOTABLE, STEADY * _spread(rotations)) else None


def _relative(
    ref: Trajectory, est: Trajectory, path_of: Trajectory, reporting: Reporting, hints: list[str]
) -> Iterator[tuple[Delta, RelativeErrors]]:
    """Yield the relative errors of every delta that the path is long enough for."""
    for delta in reporting.deltas or DELTAS:
        along = delta.along(path_of)
        if along is None:
            why = "there are no rotations" if delta.unit == "deg" else "there are no stamps"
        elif along[-1] + delta.amount * (1 - trajectory_errors.ROUNDING) == along[-1]:
            why = f"the delta is lost in rounding: the path is {along[-1]:g} {delta.unit} long"
            if reporting.deltas:
                raise ValueInvalid(f"rpe {delta}: {why}")
        else:
            ends = trajectory_errors.chained(along, delta.amount)
            if reporting.all_pairs:
                ends = trajectory_errors.all_pairs(along, delta.amount, reporting.tolerance * (delta.unit != "frames"))
            why = "" if len(ends[0]) else "no two poses are so far apart"
        if not why:
            yield delta, trajectory_errors.relative_errors(ref, est, *ends)
        elif reporting.deltas:
            hints.append(f"rpe {delta} is left out: {why}")


# --- the numbers of a comparison ---

SQRT8 = 8**0.5


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
    """Return the statistics of distances and angles; with `evo` also of the norms of R - I and of the whole matrix."""
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
    """Yield one row per pair (`ate`), per two poses a delta apart (`rpe`), or per path segment (`kitti`)."""
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
