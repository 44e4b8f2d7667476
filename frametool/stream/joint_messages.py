"""Forward kinematics over the CSV of the echo tools, where each row is a JointState that names its joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, listing
from frametool.geometry import floats
from frametool.grammar.edges import Tally
from frametool.grammar.pose import Pose
from frametool.grammar.readers import Misfit
from frametool.grammar.result import Result
from frametool.ros import joint_state
from frametool.ros.message_stream import Message, line_texts, read_messages
from frametool.stream.faults import Fault
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, BinaryIO

    from frametool.stream.faults import BadRows
    from frametool.stream.joint_rows import JointRows


def joint_poses(stream: BinaryIO, rows: JointRows, bad: BadRows, *, numbered: bool) -> Iterator[Result]:
    """Yield the pose for each row with its stamp; rows without one go to `bad`.

    numbered: they are those of `rostopic echo -p`, under its header; else those of `ros2 topic echo --csv`
    """
    count = 0
    for message in _messages(stream, bad.source, numbered=numbered):
        count += 1
        try:
            if isinstance(message, FormatError):
                raise message
            state = _state(message.value, numbered=numbered)
            yield Result(Pose.of(_pose(state, rows), rows.tip, rows.base), _stamp(state))
        except (FormatError, ValueInvalid) as error:
            line = error.line if isinstance(error, FormatError) else getattr(message, "line", 0)
            reason = error.message if isinstance(error, FormatError) else str(error)
            bad.take([Fault(line, "", reason)])
    bad.finish(count)


def _messages(stream: BinaryIO, name: str, *, numbered: bool) -> Iterator[Message | FormatError]:
    if numbered:
        return read_messages(stream, name, "csv1", Tally())
    return (Message(text, Source(name, text), line, cells=True) for line, text in line_texts(stream, name, Tally()))


def _state(value: Any, *, numbered: bool) -> dict[str, Any]:
    if numbered:
        return joint_state.of_numbered(value)
    return joint_state.of_row(joint_state.unquoted(value))


def _stamp(state: dict[str, Any]) -> dict[str, Any]:
    stamp_ns = joint_state.stamp_of_state(state)
    return {} if stamp_ns is None else {"stamp_ns": stamp_ns}


def _pose(state: dict[str, Any], rows: JointRows) -> Any:
    """Return the pose for one message."""
    found = {joint: parse_number(text) for joint, text, _ in joint_state.positions(state)}
    if missing := [joint for joint in rows.columns if joint not in found]:
        raise Misfit(f"no position of {listing(missing)} in it")
    return rows.result("", (), [found[joint] for joint in rows.columns], None, floats)
