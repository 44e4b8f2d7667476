"""Arguments of static_transform_publisher, calls (static1, static2), one a line: the pose of the child in its parent.

    --x 0.1 --y 0.0 --z 0.2 --qx 0.0 --qy 0.0 --qz 0.0 --qw 1.0 --frame-id base --child-frame-id camera      static2
    0.1 0.0 0.2 0.0 0.0 0.0 1.0 base camera                                                                  static1

Metres and radians; quaternions x, y, z, w. Angles are --roll --pitch --yaw in the new syntax and yaw, pitch, roll
in the old one, about fixed axes. The old tf package has a period in ms at the end. `ros2 run tf2_ros
static_transform_publisher` may precede them.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, Any

from frametool.documents.source import InputFile, Source
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.frames.topology import own_parent
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import ROTATION_KEYS, Pose, read_spelled
from frametool.grammar.readers import INDICES, Reading, read_number
from frametool.grammar.result import Result, Style, edge_results, rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames

CALL = "static_transform_publisher"
ROS_ARGUMENTS = "--ros-args"
XYZ = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
RPY = ("roll", "pitch", "yaw")
FRAMES = ("frame-id", "child-frame-id")
FLAGS = (*XYZ, *QUATERNION, *RPY, *FRAMES)
WITH_QUATERNION, WITH_ANGLES = (*XYZ, *QUATERNION, *FRAMES), (*XYZ, *RPY[::-1], *FRAMES)  # the old syntax
_NUMBER = re.compile(r"[-+]?(\d|\.\d)")
_FORMS = "x y z qx qy qz qw PARENT CHILD, or x y z yaw pitch roll PARENT CHILD"


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one line per pose.

    Raises ValueInvalid if a pose does not name both frames, if names cannot be read back, or if a frame has two poses.
    """
    from shlex import quote

    lines, different = [], dict[Any, str]()
    angles = bool(style.notations) and style.notations[0].representation.name == "rpy"
    names = WITH_ANGLES if angles else WITH_QUATERNION
    for pose in (result.pose for result in results):
        if not pose.name or not pose.parent:
            raise ValueInvalid(f"{CALL} needs the names of both frames; give name: and parent:")
        for name in (pose.parent, pose.name):
            if not name.isprintable() or (style.format == "static1" and any(map(str.isspace, name))):
                raise ValueInvalid(f"frame {name!r} cannot be written in {style.format}: it could not be read back")
        numbers = rotation_numbers(pose, notation("rpy_rad" if angles else "quaternion"), style)
        cells = [*map(style.number, (*pose.components[:3], *numbers)), quote(pose.parent), quote(pose.name)]
        flags = dict(zip((*XYZ, *(RPY if angles else QUATERNION), *FRAMES), cells, strict=True))
        if style.format == "static1":
            lines.append(" ".join(flags[name] for name in names))
        else:
            lines.append(" ".join(f"--{name} {cell}" for name, cell in flags.items()))
        different[pose.name, pose.parent, pose.components] = pose.name
    if moving := [name for name, count in Counter(different.values()).items() if count > 1]:
        raise ValueInvalid(moving_frames(moving))
    return "".join(f"{line}\n" for line in lines)


def moving_frames(names: Iterable[str]) -> str:
    """Return the message that frames have more than one pose."""
    return f"frames move and cannot be published as static: {', '.join(names)}"


