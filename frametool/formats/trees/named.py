"""Handwritten extrinsics: a map of names, or a list under `transforms:`, each with one pose.

    lidar: {x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}
    camera: {parent: lidar, translation: [0.1, 0, -0.2], quaternion: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
    imu: {trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
    base_to_left: {x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}         needs --direction
    left: {R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [0.1, 0.0, 0.0]}                      needs --direction
    gps: {value: [0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 1.0]}                                     needs --from

Metres, radians unless a key states degrees.  The pose is that of the name, or of `child`, in `parent`, by default in
`base` (--frames).  The order of a list of four or seven is ambiguous: --from xyzw|wxyz sets it, for all.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import flow, quoted
from frametool.errors import bare
from frametool.formats.trees.matrices import FRAME_KEYS, Ambiguous, Meaning, directed, meaning_of
from frametool.formats.trees.tree_reader import document_edges, named
from frametool.formats.trees.written_poses import static_edges, warn_lonely_roots
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.edges import Edge, Options
from frametool.grammar.loose import WORDS, read_loose_pose
from frametool.grammar.pose import read_angle_unit
from frametool.grammar.readers import Misfit, Reading, as_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style

NAME = "named"
WRAPPERS = ("transforms", "extrinsics")  # an outermost key that is not a name
PARENTS, CHILDREN = (tuple(dict.fromkeys(keys[at] for keys in FRAME_KEYS[:4])) for at in (0, 1))
_OF_CAMERAS = ("rvec", "qvec", "tvec", "R", "T", "t")  # camera<-world in OpenCV and COLMAP, often the inverse


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per name."""
    frames = options.answers.frames
    base = options.answers.names("base")[0]
    in_base, said, left = list[bool](), list[bool](), dict[str, None]()  # of each pose; remarks

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        reading.bare_numbers = False
        top: dict[Any, Any] = as_mapping(value, "poses by the names of frames")
        path: Path = ()
        if "angles" in top:
            reading.degrees = read_angle_unit(top.pop("angles"))
        if len(top) == 1 and (wrapper := next(iter(top))) in WRAPPERS:
            value, path = top[wrapper], (wrapper,)
            top = dict(enumerate(value)) if type(value) is list else as_mapping(value, "poses by the names of frames")
        for name, entry in top.items():
            here: Path = (*path, name)
            reading.here = here
            try:
                pose, ends = _entry(name, entry, reading, options, left)
                in_base.append(ends is None)
                said.append(type(entry) is dict and not {*PARENTS}.isdisjoint(entry))
                target, source, child = ends or (base, str(name), str(name))
                if child != source:
                    pose = rigid.inverse(*pose)
                yield Edge(source if child == target else target, child, pose, path=here)
            except Misfit as misfit:
                reading.refuse(misfit.below(*here))

    yield from document_edges(file, options, take)
    if frames and all(said):
        options.tally.note(f"--frames {','.join(frames)} has no effect: each pose names its parent", 1)
    count = f"{len(said)} {'pose' if len(said) == 1 else 'poses'}"
    assumed = f"{count} in {bare(base)} (--frames says another)" if any(in_base) and not frames else ""
    others = f"{', '.join(map(bare, left))} left out" if left else ""
    options.tally.assumed = "; ".join(filter(None, (assumed, others)))


def _entry(
    name: str | int, entry: Any, reading: Reading, options: Options, left: dict[str, None]
) -> tuple[Rigid, tuple[str, str, str] | None]:
    """Read one pose, and its frames: target, source and the child; None if only its own name is known.

    Raises Misfit.
    """
    if type(entry) is list:
        entry = {"value": entry}
    fields = dict(as_mapping(entry, "a pose as {x: .., y: .., z: .., roll: .., pitch: .., yaw: ..}"))
    parent, child = (_frame(fields, keys) for keys in (PARENTS, CHILDREN))
    child = child or (None if type(name) is int else str(name))
    if child is None:
        accepted = f"{', '.join(CHILDREN)}; of its parent: {', '.join(PARENTS)}"
        raise Misfit(f"missing child; in a list an entry names its frame; keys: {accepted}")
    for key in [key for key, value in fields.items() if _is_remark(key, value)]:
        left[key] = fields.pop(key)
    read = read_loose_pose(fields, reading, order=options.answers.order)
    if read.position is None and read.rotation is None:
        raise Misfit("neither position nor rotation; a pose has x, y, z, or a key like translation, and a rotation")
    if parent is not None:
        return read.components, (parent, child, child)
    meaning = meaning_of(child, dict.fromkeys(("before", "sensor"), "") | _SELF, options.answers.frames)
    if isinstance(meaning, Ambiguous):
        raise meaning.error(child)
    if meaning is None and (pair := [key for key in fields if key in _OF_CAMERAS]) and len(pair) == len(fields) == 2:
        meaning = directed(" and ".join(pair), (), options.answers.names("base")[0], child, options.answers)
    elif isinstance(meaning, Meaning) and not meaning.said:
        meaning = directed(child, (), meaning.target, meaning.source, options.answers)
    if meaning is None or not (meaning.target and meaning.source):
        return read.components, None
    return read.components, (meaning.target, meaning.source, meaning.child)


_SELF = {"me": "cam", "imu": "imu", "body": "body"}


def _frame(fields: dict[str, Any], keys: tuple[str, ...]) -> str | None:
    """Remove the name of a frame from an entry; raises Misfit for two of them."""
    there = [key for key in keys if key in fields]
    if len(there) > 1:
        raise Misfit(f"{' and '.join(there)} in one entry; keep one", (there[1],), key=True)
    found = named(fields, there[0]) if there else None
    for key in there:
        del fields[key]
    return found


def _is_remark(key: str, value: Any) -> bool:
    """Return True for a text of an entry, such as a topic or a model; False for what may be a misspelt number."""
    return key not in WORDS and type(value) is str and re.match(r"[-+.]*\d", value) is None


def write_tree(tree: Frames, style: Style) -> str:
    """Return a map of names; raises ValueInvalid for moving frames."""
    texts = []
    for parent, child, pose in static_edges(tree, NAME):
        x, y, z, w = quaternion.from_quaternion(*pose[3:], floats)
        entry = {"parent": parent, "xyz": [*pose[:3]], "quaternion": {"x": x, "y": y, "z": z, "w": w}}
        texts.append(f"{quoted(child)}: {flow(entry, style.number)}\n")
    warn_lonely_roots(tree, NAME)
    return "".join(texts)
