"""Results of Kalibr as text: results-cam-*.txt and results-imucam-*.txt; metres.

The q of a baseline is the inverse of the matrix T_cn_cnm1 in the same camchain: its quaternions are those of JPL.  The
result agrees with the matrix; t is the same.

    baseline T_1_0:
        q: [-0.00087935 -0.00270995 -0.0008824 0.99999555] +- [..]    x y z w, of the inverse rotation
        t: [-0.02997144 -0.00027389 0.00036353] +- [..]               cam0 in cam1
    T_ci:  (imu0 to cam0):                                            maps points of imu0 to cam0
    Transformation T_cam0_imu0 (imu0 to cam0, T_ci):                  the same
    [[ 0.00852045 .. ]]                                               four rows of four
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.errors import BadAnswer, ValueInvalid
from frametool.formats.trees.matrix_files import MATRIX, Stated, edges_of
from frametool.formats.trees.tree_reader import XYZ
from frametool.geometry import quaternion
from frametool.geometry.representations import notation
from frametool.grammar.pose import read_spelled
from frametool.grammar.readers import INDICES, Misfit, Reading, read_numbers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.geometry import Rigid
    from frametool.grammar.edges import Edge, Options

# a baseline by its two numbers; a matrix between two frames; a matrix below the number of its IMU
_HEAD = re.compile(
    r"(?im)^[ \t]*(?:(?P<name>baseline T_(?P<to>\d+)_(?P<of>\d+)):|(?:Transformation[ \t]+)?(?P<key>T_\w+|Baseline):?"
    r"[ \t]*\((?P<source>\w+) to (?P<target>\w+)(?:, T_\w+)?\)|(?P<imu>IMU\d+):[ \t\r]*$|(?P<own>T_i_b)[ \t\r]*$)"
)
_ROWS = re.compile(r"[^\n]*\n\s*\[\[([^\[\]]*(?:\]\s*\[[^\[\]]*)*)\]\]")
_VECTOR = r"[^\n]*\n(?:[^\n]*\n)??[ \t]*{}:\s*\[([^\[\]]*)\]"


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per camera and IMU; a second pose between the same frames is checked against the first."""
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
        if target != source:  # not the first IMU relative to itself
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
    """Read q and t below the line of a baseline, or the four rows below the line of a matrix; raises Misfit."""
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
