"""Read the intrinsics of the cameras in a file; cameras are identified by name.

    camera: {model: plumb_bob, K: [fx, fy, cx, cy], D: [..], size: [w, h]}      frametool: a file, in a tree, or inline
    camera_matrix: {data: [9]}, distortion_coefficients: {data: [..]}           camera_info of ROS, OpenCV
    k: [9], d: [..], p: [12], distortion_model: plumb_bob, width: 640           a message CameraInfo
    cam0: {camera_model: pinhole, intrinsics: [4], distortion_coeffs: [..]}     Kalibr
    1 OPENCV 1600 1200 fx fy cx cy k1 k2 p1 p2                                  COLMAP's cameras.txt
    fl_x: .., cx: .., k1: .., camera_model: OPENCV  or  camera_angle_x: ..      NeRF
    P2: 12 numbers  or  K_02:, D_02:, S_02:, P_rect_02:                         KITTI
    [{sensor_token: .., camera_intrinsic: [9]}, ..]                             nuScenes

Pixel coordinates are 0 at the centre of the first pixel, in COLMAP and NeRF at its corner.  Each reader yields names
and the arguments of `Camera`; a camera is created on demand, so that an unsupported one does not affect the others.
"""

from __future__ import annotations

import os
import re
from contextlib import closing, contextmanager
from functools import partial
from io import BufferedReader, BytesIO
from math import tan
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, alternatives, listing, shown, warn
from frametool.formats.detect import of_folder
from frametool.formats.trees.matrix_files import TAGS, made_ordinary
from frametool.formats.trees.tree_reader import CAMERA_KEYS, camera_fields, numbers_of
from frametool.geometry.camera import Camera
from frametool.geometry.lenses import CAMERA_MODELS
from frametool.grammar.edges import Answers, Diagnostics, Options, Topics
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.formats.load import FrameFile
    from frametool.frames.lookups import Frames

    Found = Iterator[tuple[str, dict[str, Any]]]
    Makers = dict[str, Callable[..., Camera]]

INFO = "sensor_msgs/msg/CameraInfo"
# argument of Camera -> keys in files; OpenCV's may end in a number
KEYS = {
    "K": "K|k|camera_matrix|cameraMatrix|M|camera_intrinsic",
    "D": r"D|d|dist(?!ance|ortion_(?:model|type))\w*?",
    "R": "R|r|rectification_matrix",
    "P": "P|p|projection_matrix",
    "model": "distortion_model|model",
}
SIZES = ("width", "height"), ("image_width", "image_height")
# camera model in COLMAP and NeRF -> our model, number of focal lengths, number of parameters after the centre
COLMAP = {
    "SIMPLE_PINHOLE": ("pinhole", 1, 0), "PINHOLE": ("pinhole", 2, 0), "SIMPLE_RADIAL": ("plumb_bob", 1, 1),
    "RADIAL": ("plumb_bob", 1, 2), "OPENCV": ("plumb_bob", 2, 4), "FULL_OPENCV": ("rational_polynomial", 2, 8),
    "SIMPLE_FISHEYE": ("equidistant", 1, 0), "FISHEYE": ("equidistant", 2, 0), "OPENCV_FISHEYE": ("equidistant", 2, 4),
    "SIMPLE_RADIAL_FISHEYE": ("equidistant", 1, 1), "RADIAL_FISHEYE": ("equidistant", 1, 2), "FOV": ("fov", 2, 1),
    "EUCM": ("eucm", 2, 2),
}  # fmt: skip
ANGLE, LISTED = "camera_angle_x", "intrinsics"  # keys of NeRF and Kalibr


def load_camera(
    path: str | os.PathLike[str], name: str | None = None, *, model: str | None = None,
    size: Sequence[int] | None = None,
) -> Camera:  # fmt: skip
    """Read a camera from a file: `load_camera("chain.yaml", "cam0")`; text that begins with `{` is read directly.

    name: selects one of several cameras; `FILE:NAME` does too
    model: overrides the model in the file; size: of the image, if the file does not state it, or to resize
    Raises FormatError, and FileProblem.
    """
    text = str(path)
    inline = BufferedReader(BytesIO(text.encode())) if text.lstrip().startswith("{") else None
    if name is None and not inline and not os.path.exists(text) and ":" in text:
        text, _, name = text.rpartition(":")
    with closing(InputFile("--camera" if inline else text, inline, folder=of_folder(text) is not None)) as file:
        known = cameras_of(file)
    if not known:
        raise file.error("no camera in it: neither K nor what else `frametool help cameras` lists")
    first, *others = known
    if name is None and any(known[each].args != known[first].args for each in others):
        raise file.error(f"several cameras; {text}:NAME chooses one; cameras: {listing(known)}")
    if name is not None and name not in known and (number := re.fullmatch(r"(?:P|cam)?0?(\d)", name)):
        name = next((each for each in (f"cam{number[1]}", f"cam{number[1]}_rect") if each in known), name)
    if name is not None and name not in known:
        raise file.error(f"no camera {shown(name)}{alternatives(name, known, 'cameras')}")
    return known[first if name is None else name](model=model, size=size)


