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
    from frametool.grammar.readers import Quaternion

CAMERAS = ("cam0", "cam1", "cam2", "cam3")
# name of a line -> parent, child of the pose of twelve numbers
POSES = {
    "Tr": ("cam0", "velo"),
    "Tr_velo_to_cam": ("cam0", "velo"),
    "Tr_velo_cam": ("cam0", "velo"),
    "Tr_imu_to_velo": ("velo", "imu"),
    "Tr_imu_velo": ("velo", "imu"),
}
RECTIFICATIONS = ("R0_rect", "R_rect")
_NO_NUMBERS = ("calib_time",)
_COUNTS = (  # pattern of a name, number of values
    (r"P[0-3]|P_rect_0\d|Tr\w*", 12),
    (r"R|R_0\d|R0_rect|R_rect(?:_0\d)?|K_0\d", 9),
    (r"T|T_0\d", 3),
)
_LINE = r"(\w+)(:?)[ \t]+(\S.*?)\s*"


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
        self.reading = Reading(file.source, normalize=options.normalize)
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
        if "R" in self.fields or "T" in self.fields:
            yield self._single()
            return
        found = [*self._whole(), *self._between(), *self._rectified(), *self._baselines()]
        if not found:
            raise FormatError(
                "no pose in it: expected P0: to P3:, Tr:, R: and T:, or R_01: and T_01:", source=self.file.name
            )
        yield from found

    def _take(self, line: int, text: str) -> None:
        """Store the numbers of a line; raises FormatError with the place."""
        match = re.fullmatch(_LINE, text)
        if match is None:
            raise line_error(self.file, line, 1, f"expected NAME: numbers, found {text.strip()[:40]!r}")
        name = match[1]
        if name in _NO_NUMBERS:
            return
        if name in self.fields:
            raise line_error(self.file, line, 1, f"{name} appears twice; first in line {self.fields[name].line}")
        words = list(re.finditer(r"\S+", match[3]))
        numbers = []
        for word in words:
            try:
                numbers.append(parse_number(word[0]))
            except ValueInvalid as error:
                raise line_error(self.file, line, match.start(3) + word.start() + 1, f"{name}: {error}") from None
        expected = next((count for pattern, count in _COUNTS if re.fullmatch(pattern, name)), len(numbers))
        if len(numbers) != expected:
            raise line_error(
                self.file, line, match.start(3) + 1, f"{name}: expected {expected} numbers, found {len(numbers)}"
            )
        self.fields[name] = Field(line, tuple(numbers), [word[0] for word in words])

    def _turn(self, name: str, texts: list[str]) -> Quaternion:
        """Check that a matrix of nine numbers is a rotation; warnings are recorded."""
        line = self.fields[name].line
        try:
            turned = rotation_of(MATRIX, texts, [()] * 9, self.reading)
        except ValueInvalid as error:
            raise line_error(self.file, line, 1, f"{name}: {error}") from None
        for note in self.reading.notes:
            self.options.tally.note_each(f"{name}: {note.message}", line, note.rule)
        self.reading.notes.clear()
        return turned

    def _single(self) -> tuple[str, str, Rigid, int]:
        """Read the pose of R: and T: of the raw recordings; the file's name, or its contents, identify the frames."""
        for name, other in (("R", "T"), ("T", "R")):
            if name not in self.fields:
                raise FormatError(f"missing {name}: together with {other}:", source=self.file.name)
        chosen = self.options.answers.frames
        base = os.path.basename(self.file.name)
        if len(chosen) == 2:
            parent, child = chosen
        elif "velo_to_cam" in base or "delta_f" in self.fields:
            parent, child = "cam0", "velo"
            rect = "R_rect_00 of calib_cam_to_cam turns it to cam0_rect"
            self.options.tally.assumed = f"cam0<-velo (--frames), cam0 as it is before rectification ({rect})"
        elif "imu_to_velo" in base:
            parent, child = "velo", "imu"
            self.options.tally.assumed = "velo<-imu (--frames)"
        else:
            message = (
                "R: and T: do not say between which frames; give --frames cam0,velo (of calib_velo_to_cam) or velo,imu"
            )
            raise Unanswered(message, source=self.file.name, line=self.fields["R"].line)
        field = self.fields["R"]
        return parent, child, (*self.fields["T"].numbers, *self._turn("R", field.texts)), field.line  # type: ignore[return-value]

    def _whole(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield the poses of twelve numbers."""
        for name, (parent, child) in POSES.items():
            if name in self.fields:
                line, (_, _, _, x, _, _, _, y, _, _, _, z), texts = self.fields[name]
                turned = self._turn(name, [*texts[0:3], *texts[4:7], *texts[8:11]])
                yield parent, child, (x, y, z, *turned), line

    def _between(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield the cameras of calib_cam_to_cam: R_01 and T_01 map points of cam0 to cam1."""
        for index, camera in enumerate(CAMERAS):
            turn, shift = self.fields.get(f"R_0{index}"), self.fields.get(f"T_0{index}")
            if turn is not None and shift is not None and index:
                x, y, z = shift.numbers
                yield "cam0", camera, rigid.inverse(x, y, z, *self._turn(f"R_0{index}", turn.texts)), turn.line

    def _rectified(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield the rectified cameras: R_rect maps points of a camera to the rectified one."""
        names = dict.fromkeys(RECTIFICATIONS, "cam0") | {f"R_rect_0{i}": name for i, name in enumerate(CAMERAS)}
        for name, camera in names.items():
            if field := self.fields.get(name):
                yield camera, f"{camera}_rect", rigid.inverse(0.0, 0.0, 0.0, *self._turn(name, field.texts)), field.line

    def _baselines(self) -> Iterator[tuple[str, str, Rigid, int]]:
        """Yield the cameras of projections, with the axes of the rectified first one: the centre -K^-1 p."""
        rect = "_rect" if any(name in self.fields for name in RECTIFICATIONS) else ""
        for index, camera in enumerate(CAMERAS):
            field = self.fields.get(f"P{index}")
            if field is None or not index:
                continue
            fx, _, cx, px, _, fy, cy, py, _, _, _, pz = field.numbers
            for focal in (fx, fy):
                if not focal > 0.0:
                    raise line_error(self.file, field.line, 1, f"P{index}: the focal length {focal:g} is not positive")
            centre = 0.0 - (px - cx * pz) / fx, 0.0 - (py - cy * pz) / fy, 0.0 - pz
            yield f"cam0{rect}", f"{camera}{rect}", (*centre, *IDENTITY[3:]), field.line
