"""Find the differences between two trees: missing frames, other parents, and the displacement of common frames.

Signs of quaternions and the order of names are ignored.  Moving trees are compared at one time.
"""

from __future__ import annotations

import re
from math import degrees
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FrametoolError, ValueInvalid, listing, shown
from frametool.formats.load import load
from frametool.frames.stamps import format_stamp, whole_stamp
from frametool.frames.topology import Snapshot, motion
from frametool.geometry import floats, rigid
from frametool.geometry.transform import NEAR, NEAR_BY
from frametool.text.numbers import parse_length, read_number_or_angle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.frames.lookups import Frames
    from frametool.geometry import Rigid
    from frametool.geometry.camera import Camera

ROUNDING = 2.0**-46  # of the largest position: the maximum error of a product of some dozens of poses

# kind -> description, in the order in which differences are listed; each of them makes two trees different
KINDS = {
    "only-in-a": "a frame that B does not have",
    "only-in-b": "a frame that A does not have",
    "parent": "a frame that hangs under another parent, or under none",
    "motion": "a frame that is static in one and moves in the other",
    "no-data": "a frame without data at that time",
    "samples": "a frame that moves in both, but otherwise",
    "camera": "a camera whose intrinsics differ",
    "moved": "a frame that has another pose, in its parent or seen from elsewhere",
}
SAME = "same"


class Tolerance(NamedTuple):
    """The largest difference of equal poses: metres and radians."""

    metres: float = NEAR_BY
    radians: float = NEAR

    def covers(self, apart: Apart | None) -> bool:
        """Return True if two poses are within the tolerance; unknown parts are ignored."""
        if apart is None:
            return True
        return apart.metres <= self.metres + apart.rounding and apart.radians <= self.radians + apart.turn_rounding

    def times(self, apart: Apart | None) -> float:
        """Return the distance of two poses in tolerances, for sorting; -1 if unknown."""
        if apart is None:
            return -1.0
        return max(apart.metres / (self.metres or NEAR_BY), apart.radians / (self.radians or NEAR))


def parse_tolerance(text: str, otherwise: Tolerance = Tolerance()) -> Tolerance:  # noqa: B008 - it is frozen
    """Parse `1mm,0.1deg`, or one of them; bare numbers are metres and radians, in this order.

    otherwise: defaults for a missing one
    Raises ValueInvalid.
    """
    parts: dict[str, float] = {}
    try:
        for index, cell in enumerate(map(str.strip, text.split(","))):
            is_angle = re.search("deg|rad|°|pi|π", cell) or (index == 1 and not cell.endswith("m"))
            name = "radians" if is_angle else "metres"
            if name in parts:
                raise ValueInvalid(f"{shown(text)} is not one length and one angle")
            parts[name] = read_number_or_angle(cell, degrees=False) if is_angle else parse_length(cell)
            if parts[name] < 0.0:
                raise ValueInvalid(f"{shown(cell)} is less than 0")
    except ValueInvalid as error:
        raise ValueInvalid(f"{error}; write a length, an angle or both: 1mm,0.1deg") from None
    return otherwise._replace(**parts)


class Apart(NamedTuple):
    """The distance of two poses, in metres and radians, and its maximum rounding error; 0 for a single edge."""

    metres: float
    radians: float
    rounding: float = 0.0
    turn_rounding: float = 0.0

    @property
    def millimetres(self) -> float:
        """Return the distance in mm."""
        return 1e3 * self.metres

    @property
    def degrees(self) -> float:
        """Return the angle in degrees."""
        return degrees(self.radians)

    def __str__(self) -> str:
        """Return it in mm and degrees, with four digits, or all before the point."""
        far = self.millimetres
        return f"{far:{'.0f' if 1e3 <= far < 1e9 else '.4g'}} mm and {self.degrees:.4g} deg"


class Difference(NamedTuple):
    """The difference in one frame.

    kind: one of KINDS, or `same` for an unchanged frame
    parent_a, parent_b: None for a root and for a missing frame
    own: displacement in its own parent; None if the parents differ, and for roots
    seen_from: the frame relative to which it is compared in both, if there is one
    seen: displacement relative to it
    note: further information
    """

    kind: str
    frame: str
    parent_a: str | None = None
    parent_b: str | None = None
    own: Apart | None = None
    seen_from: str | None = None
    seen: Apart | None = None
    note: str = ""

    @property
    def sentence(self) -> str:
        """Return it as one line."""
        name = shown(self.frame)
        at_a, at_b = ("a root" if each is None else f"under {shown(each)}" for each in (self.parent_a, self.parent_b))
        moved = f" moved {self.own or 'nowhere'} in {shown(self.parent_a)}" if self.parent_a else ""
        text = {
            "only-in-a": f", {at_a}, is only in A", "only-in-b": f", {at_b}, is only in B",
            "parent": f" is {at_a} in A, {at_b} in B", "camera": " has other intrinsics", "moved": moved, SAME: moved,
            "samples": f" moves otherwise{f' by up to {self.own}' if self.own else ''}",
        }.get(self.kind, "")  # fmt: skip
        seen = f"; seen from {shown(self.seen_from)} it moved {self.seen}" if self.seen and text else ""
        return f"{name}{text}{seen}{f': {self.note}' if self.note else ''}"


