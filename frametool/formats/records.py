"""Single records out of a text: poses, points and vectors, in the grammar or as ROS messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import format_error, parse_documents
from frametool.errors import FormatError
from frametool.grammar.pose import Pose, read_pose
from frametool.grammar.readers import Misfit, Reading, kind, within
from frametool.grammar.rotation import read_rotation
from frametool.ros import messages

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.documents.source import Source
    from frametool.grammar.readers import Path


def read_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Pose]:
    """Read every pose of a text, in order; at least one.

    Raises FormatError with the place.
    """
    return read_all(source, read_one_pose, degrees=degrees, normalize=normalize)


def read_all(source: Source, read: Callable[[Any, Reading], Any], *, degrees: bool, normalize: bool) -> list[Any]:
    """Read the records of all documents; the items of a list of mappings count singly."""
    records = []
    for document in parse_documents(source.text, source.name):
        reading = Reading(source, degrees=degrees, normalize=normalize)
        try:
            for value, path in _items(document.value):
                reading.here = (document.index, *path)
                records.append(within(path, read, value, reading))
        except Misfit as misfit:
            place = (document.index, *misfit.path)
            raise format_error(source, place, str(misfit), key=misfit.key) from misfit
        if reading.notes:
            from frametool.formats.tree_reader import tell

            tell(source, reading.notes)
    if not records:
        raise FormatError("nothing in it; a pose is {xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}", source=source.name)
    return records


def _items(value: Any) -> Iterator[tuple[Any, Path]]:
    """Yield the records of a document: itself, the entries of a list, the messages of a ROS list."""
    if type(value) is list and all(type(item) is dict for item in value):
        for index, item in enumerate(value):
            yield from ((each, (index, *path)) for each, path in _items(item))
    elif type(value) is dict and messages.is_message(value):
        yield from messages.messages(value, ())
    else:
        yield value, ()


def read_one_pose(value: Any, reading: Reading) -> Pose:
    """Read one pose: a mapping of the grammar, a TransformStamped, or the rows of a matrix."""
    if type(value) is list and len(value) in (3, 4) and all(type(row) is list for row in value):
        position, rotation = read_rotation("matrix", value, reading)
        return Pose(position, rotation)
    if type(value) is list:
        raise Misfit(
            f"a bare list of {len(value)} numbers does not say what it is; write {{rpy_deg: [..]}}, {{xyzw: [..]}}, .."
        )
    if type(value) is not dict:
        raise Misfit(f"expected a pose like {{xyz: [x, y, z], rpy_deg: [..]}}, found {kind(value)}")
    if "child_frame_id" in value:
        parent, child, position, rotation, _ = messages.read_transform(value, reading, may_be_nameless=True)
        return Pose(position, rotation, child or None, parent or None)
    pose = read_pose(value, reading)
    if pose.position is None and pose.rotation is None:
        reading.note("neither position nor rotation: taken as the identity", rule="identity")
    return pose
