"""What the turtles do, as text: velocity commands, poses, transforms; one table of kinds, each in every form.

    linear: {x: ..}, angular: {..}                                  YAML: messages as `ros2 topic echo` prints them
    {"t": 0.1, "turtle": "turtle2", "linear": {"x": ..}, "angular": {"z": ..}}             JSON: one object a line
    t,turtle,linear_x,angular_z,distance,leader_x,leader_y,leader_theta,x,y,theta          CSV; of transforms, ROS 2's

Metres, radians, seconds; quaternions x, y, z, w; a transform is the pose of the child in its parent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.json_writer import dump as json_dump
from frametool.documents.yaml_writer import dump as yaml_dump
from frametool.frames.stamps import BILLION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.sim.simulate import Broadcast, Command, Step
    from frametool.sim.turtle import TurtlePose

FORMS = ("text", "yaml", "json", "csv")
WIDTH = 10  # least, of a column in text
DECIMALS = 6


class Posed(NamedTuple):
    """A turtle's pose at a tick."""

    t_ns: int
    turtle: str
    pose: TurtlePose


class Kind(NamedTuple):
    """A kind of record: how to find it in a step, its cells by column, its message."""

    records: Callable[[Step], Iterator[Any]]
    cells: Callable[[Any], dict[str, Any]]
    message: Callable[[Any], dict[str, Any]]
    labels: Callable[[Any], dict[str, Any]]  # what JSON says before the message
    bare_row: Callable[[Any], list[Any]] | None = None  # CSV as ROS 2 writes it, without a header


class Writer:
    """Write the records of steps: emit is a name of KINDS, form one of FORMS, number writes floats.

    leaders: the commands of leaders too, not only of followers.  labelled: say in a comment whose a message of YAML is.
    """

    def __init__(
        self, emit: str, form: str, number: Callable[[float], str] | None = None, *,
        leaders: bool = False, labelled: bool = False,
    ) -> None:  # fmt: skip
        """Settle what is written and how."""
        self._kind = KINDS["all commands" if leaders and emit == "commands" else emit]
        self._form = form
        self._number = number
        self._write: Callable[[Any], str] = getattr(self, f"_{form}")
        self._labelled = labelled
        self._headed = False

    def write(self, step: Step) -> Iterator[str]:
        """Yield each record of a step, the first one below the header if the form has one."""
        for record in self._kind.records(step):
            if not self._headed:
                self._headed = True
                yield self._header(record)
            yield self._write(record)

    def _header(self, record: Any) -> str:
        columns = list(self._kind.cells(record))
        if self._form == "text":
            return _aligned(columns, columns)
        return ",".join(columns) + "\n" if self._form == "csv" and self._kind.bare_row is None else ""

    def _yaml(self, record: Any) -> str:
        labels = self._kind.labels(record) if self._labelled else None
        comment = f"# {labels['turtle']} at {labels['t']} s\n" if labels else ""
        return comment + "".join(_block(self._kind.message(record), self._number or repr)) + "---\n"

    def _json(self, record: Any) -> str:
        return f"{json_dump(self._kind.labels(record) | self._kind.message(record), self._number or repr)}\n"

    def _csv(self, record: Any) -> str:
        cells = self._kind.bare_row(record) if self._kind.bare_row else self._kind.cells(record).values()
        return ",".join(_csv_cell(cell, self._number) for cell in cells) + "\n"

    def _text(self, record: Any) -> str:
        cells = self._kind.cells(record)
        texts = [f"{cells['t']:.3f}", *(_text_cell(cell, self._number) for cell in list(cells.values())[1:])]
        return _aligned(texts, list(cells))


def table(rows: Sequence[dict[str, float | None]], form: str, number: Callable[[float], str] | None = None) -> str:
    """Write rows of numbers, at least one, in one of FORMS; what is None is -, null or empty.

    number: writes floats; without it text has six decimals, the others the shortest that reads back.
    """
    if form == "json":
        return "".join(f"{json_dump(row, number or repr)}\n" for row in rows)
    if form == "yaml":
        return "".join(_yaml_line(row, number or repr) for row in rows)
    cells = _csv_cell if form == "csv" else _text_cell
    lines = [[cells(cell, number) for cell in row.values()] for row in rows]
    columns = list(rows[0])
    return "".join(_aligned(line, columns) if form == "text" else ",".join(line) + "\n" for line in [columns, *lines])


