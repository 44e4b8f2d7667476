"""Calibrations of KITTI, text: cameras, lidar and IMU; metres, row-major; cameras have optical axes.

A projection K [I t] contains the position of its camera: -t.

    P0: 718.856 0 607.193 0 0 718.856 185.216 0 0 0 1 0       odometry, object: projection of a rectified camera
    Tr: 12 numbers                                            odometry: cam0<-velo, cam0 rectified
    R0_rect: 9    Tr_velo_to_cam: 12    Tr_imu_to_velo: 12    object: cam0_rect<-cam0, cam0<-velo, velo<-imu
    R: 9    T: 3                                              raw: cam0<-velo of calib_velo_to_cam, velo<-imu
    R_01: 9    T_01: 3    R_rect_01: 9                        raw calib_cam_to_cam: cam1<-cam0, cam1_rect<-cam1
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import Unanswered, ValueInvalid
from frametool.formats.trees.matrix_files import MATRIX
from frametool.geometry import rigid
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import read_spelled
from frametool.grammar.readers import Reading
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.geometry import Rigid

CAMERAS = ("cam0", "cam1", "cam2", "cam3")
RECTIFICATIONS = ("R0_rect", "R_rect")
# name of a rotation or a pose of twelve numbers, name of its translation, parent, child, True for child<-parent
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
    """The numbers of one line, also as written."""

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
    """Return the name of a frame of KITTI, as set by --frames."""
    base, rest = (frame[:-5], "_rect") if frame.endswith("_rect") else (frame, "")
    known = (*CAMERAS, "velo", "imu")
    return (options.answers.names(*known)[known.index(base)] if base in known else base) + rest


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of one calibration file."""
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
    # in a projection, cameras have the axes of the rectified cam0: their centre is -K^-1 p
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
    """Return parent and child of R: and T: of the raw recordings, by --frames, or the file's name or contents."""
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
