"""Derivations (--explain) of records: the numbers as they are written, then each step of their transform."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, printable, shown
from frametool.explain import derive
from frametool.explain.derive import WrittenPose
from frametool.explain.run import Row
from frametool.geometry import floats
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result
from frametool.rows.plain import read_text
from frametool.rows.record import Record, pose_of
from frametool.rows.request import COMBINED, Operation, Request, RowOptions
from frametool.rows.shapes import POINT, POSE, VECTOR

if TYPE_CHECKING:
    from frametool.documents.source import Source
    from frametool.explain.render import Explanation
    from frametool.explain.run import Sheet
    from frametool.frames.lookups import Frames
    from frametool.grammar.result import Style


class ByTree(NamedTuple):
    """A transform by look-up.

    source: the source frame; None for the frame of the record
    at_ns: the time; None for that of the record, else the latest
    """

    frames: Frames
    target: str
    source: str | None = None
    at_ns: int | None = None


def written_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[WrittenPose]:
    """Read the poses of a text with the numbers of their notation; raises as `read_poses` does."""
    request = Request(COMBINED, RowOptions(kind=POSE, degrees=degrees, normalize=normalize))
    return [_written_pose(record, request) for record in read_text(source, request).records]


def _written_pose(record: Record, request: Request) -> WrittenPose:
    """Return the pose of a record with the numbers of its notation."""
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
    style: Style, way: ByTree | WrittenPose, source: Source, rows: RowOptions, *, timeless: bool = False
) -> Explanation:
    """Derive the record of a text in the target's frame.

    way: the look-up or the pose that moves it; source: text with one record
    timeless: ignore the stamp in its header
    """
    request = Request(Operation(moves=True), rows)
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
        at_ns, mover = None, way.pose.components
    else:
        at_ns = None if timeless or way.frames.latest(target, origin) is None else record.stamp_ns
        at_ns = at_ns if way.at_ns is None else way.at_ns
        mover = way.frames.lookup(target, origin, at_ns).components
    written = _written_pose(record, request) if shape.kind == POSE else None
    start = shape.position(record.values) if shape.unit is not None else tuple(record.values)
    of_pose = written and operation.pose([written.pose.components], mover, floats)
    result = of_pose or operation.move(shape, start, (), mover)
    into, out_of = printable(target), printable(origin)

    def write(sheet: Sheet) -> None:
        if isinstance(way, WrittenPose):
            (pose,) = derive.derived_from(sheet, [way], [(into, out_of)])
        else:
            pose = derive.chain(sheet, way.frames, target, origin, at_ns)
        derive.check_vector(sheet, pose[:3], mover[:3])
        if written is None:
            sheet.reached(start)
            derive.check_vector(sheet, derive.moved(sheet, shape.kind, pose, start, into, out_of), result)
            unit = derive.METRES if shape.kind == POINT else ""
            sheet.result(f"in {into}", [Row(shape.kind, "xyz", result, unit)])
            return
        name = printable(written.pose.name or "it")
        sheet.heading("The record")
        written.say(sheet, out_of, name)
        found = derive.product(sheet, pose, written.components(sheet, out_of, name), (into, out_of, name))
        derive.end_with_pose(sheet, found, Result(Pose.of(result, written.pose.name, target)), style)

    return derive.explained(style, f"{shape.kind} in {into} of a {shape.kind} in {out_of}", write)


def _target_and_source(way: ByTree | WrittenPose, own: str | None) -> tuple[str, str]:
    """Return target and source for a record; raises ValueInvalid if the record names another frame than the source."""
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
