"""Products, inverses and differences of poses that name their frames; inner frames have to match.

    map_from_tool = product(map_from_base, base_from_tool)

The result of a look-up is such a pose, too: SOURCE in TARGET, as an entry of a tree, with its times.
"""

from __future__ import annotations

import math
from itertools import islice
from math import isfinite

from frametool.errors import LookupFailed, ValueInvalid, shown, warn
from frametool.frames.stamps import format_stamp
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.pose import RELATIVE, Pose, inverted
from frametool.grammar.result import Result, uncertain

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import Any

    from frametool.frames.lookups import Frames
    from frametool.geometry import Components
    from frametool.grammar.readers import Vector



def product(left: Pose, right: Pose) -> Pose:
    """Return a_from_c of a_from_b and b_from_c.

    Raises ValueInvalid if both name the inner frame and the names differ.
    """
    if left.name is not None and right.parent is not None and left.name != right.parent:
        raise ValueInvalid(
            f"frames do not touch: {left.parent or '?'} <- {left.name} is followed by "
            f"{right.parent} <- {right.name or '?'}; change the order, or invert one",
        )
    return Pose.of(rigid.compose_full(left.placed, right.placed), right.name, left.parent)


def shared_stamp(poses: Iterable[Pose]) -> dict[str, Any]:
    """Return the common stamp of some poses, for their result; empty if they differ, with a warning."""
    stamps = sorted({pose.stamp_ns for pose in poses if pose.stamp_ns is not None})
    if len(stamps) > 1:
        warn(f"the result has no stamp: {' and '.join(map(format_stamp, stamps[:2]))} are the times of two poses")
    return {"stamp_ns": stamps[0]} if len(stamps) == 1 else {}


def inverse(pose: Pose) -> Pose:
    """Return b_from_a of a_from_b; missing parts remain missing."""
    return inverted(pose)._replace(name=pose.parent, parent=pose.name)


def relative(a: Pose, b: Pose) -> Result:
    """Return the pose of B in A, inverse(a) b, with the distance in metres and the angle in radians and degrees.

    Raises ValueInvalid if the two are in different frames.
    """
    components = rigid.relative(*a.components, *b.components)
    distance, angle = rigid.extent(*components, floats)
    extras = dict(zip(RELATIVE, (distance, angle, math.degrees(angle)), strict=True))
    parent, name = relative_names(a, b)
    return Result(Pose.of(components, name, parent), extras | shared_stamp((a, b)))


def relative_names(a: Pose, b: Pose) -> tuple[str | None, str | None]:
    """Return parent and name of the pose of B in A; raise ValueInvalid if they are in different frames."""
    if a.parent is not None and b.parent is not None and a.parent != b.parent:
        raise ValueInvalid(f"A is in {shown(a.parent)} and B in {shown(b.parent)}; use one frame for both")
    return a.name, b.name


def turn_between(start: Vector, end: Vector) -> Result:
    """Return the shortest rotation from one direction to another, with its angle in radians and degrees.

    Raises ValueInvalid for a vector of length 0.
    """
    quaternion.check_directions(*start, *end)
    turned = quaternion.between(*start, *end, floats)
    angle = quaternion.angle(*turned, floats)
    return Result(Pose(rotation=turned), {"angle": angle, "angle_deg": math.degrees(angle)})


def interpolated(a: Pose, b: Pose, fraction: float) -> Pose:
    """Interpolate pose and time from a (0) to b (1): linearly and by slerp, as tf2 does.

    Raises ValueInvalid if the two are in different frames.
    """
    relative_names(a, b)  # raises an error for two frames
    components = rigid.interpolate(*a.components, *b.components, fraction, floats)
    start, end = a.stamp_ns, b.stamp_ns
    between = end if start is None or end is None else start + round(fraction * (end - start))
    pose = Pose.of(components, a.name if a.name == b.name else None, a.parent or b.parent)
    return pose._replace(stamp_ns=start if between is None else between)


BLOCK = 1 << 14  # times


def result_at(
    components: Sequence[float], target: str | None, source: str | None, at_ns: int | None,
    entries: Iterable[float] | None = None,
) -> Result:  # fmt: skip
    """Return target_from_source as a result; at_ns: its stamp, None for none; entries: of its covariance."""
    extras: dict[str, Any] = {} if at_ns is None else {"stamp_ns": at_ns}
    if entries is not None:
        extras |= uncertain(entries)
    return Result(Pose.of(components, source, target), extras)


