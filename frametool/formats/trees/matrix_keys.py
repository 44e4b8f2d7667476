"""What the key of a matrix says: the frame it takes points to and the one it takes them from; one table for all forms.

    T_cam_imu    Kalibr: takes points of the IMU to the camera in whose block it stands
    body_T_cam0  VINS: takes points of cam0 to body, the pose of cam0 in body

A key that no row knows is never guessed: somebody has to tell its direction.

Matrices as documents hold them: rows in rows, one long list, or OpenCV's map of rows, cols and data; row-major.

OpenCV's FileStorage as documents: its YAML made ordinary, its XML as the same maps and lists, with places.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.yaml import TAG
from frametool.errors import shown
from frametool.geometry.representations import notation
from frametool.grammar.readers import Misfit, kind, read_numbers
from frametool.grammar.rotation_spelling import read_spelled, rotation_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from frametool.documents.source import InputFile
    from frametool.documents.xml import Element, XmlFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Quaternion, Reading

# pattern of the key, target, source; <a> and <b> stand for names in it, {..} for what the file or the user names:
# {me} the block that the key stands in, {before} the camera before it, {imu} {body} what all of them are seen from
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
# these name two frames, and people write both directions so
ASKED = ("(?:T_)?<a>_to_<b>", "(?:T_)?<a>2<b>")
# two keys side by side, a rotation (3x3, or a rotation vector of three numbers) and a translation, and the frames they
# are about: together they take points of the second to the first; without frames their direction is asked for
PAIRS = (
    (r"rvec(.*)", r"tvec\1", "camera", r"object\1", ""),  # OpenCV's own: solvePnP, calibrateCamera
    (r"extrinsicRotation", "extrinsicTranslation", "imu", "cam0", ""),  # VINS-Mono: from the camera to the IMU
    (r"R", "T", "cam1", "cam0", "R1|P1|Q|E|F"),  # stereoCalibrate, which writes one of these beside them
    (r"R", "[Tt]", "", "", ""),
    (r"(?i:rotation(?:_?matrix)?)", "(?i:translation(?:_?vector)?)", "", "", ""),
)
# what is no pose, though some of it has the size of one
NO_POSE = (
    (r"P|P[0-9]|.*[Pp]rojection.*|P_rect.*", "projection"),
    (r"R|R[0-9]|.*[Rr]ectif.*|R_rect.*", "rectification"),
    (r"Q", "disparity to depth"),
    (r"E|F|.*[Ee]ssential.*|.*[Ff]undamental.*|H|.*[Hh]omography.*", "geometry of two pictures"),
    (r"K|K[0-9]|.*[Ii]ntrinsic.*|[Cc]amera_?[Mm]atrix.*|M[0-9]", "intrinsics"),
    (r"D|D[0-9]|.*[Dd]ist.*", "distortion"),
    (r".*[Cc]ov.*|.*[Nn]oise.*|.*[Ii]nformation.*", "covariance"),
)


class Meaning(NamedTuple):
    """What a matrix does: it takes points of `source` to `target`; in a tree `child` hangs under the other one.

    said: whether the key says so; else it is only how `--direction parent-from-child` would have it
    """

    target: str
    source: str
    child: str
    said: bool = True


class Ambiguous(NamedTuple):
    """The ways in which the names of two frames can be told apart in one key."""

    names: tuple[tuple[str, str], ...]


def meaning_of(key: str, known: Mapping[str, str], frames: Sequence[str] = ()) -> Meaning | Ambiguous | None:
    """Return what a key says; None if no row of the table knows it.

    key: without what stands before its last point (`IMU.T_b_c1`).
    known: names for what stands in braces; frames: names that the user told, which may be parts of the key.
    """
    bare = key.rpartition(".")[2]
    for pattern in ASKED:
        if ways := _ways(pattern, bare, frames):
            parent, child = ways[0]
            return Ambiguous(tuple(ways)) if len(ways) > 1 else Meaning(parent, child, child, said=False)
    for pattern, target, source in KEYS:
        if ways := _ways(pattern, bare, frames):
            if len(ways) > 1:
                return Ambiguous(tuple(ways))
            names = [_named(each, known, ways[0]) for each in (target, source)]
            return Meaning(names[0], names[1], known["me"] if "{me}" in (target, source) else names[1])
    return None


def _named(template: str, known: Mapping[str, str], names: tuple[str, str]) -> str:
    """Return the name of a frame in a row of the table."""
    return names[template == "<b>"] if template.startswith("<") else known[template[1:-1]]


def _ways(pattern: str, key: str, frames: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs of names that a pattern finds in a key, those that the user told if they fit."""
    if "<" not in pattern:
        return [("", "")] if key == pattern else []
    told = [(a, b) for a in frames for b in frames if re.fullmatch(_filled(pattern, re.escape(a), re.escape(b)), key)]
    if told:
        return told[:1]
    found: dict[tuple[str, str], None] = {}
    for name in (r"[A-Za-z]\w*?", r"[A-Za-z]\w*"):  # the shortest first name, then the longest
        if match := re.fullmatch(_filled(pattern, name, r"[A-Za-z]\w*"), key):
            names = {"a": "", "b": ""} | match.groupdict()
            found[names["a"], names["b"]] = None
    return list(found)


