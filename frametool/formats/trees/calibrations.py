r"""Calibrations that are named poses: of Autoware, of easy_handeye, and by hand.

autoware: the pose of the inner frame in the outer one; radians, about the fixed axes x, y, z

    base_link: {sensor_kit_base_link: {x: 0.9, y: 0.0, z: 2.0, roll: -0.001, pitch: 0.015, yaw: -0.0364}}

handeye, of easy_handeye: the pose of tracking_base_frame in robot_effector_frame if the eye is on the hand, else in
robot_base_frame

    parameters: {eye_on_hand: true, robot_effector_frame: tool0, tracking_base_frame: camera_link, ..}
    transformation: {x: .., y: .., z: .., qx: .., qy: .., qz: .., qw: ..}
    parameters: {calibration_type: eye_in_hand, ..}                        easy_handeye2
    transform: {translation: {x: .., ..}, rotation: {x: .., y: .., z: .., w: ..}}

named, by hand: a map of names, or a list under `transforms:`.  Radians unless a key states degrees.  The pose is that
of the name, or of `child`, in `parent`, by default in `base` (--frames).  The order of a list of four or seven is
ambiguous: --from xyzw|wxyz sets it, for all.

    lidar: {x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}
    camera: {parent: lidar, translation: [0.1, 0, -0.2], quaternion: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
    imu: {trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
    base_to_left: {x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}         needs --direction
    left: {R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [0.1, 0.0, 0.0]}                      needs --direction
    gps: {value: [0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 1.0]}                                     needs --from

Metres.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.writers import flow, quoted
from frametool.errors import ValueInvalid, bare, listing, shown, warn
from frametool.formats.trees.matrix_keys import FRAME_KEYS, Meaning, directed, meaning_of
from frametool.formats.trees.tree_reader import XYZ, document_edges, named
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pasted import WORDS, read_loose_pose
from frametool.grammar.pose import read_angle_unit
from frametool.grammar.readers import Misfit, Path, Reading, Unclear, as_mapping, kind, within
from frametool.grammar.result import Style, angles_of, static_edges

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.geometry import Rigid

ANGLES = (*XYZ, "roll", "pitch", "yaw")
QUATERNION = (*XYZ, "qx", "qy", "qz", "qw")
CHILD = "tracking_base_frame"
EFFECTOR, BASE = "robot_effector_frame", "robot_base_frame"
# a parameter -> the reference frame of the camera
MOUNTS = {
    "eye_on_hand": {"true": EFFECTOR, "false": BASE},
    "calibration_type": {"eye_in_hand": EFFECTOR, "eye_on_hand": EFFECTOR, "eye_on_base": BASE, "eye_to_hand": BASE},
}
POSES = {"transformation": QUATERNION, "transform": ("translation", "rotation")}
PARENTS, CHILDREN = (tuple(dict.fromkeys(keys[at] for keys in FRAME_KEYS[:4])) for at in (0, 1))
_OF_CAMERAS = ("rvec", "qvec", "tvec", "R", "T", "t")  # camera<-world in OpenCV and COLMAP, often the inverse


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a calibration."""
    if file.format == "named":
        return _read_named(file, options)
    return document_edges(file, options, _autoware if file.format == "autoware" else _handeye)


def _pose(value: Any, keys: tuple[str, ...], what: str, reading: Reading) -> Rigid:
    """Read a pose that has exactly these keys; raises Misfit."""
    pose = as_mapping(value, f"{what} as {{{', '.join(keys)}}}")
    for key in pose:
        if key not in keys:
            raise Misfit(f"unknown key {shown(key)}; a pose has {', '.join(keys)}", (key,), key=True)
    if missing := [key for key in keys if key not in pose]:
        raise Misfit(f"missing {', '.join(missing)}; a pose has {', '.join(keys)}")
    return read_loose_pose(pose, reading).components


