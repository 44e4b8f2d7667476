"""What a buffer holds, edge by edge: rates and intervals, the tree at one time, every sample in turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import warn
from frametool.frames.no_data import seconds
from frametool.frames.stamps import BILLION, format_stamp
from frametool.frames.tree import FrameTree

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.track import Track
    from frametool.geometry.types import Rigid

SHORTEST = 0.0001  # seconds: tf2 divides by no less


def rate(track: Track) -> float | None:
    """Return samples a second, counted over the gaps between them; None for fewer than two stamps."""
    if track.standing or track.stamps[0] == track.stamps[-1]:
        return None
    first, last = track.span
    return (len(track.stamps) - 1) * BILLION / (last - first)


def motion(track: Track) -> str:
    """Say in a few words how a frame moves: `41 samples  10 Hz  0.000000000 .. 4.000000000`."""
    often = rate(track)
    first, last = track.span
    if often is None:
        return f"1 sample  {format_stamp(first)}" if len(track.stamps) == 1 else f"{len(track.stamps)} samples at once"
    changes = sum(before != after for before, after in zip(track.parents, track.parents[1:], strict=False))
    other = f"  {changes} change{'s' if changes > 1 else ''} of parent" if changes else ""
    return f"{len(track.stamps)} samples  {often:.4g} Hz  {format_stamp(first)} .. {format_stamp(last)}{other}"


def tree_at(buffer: TransformBuffer, at_ns: int) -> FrameTree:
    """Return the tree as it stands at one time; edges without data then are left out, with a warning."""
    tree = FrameTree(buffer.name)
    for frame in buffer.frames:
        tree.add_root(frame)
    for track in buffer.tracks():
        pose = track.samples[0] if track.standing else track.at(at_ns)
        parent = track.parent_at(None if track.standing else at_ns)
        if pose is not None and parent is not None:
            tree.add_components(parent, track.child, pose)
        else:
            first, last = track.span
            off = max(first - at_ns, at_ns - last)
            warn(
                f"{track.parent} -> {track.child} is left out: no data at {format_stamp(at_ns)}, "
                f"samples cover {format_stamp(first)} .. {format_stamp(last)} ({seconds(off)} s off)",
            )
    return tree


def samples(buffer: TransformBuffer) -> Iterator[tuple[str, str, Rigid, int | None]]:
    """Walk every sample as (parent, child, components, stamp_ns), frame by frame; a standing one has no stamp."""
    for track in buffer.tracks():
        stamps = [None] if track.standing else track.stamps
        for parent, components, stamp_ns in zip(track.parents, track.samples, stamps, strict=True):
            yield parent, track.child, components, stamp_ns


class Seen:
    """What tf2 says about one edge of its cache."""

    def __init__(self, track: Track | None, child: str, parent: str) -> None:
        """Count; without a track, or one that stands still, it is tf2's static edge."""
        still = track is None or track.standing
        oldest, newest = (0, 0) if track is None or still else track.span
        count = 1 if track is None else len(track.samples)
        self.child, self.parent = child, parent
        self.authority = "default_authority" if track is None else track.authority
        self.oldest, self.newest = oldest / BILLION, newest / BILLION
        self.length = (newest - oldest) / BILLION
        self.rate = count / max(self.length, SHORTEST)


def seen(tree: FrameTree | TransformBuffer) -> list[Seen]:
    """Return what tf2 lists, in the order of first mention."""
    if isinstance(tree, FrameTree):
        return [Seen(None, child, parent) for parent, child, _ in tree.edges()]
    tracks = ((frame, tree.track(frame)) for frame in tree.frames)
    return [Seen(track, frame, track.parent) for frame, track in tracks if track is not None]
