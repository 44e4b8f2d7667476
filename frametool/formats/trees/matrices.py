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

from frametool.documents.yaml import TAG
from frametool.errors import bare, first_of, shown
from frametool.formats.table import DIRECTIONS
from frametool.formats.trees.tree_reader import dotted, named
from frametool.frames import topology
from frametool.frames.lookups import FrameTree
from frametool.geometry import floats, rigid
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Answers, Diagnostics, Edge
from frametool.grammar.readers import Misfit, Reading, Unclear, kind, read_numbers, within
from frametool.grammar.rotation_spelling import AGREEMENT, read_spelled, rotation_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from frametool.documents.source import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path, Quaternion

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
# matrices that are not poses, although some have the size of one
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
    """The meaning of a matrix: it maps points of `source` to `target`; in a tree `child` is below the other one.

    said: the key states it; otherwise it is the meaning with `--direction parent-from-child`
    """

    target: str
    source: str
    child: str
    said: bool = True


class Ambiguous(NamedTuple):
    """The ways to split a key into the names of two frames."""

    names: tuple[tuple[str, str], ...]


def meaning_of(key: str, known: Mapping[str, str], frames: Sequence[str] = ()) -> Meaning | Ambiguous | None:
    """Return the meaning of a key; None if it is not in the table.

    key: without the part before its last point (`IMU.T_b_c1`).
    known: names for the braces; frames: names set by the user, which may be parts of the key.
    """
    last = key.rpartition(".")[2]
    for row in (*ASKED, *KEYS):
        pattern, target, source = row
        if ways := _ways(pattern, last, frames):
            if len(ways) > 1:
                return Ambiguous(tuple(ways))
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


def no_pose(key: str) -> str:
    """Return what a matrix is that is not a pose, by its key; "" if the key does not state it."""
    last = key.rpartition(".")[2]
    return next((what for pattern, what in NO_POSE if re.fullmatch(pattern, last)), "")


class Pair(NamedTuple):
    """The key of the translation that belongs to a rotation, and two frames as in `PAIRS`."""

    translation: str
    target: str
    source: str


def partner_of(key: str, others: Collection[str]) -> Pair | None:
    """Return the translation that belongs to the key of a rotation among the other keys; None if there is none."""
    for rotation, translation, target, source, needed in PAIRS:
        if not (match := re.fullmatch(rotation, key)):
            continue
        if match.groups():  # a single key belongs to it, which is looked up directly
            wanted, child = match.expand(translation), match.expand(source)
            found = wanted if wanted in others else None
        else:
            found, child = next((other for other in others if re.fullmatch(translation, other)), None), source
        if found is not None and (not needed or any(re.fullmatch(needed, other) for other in others)):
            return Pair(found, target, child)
    return None


MATRIX = notation("matrix")
ROTVEC = notation("rotvec")
WHOLE = ((4, 4), (3, 4))  # rows and columns of a whole pose
LAST_ROW = ("0", "0", "0", "1")
_NUMBER_TYPE = r"(\d*)[ucwsifdh]"  # OpenCV's dt: the number of values per element, and their type


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
    """Parse OpenCV's map."""
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

    @property
    def parent(self) -> str:
        """Return the frame that is not the child."""
        return self.target if self.child == self.source else self.source


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
        parent, child, components = each.parent, each.child, each.components
        if child != each.source:
            components = rigid.inverse(*components)
        if tree.track(child) is not None and tree.track(parent) is None:
            parent, child, components = child, parent, rigid.inverse(*components)
        if tree.hang(parent, child, components):
            first[ends] = each
        else:
            _compare(tree.near(each.target, each.source), each, first.get(ends), reading)
    return [
        Edge(track.parent, track.child, track.components, path=first[frozenset((track.parent, track.child))].path)
        for track in tree.tracks()
    ]


def _compare(known: Rigid, each: Stated, first: Stated | None, reading: Reading) -> None:
    """Check a duplicate pose."""
    metres, radians = rigid.distance(*known, *each.components, floats)
    if metres <= AGREEMENT and radians <= AGREEMENT:
        return
    other = bare(dotted(first.path)) if first else "the others"
    message = f"differs from {other} by {metres * 1000.0:.6g} mm and {degrees(radians):.6g} degrees"
    if first and (metres > TOLERATED or radians > TOLERATED):
        raise Misfit(f"{bare(dotted(each.path))} {message}; keep one", each.path, key=True)
    reading.here = ()
    reading.note(f"{message}; {other} {'is' if first else 'are'} used", *each.path)


MOST_TOLD = 3  # matrices that are not poses
BLOCK_NAMES = {"cameras": "cam", "imu_params": "imu", "imu_parameters": "imu"}  # of okvis


class MatrixBlock(NamedTuple):
    """A map of a document that may hold matrices: its name and its path."""

    name: str
    entries: dict[str, Any]
    path: Path