def _autoware(value: Any, reading: Reading) -> Iterator[Edge]:
    for parent, children in as_mapping(value, "frames with the poses of others in them").items():
        inner = within((parent,), as_mapping, children, f"the poses of frames in {shown(parent)}")
        for child, pose in inner.items():
            path: Path = (parent, child)
            reading.here = path
            try:
                yield Edge(parent, child, _pose(pose, ANGLES, f"the pose of {shown(child)}", reading), path=path)
            except Misfit as misfit:
                reading.refuse(misfit.below(*path))


def _handeye(value: Any, reading: Reading) -> Iterator[Edge]:
    calibration = as_mapping(value, "parameters and transformation")
    inner = "parameters" in calibration  # missing in the first easy_handeye
    path: Path = ("parameters",) if inner else ()
    parameters = within(path, as_mapping, calibration["parameters"] if inner else calibration, "the parameters")
    mount = next((key for key in MOUNTS if key in parameters), None)
    if mount is None:
        raise Misfit("missing eye_on_hand (easy_handeye) or calibration_type (easy_handeye2)", path)
    if str(value := parameters[mount]) not in MOUNTS[mount]:
        raise Misfit(f"{mount} must be {' or '.join(MOUNTS[mount])}, found {kind(value)}", (*path, mount))
    parent, child = (within(path, named, parameters, key) for key in (MOUNTS[mount][value], CHILD))
    key = next((key for key in POSES if key in calibration), None)
    if key is None:
        raise Misfit("missing transformation (easy_handeye) or transform (easy_handeye2)")
    reading.here = (key,)
    pose = within((key,), _pose, calibration[key], POSES[key], "the pose of the camera", reading)
    yield Edge(parent, child, pose, path=(key,))


