"""JointState messages: the positions of named joints, in the spellings of either ROS and of their echo tools' CSV.

    {header: {stamp: {sec: 1, nanosec: 0}, frame_id: ''}, name: [elbow, wrist], position: [0.5, -0.2], velocity: [], ..}
    %time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.position0,..   rostopic echo -p
    1683377979,902062451,,elbow,wrist,0.5,-0.2,0.1,0.0                                       ros2 topic echo --csv

Positions are radians or metres.  A message may speak of some joints only.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.errors import shown
from frametool.grammar.readers import Misfit, kind, within
from frametool.ros.messages import header_stamp, whole_list

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.readers import Path

LISTS = ("name", "position", "velocity", "effort")
_NUMBERED = re.compile(r"(name|position)(\d+)")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)")


def is_joint_state(value: dict[str, Any]) -> bool:
    """Tell whether a mapping is a JointState: it names joints in a list."""
    return type(value.get("name")) is list or ("position" in value and "velocity" in value and "name" in value)


def stamp_of_state(value: dict[str, Any]) -> int | None:
    """Return the stamp of the header in nanoseconds; None without one."""
    header = value.get("header")
    return header_stamp(header) if type(header) is dict else None


def positions(value: dict[str, Any]) -> Iterator[tuple[str, Any, Path]]:
    """Yield the name of each joint, its position as written, and the path to that.

    Raises Misfit.
    """
    names = within(("name",), whole_list, value["name"], "name as a list of joints")
    listed = within(("position",), whole_list, value.get("position", []), "position as a list of numbers")
    if not listed and names:
        raise Misfit("a JointState without positions says of no joint where it stands", ("name",), key=True)
    if len(names) != len(listed):
        raise Misfit(f"{len(names)} names and {len(listed)} positions; each joint has one", ("position",))
    for index, (name, position) in enumerate(zip(names, listed, strict=True)):
        if type(name) is not str or not name:
            raise Misfit(f"expected the name of a joint, found {kind(name or None)}", ("name", index))
        yield name, position, ("position", index)


def position_of(joint: str, value: Any) -> Path | None:
    """Return the path to the position of a joint below a JointState; None for what is none, or has no such joint."""
    if type(value) is not dict or type(value.get("name")) is not list or joint not in value["name"]:
        return None
    index = value["name"].index(joint)
    listed = value.get("position")
    return ("position", index) if type(listed) is list and index < len(listed) else None


def of_numbered(message: dict[str, Any]) -> dict[str, Any]:
    """Return the JointState of a row of `rostopic echo -p`, which numbers the entries of lists."""
    lists: dict[str, list[Any]] = {"name": [], "position": []}
    for key, value in message.items():
        if (match := _NUMBERED.fullmatch(key)) and int(match[2]) == len(lists[match[1]]):
            lists[match[1]].append(value)
    return {"header": message.get("header"), **lists}


def of_row(cells: Sequence[str]) -> dict[str, Any]:
    """Return the JointState of a row of `ros2 topic echo --csv`: names, then as many positions, velocities, efforts.

    Raises Misfit.
    """
    numbers = next((at for at in range(3, len(cells)) if _NUMBER.fullmatch(cells[at])), len(cells))
    names, rest = cells[3:numbers], cells[numbers:]
    if not names or len(rest) not in (len(names), 2 * len(names), 3 * len(names)):
        found = f"found {len(names)} names and {len(rest)} numbers"
        raise Misfit(f"expected sec,nanosec,frame_id, names of joints and a position for each; {found}")
    stamp = {"sec": cells[0], "nanosec": cells[1]}
    return {"header": {"stamp": stamp}, "name": [*names], "position": [*rest[: len(names)]]}


def looks_like_row(line: str) -> bool:
    """Tell a row of `ros2 topic echo --csv` from a header of CSV."""
    return re.match(r"-?\d+,\d+,[^,]*,[^,]*[A-Za-z_]", line) is not None


def unquoted(line: str) -> list[str]:
    """Cut a row that quotes nothing.

    Raises Misfit for one with quotes.
    """
    if '"' in line:
        raise Misfit(f"the echo tools quote nothing, found {shown(line)}")
    return [cell.strip() for cell in line.split(",")]
