"""Matrices whose keys state their frames, and the edges they make: shared by camchain, OpenCV and EuRoC files.

    T_cam_imu    Kalibr: maps points of the IMU to the camera of its block
    body_T_cam0  VINS: maps points of cam0 to body, the pose of cam0 in body

A table has the meanings of keys; other keys are never guessed: the user has to state their direction.  Matrices are
nested lists, one long list, or OpenCV's map of rows, cols and data; row-major.  A duplicate, also inverted or along
another path, is not an edge but a check.
"""

from __future__ import annotations

import re
from math import degrees
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import bare, shown
from frametool.formats.table import DIRECTIONS
from frametool.formats.trees.tree_reader import dotted
from frametool.frames import topology
from frametool.frames.lookups import FrameTree
from frametool.geometry import floats, rigid
from frametool.geometry.representations import notation
from frametool.grammar.edges import Answers, Edge
from frametool.grammar.pose import AGREEMENT, read_spelled
from frametool.grammar.readers import Misfit, Path, Quaternion, Reading, Unclear, kind, read_numbers

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid

# pattern of the key, target, source; <a> and <b> are names in it, {..} are named by the file or the user:
# {me} the block of the key, {before} the camera before it, {imu} {body} the common reference frame
KEYS = (
    ("T_cn_cnm1", "{me}", "{before}"),  # Kalibr: from camera n-1 to camera n
    ("T_i_b", "{me}", "{imu}"),  # Kalibr: from the body, which is its first IMU, to this one
    ("T_cam_imu", "{me}", "{imu}"),  # Kalibr
    ("T_imu_cam", "{imu}", "{me}"),  # OpenVINS
    ("T_cam_body", "{me}", "{body}"),
    ("T_body_cam", "{body}", "{me}"),
    ("T_SC", "{sensor}", "{me}"),  # okvis: S is the IMU, C the camera
    ("T_BS", "{body}", "{me}"),  # EuRoC, okvis: S is the sensor of the file or block
    ("T_cam_<b>", "{me}", "<b>"),
    ("T_<a>_cam", "<a>", "{me}"),
    ("(?:T_)?<a>_from_<b>", "<a>", "<b>"),
    ("<a>_T_<b>", "<a>", "<b>"),  # VINS-Fusion: body_T_cam0
    ("T_<a>_<b>", "<a>", "<b>"),  # ORB-SLAM3: IMU.T_b_c1, Stereo.T_c1_c2
    ("T<letter><letter>", "<a>", "<b>"),  # ORB-SLAM3: Tbc
)
# these name two frames, and both directions are in use
ASKED = (("(?:T_)?<a>_to_<b>", "<a>", "<b>"), ("(?:T_)?<a>2<b>", "<a>", "<b>"))
# two keys, a rotation (3x3, or a rotation vector of three numbers) and a translation, and their frames: together they
# map points of the second to the first; without frames, the direction must be set
PAIRS = (
    (r"rvec(.*)", r"tvec\1", "camera", r"object\1", ""),  # OpenCV's own: solvePnP, calibrateCamera
    (r"extrinsicRotation", "extrinsicTranslation", "imu", "cam0", ""),  # VINS-Mono: from the camera to the IMU
    (r"R", "T", "cam1", "cam0", "R1|P1|Q|E|F"),  # stereoCalibrate, which writes one of these too
    (r"R", "[Tt]", "", "", ""),
    (r"(?i:rotation(?:_?matrix)?)", "(?i:translation(?:_?vector)?)", "", "", ""),
)
# keys next to a matrix that name its frames, target first (OpenLORIS-Scene, tf); whether they are so must be set
FRAME_KEYS = (
    ("parent_frame", "child_frame"), ("parent_frame_id", "child_frame_id"), ("frame_id", "child_frame_id"),
    ("parent", "child"), ("target_frame", "source_frame"), ("destination_frame", "source_frame"),
)  # fmt: skip
# matrices that are not poses, although some have the size of one: projection, rectification, disparity to depth,
# geometry of two pictures, intrinsics, distortion, covariance
NO_POSE = (
    r"[PRKD][0-9]?|M[0-9]|[QEFH]|.*([Pp]rojection|[Rr]ectif|[Ee]ssential|[Ff]undamental|[Hh]omography|[Ii]ntrinsic|[Dd]ist|"
    r"[Cc]ov|[Nn]oise|[Ii]nformation).*|(P_rect|R_rect|[Cc]amera_?[Mm]atrix).*"
)


class Meaning(NamedTuple):
    """The meaning of a matrix: it maps points of `source` to `target`; in a tree `child` is below the other one.

    said: the key states it; otherwise it is the meaning with `--direction parent-from-child`
    """

    target: str
    source: str
    child: str
    said: bool = True


