"""Files of matrices by name (camchain, euroc-sensor, opencv): chains of cameras, sensors, FileStorage of OpenCV.

    cam0:
      T_cam_imu: [[..], [..], [..], [0.0, 0.0, 0.0, 1.0]]     Kalibr: maps points of the IMU to the camera
      T_imu_cam: ..                                           OpenVINS: its inverse, the pose of the camera in the IMU
    cam1:
      T_cn_cnm1: ..                                           from cam0 to cam1; only a check if T_cam_imu is there
    cameras: [{T_SC: [16 numbers]}, ..]                       okvis: the pose of the camera in the sensor, its IMU
    T_BS: {rows: 4, cols: 4, data: [16 numbers]}              EuRoC: the pose of the sensor in the body
    body_T_cam0: !!opencv-matrix {rows: 4, cols: 4, ..}       VINS: maps points of cam0 to body

Metres, row-major.  The parent of the cameras is the IMU: `imu`, or okvis' `body`.  The sensor of a sensor.yaml has the
name of its folder: mav0/cam0/sensor.yaml.  A pair rvec, tvec maps points of the object to the camera, as everywhere
in OpenCV, whose files are YAML, JSON or XML.

The table of keys has their meanings.  Matrices are nested lists, one long list, or OpenCV's map of rows, cols and data.
A duplicate, also inverted or along another path, is not an edge but a check.
"""

from __future__ import annotations

import os
import re
from math import degrees
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.source import TAG, InputFile
from frametool.documents.writers import flow, quoted
from frametool.documents.xml import Element, read_xml
from frametool.errors import FormatError, ValueInvalid, bare, first_of, listing, shown, warn
from frametool.formats.trees.matrix_keys import FRAME_KEYS, NO_POSE, Meaning, directed, meaning_of, partner_of
from frametool.formats.trees.tree_reader import document_edges, dotted, named, remember
from frametool.frames import topology
from frametool.frames.lookups import Frames, FrameTree
from frametool.geometry import floats, rigid
from frametool.geometry.representations import notation
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.edges import Answers, Edge, Options
from frametool.grammar.pose import AGREEMENT, read_spelled
from frametool.grammar.readers import Misfit, Path, Reading, Unclear, answerable, as_mapping, kind, read_number, within
from frametool.grammar.result import Style, rows_of, static_edges

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.geometry import Rigid

MATRIX = notation("matrix")


class Grid(NamedTuple):
    """A matrix in a document.

    rows, columns: its size; columns is 0 if rows differ in length; texts: one per number; places: the path of each
    """

    rows: int
    columns: int
    texts: list[Any]
    places: list[Path]

    @property
    def size(self) -> str:
        """Return its size as text."""
        return f"{self.rows} x {self.columns}" if self.columns else f"{self.rows} rows of different lengths"

    def holds(self, count: int) -> bool:
        """Return True if it is a row or a column of `count` numbers."""
        return 1 in (self.rows, self.columns) and len(self.texts) == count