class FrameNames(NamedTuple):
    """Names of frames that no key names.

    base: the reference frame; alone: the frame of a matrix at the top of the file; names_set: all names of `--frames`
    blocks: names of blocks by their position in the file, if they were set
    """

    base: str
    alone: str
    names_set: tuple[str, ...] = ()
    blocks: tuple[str, ...] = ()


def directed(what: str, path: Path, parent: str, child: str, answers: Answers) -> Meaning:
    """Return the direction set for two frames; raises Unclear if none was."""
    if not answers.direction:
        one, other = DIRECTIONS
        a, b = bare(parent), bare(child)
        ways = f"--direction {one} (takes points of {b} to {a}) or {other} (of {a} to {b})"
        raise Unclear(f"{shown(what)}: the key does not say its direction: give {ways}", path, key=True)
    ends = (parent, child) if answers.direction == DIRECTIONS[0] else (child, parent)
    return Meaning(*ends, child)


class Matrices:
    """The poses of one document, and its matrices that are not poses."""

    def __init__(self, document: dict[str, Any], naming: FrameNames, answers: Answers, reading: Reading) -> None:
        """Read the whole document; raises Misfit."""
        self.naming, self.answers, self.reading = naming, answers, reading
        self.left: list[str] = []
        self.asked = 0
        self.blocks = _renamed(_blocks(document, "", ()), naming)
        self.before = _before(self.blocks)
        self.bodies = [each for each in self.blocks if "T_BS" in each.entries][:2]
        self.poses = [pose for block in self.blocks for pose in self._of_block(block)]

    def edges(self, tally: Diagnostics, nothing: str) -> list[Edge]:
        """Return the edges of the poses, and record how many there are and what was omitted.

        Raises Misfit if they contradict each other, and with `nothing` if there are none.
        """
        if not self.poses:
            raise Misfit(nothing)
        edges = edges_of(self.poses, self.reading)
        if self.left:
            verb = "is not a pose" if len(self.left) == 1 else "are not poses"
            tally.assumed = f"{first_of(self.left, MOST_TOLD)} {verb}"
        return edges

    def _of_block(self, block: MatrixBlock) -> Iterator[Stated]:
        """Yield the poses of one map."""
        paired: set[str] = set()
        for key, value in block.entries.items():
            if key in paired:
                continue
            self.reading.here = (*block.path, key)
            grid = within(self.reading.here, grid_of, value)
            partner = partner_of(key, block.entries) if grid else None
            if grid is not None and partner is not None:
                paired.add(partner.translation)
                yield self._pair(block, key, grid, partner)
            elif (pose := self._single(block, key, value, grid)) is not None:
                yield pose

    def _single(self, block: MatrixBlock, key: str, value: Any, grid: Grid | None) -> Stated | None:
        """Return the pose under one key, if it is one."""
        path = (*block.path, key)
        meaning = meaning_of(key, self._known(block), self.naming.names_set)
        says = isinstance(meaning, Meaning) and meaning.said
        whole = whole_pose(grid, twelve=says)
        if says and whole is None and (grid is not None or type(value) is not str):
            found = grid.size if grid else kind(value)
            raise Misfit(f"{bare(key)}: expected a 4 x 4 or 3 x 4 matrix, found {found}", path)
        if whole is None or (not says and no_pose(key)):
            is_matrix = grid is not None and (grid.rows > 1 or type(value) is dict)
            if is_matrix or (type(value) is dict and value.get(TAG) in TAGS):
                what = no_pose(str(path[-1]))
                self.left.append(f"{bare(dotted(path))} ({what})" if what else bare(dotted(path)))
            return None
        if isinstance(meaning, Ambiguous):
            ways = " or ".join(f"{bare(a)},{bare(b)}" for a, b in meaning.names)
            raise Unclear(f"{bare(key)} may name its two frames in several ways; give --frames {ways}", path, key=True)
        if meaning is None or not meaning.said:
            meaning = self._named(block, path) or self._directed(block, key, path, meaning)
        if "" in (meaning.target, meaning.source):
            raise Misfit(f"{bare(key)}: there is no camera before {bare(block.name)}", path, key=True)
        position, rotation = within(path, read_spelled, MATRIX, whole.texts, whole.places, self.reading)
        return Stated(*meaning[:3], (*(position or IDENTITY[:3]), *rotation), path, chained=key == "T_cn_cnm1")

    def _known(self, block: MatrixBlock) -> dict[str, str]:
        """Return the names for the braces in the table."""
        base = self.naming.base or "imu"
        body = self.naming.base or "body"
        inertial = next((each.name for each in self.bodies if each is not block), body)
        me = block.name or self.naming.alone
        return {"me": me, "before": self.before[block.path], "imu": base, "body": body, "sensor": inertial}

    def _named(self, block: MatrixBlock, path: Path) -> Meaning | None:
        """Return the meaning from the keys next to a matrix that name its two frames; None if there are none.

        Raises Misfit if one of the two is missing, and Unclear if nothing states the direction.
        """
        for target, source in FRAME_KEYS:
            if target in block.entries and source in block.entries:
                parent, child = (within(block.path, named, block.entries, key) for key in (target, source))
                what = f"{target} and {source} beside {path[-1]}"
                is_said = source != "source_frame"
                return Meaning(parent, child, child) if is_said else directed(what, path, parent, child, self.answers)
        ways = ((key, other) for one, two in FRAME_KEYS for key, other in ((one, two), (two, one)))
        for key, other in ((key, other) for key, other in ways if key in block.entries):
            raise Misfit(f"{key} without {other}, so nothing says what the matrix is between", (*block.path, key))
        return None

    def _directed(self, block: MatrixBlock, key: str, path: Path, ends: Meaning | None) -> Meaning:
        """Return the meaning of a key without a direction, as set by options; raises Unclear if they do not."""
        if ends is not None:
            parent, child = ends.target, ends.source
        else:
            names_set = self.naming.names_set[1:]
            parent = self.naming.base or ("imu" if block.name else "body")
            child = block.name or (names_set[self.asked] if self.asked < len(names_set) else key.rpartition(".")[2])
            self.asked += 1
        return directed(dotted(path), path, parent, child, self.answers)

    def _pair(self, block: MatrixBlock, key: str, turn: Grid, pair: Pair) -> Stated:
        """Read a rotation and its translation."""
        path, place = (*block.path, key), (*block.path, pair.translation)
        shift = within(place, grid_of, block.entries[pair.translation])
        if shift is None:
            found = kind(block.entries[pair.translation])
            raise Misfit(f"{pair.translation}: expected 3 numbers, found {found}", place)
        if named_by_keys := self._named(block, path):
            meaning = named_by_keys
        elif pair.target == "cam1":  # of two cameras cam0 is named first
            source, target = self.answers.names(pair.source, pair.target)
            meaning = Meaning(target, source, target)
        elif pair.target:
            target, source = self.answers.names(pair.target, pair.source)
            meaning = Meaning(target, source, source)
        else:
            parent, child = self.answers.names(self.naming.base or "body", block.name or key)
            meaning = directed(f"{key} and {pair.translation}", path, parent, child, self.answers)
        rotation = within(path, read_turn, turn, self.reading)
        return Stated(*meaning[:3], (*within(place, read_shift, shift), *rotation), path)


