"""Compare trajectories and solve for transforms in Python: files, transforms or arrays in, numbers and arrays out."""

from __future__ import annotations

from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, alternatives, warn
from frametool.fit.alignment import resampled, stamps_at_rate, stamps_every
from frametool.fit.comparison import AUTO, EVO, SETTINGS, Comparison, Settings, parse_delta
from frametool.fit.comparison import compare as compared
from frametool.fit.measured_tree import TreeSolution, solve_tree
from frametool.fit.numbers import whole_estimate
from frametool.formats.load import FrameFile, load
from frametool.frames.lookups import FrameTree, taken
from frametool.frames.trajectory import Trajectory
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.stream.measurements import Measurement, read_measurements
from frametool.stream.trajectories import load_trajectory

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TypeAlias

    Given: TypeAlias = Trajectory | str | PathLike[str]
    Measured: TypeAlias = str | PathLike[str] | Iterable[tuple[str, str, Transform] | tuple[str, str, Transform, Any]]

BILLION = 1_000_000_000


class Alignment(NamedTuple):
    """The estimate's world in the reference's, p' = scale R p + t; moved is the whole aligned estimate."""

    transform: Transform
    scale: float
    offset_s: float
    moved: Trajectory


def compare(
    ref: Given, est: Given, *, offset: float | str | None = None, align: str | None = None,
    mount: Transform | str | None = None, deltas: Iterable[str] | None = None, like: str | None = None, **more: Any,
) -> Comparison:  # fmt: skip
    """Compare a trajectory with a reference.

    ref, est: a Trajectory, or the path of a file as for `load_trajectory`
    offset: seconds by which est's clock lags, or "auto"; align: se3, sim3, yaw, origin or none
    mount: pose of the reference sensor in est's body, or "auto"; deltas: as "1m", "10frames", "1s", "5deg"; like: "evo"
    more: other fields of the groups of `frametool.fit.comparison.Settings`; align_first as "10s", times in nanoseconds
    Raises ValueInvalid if the two have no stamps in common, or a fit is not determined; FormatError.
    """
    if like not in (None, "evo"):
        raise ValueInvalid(f"like {like!r}: only evo is known")
    argument = {"align": align, "mount": mount, **more}
    if unknown := [name for name in argument if name not in SETTINGS]:
        raise TypeError(f"compare has no {unknown[0]!r}{alternatives(unknown[0], SETTINGS, 'settings')}")
    if offset is not None:
        argument["offset"] = AUTO if offset == AUTO else round(float(offset) * BILLION)
    if deltas is not None:
        argument["deltas"] = tuple(map(parse_delta, deltas))
    if isinstance(first := argument.get("align_first"), str):
        argument["align_first"] = parse_delta(first, ("m", "s", "frames"))
    chosen = {name: value for name, value in argument.items() if value is not None}
    base = EVO if like else Settings()
    names = [name if isinstance(each, Trajectory) else fspath(each) for each, name in ((ref, "ref"), (est, "est"))]
    return compared(_taken(ref, "ref"), _taken(est, "est"), base.changed(**chosen), (names[0], names[1]))


def align(ref: Given, est: Given, **settings: Any) -> Alignment:
    """Align a trajectory with a reference; settings as for `compare`."""
    found = compare(ref, est, **settings)
    return Alignment(found.fit.transform, found.fit.scale, found.offset_ns / BILLION, whole_estimate(found))


def resample(
    trajectory: Given, *, rate: float | None = None, at: Sequence[int] | None = None, every: str | None = None,
    max_gap_ns: float | None = None,
) -> Trajectory:  # fmt: skip
    """Interpolate a trajectory: `rate` poses per second, `at` stamps in nanoseconds, or `every` "1m" or "5deg".

    Times beyond its ends, or in gaps longer than max_gap_ns (default: 3 median intervals), have no pose.
    """
    argument = _taken(trajectory, "trajectory")
    for hint in argument.disorder("trajectory"):
        warn(hint)
    argument = argument.in_order()
    if sum(each is not None for each in (rate, at, every)) != 1:
        raise ValueInvalid("give one of rate, at and every")
    if argument.stamps_ns is None:
        raise ValueInvalid("a trajectory without stamps is not resampled")
    if rate is not None:
        stamps = stamps_at_rate(argument, rate)
    else:
        stamps = np.asarray(at, np.int64) if every is None else stamps_every(argument, parse_delta(every, ("m", "deg")))
    return resampled(argument, stamps, max_gap_ns)