def cameras_of(file: InputFile) -> dict[str, partial[Camera]]:
    """Return a function that creates each camera of a file, by its name; "" for a camera without one.

    Raises FormatError for invalid text.
    """
    found: dict[str, dict[str, Any]] = {}
    changed: dict[str, None] = {}
    with _placed(file.name):
        for name, fields in _read(file):
            if found.setdefault(name, fields) != fields:
                changed[name] = None
    if changed:
        warn(f"{file.name}: {listing(changed)}: other numbers come later; the first ones hold")
    return {name: partial(_made, file.name, fields, name=name) for name, fields in found.items()}


def cameras_of_tree(tree: Frames, files: Sequence[FrameFile]) -> Makers:
    """Return functions that create the cameras in a tree's files, by their frames."""
    found: Makers = {}
    for file in files:
        again = file
        if file.path != "-":
            again = type(file)(file.path, fmt=file.format, answers=file.answers)
            again.siblings = file.siblings
        with closing(again):
            known = cameras_of(again)
        for name, make in ((name.removeprefix("/"), make) for name, make in known.items()):
            like = rf"cam(?:era)?_?{name}" if name.isdigit() else "" if name else r"cam\w*"
            own = () if name else file.tally.axes
            frames = [each for each in tree.frames if re.fullmatch(like, each) or each in own]
            frames = [name] if name in tree.frames else frames
            found |= dict.fromkeys(frames[: len(frames) == 1], make)
    return found


def _made(
    source: str, fields: dict[str, Any], *, name: str, model: str | None = None, size: Sequence[int] | None = None
) -> Camera:
    """Create a camera from the fields in a file; raises FormatError."""
    arguments, line = {"model": None, **fields}, fields.get("line", 0)
    with _placed(source, "" if line else name, line):
        if "colmap" in fields:
            arguments |= _of_colmap(fields["colmap"], fields["numbers"], fields.get("size") or size)
            warn(f"{source}: the centre of its first pixel is 0.5, 0.5: 0.5 is taken off cx and cy")
        arguments = {key: each for key, each in arguments.items() if key in (*CAMERA_KEYS, "shift")}
        camera = Camera(**(arguments if model is None else {**arguments, "model": model}))
        if "moved" in fields:
            scale, shift = fields["moved"]
            camera = camera.resampled(scale, shift, camera.size)
        return resized(camera, size, source)


def resized(camera: Camera, size: Sequence[int] | None, source: str) -> Camera:
    """Return the camera for another image size, with a warning; raises ValueInvalid for another aspect ratio."""
    if size is None or camera.size == tuple(size):
        return camera
    made, known = camera.scaled(size), camera.size
    if known:
        warn(f"{source}: K is scaled from {known[0]} x {known[1]} to {size[0]} x {size[1]}")
    return made


