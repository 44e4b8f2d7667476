"""The steps of turtles as text: velocity commands, poses, transforms, in every format.

    linear: {x: ..}, angular: {..}                                  YAML: messages as `ros2 topic echo` prints them
    {"t": 0.1, "turtle": "turtle2", "linear": {"x": ..}, "angular": {"z": ..}}             JSON: one object per line
    t,turtle,linear_x,angular_z,distance,leader_x,leader_y,leader_theta,x,y,theta          CSV

Metres, radians, seconds; quaternions x, y, z, w; a transform is the pose of the child in its parent.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.json import dump
from frametool.errors import ValueInvalid, printable
from frametool.formats.rows.csv import row
from frametool.frames.stamps import BILLION
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.ros.echo_format import message_text, transform_stamped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from frametool.sim.simulate import IssuedCommand, SimulationStep

    Record = dict[str, Any]

FORMS = ("text", "yaml", "json", "csv")
EMITS = ("commands", "poses", "tf")
# of steps in text, whose lines must fit a terminal: millimetres and milliradians, with short names
STEP_DECIMALS = 3
SHORT = {
    "linear_x": "linear", "angular_z": "turning", "distance": "away",
    "leader_x": "lead_x", "leader_y": "lead_y", "leader_theta": "lead_th",
    "linear_velocity": "linear", "angular_velocity": "turning",
}  # fmt: skip


class Emission(NamedTuple):
    """One event of a step, in every shape that a format needs.

    cells: by column name, for text and CSV.
    message: the ROS message, for YAML and JSON.
    labels: time and turtle, if the message does not have them.
    """

    cells: Record
    message: Record
    labels: Record


class StepWriter:
    """Writes the contents of steps: emit is one of EMITS, style.form one of FORMS.

    leaders: the commands of leaders too, not only of followers.  labelled: name the turtle in a comment of a YAML
    message.
    """

    def __init__(self, emit: str, style: Style, *, leaders: bool = False, labelled: bool = False) -> None:
        """Store what is written and how."""
        self._emissions = _EMISSIONS["all commands" if leaders and emit == "commands" else emit]
        self._style = style
        self._labelled = labelled
        self._headed = False

    def write(self, step: SimulationStep) -> Iterator[str]:
        """Yield each record of a step, the first one below the header if the format has one."""
        for emission in self._emissions(step, self._style):
            if not self._headed:
                self._headed = True
                if self._style.format == "text":
                    yield _aligned({name: SHORT.get(name, name) for name in emission.cells})
                elif self._style.format == "csv":
                    yield row(emission.cells, self._style)
            yield self._record(emission)

    def _record(self, emission: Emission) -> str:
        labels, style = emission.labels, self._style
        match style.format:
            case "yaml":
                comment = f"# {printable(labels['turtle'])} at {labels['t']} s\n" if self._labelled and labels else ""
                return comment + message_text(emission.message, style)
            case "json":
                return f"{dump(labels | emission.message, style.number)}\n"
            case "csv":
                return row(emission.cells.values(), style)
        digits = STEP_DECIMALS if style.precision is None else style.precision
        texts = {}  # rounded for display; zero has no sign
        for name, cell in emission.cells.items():
            text = "-" if cell is None else printable(str(cell))
            texts[name] = f"{round(cell, digits) + 0.0:.{digits}f}" if isinstance(cell, float) else text
        return _aligned(texts | {"t": f"{emission.cells['t']:.3f}"})


def _aligned(texts: Record) -> str:
    """Format a line, each cell right-aligned in its column."""
    wide = ("turtle", "parent", "child")
    widths = {name: 7 if name in wide else max(6, len(SHORT.get(name, name))) for name in texts}
    return " ".join(f"{text:>{widths[name]}}" for name, text in texts.items()) + "\n"


def _commands(commands: Iterable[IssuedCommand]) -> Iterator[Emission]:
    """Yield commands, as geometry_msgs/Twist."""
    for command in commands:
        ahead, turning, aside = command.twist
        labels = {"t": command.t_ns / BILLION, "turtle": command.turtle}
        seen = zip(("leader_x", "leader_y", "leader_theta"), command.leader or (None, None, None), strict=True)
        cells = {"linear_x": ahead, "angular_z": turning, "distance": command.distance, **dict(seen)}
        message = {"linear": {"x": ahead, "y": aside, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turning}}
        yield Emission(labels | cells | command.state._asdict(), message, labels)


def _poses(step: SimulationStep, _: Style) -> Iterator[Emission]:
    """Yield the poses of a tick, as turtlesim/Pose; turtles at time 0 have not moved yet."""
    for name, pose in step.poses.items() if step.t_ns else ():
        if not all(map(math.isfinite, pose)):
            when = f"{name} at {step.t_ns / BILLION:g} s"
            raise ValueInvalid(f"{when}: its speed does not fit the float32 of a pose message")
        labels, message = {"t": step.t_ns / BILLION, "turtle": name}, pose._asdict()
        yield Emission(labels | message, message, labels)


def _transforms(step: SimulationStep, style: Style) -> Iterator[Emission]:
    """Yield the transforms that were published, as geometry_msgs/TransformStamped."""
    for stamp_ns, parent, child, transform in step.broadcasts:
        numbers = zip(("x", "y", "z", "qx", "qy", "qz", "qw"), transform.components, strict=True)
        cells = {"t": stamp_ns / BILLION, "parent": parent, "child": child, **dict(numbers)}
        result = Result(Pose.of(transform.components, child, parent), {"stamp_ns": stamp_ns})
        yield Emission(cells, transform_stamped(result, style), {})


_EMISSIONS: dict[str, Callable[[SimulationStep, Style], Iterator[Emission]]] = {
    "commands": lambda step, _: _commands(step.commands),
    "all commands": lambda step, _: _commands([*step.led, *step.commands]),
    "poses": _poses,
    "tf": _transforms,
}