def solve(
    measurements: Measured, *, root: str | None = None, fix: Iterable[FrameTree | str | PathLike[str]] = (),
    robust: bool = True,
) -> TreeSolution:  # fmt: skip
    """Estimate the tree that fits measurements; outliers are rejected.

    measurements: (parent, child, transform) or (parent, child, transform, covariance), the covariance as 36 numbers or
        (6, 6); or the path of a file as for `frametool solve`
    root: the frame in which the others are expressed; fix: trees, or paths of them, that are exact
    Returns .tree, .covariance(target, source), .residuals (n, 6), .u, .used, .fits, .checked and more.
    Raises ValueInvalid if frames are not connected or an outlier cannot be identified; FormatError.
    """
    trees = [each if isinstance(each, FrameTree) else load(each) for each in fix]
    if moving := next((each for each in trees if each.moves), None):
        raise ValueInvalid(f"{moving.name} moves; fixed frames must be static")
    fixed = FrameTree("the fixed frames")
    for tree in trees:
        for track in tree.tracks():
            own = Transform.of(*track.components), tree.covariances.get(track.child)
            fixed.add(track.parent, track.child, *own)
    if isinstance(measurements, str | PathLike):
        rows = read_measurements([FrameFile(measurements)])
    else:
        rows = [_measurement(each, f"measurement {number}") for number, each in enumerate(measurements, 1)]
    return solve_tree(rows, root=root, fixed=fixed, robust=robust)


def _measurement(argument: Any, place: str) -> Measurement:
    """Check one measurement passed from Python; raises ValueInvalid that names it."""
    if isinstance(argument, Measurement):
        return argument
    if not (isinstance(argument, tuple | list) and len(argument) in (3, 4) and isinstance(argument[2], Transform)):
        raise ValueInvalid(f"{place}: expected (parent, child, Transform) or with a covariance behind")
    parent, child, transform = argument[:3]
    if wrong := [name for name in (parent, child) if not (isinstance(name, str) and name)]:
        raise ValueInvalid(f"{place}: a frame is named by a text, found {wrong[0]!r}")
    if transform.shape:
        raise ValueInvalid(f"{place}: expected one transform, got shape {transform.shape}")
    try:
        return Measurement(parent, child, transform.components, taken(argument[3] if len(argument) > 3 else None))
    except ValueInvalid as error:
        raise ValueInvalid(f"{place}: {error}") from None


def _taken(argument: Given, name: str) -> Trajectory:
    """Read a path; check and convert the arrays of a trajectory."""
    if not isinstance(argument, Trajectory):
        return load_trajectory(argument)
    xyz = np.asarray(argument.xyz, np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or not len(xyz) or not np.isfinite(xyz).all():
        raise ValueInvalid(f"{name}.xyz: finite positions of shape (n, 3) are wanted, found shape {xyz.shape}")
    xyzw = None if argument.xyzw is None else np.stack(Rotation.from_quaternion(argument.xyzw).components, -1)
    stamps = None if argument.stamps_ns is None else np.asarray(argument.stamps_ns)
    for field, values in (("xyzw", xyzw), ("stamps_ns", stamps)):
        if values is not None and len(values) != len(xyz):
            raise ValueInvalid(f"{name}.{field}: {len(values)} rows for {len(xyz)} positions")
    if stamps is not None and stamps.dtype.kind not in "iu":
        raise ValueInvalid(f"{name}.stamps_ns: integer nanoseconds are wanted, found {stamps.dtype}")
    return argument._replace(xyz=xyz, xyzw=xyzw, stamps_ns=None if stamps is None else stamps.astype(np.int64))