def _before(blocks: Sequence[MatrixBlock]) -> dict[Path, str]:
    """Return the camera before each block by its path: cam0 of cam1; else the block before it; "" if there is none."""
    siblings: dict[Path, dict[str | int, str]] = {}
    for each in blocks:
        if each.path:
            siblings.setdefault(each.path[:-1], {})[each.path[-1]] = each.name
    found: dict[Path, str] = {(): ""}
    for around, names in siblings.items():
        earlier = ""
        for own, name in names.items():
            number = re.fullmatch(r"(.*?)([0-9]{1,9})", str(own))
            found[(*around, own)] = names.get(f"{number[1]}{int(number[2]) - 1}", "") if number else earlier
            earlier = name
    return found


def _renamed(blocks: Iterator[MatrixBlock], naming: FrameNames) -> list[MatrixBlock]:
    """Return the blocks, with the names set for cameras: cam0 has the first of them."""

    def is_camera(block: MatrixBlock) -> bool:  # the first in a chain has no pose
        return block.name.startswith("cam") or any(key.startswith("T_") for key in block.entries)

    found = list(blocks)
    cameras = [block for block in found if block.name and not block.name.startswith("imu") and is_camera(block)]
    numbered = sorted(cameras, key=lambda block: [int(number) for number in re.findall(r"[0-9]{1,9}", block.name)])
    names_set = {block.path: name for block, name in zip(numbered, naming.blocks, strict=False)}
    return [block._replace(name=names_set.get(block.path, block.name)) for block in found]


def _blocks(entries: dict[str, Any], name: str, path: Path, depth: int = 0) -> Iterator[MatrixBlock]:
    """Yield a map and its nested maps; those of a list by its name and their number."""
    yield MatrixBlock(name, entries, path)
    for key, value in entries.items():
        here = (*path, key)
        name = BLOCK_NAMES.get(key, key)
        if depth > 8:
            return
        if type(value) is dict and not {"rows", "cols", "data"} <= value.keys():
            yield from _blocks(value, name, here, depth + 1)
        elif type(value) is list:
            for index, each in enumerate(value):
                if type(each) is dict:
                    yield from _blocks(each, f"{name}{index}", (*here, index), depth + 1)
