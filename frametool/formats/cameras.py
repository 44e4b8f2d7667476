"""Intrinsics of cameras from the files that people keep them in: which cameras a file holds, and each one by its name.

    camera: {model: plumb_bob, K: [fx, fy, cx, cy], D: [..], size: [w, h]}      ours: a file, in a tree, or inline
    camera_matrix: {data: [9]}, distortion_coefficients: {data: [..]}           camera_info of ROS, OpenCV
    k: [9], d: [..], p: [12], distortion_model: plumb_bob, width: 640           a message CameraInfo
    cam0: {camera_model: pinhole, intrinsics: [4], distortion_coeffs: [..]}     Kalibr
    1 OPENCV 1600 1200 fx fy cx cy k1 k2 p1 p2                                  COLMAP's cameras.txt
    fl_x: .., cx: .., k1: .., camera_model: OPENCV  or  camera_angle_x: ..      NeRF
    P2: 12 numbers  or  K_02:, D_02:, S_02:, P_rect_02:                         KITTI
    [{sensor_token: .., camera_intrinsic: [9]}, ..]                             nuScenes

Pixels count from the centre of the first one, in COLMAP and NeRF from its corner.  Each reader makes the arguments of
`Camera`, by name; a camera is made when it is asked for, so that one that is not read is in nobody's way.
"""

from __future__ import annotations

import os
import re
from contextlib import closing
from functools import partial
from math import tan
from typing import TYPE_CHECKING, Any

from frametool.documents.document import parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, alternatives, listing, shown, warn
from frametool.formats.detect import of_folder
from frametool.formats.trees.matrices import TAGS, made_ordinary
from frametool.geometry.camera import CAMERA_MODELS, Camera
from frametool.grammar.edges import Answers, Options, Tally, Topics
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.formats.load import FrameFile
    from frametool.frames.lookups import Frames

    Found = Iterator[tuple[str, dict[str, Any]]]

INFO = "sensor_msgs/msg/CameraInfo"
OURS = ("model", "K", "D", "size", "skew", "xi", "alpha", "beta", "w", "axes", "R", "P")
# argument -> keys that files have for it; OpenCV's may end in a number
KEYS = {
    "K": ("K", "k", "camera_matrix", "cameraMatrix", "M", "camera_intrinsic"),
    "D": ("D", "d", "distortion_coefficients", "distCoeffs", "dist_coeffs", "distortion_coeffs", "dist"),
    "R": ("R", "r", "rectification_matrix"),
    "P": ("P", "p", "projection_matrix"),
    "model": ("distortion_model", "model"),
}
SIZES = ("width", "height"), ("image_width", "image_height")
_NUMBERED = rf"(?:{'|'.join(KEYS['K'])})_?(\d+)"
# of COLMAP and NeRF: model, how many focal lengths, how many numbers behind the centre
COLMAP = {
    "SIMPLE_PINHOLE": ("pinhole", 1, 0),
    "PINHOLE": ("pinhole", 2, 0),
    "SIMPLE_RADIAL": ("plumb_bob", 1, 1),
    "RADIAL": ("plumb_bob", 1, 2),
    "OPENCV": ("plumb_bob", 2, 4),
    "FULL_OPENCV": ("rational_polynomial", 2, 8),
    "SIMPLE_FISHEYE": ("equidistant", 1, 0),
    "FISHEYE": ("equidistant", 2, 0),
    "SIMPLE_RADIAL_FISHEYE": ("equidistant", 1, 1),
    "RADIAL_FISHEYE": ("equidistant", 1, 2),
    "OPENCV_FISHEYE": ("equidistant", 2, 4),
    "FOV": ("fov", 2, 1),
    "EUCM": ("eucm", 2, 2),
}
LEFT = ("line", "corner", "roi", "colmap", "numbers")  # of what readers make, what Camera does not take
_NERF = r"fl_[xy]|c[xy]|[wh]|[kp]\d|camera_angle_x"
_KITTI = r"(?m)^(?:P[0-3]|P_rect_0\d|K_0\d):"
_COLMAP_LINE = r"\s*\d+\s+[A-Z_]+\s+\d+\s+\d+\s"
CORNER = "the centre of its first pixel is 0.5, 0.5: 0.5 is taken off cx and cy"


