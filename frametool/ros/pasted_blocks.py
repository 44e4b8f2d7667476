"""Text pasted from ROS tools: blocks of tf2_echo, arguments of publishers, parts of `rostopic echo`.

    At time 1253924110.083                                            ROS 1 and tf_echo
    - Translation: [0.000, 0.000, 0.025]
    - Rotation: in Quaternion [0.000, 0.000, 0.000, 1.000]            ROS 2: in Quaternion (xyzw) [..]
                in RPY (radian) [0.000, -0.000, 0.000]
    - Pose [ XYZ (m) ] [ RPY (rad) ]:                                 Gazebo's `gz model -m NAME -p`
        [0.500000 -1.000000 2.000000]
        [0.000000 -0.000000 1.570796]
    args="0 0 5 0 0 0 world odom 100"                                 x y z yaw pitch roll parent child ms

All are converted to text of the grammar of poses, as `pasted_poses` does.  Of a block the quaternion is used:
its angles and its matrix are the same with as few digits.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_json
from frametool.documents.source import Pasted, Source, Verbatim
from frametool.documents.writers import dump_json
from frametool.errors import FormatError, ValueInvalid, shown, warn
from frametool.frames.stamps import parse_stamp
from frametool.grammar.pasted import DECIMAL, NUMBER, pasted_poses
from frametool.grammar.readers import Reading
from frametool.ros.publisher import CALL, read_call

if TYPE_CHECKING:
    from frametool.geometry.representations import Notation

MOST_PASTED = 1 << 16  # characters
_LIST = rf"\[\s*({NUMBER}(?:\s*,\s*{NUMBER})*)\s*\]"
_TRANSLATION = r"(?m:^)[ \t]*+(?:-\s+)?Translation:"  # a selection may begin after the dash
_PART = re.compile(  # of a block, by the key of the grammar
    rf"(?m:^)[ \t]*+At time (?P<stamp_ns>\d{{1,10}}(?:\.\d{{1,9}})?)(?![\d.])|(?P<xyz>{_TRANSLATION})"
    r"|(?P<xyzw>in Quaternion(?: \(xyzw\))?)|(?P<rpy>in RPY \(radian\))|(?P<rpy_deg>in RPY \(degree\))"
)
_HEADING = re.compile(r"(?m)^(\S+) seen from (\S+)\s+\(maps points")  # frametool's own block
_TRIPLE = rf"\[({NUMBER}(?:[ |]+{NUMBER}){{2}})\]"
_GAZEBO = re.compile(rf"Pose \[ XYZ \(m\) \] \[ RPY \(rad\) \]:\s*{_TRIPLE}\s*{_TRIPLE}")
_ARGS = re.compile(r"\bargs\s*[=:]\s*([\"'])(.*?)\1", re.DOTALL)
_FRAME = r"[A-Za-z_/][\w./-]*"
_ARGUMENTS_ALONE = (
    rf"\s*--(?:[a-z]+-)*[a-z]+[ =]|\s*(?:{NUMBER}\s+){{6,7}}{_FRAME}\s+{_FRAME}(?:\s+\d+)?\s*\Z"
)  # fmt: skip
_BEGIN = re.compile(
    rf"""(?x)\s*+(?:
    (?:[A-Za-z_]\w*+\s*+=\s*+)?[pP]\[ | (?:\w+\s+)*:?(?:robtarget|pose)\s+\w+\s*:=    # Universal Robots, ABB
    | (?:[A-Za-z_]\w*+\s*+=\s*+)?                               # T =
    (?: [A-Za-z_][\w.]*+\(\s*+[-+.\d\[({{A-Za-z_]             # array([[.., Quaternion(x=..
      | [\[({{][\[({{\s]*+(?:{NUMBER}|nan|-?inf)(?:[\s;`*]|[,\])}}])   # [[1. 0., [1 0; 0 1], [0, 0, 0.7, 0.7]
      | [\[({{][\[({{\s]*+(?:np\.|array|Array|Float)
      | {NUMBER}(?:[ \t\r]*+(?:[,;\n<]|\Z)|[ \t]++[-+.\d*])          # bare numbers, MATLAB's factor
      | [-+]?\s*+(?:{DECIMAL}\s*+)?(?:\*\s*+)?[ijk]\s*+(?:[-+]|\Z) | {NUMBER}\s*+[-+]
      | \d+[\xd7x]\d+\b | Columns?\ \d | \[,\d | \\(?:left|begin)\b | [⎡⎛│┌] | (?:se3|so3|quaternion)\s*\n )
    | \x1b\[ | Out\[\d | Parameter\ containing: | (?:[A-Za-z_]\w*\s*)?<< | \(x,\s*y,\s*z,\s*w\)\s*=
    | (?:\w++:\s*+)?t\s*+= | (?:R|rot|rotation|rotation_matrix|t|p|T|trans|translation|tvec)\s*[:=][^\S\n]*+
      (?:[\[(] | \n\s*+(?:[-+]?[.\d\[(]|[A-Za-z_][\w.]*+\())       # no list of YAML, which has - and a blank
    | [xyzw]:\s*{NUMBER}\s*, | <(?:origin|joint|node|Matrix|Quaternion|Euler)\b | (?:args|x)\s*=
    | (?:\[\w++\]\ .*+\n\s*+)*+(?:At\ (?:any\ )?time\b|-\ ++(?:Translation|Rotation):|Rotation:\ in\ |\S+\ seen\ from\ )
    | (?:Requesting\ state\ .*+\s++)?(?:Model:\ \[|(?:-\ )?Pose\ \[\ XYZ)
    | .*\b{CALL}\s | --(?:[xyz]|roll|pitch|yaw|q[xyzw]|(?:child-)?frame-id)[ =]
    )"""
)


def may_be_pasted(text: str) -> bool:
    """Return True if the beginning of a text may be a pasted print."""
    return bool(_BEGIN.match(text) or re.search(_TRANSLATION, text[:4096])) or _mended(text) != text


def in_grammar(
    source: Source, default: Notation | None = None, *, normalize: bool = False, points: bool = False
) -> Source | None:
    """Return a pasted text as text of the grammar of poses, one value per line; None for text that needs no change.

    default: the representation of numbers that do not state theirs; normalize: accept any non-zero quaternion
    points: three numbers are a point
    Raises FormatError for a known print that cannot be read.
    """
    text = source.text
    if len(text) > MOST_PASTED or not may_be_pasted(text):
        return None
    values: list[Any] | None
    try:
        values = _blocks(text)
        if not values and (gazebo := _GAZEBO.findall(text)):
            if len(gazebo) > 1:  # its links and their inertias are printed with it
                what = f"Gazebo printed {len(gazebo)} poses; `gz model -m NAME -p` prints the model's alone"
                raise ValueInvalid(what)
            values = [{"xyz": re.split(r"[ |]+", xyz), "rpy_rad": re.split(r"[ |]+", rpy)} for xyz, rpy in gazebo]
        values = values or _published(source, normalize=normalize) or _unless_grammar(source, default, points=points)
    except ValueInvalid as error:
        raise FormatError(str(error), source=source.name) from error
    if values is not None:
        return Pasted(source.name, "\n".join(map(dump_json, values)))
    return Source(source.name, mended) if (mended := _mended(text)) != text else None


def _unless_grammar(source: Source, default: Notation | None, *, points: bool) -> list[Any] | None:
    """Return the values of pasted numbers; None for JSON that the grammar accepts."""
    read = parse_json(source)
    lists = (each for each in read or () if type(each) is list and each and type(each[0]) is list)
    has_matrix = any((len(each), len(each[0])) in ((3, 3), (4, 4)) for each in lists)
    if (points and read is not None) or (has_matrix and default is None):
        return None
    try:
        return pasted_poses(source.text, default)
    except ValueInvalid:
        if has_matrix:
            return None
        raise


def _blocks(text: str) -> list[Any]:
    """Read all blocks printed by tf2_echo; position and time may be missing, and the first rotation of each is used."""
    names, values, stamp = _HEADING.search(text), list[dict[str, Any]](), 0
    known = {"name": names[1], "parent": names[2]} if names else {}
    for part in _PART.finditer(text):
        key = str(part.lastgroup)
        if key == "stamp_ns":
            stamp = parse_stamp(part[key])
            continue
        if key == "xyz" or not values:
            values.append({**known, **({"stamp_ns": Verbatim(stamp)} if stamp else {})})  # 0: static
            stamp = 0
        if values[-1].keys().isdisjoint(("xyzw", "rpy", "rpy_deg")):
            numbers = re.compile(rf"\s*{_LIST}").match(text, part.end())
            if not numbers:
                line = text[part.start() :].strip().partition("\n")[0]
                raise ValueInvalid(f"expected a list of numbers, found {shown(line)}")
            values[-1][key] = numbers[1].replace(",", " ").split()
    return values


def _published(source: Source, *, normalize: bool) -> list[Any]:
    """Read the arguments of static_transform_publisher: `args=".."` of launch files, or a whole call."""
    text = source.text
    calls = [match[2] for match in _ARGS.finditer(text)]
    is_bare = not calls
    if is_bare:
        lines = [line for line in re.sub(r"\\\r?\n", " ", text).splitlines() if line.strip()]
        calls = [line for line in lines if CALL in line or re.match(_ARGUMENTS_ALONE, line)]
        if len(calls) < len(lines):
            return []
    values = []
    for call in calls:
        reading = Reading(source, normalize=normalize)
        pose = read_call(call, reading)
        if is_bare and re.match(rf"\s*(?:{NUMBER}\s+){{6}}{_FRAME}\s", call):
            warn(f"{source.name}: taken for arguments of {CALL}: x y z yaw pitch roll PARENT CHILD")
        for note in reading.notes:
            warn(f"{source.name}: {note.message}", rule=note.rule)
        numbers = [*map(repr, pose.components)]
        values.append({"name": pose.name, "parent": pose.parent, "xyz": numbers[:3], "xyzw": numbers[3:]})
    return values


def _mended(text: str) -> str:
    """Restore the indentation that a selection from the middle of a line has lost before its first word."""
    first, newline, rest = text.partition("\n")
    lines = [line for line in rest.split("\n")[:200] if line.strip() and not line.startswith("---")]
    if not lines or not re.fullmatch(r"[A-Za-z_]\w*:( .*)?", first.rstrip()):
        return text
    indents = [len(line) - len(line.lstrip(" ")) for line in lines]
    holds = not first.rstrip().endswith(":")
    if not min(indents) or not (holds or indents[0] > min(indents)):
        return text
    return " " * min(indents) + first + newline + rest
