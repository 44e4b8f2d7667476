"""Calibrations of KITTI: cameras, lidar and IMU, a name and its numbers per line.

    P0: 718.856 0 607.193 0 0 718.856 185.216 0 0 0 1 0       odometry, object: projection of a rectified camera
    Tr: 12 numbers                                            odometry: cam0<-velo, cam0 rectified
    R0_rect: 9    Tr_velo_to_cam: 12    Tr_imu_to_velo: 12    object: cam0_rect<-cam0, cam0<-velo, velo<-imu
    R: 9    T: 3                                              raw: cam0<-velo of calib_velo_to_cam, velo<-imu
    R_01: 9    T_01: 3    R_rect_01: 9                        raw calib_cam_to_cam: cam1<-cam0, cam1_rect<-cam1

Metres, row-major; cameras have optical axes.  A projection K [I t] contains the position of its camera: -t.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, Unanswered, ValueInvalid
from frametool.formats.trees.matrices import MATRIX
from frametool.formats.trees.tree_reader import line_error
from frametool.geometry import rigid
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Edge, Options
from frametool.grammar.readers import Reading
from frametool.grammar.rotation_spelling import rotation_of
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid

CAMERAS = ("cam0", "cam1", "cam2", "cam3")
RECTIFICATIONS = ("R0_rect", "R_rect")
# name of a rotation, or of a pose of twelve numbers; that of its translation; parent, child; whether it is the inverse
POSES = (
    *((name, "", "cam0", "velo", False) for name in ("Tr", "Tr_velo_to_cam", "Tr_velo_cam")),
    *((name, "", "velo", "imu", False) for name in ("Tr_imu_to_velo", "Tr_imu_velo")),
    *((f"R_0{i}", f"T_0{i}", "cam0", f"cam{i}", True) for i in (1, 2, 3)),
    *((name, "", "cam0", "cam0_rect", True) for name in RECTIFICATIONS),
    *((f"R_rect_0{i}", "", camera, f"{camera}_rect", True) for i, camera in enumerate(CAMERAS)),
)
_NO_NUMBERS = ("calib_time",)
_COUNTS = (  # pattern of a name, number of values
    (r"P[0-3]|P_rect_0\d|Tr\w*", 12),
    (r"R|R_0\d|R0_rect|R_rect(?:_0\d)?|K_0\d", 9),
    (r"T|T_0\d", 3),
)


class Field(NamedTuple):
    """The numbers of one line."""

    line: int
    numbers: tuple[float, ...]
    texts: list[str]


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of one file of a calibration."""
    calibration = Calibration(file, options)
    for parent, child, pose, line in calibration.edges():
        names = (calibration.named(parent), calibration.named(child))
        yield Edge(*names, pose, line=line)
        cameras = {name for name, own in zip(names, (parent, child), strict=True) if own.startswith("cam")}
        options.tally.axes |= dict.fromkeys(cameras, options.answers.camera_axes or "optical")