def entry(each: Difference) -> dict[str, Any]:
    """Return a difference as plain values: lengths in mm, angles in degrees."""
    return {
        "kind": each.kind,
        "frame": each.frame,
        "parent_a": each.parent_a,
        "parent_b": each.parent_b,
        "moved_mm": each.own and each.own.millimetres,
        "moved_deg": each.own and each.own.degrees,
        "seen_from": each.seen_from,
        "seen_mm": each.seen and each.seen.millimetres,
        "seen_deg": each.seen and each.seen.degrees,
        "note": each.note or None,
    }


class TreeComparison(NamedTuple):
    """The differences between two trees.

    differences: by kind, the largest first
    unmoved: the common frames that are not among them
    notes: messages about how the two were compared
    uncompared: frames that could not be compared: neither has data at that time
    """

    differences: list[Difference]
    unmoved: list[Difference]
    notes: list[str]
    uncompared: list[str]


def diff(
    a: Frames | str | PathLike[str], b: Frames | str | PathLike[str], *, at_ns: int | None = None,
    seen_from: str | None = None, tolerance: tuple[float, float] = Tolerance(),
) -> TreeComparison:  # fmt: skip
    """Compare two trees, or two recordings at one time: a frame moves from its pose in A to its pose in B.

    a, b: trees, or the paths of their files as for `load`
    at_ns: the time; None is the latest of each.  seen_from: a frame of both; None is the root of each part of A, or
    the nearest frame to it that is in both.  tolerance: metres and radians that are ignored.
    Raises UnknownFrame for a `seen_from` that is not in both.
    """
    a, b = (load(each) if isinstance(each, str | PathLike) else each for each in (a, b))
    at_ns = None if at_ns is None else whole_stamp(at_ns)
    pair = _Pair(a, b, at_ns, Tolerance(*tolerance), seen_from)
    common = frozenset(pair.common)
    found = [
        Difference(kind, frame, pair.a.parent(frame), pair.b.parent(frame))
        for kind, side in (("only-in-a", a), ("only-in-b", b)) for frame in side.frames if frame not in common
    ]  # fmt: skip
    found += [*(each for frame in pair.common for each in pair.about(frame)), *pair.cameras()]
    order = {kind: number for number, kind in enumerate((*KINDS, SAME))}
    limit = pair.tolerance

    def rank(each: Difference) -> tuple[float, ...]:  # frames that only moved with their parent are last
        own = -1.0 if limit.covers(each.own) else limit.times(each.own)
        return order[each.kind], -own, -limit.times(each.seen)

    found.sort(key=rank)
    if at_ns is None and (a.moves or b.moves):
        newest = [
            f"{name} {format_stamp(max(track.last_ns for track in tree.tracks() if not track.is_static))}"
            for name, tree in (("A", a), ("B", b))
            if tree.moves
        ]
        also = ", and sample by sample" if a.moves and b.moves else ""
        pair.notes.append(
            f"what moves is compared at its latest ({' and '.join(newest)}){also}; --at TIME compares at one time"
        )
    both = [child for child in dict.fromkeys([*a.covariances, *b.covariances]) if a.track(child) and b.track(child)]
    if others := [child for child in both if a.covariances.get(child) != b.covariances.get(child)]:
        pair.notes.append(f"covariances are not compared; those of {listing(others, 8)} differ")
    return TreeComparison(
        [each for each in found if each.kind != SAME],
        [each for each in found if each.kind == SAME],
        pair.notes,
        [frame for frame in pair.common if frame in pair.a.without_data and frame in pair.b.without_data],
    )


