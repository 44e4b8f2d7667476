"""XML as a stream of elements with their places, or as a tree of selected elements; without entities.

It uses expat of the standard library and knows syntax only.  Names keep their prefix as written (`sensor:camera`), so
that files with undeclared prefixes can be read too.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, NamedTuple
from xml.parsers import expat

from frametool.documents.source import MOST_CHARACTERS, Source, line_of, not_text, pointer
from frametool.errors import FileProblem, FormatError, bare, shown
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping
    from typing import NoReturn

    from frametool.documents.source import InputFile

DEEPEST_ELEMENT = 100_000
_BLOCK = 1 << 16
_OTHER_ENTITY = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)[^\s;&]++;")


class Element(NamedTuple):
    """The beginning or the end of an element.

    ends: True for the end; then `text` is the text directly in the element, the rest is as at its beginning
    depth: 1 for the root
    offset: of its first character, in bytes
    """

    ends: bool
    tag: str
    attributes: dict[str, str]
    depth: int
    line: int
    column: int
    offset: int
    text: str = ""


class XmlFile:
    """The elements of one XML file, and errors that point into it."""

    def __init__(self, file: InputFile) -> None:
        """Read the bytes of a file; raises FileProblem, and FormatError if they are too many or not text."""
        self.name = file.name
        try:
            self.data = file.stream.read(MOST_CHARACTERS + 1)
        except OSError as error:
            raise FileProblem(f"{self.name}: {(error.strerror or str(error)).lower()}") from None
        if len(self.data) > MOST_CHARACTERS:
            raise FormatError(f"longer than {MOST_CHARACTERS} bytes, the most in one file", source=self.name)

    def elements(self, deepest: int = DEEPEST_ELEMENT, *, ends: bool = True) -> Iterator[Element]:
        """Yield the beginnings and ends of all elements, in order.

        deepest: omit elements below this depth; ends: without them the text of elements is omitted too.
        Raises FormatError if it is not XML, and for declarations of entities.
        """
        opened: list[Element] = []
        texts: list[list[str]] = []
        found: list[Element] = []
        parser = expat.ParserCreate()
        depth = 0

        def start(tag: str, attributes: dict[str, str]) -> None:
            nonlocal depth
            depth += 1
            if depth <= deepest:
                place = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, parser.CurrentByteIndex
                found.append(Element(False, tag, attributes, depth, *place))  # noqa: FBT003 - a field of a record
                if ends:
                    opened.append(found[-1])
                    texts.append([])
            if depth > DEEPEST_ELEMENT:
                message = f"more than {DEEPEST_ELEMENT} elements inside one another"
                raise self._at(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, message)

        def end(_: str) -> None:
            nonlocal depth
            if ends and depth <= deepest:
                found.append(Element(True, *opened.pop()[1:7], "".join(texts.pop())))  # noqa: FBT003 - a field
            depth -= 1

        def read_text(text: str) -> None:
            if depth <= deepest:
                texts[-1].append(text)

        def refuse(*_: object) -> NoReturn:
            message = "a DOCTYPE with entities is not read; expand them: xmllint --noent FILE"
            raise self._at(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, message)

        parser.StartElementHandler, parser.EndElementHandler = start, end
        if ends:
            parser.CharacterDataHandler = read_text
        parser.StartDoctypeDeclHandler = partial(self._check_doctype, parser)
        parser.EntityDeclHandler = refuse
        parser.ExternalEntityRefHandler = refuse
        for begin in range(0, len(self.data) or 1, _BLOCK):
            block = self.data[begin : begin + _BLOCK]
            try:
                parser.Parse(block, begin + _BLOCK >= len(self.data))
            except expat.ExpatError as error:
                yield from found
                raise self._broken(error) from None
            except (LookupError, ValueError) as error:  # of Python's codecs
                if isinstance(error, FormatError):
                    raise
                raise self._at(1, 1, f"not XML: {error}") from None
            yield from found
            found.clear()

    def _check_doctype(self, parser: expat.XMLParserType, _: str, file: str | None, *_more: object) -> None:
        """Refuse entities of another file, which expat would omit silently."""
        if file and _OTHER_ENTITY.search(self.data.replace(b"\0", b"")):
            message = f"a DOCTYPE with entities of {shown(file)} is not read; expand: xmllint --noent --loaddtd FILE"
            raise self._at(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, message)

    def _broken(self, error: expat.ExpatError) -> FormatError:
        """Return a one-line error for invalid XML."""
        if what := not_text(self.data):
            return FormatError(what, source=self.name, line=1, column=1)
        problem = "it ends too early" if error.code == _ENDS_EARLY else expat.ErrorString(error.code)
        return self._at(error.lineno, error.offset + 1, f"not XML: {problem}")

    def error(self, element: Element, message: str, attribute: str = "", *, rule: str = "") -> FormatError:
        """Return the error for an element, or for the value of one of its attributes."""
        line, column = self.place(element, attribute)
        return self._at(line, column, message, rule=rule)

    def place(self, element: Element, attribute: str = "") -> tuple[int, int]:
        """Return line and column of an element, or of the value of one of its attributes."""
        line, column = element.line, element.column
        name = re.compile(rb"""\b%s\s*=\s*["']""" % re.escape(attribute.encode()))
        value = name.search(self.data, element.offset, element.offset + _BLOCK) if attribute else None
        if value:
            before = self.data[element.offset : value.end()].decode("utf-8", "replace")
            line += before.count("\n")
            column = len(before) - before.rfind("\n") if "\n" in before else column + len(before)
        return line, column

    def _at(self, line: int, column: int, message: str, *, rule: str = "") -> FormatError:
        # lines as expat counts them, the same as in editors
        text = self.data.decode("utf-8", "replace").split("\n")[line - 1 : line] or [""]
        snippet = pointer(line_of(text[0], 1), column)
        return FormatError(message, source=self.name, line=line, column=column, snippet=snippet, rule=rule)

    def required(self, element: Element, attribute: str) -> str:
        """Return an attribute that must be present and not empty."""
        value = element.attributes.get(attribute)
        if not value:
            raise self.error(element, f"<{element.tag}> has no {attribute}", attribute if value is not None else "")
        return value

    def numbers(self, element: Element, attribute: str, count: int, default: str | None = None) -> tuple[float, ...]:
        """Read an attribute as this many finite numbers between blanks; without it the default."""
        text = element.attributes.get(attribute, default)
        if text is None:
            raise self.error(element, f"<{element.tag}> has no {attribute}")
        return self.numbers_in(text, element, attribute, count)

    def numbers_in(self, text: str, element: Element, attribute: str, count: int) -> tuple[float, ...]:
        """Read a text of an element as this many finite numbers; the attribute, if any, is its place."""
        words = text.split()
        if len(words) != count:
            found = f"found {len(words)} in {shown(text)}"
            expected = f"{count} number{'s' * (count != 1)}"
            raise self.error(element, f"{attribute or element.tag}: expected {expected}, {found}", attribute)
        try:
            return tuple(map(parse_number, words))
        except ValueError as error:
            raise self.error(element, f"{attribute or element.tag}: {error}", attribute) from None

    @property
    def source(self) -> Source:
        """Return the text under its name."""
        return Source(self.name, self.data.decode("utf-8", "replace"))


