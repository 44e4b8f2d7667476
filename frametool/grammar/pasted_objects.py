"""Objects that say by their names what their numbers are, as tools print them.

    0.7071 + 0.7071k                       the algebra of tutorials: x, y, z of i, j, k, then w
    0.7071 << 0, 0, 0.7071 >>              spatialmath: w, then x, y, z; (x,y,z,w) = .. is Pinocchio's
    Quaternion(x=0.0, ..)                  a repr with names, also <Quaternion (w=0.7071, ..)> of Blender
    SE3(wxyz=[..], xyz=[..])               a repr with lists; RigidTransform(R=RotationMatrix([[..]]), p=[..])
    R = .. p = ..                          a rotation and a position: Pinocchio, GTSAM, NumPy arrays
    t = 1, 2, 3; rpy/zyx = 0, 0, 90 deg    one line of spatialmath
    <Euler (x=0, y=0, z=1.57), order='XYZ'>
    <origin xyz=".." rpy=".."/>

Each number stays the text it was.  None stands for a text that is nothing of the kind.
"""

from __future__ import annotations

import re
from typing import Any

from frametool.errors import ValueInvalid, shown
from frametool.grammar.pasted_rows import DECIMAL, LABEL, NUMBER, number_rows

_TERM = re.compile(rf"([-+]*)((?:{DECIMAL})?)\*?([ijk]?)")
_MEMBERS = rf"\s*[A-Za-z_]\w*\s*[=:]\s*(?:{NUMBER}|[A-Za-z_][\w.]*\()"
_THREE = rf"\(?\s*({NUMBER})(°?)\s*,\s*({NUMBER})°?\s*,\s*({NUMBER})°?\s*\)?"
_SCALAR_FIRST = rf"\s*({NUMBER})\s*(<<|<)\s*({NUMBER})\s*,\s*({NUMBER})\s*,\s*({NUMBER})\s*>>?\s*"
_ONE_LINE = rf"\s*(?:\w+:\s*)?t\s*=\s*{_THREE}[;,]\s*(\S+)\s*=\s*(.*)"
_ABOUT = rf"\((?:x=)?({NUMBER}),\s*(?:y=)?({NUMBER}),\s*(?:z=)?({NUMBER})\)"
_EULER = rf"\s*(?:<Euler {_ABOUT}, order='([XYZ]{{3}})'>|Euler\({_ABOUT}, '([XYZ]{{3}})'\))\s*"
_LISTS = r"\s*\w+\(\s*((?:(?:wxyz|xyzw|xyz)\s*=\s*(?:\w+\()?\[[^\[\]]*\](?:,\s*dtype=\w+)?\)?\s*,?\s*)+)\)\s*"
_TURNED = "R|rot|rotation|rotation_matrix"
_MOVED = "t|p|T|trans|translation|tvec"
_PART = re.compile(rf"(?:^|(?<=[\s(]))({_TURNED}|{_MOVED})\s*[=:]\s*(?=[\[(]|\n|np\.|array|Rot|{NUMBER})")


def named_values(text: str) -> list[Any] | None:
    """Return what a print of objects stands for, as documents give it; None for no such text.

    Raises ValueInvalid for a print that is known and cannot be taken.
    """
    for read in (_algebra, _scalar_first, _members, _lists, _euler, _one_line, _parts):
        if (found := read(text)) is not None:
            return [found]
    return _origins(text) if re.match(r"\s*<(?!Matrix\b)", text) else None


def _algebra(text: str) -> dict[str, Any] | None:
    """Read `0.7071 + 0.7071k`, `-j`, `0.5i + -0.5j + 0.5*k + 0.5`: each unit and the real part once at most."""
    plain = re.sub(LABEL, "", text, count=1).removeprefix("quaternion") if len(text) < 200 else ""
    tight = re.sub(r"\s+", "", plain)
    tight = re.sub(rf"\(({NUMBER})\)", r"\1", tight)  # SymPy's + (-0.5)*j
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


def _scalar_first(text: str) -> dict[str, Any] | None:
    """Read `w << x, y, z >>`, and the four numbers that say `(x,y,z,w) =`."""
    if told := re.match(r"\s*\((x,\s*y,\s*z,\s*w)\)\s*=\s*", text):
        rows = number_rows(text[told.end() :])
        return {"xyzw": rows[0]} if rows and len(rows) == 1 and len(rows[0]) == 4 else None
    found = re.fullmatch(_SCALAR_FIRST, text)
    return None if found is None else {"wxyz": [found[1], *found.groups()[2:]]}