def load_camera(
    path: str | os.PathLike[str],
    name: str | None = None,
    *,
    model: str | None = None,
    size: Sequence[int] | None = None,
) -> Camera:
    """Read a camera from a file: `load_camera("chain.yaml", "cam0")`; a text that begins with `{` is one itself.

    name: which, where there are several; `FILE:NAME` says it too
    model: instead of the model that the file says; size: of the picture, where that is another or not said
    Raises FormatError, and FileProblem.
    """
    text = str(path)
    is_inline = text.lstrip().startswith("{")
    if name is None and not is_inline and not os.path.exists(text) and ":" in text:
        text, _, name = text.rpartition(":")
    with closing(_Text(text) if is_inline else InputFile(text, folder=of_folder(text) is not None)) as file:
        return _chosen(file.name, cameras_of(file), name, model=model, size=size)


def _fields(make: Any) -> Any:
    """Return what a camera is made of."""
    return make.args[-1]


class _Text(InputFile):
    """A text on the command line."""

    def __init__(self, text: str) -> None:
        self.path = self.name = "--camera"
        self.text = text

    def close(self) -> None:
        """Do nothing."""


def _chosen(source: str, known: dict[str, Callable[..., Camera]], name: str | None, **options: Any) -> Camera:
    """Return one of a file's cameras; raises FormatError for no such name, and for several without a name."""
    if not known:
        raise FormatError("no camera in it: neither K nor what else `frametool help cameras` lists", source=source)
    if name is not None and name not in known and (number := re.fullmatch(r"P?0?(\d)", name)):
        name = next((each for each in (f"cam{number[1]}", f"cam{number[1]}_rect") if each in known), name)
    first = next(iter(known))
    if name is None and all(_fields(each) == _fields(known[first]) for each in known.values()):
        name = first
    if name is None:
        raise FormatError(f"several cameras; {source}:NAME chooses one; cameras: {listing(known)}", source=source)
    if name not in known:
        raise FormatError(f"no camera {shown(name)}{alternatives(name, known, 'cameras')}", source=source)
    return known[name](**options)


def cameras_of(file: InputFile) -> dict[str, Callable[..., Camera]]:
    """Return what makes each camera of a file, by its name; "" where it has none.

    Raises FormatError for a text that is broken.
    """
    found: dict[str, dict[str, Any]] = {}
    changed: dict[str, None] = {}
    try:
        for name, fields in _read(file):
            if found.setdefault(name, fields) != fields:
                changed[name] = None
    except FormatError:
        raise
    except ValueInvalid as error:
        raise FormatError(str(error), source=file.name) from None
    if changed:
        warn(f"{file.name}: {listing(changed)}: other numbers come later; the first ones hold")
    return {name: partial(_made, file.name, name, fields) for name, fields in found.items()}


def cameras_of_tree(tree: Frames, files: Sequence[FrameFile]) -> dict[str, Callable[..., Camera]]:
    """Return what makes the cameras that files of a tree hold, by the frames that they are."""
    from frametool.formats.load import FrameFile

    found: dict[str, Callable[..., Camera]] = {}
    for file in files:
        again = file if file.path == "-" else FrameFile(file.path, form=file.form, answers=file.answers)
        again.beside = file.beside
        with closing(again):
            made = cameras_of(again)
        for name, make in made.items():
            own = rf"cam(?:era)?_?{name}" if name.isdigit() else r"cam.*"
            like = [each for each in tree.frames if each in file.tally.axes or re.fullmatch(own, each)]
            frame = name if name in tree.frames or len(like) > 1 or not (name.isdigit() or not name) else like[:1]
            found |= dict.fromkeys([frame] if isinstance(frame, str) else frame, make)
    return found