class Calibration:
    """One file: its lines by name, and their poses."""

    def __init__(self, file: InputFile, options: Options) -> None:
        """Read the lines; raises FormatError."""
        self.file, self.options = file, options
        self.names = dict(zip((*CAMERAS, "velo", "imu"), options.answers.names(*CAMERAS, "velo", "imu"), strict=True))
        self.fields: dict[str, Field] = {}
        for number, text in enumerate(file.text.split("\n"), 1):
            if text.strip() and not text.startswith("#"):
                try:
                    self._take(number, text)
                except FormatError as error:
                    options.report(error)

    def named(self, frame: str) -> str:
        """Return the name of a frame."""
        base, rest = (frame[:-5], "_rect") if frame.endswith("_rect") else (frame, "")
        return self.names.get(base, base) + rest

    def edges(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield parent, child, pose and line; raises FormatError if there are none."""
        poses, found = POSES, False
        if "R" in self.fields or "T" in self.fields:
            poses = (("R", "T", *self._ends(), False),)
        for turn, shift, parent, child, inverse in poses:
            if turn in self.fields and (not shift or shift in self.fields):
                pose, found = self._pose(turn, shift), True
                yield parent, child, rigid.inverse(*pose) if inverse else pose, self.fields[turn].line
        for edge in self._baselines() if poses is POSES else ():
            found = True
            yield edge
        if not found:
            message = "no pose in it: expected P0: to P3:, Tr:, R: and T:, or R_01: and T_01:"
            raise FormatError(message, source=self.file.name)

    def _take(self, line: int, text: str) -> None:
        """Store the numbers of a line; raises FormatError with the place."""
        first, *words = re.finditer(r"\S+", text)
        name = first[0].removesuffix(":")
        if not words or not re.fullmatch(r"\w+", name):
            raise line_error(self.file, line, 1, f"expected NAME: numbers, found {text.strip()[:40]!r}")
        if name in _NO_NUMBERS:
            return
        if name in self.fields:
            raise line_error(self.file, line, 1, f"{name} appears twice; first in line {self.fields[name].line}")
        numbers = []
        for word in words:
            try:
                numbers.append(parse_number(word[0]))
            except ValueInvalid as error:
                raise line_error(self.file, line, word.start() + 1, f"{name}: {error}") from None
        expected = next((count for pattern, count in _COUNTS if re.fullmatch(pattern, name)), len(numbers))
        if len(numbers) != expected:
            message = f"{name}: expected {expected} numbers, found {len(numbers)}"
            raise line_error(self.file, line, words[0].start() + 1, message)
        self.fields[name] = Field(line, tuple(numbers), [word[0] for word in words])

    def _pose(self, name: str, shift: str) -> Rigid:
        """Return the pose of twelve numbers, or of a rotation and its translation, if any; warnings are recorded."""
        line, numbers, texts = self.fields[name]
        x, y, z = self.fields[shift].numbers if shift else numbers[3::4] if len(numbers) == 12 else IDENTITY[:3]
        turn = [text for at, text in enumerate(texts) if len(texts) == 9 or at % 4 < 3]
        reading = Reading(self.file.source, normalize=self.options.normalize)
        try:
            rotation = rotation_of(MATRIX, turn, [()] * 9, reading)
        except ValueInvalid as error:
            raise line_error(self.file, line, 1, f"{name}: {error}") from None
        for note in reading.notes:
            self.options.tally.note_each(f"{name}: {note.message}", line, note.rule)
        return x, y, z, *rotation

    def _ends(self) -> tuple[str, str]:
        """Return parent and child of the pose of R: and T: of the raw recordings, by the file's name or contents."""
        for name, other in (("R", "T"), ("T", "R")):
            if name not in self.fields:
                raise FormatError(f"missing {name}: together with {other}:", source=self.file.name)
        chosen = self.options.answers.frames
        base = os.path.basename(self.file.name)
        if len(chosen) == 2:
            return chosen[0], chosen[1]
        if "velo_to_cam" in base or "delta_f" in self.fields:
            rect = "R_rect_00 of calib_cam_to_cam turns it to cam0_rect"
            self.options.tally.assumed = f"cam0<-velo (--frames), cam0 as it is before rectification ({rect})"
            return "cam0", "velo"
        if "imu_to_velo" in base:
            self.options.tally.assumed = "velo<-imu (--frames)"
            return "velo", "imu"
        ways = "give --frames cam0,velo (of calib_velo_to_cam) or velo,imu"
        message = f"R: and T: do not say between which frames; {ways}"
        raise Unanswered(message, source=self.file.name, line=self.fields["R"].line)

    def _baselines(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield the cameras of projections, with the axes of the rectified first one: the centre -K^-1 p."""
        rect = "_rect" if any(name in self.fields for name in RECTIFICATIONS) else ""
        for index in (1, 2, 3):
            if (field := self.fields.get(f"P{index}")) is None:
                continue
            fx, _, cx, px, _, fy, cy, py, _, _, _, pz = field.numbers
            for focal in (fx, fy):
                if not focal > 0.0:
                    raise line_error(self.file, field.line, 1, f"P{index}: the focal length {focal:g} is not positive")
            centre = 0.0 - (px - cx * pz) / fx, 0.0 - (py - cy * pz) / fy, 0.0 - pz
            yield f"cam0{rect}", f"cam{index}{rect}", (*centre, *IDENTITY[3:]), field.line
