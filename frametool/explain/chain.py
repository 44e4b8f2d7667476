"""The derivation of a lookup: the way through the tree, the samples around the time, the products along the way."""

from __future__ import annotations

from bisect import bisect_right
from operator import itemgetter
from typing import TYPE_CHECKING

from frametool.errors import printable
from frametool.explain.operations import between, compose, inverse
from frametool.frames.stamps import BILLION, format_stamp
from frametool.geometry.rigid import IDENTITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.run import Sheet, Values
    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack, Track
    from frametool.geometry.types import Rigid

    Sample = tuple[int, str, Rigid]
    Edge = tuple[str, str, Rigid]  # parent, child, parent_from_child


def chain(sheet: Sheet, frames: Frames, target: str, source: str, at_ns: int | None) -> Rigid:
    """Derive target_from_source at a time, None for the latest; the lookup itself has succeeded."""
    words = {"target": printable(target), "source": printable(source)}
    if target == source:
        sheet.play("same frame", {}, **words)
        return IDENTITY
    at_ns = frames.latest(target, source) if at_ns is None else at_ns
    down, up = frames.between(target, source, at_ns)
    tracks = {track.child: track for track in frames.way(target, source, at_ns)}
    parents = {child: str(frames.parent(child, at_ns)) for child in tracks}
    left, right = (" @ ".join(_named(parents[child], child) for child in branch) for branch in (down, up[::-1]))
    words["formula"] = " @ ".join(filter(None, [left and f"({left})^-1", right]))
    words["top"] = printable(parents[[*down, *reversed(up)][0]])
    words["path"] = " <- ".join(map(printable, frames.path(target, source, at_ns)))
    sheet.play("way", {"down": float(len(down)), "up": float(len(up))}, **words)
    moving = [track for child in (*down, *up) if not (track := tracks[child]).is_static]
    if moving and at_ns is not None:
        ends = ", ".join(f"{printable(track.child)} {format_stamp(track.last_ns)}" for track in moving)
        values = {"latest": float(at_ns == min(track.last_ns for track in moving)), "count": float(len(moving))}
        sheet.play("way of moving edges", values, at=format_stamp(at_ns), ends=ends)
    for child in (*down, *reversed(up)):
        if (track := tracks[child]).is_static:
            sheet.reached(track.components[:3])
            sheet.say(f"{_named(track.parent, child)}: {_line(sheet, track.components)}")
    edges = {child: _edge(sheet, tracks[child], at_ns or 0) for child in (*down, *up)}
    return _joined(sheet, [edges[each] for each in down], [edges[each] for each in reversed(up)])


def _line(sheet: Sheet, pose: Rigid) -> str:
    return f"xyz {sheet.numbers(pose[:3])} m, xyzw {sheet.numbers(pose[3:])}"


def _named(parent: str, child: str) -> str:
    return f"{printable(parent)}_from_{printable(child)}"


def _edge(sheet: Sheet, track: Track, at_ns: int) -> Edge:
    """Return an edge as it is at a time, with the steps to it if it moves."""
    child = printable(track.child)
    if track.is_static:
        return printable(track.parent), child, track.components
    (begin_ns, parent, a), after = samples_around(track, at_ns)
    sheet.reached(a[:3])
    edge, is_between = _named(parent, track.child), after is not None and begin_ns != at_ns
    end_ns, other, b = after or (begin_ns, parent, a)
    words = dict(zip(("begin", "end", "at"), map(format_stamp, (begin_ns, end_ns, at_ns)), strict=True))
    if not is_between or other != parent:
        changes = {"changes": float(is_between)}
        sheet.play("sample", changes, edge=edge, pose=_line(sheet, a), other=printable(other), **words)
        return printable(parent), child, a
    sheet.reached(b[:3])
    with sheet.about(edge):
        values = sheet.play(
            "two samples", spans(begin_ns, end_ns, at_ns), a=_line(sheet, a), b=_line(sheet, b), **words
        )
        return printable(parent), child, between(sheet, a, b, values["f"])


def samples_around(track: MovingTrack, at_ns: int) -> tuple[Sample, Sample | None]:
    """Return the last sample that is not after a time, else the first one; and the next one, if there is one."""
    samples = list(track.walk())
    at = max(bisect_right(samples, at_ns, key=itemgetter(0)), 1)
    return samples[at - 1], samples[at] if at < len(samples) else None


def spans(begin_ns: int, end_ns: int, at_ns: int) -> Values:
    """Return how long a time is after the first of two samples, and how long the second is, in seconds."""
    return {"past": (at_ns - begin_ns) / BILLION, "gap": (end_ns - begin_ns) / BILLION}


def _joined(sheet: Sheet, to_target: list[Edge], to_source: list[Edge]) -> Rigid:
    """Multiply both branches and join them; where the branch to the target is empty nothing is inverted."""
    products = [_product(sheet, edges) for edges in (to_target, to_source) if edges]
    top, target, pose = products[0]
    if not to_target:
        return pose
    back = inverse(sheet, pose, top, target)
    return compose(sheet, back, products[1][2], (target, top, products[1][1])) if to_source else back


def _product(sheet: Sheet, edges: Sequence[Edge]) -> Edge:
    """Multiply the edges of a branch, topmost first."""
    top, here, pose = edges[0]
    for _, child, edge in edges[1:]:
        pose = compose(sheet, pose, edge, (top, here, child))
        here = child
    return top, here, pose
