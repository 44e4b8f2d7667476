"""Many lookups at once: the samples of each edge as arrays, evaluated at sorted times, block by block.

Imports numpy; the buffer imports this module on demand.
"""

from __future__ import annotations

import itertools
from operator import methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid, shown
from frametool.geometry import arrays, quaternion, rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:

    from numpy.typing import NDArray

    from frametool.frames.lookups import Frames
    from frametool.frames.path import Query
    from frametool.frames.track import MovingTrack
    from frametool.geometry.types import Rigid

    Stamps = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Way = tuple[tuple[str, ...], tuple[str, ...]]

SHARED = 4  # times per sample


def lookup_many(frames: Frames, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
    """Return target_from_source at each of many times; see `Frames.lookup_many`."""
    if missing not in ("raise", "nan"):
        raise ValueInvalid(f"missing is 'raise' or 'nan', found {shown(missing)}")
    times = as_stamps(at_ns)
    flat = times.reshape(-1)
    order = None if bool(np.all(flat[1:] >= flat[:-1])) else np.argsort(flat)
    out = np.empty((7, flat.size))
    _fill_sorted(out, frames, target, source, flat if order is None else flat[order])
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


def _fill_sorted(out: Floats, frames: Frames, target: str, source: str, times: Stamps) -> None:
    """Compute sorted times, in intervals in which no parent changes."""
    frames.require(target, source)
    if times.size:
        frames.way_at(target, source, int(times[0]))  # detects a cycle of newest parents
    changes = frames.changes()
    if not changes:
        _fill(out, frames.query(target, source, None), times)
        return
    cuts = [0, *np.searchsorted(times, changes).tolist(), times.size]
    for way, parts in _stretches(frames, target, source, times, cuts).items():
        at = np.concatenate([np.arange(begin, end) for begin, end in parts])
        piece = np.full((7, at.size), np.nan)
        if way is not None:
            _fill(piece, frames.query_of(*way), times[at])
        out[:, at] = piece


def _stretches(
    frames: Frames, target: str, source: str, times: Stamps, cuts: list[int]
) -> dict[Way | None, list[tuple[int, int]]]:
    """Return the intervals between cuts that contain times, grouped by the path that is valid in each, or None."""
    stretches: dict[Way | None, list[tuple[int, int]]] = {}
    for begin, end in itertools.pairwise(cuts):
        if begin < end:
            found = frames.way_at(target, source, int(times[begin]))
            way = None if found is None else (tuple(found[0]), tuple(found[1]))
            stretches.setdefault(way, []).append((begin, end))
    return stretches


def _fill(out: Floats, query: Query, times: Stamps) -> None:
    """Compute one interval block by block; NaN where an edge has no data."""
    if query.span is None:
        out[:] = np.array(query.fixed)[:, None]
        return
    begin, end = int(np.searchsorted(times, query.span[0])), int(np.searchsorted(times, query.span[1], "right"))
    out[:, :begin] = np.nan
    out[:, max(begin, end) :] = np.nan
    inside = out[:, begin:end]
    for start, stop in arrays.blocks(max(end - begin, 0)):
        for row, column in zip(inside, _joined(query, times[begin + start : begin + stop]), strict=True):
            row[start:stop] = column


def _joined(query: Query, times: Stamps) -> Rigid:
    """Return target_from_source at sorted times covered by every edge's samples."""
    found = query.compose(lambda track: track.at_many(times))
    assert found is not None  # noqa: S101 - all times are covered
    return *found[:3], *quaternion.unit(*found[3:], arrays)


def carried_many(frames: Frames, target: str, source: str, at_ns: Any, poses: Rigid) -> Floats:
    """Return the covariance of target_from_source, 36 columns, at times whose poses were looked up; NaN as these."""
    times = as_stamps(at_ns)
    there = np.flatnonzero(~np.isnan(poses[6]))
    order = there[np.argsort(times[there], kind="stable")]
    found = np.full((times.size, 36), np.nan)
    for rows in np.split(order, np.searchsorted(times[order], frames.changes())):
        for start, stop in arrays.blocks(rows.size):
            at = times[rows[start:stop]]
            entries = frames.covariance_along(target, source, int(at[0]), methodcaller("at_many", at))
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
        stamps, columns = self._spread(times)
        arguments: tuple[Any, ...] = (*columns[:15], (times - stamps) * columns[15], arrays)
        return rigid.along(*arguments)

    def _spread(self, times: Stamps) -> tuple[Stamps, Floats]:
        """Return for each time the stamp and the columns of the newest sample that is not after it.

        Repeating is several times faster than indexing if many times share a sample.
        """
        low = int(np.searchsorted(self.stamps, times[0], "right")) - 1
        high = int(np.searchsorted(self.stamps, times[-1], "right"))
        if (high - low) * SHARED > times.size:
            at = np.searchsorted(self.stamps, times, "right") - 1
            return self.stamps.take(at), self.columns.take(at, axis=1)
        counts = np.diff(np.searchsorted(times, self.stamps[low + 1 : high]), prepend=0, append=times.size)
        return self.stamps[low:high].repeat(counts), self.columns[:, low:high].repeat(counts, axis=1)