def _members(text: str) -> dict[str, Any] | None:
    """Read `geometry_msgs.msg.Transform(translation=..Vector3(x=1.0, ..), ..)`, or `x=1.0, y=2.0` without a name."""
    text = re.sub(r"\A\s*<Quaternion \((.*)\)>\s*\Z", r"Quaternion(\1)", text)
    if not re.match(rf"\s*(?:[A-Za-z_][\w.]*\()?{_MEMBERS}", text) or re.match(r"\s*\w+:[^,]*\n", text):
        return None
    words = re.findall(rf"[A-Za-z_][\w.]*|{NUMBER}|[=(),:]|\S", text.strip())
    stack: list[dict[str, Any]] = [{}]
    keys: list[str] = []
    at = 2 if words[1:2] == ["("] else 0  # the outermost name
    depth = at // 2
    while at < len(words):
        word, after = words[at], words[at + 1 : at + 4]
        if after[:1] in (["="], [":"]) and len(after) > 1 and word not in stack[-1]:
            keys.append(word)
            if after[2:3] == ["("]:
                stack.append({})
                at += 4
                continue
            if not re.fullmatch(NUMBER, after[1]):
                return None
            stack[-1][keys.pop()] = after[1]
            at += 3
        elif word == ")" and len(stack) > 1:
            inner = stack.pop()
            stack[-1][keys.pop()] = inner
            at += 1
        elif word == "," or (word == ")" and depth):
            depth -= word == ")"
            at += 1
        else:
            return None
    return stack[0] if len(stack) == 1 and not depth else None


def _lists(text: str) -> dict[str, Any] | None:
    """Read `SE3(wxyz=[..], xyz=[..])`, whose names are those of the grammar."""
    found = re.fullmatch(_LISTS, text)
    if found is None:
        return None
    lists = re.findall(r"(wxyz|xyzw|xyz)\s*=\s*(?:\w+\()?(\[[^\[\]]*\])", found[1])
    read = {key: rows[0] for key, numbers in lists if (rows := number_rows(numbers))}
    return read if len(read) == len(lists) else None


def _euler(text: str) -> dict[str, Any] | None:
    """Read Blender's angles: about x, y, z each, applied about the fixed axes in the order of the letters."""
    found = re.fullmatch(_EULER, text)
    if found is None:
        return None
    *about, order = [each for each in found.groups() if each is not None]
    return {"euler": {"axes": f"s{order.lower()}", "angles": [about["XYZ".index(letter)] for letter in order]}}


def _one_line(text: str) -> dict[str, Any] | None:
    """Read `t = 0.5, -1.25, 2; rpy/zyx = 68.8°, -22.9°, 17.2°`; without a unit the angles are radians."""
    found = re.fullmatch(_ONE_LINE, text.strip())
    if found is None:
        return None
    xyz, kind = [found[1], found[3], found[4]], found[5]
    angles = re.fullmatch(rf"{_THREE}\s*(deg|rad)?", found[6].strip())
    if kind.lower() != "rpy/zyx" or angles is None:
        raise ValueInvalid(f"{shown(kind)} is not read; print with rpy/zyx, or print the matrix")
    is_degrees = angles[2] == "°" or angles[5] == "deg"
    return {"xyz": xyz, "rpy_deg" if is_degrees else "rpy_rad": [angles[1], angles[3], angles[4]]}


def _parts(text: str) -> dict[str, Any] | None:
    """Read a rotation matrix and a position under names of their own, one of each."""
    text = re.sub(r"\A\s*RigidTransform\(\n?(.*)\)\s*\Z", r"\1", text, flags=re.DOTALL)
    labels = list(_PART.finditer(text))
    if not labels or text[: labels[0].start()].strip() or len(labels) > 2:
        return None
    ends = [*(label.start() for label in labels[1:]), len(text)]
    value: dict[str, Any] = {}
    for label, end in zip(labels, ends, strict=True):
        rows = number_rows(re.sub(r"[,\s]+\Z", "", text[label.end() : end]))
        cells = [cell for row in rows or () for cell in row]
        is_turn = re.fullmatch(_TURNED, label[1]) is not None
        if rows is None or (len(cells), len(rows)) not in (((9, 3),) if is_turn else ((3, 1), (3, 3))):
            return None
        value["matrix" if is_turn else "xyz"] = rows if is_turn else cells
    return value if "matrix" in value and len(value) == len(labels) else None


def _origins(text: str) -> list[Any] | None:
    """Read the origins of joints: metres, rpy in radians; the links of one joint are its frames."""
    plain = re.sub(r"(?s)<!--.*?-->", "", text)
    found = re.findall(r"<origin\b([^<>]*?)/?>", plain)
    if not found or re.match(r"\s*<(?!origin\b|joint\b)", plain):
        return None
    values = [_origin(attributes) for attributes in found]
    if len(values) == 1:
        for key, tag in (("name", "child"), ("parent", "parent")):
            if names := re.findall(rf"<{tag}\s+link\s*=\s*[\"']([^\"'<>]+)[\"']", plain):
                values[0][key] = names[0]
    return values


def _origin(attributes: str) -> dict[str, Any]:
    """Read the attributes of one origin."""
    value: dict[str, Any] = {"xyz": ["0"] * 3, "rpy": ["0"] * 3}
    for name, _, numbers in re.findall(r"([\w:]+)\s*=\s*([\"'])(.*?)\2", attributes):
        if name not in value:
            raise ValueInvalid(f"unknown attribute {shown(name)} of an origin; it has xyz and rpy")
        value[name] = numbers.split()
    return value
