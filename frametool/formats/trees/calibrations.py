r"""Calibrations as other tools write them.

autoware: the pose of the inner frame in the outer one; radians, about the fixed axes x, y, z

    base_link: {sensor_kit_base_link: {x: 0.9, y: 0.0, z: 2.0, roll: -0.001, pitch: 0.015, yaw: -0.0364}}

handeye, of easy_handeye: the pose of tracking_base_frame in robot_effector_frame if the eye is on the hand, else in
robot_base_frame

    parameters: {eye_on_hand: true, robot_effector_frame: tool0, tracking_base_frame: camera_link, ..}
    transformation: {x: .., y: .., z: .., qx: .., qy: .., qz: .., qw: ..}
    parameters: {calibration_type: eye_in_hand, ..}                        easy_handeye2
    transform: {translation: {x: .., ..}, rotation: {x: .., y: .., z: .., w: ..}}

nuscenes: ego<-sensor, and global<-ego, which moves; w first, microseconds.  Names of sensors are in sensor.json, in the
same folder or passed with the other files.

    calibrated_sensor.json   [{"token": .., "sensor_token": .., "translation": [x, y, z], "rotation": [w, x, y, z]}, ..]
    ego_pose.json            [{"token": .., "timestamp": 1531883530449377, "translation": .., "rotation": ..}, ..]
    sensor.json              [{"token": .., "channel": "CAM_FRONT", "modality": "camera"}, ..]

named, by hand: a map of names, or a list under `transforms:`.  Radians unless a key states degrees.  The pose is that
of the name, or of `child`, in `parent`, by default in `base` (--frames).  The order of a list of four or seven is
ambiguous: --from xyzw|wxyz sets it, for all.

    lidar: {x: 0.9, y: 0.0, z: 2.0, roll: 0.0, pitch: 0.0, yaw: 1.57}
    camera: {parent: lidar, translation: [0.1, 0, -0.2], quaternion: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
    imu: {trans_x: 0.1, trans_y: 0.0, trans_z: 0.0, rot_x: 0.0, rot_y: 0.0, rot_z: 0.0, rot_w: 1.0}
    base_to_left: {x: 0.1, y: 0.0, z: 0.0, ax: 0.0, ay: 0.0, az: 1.0, theta: 0.1}         needs --direction
    left: {R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [0.1, 0.0, 0.0]}                      needs --direction
    gps: {value: [0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 1.0]}                                     needs --from

kitti-calib, text: cameras, lidar and IMU, row-major; cameras have optical axes.  A projection K [I t] contains the
position of its camera: -t.

    P0: 718.856 0 607.193 0 0 718.856 185.216 0 0 0 1 0       odometry, object: projection of a rectified camera
    Tr: 12 numbers                                            odometry: cam0<-velo, cam0 rectified
    R0_rect: 9    Tr_velo_to_cam: 12    Tr_imu_to_velo: 12    object: cam0_rect<-cam0, cam0<-velo, velo<-imu
    R: 9    T: 3                                              raw: cam0<-velo of calib_velo_to_cam, velo<-imu
    R_01: 9    T_01: 3    R_rect_01: 9                        raw calib_cam_to_cam: cam1<-cam0, cam1_rect<-cam1

kalibr, text: results-cam-*.txt and results-imucam-*.txt.  The q of a baseline is the inverse of the matrix T_cn_cnm1 in
the same camchain: its quaternions are those of JPL.  The result agrees with the matrix; t is the same.

    baseline T_1_0:
        q: [-0.00087935 -0.00270995 -0.0008824 0.99999555] +- [..]    x y z w, of the inverse rotation
        t: [-0.02997144 -0.00027389 0.00036353] +- [..]               cam0 in cam1
    T_ci:  (imu0 to cam0):                                            maps points of imu0 to cam0
    Transformation T_cam0_imu0 (imu0 to cam0, T_ci):                  the same
    [[ 0.00852045 .. ]]                                               four rows of four

Metres.
"""

from __future__ import annotations

