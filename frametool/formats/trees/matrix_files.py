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
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.xml import Element, read_xml
from frametool.documents.yaml import TAG
from frametool.documents.yaml_writer import flow, quoted
from frametool.errors import FormatError, ValueInvalid, bare, first_of, listing, shown, warn
from frametool.formats.trees import matrices
from frametool.formats.trees.matrices import Grid, Meaning, Stated, directed
from frametool.formats.trees.tree_reader import document_edges, dotted, named, remember
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.pose import read_spelled
from frametool.grammar.readers import Misfit, Path, Reading, Unclear, answerable, as_mapping, kind, within
from frametool.grammar.result import Style, rows_of, static_edges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Answers, Edge, Options

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
    """Yield one edge per pose, and check duplicates."""
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
        edges = matrices.edges_of(found.poses, reading)
        options.tally.assumed = left if found.left else options.tally.assumed
        return edges

    if file.head().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        yield from _read_xml(file, options, take)
    else:
        yield from document_edges(matrices.made_ordinary(file), options, take, matrices.TAGS)


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

        frames: those of `--frames`, the reference frame, then the blocks; alone: the frame of a matrix outside of them.
        """
        self.frames, self.alone, self.answers, self.reading = frames, alone, answers, reading
        self.base = frames[0] if frames else ""
        self.left: list[str] = []
        self.asked = 0
        blocks = [*_blocks(document, "", ())]
        cameras = [
            block
            for block in blocks  # the first in a chain has no pose
            if block.name[:3] not in ("", "imu")
            and (block.name[:3] == "cam" or any(key.startswith("T_") for key in block.entries))
        ]
        cameras.sort(key=lambda block: [int(number) for number in re.findall(r"[0-9]{1,9}", block.name)])
        chosen = {block.path: name for block, name in zip(cameras, frames[1:], strict=False)}
        blocks = [block._replace(name=chosen.get(block.path, block.name)) for block in blocks]
        self.names = {block.path: block.name for block in blocks}
        self.bodies = [each for each in blocks if "T_BS" in each.entries][:2]
        self.poses = [pose for block in blocks for pose in self._of_block(block)]

    def _of_block(self, block: MatrixBlock) -> Iterator[Stated]:
        """Yield the poses of one map."""
        paired: set[str] = set()
        for key, value in block.entries.items():
            if key in paired:
                continue
            path = self.reading.here = (*block.path, key)
            grid = within(path, matrices.grid_of, value)
            if grid is not None and (pair := matrices.partner_of(key, block.entries)):
                paired.add(pair[0])
                yield self._pair(block, key, grid, *pair)
            elif (pose := self._single(block, key, value, grid)) is not None:
                yield pose

    def _single(self, block: MatrixBlock, key: str, value: Any, grid: Grid | None) -> Stated | None:
        """Return the pose under one key, if it is one."""
        path = (*block.path, key)
        meaning = matrices.meaning_of(key, self._known(block), self.frames)
        says = isinstance(meaning, Meaning) and meaning.said
        whole = matrices.whole_pose(grid, twelve=says)
        if says and whole is None and (grid is not None or type(value) is not str):
            found = grid.size if grid else kind(value)
            raise Misfit(f"{bare(key)}: expected a 4 x 4 or 3 x 4 matrix, found {found}", path)
        if whole is None or (not says and re.fullmatch(matrices.NO_POSE, key.rpartition(".")[2])):
            is_matrix = grid is not None and (grid.rows > 1 or type(value) is dict)
            if is_matrix or (type(value) is dict and value.get(TAG) in matrices.TAGS):
                self.left.append(bare(dotted(path)))
            return None
        if isinstance(meaning, Unclear):
            raise meaning.below(*path)
        if not says and (named_there := self._named(block, path)) is not None:
            meaning = named_there
        elif meaning is None:
            parent = self.base or ("imu" if block.name else "body")
            child = block.name or next(iter(self.frames[1 + self.asked :]), key.rpartition(".")[2])
            self.asked += 1
            meaning = directed(dotted(path), path, parent, child, self.answers)
        elif not says:
            meaning = directed(dotted(path), path, meaning.target, meaning.source, self.answers)
        if "" in (meaning.target, meaning.source):
            raise Misfit(f"{bare(key)}: there is no camera before {bare(block.name)}", path, key=True)
        position, rotation = within(path, read_spelled, matrices.MATRIX, whole.texts, whole.places, self.reading)
        return Stated(*meaning[:3], (*(position or IDENTITY[:3]), *rotation), path, chained=key == "T_cn_cnm1")

    def _known(self, block: MatrixBlock) -> dict[str, str]:
        """Return the names for the braces in the table."""
        body = self.base or "body"
        before = ""
        if number := re.fullmatch(r"(.*?)([0-9]{1,9})", str(block.path[-1]) if block.path else ""):
            before = self.names.get((*block.path[:-1], f"{number[1]}{int(number[2]) - 1}"), "")
        return {
            "me": block.name or self.alone,
            "before": before,
            "imu": self.base or "imu",
            "body": body,
            "sensor": next((each.name for each in self.bodies if each is not block), body),
        }

    def _named(self, block: MatrixBlock, path: Path) -> Meaning | None:
        """Return the meaning from the keys next to a matrix that name its two frames; None if there are none.

        Raises Misfit if one of the two is missing, and Unclear if nothing states the direction.
        """
        for target, source in matrices.FRAME_KEYS:
            if target in block.entries and source in block.entries:
                parent, child = (within(block.path, named, block.entries, key) for key in (target, source))
                what = f"{target} and {source} beside {path[-1]}"
                is_said = source != "source_frame"
                return Meaning(parent, child, child) if is_said else directed(what, path, parent, child, self.answers)
        for key, other in [*matrices.FRAME_KEYS, *(each[::-1] for each in matrices.FRAME_KEYS)]:
            if key in block.entries:
                raise Misfit(f"{key} without {other}, so nothing says what the matrix is between", (*block.path, key))
        return None

    def _pair(self, block: MatrixBlock, key: str, turn: Grid, translation: str, target: str, source: str) -> Stated:
        """Read a rotation and its translation."""
        path, place = (*block.path, key), (*block.path, translation)
        shift = within(place, matrices.grid_of, block.entries[translation])
        if shift is None:
            raise Misfit(f"{translation}: expected 3 numbers, found {kind(block.entries[translation])}", place)
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
        rotation = within(path, matrices.read_turn, turn, self.reading)
        return Stated(*meaning[:3], (*within(place, matrices.read_shift, shift), *rotation), path)


def _blocks(entries: dict[str, Any], name: str, path: Path) -> Iterator[MatrixBlock]:
    """Yield a map and its nested maps; those of a list by its name and their number."""
    yield MatrixBlock(name, entries, path)
    for key, value in entries.items() if len(path) < 8 else ():
        inner = BLOCK_NAMES.get(key, key)
        if type(value) is dict and not {"rows", "cols", "data"} <= value.keys():
            yield from _blocks(value, inner, (*path, key))
        for index, each in enumerate(value) if type(value) is list else ():
            if type(each) is dict:
                yield from _blocks(each, f"{inner}{index}", (*path, key, index))


def _read_xml(file: InputFile, options: Options, take: Any) -> Iterator[Edge]:
    """Read OpenCV's XML."""
    try:
        stored = StoredXml(read_xml(file))
        reading = Reading(stored.root.source, normalize=options.normalize)
        reading.bare_numbers = True
        for edge in take(stored.value, reading):
            yield edge._replace(path=(), line=stored.element(edge.path).line)
        remember(reading.notes, [stored.element(note.path).line for note in reading.notes], options.tally)
    except Misfit as misfit:
        error = stored.element(misfit.path).error(str(misfit), rule=misfit.rule)
        if isinstance(misfit, Unclear):
            raise answerable(error) from None
        options.report(error)
    except FormatError as error:
        options.report(error)