def grid_of(value: Any) -> Grid | None:
    """Return a value as a matrix; None if it is something else.

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


TAGS = frozenset(("!!opencv-matrix", "!!opencv-nd-matrix", "!!opencv-sparse-matrix"))
_HEAD = r"\s*%(?=YAML:1\.[0-9])"
_TIGHT_KEY = r"(?m)^( *(?:- +)*[\w.-]+):(?=[^\s:/])"


def made_ordinary(file: InputFile) -> InputFile:
    """Convert a text with OpenCV's header into plain YAML: the header a comment, a blank after each colon.

    Lines are preserved, and columns too, but text after a colon without a blank moves by one.
    """
    if match := re.match(_HEAD, file.text):
        at = match.end() - 1
        file.text = f"{file.text[:at]}#" + re.sub(_TIGHT_KEY, r"\1: ", file.text[at + 1 :])
    return file


TOLERATED = 1e-3  # metres, radians: the largest difference between a pose and its stated inverse, with a warning


class Stated(NamedTuple):
    """One stated pose: target_from_source.

    child: the frame, of the two, that is the child in the tree
    chained: it relates neighbours in a chain, and is only a check if both are known otherwise
    """

    target: str
    source: str
    child: str
    components: Rigid
    path: Path
    chained: bool = False


def edges_of(statements: Iterable[Stated], reading: Reading) -> list[Edge]:
    """Return the edges of a tree; poses between frames that are already connected are checked against it.

    Raises Misfit if a pose and its inverse contradict each other; other contradictions are recorded as warnings.
    """
    tree = FrameTree()
    first: dict[frozenset[str], Stated] = {}
    for each in sorted(statements, key=lambda each: (each.chained, each.child != each.source)):
        if each.target == each.source:
            raise Misfit(topology.own_parent(each.source).message, each.path, key=True)
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


# --- files ---

DEEPEST = 100  # elements
BLOCK_NAMES = {"cameras": "cam", "imu_params": "imu", "imu_parameters": "imu"}  # of okvis
NO_POSES = {
    "camchain": "no pose in it: a camera has T_cam_imu, T_imu_cam, T_cn_cnm1 or T_SC",
    "euroc-sensor": "no pose in it: the pose of a sensor is T_BS",
    "opencv": "no pose in it; a pose is named after its two frames, as body_T_cam0",
}
_KEY = r"[A-Za-z_][\w-]*"  # names in FileStorage, without blanks
_NO_NAMES = dict.fromkeys(("me", "before", "imu", "body", "sensor"), "")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per pose; duplicates are checked."""
    frames, alone = options.answers.frames, "cam"
    if file.format == "euroc-sensor":  # named after the folder of a sensor.yaml, else after the file
        folder, name = os.path.split("" if file.path == "-" else os.path.abspath(file.path))
        stem = name.partition(".")[0]
        frames = options.answers.names("body", (os.path.basename(folder) if stem == "sensor" else stem) or "sensor")
        alone = frames[1]

    def take(value: Any, reading: Reading) -> list[Edge]:
        found = Matrices(as_mapping(value, "matrices by name"), frames, alone, options.answers, reading)
        left = f"{first_of(found.left, 3)} {'is not a pose' if len(found.left) == 1 else 'are not poses'}"
        if not found.poses:
            raise Misfit(f"{NO_POSES[file.format]}{f'; {left}' if found.left else ''}")
        edges = edges_of(found.poses, reading)
        options.tally.assumed = left if found.left else options.tally.assumed
        return edges

    if not file.head().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        yield from document_edges(made_ordinary(file), options, take, TAGS)
        return
    elements: dict[Path, Element] = {}

    def at(path: Path) -> Element:
        return next(elements[path[:end]] for end in range(len(path), -1, -1) if path[:end] in elements)

    try:
        root = read_xml(file)
        value = stored(root, (), elements)
        reading = Reading(root.file.source, normalize=options.normalize)
        reading.bare_numbers = True
        for edge in take(value if type(value) is dict else {}, reading):
            yield edge._replace(path=(), line=at(edge.path).line)
        remember(reading.notes, [at(note.path).line for note in reading.notes], options.tally)
    except Misfit as misfit:
        error = at(misfit.path).error(str(misfit), rule=misfit.rule)
        if isinstance(misfit, Unclear):
            raise answerable(error) from None
        options.report(error)
    except FormatError as error:
        options.report(error)


class MatrixBlock(NamedTuple):
    """A map of a document that may hold matrices: its name and its path."""

    name: str
    entries: dict[str, Any]
    path: Path