@contextmanager
def _placed(source: str, name: str = "", line: int = 0) -> Iterator[None]:
    """Convert errors about the kind or number of values into a FormatError with the place."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        what = str(error) if isinstance(error, ValueInvalid) else f"not as a camera has it ({error})"
        raise FormatError(f"{name}: {what}" if name else what, source=source, line=line) from None


# --- which format ---


def _read(file: InputFile) -> Found:
    """Yield the name of each camera of a file, and its fields; those of a bag by topic and by frame_id."""
    is_open = "text" not in vars(file)  # False for a file whose tree has been read
    if is_open and (
        of_folder(file.path) or file.path.endswith(".db3") or file.head().startswith((b"#ROSBAG ", b"\x89MCAP"))
    ):
        from frametool.recordings.read import opened_recording

        with opened_recording(file.path, Diagnostics()) as reader:
            for channel, _, data, *_ in reader.messages([each for each in reader.channels if each.type == INFO]):
                message = vars(reader.types.read(channel, data))
                plain = {key: each.tolist() if hasattr(each, "tolist") else each for key, each in message.items()}
                fields = _by_keys({**plain, "roi": vars(message["roi"])})
                yield from ((channel.topic, fields), (message["header"].frame_id, fields))
    elif is_open and file.head().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        from frametool.documents.xml import read_xml
        from frametool.formats.trees.matrix_files import stored

        yield from _in_document(stored(read_xml(file), (), {}), file)
    elif re.search(r"(?m)^(?:P[0-3]|P_rect_0\d|K_0\d):", file.text):
        yield from _kitti(file)
    elif re.match(r"(?:\s*#.*\n)*\s*\d+\s+[A-Z_]+\s+\d+\s+\d+\s", file.text):  # cameras.txt of COLMAP
        for line, text in enumerate(file.text.splitlines(), 1):
            if text.strip() and not text.startswith("#"):
                name, model, *words = text.split()
                width, height, *numbers = map(parse_number, words)
                yield name, {"colmap": model, "numbers": numbers, "size": [width, height], "line": line}
    else:
        for document in parse_documents(made_ordinary(file).text, file.name, TAGS):
            yield from _in_document(document.value, file)


def _in_document(value: Any, file: InputFile) -> Found:
    """Yield the cameras of one document."""
    if isinstance(value, list) and any(isinstance(each, dict) and "camera_intrinsic" in each for each in value):
        from frametool.formats.trees.nuscenes import read

        for edge in read(file, _options(file)):  # calibrated_sensor.json of nuScenes, by the names of the frames
            record = value[edge.path[-1]] if edge.parent is not None else {}  # type: ignore[index]
            if record.get("camera_intrinsic"):
                yield edge.child, {"model": "pinhole", "K": numbers_of(record["camera_intrinsic"])}
    elif isinstance(value, list):
        yield from _ours(value, "")
    elif not isinstance(value, dict):
        return
    elif "fl_x" in value or ANGLE in value:
        yield "", _nerf(value)
    elif value.keys() <= {*CAMERA_KEYS}:
        yield "", camera_fields(value)
    elif "frames" in value or "camera" in value:
        yield from _ours(value, "")
    elif chain := {at: each for at, each in {"": value, **value}.items() if isinstance(each, dict) and LISTED in each}:
        for name, each in chain.items():  # a camchain, or a sensor.yaml of EuRoC: the model's own parameters come first
            lens, warp = each.get("camera_model", "pinhole"), each.get("distortion_model", "none")
            numbers = numbers_of(each[LISTED])
            d = numbers_of(each.get("distortion_coeffs") or each.get("distortion_coefficients") or [])
            own = dict(zip(CAMERA_MODELS[lens].parameters, numbers, strict=False)) if lens in CAMERA_MODELS else {}
            if warp == "fov":
                own, d = {"w": d[0]}, []
            size = {"size": numbers_of(each["resolution"])} if "resolution" in each else {}
            yield name, {"model": warp if lens == "pinhole" else lens, "K": numbers[-4:], "D": d, **own, **size}
    else:
        ends = [match[1] for key in value if (match := re.fullmatch(r"(?:K|M|camera_?[mM]atrix)_?(\d+)", key))]
        name = (value.get("header") or {}).get("frame_id") or value.get("camera_name") or ""
        yield from ((end or str(name), fields) for end in ends or [""] if (fields := _by_keys(value, end)))


def _ours(value: Any, name: str) -> Found:
    """Yield the cameras under `camera:` in a file or in a tree, nested or as a list."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value):
        if key == "camera" and isinstance(each, dict) and "K" in each:
            frame = value.get("name", value.get("child_frame_id", name))
            yield frame.removeprefix("/"), camera_fields(each)
        elif isinstance(each, (dict, list)):
            yield from _ours(each, str(key) if isinstance(value, dict) and key not in ("frames", "children") else name)


# --- CameraInfo, OpenCV ---


