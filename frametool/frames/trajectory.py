"""Many poses at once: trajectories, and lookups at many times with the samples of each edge as arrays.

Imports numpy; trees and buffers import this module on demand.
"""

from __future__ import annotations

import itertools
from operator import methodcaller
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid, shown
from frametool.geometry import arrays, quaternion, rigid
from frametool.geometry.transform import Rotation, Transform, in_notebook

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from frametool.frames.lookups import Frames
    from frametool.frames.topology import FramePath, Query
    from frametool.frames.track import MovingTrack
    from frametool.geometry import Array, Rigid

    Stamps = NDArray[np.int64]
    Floats = NDArray[np.float64]

WORLD, BODY = "world", "body"  # default names


class Trajectory(NamedTuple):
    """Poses of `body` in `world`, or only its positions.

    stamps_ns: integers of shape (n,), or None if poses are only numbered; xyz: (n, 3), metres
    xyzw: unit quaternions (n, 4), or None if there are only positions
    lines: line numbers in the file, from 1; None if unknown
    """

    stamps_ns: Any
    xyz: Any
    xyzw: Any = None
    world: str = WORLD
    body: str = BODY
    lines: Any = None

    def _repr_html_(self) -> str | None:
        """Show it in a notebook as a terminal does."""
        return in_notebook(self)

    @property
    def size(self) -> int:
        """The number of poses."""
        return len(self.xyz)

    @property
    def rotation(self) -> Rotation | None:
        """The rotations, if there are any."""
        return None if self.xyzw is None else Rotation.of(*columns(self.xyzw))

    @property
    def poses(self) -> Transform:
        """The poses; raises ValueInvalid if there are only positions."""
        if self.xyzw is None:
            raise ValueInvalid("positions alone are not poses: rotations are needed here")
        return Transform.of(*columns(self.xyz), *columns(self.xyzw))

    def with_poses(self, poses: Transform) -> Trajectory:
        """Return the trajectory with other poses."""
        return self._replace(xyz=np.stack(poses.components[:3], -1), xyzw=np.stack(poses.components[3:], -1))

    def at(self, index: Any) -> Trajectory:
        """Select poses as numpy does."""
        stamps = None if self.stamps_ns is None else self.stamps_ns[index]
        turns, lines = (None if each is None else each[index] for each in (self.xyzw, self.lines))
        return self._replace(stamps_ns=stamps, xyz=self.xyz[index], xyzw=turns, lines=lines)

    def numbered(self) -> Trajectory:
        """Return the trajectory with the indices of its poses as seconds."""
        return self._replace(stamps_ns=np.arange(self.size, dtype=np.int64) * 1_000_000_000)

    def disorder(self, name: str) -> list[str]:
        """Return a sentence for each change that `in_order` makes; name: that of the trajectory."""
        stamps = np.array([], np.int64) if self.stamps_ns is None else self.stamps_ns
        doubled = int((np.diff(np.sort(stamps)) == 0).sum())
        said = [f"{name}: stamps are out of order; sorted"] * bool((np.diff(stamps) < 0).any())
        have = "pose has" if doubled == 1 else "poses have"
        return said + [f"{name}: {doubled} {have} the stamp of another; the last counts"] * bool(doubled)

    def in_order(self) -> Trajectory:
        """Return the trajectory sorted by its stamps; the last of equal stamps counts."""
        if self.stamps_ns is None or not np.any(np.diff(self.stamps_ns) <= 0):
            return self
        order = np.argsort(self.stamps_ns, kind="stable")
        last = np.append(np.diff(self.stamps_ns[order]) > 0, True)
        return self.at(order[last])


def columns(rows: Array) -> list[Array]:
    """Return the columns of rows, each of them contiguous."""
    return list(np.ascontiguousarray(np.asarray(rows, np.float64).T))


def way(xyz: Array) -> Array:
    """Return the path length in metres up to each position."""
    x, y, z = np.diff(xyz, axis=0).T
    return np.append(0.0, np.cumsum(quaternion.magnitude(x, y, z, arrays)))


# --- lookups at many times ---


SHARED = 4  # times per sample from which on repeating samples is faster than indexing