def _read_named(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per name of extrinsics written by hand."""
    frames = options.answers.frames
    base = options.answers.names("base")[0]
    in_base, with_parent, left = list[bool](), list[bool](), dict[str, None]()  # for each pose; keys left out

    def take(value: Any, reading: Reading) -> Iterator[Edge]:
        reading.bare_numbers = False
        top: dict[Any, Any] = as_mapping(value, "poses by the names of frames")
        path: Path = ()
        if "angles" in top:
            reading.degrees = read_angle_unit(top.pop("angles"))
        if len(top) == 1 and (wrapper := next(iter(top))) in ("transforms", "extrinsics"):  # not a name
            value, path = top[wrapper], (wrapper,)
            top = dict(enumerate(value)) if type(value) is list else as_mapping(value, "poses by the names of frames")
        for name, entry in top.items():
            here: Path = (*path, name)
            reading.here = here
            try:
                pose, (target, source, child, is_stated) = _entry(name, entry, reading, options, left)
                in_base.append(not is_stated)
                with_parent.append(type(entry) is dict and not {*PARENTS}.isdisjoint(entry))
                if child != source:
                    pose = rigid.inverse(*pose)
                yield Edge(source if child == target else target, child, pose, path=here)
            except Misfit as misfit:
                reading.refuse(misfit.below(*here))

    yield from document_edges(file, options, take)
    if frames and all(with_parent):
        options.tally.note(f"--frames {','.join(frames)} has no effect: each pose names its parent", 1)
    count = f"{sum(in_base)} {'pose' if sum(in_base) == 1 else 'poses'}"
    assumed = f"{count} in {bare(base)} (--frames says another)" if any(in_base) and not frames else ""
    others = f"{', '.join(map(bare, left))} left out" if left else ""
    options.tally.assumed = "; ".join(filter(None, (assumed, others)))


def _entry(
    name: str | int, entry: Any, reading: Reading, options: Options, left: dict[str, None]
) -> tuple[Rigid, Meaning]:
    """Read one pose and its meaning, with `is_stated` False if only the name of the entry is known; raises Misfit.

    name: key of the entry, or its index in a list; left: receives the texts that are not part of the pose
    """
    if type(entry) is list:
        entry = {"value": entry}
    fields = as_mapping(entry, "a pose as {x: .., y: .., z: .., roll: .., pitch: .., yaw: ..}")
    frames = []
    for keys in (PARENTS, CHILDREN):
        there = [key for key in keys if key in fields]
        if len(there) > 1:
            raise Misfit(f"{' and '.join(there)} in one entry; keep one", (there[1],), key=True)
        frames.append(named(fields, there[0]) if there else "")
        fields = {key: value for key, value in fields.items() if key not in there}
    parent, child = frames
    child = child or ("" if type(name) is int else str(name))
    if not child:
        accepted = f"{', '.join(CHILDREN)}; of its parent: {', '.join(PARENTS)}"
        raise Misfit(f"missing child; in a list an entry names its frame; keys: {accepted}")
    for key, value in [*fields.items()]:  # leave out texts, such as a topic or a model, but no misspelt number
        if key not in WORDS and type(value) is str and re.match(r"[-+.]*\d", value) is None:
            left[key] = fields.pop(key)
    read = read_loose_pose(fields, reading, order=options.answers.order)
    if read.position is None and read.rotation is None:
        raise Misfit("neither position nor rotation; a pose has x, y, z, or a key like translation, and a rotation")
    if parent:
        return read.components, Meaning(parent, child, child)
    known = {"me": "cam", "before": "", "imu": "imu", "body": "body", "sensor": ""}
    meaning = meaning_of(child, known, options.answers.frames)
    if isinstance(meaning, Unclear):
        raise meaning
    if meaning is None and (pair := [key for key in fields if key in _OF_CAMERAS]) and len(pair) == len(fields) == 2:
        meaning = directed(" and ".join(pair), (), options.answers.names("base")[0], child, options.answers)
    elif meaning is not None and not meaning.is_stated:
        meaning = directed(child, (), meaning.target, meaning.source, options.answers)
    if meaning is None or not (meaning.target and meaning.source):
        meaning = Meaning(options.answers.names("base")[0], child, child, is_stated=False)
    return read.components, meaning


# --- writing ---


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree in the format of Autoware, easy_handeye, or by names; raises ValueInvalid if it does not fit."""
    edges = static_edges(tree, style.format)
    if style.format == "named":
        text = ""
        for parent, child, pose in edges:
            rotation = dict(zip("xyzw", quaternion.from_quaternion(*pose[3:], floats), strict=True))
            entry = {"parent": parent, "xyz": [*pose[:3]], "quaternion": rotation}
            text += f"{quoted(child)}: {flow(entry, style.number)}\n"
        return text
    if style.format == "handeye":
        if len(edges) != 1:
            children = listing(child for _, child, _ in edges)
            raise ValueInvalid(f"handeye holds one pose, and here are {len(edges)}: {children}")
        ((parent, child, pose),) = edges
        warn(f"handeye: {shown(parent)} is written as the hand; for a fixed camera write eye_on_hand: false and {BASE}")
        return write_mount(parent, child, pose, style, on_hand=True)
    texts: dict[str, str] = {}
    for parent, child, pose in edges:
        lines = _lines(ANGLES, (*pose[:3], *angles_of(pose[3:])), style, "    ")
        texts[parent] = f"{texts.get(parent, '')}  {quoted(child)}:\n{lines}"
    if len(texts) > 1:
        warn(f"Autoware has a file for each frame that holds others; here in one: {listing(texts)}")
    return "".join(f"{quoted(parent)}:\n{children}" for parent, children in texts.items())


def write_mount(parent: str, child: str, pose: Rigid, style: Style, *, on_hand: bool) -> str:
    """Return the pose of a camera on the hand, or fixed to the base, in the format of easy_handeye."""
    turned = quaternion.from_quaternion(*pose[3:], floats)
    mount = EFFECTOR if on_hand else BASE
    frames = f"  eye_on_hand: {str(on_hand).lower()}\n  {mount}: {quoted(parent)}\n  {CHILD}: {quoted(child)}\n"
    return f"parameters:\n{frames}transformation:\n{_lines(QUATERNION, (*pose[:3], *turned), style, '  ')}"


def _lines(keys: Iterable[str], numbers: Iterable[float], style: Style, indent: str) -> str:
    return "".join(f"{indent}{key}: {flow(number, style.number)}\n" for key, number in zip(keys, numbers, strict=True))
