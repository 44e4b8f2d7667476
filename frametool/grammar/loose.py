"""Poses as people write them by hand: single numbers, lists under various names; converted to the keys of the grammar.

{x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}          {x: 1, y: 2, theta: 90deg}
{trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
{x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import bare
from frametool.grammar.names import COLUMN_WORDS
from frametool.grammar.pose import POSE_KEYS, Pose, read_pose
from frametool.grammar.readers import Misfit, Reading, Unclear, kind
from frametool.grammar.rotation_spelling import POSITION_WORDS, ROTATION_WORDS, is_position

if TYPE_CHECKING:
    from collections.abc import Collection

    from frametool.grammar.readers import Path

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
    **{f"{name}{unit}": (f"rpy{unit}", name) for name in ("roll", "pitch", "yaw") for unit in ("", "_deg", "_rad")},
    **{f"a{axis}": ("axis", axis) for axis in "xyz"},
    **{f"{name}{unit}": (f"axis_angle{unit}", "angle") for name in ("theta", "angle") for unit in ("", "_deg", "_rad")},
}
WORDS = frozenset((*POSE_KEYS, *_FLAT, *_POSITIONS, *_TURNS, *_WHOLE))


def read_loose_pose(fields: dict[str, Any], reading: Reading, also: Collection[str] = (), *, order: str = "") -> Pose:
    """Read a pose whose numbers may each have a name: x, y, z, yaw; raises Misfit."""
    places: dict[Path, str] = {}
    mapping = _in_grammar(fields, order, places)
    try:
        return read_pose(mapping, reading, also)
    except Misfit as misfit:  # at the key as written
        known = next((end for end in (2, 1) if misfit.path[:end] in places), 0)
        misfit.path = (places[misfit.path[:known]], *misfit.path[known:]) if known else misfit.path
        raise


def _in_grammar(fields: dict[str, Any], order: str, places: dict[Path, str]) -> dict[str, Any]:
    """Return an entry with the keys of the grammar of poses; raises Misfit.

    places: is filled with the original keys of these
    """
    found: dict[str, Any] = {}
    for key, value in fields.items():
        if type(value) is not list and type(value) is not dict and key in _FLAT:
            together, part = _FLAT[key]
            parts = found.setdefault(together, {})
            if type(parts) is not dict or part in parts:
                raise Misfit(f"{bare(key)} repeats another key; keep one", (key,), key=True)
            parts[part], places[together, part] = value, key
        elif key in _WHOLE:
            if type(value) is not list or len(value) != 7:
                found_here = f"{len(value)} numbers" if type(value) is list else kind(value)
                raise Misfit(f"expected 7 numbers, found {found_here}", (key,))
            _put(found, "xyz", value[:3], key)
            _put(found, _ordered(value[3:], order, key), value[3:], key)
        elif key in _POSITIONS and is_position(key, value):
            _put(found, "xyz", value, key)
        elif key in _TURNS:
            _put(found, *_turn(value, order, key), key)
        else:
            _put(found, key, value, key)
        places |= {(new,): key for new in found if (new,) not in places and type(value) in (list, dict)}
    angle = next((key for key in found if key.startswith("axis_angle") and type(found[key]) is dict), "")
    if axis := found.pop("axis", None):
        if not angle or axis.keys() != {"x", "y", "z"}:
            raise Misfit("ax, ay, az and theta belong together: an axis and the angle about it")
        found[angle] = {"axis": [axis[each] for each in "xyz"], **found[angle]}
    elif angle and found[angle].keys() == {"angle"}:  # about z, as yaw alone
        yaw = angle.replace("axis_angle", "rpy")
        _put(found, yaw, {"yaw": found.pop(angle)["angle"]}, "theta")
        places[yaw, "yaw"] = places[angle, "angle"]
    for key, parts, least in (("rpy", ("roll", "pitch", "yaw"), {"yaw"}), ("quaternion", "xyzw", set())):
        for spelled in (key, f"{key}_deg", f"{key}_rad"):
            present = found.get(spelled)
            if type(present) is dict and present.keys() != {*parts} and present.keys() != least:
                missing = ", ".join(part for part in parts if part not in present)
                raise Misfit(f"incomplete rotation: missing {missing} beside {', '.join(present)}")
    return found


def _put(found: dict[str, Any], key: str, value: Any, present: str) -> None:
    """Store a value; raises Misfit for a second position, or for a duplicate."""
    if key in found:
        raise Misfit(f"{bare(present)} repeats another key; keep one", (present,), key=True)
    found[key] = value


def _turn(value: Any, order: str, key: str) -> tuple[str, Any]:
    """Return the key of the grammar for a rotation, by the shape of its value, and the value; raises Misfit."""
    if type(value) is list and len(value) == 4 and not any(type(each) is list for each in value):
        return _ordered(value, order, key), value
    if type(value) is list and (len(value) == 9 or any(type(each) is list for each in value)):
        return "matrix", value
    if type(value) is dict and not {"roll", "pitch", "yaw"}.isdisjoint(value):
        return "rpy", value
    if type(value) is dict and value.keys() == {"qx", "qy", "qz", "qw"}:
        return "quaternion", {name[1]: each for name, each in value.items()}
    if type(value) is list and len(value) == 3:
        what = f"{bare(key)} of 3 numbers does not say what they are"
        raise Misfit(f"{what}; write rpy, rpy_deg or rotvec", (key,), key=True)
    return "quaternion", value


def _ordered(value: list[Any], order: str, key: str) -> str:
    if not order:
        numbers = ", ".join(str(each) for each in value)
        what = f"{bare(key)} [{bare(numbers)}] does not state the position of w"
        raise Unclear(f"{what}: give --from xyzw or --from wxyz, for all of the file", (key,), key=True)
    return order
