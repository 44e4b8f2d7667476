"""Stamped geometry: ROS messages with a point, vector, pose, transform, wrench or twist that can be moved.

    {header: {stamp: {sec: 1, nanosec: 0}, frame_id: lidar}, point: {x: 1.0, y: 0.0, z: 0.0}}

Frame and stamp are those of the header; what is not moved stays as it was. A pose and a twist may come with their
covariance (36 numbers, row-major). Bare Twist and Wrench messages have no header.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.geometry import floats, quaternion, rigid, spatial
from frametool.grammar.readers import Misfit, as_mapping, read_numbers, within
from frametool.ros import messages
from frametool.ros.message_parts import frame_of, header_stamp, read_rigid, whole_list
from frametool.text.numbers import NotFinite, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Reading

XYZ = ("x", "y", "z")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"-?(0|[1-9]\d*)", re.ASCII)
_TRUTH = {"true": True, "True": True, "false": False, "False": False}
_NAMES = frozenset(("frame_id", "child_frame_id", "name", "frame"))


class Kind(NamedTuple):
    """What a field holds: the names of its parts, and what moving does to its numbers."""

    parts: tuple[str, ...]
    move: Callable[..., Sequence[float]]


def _turn(_x: float, _y: float, _z: float, *numbers: float) -> Sequence[float]:
    return quaternion.rotate(*numbers)


def _compose(*numbers: float) -> Sequence[float]:
    moved = rigid.compose(*numbers)
    return (*moved[:3], *quaternion.from_quaternion(*moved[3:], floats))


KINDS = {
    "point": Kind((), rigid.apply),
    "vector": Kind((), _turn),
    "pose": Kind(("position", "orientation"), _compose),
    "transform": Kind(("translation", "rotation"), _compose),
    "wrench": Kind(("force", "torque"), spatial.move_wrench),
    "twist": Kind(("linear", "angular"), spatial.move_twist),
}
BARE = ("wrench", "twist")  # these messages also come without a header, as their parts alone
RIGID = ("pose", "transform")
COVARIANT = ("pose", "twist")


class Stamped(NamedTuple):
    """A message of one kind, its frame and stamp, and the numbers that moving changes."""

    message: dict[str, Any]
    key: str
    numbers: Sequence[float]
    covariance: Sequence[float] | None = None
    frame: str | None = None
    stamp_ns: int | None = None
    listed: str = ""  # the list that a TFMessage holds it in
    path: Path = ()  # where it stands in the document
    form: str = ""  # how it was written: ros1, ros2, json; "" for the grammar of poses and points

    def moved(self, target_from_source: Rigid, target: str | None) -> Stamped:
        """Return the message as seen from the target, at its own stamp."""
        numbers = KINDS[self.key].move(*target_from_source, *self.numbers)
        covariance = self.covariance
        if covariance is not None and self.key == "twist":
            covariance = spatial.move_twist_covariance(*target_from_source, covariance)
        elif covariance is not None:
            covariance = spatial.rotate_covariance(*target_from_source[3:], covariance)
        return self._replace(numbers=numbers, covariance=covariance, frame=target or self.frame)

    def mapping(self) -> dict[str, Any]:
        """Return the message with the numbers and the frame it has now; each transform in a TFMessage of its own."""
        message = plain(self._message())
        return {self.listed: [message]} if self.listed else message

    def _message(self) -> dict[str, Any]:
        message = dict(self.message)
        if "header" in message and self.frame is not None:
            message["header"] = message["header"] | {"frame_id": self.frame}
        inner = self._parts()
        if self.key not in message:
            return message | inner
        if self.key in message[self.key]:
            inner = message[self.key] | {self.key: message[self.key][self.key] | inner}
        if self.covariance is not None:
            inner = inner | {"covariance": list(self.covariance)}
        return message | {self.key: message[self.key] | inner}

    def _parts(self) -> dict[str, Any]:
        """Return the numbers under the names they have in a message."""
        kind = KINDS[self.key]
        if not kind.parts:
            return dict(zip(XYZ, self.numbers, strict=True))
        first, second = kind.parts
        return {
            first: dict(zip(XYZ, self.numbers[:3], strict=True)),
            second: dict(zip("xyzw", self.numbers[3:], strict=False)),
        }


def kind_of(message: Any) -> str | None:
    """Name the kind of a message that can be moved; None for everything else."""
    if type(message) is not dict:
        return None
    if "header" in message:
        return next((key for key in KINDS if key in message), None)
    return next((key for key in BARE if all(part in message for part in KINDS[key].parts)), None)


def read_stamped(message: dict[str, Any], key: str, reading: Reading) -> Stamped:
    """Read a message of a kind that `kind_of` named.

    Raises Misfit with the path.
    """
    frame, stamp_ns = None, None
    if "header" in message:
        header = within(("header",), as_mapping, message["header"], "a header {stamp, frame_id}")
        frame = frame_of(header, "frame_id", ("header",), reading) if header.get("frame_id") else None
        stamp_ns = header_stamp(header)
    path: Path = (key,) if key in message else ()
    inner = within(path, as_mapping, message[key], f"the {key} as a mapping") if path else message
    covariance = None
    if key in COVARIANT and key in inner:
        covariance = within(path, _covariance, inner) if "covariance" in inner else None
        inner, path = within((key, key), as_mapping, inner[key], f"the {key} as a mapping"), (key, key)
    numbers = within(path, _numbers, key, inner, reading)
    return Stamped(message, key, numbers, covariance, frame, stamp_ns)


def _numbers(key: str, inner: dict[str, Any], reading: Reading) -> Sequence[float]:
    """Read the numbers that moving changes."""
    parts = KINDS[key].parts
    if not parts:
        return read_numbers(inner, XYZ)
    if key in RIGID:
        position, rotation = read_rigid(inner, (parts[0], parts[1]), reading)
        return (*position, *rotation)
    if missing := [part for part in parts if part not in inner]:
        raise Misfit(f"missing {', '.join(missing)}")
    return [number for part in parts for number in within((part,), read_numbers, inner[part], XYZ)]


def _covariance(inner: dict[str, Any]) -> list[float]:
    """Read 36 numbers, row-major."""
    values = within(("covariance",), whole_list, inner["covariance"], "36 numbers")
    names = [f"c{row}{column}" for row in range(6) for column in range(6)]
    numbers: tuple[float, ...] = within(("covariance",), read_numbers, values, names)
    return list(numbers)


def plain(value: Any, key: str = "") -> Any:
    """Turn the texts of a message into what they stand for, so that it can be written; names stay text."""
    if type(value) is dict:
        return {name: plain(each, name) for name, each in value.items()}
    if type(value) is list:
        return [plain(each, key) for each in value]
    if type(value) is not str or key in _NAMES:
        return value
    if _WHOLE.fullmatch(value):
        return int(value)
    try:
        return parse_number(value) if _NUMBER.fullmatch(value) else _TRUTH.get(value, value)
    except NotFinite:
        return value


def moveables(value: Any, reading: Reading) -> Iterator[Stamped]:
    """Yield every message that can be moved in a value: itself, the items of a list, the transforms of a TFMessage.

    Raises Misfit for a message of another kind.
    """
    for message, path in _each(value, ()):
        reading.here = path
        key = kind_of(message)
        if key is None:
            found = ", ".join(map(repr, list(message)[:8])) if type(message) is dict else repr(message)
            raise Misfit(f"expected a header and one of {', '.join(KINDS)}; found {found}", path)
        stamped = within(path, read_stamped, message, key, reading)
        yield stamped._replace(path=path, listed=str(path[-2]) if path[-2:-1] and path[-2] in messages.LISTS else "")


def _each(value: Any, path: Path) -> Iterator[tuple[Any, Path]]:
    if type(value) is list:
        for index, item in enumerate(value):
            yield from _each(item, (*path, index))
    elif type(value) is dict and messages.is_envelope(value):
        yield from _each(value["msg"], (*path, "msg"))
    elif type(value) is dict and any(key in value for key in messages.LISTS):
        yield from messages.messages(value, path)
    else:
        yield value, path


def spelling(message: dict[str, Any]) -> str:
    """Name the ROS that a message looks like: by its header, else the newer one."""
    header = message.get("header") or {}
    return "ros1" if "seq" in header or "secs" in (header.get("stamp") or ()) else "ros2"
