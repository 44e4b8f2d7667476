"""Poses as people write them by hand: single numbers, lists under various names; converted to the keys of the grammar.

{x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}          {x: 1, y: 2, theta: 90deg}
{trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
{x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.errors import bare
from frametool.geometry.representations import RPY
from frametool.grammar.pose import POSE_KEYS, POSITION_WORDS, ROTATION_WORDS, Pose, is_position, own_key, read_pose
from frametool.grammar.readers import COLUMN_WORDS, Misfit, Path, Reading, Unclear, kind, within

if TYPE_CHECKING:
    from collections.abc import Collection


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
