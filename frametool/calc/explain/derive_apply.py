"""The derivation of one record moved into another frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.calc.explain.agreement import (
    DerivationStyle,
    check_vector,
    covariance_rows,
    end_with_pose,
    explained,
    row,
)
from frametool.calc.explain.chain import chain
from frametool.calc.explain.given import Given, given_of
from frametool.calc.explain.movers import MOVERS, pose_covariance, twist_covariance
from frametool.calc.explain.operations import compose
from frametool.errors import ValueInvalid, printable, shown
from frametool.geometry import floats
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result
from frametool.stream.operation import Operation
from frametool.stream.record import PARTS
from frametool.stream.record_values import documents, stamp_of
from frametool.stream.request import Request
from frametool.stream.row_layout import POSE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.calc.explain.render import Explanation
    from frametool.calc.explain.sheet import Row, Sheet
    from frametool.documents.source import Source
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.stream.record import Record

UNITS = {"point": ("m",), "vector": ("",), "twist": ("m/s", "rad/s"), "wrench": ("N", "Nm")}


class ByTree(NamedTuple):
    """Move by a lookup: from `source`, or the frame that the record names, at a time or the latest."""

    frames: Frames
    target: str
    source: str | None = None
    at_ns: int | None = None

    def names(self, own: str | None) -> tuple[str, str]:
        """Return target and source for a record given in a frame."""
        if own and own.startswith("/") and own not in self.frames.frames:
            own = own[1:]
        source = own or self.source
        if self.source is not None and source != self.source:
            raise ValueInvalid(f"a record is given in {shown(own)}, not in {shown(self.source)}")
        if source is None:
            raise ValueInvalid("a record does not say its frame; name SOURCE, or write {frame: .., point: [..]}")
        return self.target, source

    def components(self, names: tuple[str, str], stamp_ns: int | None) -> Rigid:
        """Return target_from_source."""
        return self.frames.lookup(*names, self._time(stamp_ns)).components

    def write(self, sheet: Sheet, names: tuple[str, str], stamp_ns: int | None) -> Rigid:
        """Add the derivation of target_from_source."""
        return chain(sheet, self.frames, *names, self._time(stamp_ns))

    def _time(self, stamp_ns: int | None) -> int | None:
        return stamp_ns if self.at_ns is None else self.at_ns


class ByPose(NamedTuple):
    """Move by a pose as it is written."""

    given: Given

    def names(self, own: str | None) -> tuple[str, str]:
        """Return target and source; a record's own frame must be that of the pose."""
        pose = self.given.pose
        if own and pose.name is not None and own != pose.name:
            raise ValueInvalid(f"a record is given in {shown(own)}, not in {shown(pose.name)}")
        return pose.parent or "a", own or pose.name or "b"

    def components(self, _names: tuple[str, str], _stamp_ns: int | None) -> Rigid:
        """Return the pose."""
        return self.given.pose.components

    def write(self, sheet: Sheet, names: tuple[str, str], _stamp_ns: int | None) -> Rigid:
        """Add the way from what is written to the pose."""
        target, source = map(printable, names)
        sheet.heading("Given")
        self.given.say(sheet, target, source)
        return self.given.components(sheet, target, source)


def derive_apply(
    way: ByTree | ByPose, source: Source, plan: DerivationStyle, *, kind: str = "", degrees: bool = False,
    normalize: bool = False, counters: bool = True, timeless: bool = False,
) -> Explanation:  # fmt: skip
    """Derive where a record is in the target's frame.

    source: text that holds one record.  timeless: the stamp of its header does not matter.
    """
    request = Request(Operation(moves=True), kind=kind, degrees=degrees, normalize=normalize, counters=counters)
    records = [record for _, found in documents(source, request) for record in found]
    if len(records) != 1:
        raise ValueInvalid(f"a derivation is of one record, {source.name} holds {len(records)}")
    record = records[0]
    names = way.names(record.parent.text)
    stamp_ns = stamp_of(record, source) if record.stamp and not timeless else None
    if isinstance(way, ByTree) and way.frames.latest(*names) is None:
        stamp_ns = None
    mover = way.components(names, stamp_ns)
    target, origin = map(printable, names)

    def write(sheet: Sheet) -> None:
        pose = way.write(sheet, names, stamp_ns)
        sheet.reached(pose[:3])
        check_vector(sheet, pose[:3], mover[:3])
        if record.shape.kind == POSE:
            _move_pose(sheet, pose, given_of(record, request), record, mover, names, plan)
        else:
            _move_vectors(sheet, pose, record, mover, (target, origin))

    return explained(f"{record.shape.kind} in {target} of a {record.shape.kind} in {origin}", write, plan)