class StoredXml:
    """The `<opencv_storage>` as one document: its value, and the element at which each path begins."""

    def __init__(self, root: Element) -> None:
        """Convert all elements; raises FormatError."""
        self.root = root
        self._elements: dict[Path, Element] = {}
        found = self._inside(root, ())
        self.value: dict[str, Any] = found if type(found) is dict else {}

    def element(self, path: Path) -> Element:
        """Return the element of a path, or the nearest enclosing one."""
        return next(self._elements[path[:end]] for end in range(len(path), -1, -1) if path[:end] in self._elements)

    def _inside(self, outer: Element, path: Path) -> Any:
        """Return the contents of an element: a map, a list of `_`, the words of a matrix, or a text."""
        if len(path) >= DEEPEST:
            raise outer.error(f"more than {DEEPEST} elements inside one another")
        self._elements[path] = outer
        found: dict[str | int, Any] = {}
        for element in outer.children:
            key = len(found) if element.tag == "_" else element.tag
            if key in found:
                raise element.error(f"key {element.tag!r} appears twice")
            found[key] = self._inside(element, (*path, key))
        plain = outer.text.split() if outer.tag == "data" else outer.text.strip('"')
        return ([*found.values()] if 0 in found else found) or plain


def write_tree(tree: Frames, style: Style) -> str:
    """Return a camera chain; or OpenCV's YAML, one matrix per edge, named `parent_T_child`.

    Raises ValueInvalid for what either cannot hold, as names that OpenCV does not accept.
    """
    if style.format == "camchain":
        return _chain(tree, style)
    text = "%YAML:1.0\n---\n"
    for parent, child, pose in static_edges(tree, style.format):
        key = f"{parent}_T_{child}"
        if not re.fullmatch(_KEY, key) or matrices.meaning_of(key, _NO_NAMES) != Meaning(parent, child, child):
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
