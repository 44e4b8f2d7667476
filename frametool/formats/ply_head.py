"""The header of a PLY file: its elements in order, their properties, and how they are written.

    ply
    format binary_little_endian 1.0
    comment made by hand
    element vertex 3
    property float x
    property float y
    property float z
    element face 1
    property list uchar int vertex_indices
    end_header

Numbers are in the unit of whoever wrote them, metres for point clouds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FormatError, listing, shown

if TYPE_CHECKING:
    from typing import BinaryIO

LONGEST = 1 << 20  # bytes of a header
FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
VERTEX = "vertex"
_MOST = 1 << 62


class PlyElement(NamedTuple):
    """One element of a file.

    instances: how many there are; line: where it stands in the header
    layout: of each property its name, the type of a value, and of a list the type of what counts it, else ""
    """

    name: str
    instances: int
    layout: tuple[tuple[str, str, str], ...] = ()
    line: int = 0

    @property
    def properties(self) -> tuple[tuple[str, str], ...]:
        """Return the properties as (name, type); "" for the type of a list."""
        return tuple((name, "" if counted else code) for name, code, counted in self.layout)

    @property
    def lists(self) -> list[str]:
        """Name the properties that are lists, whose size is not known beforehand."""
        return [name for name, code in self.properties if not code]

    @property
    def size(self) -> int:
        """Return how many bytes one of them has where none of its properties is a list."""
        return sum(int(code[1:]) for _, code in self.properties if code)


class PlyHead(NamedTuple):
    """What a header says; `text` is the header byte for byte, its last line end included.

    form: a key of FORMS
    """

    text: bytes
    form: str
    elements: tuple[PlyElement, ...]

    @property
    def order(self) -> str:
        """Return the byte order as numpy writes it, "" for text."""
        return FORMS[self.form]

    def vertex(self, source: str) -> tuple[tuple[PlyElement, ...], PlyElement]:
        """Return the elements before the vertices, and these; raises FormatError where they cannot be reached."""
        at = next((at for at, each in enumerate(self.elements) if each.name == VERTEX), None)
        if at is None:
            names = listing(each.name for each in self.elements) or "none"
            raise FormatError(f"no element {VERTEX!r}; elements: {names}", source=source)
        before, vertex = self.elements[:at], self.elements[at]
        if vertex.lists:
            raise FormatError(
                f"the list {shown(vertex.lists[0])} within {VERTEX!r} is not read; write it as an element of its own, "
                "or leave it out",
                source=source,
                line=vertex.line,
            )
        for each in before:
            if self.order and each.lists and each.instances:
                raise FormatError(
                    f"element {shown(each.name)} with the list {shown(each.lists[0])} stands before {VERTEX!r}; "
                    f"write {VERTEX!r} first, or the file as ascii",
                    source=source,
                    line=each.line,
                )
        return before, vertex


def read_ply_head(stream: BinaryIO, source: str) -> PlyHead:
    """Read a header and leave the stream behind it; raises FormatError that says line, value and remedy."""
    text = stream.readline(64)
    if text.rstrip(b"\r\n") != b"ply" or not text.endswith(b"\n"):
        raise FormatError("the first line of a PLY file is `ply`, and it ends in a line feed", source=source, line=1)
    form, elements, number = "", list[PlyElement](), 1

    def fail(message: str) -> FormatError:
        return FormatError(message, source=source, line=number)

    while True:
        line = stream.readline(LONGEST)
        number += 1
        text += line
        if not line or len(text) > LONGEST:
            raise fail("the header ends before its `end_header` line; is the file whole?")
        words = line.decode("latin-1").split()
        word = words[0] if words else "comment"
        if word in ("comment", "obj_info"):
            continue
        if word == "end_header":
            break
        if word == "format":
            if form or len(words) != 3 or words[1] not in FORMS or words[2] != "1.0":
                raise fail(f"{shown(' '.join(words))}: expected one format: {', '.join(FORMS)}, and 1.0")
            form = words[1]
        elif word == "element":
            elements.append(_element(words, elements, number, fail))
        elif word == "property":
            if not elements:
                raise fail("a property before the first element")
            elements[-1] = _with_property(elements[-1], words, fail)
        else:
            known = "format, element, property, comment, obj_info, end_header"
            raise fail(f"{shown(word)} is no key of a PLY header; keys: {known}")
    if not form:
        raise fail(f"the header has no format; formats: {', '.join(FORMS)}")
    return PlyHead(text, form, tuple(elements))


if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Fail = Callable[[str], FormatError]


def _element(words: Sequence[str], before: Sequence[PlyElement], line: int, fail: Fail) -> PlyElement:
    """Read `element NAME COUNT`."""
    if len(words) != 3:
        raise fail(f"{shown(' '.join(words))}: expected element NAME COUNT")
    _, name, count = words
    if not (count.isascii() and count.isdecimal()) or len(count) > 19 or int(count) > _MOST:
        raise fail(f"{shown(count)} of element {shown(name)} is no count")
    if any(each.name == name for each in before):
        raise fail(f"element {shown(name)} stands twice")
    return PlyElement(name, int(count), line=line)


def _with_property(element: PlyElement, words: Sequence[str], fail: Fail) -> PlyElement:
    """Read `property TYPE NAME` or `property list TYPE TYPE NAME`."""
    is_list = words[1:2] == ["list"]
    types = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3):
        raise fail(f"{shown(' '.join(words))}: expected property TYPE NAME, or property list TYPE TYPE NAME")
    for each in types:
        if each not in TYPES:
            raise fail(f"{shown(each)} is no type; types: {', '.join(TYPES)}")
    name = words[-1]
    if any(name == known for known, _ in element.properties):
        raise fail(f"property {shown(name)} of {shown(element.name)} stands twice")
    codes = [TYPES[each] for each in types]
    if is_list and codes[0][0] == "f":
        raise fail(f"{shown(types[0])} counts the values of a list; it has to be an integer")
    return element._replace(layout=(*element.layout, (name, codes[-1], codes[0] if is_list else "")))