_ENDS_EARLY = 3  # expat's code for "no element found", also used for truncated text


class XmlNode:
    """One element: its attributes and place, its text, and its selected children."""

    __slots__ = ("children", "element", "line", "tag", "text", "xml")

    def __init__(self, element: Element, xml: XmlFile) -> None:
        """Create it as it begins."""
        self.xml = xml
        self.element = element
        self.line = element.line
        self.tag = element.tag
        self.children: list[XmlNode] = []
        self.text = ""

    def all(self, *tags: str) -> Iterator[XmlNode]:
        """Yield the direct children of some kinds."""
        return (child for child in self.children if child.tag in tags)

    def first(self, tag: str) -> XmlNode | None:
        """Return the first child of a kind, if there is one."""
        return next(self.all(tag), None)

    def text_of(self, tag: str) -> str:
        """Return the text of the first child of a kind; "" if there is none."""
        found = self.first(tag)
        return "" if found is None else found.text

    def attribute(self, name: str) -> str:
        """Return an attribute; "" if it is missing."""
        return self.element.attributes.get(name, "").strip()

    def error(self, message: str, attribute: str = "", *, rule: str = "") -> FormatError:
        """Return the error for it, or for the value of one of its attributes."""
        return self.xml.error(self.element, message, attribute, rule=rule)

    def numbers(self, count: int) -> tuple[float, ...]:
        """Read its text as this many finite numbers."""
        return self.xml.numbers_in(self.text, self.element, "", count)


def read_nodes(xml: XmlFile, held: Mapping[str, Collection[str]], fmt: str = "", *, texts: bool = True) -> XmlNode:
    """Return the root element with the selected elements below it.

    held: the children kept for each element, the root first; all others are dropped.
    fmt: the format's name, for a file with another root.  texts: without them it is faster.
    Raises FormatError.
    """
    top = next(iter(held))
    root: XmlNode | None = None
    opened: list[XmlNode] = []
    skipped = 0  # the depth below which nothing is kept
    for element in xml.elements(DEEPEST_ELEMENT if texts else len(held) + 1, ends=texts):
        if skipped and element.depth > skipped:
            continue
        skipped = 0
        if element.ends and opened and opened[-1].element.depth == element.depth:
            opened[-1].text = element.text.strip()
        while opened and opened[-1].element.depth >= element.depth:
            opened.pop()
        if element.ends:
            continue
        if root is None and element.tag != top:
            expected = f"{fmt} begins with <{top}>" if fmt else f"expected <{top}>"
            raise xml.error(element, f"{expected}, found <{bare(element.tag)}>")
        if opened and element.tag not in held.get(opened[-1].tag, ()):
            skipped = element.depth
            continue
        node = XmlNode(element, xml)
        if opened:
            opened[-1].children.append(node)
        opened.append(node)
        root = root or node
    assert root is not None  # noqa: S101 - XML without an element is an error of its own
    return root
