"""The JSON Schema of frametool's trees in YAML and JSON, for editors: their keys, and the types of values.

The schema accepts more than the reader, never less: texts such as `90deg` are accepted as numbers, names may look like
numbers, and combinations of keys are checked only when a file is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.formats.trees.tree_reader import CAMERA_KEYS, STAMP_KEYS, TREE_KEYS
from frametool.geometry.lenses import CAMERA_MODELS
from frametool.geometry.representations import MAP, NAMED, POSITIONS
from frametool.grammar.pasted import WORDS
from frametool.grammar.place import EARTH_KEYS
from frametool.grammar.pose import LISTED_WORDS, NAMES, POSITION_KEYS, ROTATION_KEYS, ROTATION_WORDS
from frametool.grammar.readers import AXES_KEY
from frametool.ros.messages import MARKS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    Schema = dict[str, Any]

MESSAGE: Schema = {"type": ["object", "null"]}
NUMBER: Schema = {"type": ["number", "string"]}
NAME: Schema = {"type": ["string", "number", "boolean"], "description": "the name of a frame"}
UNIT = {True: ", degrees", False: ", radians", None: ", radians unless angles: deg"}
KEYS = WORDS | EARTH_KEYS | STAMP_KEYS | {"samples", "camera"}
MODEL: Schema = {"anyOf": [{"enum": [*CAMERA_MODELS]}, {"type": "string"}]}  # camera model, in upper or lower case
MEANINGS: dict[str, Schema] = {
    "inverse": {"enum": [True, False], "description": "true: the numbers are those of the parent in the frame"},
    "angles": {"enum": ["deg", "rad"], "description": "the unit of bare angles"},
    AXES_KEY: {"type": "string", "description": "a constant rotation by name: optical, ned_from_enu (help axes)"},
    "at": {"type": "object", "description": "a position on the Earth (help earth)"},
    "sigma": {"type": "object", "description": "standard deviations: xyz or xyz_mm, rpy or rpy_deg"},
    "covariance": {"type": "array", "description": "36 numbers or 6 rows, over x y z and rotation about x y z"},
    "stamp": NUMBER | {"description": "seconds"},
    "stamp_ns": {"type": ["integer", "string"], "description": "nanoseconds"},
}


def schema() -> Schema:
    """Return the schema of a document: a tree, a list of entries, one entry, or a ROS message."""
    tree = {"type": "object", "properties": {"frames": _ref("frames"), "angles": MEANINGS["angles"]}}
    keys = {key: _of_key(key) for key in sorted(KEYS | {"children"})}
    named = {"if": {"type": "object", "properties": {"parent": {"type": "string"}}, "required": ["parent"]}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "frametool: a tree of frames",
        "if": {"type": "object", "required": ["frames"]},
        "then": tree | {"propertyNames": {"enum": sorted(TREE_KEYS)}},
        "else": {"if": {"type": "array"}, "then": {"items": _ref("entry")}, "else": _ref("entry")},
        "$defs": {
            "keys": {"properties": keys},
            "frames": {
                "if": {"type": "array"},
                "then": {"items": _ref("entry")},
                "else": {
                    "type": ["object", "null"],
                    "additionalProperties": named | {"then": _entry({"children", "parent"}), "else": _ref("children")},
                },
            },
            "children": {"type": ["object", "null"], "additionalProperties": _entry({"children"})},
            "entry": {"if": _one_of((*MARKS, "op")), "then": MESSAGE, "else": _entry(NAMES) | _one_of(NAMES)},
            "sample": _entry(NAMES, without={"samples", "camera"}),
            "camera": {
                "type": "object",
                "required": ["K"],
                "properties": {key: {} for key in CAMERA_KEYS} | {"model": MODEL},
                "additionalProperties": False,
            },
        },
    }


def _one_of(keys: Iterable[str]) -> Schema:
    """Return the schema of an object with at least one of the keys: a message, or an entry."""
    return {"anyOf": [{"required": [key]} for key in sorted(keys)]}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _entry(also: Collection[str], without: Collection[str] = ()) -> Schema:
    """Return the schema of an entry: the keys of poses, and `also`, without others."""
    keys = (KEYS - NAMES).union(also).difference(without)
    properties = {key: {"$ref": f"#/$defs/keys/properties/{key}"} for key in sorted(keys)}
    return {"type": ["object", "null"], "properties": properties, "additionalProperties": False}


def _of_key(key: str) -> Schema:
    """Return the schema of the value of a key; {} for keys whose meaning depends on their value."""
    if key in ("samples", "children", "camera"):
        return {"type": "array", "items": _ref("sample")} if key == "samples" else _ref(key)
    if key in NAMES:
        return NAME
    if key in LISTED_WORDS:
        return {}
    if key in POSITION_KEYS:
        unit = key.removeprefix("xyz_") if key.startswith("xyz_") else "m"
        about = f"position of the frame in its parent, {unit}"
        return _numbers(("x", "y", "z"), about) | {"additionalProperties": False}
    if key in ROTATION_KEYS and key not in ROTATION_WORDS:
        row = ROTATION_KEYS[key].representation
        about = row.summary + (UNIT[ROTATION_KEYS[key].degrees] if row.angles else "")
        if isinstance(row.shape, tuple) or row.shape == NAMED:
            return {"type": ["object", "array"], "description": about}
        return _numbers(row.names if row.shape == MAP else (), about)
    if key in POSITIONS:
        return {"description": POSITIONS[key].summary}
    return MEANINGS.get(key, {})


def _numbers(names: Collection[str], about: str) -> Schema:
    """Return the schema of a list of numbers, or also of a mapping with these names, if there are any."""
    kinds = ["array", "object"] if names else ["array"]
    return {"type": kinds, "properties": dict.fromkeys(names, NUMBER), "description": about}
