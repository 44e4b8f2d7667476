"""OpenCV's FileStorage as documents: its YAML made ordinary, its XML as the same maps and lists, with places."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile
    from frametool.documents.xml_events import Element, XmlFile
    from frametool.grammar.readers import Path

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