import os
import re
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile
from frametool.documents.writers import flow, quoted
from frametool.errors import BadAnswer, FormatError, Unanswered, ValueInvalid, bare, listing, shown, warn
from frametool.formats.trees.matrix_files import FRAME_KEYS, MATRIX, Meaning, Stated, directed, edges_of, meaning_of
from frametool.formats.trees.tree_reader import XYZ, document_edges, named
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pasted import WORDS, read_loose_pose
from frametool.grammar.pose import read_angle_unit, read_rotation, read_spelled
from frametool.grammar.readers import INDICES, Misfit, Path, Reading, Unclear, as_mapping, kind, read_numbers, within
from frametool.grammar.result import Style, angles_of, static_edges
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

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
SENSORS = "sensor.json"
PARENTS, CHILDREN = (tuple(dict.fromkeys(keys[at] for keys in FRAME_KEYS[:4])) for at in (0, 1))
_OF_CAMERAS = ("rvec", "qvec", "tvec", "R", "T", "t")  # camera<-world in OpenCV and COLMAP, often the inverse


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a calibration."""
    if whole := {"named": _read_named, "kitti-calib": _read_kitti, "kalibr": _read_kalibr}.get(file.format):
        return whole(file, options)
    take = {"autoware": _autoware, "handeye": _handeye}.get(file.format) or partial(_nuscenes, file, options)
    return document_edges(file, options, take)


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


def _nuscenes(file: InputFile, options: Options, value: Any, reading: Reading) -> Iterator[Edge]:
    """Yield one edge per pose of a sensor, or one sample per ego pose; of sensor.json only the frame above the sensors.

    If a sensor has several poses, each name includes the token.
    """
    world, ego = options.answers.names("global", "ego")
    records = _records(value)
    moves = "sensor_token" not in records[0]
    if moves and not {"translation", "rotation", "timestamp"} <= records[0].keys():
        if "channel" not in records[0]:
            raise Misfit("no poses in this table of nuScenes: they are in calibrated_sensor.json and ego_pose.json")
        yield Edge(None, ego, rigid.IDENTITY)
        return
    channels = None if moves else channels_of(file)
    poses: dict[str, dict[Rigid, tuple[str, Path]]] = {}
    for index, record in enumerate(records):
        path: Path = (index,)
        reading.here = path
        try:
            word = within(path, _text, record, "timestamp" if moves else "sensor_token")
            if moves and not re.fullmatch(r"(?a)\d{1,18}", word):
                raise Misfit(f"expected whole microseconds, found {shown(word)}", (index, "timestamp"))
            for key in ("translation", "rotation"):
                if key not in record:
                    raise Misfit(f"missing {key}", path)
            rotation = record["rotation"]  # w, x, y, z, or the 3x3 matrix of some forks
            rows = type(rotation) is list and any(type(row) is list for row in rotation)
            x, y, z = within((index, "translation"), read_numbers, record["translation"], XYZ)
            turn = within((index, "rotation"), read_rotation, "matrix" if rows else "wxyz", rotation, reading)[1]
        except Misfit as misfit:
            reading.refuse(misfit)
            continue
        if moves:
            yield Edge(world, ego, (x, y, z, *turn), int(word) * 1000, path=path)
        else:
            known = poses.setdefault((channels or {}).get(word, word), {})
            known.setdefault((x, y, z, *turn), (str(record.get("token")), path))
    unnamed = f"sensors are called by their tokens ({SENSORS} has the names: --with it)" if channels is None else ""
    several = next((name for name, found in poses.items() if len(found) > 1), None)
    more = f"those of several poses as {bare(several)}/TOKEN" if several else ""
    if not moves:
        options.tally.assumed = ", ".join(filter(None, (unnamed, more)))
    for name, found in poses.items():
        for pose, (token, path) in found.items():
            yield Edge(ego, f"{name}/{token}" if len(found) > 1 else name, pose, path=path)


def _records(value: Any) -> list[dict[str, Any]]:
    if type(value) is not list or not value:
        raise Misfit(f"expected a list of records, found {kind(value) if value else 'an empty one'}")
    return [within((index,), as_mapping, record, "a record") for index, record in enumerate(value)]


def _text(record: dict[str, Any], key: str) -> str:
    found = record.get(key)
    if type(found) is not str or not found:
        raise Misfit(f"{key} must be one word, found {kind(found or None)}", (key,) if key in record else ())
    return found


def channels_of(file: InputFile) -> dict[str, str] | None:
    """Return the names of sensors, by their tokens; None without the table of them."""
    table = next((each for each in file.siblings if os.path.basename(each.path) == SENSORS), None)
    if table is None:
        path = os.path.join(os.path.dirname(file.path), SENSORS)
        if file.path == "-" or not os.path.exists(path):
            return None
        table = InputFile(path)
    documents = parse_documents(table.text, table.name)
    try:
        records = _records(documents[0].value if len(documents) == 1 else None)
        return {_text(record, "token"): _text(record, "channel") for record in records}
    except Misfit as misfit:
        raise FormatError(str(misfit), source=table.name) from None


def _read_named(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per name of handwritten extrinsics."""
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
    """Read one pose and its meaning, with `is_stated` False if only its own name is known; raises Misfit."""
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
    for key, value in [*fields.items()]:  # texts, such as a topic or a model, but no misspelt number
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