def write_tree(tree: Frames, style: Style) -> str:
    """Return one line per edge."""
    return write_poses(edge_results(tree), style)


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the pose that each line publishes; a line that ends in a backslash continues in the next.

    Other lines of a script that calls the tool are skipped, with a warning.
    """
    line, others, in_script = 1, dict[int, str](), CALL in file.text
    for call in re.findall(r"(?:[ \t]*#.*|(?:.*\\\n)*.*)(?:\n|\Z)", re.sub("\r\n?", "\n", file.text)):
        if (bare := call.strip()) and not bare.startswith("#"):
            if in_script and CALL not in bare and not re.match(r"[-+.\d]", bare):
                others[line] = bare
            elif edge := read_edge(call, file, options, line):
                yield edge
        line += call.count("\n")
    for line, text in [*others.items()][:1]:
        many = "a line that publishes" if len(others) == 1 else f"{len(others)} lines that publish"
        options.tally.note(f"{many} nothing skipped: {shown(text)}", line)


def read_edge(
    arguments: str | Sequence[str], file: InputFile, options: Options, line: int, column: int = 0
) -> Edge | None:
    """Read the arguments of one call, a line or its words; None if they are invalid and the error is only reported."""
    reading = Reading(Source(file.name, ""), normalize=options.normalize)
    try:
        pose = read_call(arguments, reading) if isinstance(arguments, str) else read_words(arguments, reading)
    except ValueInvalid as error:
        options.report(FormatError(str(error), source=file.name, line=line, column=column, rule=error.rule))
        return None
    parent, child = reading.bare(pose.parent or ""), reading.bare(pose.name or "")
    options.tally.note_all(reading.notes, line)
    return Edge(parent, child, pose.components, line=line)


def read_call(line: str, reading: Reading) -> Pose:
    """Read one call, split as by a shell.

    Raises ValueInvalid.
    """
    from shlex import split

    # XML and YAML replace the end of a line by a blank
    line = re.sub(r"""('[^']*'|"[^"]*")|\\(?:\r?\n|\Z)|(?<!\S)\\\s+""", lambda found: found[1] or " ", line)
    try:
        words = split(line, comments=re.search(r"(?:^|\s)#", line) is not None)  # inside a word it is part of it
    except ValueError as error:
        raise ValueInvalid(f"a quote is not closed ({str(error).lower()})") from None
    return read_words(words, reading)


def read_words(words: Sequence[str], reading: Reading) -> Pose:
    """Read one call from its words; those before the tool's name, and those for ROS itself, are ignored.

    Its numbers have no units.
    Raises ValueInvalid.
    """
    reading.bare_numbers = True
    starts = [index for index, word in enumerate(words) if word.rsplit("/", 1)[-1] == CALL]
    if len(starts) > 1:
        raise ValueInvalid(f"{len(starts)} calls of {CALL} in one line; write one a line")
    words = list(words[starts[0] + 1 :] if starts else words)
    if ROS_ARGUMENTS in words:
        del words[words.index(ROS_ARGUMENTS) :]
    if words[-1:] == ["&"]:  # a script starts the tool in the background
        del words[-1]
    words = [word for word in words if ":=" not in word]  # remappings such as __name:=camera
    if not any(word.startswith("--") for word in words):
        return read_positional(words, reading)
    flags: dict[str, str] = {}
    rest = iter(words)
    for word in rest:
        name, equals, value = word.removeprefix("--").partition("=")
        if not word.startswith("--") or name not in FLAGS:
            raise ValueInvalid(f"unknown argument {shown(word)}; the flags are --{', --'.join(FLAGS)}")
        flags[name] = value if equals else next(rest, "")
        if not flags[name]:
            raise ValueInvalid(f"not enough arguments for --{name}")
    return read_flags(flags, reading)


def read_flags(flags: dict[str, str], reading: Reading) -> Pose:
    """Read the new syntax; missing values are 0 or the identity."""
    both = [name for name in (*QUATERNION, *RPY) if name in flags]
    angles = not {*both}.isdisjoint(RPY)
    if angles and not {*both}.isdisjoint(QUATERNION):
        raise ValueInvalid(f"a quaternion and angles at once (--{', --'.join(both)}); keep one")
    for name in FRAMES:
        if not flags.get(name):
            raise ValueInvalid(f"missing --{name}: a transform is that of a child frame in its parent")
    flags = {"qw": "1", **flags}  # the tool's default, also with other components: refused below unless they are 0
    x, y, z = (read_number(flags.get(name, "0")) for name in XYZ)
    key, names = ("rpy", RPY) if angles else ("quaternion", QUATERNION)
    turned = read_spelled(ROTATION_KEYS[key], [flags.get(name, "0") for name in names], INDICES, reading).rotation
    parent, child = (flags[name] for name in FRAMES)
    if parent == child:
        error = own_parent(child)
        raise ValueInvalid(error.message, rule=error.rule)
    return Pose((x, y, z), turned, child, parent)


def read_positional(words: Sequence[str], reading: Reading) -> Pose:
    """Read the old syntax: 8 or 9 words, and an optional period in ms; a numeric seventh word means a quaternion."""
    names = WITH_ANGLES if len(words) >= 7 and not _NUMBER.match(words[6]) else WITH_QUATERNION
    if len(words) not in (len(names), len(names) + 1):
        raise ValueInvalid(f"{CALL} takes {_FORMS}; found {len(words)} words")
    return read_flags(dict(zip(names, words, strict=False)), reading)