def _made(
    source: str, name: str, fields: dict[str, Any], *, model: str | None = None, size: Sequence[int] | None = None
) -> Camera:
    """Make a camera of what a file says; raises FormatError."""
    line = fields.get("line", 0)
    try:
        if "angle" in fields:
            fields = _of_angle(fields, size)
        if "colmap" in fields:
            fields |= _of_colmap(fields["colmap"], fields["numbers"])
        given = {key: value for key, value in fields.items() if key not in LEFT}
        if model is not None:
            given["model"] = model
        camera = Camera(**{"model": None, **given})
        if fields.get("corner"):
            fx, fy, cx, cy, _ = camera.numbers
            camera = camera.changed(K=[fx, fy, cx - 0.5, cy - 0.5])
            warn(f"{source}: {CORNER}")
        if "roi" in fields:
            camera = _cut_out(camera, *fields["roi"])
        if size is not None:
            if camera.size not in (None, tuple(size)):
                warn(f"{source}: K is scaled from {camera.size[0]} x {camera.size[1]} to {size[0]} x {size[1]}")
            camera = camera.scaled(size)
    except ValueInvalid as error:
        what = f"{name}: {error}" if name and not line else str(error)
        raise FormatError(what, source=source, line=line) from None
    return camera


def _of_angle(fields: dict[str, Any], size: Sequence[int] | None) -> dict[str, Any]:
    """Return the fields of a camera of which only its angle across the picture is known."""
    size = fields.get("size") or size
    if not size:
        raise ValueInvalid("camera_angle_x needs --size W,H")
    width, height = size
    focal = width / (2.0 * tan(0.5 * fields["angle"]))
    return {"model": "pinhole", "K": [focal, focal, width / 2.0, height / 2.0], "size": size, "corner": True}


