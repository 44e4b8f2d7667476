"""Camera chains of Kalibr, OpenVINS and okvis, sensors of EuRoC: 4x4 matrices whose keys state the frames.

    cam0:
      T_cam_imu: [[..], [..], [..], [0.0, 0.0, 0.0, 1.0]]     Kalibr: maps points of the IMU to the camera
      T_imu_cam: ..                                           OpenVINS: its inverse, the pose of the camera in the IMU
    cam1:
      T_cn_cnm1: ..                                           from cam0 to cam1; only a check if T_cam_imu is there
    cameras: [{T_SC: [16 numbers]}, ..]                       okvis: the pose of the camera in the sensor, its IMU
    T_BS: {rows: 4, cols: 4, data: [16 numbers]}              EuRoC: the pose of the sensor in the body

Metres, row-major.  The parent of the cameras is the IMU: `imu`, or okvis' `body`.  The sensor of a sensor.yaml has the
name of its folder: mav0/cam0/sensor.yaml.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

from frametool.documents.yaml_writer import flow, quoted
from frametool.errors import ValueInvalid, listing, shown, warn
from frametool.formats.trees.matrices import TAGS, FrameNames, Matrices, made_ordinary
from frametool.formats.trees.tree_reader import document_edges
from frametool.formats.trees.written_poses import Precision, rows_of, static_edges
from frametool.geometry import rigid
from frametool.grammar.readers import Reading, as_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.formats.load import FrameFile
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.result import Style

NAME = "camchain"
_CAMERA = r"cam([0-9]+)"


def read(file: FrameFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per camera, and check duplicates; of a sensor.yaml the only edge."""
    frames = options.answers.frames
    naming = FrameNames(base=frames[0] if frames else "", alone="cam", names_set=frames, blocks=frames[1:])
    expected, nothing = "blocks of cameras", "a camera has T_cam_imu, T_imu_cam, T_cn_cnm1 or T_SC"
    is_sensor = file.format == "euroc-sensor"
    if is_sensor:
        expected, nothing = "T_BS of a sensor", "the pose of a sensor is T_BS"
        names = options.answers.names("body", sensor_name(file.path))
        naming = FrameNames(base=names[0], alone=names[1], names_set=names)

    def take(value: Any, reading: Reading) -> list[Edge]:
        matrices = Matrices(as_mapping(value, expected), naming, options.answers, reading)
        return matrices.edges(options.tally, f"no pose in it: {nothing}")

    yield from document_edges(made_ordinary(file), options, take, TAGS)


def sensor_name(path: str) -> str:
    """Return the name of a sensor from its file: the folder of a sensor.yaml, else the name of the file."""
    if path == "-":
        return "sensor"
    folder, name = os.path.split(os.path.abspath(path))
    stem = name.partition(".")[0]
    return (os.path.basename(folder) if stem == "sensor" else stem) or "sensor"


def write_tree(tree: Frames, style: Style) -> str:
    """Return one block per camera; raises ValueInvalid for several trees, and for moving frames.

    Cameras of an IMU get both directions: Kalibr reads T_cam_imu, OpenVINS T_imu_cam.  A tree of only cameras,
    cam0, cam1 .., gets T_cn_cnm1.
    """
    edges = static_edges(tree, NAME)
    if len(tree.roots) != 1:
        raise ValueInvalid(f"{NAME} holds one tree of cameras; the roots here: {listing(tree.roots)}")
    precision = Precision(NAME, "matrices")
    cameras = [frame for frame in tree.frames if re.fullmatch(_CAMERA, frame)]
    if len(cameras) == len(tree.frames):
        text = _chain(tree, cameras, precision, style)
    else:
        _tell(tree.roots[0], edges)
        text = _star(tree, tree.roots[0], precision, style)
    precision.tell(style)
    return text


def _tell(root: str, edges: list[tuple[str, str, Rigid]]) -> None:
    """Warn about what a camchain does not store or Kalibr does not read."""
    if root != "imu":
        warn(f"{NAME} has no name for its root {shown(root)}; read it back with --frames {root}")
    if deeper := [child for parent, child, _ in edges if parent != root]:
        warn(f"{NAME} holds cameras under one IMU; as seen from {shown(root)} are written: {listing(deeper)}")
    if others := [child for _, child, _ in edges if not re.fullmatch(_CAMERA, child)]:
        warn(f"Kalibr calls cameras cam0, cam1 ..; these keep their names: {listing(others)}")


def _star(tree: Frames, root: str, precision: Precision, style: Style) -> str:
    """Write every frame relative to the root, in both directions."""
    text = ""
    for frame in tree.frames:
        if frame != root:
            pose = tree.lookup_components(root, frame)
            rows, back = rows_of(pose)
            precision.add(pose, back)
            text += f"{quoted(frame)}:\n{_matrix('T_cam_imu', rows_of(rigid.inverse(*pose))[0], style)}"
            text += _matrix("T_imu_cam", rows, style)
    return text


def _chain(tree: Frames, cameras: list[str], precision: Precision, style: Style) -> str:
    """Write every camera relative to the next; Kalibr's first camera has no pose."""
    text, before = "", ""
    for frame in sorted(cameras, key=lambda name: int(name[3:])):
        text += f"{frame}:\n"
        if before:
            pose = tree.lookup_components(frame, before)
            rows, back = rows_of(pose)
            precision.add(tree.lookup_components(before, frame), rigid.inverse(*back))
            text += _matrix("T_cn_cnm1", rows, style)
        else:
            text += "  cam_overlaps: []\n"
        before = frame
    return text


def _matrix(key: str, rows: list[list[float]], style: Style) -> str:
    return f"  {key}:\n" + "".join(f"  - {flow(row, style.number)}\n" for row in rows)