def _filled(pattern: str, a: str, b: str) -> str:
    letters = pattern.replace("<letter>", "(?P<a>[a-z])", 1).replace("<letter>", "(?P<b>[a-z])", 1)
    return letters if letters != pattern else pattern.replace("<a>", f"(?P<a>{a})").replace("<b>", f"(?P<b>{b})")


def no_pose(key: str) -> str:
    """Return what a matrix is that is no pose, by its key; "" if that does not say it."""
    bare = re.split(r"[.]", key)[-1]
    return next((what for pattern, what in NO_POSE if re.fullmatch(pattern, bare)), "")


class Pair(NamedTuple):
    """The key of the translation that belongs to a rotation, and two frames as in `PAIRS`."""

    translation: str
    target: str
    source: str


def partner_of(key: str, others: Collection[str]) -> Pair | None:
    """Return what belongs to the key of a rotation among the keys beside it; None if nothing does."""
    for rotation, translation, target, source, needed in PAIRS:
        if not (match := re.fullmatch(rotation, key)):
            continue
        wanted, child = (match.expand(each) if match.groups() else each for each in (translation, source))
        found = next((other for other in others if re.fullmatch(wanted, other)), None)
        if found is not None and (not needed or any(re.fullmatch(needed, other) for other in others)):
            return Pair(found, target, child)
    return None


MATRIX = notation("matrix")
ROTVEC = notation("rotvec")
WHOLE = ((4, 4), (3, 4))  # rows and columns of what holds a whole pose
LAST_ROW = ("0", "0", "0", "1")
_NUMBER_TYPE = r"(\d*)[ucwsifdh]"  # OpenCV's dt: how many numbers an element has, and of which type


class Grid(NamedTuple):
    """A matrix in text: rows and columns (0 where they differ in length), one text a number, and where each stands."""

    rows: int
    columns: int
    texts: list[Any]
    places: list[Path]

    @property
    def size(self) -> str:
        """Say how large it is."""
        return f"{self.rows} x {self.columns}" if self.columns else f"{self.rows} rows of different lengths"

    def holds(self, count: int) -> bool:
        """Tell whether it is a row or a column of so many numbers."""
        return 1 in (self.rows, self.columns) and len(self.texts) == count


def grid_of(value: Any) -> Grid | None:
    """Return a value as a matrix; None if it is none.

    Raises Misfit for one whose data does not have the size that it says.
    """
    if type(value) is dict:
        return _stored(value) if {"rows", "cols", "data"} <= value.keys() else None
    if type(value) is not list or not value:
        return None
    if not any(type(row) is list for row in value):
        return None if any(type(each) is dict for each in value) else _flat(1, len(value), value, ())
    rows = [row if type(row) is list else [row] for row in value]
    widths = {len(row) for row in rows}
    places: list[Path] = [(at, column) for at, row in enumerate(rows) for column in range(len(row))]
    return Grid(len(rows), widths.pop() if len(widths) == 1 else 0, [text for row in rows for text in row], places)


def _flat(rows: int, columns: int, texts: list[Any], path: Path) -> Grid:
    return Grid(rows, columns, texts, [(*path, index) for index in range(len(texts))])


def _stored(value: dict[str, Any]) -> Grid:
    """Take OpenCV's map apart."""
    rows, columns = (_whole(value, key) for key in ("rows", "cols"))
    known = re.fullmatch(_NUMBER_TYPE, str(value.get("dt", "d")))
    if known is None:
        raise Misfit(f"expected a type of numbers like d or 3f, found {kind(value['dt'])}", ("dt",))
    columns *= int(known[1] or 1)
    data = value["data"]
    if type(data) is not list or len(data) != rows * columns:
        found = f"{len(data)} numbers" if type(data) is list else kind(data)
        raise Misfit(f"expected {rows} x {columns} = {rows * columns} numbers, found {found}", ("data",))
    return _flat(rows, columns, data, ("data",))


