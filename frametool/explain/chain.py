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

STORED = "A stored edge is the pose of the child in its parent; it maps points in the child to points in the parent."


def chain(sheet: Sheet, frames: Frames, target: str, source: str, at_ns: int | None) -> Rigid:
    """Derive target_from_source at a time, None for the latest; the lookup itself has succeeded."""
    to, of = printable(target), printable(source)
    if target == source:
        sheet.heading(f"{to}_from_{of}")
        sheet.say("A frame seen from itself: the identity, x 0, y 0, z 0, w 1 and no shift.")
        return IDENTITY
    at_ns = frames.latest(target, source) if at_ns is None else at_ns
    down, up = frames.between(target, source, at_ns)
    tracks = {track.child: track for track in frames.way(target, source, at_ns)}
    sheet.heading("The way through the tree")
    sheet.say(" <- ".join(map(printable, frames.path(target, source, at_ns))))
    first, second = _names(frames, down, at_ns), _names(frames, [*reversed(up)], at_ns)
    sheet.say(_sentence(first, second))
    if len(tracks) > 1 or first:
        sheet.say(f"{to}_from_{of} = {_formula(first, second)}")
    sheet.caveat(STORED)
    moving = [track for child in (*down, *up) if not (track := tracks[child]).standing]
    if moving and at_ns is not None:
        _say_time(sheet, moving, at_ns)
    for child in (*down, *reversed(up)):
        if (track := tracks[child]).standing:
            sheet.reached(track.components[:3])
            sheet.say(f"{printable(track.parent)}_from_{printable(child)}: {_line(sheet, track.components)}")
    edges = {child: _edge(sheet, tracks[child], at_ns or 0) for child in (*down, *up)}
    return _joined(sheet, [edges[each] for each in down], [edges[each] for each in reversed(up)])


def _line(sheet: Sheet, pose: Rigid) -> str:
    return f"xyz {sheet.numbers(pose[:3])} m, xyzw {sheet.numbers(pose[3:])}"


def _names(frames: Frames, children: Sequence[str], at_ns: int | None) -> list[tuple[str, str]]:
    """Return the edges of a branch as (parent, child), topmost first."""
    return [(printable(str(frames.parent(child, at_ns))), printable(child)) for child in children]


def _sentence(first: list[tuple[str, str]], second: list[tuple[str, str]]) -> str:
    """Say how the branches come together."""
    if not first:
        edge = "The edge is stored as it is asked for." if len(second) == 1 else "The stored edges multiply, top first."
        return f"{second[0][0]} is above {second[-1][1]}. {edge}"
    if not second:
        edge = "The stored edge is" if len(first) == 1 else "The product of the stored edges, top first, is"
        return f"{first[0][0]} is above {first[-1][1]}. {edge} inverted."
    return (
        f"{first[0][0]} is the frame above both. The stored edges multiply from it down to the source, and from it "
        "down to the target; the latter product is inverted."
    )


def _formula(first: list[tuple[str, str]], second: list[tuple[str, str]]) -> str:
    """Write the product of stored edges."""
    left, right = (" @ ".join(f"{parent}_from_{child}" for parent, child in each) for each in (first, second))
    return " @ ".join(filter(None, [left and f"({left})^-1", right]))


def _say_time(sheet: Sheet, moving: Sequence[MovingTrack], at_ns: int) -> None:
    """Say at which time the edges are taken, and why if it is the latest."""
    newest = min(track.last_ns for track in moving)
    text = f"Time {format_stamp(at_ns)} s."
    if at_ns == newest:
        text += " It is the latest that every moving edge on the way has reached"
        if len(moving) > 1:
            text += ": " + ", ".join(f"{printable(track.child)} {format_stamp(track.last_ns)}" for track in moving)
        text += "."
    sheet.say(text)


def _edge(sheet: Sheet, track: Track, at_ns: int) -> Edge:
    """Return an edge as it is at a time, with the steps to it if it moves."""
    if track.standing:
        return printable(track.parent), printable(track.child), track.components
    before, after = around(track, at_ns)
    edge = f"{printable(before[1])}_from_{printable(track.child)}"
    sheet.reached(before[2][:3])
    if after is not None and before[0] != at_ns and after[1] == before[1]:
        sheet.reached(after[2][:3])
        with sheet.about(edge):
            return printable(before[1]), printable(track.child), _interpolated(sheet, before, after, at_ns)
    text = f"{edge}: {_line(sheet, before[2])}, the sample at {format_stamp(before[0])}"
    if after is not None and before[0] != at_ns:
        text += (
            f". The next, at {format_stamp(after[0])}, has another parent, {printable(after[1])}: until then this one "
            "holds."
        )
    sheet.say(text)
    return printable(before[1]), printable(track.child), before[2]


def around(track: MovingTrack, at_ns: int) -> tuple[Sample, Sample | None]:
    """Return the last sample that is not after a time, else the first one; and the next one, if there is one."""
    samples = list(track.walk())
    at = max(bisect_right(samples, at_ns, key=itemgetter(0)), 1)
    return samples[at - 1], samples[at] if at < len(samples) else None


def spans(begin_ns: int, end_ns: int, at_ns: int) -> Values:
    """Return how long a time is after the first of two samples, and how long the second is, in seconds."""
    return {"past": (at_ns - begin_ns) / BILLION, "gap": (end_ns - begin_ns) / BILLION}


def _interpolated(sheet: Sheet, before: Sample, after: Sample, at_ns: int) -> Rigid:
    """Go from one sample towards the next."""
    (begin, _, a), (end, _, b) = before, after
    sheet.heading("the two samples around the time")
    words = dict(zip(("begin", "end", "at"), map(format_stamp, (begin, end, at_ns)), strict=True))
    f = sheet.play("fraction", spans(begin, end, at_ns), **words)["f"]
    sheet.say(f"a: {_line(sheet, a)}")
    sheet.say(f"b: {_line(sheet, b)}")
    return between(sheet, a, b, f)


def _joined(sheet: Sheet, to_target: list[Edge], to_source: list[Edge]) -> Rigid:
    """Multiply both branches and join them; where the branch to the target is empty nothing is inverted."""
    products = [_product(sheet, edges) for edges in (to_target, to_source) if edges]
    top, target, pose = products[0]
    if not to_target:
        return pose
    back = inverse(sheet, pose, top, target)
    return compose(sheet, back, products[1][2], (target, top, products[1][1])) if to_source else back


def _product(sheet: Sheet, edges: list[Edge]) -> Edge:
    """Multiply the edges of a branch, topmost first."""
    top, here, pose = edges[0]
    for _, child, edge in edges[1:]:
        pose = compose(sheet, pose, edge, (top, here, child))
        here = child
    return top, here, pose
