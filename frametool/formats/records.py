"""Single records out of a text: poses, points and vectors, in the grammar or as ROS messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import FormatError
from frametool.formats import ros
from frametool.formats.documents import format_error, parse_documents
from frametool.formats.load import tell
from frametool.formats.pose import POSITION_KEYS, Pose, read_name, read_pose, read_position
from frametool.formats.rotations import ROTATION_KEYS, read_rotation
from frametool.formats.values import Misfit, Reading, kind, read_numbers, within

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.formats.source import Source
    from frametool.formats.values import Path, Vector

POINT_KEYS = {"point": 1.0, "vector": 1.0, **POSITION_KEYS}  # with metres a unit
BESIDE_POINT = ("frame", "name")


class Point(NamedTuple):
    """One position or free vector, in metres: the key it stood under ("" for bare x, y, z), and its frame."""

    position: Vector
    key: str = "point"
    named: bool = False  # written {x:, y:, z:} rather than [x, y, z]
    frame: str | None = None
    name: str | None = None

    @property
    def is_vector(self) -> bool:
        """Tell whether it has a direction and a length but no place: it rotates and does not shift."""
        return self.key == "vector"

    def mapping(self) -> dict[str, Any]:
        """Give the record, spelled as it was read."""
        unit = POINT_KEYS.get(self.key, 1.0)
        values = [value / unit for value in self.position]
        about = {key: name for key, name in (("frame", self.frame), ("name", self.name)) if name is not None}
        if not self.key:
            return about | dict(zip("xyz", values, strict=True))
        return about | {self.key: dict(zip("xyz", values, strict=True)) if self.named else values}


def read_poses(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Pose]:
    """Read every pose of a text, in order; at least one.

    Raises FormatError with the place.
    """
    return _read_all(source, _pose, degrees=degrees, normalize=normalize)


def read_moveables(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Pose | Point]:
    """Read every point and pose of a text: what has a rotation is a pose, what has only a position a point."""
    return _read_all(source, _moveable, degrees=degrees, normalize=normalize)


def _read_all(source: Source, read: Callable[[Any, Reading], Any], *, degrees: bool, normalize: bool) -> list[Any]:
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
        tell(source, reading.notes)
    if not records:
        raise FormatError("nothing in it; a pose is {xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}", source=source.name)
    return records


def _items(value: Any) -> Iterator[tuple[Any, Path]]:
    """Give the records of a document: itself, the entries of a list, the messages of a ROS list."""
    if type(value) is list and all(type(item) is dict for item in value):
        for index, item in enumerate(value):
            yield from ((each, (index, *path)) for each, path in _items(item))
    elif type(value) is dict and ros.is_message(value):
        yield from ros.messages(value, ())
    else:
        yield value, ()


def _pose(value: Any, reading: Reading) -> Pose:
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
        parent, child, position, rotation, _ = ros.read_transform(value, reading)
        return Pose(position, rotation, child, parent)
    return read_pose(value, reading)


def _moveable(value: Any, reading: Reading) -> Pose | Point:
    """Read a point if there is a position and no rotation, else a pose."""
    if type(value) is list and len(value) == 3 and not any(type(item) is list for item in value):
        return Point(read_position(value, 1.0))
    if type(value) is not dict or any(key in ROTATION_KEYS or key == "child_frame_id" for key in value):
        return _pose(value, reading)
    keys = [key for key in POINT_KEYS if key in value]
    if not keys and "x" in value:
        return _bare_point(value)
    if len(keys) != 1:
        raise Misfit(
            f"expected a point like {{point: [x, y, z]}} or a pose, found the keys {', '.join(map(repr, value))}"
        )
    key = keys[0]
    if unknown := [each for each in value if each != key and each not in BESIDE_POINT]:
        raise Misfit(f"unknown key {unknown[0]!r} beside {key}", (unknown[0],), key=True)
    position = within((key,), read_position, value[key], POINT_KEYS[key])
    return Point(position, key, type(value[key]) is dict, read_name(value, "frame"), read_name(value, "name"))


def _bare_point(value: dict[str, Any]) -> Point:
    """Read {x:, y:, z:}."""
    numbers = {key: each for key, each in value.items() if key not in BESIDE_POINT}
    x, y, z = read_numbers(numbers, ("x", "y", "z"))
    return Point((x, y, z), "", named=True, frame=read_name(value, "frame"), name=read_name(value, "name"))
