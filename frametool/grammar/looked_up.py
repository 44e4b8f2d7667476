"""Lookups as results: the pose of SOURCE in TARGET as an entry of a tree, with the times that mattered."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from frametool.errors import LookupFailed
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid


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
    frames: Frames, target: str, source: str, times: Sequence[int], *, missing: str = "raise"
) -> Iterator[Result]:
    """Look up at many times, in their order; those without data raise, or are left out if `missing` is "nan"."""
    found = frames.lookup_many(target, source, times, missing=missing)
    rows = zip(*(column.tolist() for column in found.components), strict=True)
    for at_ns, row in zip(times, rows, strict=True):
        if isfinite(row[6]):
            yield result_at(row, target, source, at_ns)


def reasons(frames: Frames, target: str, source: str, times: Sequence[int]) -> Iterator[LookupFailed]:
    """Yield why there is no answer at each of some times."""
    for at_ns in times:
        try:
            frames.lookup_components(target, source, at_ns)
        except LookupFailed as error:
            yield error
