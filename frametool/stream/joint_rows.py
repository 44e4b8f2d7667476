"""Forward kinematics over rows: values of joints in columns or under keys, a pose with them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.errors import (
    BadAnswer,
    FormatError,
    Misused,
    ValueInvalid,
    bare,
    did_you_mean,
    first_of,
    listing,
    shown,
    warn,
)
from frametool.formats.robots.joints import SLACK, JointColumn, JointState, find_joint_columns
from frametool.formats.robots.model import TURNING, JointValue, Robot
from frametool.formats.table import FORMATS
from frametool.ros import messages
from frametool.stream.request import Formula
from frametool.stream.row_layout import POSE
from frametool.stream.splitter import Splitter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.types import Components, Namespace, Number


class JointRows(Formula):
    """The pose of a robot's frame for each row.

    base, tip: the pose is that of tip in base
    """

    reads_row = False
    adds = False

    def __init__(self, robot: Robot, posture: JointState, base: str, tip: str) -> None:
        """Find the way; the joints that the posture sets need no column.

        Raises UnknownFrame, NotConnected; BadAnswer for joints that are set to move over time.
        """
        self.chain = robot.chain(base, tip)
        self.joints = robot.joints
        self.base = base
        self.tip = tip
        if posture.moving:
            raise BadAnswer(f"--joints: {listing(posture.moving)} moves over time; stream that file with -i")
        self.constants = {name: posture.still[name] for name in posture.named}
        self._read: Sequence[JointColumn] = ()
        self._beyond: set[str] = set()

    def bind(self, names: Sequence[str], source: str, *, fixed: frozenset[str] = frozenset()) -> None:
        """Choose the columns of the joints on the way.

        fixed: the joints that nothing but `constants` may tell.
        Raises Misused for a joint that has none or several, FormatError for a unit it cannot have.
        """
        try:
            found = find_joint_columns(names, self.joints)
        except ValueInvalid as error:
            raise FormatError(str(error), source=source, line=1) from None
        self._read = columns = [column for column in found if self.chain.uses(column.joint)]
        known = {**self.constants, **{column.joint: None for column in columns}}
        if twice := next((column for column in columns if column.joint in fixed), None):
            problem = f"joint {shown(twice.joint)} has a column, {shown(names[twice.place])}, and a value by --joint"
            raise Misused(f"{problem}; keep one", source=source)
        if missing := self.chain.missing(known):
            others = [name for place, name in enumerate(names) if place not in {column.place for column in found}]
            near = did_you_mean(missing[0], others)
            example = "or give it by --joint" if near else f"give --joint {missing[0]}=VALUE"
            what = f"no column for joint{'s' * (len(missing) > 1)} {listing(missing)}{near or ';'} {example}"
            raise Misused(f"{what}; columns: {first_of(names, 12, quote=bare)}", source=source, line=1)
        self.columns = tuple(names[column.place] for column in columns)

    def kind(self, row: str) -> str:  # noqa: ARG002 - whatever a row is
        """Return that rows get a pose."""
        return POSE

    def rename(self, row: str, parent: str | None, name: str | None) -> tuple[str | None, str | None]:  # noqa: ARG002
        """Return the frames of the pose."""
        return self.base, self.tip

    def result(
        self, row: str, parts: Components, cells: Sequence[Number], times_ns: Number, xp: Namespace  # noqa: ARG002
    ) -> Components:
        """Return the pose for the cells of a block, or of one row."""
        values = dict(self.constants)
        for column, cell in zip(self._read, cells, strict=True):
            values[column.joint] = value = JointValue(cell / column.per_metre, column.degrees)
            joint = self.joints[column.joint]
            if joint.lower is None or joint.upper is None or joint.lower > joint.upper or joint.name in self._beyond:
                continue
            middle = 0.5 * (joint.lower + joint.upper)
            if xp.furthest(value.plain - middle) > joint.upper - middle + SLACK:
                self._beyond.add(joint.name)
                unit = "rad" if joint.kind in TURNING else "m"
                warn(f"joint {shown(joint.name)} goes beyond its limits {joint.lower:g} .. {joint.upper:g} {unit}")
        return self.chain.pose(values, xp)


def names_in(begin: bytes, fmt: str, source: str, wanted: str, *, header: bool = True) -> Sequence[str]:
    """Return the names of a table's columns, or the keys of the first record; of a JointState the joints it names.

    begin: the first bytes of the stream, of one of the formats that are streamed; wanted: what a record has
    Columns without names are called by their numbers from 1; keys within a mapping have its key and a dot before them.
    """
    if "records" not in FORMATS[fmt].reads:
        from frametool.stream.table import open_table

        table, _ = open_table(begin, fmt, header=header, source=source)
        return table.called
    part = next(iter(Splitter(fmt).parts(begin)[0]), None)
    text = "" if part is None else begin[part.start : part.end].decode("utf-8", "replace")
    documents = parse_documents(messages.without_noise(text) if fmt == "yaml" else text, source)
    value: Any = documents[0].value if documents else {}
    value = value[0] if type(value) is list and value else value
    if type(value) is not dict:
        raise FormatError(f"expected a mapping with {wanted}", source=source, line=1)
    inner = value["msg"] if messages.is_envelope(value) else value
    return [joint for joint, *_ in messages.positions(inner)] if messages.is_joint_state(inner) else _flat_keys(value)


def _flat_keys(value: dict[str, Any], prefix: str = "") -> list[str]:
    """Return the keys of what is neither mapping nor empty, in order."""
    found: list[str] = []
    for key, each in value.items():
        found += _flat_keys(each, f"{prefix}{key}.") if type(each) is dict else [prefix + key]
    return found