class Matrices:
    """The poses of one document, and the keys of its matrices that are not poses."""

    def __init__(
        self, document: dict[str, Any], frames: tuple[str, ...], alone: str, answers: Answers, reading: Reading
    ) -> None:
        """Read the whole document; raises Misfit.

        frames: those of `--frames`, the reference frame, then one per block
        alone: the frame of a matrix that is in no block
        """
        self.frames, self.answers, self.reading = frames, answers, reading
        self.base = frames[0] if frames else ""
        self.left: list[str] = []
        self.asked = 0
        blocks = [*_blocks(document, "", ())]
        cameras = [
            block
            for block in blocks  # the first camera in a chain has no pose
            if block.name[:3] not in ("", "imu")
            and (block.name[:3] == "cam" or any(key.startswith("T_") for key in block.entries))
        ]
        cameras.sort(key=lambda block: [int(number) for number in re.findall(r"[0-9]{1,9}", block.name)])
        chosen = {block.path: name for block, name in zip(cameras, frames[1:], strict=False)}
        blocks = [block._replace(name=chosen.get(block.path, block.name)) for block in blocks]
        names = {block.path: block.name for block in blocks}
        bodies = [each for each in blocks if "T_BS" in each.entries][:2]
        self.poses: list[Stated] = []
        for block in blocks:
            before, body = "", self.base or "body"
            if number := re.fullmatch(r"(.*?)([0-9]{1,9})", str(block.path[-1]) if block.path else ""):
                before = names.get((*block.path[:-1], f"{number[1]}{int(number[2]) - 1}"), "")
            sensor = next((each.name for each in bodies if each is not block), body)
            # the names for the braces in matrix_keys.KEYS
            known = {"me": block.name or alone, "before": before, "body": body, "sensor": sensor}
            known["imu"] = self.base or "imu"
            paired: set[str] = set()
            for key, value in block.entries.items():
                if key in paired:
                    continue
                path = reading.here = (*block.path, key)
                grid = within(path, grid_of, value)
                if grid is not None and (pair := partner_of(key, block.entries)):
                    paired.add(pair[0])
                    self.poses.append(self._pair(block, key, grid, *pair))
                elif (pose := self._single(block, key, grid, known)) is not None:
                    self.poses.append(pose)

    def _single(self, block: MatrixBlock, key: str, grid: Grid | None, known: dict[str, str]) -> Stated | None:
        """Return the pose under one key; None for other values."""
        value, path = block.entries[key], (*block.path, key)
        meaning = meaning_of(key, known, self.frames)
        is_stated = isinstance(meaning, Meaning) and meaning.is_stated
        whole = grid
        if grid is not None and (grid.holds(16) or (grid.holds(12) and is_stated)):  # in a row
            whole = grid._replace(rows=len(grid.texts) // 4, columns=4)
        if whole is not None and (whole.rows, whole.columns) not in ((4, 4), (3, 4)):
            whole = None
        if is_stated and whole is None and (grid is not None or type(value) is not str):
            found = grid.size if grid else kind(value)
            raise Misfit(f"{bare(key)}: expected a 4 x 4 or 3 x 4 matrix, found {found}", path)
        if whole is None or (not is_stated and re.fullmatch(NO_POSE, key.rpartition(".")[2])):
            is_matrix = grid is not None and (grid.rows > 1 or type(value) is dict)
            if is_matrix or (type(value) is dict and value.get(TAG) in TAGS):
                self.left.append(bare(dotted(path)))
            return None
        if isinstance(meaning, Unclear):
            raise meaning.below(*path)
        if not is_stated and (named_there := self._named(block, path)) is not None:
            meaning = named_there
        elif meaning is None:
            parent = self.base or ("imu" if block.name else "body")
            child = block.name or next(iter(self.frames[1 + self.asked :]), key.rpartition(".")[2])
            self.asked += 1
            meaning = directed(dotted(path), path, parent, child, self.answers)
        elif not is_stated:
            meaning = directed(dotted(path), path, meaning.target, meaning.source, self.answers)
        if "" in (meaning.target, meaning.source):
            raise Misfit(f"{bare(key)}: there is no camera before {bare(block.name)}", path, key=True)
        last = ["0", "0", "0", "1"][len(whole.texts) - 12 :]
        texts, places = [*whole.texts, *last], [*whole.places, *[()] * len(last)]
        position, rotation = within(path, read_spelled, MATRIX, texts, places, self.reading)[:2]
        return Stated(*meaning[:3], (*(position or IDENTITY[:3]), *rotation), path, chained=key == "T_cn_cnm1")

    def _named(self, block: MatrixBlock, path: Path) -> Meaning | None:
        """Return the meaning from keys next to a matrix that name its two frames; None without such keys.

        Raises Misfit if one of the two is missing, and Unclear if neither key nor option states the direction.
        """
        for target, source in FRAME_KEYS:
            if target in block.entries and source in block.entries:
                parent, child = (within(block.path, named, block.entries, key) for key in (target, source))
                what = f"{target} and {source} beside {path[-1]}"
                is_stated = source != "source_frame"
                return Meaning(parent, child, child) if is_stated else directed(what, path, parent, child, self.answers)
        for key, other in [*FRAME_KEYS, *(each[::-1] for each in FRAME_KEYS)]:
            if key in block.entries:
                raise Misfit(f"{key} without {other}, so nothing says what the matrix is between", (*block.path, key))
        return None

    def _pair(self, block: MatrixBlock, key: str, turn: Grid, translation: str, target: str, source: str) -> Stated:
        """Read a rotation and its translation, a matrix or rotation vector and three numbers.

        translation: key of the translation; target, source: as in `matrix_keys.PAIRS`
        """
        path, place = (*block.path, key), (*block.path, translation)
        shift = within(place, grid_of, block.entries[translation])
        if shift is None or not shift.holds(3):
            found = shift.size if shift else kind(block.entries[translation])
            raise Misfit(f"{translation}: expected 3 numbers, found {found}", place)
        meaning = self._named(block, path)
        if meaning is None and target == "cam1":  # of two cameras cam0 is named first
            source, target = self.answers.names(source, target)
            meaning = Meaning(target, source, target)
        elif meaning is None and target:
            target, source = self.answers.names(target, source)
            meaning = Meaning(target, source, source)
        elif meaning is None:
            parent, child = self.answers.names(self.base or "body", block.name or key)
            meaning = directed(f"{key} and {translation}", path, parent, child, self.answers)
        if not turn.holds(3) and not turn.holds(9) and (turn.rows, turn.columns) != (3, 3):
            raise Misfit(f"expected a 3 x 3 matrix or a rotation vector, found {turn.size}", path)
        representation = notation("rotvec" if turn.holds(3) else "matrix")
        rotation = within(path, read_spelled, representation, turn.texts, turn.places, self.reading)[1]
        numbers = zip(shift.places, shift.texts, strict=True)
        position = (within((*place, *at), read_number, text) for at, text in numbers)
        return Stated(*meaning[:3], (*position, *rotation), path)


def _blocks(entries: dict[str, Any], name: str, path: Path) -> Iterator[MatrixBlock]:
    """Yield a map and its nested maps; those in a list are named after the list, with their number."""
    yield MatrixBlock(name, entries, path)
    for key, value in entries.items() if len(path) < 8 else ():
        inner = BLOCK_NAMES.get(key, key)
        if type(value) is dict and not {"rows", "cols", "data"} <= value.keys():
            yield from _blocks(value, inner, (*path, key))
        for index, each in enumerate(value) if type(value) is list else ():
            if type(each) is dict:
                yield from _blocks(each, f"{inner}{index}", (*path, key, index))


def stored(outer: Element, path: Path, elements: dict[Path, Element]) -> Any:
    """Return the contents of an element of `<opencv_storage>`: a map, a list of `_`, the words of a matrix, or a text.

    elements: receives path -> element
    """
    if len(path) >= DEEPEST:
        raise outer.error(f"more than {DEEPEST} elements inside one another")
    elements[path] = outer
    found: dict[str | int, Any] = {}
    for element in outer.children:
        key = len(found) if element.tag == "_" else element.tag
        if key in found:
            raise element.error(f"key {element.tag!r} appears twice")
        found[key] = stored(element, (*path, key), elements)
    plain = outer.text.split() if outer.tag == "data" else outer.text.strip('"')
    return ([*found.values()] if 0 in found else found) or plain


def write_tree(tree: Frames, style: Style) -> str:
    """Return a camera chain, or OpenCV's YAML with one matrix per edge, named `parent_T_child`.

    Raises ValueInvalid for trees that do not fit, e.g. names that OpenCV does not accept.
    """
    if style.format == "camchain":
        return _chain(tree, style)
    text = "%YAML:1.0\n---\n"
    for parent, child, pose in static_edges(tree, style.format):
        key = f"{parent}_T_{child}"
        if not re.fullmatch(_KEY, key) or meaning_of(key, _NO_NAMES) != Meaning(parent, child, child):
            raise ValueInvalid(
                f"{style.format} cannot name the pose of {shown(child)} in {shown(parent)}: names there have letters, "
                f"digits and _, begin with a letter and do not hold _T_"
            )
        lines = ",\n       ".join(flow(row, style.number)[1:-1] for row in rows_of(pose))
        text += f"{key}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ {lines} ]\n"
    return text


def _chain(tree: Frames, style: Style) -> str:
    """Return one block per camera; raises ValueInvalid for several trees, and for moving frames.

    Cameras of an IMU get both directions: Kalibr reads T_cam_imu, OpenVINS T_imu_cam.  A tree of only cameras,
    cam0, cam1 .., gets T_cn_cnm1, the pose of each in the next.
    """
    if len(tree.roots) != 1:
        raise ValueInvalid(f"{style.format} holds one tree of cameras; the roots here: {listing(tree.roots)}")
    edges, root = static_edges(tree, style.format), tree.roots[0]
    cameras = [frame for frame in tree.frames if re.fullmatch(r"cam[0-9]+", frame)]
    if len(cameras) == len(tree.frames):
        cameras.sort(key=lambda name: int(name[3:]))
        links = zip(cameras[1:], cameras, strict=False)
        chained = (f"{frame}:\n{_matrix('T_cn_cnm1', tree, frame, before, style)}" for frame, before in links)
        return f"{cameras[0]}:\n  cam_overlaps: []\n{''.join(chained)}"
    if root != "imu":
        warn(f"{style.format} has no name for its root {shown(root)}; read it back with --frames {root}")
    if deeper := [child for parent, child, _ in edges if parent != root]:
        warn(f"{style.format} holds cameras under one IMU; as seen from {shown(root)} are written: {listing(deeper)}")
    if others := [child for _, child, _ in edges if child not in cameras]:
        warn(f"Kalibr calls cameras cam0, cam1 ..; these keep their names: {listing(others)}")
    text = ""
    for frame in tree.frames:
        if frame != root:
            both = _matrix("T_cam_imu", tree, frame, root, style) + _matrix("T_imu_cam", tree, root, frame, style)
            text += f"{quoted(frame)}:\n{both}"
    return text


def _matrix(key: str, tree: Frames, target: str, source: str, style: Style) -> str:
    rows = rows_of(tree.lookup_components(target, source))
    return f"  {key}:\n" + "".join(f"  - {flow(row, style.number)}\n" for row in rows)
