"""OpenCV's FileStorage as YAML, JSON or XML: matrices by name; a name with two frames is a pose.

    %YAML:1.0
    ---
    body_T_cam0: !!opencv-matrix            maps points of cam0 to body: the pose of cam0 in body
       rows: 4
       cols: 4
       dt: d
       data: [ 1., 0., 0., 0.05, .. ]       row-major

A pair rvec, tvec maps points of the object to the camera, as everywhere in OpenCV.  Lengths are in metres if the
board's squares were.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.xml import Element, XmlFile
from frametool.documents.yaml_writer import flow
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.formats.trees.matrices import HEAD, TAGS, FrameNames, Matrices, Meaning, made_ordinary, meaning_of
from frametool.formats.trees.tree_reader import document_edges, remember
from frametool.formats.trees.written_poses import Precision, rows_of, static_edges, warn_lonely_roots
from frametool.grammar.readers import Misfit, Reading, Unclear, answerable, as_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style

NAME = "opencv"
_KEY = r"[A-Za-z_][\w-]*"  # names in FileStorage, without blanks
DEEPEST = 100  # elements
_NO_NAMES = dict.fromkeys(("me", "before", "imu", "body", "sensor"), "")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per pose, and check duplicates."""

    def take(value: Any, reading: Reading) -> list[Edge]:
        frames = options.answers.frames
        naming = FrameNames(base=frames[0] if frames else "", alone="cam", names_set=frames)
        matrices = Matrices(as_mapping(value, "matrices by name"), naming, options.answers, reading)
        found = f"; {', '.join(matrices.left[:3])}" if matrices.left else ""
        nothing = f"no pose in it{found}; a pose is named after its two frames, as body_T_cam0"
        return matrices.edges(options.tally, nothing)

    if file.head().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        yield from _read_xml(file, options, take)
    else:
        yield from document_edges(made_ordinary(file), options, take, TAGS)


def _read_xml(file: InputFile, options: Options, take: Any) -> Iterator[Edge]:
    """Read the XML variant."""
    xml = XmlFile(file)
    try:
        stored = StoredXml(xml)
        reading = Reading(xml.source, normalize=options.normalize)
        reading.bare_numbers = True
        for edge in take(stored.value, reading):
            yield edge._replace(path=(), line=stored.element(edge.path).line)
        remember(reading.notes, [stored.element(note.path).line for note in reading.notes], options.tally)
    except Misfit as misfit:
        error = xml.error(stored.element(misfit.path), str(misfit), rule=misfit.rule)
        if isinstance(misfit, Unclear):
            raise answerable(error) from None
        options.report(error)
    except FormatError as error:
        options.report(error)


class StoredXml:
    """The `<opencv_storage>` as one document: its value, and the element at which each path begins."""

    def __init__(self, xml: XmlFile) -> None:
        """Read the whole text; raises FormatError."""
        self.xml = xml
        self.value: dict[str, Any] = {}
        self._elements: dict[Path, Element] = {}
        elements = iter(xml.elements())
        self._elements[()] = next(elements)
        inside = self._inside(elements, ())
        self.value = inside if type(inside) is dict else {}

    def element(self, path: Path) -> Element:
        """Return the element of a path, or the nearest enclosing one."""
        return next(self._elements[path[:end]] for end in range(len(path), -1, -1) if path[:end] in self._elements)

    def _inside(self, elements: Iterator[Element], path: Path) -> Any:
        """Return the contents of an element up to its end: a map, a list of `_`, the words of a matrix, or a text."""
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
                raise self.xml.error(element, f"key {element.tag!r} appears twice")
            value = self._inside(elements, here)
            if element.tag == "_":
                items.append(value)
            else:
                found[element.tag] = value
        return found


def write_tree(tree: Frames, style: Style) -> str:
    """Return one matrix per edge, named `parent_T_child`; raises ValueInvalid for names that OpenCV does not accept."""
    precision = Precision(NAME, "matrices")
    text = f"{HEAD}\n---\n"
    for parent, child, pose in static_edges(tree, NAME):
        key = f"{parent}_T_{child}"
        if not re.fullmatch(_KEY, key) or meaning_of(key, _NO_NAMES) != Meaning(parent, child, child):
            raise ValueInvalid(
                f"{NAME} cannot name the pose of {shown(child)} in {shown(parent)}: names there have letters, digits "
                f"and _, begin with a letter and do not hold _T_"
            )
        rows, back = rows_of(pose)
        precision.add(pose, back)
        lines = ",\n       ".join(flow(row, style.number)[1:-1] for row in rows)
        text += f"{key}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ {lines} ]\n"
    warn_lonely_roots(tree, NAME)
    precision.tell(style)
    return text
