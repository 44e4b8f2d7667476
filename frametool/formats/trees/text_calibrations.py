r"""Calibrations as text: those of KITTI, and results of Kalibr.

KITTI (kitti-calib): cameras, lidar and IMU, a name and its numbers per line.

    P0: 718.856 0 607.193 0 0 718.856 185.216 0 0 0 1 0       odometry, object: projection of a rectified camera
    Tr: 12 numbers                                            odometry: cam0<-velo, cam0 rectified
    R0_rect: 9    Tr_velo_to_cam: 12    Tr_imu_to_velo: 12    object: cam0_rect<-cam0, cam0<-velo, velo<-imu
    R: 9    T: 3                                              raw: cam0<-velo of calib_velo_to_cam, velo<-imu
    R_01: 9    T_01: 3    R_rect_01: 9                        raw calib_cam_to_cam: cam1<-cam0, cam1_rect<-cam1

Metres, row-major; cameras have optical axes.  A projection K [I t] contains the position of its camera: -t.

Kalibr, results-cam-*.txt and results-imucam-*.txt: poses between cameras and IMUs.

    baseline T_1_0:
        q: [-0.00087935 -0.00270995 -0.0008824 0.99999555] +- [..]    x y z w, of the inverse rotation
        t: [-0.02997144 -0.00027389 0.00036353] +- [..]               cam0 in cam1, metres
    T_ci:  (imu0 to cam0):                                            maps points of imu0 to cam0
    Transformation T_cam0_imu0 (imu0 to cam0, T_ci):                  the same
    [[ 0.00852045 .. ]]                                               four rows of four

The q of a baseline is the inverse of the matrix T_cn_cnm1 in the same camchain: Kalibr's quaternions are
those of JPL.  The result agrees with the matrix; t is the same in both.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import BadAnswer, FormatError, Unanswered, ValueInvalid
from frametool.formats.trees.matrix_files import MATRIX, Stated, edges_of
from frametool.formats.trees.tree_reader import line_error
from frametool.geometry import quaternion, rigid
from frametool.geometry.representations import notation
from frametool.grammar.edges import Edge, Options
from frametool.grammar.pose import read_spelled
from frametool.grammar.readers import INDICES, Misfit, Reading, read_numbers
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
    if file.format == "kalibr":
        yield from _read_kalibr(file, options)
        return
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
        rect = "_rect" if any(name in self.fields for name in RECTIFICATIONS) else ""
        # the cameras of projections have the axes of the rectified first one: the centre is -K^-1 p
        for index in (1, 2, 3) if poses is POSES else ():
            if (field := self.fields.get(f"P{index}")) is None:
                continue
            fx, _, cx, px, _, fy, cy, py, _, _, _, pz = field.numbers
            for focal in (fx, fy):
                if not focal > 0.0:
                    raise line_error(self.file, field.line, 1, f"P{index}: the focal length {focal:g} is not positive")
            centre = 0.0 - (px - cx * pz) / fx, 0.0 - (py - cy * pz) / fy, 0.0 - pz
            found = True
            yield f"cam0{rect}", f"cam{index}{rect}", (*centre, *rigid.IDENTITY[3:]), field.line
        if not found:
            raise self.file.error("no pose in it: expected P0: to P3:, Tr:, R: and T:, or R_01: and T_01:")

    def _take(self, line: int, text: str) -> None:
        """Store the numbers of a line; raises FormatError with the place."""
        first, *words = re.finditer(r"\S+", text)
        name = first[0].removesuffix(":")
        if not words or not re.fullmatch(r"\w+", name):
            raise line_error(self.file, line, 1, f"expected NAME: numbers, found {text.strip()[:40]!r}")
        if name == "calib_time":  # which is no number
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
        x, y, z = self.fields[shift].numbers if shift else numbers[3::4] if len(numbers) == 12 else rigid.IDENTITY[:3]
        turn = [text for at, text in enumerate(texts) if len(texts) == 9 or at % 4 < 3]
        reading = Reading(self.file.source, normalize=self.options.normalize)
        try:
            _, rotation = read_spelled(MATRIX, turn, [()] * 9, reading)
        except ValueInvalid as error:
            raise line_error(self.file, line, 1, f"{name}: {error}") from None
        for note in reading.notes:
            self.options.tally.note_each(f"{name}: {note.message}", line, note.rule)
        return x, y, z, *rotation

    def _ends(self) -> tuple[str, str]:
        """Return parent and child of the pose of R: and T: of the raw recordings, by the file's name or contents."""
        for name, other in (("R", "T"), ("T", "R")):
            if name not in self.fields:
                raise self.file.error(f"missing {name}: together with {other}:")
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
            pose = _baseline(text, head, reading) if head["name"] else _matrix(text, head, reading)
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


def _baseline(text: str, head: re.Match[str], reading: Reading) -> Rigid:
    """Read the q and t below a baseline; raises Misfit."""
    turn, shift = (re.compile(_VECTOR.format(name)).match(text, head.end()) for name in "qt")
    if turn is None or shift is None:
        raise Misfit("expected q: [x y z w] and t: [x y z] below it")
    if len(words := turn[1].split()) != 4:
        raise Misfit(f"q: expected 4 numbers, found {len(words)}")
    x, y, z = read_numbers(shift[1].split(), ("x", "y", "z"))
    _, rotation = read_spelled(notation("xyzw"), words, INDICES, reading)
    return x, y, z, *quaternion.conjugate(*rotation)


def _matrix(text: str, head: re.Match[str], reading: Reading) -> Rigid:
    """Read the four rows below a line; raises Misfit."""
    rows = _ROWS.match(text, head.end())
    words = re.findall(r"[^\s\[\],]+", rows[1]) if rows else []
    if len(words) != 16:
        raise Misfit(f"expected a 4 x 4 matrix below it, found {f'{len(words)} numbers' if words else 'none'}")
    position, rotation = read_spelled(MATRIX, words, INDICES, reading)
    return *(position or (0.0, 0.0, 0.0)), *rotation
