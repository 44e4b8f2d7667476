"""Bags: ROS 1, ROS 2 (sqlite3) and MCAP files through the rosbags library, the extra `frametool[bag]`.

Every topic that holds transforms is read, with whatever namespace; what comes by a topic `tf_static` stands still.
"""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frametool.errors import FileProblem, FormatError, FrametoolError, ValueInvalid, shown
from frametool.frames.stamps import BILLION
from frametool.geometry import quaternion
from frametool.grammar.edges import Edge
from frametool.ros.message_bytes import RawTransform
from frametool.ros.messages import POSES, STAMPS, body_of, stamp_problem
from frametool.ros.plain_messages import unit_components
from frametool.ros.pose_lists import posed_messages

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Options, Tally

LOST = "SELECT count(*) FROM messages WHERE topic_id NOT IN (SELECT id FROM topics)"
NO_SUMMARY = "{} has no summary: whether it lost messages cannot be known"
TYPES = frozenset(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"))


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the transforms of a bag in the order they were recorded.

    An edge's line is the number of its message among those with transforms.
    Raises FileProblem when the extra is missing; FormatError for a bag that is broken or holds no transforms.
    """
    try:
        with opened_bag(file.path, options.tally) as reader:
            yield from _transforms(reader, file.path, options)
    except FormatError as error:
        options.report(error)


@contextmanager
def opened_bag(path: str, tally: Tally) -> Iterator[Any]:
    """Open a bag and yield its reader; whatever the library raises for a broken one is one error."""
    refuse_empty(path)
    try:
        import rosbags.highlevel  # noqa: F401 - whether it is there

        from frametool.ros.bag_reader import BagReader
    except ImportError:
        raise FileProblem(f"{path}: bags are read with an extra; install it: pip install 'frametool[bag]'") from None

    if path == "-":
        raise FileProblem("stdin: a bag cannot be read from a pipe; name its file")
    with broken(path):
        check_files(path, tally)
        with BagReader([Path(path)]) as reader:
            yield reader


@contextmanager
def broken(path: str) -> Iterator[None]:
    """Make one error of whatever reading a broken bag raises: anything, also MemoryError."""
    try:
        yield
    except (FrametoolError, BrokenPipeError):
        raise
    except Exception as error:  # noqa: BLE001 - see above
        said = f"{type(error).__name__}: {error}"[:100].replace("\n", " ")
        raise FormatError(f"the bag cannot be read; is it whole, and its suffix right? ({said})", source=path) from None


def refuse_empty(path: str) -> None:
    """Raise FormatError for an empty file, whose suffix alone says that it is a bag."""
    if path != "-" and Path(path).is_file() and not Path(path).stat().st_size:
        raise FormatError("nothing in it: an empty file is no bag", source=path)


def check_files(path: str, tally: Tally) -> None:
    """Check what the library does not: the pages of sqlite3; tell if an MCAP file has no counts to compare with."""
    for file in sorted(Path(path).iterdir()) if Path(path).is_dir() else [Path(path)]:
        if file.suffix == ".db3":
            _check_database(file)
        elif file.suffix == ".mcap" and _tail(file)[:8] == bytes(8):
            tally.note(NO_SUMMARY.format(file.name), 1)


def _tail(file: Path) -> bytes:
    """Return the last 28 bytes: of MCAP, where the summary begins, and what follows."""
    with file.open("rb") as stream:
        stream.seek(-28, 2)
        return stream.read()


def _check_database(file: Path) -> None:
    """Let sqlite3 check its pages: rows on a broken one would be missing without a word."""
    from sqlite3 import connect

    database = connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)
    try:
        ((said,),) = database.execute("PRAGMA quick_check(1)").fetchall()
        ((lost,),) = database.execute(LOST).fetchall() if said == "ok" else [[0]]
    finally:
        database.close()
    if said != "ok" or lost:
        said = f"{lost} messages belong to no topic" if lost else " ".join(said.split())[:100]
        raise FormatError(f"the bag is damaged: {said}", source=str(file))


def _transforms(reader: Any, path: str, options: Options) -> Iterator[Edge]:
    """Walk the messages of every topic with transforms; there must be as many as the bag says."""
    refuse_foreign(reader, options.topics.chosen, path)
    topics = [connection for connection in reader.connections if _is_read(connection, options)]
    options.topics.seen |= {connection.topic for connection in reader.connections}
    for other in reader.connections:
        if other not in topics and other.topic.rpartition("/")[2] in ("tf", "tf_static"):
            raise FormatError(f"{other.topic} holds {other.msgtype} and no transforms; is it damaged?", source=path)
    if not topics:
        poses = sorted({connection.topic for connection in reader.connections if connection.msgtype in POSES})
        foreign = {f"{topic} ({encoding})" for topic, encoding in reader.foreign.items()}
        known = ", ".join(sorted(options.topics.seen | foreign))
        hint = f"; --topic {poses[0]} reads its poses" if poses else ""
        what = f"no transforms in the bag; its topics: {known}{hint}" if known else "no messages in the bag"
        raise FormatError(what, source=path)
    number = 0
    for number, (topic, received_ns, data) in enumerate(reader.messages(connections=topics), 1):
        message = reader.deserialize(data, topic.msgtype)
        for transform in posed_messages(message, topic.msgtype) if topic.msgtype in POSES else message.transforms:
            said = _said(transform, topic.topic, options)
            if edge := recorded_edge(said, number, topic.topic, received_ns, path, options):
                yield edge
    check_count(reader, topics, number, path)
    if not number:
        raise FormatError(f"no messages on {', '.join(topic.topic for topic in topics)}", source=path)


def refuse_foreign(reader: Any, chosen: Collection[str], path: str) -> None:
    """Raise FormatError for a topic that is asked for and whose messages are in another encoding than ROS's."""
    wanted = {topic.strip("/") for topic in chosen}
    for topic, encoding in reader.foreign.items():
        if topic.strip("/") in wanted:
            raise FormatError(f"the messages of {topic} are encoded as {shown(encoding)}; cdr is read", source=path)


def check_count(reader: Any, topics: list[Any], number: int, path: str) -> None:
    """Raise FormatError unless as many messages were there on some topics as the bag says."""
    expected = _expected(reader, topics)
    if number != expected:
        names = ", ".join(sorted({topic.topic for topic in topics}))
        raise FormatError(f"the bag is damaged: {number} of {expected} messages on {names} are there", source=path)


def _expected(reader: Any, topics: list[Any]) -> int:
    """Return how many messages the bag says are there on some topics; a ROS 1 bag says it chunk by chunk."""
    chunks = [chunk.connection_counts for each in reader.readers for chunk in getattr(each, "chunk_infos", ())]
    if not chunks:
        return sum(topic.msgcount for topic in topics)
    others = {connection.id for connection in reader.connections} - {topic.id for topic in topics}
    return sum(count for counts in chunks for number, count in counts.items() if number not in others)


def _is_read(connection: Any, options: Options) -> bool:
    """Tell whether a topic holds transforms, or was chosen and holds poses."""
    kind = connection.msgtype
    return kind in TYPES or (kind in POSES and options.topics.chooses(connection.topic))


def _said(message: Any, topic: str, options: Options) -> RawTransform:
    """Return what a TransformStamped says, or a pose over time."""
    if hasattr(message, "transform"):
        named, moved, turned = message.child_frame_id, message.transform.translation, message.transform.rotation
    else:
        pose = getattr(message.pose, "pose", message.pose)
        named = getattr(message, "child_frame_id", "") or body_of(topic, options.answers)
        moved, turned = pose.position, pose.orientation
    numbers = moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w
    stamp = message.header.stamp
    return RawTransform(message.header.frame_id, named, numbers, (stamp.sec, stamp.nanosec))


def recorded_edge(
    said: RawTransform, number: int, topic: str, received_ns: int, path: str, options: Options
) -> Edge | None:
    """Return the edge that a message on a topic says; None where the topic does not count.

    number: of the message among those with transforms
    Raises FormatError for one that is none.
    """
    if not options.topics.takes(topic):
        return None
    tally = options.tally
    parent, child = tally.names.bare(said.parent), tally.names.bare(said.child)
    components = unit_components(said.numbers, number, tally, options.normalize)
    if components is None or not parent or not child:
        problem = _complaint(parent, child, said.numbers, normalize=options.normalize)
        edge = f"{shown(parent)} -> {shown(child)}"
        raise FormatError(f"message {number}: {edge}: {problem}", source=path, rule=problem.rule)
    if misfit := stamp_problem(*said.stamp, STAMPS[0]):
        raise FormatError(f"message {number}: {parent!r} -> {child!r}: {misfit}", source=path)
    if clash := options.topics.conflict(topic, child):
        options.report(FormatError(clash, source=path, rule="two-topics"))
    stamp_ns = None if topic.endswith("tf_static") else said.stamp[0] * BILLION + said.stamp[1]
    return Edge(parent, child, components, stamp_ns, number, received_ns, topic=topic)


def _complaint(parent: str, child: str, numbers: tuple[float, ...], *, normalize: bool) -> ValueInvalid:
    """Say what is wrong with a transform that was refused."""
    if not parent or not child:
        return ValueInvalid("an empty frame name")
    problem = quaternion.complaint(*numbers[3:], normalize=normalize)
    return problem or ValueInvalid("its position is not finite", rule="not-finite")