def lookup_many(frames: Frames, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
    """Return target_from_source at each of many times; see `Frames.lookup_many`."""
    if missing not in ("raise", "nan"):
        raise ValueInvalid(f"missing is 'raise' or 'nan', found {shown(missing)}")
    times = as_stamps(at_ns)
    flat = times.reshape(-1)
    order = None if bool(np.all(flat[1:] >= flat[:-1])) else np.argsort(flat)
    out = np.empty((7, flat.size))
    ordered = flat if order is None else flat[order]
    frames.require(target, source)
    if flat.size:
        frames.path_at(target, source, int(ordered[0]))  # detects a cycle of newest parents
    if changes := frames.changes():  # intervals in which no parent changes, grouped by the path valid in each
        stretches: dict[FramePath | None, list[Any]] = {}
        for begin, end in itertools.pairwise([0, *np.searchsorted(ordered, changes).tolist(), flat.size]):
            if begin < end:
                path = frames.path_at(target, source, int(ordered[begin]))
                stretches.setdefault(path, []).append(np.arange(begin, end))
        for path, parts in stretches.items():
            at = np.concatenate(parts)
            piece = np.full((7, at.size), np.nan)
            if path is not None:
                _fill(piece, frames.query(target, source, int(ordered[at[0]])), ordered[at])
            out[:, at] = piece
    else:
        _fill(out, frames.query(target, source, None), ordered)
    if order is not None:
        for column in out:
            column[order] = column.copy()
    if missing == "raise" and np.isnan(out[6]).any():
        frames.lookup(target, source, int(flat[np.isnan(out[6]).argmax()]))  # raises, with the reason
    if not times.shape:
        return Transform.of(*out[:, 0].tolist())
    return Transform.of(*out.reshape(7, *times.shape))


def as_stamps(at_ns: Any) -> Stamps:
    """Return times as int64 nanoseconds; floats are refused: seconds since 1970 in a float have no nanoseconds."""
    try:
        times = np.asarray(at_ns)
        if times.size and times.dtype.kind not in "iu":
            raise ValueInvalid(f"times are integer nanoseconds, found {times.dtype}")
        return times.astype(np.int64, copy=False)
    except OverflowError:
        raise ValueInvalid("a time is beyond 64 bits of nanoseconds") from None


def _fill(out: Floats, query: Query, times: Stamps) -> None:
    """Fill `out` (7, n) with the poses of a query at sorted times, block by block; NaN where an edge has no data."""
    if query.span is None:
        out[:] = np.array(query.fixed)[:, None]
        return
    begin, end = int(np.searchsorted(times, query.span[0])), int(np.searchsorted(times, query.span[1], "right"))
    out[:, :begin] = np.nan
    out[:, max(begin, end) :] = np.nan
    inside = out[:, begin:end]
    for start, stop in arrays.blocks(max(end - begin, 0)):
        block = times[begin + start : begin + stop]
        with np.errstate(all="ignore"):  # results that overflow are not finite, and refused by their users
            found = query.compose(methodcaller("at_many", block))
        assert found is not None  # noqa: S101 - all times are covered
        for row, column in zip(inside, (*found[:3], *quaternion.unit(*found[3:], arrays)), strict=True):
            row[start:stop] = column


def carried_many(frames: Frames, target: str, source: str, at_ns: Any, poses: Rigid) -> Floats:
    """Return the covariance of target_from_source at many times, (n, 36); NaN where `poses` are NaN.

    poses: the results of lookups at these times
    """
    times = as_stamps(at_ns)
    there = np.flatnonzero(~np.isnan(poses[6]))
    order = there[np.argsort(times[there], kind="stable")]
    found = np.full((times.size, 36), np.nan)
    for rows in np.split(order, np.searchsorted(times[order], frames.changes())):
        for start, stop in arrays.blocks(rows.size):
            at = times[rows[start:stop]]
            entries = frames.carried(target, source, int(at[0]), methodcaller("at_many", at))
            for column, entry in enumerate(entries):
                found[rows[start:stop], column] = entry
    return found


class TrackTable:
    """The samples of a track as columns, each with the prepared segment to the next and its duration."""

    def __init__(self, track: MovingTrack) -> None:
        """Prepare every segment; there is none after the last sample, nor before a change of parent."""
        stamps, parents, samples = zip(*track.walk(), strict=True)
        self.stamps = np.array(stamps, dtype=np.int64)
        here: Any = np.array(samples).T
        following = np.append(np.arange(1, self.stamps.size), self.stamps.size - 1)
        if track.varies:
            under = np.array(parents, dtype=object)
            following = np.where(under[following] == under, following, np.arange(self.stamps.size))
        ways = arrays.run(rigid.prepare, 8, (*here, *here[:, following]), arrays)
        step = np.append(np.diff(self.stamps), 1)
        self.columns = np.array((*here, *ways, 1.0 / np.maximum(step, 1)))

    def at(self, times: Stamps) -> Rigid:
        """Return the poses at sorted times, all within the samples."""
        low = int(np.searchsorted(self.stamps, times[0], "right")) - 1
        high = int(np.searchsorted(self.stamps, times[-1], "right"))
        if (high - low) * SHARED > times.size:
            at = np.searchsorted(self.stamps, times, "right") - 1
            stamps, columns = self.stamps.take(at), self.columns.take(at, axis=1)
        else:  # many times share a sample: repeating is several times faster than indexing
            counts = np.diff(np.searchsorted(times, self.stamps[low + 1 : high]), prepend=0, append=times.size)
            stamps, columns = self.stamps[low:high].repeat(counts), self.columns[:, low:high].repeat(counts, axis=1)
        arguments: tuple[Any, ...] = (*columns[:15], (times - stamps) * columns[15], arrays)
        return rigid.along(*arguments)
