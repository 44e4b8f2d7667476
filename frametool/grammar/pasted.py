"""Numbers pasted from other tools, and poses as people write them by hand, converted to the keys of the grammar.

    array([[ 0., -1.], ..                  numpy, PyTorch, JAX; [0 -1; 1 0] is MATLAB
    0.7071 + 0.7071k                       algebra in tutorials: x, y, z of i, j, k, then w
    (x,y,z,w) = 0 0 0.7071 0.7071          Pinocchio
    Quaternion(x=0.0, ..)                  a repr with names; <Euler (x=0, ..), order='XYZ'> of Blender
    R = .. p = ..                          a rotation and a position

Printed 3x3, 3x4 and 4x4 arrays are matrices, other rows have the notation that the caller states.  Numbers remain text.
Readers return None for other texts; for an ambiguous one they return the bare list, which the grammar refuses.

By hand: single numbers, and lists under various names:

    {x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}          {x: 1, y: 2, theta: 90deg}
    {trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
    {x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid, bare, shown
from frametool.geometry.representations import RPY, Notation, notation
from frametool.grammar.pose import (
    POSE_KEYS,
    POSITION_WORDS,
    ROTATION_WORDS,
    Pose,
    are_rotation,
    is_position,
    matrix_pose,
    notation_of,
    own_key,
    read_pose,
)
from frametool.grammar.readers import COLUMN_WORDS, Misfit, Path, Reading, Unclear, kind, within
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence


Rows: TypeAlias = "list[list[str]]"


DECIMAL = r"(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?"
NUMBER = rf"[-+]?{DECIMAL}"
LABEL = r"\s*+[A-Za-z_]\w*+\s*+=(?!=)\s*+"  # MATLAB's and Python's `T =`
_SCALE = r"\s*1(?:\.0*)?[eE]([-+]?\d+)\s*\*\s*\n"  # MATLAB's `1.0e+03 *` above a matrix
# of GLSL, and of R
_BY_COLUMNS = r"(?:[dft]|high|med|low)?p?_?mat[34](?:x[34])?\(|(?:structure\(|matrix\()?c\((?:[^,()]*,){8}(?!.*byrow)"
_NO_JSON = r"\d\.(?=[\s,\]])|;"

_ROW = r"\[(?:[^\[\],]*,){%s}[^\[\],]*\]\s*,?\s*"
_LISTED_ROWS = rf"\s*(?:\[\s*(?:{_ROW % 3}){{3}}\]|(?:{_ROW % '2,3'}){{3,4}}\Z)"
_COLUMNS = r"(?m)^[ \t]*Columns? \d+(?: (?:through|and|to) \d+)?:?[ \t]*$"
_DECORATIONS: Sequence[tuple[str, str]] = (
    (r"\x1b\[[\d;]*m", ""),  # colours of a terminal
    (r"\A\s*Out\[\d+\]:\s*", ""),  # IPython
    (r"\A\s*Parameter containing:\s*", ""),  # PyTorch
    (r"\A\s*(?:[A-Za-z_][\w.()]*\s*)?<<", ""),  # Eigen's comma initializer
    (rf"\A({LABEL})\s*\d+[\xd7x]\d+\b[^\n]*\n", ""),  # heading of MATLAB's live scripts
    (rf"\A({LABEL})\s*(?:se3|so3)[ \t]*\n", ""),  # MATLAB's classes
    (r"(?s)\A([^<]*)<Matrix \d+x\d+\s*(.*)>", r"\1[\2]"),  # Blender
    (r"(?:np|numpy)\.\w+\(([^()]*)\)", r"\1"),  # numpy 2 in lists: np.float64(0.5)
    (r"(?:,\s*+[A-Za-z]\w*+\s*+=\s*+[\w.'\":<>]++){1,9}+\s*+(?=\))", ""),  # dtype=float32
    (r"(?<![\w.)\]}])[A-Za-z_][\w.]*+\((?=\s*[-+.\d\[({A-Za-z])", "("),  # array(, np.array(, tensor(
)
_DECORATED = r"""[\x1b\\⎡⎛`^\xd7]|<|\[\d*,?\d*\]|[A-Za-z]\w{,60}[(: ]|(?m:^[ \t]*se3|so3)"""


def number_rows(text: str, *, any_text: bool = False) -> Rows | None:
    """Split printed numbers into rows; None if the text is something else.

    any_text: keep words between the numbers, for a reader that reports them.
    Raises ValueInvalid for a truncated print, for one by columns, and for commas that may be decimal commas.
    """
    body = _undecorated(text).strip().rstrip(";")
    body = re.sub(LABEL, "", body, count=1) if re.match(LABEL, body) else body
    scale = re.match(_SCALE, body)
    body = body[scale.end() :] if scale else body
    before, *blocks = re.split(_COLUMNS, body)
    lines = [[line for line in block.splitlines() if line.strip()] for block in blocks]
    if blocks and not before.strip() and len({*map(len, lines)}) == 1:  # a wide matrix printed in blocks of columns
        body = "\n".join(map(" ".join, zip(*lines, strict=True)))
    if "..." in body and re.search(r"[0-9]\.?[\s,]*+\.\.\.", body):
        raise ValueInvalid("the print was cut at '...'; print all numbers")
    pieces: list[str] = re.split(r";|\n", body)
    if body[:1] and body[0] in "[({":  # the innermost brackets hold the rows
        plain = body.translate(str.maketrans("({)}", "[[]]"))
        around = re.sub(r"\[[^\[\]]*\]", "", plain)
        if plain.count("[") != plain.count("]") or re.sub(r"[\[\],;\s]", "", around):
            return None
        inner = re.findall(r"\[([^\[\]]*)\]", plain)
        pieces = inner[0].split(";") if len(inner) == 1 else inner
    rows = []
    for piece in filter(str.strip, pieces):
        row = piece.strip().removesuffix(",").strip()
        gaps = re.findall(r"\s*,\s*|\s+", row)
        is_number = re.fullmatch(rf"(?:{NUMBER}|[\s,])+", row) is not None
        if is_number and 0 < sum("," in gap for gap in gaps) < len(gaps):
            both = f"{shown(row)} is separated by blanks and by commas"
            raise ValueInvalid(f"{both}; are these decimal commas? write points")
        rows.append(re.split(r"\s*,\s*|\s+", row))
    cells = [cell for row in rows for cell in row]
    fits = any if any_text and not re.search("[:=\"']", body) else all
    if not cells or not fits(re.fullmatch(rf"{NUMBER}|[-+]?(?:nan|inf)", cell, re.IGNORECASE) for cell in cells):
        return None
    return [[f"{cell}e{scale[1]}" for cell in row] for row in rows] if scale else rows


def _undecorated(text: str) -> str:
    """Remove the names, headings and brackets that tools print around numbers.

    Raises ValueInvalid for a matrix printed column by column.
    """
    if not re.search(_DECORATED, text):
        return text
    if by_columns := re.match(rf"(?:{LABEL})?\s*(?:{_BY_COLUMNS})", text):
        name = shown(by_columns[0].split("(")[0].strip())
        raise ValueInvalid(f"{name} holds a matrix column by column; write its rows, [[..], [..], [..]]")
    for pattern, plain in _DECORATIONS:
        text = re.sub(pattern, plain, text)
    return text


_TERM = re.compile(rf"([-+]*)((?:{DECIMAL})?)\*?([ijk]?)")
_MEMBERS = rf"\s*[A-Za-z_]\w*\s*[=:]\s*(?:{NUMBER}|[A-Za-z_][\w.]*\()"
_ABOUT = rf"\((?:x=)?({NUMBER}),\s*(?:y=)?({NUMBER}),\s*(?:z=)?({NUMBER})\)"
_EULER = rf"\s*(?:<Euler {_ABOUT}, order='([XYZ]{{3}})'>|Euler\({_ABOUT}, '([XYZ]{{3}})'\))\s*"
_TURNED = "R|rot|rotation|rotation_matrix"
_MOVED = "t|p|T|trans|translation|tvec"
_PART = re.compile(rf"(?:^|(?<=[\s(]))({_TURNED}|{_MOVED})\s*[=:]\s*(?=[\[(]|\n|np\.|array|Rot|{NUMBER})")


_UR = "[pP]"
ABB = r"\[\s*\[([^\[\]]*)\]\s*,\s*\[([^\[\]]*)\]\s*((?:,\s*\[[^\[\]]*\]\s*){2})?\]"
_DECLARED = r"(?:(?:LOCAL|TASK)\s+)?(?:CONST|PERS|VAR)\s+(?:robtarget|pose)\s+\w+\s*:=\s*"


def _robot(text: str, default: Notation | None) -> dict[str, Any] | None:
    """Read `p[x, y, z, rx, ry, rz]` of Universal Robots, and ABB's [[x, y, z], [q1, q2, q3, q4], ..].

    The first has metres and a rotation vector in radians, the second millimetres and w first; a robtarget also has the
    robot's configuration and external axes, which are not part of the pose.  default: the notation of the numbers
    Raises ValueInvalid for p[..] with another number of values, and for ABB's two lists alone.
    """
    plain = re.sub(rf"\A(?:{LABEL})?(?={_UR}\[)|\A{_DECLARED}", "", text.strip().rstrip(";").strip())
    if found := re.fullmatch(rf"{_UR}\[([^\[\]]*)\]", plain):
        cells = [cell.strip() for cell in found[1].split(",")]
        if len(cells) != 6:
            raise ValueInvalid(f"p[..] of Universal Robots has six numbers (x, y, z, rx, ry, rz); found {len(cells)}")
        return {"xyz": cells[:3], "rotvec_rad": cells[3:]}
    if (found := re.fullmatch(ABB, plain)) is None or (default is not None and not found[3]):
        return None
    xyz, turn = ([cell.strip() for cell in found[at].split(",")] for at in (1, 2))
    if (len(xyz), len(turn)) != (3, 4):
        return None
    if not found[3] and ":=" not in text:
        stated = "{xyz: [..], wxyz: [..]}, of ABB {xyz_mm: [..], wxyz: [..]}, or give --from xyzw or wxyz"
        raise ValueInvalid(f"two lists state neither unit nor order; write {stated}")
    return {"xyz_mm": xyz, "wxyz": turn}


def _algebra(text: str) -> dict[str, Any] | None:
    """Read `0.7071 + 0.7071k`, `-j`, `0.5i + -0.5j + 0.5*k + 0.5`: each unit and the real part at most once."""
    plain = re.sub(LABEL, "", text, count=1).removeprefix("quaternion") if len(text) < 200 else ""
    tight = re.sub(r"\s+", "", plain)
    if not tight or tight[-1] not in "ijk0123456789." or not any(each in "ijk" for each in tight):
        return None
    parts: dict[str, str] = {}
    at = 0
    while at < len(tight):
        match = _TERM.match(tight, at)
        if not match or match.end() == at or not (match[2] or match[3]) or (at and not match[1]) or match[3] in parts:
            return None
        sign = "-" * (match[1].count("-") % 2)
        parts[match[3]] = sign + (match[2] or "1")
        at = match.end()
    return {"quaternion": {name: parts.get(unit, "0") for name, unit in zip("xyzw", ("i", "j", "k", ""), strict=True)}}


def _members(text: str) -> dict[str, Any] | None:
    """Read `geometry_msgs.msg.Transform(translation=..Vector3(x=1.0, ..), ..)`, or `x=1.0, y=2.0` without a name."""
    text = re.sub(r"\A\s*<Quaternion \((.*)\)>\s*\Z", r"Quaternion(\1)", text)
    if not re.match(rf"\s*+(?:[A-Za-z_][\w.]*\()?{_MEMBERS}", text) or re.match(r"\s*\w+:[^,]*\n", text):
        return None
    import json

    body = re.sub(r"[A-Za-z_][\w.]*\(", "{", text.strip().rstrip(",")).replace(")", "}")
    body = re.sub(rf"([A-Za-z_][\w.]*)\s*[=:]\s*({NUMBER})", r'"\1": "\2"', body)
    body = re.sub(r"([A-Za-z_][\w.]*)\s*[=:]\s*", r'"\1": ', body)
    try:
        found: dict[str, Any] = json.loads(body if body[0] == "{" else f"{{{body}}}", object_pairs_hook=_unrepeated)
    except ValueError:
        return None
    return found


def _unrepeated(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the members of an object; raises ValueError if two have one name."""
    if len({name for name, _ in pairs}) < len(pairs):
        raise ValueError
    return dict(pairs)


def _parts(text: str) -> dict[str, Any] | None:
    """Read a rotation matrix and a position with names, one of each."""
    text = re.sub(r"\A\s*RigidTransform\(\n?(.*)\)\s*\Z", r"\1", text, flags=re.DOTALL)
    labels = list(_PART.finditer(text))
    if not labels or text[: labels[0].start()].strip() or len(labels) > 2:
        return None
    ends = [*(label.start() for label in labels[1:]), len(text)]
    value: dict[str, Any] = {}
    for label, end in zip(labels, ends, strict=True):
        rows = number_rows(re.sub(r"(?<![,\s])[,\s]++\Z", "", text[label.end() : end]))
        cells = [cell for row in rows or () for cell in row]
        is_turn = re.fullmatch(_TURNED, label[1]) is not None
        if rows is None or (len(cells), len(rows)) not in (((9, 3),) if is_turn else ((3, 1), (3, 3))):
            return None
        value["matrix" if is_turn else "xyz"] = rows if is_turn else cells
    return value if "matrix" in value and len(value) == len(labels) else None


def _origins(text: str) -> list[Any] | None:
    """Read the origins of joints: metres, rpy in radians; the links of a single joint are its frames."""
    plain = re.sub(r"(?s)<!--.*?(?:-->|\Z)", "", text)
    found = re.findall(r"<origin\b([^<>]*?)/?>", plain)
    if not found or re.match(r"\s*<(?!origin\b|joint\b)", plain):
        return None
    values: list[dict[str, Any]] = []
    for attributes in found:
        value: dict[str, Any] = {"xyz": ["0"] * 3, "rpy": ["0"] * 3}
        for name, _, numbers in re.findall(r"(?<![\w:])([\w:]++)\s*+=\s*+([\"'])(.*?)\2", attributes):
            if name not in value:
                raise ValueInvalid(f"unknown attribute {shown(name)} of an origin; it has xyz and rpy")
            value[name] = numbers.split()
        values.append(value)
    if len(values) == 1:
        for key, tag in (("name", "child"), ("parent", "parent")):
            if names := re.findall(rf"<{tag}\s+link\s*=\s*[\"']([^\"'<>]+)[\"']", plain):
                values[0][key] = names[0]
    return values


def pasted_poses(text: str, default: Notation | None = None) -> list[Any] | None:
    """Return the values of a pasted text, as documents have them; None for any other text.

    default: the notation of numbers that do not state theirs.
    Raises ValueInvalid for a known print that cannot be read.
    """
    robots = [_robot(line, default) for line in text.strip().splitlines() if line.strip()]
    if robots and None not in robots:
        return [*robots]
    if stated := re.match(r"\s*\((x,\s*y,\s*z,\s*w)\)\s*=\s*", text):
        rows = number_rows(text[stated.end() :])
        if rows and len(rows) == 1 and len(rows[0]) == 4:
            return [{"xyzw": rows[0]}]
    if euler := re.fullmatch(_EULER, text):  # Blender: about the fixed axes, in the order of the letters
        *about, order = [each for each in euler.groups() if each is not None]
        angles = [about["XYZ".index(letter)] for letter in order]
        return [{"euler": {"axes": f"s{order.lower()}", "angles": angles}}]
    for read in (_algebra, _members, _parts):
        if (value := read(text)) is not None:
            return [value]
    if re.match(r"\s*<(?!Matrix\b)", text) and (found := _origins(text)) is not None:
        return found
    rows = number_rows(text, any_text=default is not None)
    if rows is None:
        return None
    rep = default or notation("matrix")
    if rep.representation.whole:
        if (value := matrix_pose(rows, rep, stated=default is not None)) is not None:
            return [value]
    elif (found := _spelled_rows(rows, rep)) is not None:
        return found
    if default is not None:
        counts = " and ".join(map(str, dict.fromkeys(map(len, rows))))
        several = f"{len(rows)} rows of " * (len(rows) > 1)
        raise ValueInvalid(f"{rep.counted}; found {several}{counts}")
    return [rows[0] if len(rows) == 1 else rows]


def _spelled_rows(rows: Rows, rep: Notation) -> list[Any] | None:
    """Return the poses of rows in a notation: one per row, or one column, or a position and a rotation."""
    row, size = rep.representation, len(rep.columns)
    if len(rows) > 1 and all(len(cells) == 1 for cells in rows):
        rows = [[cell for (cell,) in rows]]
    if [*map(len, rows)] == [3, size]:
        if size == 3:
            hint = f"write {{xyz: [..], {row.name}: ..}}"
            raise ValueInvalid(f"two rows of 3 may be a pose or two rotations; {hint}")
        rows = [[*rows[0], *rows[1]]]
    if not {*map(len, rows)} <= {size, size + 3}:
        return None
    unit = "" if rep.degrees is None else "_deg" if rep.degrees else "_rad"
    found: list[Any] = []
    for cells in rows:
        for index, cell in enumerate(cells[-size:]):
            (parse_angle if index in row.angles else parse_number)(cell)
        rep.bound_axes()
        position = {"xyz": list(cells[:-size])} if len(cells) > size else {}
        found.append({**position, f"{row.name}{unit}": rep.spelled(cells[-size:])})
    return found


def mapping_of_numbers(texts: Sequence[str], default: Notation | None) -> dict[str, Any]:
    """Return the mapping with the same meaning as bare numbers that `pose_of_numbers` has read."""
    rep, rows = default or notation_of(texts), list[list[str]]([[*map(Verbatim, texts)]])
    is_matrix = rep.representation.whole is not None
    whole = matrix_pose(rows, rep, stated=default is not None) if is_matrix else None
    return whole or (_spelled_rows(rows, rep) or [{}])[0]


def begins_freely(head: str, default: Notation | None, *, moves: bool, alone: bool) -> bool | None:
    """Return True if a text begins with a pasted print, False for a stream of rows or records, None if undecided.

    moves: the rows are points
    alone: three numbers per row would have no result
    """
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    first = lines[0]
    if first[0] in "[({" and re.match(r"[\[\s]*[-+.\d]\S*\s*,", first):
        listed = re.match(r"\s*\[([^\[\]]*)\]", head)
        is_pose = listed is not None and listed[1].count(",") in (8, 11, 15)  # 9, 12 or 16 numbers
        is_pose = is_pose or re.match(rf"{_LISTED_ROWS}|\s*{ABB}", head) is not None
        return not moves and (default is not None or is_pose or re.search(_NO_JSON, head) is not None)
    cells = first.split()
    if not all(re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?", cell) for cell in cells):
        return True
    if moves:
        return False
    matrix = default is None or default.representation.whole is not None
    if (len(cells), len(lines)) == (3, 3) and matrix:
        return default is not None or alone or (None if are_rotation([line.split() for line in lines]) else False)
    if matrix:
        return (len(cells), len(lines)) in ((4, 3), (4, 4))  # a line of twelve is a KITTI file with one pose
    return len(cells) == 1 and len(lines) > 1


# --- written by hand: the names of single numbers, and of lists ---

_POSITIONS = (*POSITION_WORDS, "translation", "position", "location")
_TURNS = (*(word for word, meant in ROTATION_WORDS.items() if not meant), "q", "quaternion")
_SPELLED = {"t": "xyz", "q": "quaternion", "r": "rotvec_rad"}  # by the first letter of a single number's name
_WHOLE = ("value", "pose")  # seven numbers
# the names of single numbers -> the key of the grammar for them
_FLAT = {
    **{f"{word}{axis}": ("xyz", axis) for axis in "xyz" for word in ("", "p", "t")},
    **{f"q{axis}": ("quaternion", axis) for axis in "xyzw"},
    **{word: (_SPELLED[name[0]], word[-1]) for word, name in COLUMN_WORDS.items()},
    **{f"{axis}_{unit}": (f"xyz_{unit}", axis) for axis in "xyz" for unit in ("mm", "cm")},
    **{f"{name}{unit}": (f"rpy{unit}", name) for name in RPY for unit in ("", "_deg", "_rad")},
    **{f"a{axis}": ("axis", axis) for axis in "xyz"},
    **{f"{name}{unit}": (f"axis_angle{unit}", "angle") for name in ("theta", "angle") for unit in ("", "_deg", "_rad")},
}
WORDS = frozenset((*POSE_KEYS, *_FLAT, *_POSITIONS, *_TURNS, *_WHOLE))


def read_loose_pose(fields: dict[str, Any], reading: Reading, also: Collection[str] = (), *, order: str = "") -> Pose:
    """Read a pose whose numbers may each have a name: x, y, z, yaw; raises Misfit."""
    places: dict[Path, str] = {}
    found: dict[str, Any] = {}
    for key, value in fields.items():
        is_number = type(value) is not list and type(value) is not dict
        if is_number and key in _FLAT:
            together, part = _FLAT[key]
            parts = found.setdefault(together, {})
            is_new = type(parts) is dict and part not in parts
            if is_new:
                parts[part], places[together, part] = value, key
        else:
            meant = _meant(key, value, order)
            is_new = meant.keys().isdisjoint(found)
            found |= meant
            places |= {} if is_number else {(new,): key for new in meant}
        if not is_new:
            raise Misfit(f"{bare(key)} repeats another key; keep one", (key,), key=True)
    angle = next((key for key in found if key.startswith("axis_angle") and type(found[key]) is dict), "")
    if axis := found.pop("axis", None):
        if not angle or axis.keys() != {"x", "y", "z"}:
            raise Misfit("ax, ay, az and theta belong together: an axis and the angle about it")
        found[angle] = {"axis": [axis[each] for each in "xyz"], **found[angle]}
    elif angle and found[angle].keys() == {"angle"}:  # about z, as yaw alone
        yaw = angle.replace("axis_angle", "rpy")
        if yaw in found:
            raise Misfit("theta repeats another key; keep one", key=True)
        found[yaw] = {"yaw": found.pop(angle)["angle"]}
        places[yaw, "yaw"] = places[angle, "angle"]
    for key, present in found.items():
        wanted = RPY if key.startswith("rpy") else "xyzw" if key == "quaternion" else ()
        if wanted and type(present) is dict and present.keys() not in ({*wanted}, {"yaw"}):
            missing = ", ".join(part for part in wanted if part not in present)
            raise Misfit(f"incomplete rotation: missing {missing} beside {', '.join(present)}")
    try:
        return read_pose(found, reading, also)
    except Misfit as misfit:  # at the key as written
        known = next((end for end in (2, 1) if misfit.path[:end] in places), 0)
        misfit.path = (places[misfit.path[:known]], *misfit.path[known:]) if known else misfit.path
        raise


def _meant(key: str, value: Any, order: str) -> dict[str, Any]:
    """Return the values of the grammar that a key with its value means; raises Misfit."""
    if key in _WHOLE:
        if type(value) is not list or len(value) != 7:
            found_here = f"{len(value)} numbers" if type(value) is list else kind(value)
            raise Misfit(f"expected 7 numbers, found {found_here}", (key,))
        return {"xyz": value[:3], _ordered(value[3:], order, key): value[3:]}
    if key in _POSITIONS and is_position(key, value):
        return {"xyz": value}
    if key not in _TURNS:
        return {key: value}
    if type(value) is dict and value.keys() == {"qx", "qy", "qz", "qw"}:
        return {"quaternion": {name[1]: each for name, each in value.items()}}
    turned = within((key,), own_key, key if key in ROTATION_WORDS else "quat", value)
    return {_ordered(value, order, key) if turned == "quaternion" and type(value) is list else turned: value}


def _ordered(value: list[Any], order: str, key: str) -> str:
    if not order:
        numbers = ", ".join(str(each) for each in value)
        what = f"{bare(key)} [{bare(numbers)}] does not state the position of w"
        raise Unclear(f"{what}: give --from xyzw or --from wxyz, for all of the file", (key,), key=True)
    return order
