"""Many lookups at once: the samples of each edge as arrays, walked at sorted times, block by block.

Needs numpy at import; the buffer imports it when it is asked.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import NoDataAt, NotConnected, ValueInvalid
from frametool.frames.query import IDENTITY
from frametool.frames.track import Track
from frametool.geometry import arrays, quaternion, rigid, segment
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.query import Piece, Plan
    from frametool.frames.tree import FrameTree

    Stamps = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Columns = tuple[Any, ...]
    Way = tuple[tuple[str, ...], tuple[str, ...]]


SHARED = 4  # times a sample


def lookup_many(buffer: TransformBuffer, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
    """Return target_from_source at each of many times; see TransformBuffer.lookup_many."""
    _check_missing(missing)
    times = as_stamps(at_ns)
    flat = times.reshape(-1)
    order = None if bool(np.all(flat[1:] >= flat[:-1])) else np.argsort(flat)
    out = np.empty((7, flat.size))
    _fill_sorted(out, buffer, target, source, flat if order is None else flat[order])
    if order is not None:
        out = _put_back(out, order)
    if missing == "raise" and np.isnan(out[6]).any():
        buffer.lookup(target, source, int(flat[np.isnan(out[6]).argmax()]))  # raises, with the reason
    if not times.shape:
        return Transform.of(*out[:, 0].tolist())
    return Transform.of(*out.reshape(7, *times.shape))


def lookup_still(tree: FrameTree, target: str, source: str, at_ns: Any, *, missing: str = "raise") -> Transform:
    """Return the one answer of a standing tree for each of many times."""
    _check_missing(missing)
    times = as_stamps(at_ns)
    return Transform.of(*(np.full(times.shape, value) for value in tree.lookup(target, source).components))


def _check_missing(missing: str) -> None:
    if missing not in ("raise", "nan"):
        raise ValueInvalid(f"missing is 'raise' or 'nan', found {missing!r}")


def as_stamps(at_ns: Any) -> Stamps:
    """Take times for int64 nanoseconds; floats are refused, because seconds of today in one have no nanoseconds."""
    try:
        times = np.asarray(at_ns)
        if times.size and times.dtype.kind not in "iu":
            raise ValueInvalid(f"times are integer nanoseconds, found {times.dtype}")
        return times.astype(np.int64, copy=False)
    except OverflowError:
        raise ValueInvalid("a time is beyond 64 bits of nanoseconds") from None


def _put_back(out: Floats, order: NDArray[np.intp]) -> Floats:
    """Return columns in the order before sorting."""
    back = np.empty_like(out)
    for given, in_order in zip(back, out, strict=True):
        given[order] = in_order
    return back


def _fill_sorted(out: Floats, buffer: TransformBuffer, target: str, source: str, times: Stamps) -> None:
    """Compute sorted times, in stretches on which no parent changes."""
    buffer.require(target, source)
    if times.size:
        _way_at(buffer, target, source, int(times[0]))  # finds out whether newest parents form a circle
    edges = buffer.changes()
    if not edges:
        _fill(out, buffer.plan(target, source, None), times)
        return
    cuts = [0, *np.searchsorted(times, edges).tolist(), times.size]
    for way, parts in _stretches(buffer, target, source, times, cuts).items():
        at = np.concatenate([np.arange(begin, end) for begin, end in parts])
        piece = np.empty((7, at.size))
        _fill(piece, None if way is None else buffer.plan_of(*way), times[at])
        out[:, at] = piece


def _stretches(
    buffer: TransformBuffer, target: str, source: str, times: Stamps, cuts: list[int]
) -> dict[Way | None, list[tuple[int, int]]]:
    """Return the stretches between cuts that have any times, by the way that holds in each, or None."""
    stretches: dict[Way | None, list[tuple[int, int]]] = {}
    for begin, end in itertools.pairwise(cuts):
        if begin < end:
            stretches.setdefault(_way_at(buffer, target, source, int(times[begin])), []).append((begin, end))
    return stretches


def _way_at(buffer: TransformBuffer, target: str, source: str, at_ns: int) -> Way | None:
    """Name the edges between two frames at a time; None where a changing parent leaves no way."""
    try:
        down, up = buffer.between(target, source, at_ns)
    except (NoDataAt, NotConnected):
        return None
    return tuple(down), tuple(up)


def _fill(out: Floats, plan: Plan | None, times: Stamps) -> None:
    """Compute one stretch block by block; NaN where an edge has no data."""
    if plan is None or plan.fixed is not None:
        out[:] = np.nan if plan is None or plan.fixed is None else np.array(plan.fixed)[:, None]
        return
    first = max(track.stamps[0] for track in plan.moving)
    last = min(track.stamps[-1] for track in plan.moving)
    begin, end = int(np.searchsorted(times, first)), int(np.searchsorted(times, last, "right"))
    out[:, :begin] = np.nan
    out[:, max(begin, end) :] = np.nan
    inside = out[:, begin:end]
    for start, stop in arrays.blocks(max(end - begin, 0)):
        part = times[begin + start : begin + stop]
        tx, ty, tz, x, y, z, w = _joined(plan, part)
        for row, column in zip(inside, (tx, ty, tz, *quaternion.unit(x, y, z, w, arrays)), strict=True):
            row[start:stop] = column


def _joined(plan: Plan, times: Stamps) -> Columns:
    """Return target_from_source at sorted times within every edge's samples."""
    top_from_target, top_from_source = _product(plan.to_target, times), _product(plan.to_source, times)
    if top_from_target is None:
        return top_from_source or IDENTITY
    target_from_top = rigid.inverse(*top_from_target)
    return target_from_top if top_from_source is None else rigid.compose(*target_from_top, *top_from_source)