def meaning_of(key: str, known: Mapping[str, str], frames: Sequence[str] = ()) -> Meaning | Unclear | None:
    """Return the meaning of a key, or the error if it may name two frames in several ways; None if not in the table.

    key: without the part before its last point (`IMU.T_b_c1`).
    known: names for the braces; frames: names set by the user, which may be parts of the key.
    """
    last = key.rpartition(".")[2]
    for row in (*ASKED, *KEYS):
        pattern, target, source = row
        if ways := _ways(pattern, last, frames):
            if len(ways) > 1:
                said = " or ".join(f"{bare(a)},{bare(b)}" for a, b in ways)
                return Unclear(f"{bare(key)} may name its two frames in several ways; give --frames {said}", key=True)
            names = {"<a>": ways[0][0], "<b>": ways[0][1]} | {f"{{{name}}}": frame for name, frame in known.items()}
            child = names["{me}" if "{me}" in (target, source) else source]
            return Meaning(names[target], names[source], child, said=row not in ASKED)
    return None


def _ways(pattern: str, key: str, frames: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs of names that a pattern finds in a key, those set by the user if they fit."""
    if "<" not in pattern:
        return [("", "")] if key == pattern else []
    fits = [(a, b) for a in frames for b in frames if re.fullmatch(_filled(pattern, re.escape(a), re.escape(b)), key)]
    if fits:
        return fits[:1]
    found: dict[tuple[str, str], None] = {}
    for name in (r"[A-Za-z]\w*?", r"[A-Za-z]\w*"):  # the shortest first name, then the longest
        if match := re.fullmatch(_filled(pattern, name, r"[A-Za-z]\w*"), key):
            names = {"a": "", "b": ""} | match.groupdict()
            found[names["a"], names["b"]] = None
    return list(found)


def _filled(pattern: str, a: str, b: str) -> str:
    letters = pattern.replace("<letter>", "(?P<a>[a-z])", 1).replace("<letter>", "(?P<b>[a-z])", 1)
    return letters if letters != pattern else pattern.replace("<a>", f"(?P<a>{a})").replace("<b>", f"(?P<b>{b})")


def partner_of(key: str, others: Collection[str]) -> tuple[str, str, str] | None:
    """Return the key of the translation that belongs to that of a rotation, and two frames as in `PAIRS`."""
    for rotation, translation, target, source, needed in PAIRS:
        match = re.fullmatch(rotation, key)
        if match is None or (needed and not any(re.fullmatch(needed, other) for other in others)):
            continue
        if match.groups():  # a single key belongs to it, which is looked up directly
            wanted = match.expand(translation)
            found = wanted if wanted in others else None
        else:
            found = next((other for other in others if re.fullmatch(translation, other)), None)
        if found is not None:
            return found, target, match.expand(source)
    return None


MATRIX = notation("matrix")
ROTVEC = notation("rotvec")
WHOLE = ((4, 4), (3, 4))  # rows and columns of a whole pose
LAST_ROW = ("0", "0", "0", "1")


class Grid(NamedTuple):
    """A matrix in text: rows and columns (0 if rows differ in length), one text per number, and the path of each."""

    rows: int
    columns: int
    texts: list[Any]
    places: list[Path]

    @property
    def size(self) -> str:
        """Return its size as text."""
        return f"{self.rows} x {self.columns}" if self.columns else f"{self.rows} rows of different lengths"

    def holds(self, count: int) -> bool:
        """Return True if it is a row or a column of this many numbers."""
        return 1 in (self.rows, self.columns) and len(self.texts) == count


def grid_of(value: Any) -> Grid | None:
    """Return a value as a matrix; None if it is not one.

    Raises Misfit if its data do not have the stated size.
    """
    if type(value) is dict:  # OpenCV's map
        if not {"rows", "cols", "data"} <= value.keys():
            return None
        for key in ("rows", "cols"):
            if not re.fullmatch(r"[0-9]{1,9}", str(value[key])):
                raise Misfit(f"expected a whole number, found {kind(value[key])}", (key,))
        per_element = re.match(r"[1-9][0-9]?", str(value.get("dt")))  # as in 3f
        height, width, data = int(value["rows"]), int(value["cols"]), value["data"]
        width *= int(per_element[0]) if per_element else 1
        if type(data) is not list or len(data) != height * width:
            found = f"{len(data)} numbers" if type(data) is list else kind(data)
            raise Misfit(f"expected {height} x {width} = {height * width} numbers, found {found}", ("data",))
        return Grid(height, width, data, [("data", index) for index in range(len(data))])
    if type(value) is not list or not value:
        return None
    if not any(type(row) is list for row in value):
        is_list_of_maps = any(type(each) is dict for each in value)
        return None if is_list_of_maps else Grid(1, len(value), value, [(index,) for index in range(len(value))])
    rows = [row if type(row) is list else [row] for row in value]
    widths = {len(row) for row in rows}
    places: list[Path] = [(at, column) for at, row in enumerate(rows) for column in range(len(row))]
    return Grid(len(rows), widths.pop() if len(widths) == 1 else 0, [text for row in rows for text in row], places)


def whole_pose(grid: Grid | None, *, twelve: bool) -> Grid | None:
    """Return a matrix that has the size of a whole pose with its four rows; None for any other.

    twelve: twelve numbers in a row are a pose too
    """
    if grid is not None and grid.holds(16):
        grid = grid._replace(rows=4, columns=4)
    elif grid is not None and grid.holds(12) and twelve:
        grid = grid._replace(rows=3, columns=4)
    if grid is None or (grid.rows, grid.columns) not in WHOLE:
        return None
    missing = 16 - len(grid.texts)
    return Grid(4, 4, [*grid.texts, *LAST_ROW[:missing]], [*grid.places, *[()] * missing])


def read_turn(grid: Grid, reading: Reading) -> Quaternion:
    """Read a 3x3 matrix, or a rotation vector of three numbers in radians; raises Misfit."""
    if grid.holds(3):
        return read_spelled(ROTVEC, grid.texts, grid.places, reading)[1]
    if (grid.rows, grid.columns) != (3, 3) and not grid.holds(9):
        raise Misfit(f"expected a 3 x 3 matrix or a rotation vector, found {grid.size}")
    return read_spelled(MATRIX, grid.texts, grid.places, reading)[1]


def read_shift(grid: Grid) -> tuple[float, float, float]:
    """Read a vector of three numbers; raises Misfit."""
    if not grid.holds(3):
        raise Misfit(f"expected 3 numbers, found {grid.size}")
    try:
        x, y, z = read_numbers(grid.texts, ("x", "y", "z"))
    except Misfit as misfit:
        raise Misfit(str(misfit), grid.places[int(misfit.path[0])]) from None
    return x, y, z


TAGS = frozenset(("!!opencv-matrix", "!!opencv-nd-matrix", "!!opencv-sparse-matrix"))
_HEAD = r"\s*%(?=YAML:1\.[0-9])"
_TIGHT_KEY = r"(?m)^( *(?:- +)*[\w.-]+):(?=[^\s:/])"


def made_ordinary(file: InputFile) -> InputFile:
    """Convert a text with OpenCV's header into plain YAML: the header a comment, a blank after each colon.

    Places in the text are preserved, except one to the right after a colon without a blank.
    """
    if match := re.match(_HEAD, file.text):
        at = match.end() - 1
        file.text = f"{file.text[:at]}#" + re.sub(_TIGHT_KEY, r"\1: ", file.text[at + 1 :])
    return file


TOLERATED = 1e-3  # metres, radians: the largest difference between a pose and its stated inverse, with a warning


class Stated(NamedTuple):
    """One stated pose: target_from_source; in a tree `child` is below the other one.

    chained: it relates neighbours in a chain, and is only a check if both are known otherwise
    """

    target: str
    source: str
    child: str
    components: Rigid
    path: Path
    chained: bool = False


def edges_of(statements: Iterable[Stated], reading: Reading) -> list[Edge]:
    """Return the edges, and check duplicates against them.

    Raises Misfit if a pose and its inverse contradict each other; other contradictions are recorded as warnings.
    """
    tree = FrameTree()
    first: dict[frozenset[str], Stated] = {}
    for each in sorted(statements, key=lambda each: (each.chained, each.child != each.source)):
        if each.target == each.source:
            error = topology.own_parent(each.source)
            raise Misfit(error.message, each.path, key=True)
        ends = frozenset((each.target, each.source))
        parent, child, components = each.target, each.child, each.components
        if child != each.source:
            parent, components = each.source, rigid.inverse(*components)
        if tree.track(child) is not None and tree.track(parent) is None:
            parent, child, components = child, parent, rigid.inverse(*components)
        if tree.hang(parent, child, components):
            first[ends] = each
            continue
        metres, radians = rigid.distance(*tree.near(each.target, each.source), *each.components, floats)
        if metres <= AGREEMENT and radians <= AGREEMENT:
            continue
        same = first.get(ends)
        other = bare(dotted(same.path)) if same else "the others"
        message = f"differs from {other} by {metres * 1000.0:.6g} mm and {degrees(radians):.6g} degrees"
        if same and (metres > TOLERATED or radians > TOLERATED):
            raise Misfit(f"{bare(dotted(each.path))} {message}; keep one", each.path, key=True)
        reading.here = ()
        reading.note(f"{message}; {other} {'is' if same else 'are'} used", *each.path)
    return [
        Edge(track.parent, track.child, track.components, path=first[frozenset((track.parent, track.child))].path)
        for track in tree.tracks()
    ]


def directed(what: str, path: Path, parent: str, child: str, answers: Answers) -> Meaning:
    """Return the direction set for two frames; raises Unclear if none was."""
    if not answers.direction:
        one, other = DIRECTIONS
        a, b = bare(parent), bare(child)
        ways = f"--direction {one} (takes points of {b} to {a}) or {other} (of {a} to {b})"
        raise Unclear(f"{shown(what)}: the key does not say its direction: give {ways}", path, key=True)
    ends = (parent, child) if answers.direction == DIRECTIONS[0] else (child, parent)
    return Meaning(*ends, child)