def looked_up_across(
    frames: Frames, target: str, at_ns: int | None, source: str, source_at_ns: int | None, fixed: str
) -> Result:
    """Look up across two times through a fixed frame; the result states both."""
    found = frames.lookup_across(target, at_ns, source, source_at_ns, fixed)
    at_ns = frames.latest(target, fixed) if at_ns is None else at_ns
    source_at_ns = frames.latest(fixed, source) if source_at_ns is None else source_at_ns
    stamps = {key: at for key, at in (("stamp_ns", at_ns), ("source_stamp_ns", source_at_ns)) if at is not None}
    return Result(Pose.of(found.components, source, target), {**stamps, "fixed": fixed})


def why_missing(frames: Frames, target: str, source: str, at_ns: int) -> LookupFailed | None:
    """Return the error of a lookup at a time without data."""
    try:
        frames.lookup_components(target, source, at_ns)
    except LookupFailed as error:
        return error
    return None


def sample_stamps(frames: Frames, target: str, source: str) -> list[int]:
    """Return the stamps of all samples on the path between two frames at which all edges have data, sorted."""
    span = frames.span(target, source)
    if span is None:
        return []
    first, last = span
    stamps = {
        stamp_ns
        for track in frames.way(target, source)
        if not track.is_static
        for stamp_ns, *_ in track.walk()
        if first <= stamp_ns <= last
    }
    if not stamps:
        frames.lookup_components(target, source, first)  # raises an error: the samples of two edges never overlap
    return sorted(stamps)


class Lookups:
    """Look-ups of a tree, with the covariances of its edges if requested, and warnings about them."""

    def __init__(self, tree: Frames, *, carried: bool) -> None:
        """Start without results."""
        self.tree, self.carried = tree, carried
        self.edges: set[str] = set()  # used edges, by their children
        self.widest: Sequence[float] = ()

    def result(self, target: str, source: str, at_ns: int | None) -> Result:
        """Look up at one time; None is the latest time, which is then the stamp of the result."""
        at_ns = self.tree.latest(target, source) if at_ns is None and self.tree.moves else at_ns
        found = self.tree.lookup_components(target, source, at_ns)
        if not self.carried:
            return result_at(found, target, source, at_ns)
        return self._noted(result_at(found, target, source, at_ns, self.tree.carried(target, source, at_ns)))

    def results(
        self, target: str, source: str, times: Sequence[int], miss: Callable[[int], None] | None = None
    ) -> Iterator[Result]:
        """Look up at many times, in their order, block by block.

        miss: called with each time without data; without it the first one raises an error.
        """
        for begin in range(0, len(times), BLOCK):
            block = times[begin : begin + BLOCK]
            found = self._columns(target, source, block, "nan" if miss else "raise")
            for at_ns, *row in zip(block, *(column.tolist() for column in found), strict=True):
                if isfinite(row[6]):
                    result = result_at(row[:7], target, source, at_ns, row[7:] or None)
                    yield self._noted(result) if self.carried else result
                elif miss:
                    miss(at_ns)

    def one(self, target: str, source: str, at_ns: int | None) -> Components:
        """Return the components of a pose, with those of its covariance."""
        found = self.result(target, source, at_ns)
        return *found.pose.components, *found.extras.get("covariance", ())

    def many(self, target: str, source: str, times_ns: Any) -> Components:
        """Return these components at many times, as columns; nan where there are no data."""
        found = self._columns(target, source, times_ns, "nan")
        for at_ns in islice((at_ns for at_ns, w in zip(times_ns, found[6], strict=True) if isfinite(w)), self.carried):
            self.edges |= {track.child for track in self.tree.way(target, source, int(at_ns))}
        return found

    def _columns(self, target: str, source: str, times_ns: Any, missing: str) -> Components:
        poses = self.tree.lookup_many(target, source, times_ns, missing=missing).components
        if not self.carried:
            return poses
        from frametool.frames.trajectory import carried_many

        return *poses, *carried_many(self.tree, target, source, times_ns, poses).T

    def _noted(self, result: Result) -> Result:
        """Record a result with its covariance."""
        from frametool.geometry.uncertainty import widest_turn

        way = self.tree.way(result.pose.parent or "", result.pose.name or "", result.extras.get("stamp_ns"))
        self.edges |= {track.child for track in way}
        self.widest = max(self.widest, result.extras["covariance"], key=widest_turn)  # at least that of each edge
        return result

    def assumptions(self) -> str:
        """Return the assumptions about covariances, or ""; warn about rotations too uncertain for the first order."""
        if not self.edges:
            return ""
        from frametool.geometry.uncertainty import warn_if_wide

        warn_if_wide([self.widest])
        exact = len(self.edges - self.tree.covariances.keys())
        count = f"{exact} of {len(self.edges)}"
        none = f"{count} has no sigma and counts" if exact == 1 else f"{count} have no sigma and count"
        return f"edges count as independent{f'; {none} as exact' * bool(exact)}"
