"""What a tree holds, edge by edge: how often and over which time, in a few words and as tf2 lists it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.stamps import BILLION, format_stamp

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack, Track

SHORTEST = 0.0001  # seconds: tf2 divides by no less


def motion(track: MovingTrack) -> str:
    """Return in a few words how a frame moves: `41 at 10 Hz, 0 .. 4 s`."""
    first, last = track.span
    if first == last:
        return f"one at {_short(first)} s" if track.count == 1 else f"{track.count} at once"
    rate = (track.count - 1) * BILLION / (last - first)
    changes = sum(1 for _ in track.changes())
    times = f" {changes} times" if changes > 1 else ""
    other = f", reparented{times}" if changes else ""
    return f"{track.count} at {rate:.4g} Hz, {_short(first)} .. {_short(last)} s{other}"


def _short(stamp_ns: int) -> str:
    """Write a stamp without the zeros at its end."""
    return format_stamp(stamp_ns).rstrip("0").removesuffix(".")


class CacheEntry:
    """What tf2 says about one edge of its cache; a standing one has no stamps."""

    def __init__(self, track: Track) -> None:
        """Count."""
        oldest, newest = (0, 0) if track.standing else track.span
        self.child, self.parent, self.authority = track.child, track.parent, track.authority
        self.oldest, self.newest = oldest / BILLION, newest / BILLION
        self.length = (newest - oldest) / BILLION
        self.rate = track.count / max(self.length, SHORTEST)


def cache_entries(tree: Frames) -> list[CacheEntry]:
    """Return what tf2 lists, in the order of first mention."""
    tracks = (tree.track(frame) for frame in tree.frames)
    return [CacheEntry(track) for track in tracks if track is not None]
