"""Comparing trajectories from Python: paths or arrays in, numbers and arrays out."""

from __future__ import annotations

from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, alternatives
from frametool.fit.comparison import AUTO, EVO, Delta, Settings, parse_delta
from frametool.fit.comparison import compare as compared
from frametool.fit.numbers import whole_estimate
from frametool.fit.resampling import resampled, stamps_at_rate, stamps_every
from frametool.frames.trajectory import Trajectory
from frametool.geometry.rotation import Rotation
from frametool.stream.trajectories import load_trajectory

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TypeAlias

    from frametool.fit.comparison import Comparison
    from frametool.geometry.transform import Transform

    Given: TypeAlias = Trajectory | str | PathLike[str]

BILLION = 1_000_000_000


class Alignment(NamedTuple):
    """Where an estimate's world is in the reference's, p' = scale R p + t; moved is all of the estimate there."""

    transform: Transform
    scale: float
    offset_s: float
    moved: Trajectory


def compare(
    ref: Given,
    est: Given,
    *,
    offset: float | str | None = None,
    align: str | None = None,
    mount: Transform | str | None = None,
    deltas: Iterable[str] | None = None,
    like: str | None = None,
    **more: Any,
) -> Comparison:
    """Compare a trajectory with a reference.

    ref, est: a Trajectory, or the path of a file as `load_trajectory` takes it
    offset: seconds that est's clock is behind, or "auto"; align: se3, sim3, yaw, origin or none
    mount: ref's body in est's, or "auto"; deltas: as "1m", "10frames", "1s", "5deg"; like: "evo" for its ways
    more: other fields of `frametool.fit.comparison.Settings`; align_first as "10s", times in nanoseconds
    Raises ValueInvalid where the two have no stamps in common, or a fit is not determined; FormatError.
    """
    if like not in (None, "evo"):
        raise ValueInvalid(f"like {like!r}: only evo is known")
    given = {"align": align, "mount": mount, **more}
    if unknown := [name for name in given if name not in Settings._fields]:
        raise TypeError(f"compare has no {unknown[0]!r}{alternatives(unknown[0], Settings._fields, 'settings')}")
    if offset is not None:
        given["offset"] = AUTO if offset == AUTO else round(float(offset) * BILLION)
    if deltas is not None:
        given["deltas"] = tuple(map(parse_delta, deltas))
    if isinstance(first := given.get("align_first"), str):
        given["align_first"] = parse_delta(first, ("m", "s", "frames"))
    elif isinstance(first, int):
        given["align_first"] = Delta(float(first), "frames")
    chosen = {name: value for name, value in given.items() if value is not None}
    base = EVO if like else Settings()
    names = _name(ref, "ref"), _name(est, "est")
    return compared(_taken(ref, "ref"), _taken(est, "est"), base._replace(**chosen), names)


def align(ref: Given, est: Given, **settings: Any) -> Alignment:
    """Fit a trajectory to a reference; settings as those of `compare`."""
    found = compare(ref, est, **settings)
    return Alignment(found.fit.transform, found.fit.scale, found.offset_ns / BILLION, whole_estimate(found))


def resample(
    trajectory: Given,
    *,
    rate: float | None = None,
    at: Sequence[int] | None = None,
    every: str | None = None,
    max_gap_ns: float | None = None,
) -> Trajectory:
    """Interpolate a trajectory: `rate` poses a second, `at` stamps in nanoseconds, or `every` "1m" or "5deg".

    Moments beyond its ends, or between poses more than a gap apart (3 median intervals if none is said), have none.
    """
    given = _taken(trajectory, "trajectory").in_order()
    if sum(each is not None for each in (rate, at, every)) != 1:
        raise ValueInvalid("give one of rate, at and every")
    if given.stamps_ns is None:
        raise ValueInvalid("a trajectory without stamps is not resampled")
    if rate is not None:
        stamps = stamps_at_rate(given, rate)
    else:
        stamps = np.asarray(at, np.int64) if every is None else stamps_every(given, parse_delta(every, ("m", "deg")))
    return resampled(given, stamps, max_gap_ns)


def _name(given: Given, otherwise: str) -> str:
    return otherwise if isinstance(given, Trajectory) else fspath(given)


def _taken(given: Given, name: str) -> Trajectory:
    """Read a path; check and convert the arrays of a trajectory."""
    if not isinstance(given, Trajectory):
        return load_trajectory(given)
    xyz = np.asarray(given.xyz, np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or not len(xyz) or not np.isfinite(xyz).all():
        raise ValueInvalid(f"{name}.xyz: finite positions of shape (n, 3) are wanted, found shape {xyz.shape}")
    xyzw = None if given.xyzw is None else np.stack(Rotation.from_quaternion(given.xyzw).components, -1)
    stamps = None if given.stamps_ns is None else np.asarray(given.stamps_ns)
    for field, values in (("xyzw", xyzw), ("stamps_ns", stamps)):
        if values is not None and len(values) != len(xyz):
            raise ValueInvalid(f"{name}.{field}: {len(values)} rows for {len(xyz)} positions")
    if stamps is not None and stamps.dtype.kind not in "iu":
        raise ValueInvalid(f"{name}.stamps_ns: integer nanoseconds are wanted, found {stamps.dtype}")
    return given._replace(xyz=xyz, xyzw=xyzw, stamps_ns=None if stamps is None else stamps.astype(np.int64))