# --- KITTI ---

CAMERAS = ("cam0", "cam1", "cam2", "cam3")
RECTIFICATIONS = ("R0_rect", "R_rect")
# name of a rotation, or of a pose of twelve numbers; that of its translation; parent, child; whether it is the inverse
OF_KITTI = (
    *((name, "", "cam0", "velo", False) for name in ("Tr", "Tr_velo_to_cam", "Tr_velo_cam")),
    *((name, "", "velo", "imu", False) for name in ("Tr_imu_to_velo", "Tr_imu_velo")),
    *((f"R_0{i}", f"T_0{i}", "cam0", f"cam{i}", True) for i in (1, 2, 3)),
    *((name, "", "cam0", "cam0_rect", True) for name in RECTIFICATIONS),
    *((f"R_rect_0{i}", "", camera, f"{camera}_rect", True) for i, camera in enumerate(CAMERAS)),
)
_COUNTS = (  # pattern of a name, number of values
    (r"P[0-3]|P_rect_0\d|Tr\w*", 12),
    (r"R|R_0\d|R0_rect|R_rect(?:_0\d)?|K_0\d", 9),
    (r"T|T_0\d", 3),
)


class KittiLine(NamedTuple):
    """The numbers of one line."""

    line: int
    numbers: tuple[float, ...]
    texts: list[str]


def kitti_lines(file: InputFile, options: Options) -> dict[str, KittiLine]:
    """Return the lines of a KITTI calibration by name; errors in them go to `options.report`."""
    found: dict[str, KittiLine] = {}
    for line, text in enumerate(file.text.split("\n"), 1):
        if not text.strip() or text.startswith("#"):
            continue
        first, *words = re.finditer(r"\S+", text)
        name = first[0].removesuffix(":")
        column, problem = 1, ""
        if not words or not re.fullmatch(r"\w+", name):
            problem = f"expected NAME: numbers, found {text.strip()[:40]!r}"
        elif name == "calib_time":  # not a number
            continue
        elif name in found:
            problem = f"{name} appears twice; first in line {found[name].line}"
        numbers: list[float] = []
        for word in () if problem else words:
            try:
                numbers.append(parse_number(word[0]))
            except ValueInvalid as error:
                column, problem = word.start() + 1, f"{name}: {error}"
                break
        expected = next((count for pattern, count in _COUNTS if re.fullmatch(pattern, name)), len(numbers))
        if not problem and len(numbers) != expected:
            column, problem = words[0].start() + 1, f"{name}: expected {expected} numbers, found {len(numbers)}"
        if problem:
            options.report(file.error(problem, line, column))
        else:
            found[name] = KittiLine(line, tuple(numbers), [word[0] for word in words])
    return found


def kitti_name(frame: str, options: Options) -> str:
    """Return the name of a frame."""
    base, rest = (frame[:-5], "_rect") if frame.endswith("_rect") else (frame, "")
    known = (*CAMERAS, "velo", "imu")
    return (options.answers.names(*known)[known.index(base)] if base in known else base) + rest


