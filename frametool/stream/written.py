"""Poses and records as they are written, for derivations: the numbers of a notation with what they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid, shown
from frametool.explain import derive
from frametool.explain.derive import ByTree, MovedRecord
from frametool.explain.operations import WrittenPose
from frametool.geometry import floats
from frametool.stream.record_values import pose_of, read_text
from frametool.stream.request import Operation, Request
from frametool.stream.row_layout import POINT, POSE, VECTOR

if TYPE_CHECKING:
    from frametool.documents.source import Source
    from frametool.explain.derive import DerivationStyle
    from frametool.explain.render import Explanation
    from frametool.stream.record import Record


def written_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[WrittenPose]:
    """Read the poses of a text as they are written; raises as `read_poses` does."""
    request = Request(kind=POSE, degrees=degrees, normalize=normalize)
    return [_written_pose(record, request) for record in read_text(source, request).records]


def _written_pose(record: Record, request: Request) -> WrittenPose:
    """Return a record as it is written."""
    shape, notation = record.shape, record.shape.notation
    written = WrittenPose(
        pose_of(record, request), notation, position=shape.position(record.values), inverse=shape.inverse
    )
    if notation is None:
        return written
    return written._replace(
        numbers=shape.rotation(record.values), degrees=bool(notation.representation.angles) and shape.degrees
    )


def derive_record(
    plan: DerivationStyle, way: ByTree | WrittenPose, source: Source, *, kind: str = "", degrees: bool = False,
    normalize: bool = False, counters: bool = True, timeless: bool = False,
) -> Explanation:  # fmt: skip
    """Derive where a record is in the target's frame.

    way: a lookup, or a pose.  source: text that holds one record.  timeless: the stamp of its header does not matter.
    """
    request = Request(Operation(moves=True), kind=kind, degrees=degrees, normalize=normalize, frame_is_counter=counters)
    records = read_text(source, request).records
    if len(records) != 1:
        raise ValueInvalid(f"a derivation is of one record, {source.name} holds {len(records)}")
    (record,) = records
    shape, operation = record.shape, request.operation
    if shape.kind not in (POSE, POINT, VECTOR) or shape.covariance:
        what = f"of a {shape.kind}" + " with a covariance" * bool(shape.covariance)
        raise ValueInvalid(f"no derivation {what}; leave --explain out")
    target, origin = _target_and_source(way, record.parent.text)
    if isinstance(way, WrittenPose):
        mover = way.pose.components
    else:
        at_ns = None if timeless or way.frames.latest(target, origin) is None else record.stamp_ns
        way = way._replace(source=origin, at_ns=at_ns if way.at_ns is None else way.at_ns)
        mover = way.frames.lookup(target, origin, way.at_ns).components
    if shape.kind == POSE:
        written = _written_pose(record, request)
        result = operation.pose([written.pose.components], mover, floats)
        return derive.apply(plan, way, MovedRecord(POSE, target, origin, mover, (), result, written))
    start = tuple(record.values) if shape.unit is None else shape.position(record.values)
    result = operation.move(shape, start, (), mover)
    return derive.apply(plan, way, MovedRecord(shape.kind, target, origin, mover, start, result))


def _target_and_source(way: ByTree | WrittenPose, own: str | None) -> tuple[str, str]:
    """Return target and source for a record; where it names its own frame, that must be the source."""
    if isinstance(way, WrittenPose):
        target, source = way.pose.parent or "a", way.pose.name
    else:
        target, source = way.target, way.source
        if own and own.startswith("/") and own not in way.frames.frames:
            own = own[1:]
    if own and source is not None and own != source:
        raise ValueInvalid(f"a record is expressed in {shown(own)}, not in {shown(source)}")
    if not own and source is None and isinstance(way, ByTree):
        raise ValueInvalid("a record does not say its frame; name SOURCE, or write {frame: .., point: [..]}")
    return target, own or source or "b"