def _product(pieces: Iterable[Piece], times: Stamps) -> Columns | None:
    """Compose the pieces of one branch at each time; None for no pieces."""
    product: Columns | None = None
    for piece in pieces:
        here = _table(piece).at(times) if isinstance(piece, Track) else piece
        product = here if product is None else rigid.compose(*product, *here)
    return product


def _table(track: Track) -> Table:
    """Return a track's samples as arrays, made once."""
    if track.table is None:
        track.table = Table(track)
    table: Table = track.table
    return table


class Table:
    """The samples of a track as columns, each with the way to the next and the time it takes."""

    def __init__(self, track: Track) -> None:
        """Prepare every way; the last sample leads nowhere, and neither does one before a change of parent."""
        self.stamps = np.array(track.stamps, dtype=np.int64)
        here: Any = np.array(track.samples).T
        following = np.append(np.arange(1, self.stamps.size), self.stamps.size - 1)
        if track.varies:
            parents = np.array(track.parents, dtype=object)
            following = np.where(parents[following] == parents, following, np.arange(self.stamps.size))
        ways = arrays.run(segment.prepare, 8, (*here, *here[:, following]), arrays)
        step = np.append(np.diff(self.stamps), 1)
        self.columns = np.array((*here, *ways, 1.0 / np.maximum(step, 1)))

    def at(self, times: Stamps) -> Columns:
        """Return the poses at sorted times, none of them outside of the samples."""
        stamps, columns = self._spread(times)
        arguments: tuple[Any, ...] = (*columns[:15], (times - stamps) * columns[15], arrays)
        return segment.along(*arguments)

    def _spread(self, times: Stamps) -> tuple[Stamps, Floats]:
        """Return for each time the newest sample that is not after it: its stamp and its columns.

        Repeating is several times faster than picking where many times share a sample.
        """
        low = int(np.searchsorted(self.stamps, times[0], "right")) - 1
        high = int(np.searchsorted(self.stamps, times[-1], "right"))
        if (high - low) * SHARED > times.size:
            at = np.searchsorted(self.stamps, times, "right") - 1
            return self.stamps.take(at), self.columns.take(at, axis=1)
        begins = np.searchsorted(times, self.stamps[low + 1 : high])
        counts = np.diff(begins, prepend=0, append=times.size)
        return self.stamps[low:high].repeat(counts), self.columns[:, low:high].repeat(counts, axis=1)