def _by_keys(value: dict[str, Any], end: str = "") -> dict[str, Any]:
    """Return the arguments of `Camera` from the keys of CameraInfo and OpenCV; empty without a K.

    end: number at the end of OpenCV's keys, "" for none
    """
    found: dict[str, Any] = {}
    for taken, keys in KEYS.items():
        for key, each in value.items():
            if re.fullmatch(rf"(?:{keys})_?{end}", key) and each and isinstance(each, str) == (taken == "model"):
                found.setdefault(taken, each if taken == "model" else numbers_of(each))
    for key in ("P", "R"):
        if "P" not in found or not any(found.get(key, ())):
            found.pop(key, None)
    for sides in SIZES:
        if all(side in value for side in sides):
            found["size"] = [numbers_of(value[side]) for side in sides]
    region = value.get("roi") or {}
    left, top, *inner = (int(numbers_of(region.get(key, 0))) for key in ("x_offset", "y_offset", "width", "height"))
    binning = [int(numbers_of(value.get(key) or 1)) or 1 for key in ("binning_x", "binning_y")]
    if any((left, top, *inner)) or binning != [1, 1]:
        found["moved"] = [1.0 / by for by in binning], [-left / binning[0], -top / binning[1]]
        parts = zip(inner, found.get("size", inner), binning, strict=True)
        found["size"] = [(part or side) // by for part, side, by in parts]
    return found if "K" in found else {}


# --- COLMAP, NeRF ---


def _of_colmap(name: str, numbers: Sequence[float], size: Sequence[int] | None) -> dict[str, Any]:
    """Return the arguments of `Camera` for a model's name and parameters; raises ValueInvalid."""
    if name == ANGLE:  # NeRF's, across the image
        if not size:
            raise ValueInvalid(f"{ANGLE} needs --size W,H")
        focal = size[0] / (2.0 * tan(0.5 * numbers[0]))
        return {"model": "pinhole", "K": [focal, focal, size[0] / 2.0 - 0.5, size[1] / 2.0 - 0.5], "size": size}
    if name not in COLMAP:
        raise ValueInvalid(f"{name} is not read; models: {listing(COLMAP)}")
    model, focals, count = COLMAP[name]
    if len(numbers) != focals + 2 + count:
        raise ValueInvalid(f"{name} has {focals + 2 + count} parameters, not {len(numbers)}")
    rest, own = numbers[focals + 2 :], CAMERA_MODELS[model].parameters
    fields = dict(zip(own, rest, strict=True)) if own else {"D": [*rest, *[0.0] * (4 - len(rest))] if rest else []}
    cx, cy = numbers[focals : focals + 2]
    return {"model": model, "K": [numbers[0], numbers[focals - 1], cx - 0.5, cy - 0.5], **fields}


def _nerf(value: dict[str, Any]) -> dict[str, Any]:
    """Return the only camera of transforms.json: a model of COLMAP whose parameters have names."""
    keys = rf"fl_[xy]|c[xy]|[wh]|[kp]\d|{ANGLE}"
    known = {key: parse_number(each) for key, each in value.items() if re.fullmatch(keys, key)}
    size = [known["w"], known["h"]] if {"w", "h"} <= known.keys() else None
    if "fl_x" not in known:
        return {"colmap": ANGLE, "numbers": [known[ANGLE]], "size": size}
    model = value.get("camera_model") or ("OPENCV_FISHEYE" if value.get("is_fisheye") == "true" else "OPENCV")
    words = "k1 k2 k3 k4" if "FISHEYE" in model else "k1 k2 p1 p2 k3 k4 k5 k6"
    focals, count = COLMAP.get(model, ("", 2, 0))[1:]
    usual = {"fl_y": known["fl_x"]} | ({"cx": size[0] / 2.0, "cy": size[1] / 2.0} if size else {})
    names = [*("fl_x", "fl_y")[:focals], "cx", "cy", *words.split()[:count]]
    return {"colmap": model, "numbers": [{**usual, **known}.get(each, 0.0) for each in names], "size": size}


# --- KITTI ---


def _kitti(file: InputFile) -> Found:
    """Yield the cameras of a KITTI calibration."""
    from frametool.formats.trees.kitti_calib import CAMERAS, RECTIFICATIONS, kitti_lines, kitti_name

    options = _options(file)
    numbers = {name: line.numbers for name, line in kitti_lines(file, options).items()}
    rect = "_rect" if any(name in numbers for name in RECTIFICATIONS) else ""
    for at, camera in enumerate(CAMERAS):
        raw = ("K", "K"), ("D", "D"), ("size", "S"), ("R", "R_rect"), ("P", "P_rect")
        stated = {key: each for key, line in raw if (each := numbers.get(f"{line}_0{at}"))}
        if "K" in stated:
            yield kitti_name(camera, options), {"model": "plumb_bob", **stated}
        more = {"size": each} if (each := numbers.get(f"S_rect_0{at}")) else {}
        for name, p in ((f"{camera}{rect}", numbers.get(f"P{at}")), (f"{camera}_rect", stated.get("P"))):
            fields: dict[str, Any] = {"model": "pinhole", "K": p and [p[0:3], p[4:7], p[8:11]], "P": p, **more}
            if p and "R" in stated and (t := numbers.get(f"T_0{at}")):  # the translation of P that T lacks
                turn, centre = stated["R"], Camera(**fields).rectified(from_first=True).fields["shift"]
                fields["shift"] = [c - sum(turn[3 * i + k] * t[k] for k in range(3)) for i, c in enumerate(centre)]
            if p:
                yield kitti_name(name, options), fields


def _options(file: InputFile) -> Options:
    """Return the options for reading the poses of a file."""
    return Options(Diagnostics(), Topics(()), answers=getattr(file, "answers", Answers()))