def _cut_out(camera: Camera, left: int, top: int, width: int, height: int, across: int, down: int) -> Camera:
    """Return the camera of a region of the picture, of which so many pixels are one."""
    whole = camera.size or (0, 0)
    size = [(width or whole[0]) // across, (height or whole[1]) // down]
    return camera.resampled((1.0 / across, 1.0 / down), (-left / across, -top / down), size if all(size) else None)


# ---------------------------------------------------------------- which form


def _read(file: InputFile) -> Found:
    """Yield the name of each camera of a file, and what it is made of."""
    is_read = "text" in vars(file)  # of a tree, or inline
    if not is_read and _is_bag(file):
        yield from _in_bag(file)
        return
    if not is_read and file.head().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        from frametool.documents.xml import XmlFile
        from frametool.formats.trees.opencv import StoredXml

        yield from _in_document(StoredXml(XmlFile(file)).value, file)
        return
    if re.search(_KITTI, file.text):
        yield from _kitti(file)
        return
    first = next((line for line in file.text.splitlines() if line.strip() and not line.startswith("#")), "")
    if re.match(_COLMAP_LINE, first):
        yield from _colmap(file)
        return
    made_ordinary(file)
    for document in parse_documents(file.text, file.name, TAGS):
        yield from _in_document(document.value, file)


def _is_bag(file: InputFile) -> bool:
    is_folder = of_folder(file.path) is not None
    return is_folder or file.path.endswith(".db3") or file.head().startswith((b"#ROSBAG ", b"\x89MCAP"))


def _in_document(value: Any, file: InputFile) -> Found:
    """Yield the cameras of one document."""
    if isinstance(value, list):
        is_table = any(isinstance(each, dict) and "camera_intrinsic" in each for each in value)
        yield from _nuscenes(value, file) if is_table else _ours(value, "")
    elif not isinstance(value, dict):
        return
    elif "fl_x" in value or "camera_angle_x" in value:
        yield "", _nerf(value)
    elif any(isinstance(each, dict) and "intrinsics" in each for each in (value, *value.values())):
        for name, each in ({"": value} if "intrinsics" in value else value).items():
            if isinstance(each, dict) and "intrinsics" in each:
                yield name, _kalibr(each)
    elif "frames" in value or "camera" in value or value.keys() <= {*OURS}:
        yield from _ours(value, "") if value.keys() - {*OURS} else [("", _own(value))]
    else:
        for suffix in [match[1] for key in value if (match := re.fullmatch(_NUMBERED, key))] or [""]:
            if fields := _by_keys(value, suffix):
                yield suffix or _own_name(value), fields


# ---------------------------------------------------------------- ours


def _ours(value: Any, name: str) -> Found:
    """Yield what stands under `camera:` in a file or in a tree, nested or as a list."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value):
        if key == "camera" and isinstance(each, dict) and "K" in each:
            yield next((str(value[word]) for word in ("name", "child_frame_id") if word in value), name), _own(each)
        elif isinstance(each, (dict, list)):
            yield from _ours(each, str(key) if isinstance(value, dict) and key not in ("frames", "children") else name)


def _own(value: dict[str, Any]) -> dict[str, Any]:
    if unknown := [key for key in value if key not in OURS]:
        raise ValueInvalid(f"camera: unknown key {shown(unknown[0])}{alternatives(unknown[0], OURS, 'keys')}")
    return {key: each if key in ("model", "axes") else _numbers(each) for key, each in value.items()}


def _numbers(value: Any) -> Any:
    """Return the numbers of a text, of lists of such, and of matrices that say their rows."""
    if isinstance(value, dict):
        return _numbers(value.get("data", []))
    if isinstance(value, (list, tuple)):
        return [_numbers(each) for each in value]
    return parse_number(value) if isinstance(value, str) else value


# ---------------------------------------------------------------- CameraInfo, OpenCV


def _by_keys(value: dict[str, Any], suffix: str = "") -> dict[str, Any]:
    """Return what keys say that CameraInfo and OpenCV have; nothing where there is no K."""
    found: dict[str, Any] = {}
    for argument, keys in KEYS.items():
        names = [f"{key}{gap}{suffix}" for key in keys for gap in ("", "_")[: 1 + bool(suffix)]]
        key = next((key for key in names if value.get(key) not in (None, "", [])), None)
        if key is not None:
            found[argument] = str(value[key]) if argument == "model" else _numbers(value[key])
    if "K" not in found:
        return {}
    if not any(found.get("P", ())):
        found.pop("P", None)
    if "P" not in found or not any(found.get("R", ())):
        found.pop("R", None)
    for sides in SIZES:
        if all(side in value for side in sides):
            found["size"] = [_numbers(value[side]) for side in sides]
    roi = {key: int(_numbers(each)) for key, each in (value.get("roi") or {}).items() if key.endswith(("t", "h"))}
    binning = [int(_numbers(value.get(key) or 1)) or 1 for key in ("binning_x", "binning_y")]
    if any(roi.values()) or binning != [1, 1]:
        found["roi"] = *(roi.get(key, 0) for key in ("x_offset", "y_offset", "width", "height")), *binning
    return found


def _own_name(value: dict[str, Any]) -> str:
    return str((value.get("header") or {}).get("frame_id") or value.get("camera_name") or "")


def _in_bag(file: InputFile) -> Found:
    """Yield the cameras of a bag by topic and by frame_id, from the messages CameraInfo."""
    from frametool.recordings.read import opened_recording

    with opened_recording(file.path, Tally()) as reader:
        channels = [each for each in reader.channels if each.type == INFO]
        for channel, _, data, *_ in reader.messages(channels):
            message = vars(reader.types.read(channel, data))
            plain = {key: each.tolist() if hasattr(each, "tolist") else each for key, each in message.items()}
            fields = _by_keys({**plain, "roi": vars(message["roi"])})
            yield from ((channel.topic, fields), (message["header"].frame_id, fields))


# ---------------------------------------------------------------- Kalibr, COLMAP, NeRF


def _kalibr(value: dict[str, Any]) -> dict[str, Any]:
    """Return a camera of a camchain, or of a sensor.yaml of EuRoC: the model's own parameters come first."""
    lens, warp = str(value.get("camera_model", "pinhole")), str(value.get("distortion_model", "none"))
    numbers = _numbers(value["intrinsics"])
    d = _numbers(value.get("distortion_coeffs", value.get("distortion_coefficients", [])))
    size = {"size": _numbers(value["resolution"])} if "resolution" in value else {}
    row = CAMERA_MODELS.get(lens)
    own = dict(zip(row.parameters, numbers, strict=False)) if row else {}
    model = warp if lens == "pinhole" else lens
    if warp == "fov":
        own, d = {"w": d[0]}, []
    return {"model": model, "K": numbers[len(numbers) - 4 :], "D": d if warp != "none" else [], **own, **size}


def _colmap(file: InputFile) -> Found:
    """Yield the cameras of cameras.txt by their numbers."""
    for line, text in enumerate(file.text.splitlines(), 1):
        if text.strip() and not text.startswith("#"):
            name, model, *numbers = text.split()
            width, height, *parameters = map(parse_number, numbers)
            yield name, {"colmap": model, "numbers": parameters, "size": [width, height], "line": line}


def _of_colmap(name: str, numbers: Sequence[float]) -> dict[str, Any]:
    """Return a camera by a model's name and its parameters."""
    model, focals, count = _known(name)
    if len(numbers) != focals + 2 + count:
        raise ValueInvalid(f"{name} has {focals + 2 + count} parameters, not {len(numbers)}")
    fx, fy, (cx, cy), rest = numbers[0], numbers[focals - 1], numbers[focals : focals + 2], numbers[focals + 2 :]
    own = CAMERA_MODELS[model].parameters
    fields = dict(zip(own, rest, strict=True)) if own else {"D": [*rest, *[0.0] * (4 - len(rest))] if rest else []}
    return {"model": model, "K": [fx, fy, cx, cy], "corner": True, **fields}


def _known(name: str) -> tuple[str, int, int]:
    """Return the row of a model of COLMAP; raises ValueInvalid."""
    if name not in COLMAP:
        raise ValueInvalid(f"{name} is not read; models: {', '.join(COLMAP)}")
    return COLMAP[name]


def _nerf(value: dict[str, Any]) -> dict[str, Any]:
    """Return the one camera of transforms.json."""
    known = {key: parse_number(each) for key, each in value.items() if re.fullmatch(_NERF, key)}
    size = {"size": [known["w"], known["h"]]} if {"w", "h"} <= known.keys() else {}
    if "fl_x" not in known:
        return {"angle": known["camera_angle_x"], **size}
    named = value.get("camera_model") or ("OPENCV_FISHEYE" if value.get("is_fisheye") == "true" else "OPENCV")
    model, _, count = _known(named)
    keys = ("k1 k2 k3 k4" if model == "equidistant" else "k1 k2 p1 p2 k3 k4 k5 k6").split()[:count]
    focal = known["fl_x"]
    centre = [known.get(key, side / 2.0) for key, side in zip(("cx", "cy"), size.get("size", (0.0, 0.0)), strict=True)]
    d = [known.get(key, 0.0) for key in keys]
    return {"model": model, "K": [focal, known.get("fl_y", focal), *centre], "D": d, "corner": True, **size}


# ---------------------------------------------------------------- KITTI, nuScenes


def _kitti(file: InputFile) -> Found:
    """Yield the cameras of a calibration of KITTI."""
    from frametool.formats.trees.kitti_calib import CAMERAS, RECTIFICATIONS, Calibration

    read = Calibration(file, _options(file))
    numbers = {name: field.numbers for name, field in read.fields.items()}
    rect = "_rect" if any(name in numbers for name in RECTIFICATIONS) else ""
    for at, camera in enumerate(CAMERAS):
        for name, prefix in ((f"{camera}{rect}", f"P{at}"), (f"{camera}_rect", f"P_rect_0{at}")):
            if p := numbers.get(prefix):
                size = {"size": s} if (s := numbers.get(f"S_rect_0{at}")) and prefix != f"P{at}" else {}
                yield read.named(name), {"model": "pinhole", "K": [p[0:3], p[4:7], p[8:11]], "P": p, **size}
        if k := numbers.get(f"K_0{at}"):
            own = ("D", "D"), ("size", "S"), ("R", "R_rect"), ("P", "P_rect")
            said = {key: each for key, line in own if (each := numbers.get(f"{line}_0{at}"))}
            yield read.named(camera), {"model": "plumb_bob", "K": k, **said}


def _nuscenes(records: list[dict[str, Any]], file: InputFile) -> Found:
    """Yield the cameras of calibrated_sensor.json by the names that their frames have."""
    from frametool.formats.trees.nuscenes import read

    for edge in read(file, _options(file)):
        record = records[edge.path[-1]] if edge.parent is not None else {}  # type: ignore[index]
        if record.get("camera_intrinsic"):
            yield edge.child, {"model": "pinhole", "K": _numbers(record["camera_intrinsic"])}


def _options(file: InputFile) -> Options:
    """Return how the poses of a file are read."""
    return Options(Tally(), Topics(()), answers=getattr(file, "answers", Answers()))
