"""Points and free vectors: records with a position and no rotation, in the spellings people use.

{frame: lidar, point: [1, 2, 3]}     {x: 1, y: 2, z: 3}     {vector: {x: 0, y: 0, z: 1}}     [1, 2, 3]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.formats.records import read_all, read_one_pose
from frametool.grammar.pose import POSITION_KEYS, read_name, read_position
from frametool.grammar.readers import Misfit, Reading, read_numbers, within
from frametool.grammar.rotation import AXES_KEY, ROTATION_KEYS
from frametool.ros.messages import MESSAGE_KEYS

if TYPE_CHECKING:
    from frametool.documents.source import Source
    from frametool.grammar.readers import Vector


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
        """Return the record, spelled as it was read."""
        unit = POINT_KEYS.get(self.key, 1.0)
        values = [value / unit for value in self.position]
        about = {key: name for key, name in (("frame", self.frame), ("name", self.name)) if name is not None}
        if not self.key:
            return about | dict(zip("xyz", values, strict=True))
        return about | {self.key: dict(zip("xyz", values, strict=True)) if self.named else values}


def read_moveables(source: Source, *, degrees: bool = False, normalize: bool = False) -> list[Any]:
    """Read every point and pose of a text: what has a rotation is a pose, what has only a position a point.

    ROS messages that can be moved are `frametool.ros.stamped.Stamped`.
    """
    return read_all(source, _moveable, degrees=degrees, normalize=normalize)


def _moveable(value: Any, reading: Reading) -> Any:
    """Read a point if there is a position and no rotation, else a pose; a ROS message as what it is."""
    if type(value) is dict and not MESSAGE_KEYS.isdisjoint(value) and "child_frame_id" not in value:
        from frametool.ros.stamped import kind_of, read_stamped

        if key := kind_of(value):
            return read_stamped(value, key, reading)
    if type(value) is list and len(value) == 3 and not any(type(item) is list for item in value):
        return Point(read_position(value, 1.0))
    if type(value) is not dict or any(key in ROTATION_KEYS or key in ("child_frame_id", AXES_KEY) for key in value):
        return read_one_pose(value, reading)
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