def _own(record: Record, mover: Rigid) -> Sequence[float]:
    """Return what the command makes of a record."""
    shape = record.shape
    own = record.values[: shape.own_size]
    start = shape.position(own) if shape.unit is not None else tuple(own)
    return Operation(moves=True).move(shape, (*start, *record.values[shape.own_size :]), mover)


def _move_vectors(
    sheet: Sheet, pose: Rigid, record: Record, mover: Rigid, frames: tuple[str, str]
) -> None:
    """Move a point, a vector, a twist or a wrench, and end with the result."""
    shape = record.shape
    own = _own(record, mover)
    numbers = record.values[: shape.own_size]
    start = shape.position(numbers) if shape.unit is not None else tuple(numbers)
    sheet.reached(start)
    found = MOVERS[shape.kind](sheet, pose, start, *frames)
    check_vector(sheet, found, own[: len(found)])
    rows: list[Row] = []
    labels = PARTS.get(shape.kind, (shape.kind,))
    for at, (label, unit) in enumerate(zip(labels, UNITS[shape.kind], strict=True)):
        rows.append(row(label, "xyz", own[3 * at : 3 * at + 3], unit))
    if shape.covariance:
        beside = twist_covariance(sheet, pose, record.values[shape.own_size :])
        _check_covariance(sheet, beside, own[len(found) :])
        rows += covariance_rows(own[len(found) :])
    sheet.result(f"in {frames[0]}", rows)


def _move_pose(
    sheet: Sheet, pose: Rigid, given: Given, record: Record, mover: Rigid, names: tuple[str, str], plan: DerivationStyle
) -> None:
    """Move a pose, and end with the result."""
    target, origin = map(printable, names)
    name = printable(given.pose.name or "it")
    own = Result(Pose.of(Operation().pose([given.pose.components], mover, floats), given.pose.name, names[0]))
    sheet.heading("The record")
    given.say(sheet, origin, name)
    moved = compose(sheet, pose, given.components(sheet, origin, name), (target, origin, name))
    shape = record.shape
    if shape.covariance:
        turned = pose_covariance(sheet, pose, record.values[shape.own_size :])
        numbers = Operation().covariance(shape, tuple(record.values[shape.own_size :]), mover)
        _check_covariance(sheet, turned, numbers)
        end_with_pose(sheet, moved, Result(own.pose, {"covariance": numbers}), plan)
    else:
        end_with_pose(sheet, moved, own, plan)


def _check_covariance(sheet: Sheet, found: Sequence[float], own: Sequence[float]) -> None:
    sheet.reached([sheet.reach**2 * max(map(abs, own))])
    check_vector(sheet, found, own)


def record_source(value: Any, kind: str = "") -> Source:
    """Return the text of a record given in Python: three numbers, a mapping, or its text; raises ValueInvalid."""
    from frametool.documents.json_writer import dump
    from frametool.documents.source import Source

    if isinstance(value, str):
        return Source("argument", value)
    if isinstance(value, dict):
        return Source("argument", dump(value))
    try:
        x, y, z = map(float, value)
    except (TypeError, ValueError):
        raise ValueInvalid(f"expected three numbers or a mapping, found {shown(value)}") from None
    return Source("argument", dump({kind or "point": [x, y, z]}))