def _yaml_line(row: dict[str, float | None], number: Callable[[float], str]) -> str:
    """Write an item of a list, on one line whatever is missing."""
    return "- {" + ", ".join(f"{key}: {yaml_dump(cell, number).rstrip()}" for key, cell in row.items()) + "}\n"


def _csv_cell(cell: Any, number: Callable[[float], str] | None) -> str:
    if cell is None:
        return ""
    return (number or repr)(cell) if isinstance(cell, float) else str(cell)


def _text_cell(cell: Any, number: Callable[[float], str] | None) -> str:
    """Round for reading; zero has no sign there."""
    if not isinstance(cell, float):
        return "-" if cell is None else str(cell)
    return number(cell) if number else f"{round(cell, DECIMALS) + 0.0:.{DECIMALS}f}"


def _commands(step: Step) -> Iterator[Command]:
    yield from step.commands


def _all_commands(step: Step) -> Iterator[Command]:
    yield from step.led
    yield from step.commands


def _command_cells(command: Command) -> dict[str, Any]:
    leader = command.leader or (None, None, None)
    return {
        "t": command.t_ns / BILLION, "turtle": command.turtle, "linear_x": command.twist.linear_x,
        "angular_z": command.twist.angular_z, "distance": command.distance,
        "leader_x": leader[0], "leader_y": leader[1], "leader_theta": leader[2], **command.state._asdict(),
    }


def _twist(command: Command) -> dict[str, Any]:
    """Return a geometry_msgs/Twist."""
    ahead, turning, aside = command.twist
    return {"linear": {"x": ahead, "y": aside, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turning}}


def _poses(step: Step) -> Iterator[Posed]:
    """Yield the poses of a tick; what is there at time 0 has not moved yet."""
    if step.t_ns:
        yield from (Posed(step.t_ns, name, pose) for name, pose in step.poses.items())


def _pose_cells(posed: Posed) -> dict[str, Any]:
    return _labels(posed) | posed.pose._asdict()


def _pose_message(posed: Posed) -> dict[str, Any]:
    """Return a turtlesim/Pose."""
    return posed.pose._asdict()


def _labels(record: Command | Posed) -> dict[str, Any]:
    return {"t": record.t_ns / BILLION, "turtle": record.turtle}


def _transforms(step: Step) -> Iterator[Broadcast]:
    yield from step.broadcasts


def _transform_cells(broadcast: Broadcast) -> dict[str, Any]:
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    labels = {"t": broadcast.stamp_ns / BILLION, "parent": broadcast.parent, "child": broadcast.child}
    return labels | dict(zip(names, broadcast.transform.components, strict=True))


def _transform_row(broadcast: Broadcast) -> list[Any]:
    """Return what `ros2 topic echo --csv /tf` prints."""
    seconds, nanoseconds = divmod(broadcast.stamp_ns, BILLION)
    return [seconds, nanoseconds, broadcast.parent, broadcast.child, *broadcast.transform.components]


def _transform_message(broadcast: Broadcast) -> dict[str, Any]:
    """Return a geometry_msgs/TransformStamped."""
    seconds, nanoseconds = divmod(broadcast.stamp_ns, BILLION)
    numbers = broadcast.transform.components
    return {
        "header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": broadcast.parent},
        "child_frame_id": broadcast.child,
        "transform": {
            "translation": dict(zip("xyz", numbers[:3], strict=True)),
            "rotation": dict(zip("xyzw", numbers[3:], strict=True)),
        },
    }


KINDS = {
    "commands": Kind(_commands, _command_cells, _twist, _labels),
    "all commands": Kind(_all_commands, _command_cells, _twist, _labels),
    "poses": Kind(_poses, _pose_cells, _pose_message, _labels),
    "tf": Kind(_transforms, _transform_cells, _transform_message, lambda _: {}, _transform_row),
}
EMITS = ("commands", "poses", "tf")


def _block(message: dict[str, Any], number: Callable[[float], str], indent: str = "") -> Iterator[str]:
    """Write nested mappings as `ros2 topic echo` does."""
    for key, value in message.items():
        if isinstance(value, dict):
            yield f"{indent}{key}:\n"
            yield from _block(value, number, indent + "  ")
        else:
            yield f"{indent}{key}: {yaml_dump(value, number)}"


def _aligned(cells: list[str], columns: list[str]) -> str:
    """Write a line, each cell to the right below its column's name."""
    return " ".join(f"{cell:>{max(WIDTH, len(name))}}" for cell, name in zip(cells, columns, strict=True)) + "\n"
