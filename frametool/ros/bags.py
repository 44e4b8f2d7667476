"""Bags: ROS 1, ROS 2 (sqlite3) and MCAP files through the rosbags library, the extra `frametool[bag]`.

Every topic that holds transforms is read, with whatever namespace; what comes by a topic `tf_static` stands still.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import FileProblem, FormatError, FrametoolError, ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.geometry import quaternion
from frametool.grammar.edges import Edge
from frametool.ros.echo_blocks import unit_components

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile
    from frametool.grammar.edges import Options

TYPES = frozenset(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"))


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the transforms of a bag in the order they were recorded.

    An edge's line is the number of its message among those with transforms.
    Raises FileProblem when the extra is missing; FormatError for a bag that is broken or holds no transforms.
    """
    try:
        yield from _edges(file.path, options)
    except FormatError as error:
        options.report(error)


def _edges(path: str, options: Options) -> Iterator[Edge]:
    """Open the bag; whatever the library raises for a broken one is one error."""
    try:
        from rosbags.highlevel import AnyReader
    except ImportError:
        raise FileProblem(f"{path}: bags are read with an extra; install it: pip install 'frametool[bag]'") from None
    from pathlib import Path

    if path == "-":
        raise FileProblem("stdin: a bag cannot be read from a pipe; name its file")
    try:
        with AnyReader([Path(path)]) as reader:
            yield from _transforms(reader, path, options)
    except FrametoolError:
        raise
    except Exception as error:  # noqa: BLE001 - a broken bag makes the library raise anything, also MemoryError
        said = f"{type(error).__name__}: {error}"[:100].replace("\n", " ")
        raise FormatError(f"the bag cannot be read; is it whole, and its suffix right? ({said})", source=path) from None


def _transforms(reader: Any, path: str, options: Options) -> Iterator[Edge]:
    """Walk the messages of every topic with transforms."""
    topics = [connection for connection in reader.connections if connection.msgtype in TYPES]
    if not topics:
        known = ", ".join(sorted({connection.topic for connection in reader.connections}))
        raise FormatError(f"no transforms in the bag; its topics: {known or 'none'}", source=path)
    for number, (topic, received_ns, data) in enumerate(reader.messages(connections=topics), 1):
        still = topic.topic.endswith("tf_static")
        for transform in reader.deserialize(data, topic.msgtype).transforms:
            edge = _edge(transform, number, path, options)
            yield edge._replace(stamp_ns=None if still else edge.stamp_ns, received_ns=received_ns)


def _edge(message: Any, number: int, path: str, options: Options) -> Edge:
    """Return one TransformStamped."""
    tally = options.tally
    moved, turned = message.transform.translation, message.transform.rotation
    numbers = moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w
    parent, child = tally.names.bare(message.header.frame_id), tally.names.bare(message.child_frame_id)
    components = unit_components(tally, number, *numbers, normalize=options.normalize)
    if components is None or not parent or not child:
        problem = _complaint(parent, child, numbers, normalize=options.normalize)
        edge = f"{shown(parent)} -> {shown(child)}"
        raise FormatError(f"message {number}: {edge}: {problem}", source=path, rule=problem.rule)
    stamp = message.header.stamp
    return Edge(parent, child, components, stamp.sec * BILLION + stamp.nanosec, number)


def _complaint(parent: str, child: str, numbers: tuple[float, ...], *, normalize: bool) -> ValueInvalid:
    """Say what is wrong with a transform that was refused."""
    if not parent or not child:
        return ValueInvalid("an empty frame name")
    problem = quaternion.complaint(*numbers[3:], normalize=normalize)
    return problem or ValueInvalid("its position is not finite", rule="not-finite")