def _whole(value: dict[str, Any], key: str) -> int:
    text = value[key]
    if type(text) is not str or not re.fullmatch(r"[0-9]{1,9}", text):
        raise Misfit(f"expected a whole number, found {shown(text) if type(text) is str else kind(text)}", (key,))
    return int(text)


def is_tagged(value: Any, tag: str) -> bool:
    """Tell whether a mapping has a tag of YAML."""
    return type(value) is dict and value.get(TAG) == tag


def whole_pose(grid: Grid | None) -> Grid | None:
    """Return a matrix that has the size of a whole pose with the four rows of it; None for any other."""
    if grid is not None and grid.holds(16):
        grid = grid._replace(rows=4, columns=4)
    if grid is None or (grid.rows, grid.columns) not in WHOLE:
        return None
    missing = 16 - len(grid.texts)
    return Grid(4, 4, [*grid.texts, *LAST_ROW[:missing]], [*grid.places, *[()] * missing])


def read_whole(grid: Grid, reading: Reading) -> Rigid:
    """Read a 4x4 matrix as x, y, z, qx, qy, qz, qw, checked by the rules of the grammar; raises Misfit."""
    position, rotation = read_spelled(MATRIX, grid.texts, grid.places, reading)
    return (*(position or (0.0, 0.0, 0.0)), *rotation)


def read_turn(grid: Grid, reading: Reading) -> Quaternion:
    """Read a 3x3 matrix, or a rotation vector of three numbers in radians; raises Misfit."""
    if grid.holds(3):
        return rotation_of(ROTVEC, grid.texts, grid.places, reading)
    if (grid.rows, grid.columns) != (3, 3) and not grid.holds(9):
        raise Misfit(f"expected a 3 x 3 matrix or a rotation vector, found {grid.size}")
    return rotation_of(MATRIX, grid.texts, grid.places, reading)


def read_shift(grid: Grid) -> tuple[float, float, float]:
    """Read a vector of three numbers; raises Misfit."""
    if not grid.holds(3):
        raise Misfit(f"expected 3 numbers, found {grid.size}")
    try:
        x, y, z = read_numbers(grid.texts, ("x", "y", "z"))
    except Misfit as misfit:
        raise Misfit(str(misfit), grid.places[int(misfit.path[0])]) from None
    return x, y, z


HEAD = "%YAML:1.0"
TAGS = frozenset(("!!opencv-matrix", "!!opencv-nd-matrix", "!!opencv-sparse-matrix"))
DEEPEST = 100  # elements
_HEAD = r"\s*%(?=YAML:1\.[0-9])"
_TIGHT_KEY = r"(?m)^( *(?:- +)*[\w.-]+):(?=[^\s:/])"


def made_ordinary(file: InputFile) -> InputFile:
    """Make a text with OpenCV's head one that YAML reads: the head a comment, a blank behind each colon.

    Places in the text stay where they are, but one to the right behind a colon without a blank.
    """
    if match := re.match(_HEAD, file.text):
        at = match.end() - 1
        file.text = f"{file.text[:at]}#" + re.sub(_TIGHT_KEY, r"\1: ", file.text[at + 1 :])
    return file


class StoredXml:
    """A `<opencv_storage>` as one document: its value, and the element in which each path of it begins."""

    def __init__(self, xml: XmlFile) -> None:
        """Read all of it; raises FormatError."""
        self.xml = xml
        self.value: dict[str, Any] = {}
        self._elements: dict[Path, Element] = {}
        elements = iter(xml.elements())
        root = next(elements)
        self._elements[()] = root
        inside = self._inside(elements, ())
        self.value = inside if type(inside) is dict else {}

    def element(self, path: Path) -> Element:
        """Return the element of a path, or the nearest around it."""
        return next(self._elements[path[:end]] for end in range(len(path), -1, -1) if path[:end] in self._elements)

    def _inside(self, elements: Iterator[Element], path: Path) -> Any:
        """Return what stands in an element up to its end: a map, a list of `_`, the words of a matrix, or a text."""
        found: dict[str, Any] = {}
        items: list[Any] = []
        for element in elements:
            if element.ends:
                if items:
                    return items
                text = element.text.strip()
                return found or (text.split() if element.tag == "data" else text.strip('"'))
            here = (*path, len(items) if element.tag == "_" else element.tag)
            self._elements[here] = element
            if element.depth > DEEPEST:
                raise self.xml.error(element, f"more than {DEEPEST} elements inside one another")
            if element.tag in found:
                raise self.xml.error(element, f"key {element.tag!r} stands twice")
            value = self._inside(elements, here)
            if element.tag == "_":
                items.append(value)
            else:
                found[element.tag] = value
        return found
