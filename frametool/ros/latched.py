"""Messages of transforms for good that are added to a recording, and the latched topics they come on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.ros.bag1_chunks import connection
from frametool.ros.bag2_folder import QOS, latched_qos, says_by_numbers
from frametool.ros.bags import TYPES
from frametool.ros.mcap_chunks import mapping, sized
from frametool.ros.recordings import BAG1, BAG2, KINDS, serialised, typestore

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.ros.record_copy import CopiedRecording
    from frametool.ros.recorded_edges import AddedEdge

STATIC = KINDS["tf_static"]


def added_messages(
    recording: CopiedRecording, edges: Mapping[str, Sequence[AddedEdge]], stamp_ns: int
) -> list[tuple[int, bytes]]:
    """Return a message of the edges of each topic, with the number of the channel it is written on."""
    form = BAG1 if recording.is_ros1 else BAG2
    made = []
    for topic, each in edges.items():
        frames = [(edge.parent, edge.child) for edge in each]
        data = serialised(STATIC, form, frames, [stamp_ns] * len(each), [edge.numbers for edge in each])
        channel = _latched_connection if recording.is_ros1 else _latched_channel
        made.append((channel(recording, topic), data))
    return made


def _latched_channel(recording: CopiedRecording, topic: str) -> int:
    """Return the number of a channel of transforms for good: that of the recording, or a new one."""
    for number, channel in recording.channels.items():
        if channel == (topic, STATIC.type, "cdr"):
            return number
    known = recording.registry
    qos = [known.channel(number)[2].get(QOS, "") for number in known.channels]
    definition, _ = typestore(BAG2).generate_msgdef(STATIC.type, ros_version=2)
    kind = b"".join(sized(each.encode()) for each in (STATIC.type, "ros2msg", definition))
    named = [number for number, body in known.schemas.items() if body.startswith(sized(STATIC.type.encode()))]
    schema = named[0] if named else known.add_schema(None, kind)
    said = mapping({QOS: latched_qos(by_numbers=any(map(says_by_numbers, qos)))})
    body = b"".join((sized(topic.encode()), sized(b"cdr"), said))
    return known.add_channel(None, schema, body)


def _latched_connection(recording: CopiedRecording, topic: str) -> int:
    """Return the number of a new latched connection, for whoever plays it keeps the last message of each."""
    known = recording.connections
    same = [number for number, each in recording.channels.items() if each.topic == topic and each.type in TYPES]
    found = [known[number][1] for number in same]
    definition, digest = typestore(BAG1).generate_msgdef(STATIC.type)
    said = found[0] if found else {
        b"type": STATIC.type.replace("/msg/", "/").encode(), b"md5sum": digest.encode(),
        b"message_definition": definition.encode(),
    }  # fmt: skip
    said = {name: each for name, each in said.items() if name != b"callerid"}
    number = max(known, default=-1) + 1
    made = connection(number, topic, {**said, b"topic": topic.encode(), b"latching": b"1"})
    recording.connections = {number: made, **known}  # first, so that its messages come first among those of one time
    return number
