"""Lookups as results: the pose of SOURCE in TARGET as an entry of a tree, with the times that mattered."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from frametool.errors import LookupFailed
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid

BLOCK = 1 << 14  # times


def result_at(components: Rigid, target: str, source: str, at_ns: int | None) -> Result:
    """Return target_from_source as a result; a time of None did not matter."""
    return Result(Pose.of(components, source, target), {} if at_ns is None else {"stamp_ns": at_ns})


def looked_up(frames: Frames, target: str, source: str, at_ns: int | None = None) -> Result:
    """Look up at one time; None is the latest, and the result says which that was."""
    at_ns = frames.latest(target, source) if at_ns is None else at_ns
    return result_at(frames.lookup_components(target, source, at_ns), target, source, at_ns)


def looked_up_across(
    frames: Frames, target: str, at_ns: int | None, source: str, source_at_ns: int | None, fixed: str
) -> Result:
    """Look up across two times by way of a fixed frame; the result says both."""
    found = frames.lookup_across(target, at_ns, source, source_at_ns, fixed)
    at_ns = frames.latest(target, fixed) if at_ns is None else at_ns
    source_at_ns = frames.latest(fixed, source) if source_at_ns is None else source_at_ns
    stamps = {key: at for key, at in (("stamp_ns", at_ns), ("source_stamp_ns", source_at_ns)) if at is not None}
    return Result(Pose.of(found.components, source, target), {**stamps, "fixed": fixed})


def looked_up_many(
    frames: Frames, target: str, source: str, times: Sequence[int], *, miss: Callable[[int], None] | None = None
) -> Iterator[Result]:
    """Look up at many times, in their order, block by block.

    miss: takes each time without data, which then has no result; without it the first one raises.
    """
    for begin in range(0, len(times), BLOCK):
        block = times[begin : begin + BLOCK]
        found = frames.lookup_many(target, source, block, missing="nan" if miss else "raise")
        rows = zip(*(column.tolist() for column in found.components), strict=True)
        for at_ns, row in zip(block, rows, strict=True):
            if isfinite(row[6]):
                yield result_at(row, target, source, at_ns)
            elif miss:
                miss(at_ns)


def why_missing(frames: Frames, target: str, source: str, at_ns: int) -> LookupFailed | None:
    """Return the error of a lookup at a time without data."""
    try:
        frames.lookup_components(target, source, at_ns)
    except LookupFailed as error:
        return error
    return None


def sample_stamps(frames: Frames, target: str, source: str) -> list[int]:
    """Return the stamps of all samples on the way between two frames at which all of it has data, sorted."""
    span = frames.span(target, source)
    if span is None:
        return []
    first, last = span
    stamps = {
        stamp_ns
        for track in frames.way(target, source)
        if not track.standing
        for stamp_ns, *_ in track.walk()
        if first <= stamp_ns <= last
    }
    if not stamps:
        frames.lookup_components(target, source, first)  # raises: the samples of two edges never overlap
    return sorted(stamps)