def _read_kitti(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of one file of a calibration."""
    lines = kitti_lines(file, options)
    is_raw = "R" in lines or "T" in lines
    found: list[tuple[str, str, Rigid, int]] = []
    poses = (("R", "T", *_ends(file, lines, options), False),) if is_raw else OF_KITTI
    for turn, shift, parent, child, inverse in poses:
        if turn not in lines or (shift and shift not in lines):
            continue
        line, numbers, texts = lines[turn]
        x, y, z = lines[shift].numbers if shift else numbers[3::4] if len(numbers) == 12 else rigid.IDENTITY[:3]
        reading = Reading(file.source, normalize=options.normalize)
        try:
            words = [text for at, text in enumerate(texts) if len(texts) == 9 or at % 4 < 3]
            rotation = read_spelled(MATRIX, words, [()] * 9, reading).rotation
        except ValueInvalid as error:
            raise file.error(f"{turn}: {error}", line, 1) from None
        for note in reading.notes:
            options.tally.note_each(f"{turn}: {note.message}", line, note.rule)
        pose = (x, y, z, *rotation)
        found.append((parent, child, rigid.inverse(*pose) if inverse else pose, line))
    rect = "_rect" if any(name in lines for name in RECTIFICATIONS) else ""
    # the cameras of projections have the axes of the rectified first one: the centre is -K^-1 p
    for index in () if is_raw else (1, 2, 3):
        if known := lines.get(f"P{index}"):
            fx, _, cx, px, _, fy, cy, py, _, _, _, pz = known.numbers
            for focal in (fx, fy):
                if not focal > 0.0:
                    raise file.error(f"P{index}: the focal length {focal:g} is not positive", known.line, 1)
            centre = 0.0 - (px - cx * pz) / fx, 0.0 - (py - cy * pz) / fy, 0.0 - pz
            found.append((f"cam0{rect}", f"cam{index}{rect}", (*centre, *rigid.IDENTITY[3:]), known.line))
    if not found:
        raise file.error("no pose in it: expected P0: to P3:, Tr:, R: and T:, or R_01: and T_01:")
    for parent, child, pose, line in found:
        names = {frame: kitti_name(frame, options) for frame in (parent, child)}
        yield Edge(names[parent], names[child], pose, line=line)
        cameras = (name for frame, name in names.items() if frame.startswith("cam"))
        options.tally.axes |= dict.fromkeys(cameras, options.answers.camera_axes or "optical")


def _ends(file: InputFile, lines: dict[str, KittiLine], options: Options) -> tuple[str, str]:
    """Return parent and child of the pose R: and T: of the raw recordings, by the file's name or contents."""
    for name, other in (("R", "T"), ("T", "R")):
        if name not in lines:
            raise file.error(f"missing {name}: together with {other}:")
    if len(chosen := options.answers.frames) == 2:
        return chosen[0], chosen[1]
    base = os.path.basename(file.name)
    if "velo_to_cam" in base or "delta_f" in lines:
        rect = "R_rect_00 of calib_cam_to_cam turns it to cam0_rect"
        options.tally.assumed = f"cam0<-velo (--frames), cam0 as it is before rectification ({rect})"
        return "cam0", "velo"
    if "imu_to_velo" in base:
        options.tally.assumed = "velo<-imu (--frames)"
        return "velo", "imu"
    ways = "give --frames cam0,velo (of calib_velo_to_cam) or velo,imu"
    message = f"R: and T: do not say between which frames; {ways}"
    raise Unanswered(message, source=file.name, line=lines["R"].line)


# --- Kalibr ---

# a baseline by its two numbers; a matrix between two frames; a matrix below the number of its IMU
_HEAD = re.compile(
    r"(?im)^[ \t]*(?:(?P<name>baseline T_(?P<to>\d+)_(?P<of>\d+)):|(?:Transformation[ \t]+)?(?P<key>T_\w+|Baseline):?"
    r"[ \t]*\((?P<source>\w+) to (?P<target>\w+)(?:, T_\w+)?\)|(?P<imu>IMU\d+):[ \t\r]*$|(?P<own>T_i_b)[ \t\r]*$)"
)
_ROWS = re.compile(r"[^\n]*\n\s*\[\[([^\[\]]*(?:\]\s*\[[^\[\]]*)*)\]\]")
_VECTOR = r"[^\n]*\n(?:[^\n]*\n)??[ \t]*{}:\s*\[([^\[\]]*)\]"


def _read_kalibr(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per camera and IMU; duplicates are checked."""
    reading = Reading(file.source, normalize=options.normalize)
    text, lines, stated, imu = file.text, dict[str, int](), list[Stated](), ""
    for head in _HEAD.finditer(text):
        if head["imu"]:
            imu = head["imu"].lower()
            continue
        target, source = (
            (f"cam{head['to']}", f"cam{head['of']}") if head["name"]
            else (imu, "imu0") if head["own"] else (head["target"], head["source"])
        )  # fmt: skip
        label = head["name"] or f"{head['own'] or head['key']} ({source} to {target})"
        lines[label] = 1 + text.count("\n", 0, head.end())
        reading.here = (label,)
        try:
            pose = _kalibr_pose(text, head, reading)
        except ValueInvalid as error:
            raise file.error(f"{label}: {error}", lines[label]) from None
        if target != source:  # as the first IMU relative to itself
            child = max(target, source, key=lambda name: (name[:3] == "cam", name[:3], len(name), name))
            stated.append(Stated(target, source, child, pose, (label,), chained=target[:3] == source[:3] == "cam"))
    if not stated:
        raise file.error("no pose in it: it would be under baseline T_1_0 or T_ci")
    try:
        edges = edges_of(stated, reading)
    except Misfit as misfit:
        raise file.error(str(misfit), lines.get(str(misfit.path[0]), 0)) from None
    for note in reading.notes:
        options.tally.note_each(f"{note.path[0]}: {note.message}", lines[str(note.path[0])], note.rule)
    # --frames names the IMUs, then the cameras, by their numbers
    found = {name for each in edges for name in (each.parent or "", each.child)}
    frames = sorted(found, key=lambda name: (name[:3] == "cam", len(name), name))
    if len(chosen := options.answers.frames) > len(frames):
        raise BadAnswer(f"--frames names {len(chosen)} frames, there are {len(frames)}: {', '.join(frames)}")
    names = dict(zip(frames, options.answers.names(*frames), strict=True))
    for each in edges:
        line = lines[str(each.path[0])]
        yield each._replace(parent=names[each.parent or ""], child=names[each.child], line=line, path=())


def _kalibr_pose(text: str, head: re.Match[str], reading: Reading) -> Rigid:
    """Read the q and t below a baseline, or the four rows below the line of a matrix; raises Misfit."""
    if not head["name"]:
        rows = _ROWS.match(text, head.end())
        words = re.findall(r"[^\s\[\],]+", rows[1]) if rows else []
        if len(words) != 16:
            raise Misfit(f"expected a 4 x 4 matrix below it, found {f'{len(words)} numbers' if words else 'none'}")
        position, rotation = read_spelled(MATRIX, words, INDICES, reading)[:2]
        return *(position or (0.0, 0.0, 0.0)), *rotation
    turn, shift = (re.compile(_VECTOR.format(name)).match(text, head.end()) for name in "qt")
    if turn is None or shift is None:
        raise Misfit("expected q: [x y z w] and t: [x y z] below it")
    if len(words := turn[1].split()) != 4:
        raise Misfit(f"q: expected 4 numbers, found {len(words)}")
    x, y, z = read_numbers(shift[1].split(), XYZ)
    return x, y, z, *quaternion.conjugate(*read_spelled(notation("xyzw"), words, INDICES, reading).rotation)


# --- writing ---


def write_tree(tree: Frames, style: Style) -> str:
    """Return the tree as in Autoware or easy_handeye, or by names; raises ValueInvalid for trees that do not fit."""
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