class _Pair:
    """Two trees at one time, side by side."""

    def __init__(self, a: Frames, b: Frames, at_ns: int | None, tolerance: Tolerance, start: str | None) -> None:
        """Take both trees at a time; compare all frames relative to `start`, or each part relative to its own frame."""
        self.a, self.b = Snapshot(a, at_ns), Snapshot(b, at_ns)
        self.tolerance = tolerance
        in_b = frozenset(b.frames)
        self.common = [frame for frame in a.frames if frame in in_b]
        self.notes = [] if self.common else ["no frame is in both A and B"]
        self.seen: dict[str, tuple[str, Apart]] = {}  # frame -> reference frame, displacement
        self.start = start  # the reference frame of all frames, if it was named
        starts = []
        if start is not None:
            a.require(start)
            b.require(start)
            starts.append(start)
        else:
            parts: dict[tuple[str, str], set[str]] = {}
            for frame in self.common:
                parts.setdefault((self.a.roots[frame], self.b.roots[frame]), set()).add(frame)
            for (root, _), frames in parts.items():
                if len(frames) > 1:
                    starts.append(next(frame for frame in self.a.below(root) if frame in frames))
        for each in starts:
            one, other = self.a.seen_from(each), self.b.seen_from(each)
            reach = max(1.0, *(abs(part) for pose in (*one.values(), *other.values()) for part in pose[:3]))
            for frame in self.common:
                if frame != each and frame in one and frame in other and frame not in self.seen:
                    apart = _apart(one[frame], other[frame])
                    self.seen[frame] = each, apart._replace(rounding=ROUNDING * reach, turn_rounding=ROUNDING)

    def about(self, frame: str) -> Iterator[Difference]:
        """Yield the differences of a common frame, of kind `same` if it is unchanged."""
        parent_a, parent_b = self.a.parent(frame), self.b.parent(frame)
        blind = " and ".join(name for name, side in (("A", self.a), ("B", self.b)) if frame in side.without_data)
        start, seen = self.seen.get(frame, (None, None))
        found = Difference(SAME, frame, parent_a, parent_b, None, start, seen)
        if seen is None and self.start not in (None, frame):
            found = found._replace(note=f"not connected to {shown(self.start)} in both")
        one, other = self.a.tree.track(frame), self.b.tree.track(frame)
        if one is not None and other is not None and one.is_static != other.is_static:
            note = "static in A, moves in B" if one.is_static else "moves in A, static in B"
            yield Difference("motion", frame, parent_a, parent_b, note=note)
        if blind:
            yield found._replace(kind="no-data", note=f"no data in {blind} at {format_stamp(self.a.at_ns or 0)}")
        elif parent_a != parent_b:
            yield found._replace(kind="parent")
        else:
            own = _apart(self.a.edges[frame][1], self.b.edges[frame][1]) if parent_a is not None else None
            if self.a.at_ns is None and (samples := self._other_samples(frame)):
                yield samples
            same = self.tolerance.covers(own) and self.tolerance.covers(seen)
            yield found._replace(kind=SAME if same else "moved", own=own)

    def cameras(self) -> Iterator[Difference]:
        """Yield the common frames whose intrinsics differ; note what cannot be compared."""
        try:
            in_a, in_b = map(_cameras, (self.a.tree, self.b.tree))
        except FrametoolError as error:
            self.notes.append(f"intrinsics are not compared: {error}")
            return
        if alone := [frame for frame in self.common if (frame in in_a) != (frame in in_b)]:
            self.notes.append(f"intrinsics in only one of A and B are not compared: {listing(alone, 8)}")
        for frame in (frame for frame in self.common if frame in in_a and frame in in_b):
            try:
                one, other = _intrinsics(in_a[frame]), _intrinsics(in_b[frame])
            except FrametoolError as error:
                self.notes.append(f"intrinsics of {shown(frame)} are not compared: {error}")
                continue
            keys = [key for key in {**one, **other} if one.get(key) != other.get(key)]
            if note := ", ".join(f"{key} {one.get(key, 'none')} -> {other.get(key, 'none')}" for key in keys):
                yield Difference("camera", frame, self.a.parent(frame), self.b.parent(frame), note=note)

    def _other_samples(self, frame: str) -> Difference | None:
        """Compare all samples of a frame that moves in both."""
        one, other = self.a.tree.track(frame), self.b.tree.track(frame)
        if one is None or other is None or one.is_static or other.is_static:
            return None
        found = Difference("samples", frame, one.parent, other.parent)
        if one.count != other.count or one.span != other.span:
            return found._replace(note=f"{motion(one)} in A, {motion(other)} in B")
        farthest = Apart(0.0, 0.0)
        at_ns = None
        for (stamp_a, parent_a, pose_a), (stamp_b, parent_b, pose_b) in zip(one.walk(), other.walk(), strict=True):
            if stamp_a != stamp_b or parent_a != parent_b:
                what = "another stamp" if stamp_a != stamp_b else "another parent"
                return found._replace(note=f"{what} in B, first for that of A at {format_stamp(stamp_a)}")
            apart = _apart(pose_a, pose_b) if pose_a != pose_b else None
            if apart is not None and self.tolerance.times(apart) > self.tolerance.times(farthest):
                farthest, at_ns = apart, stamp_a
        if at_ns is None or self.tolerance.covers(farthest):
            return None
        return found._replace(own=farthest, note=f"farthest at {format_stamp(at_ns)}")


def _apart(a: Rigid, b: Rigid) -> Apart:
    return Apart(*rigid.distance(*a, *b, floats))


def _cameras(tree: Frames) -> dict[str, Camera | Callable[..., Camera]]:
    return {**tree.read_cameras(), **tree.cameras}


def _intrinsics(known: Camera | Callable[..., Camera]) -> dict[str, str]:
    """Return the intrinsics of a camera by name, as text without digits that may be rounding errors."""
    camera = known() if callable(known) else known
    fields = {**camera.mapping(), **dict(zip(("fx", "fy", "cx", "cy"), camera.numbers, strict=False))}
    for key in ("K", "axes"):
        fields.pop(key, None)
    return {key: _plain(value) for key, value in fields.items()}


def _plain(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_plain, value))}]"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
