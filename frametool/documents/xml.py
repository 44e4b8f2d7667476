"""Read XML as a tree of elements with their places; entities are refused.

The parser is expat of the standard library.  Names keep their prefix as written (`sensor:camera`), so that files with
undeclared prefixes can be read too.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.parsers import expat

from frametool.documents.source import InputFile, Source, line_of, not_text, pointer
from frametool.errors import FormatError, NamedTuple, bare, shown
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import NoReturn


DEEPEST_ELEMENT = 100_000
_BLOCK = 1 << 16
_OTHER_ENTITY = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)[^\s;&]++;")


class XmlFile(NamedTuple):
    """The name and the bytes of an XML file, and errors that point into it."""

    source: Source
    data: bytes

    def at(self, line: int, column: int, message: str, *, rule: str = "") -> FormatError:
        """Return the error for a place."""
        # lines as expat counts them, the same as in editors
        text = self.data.decode("utf-8", "replace").split("\n")[line - 1 : line] or [""]
        snippet = pointer(line_of(text[0], 1), column)
        return FormatError(message, source=self.source.name, line=line, column=column, snippet=snippet, rule=rule)


_ENDS_EARLY = 3  # expat's code for "no element found", also used for truncated text


class Element:
    """One element: its attributes, its place, the text directly in it, and its children.

    offset: of its first character, in bytes
    """

    __slots__ = ("attributes", "children", "column", "file", "line", "offset", "tag", "text")

    def __init__(self, file: XmlFile, tag: str, attributes: dict[str, str], place: tuple[int, int, int]) -> None:
        """Create an element without text and children."""
        self.file, self.tag, self.attributes = file, tag, attributes
        self.line, self.column, self.offset = place
        self.children: list[Element] = []
        self.text = ""

    def all(self, *tags: str) -> Iterator[Element]:
        """Yield the children with one of these tags."""
        return (child for child in self.children if child.tag in tags)

    def first(self, tag: str) -> Element | None:
        """Return the first child with a tag; None without one."""
        return next(self.all(tag), None)

    def text_of(self, tag: str) -> str:
        """Return the text of the first child with a tag; "" without one."""
        found = self.first(tag)
        return "" if found is None else found.text

    def attribute(self, name: str) -> str:
        """Return an attribute; "" if it is missing."""
        return self.attributes.get(name, "").strip()

    def required(self, attribute: str) -> str:
        """Return an attribute; raises FormatError if it is missing or empty."""
        value = self.attributes.get(attribute)
        if not value:
            raise self.error(f"<{self.tag}> has no {attribute}", attribute if value is not None else "")
        return value

    def numbers(self, count: int, attribute: str = "", default: str | None = None) -> tuple[float, ...]:
        """Read the text, or an attribute, as `count` finite numbers with blanks between them; raises FormatError.

        default: text in place of a missing attribute
        """
        text = self.attributes.get(attribute, default) if attribute else self.text
        if text is None:
            raise self.error(f"<{self.tag}> has no {attribute}")
        words = text.split()
        if len(words) != count:
            found = f"found {len(words)} in {shown(text)}"
            expected = f"{count} number{'s' * (count != 1)}"
            raise self.error(f"{attribute or self.tag}: expected {expected}, {found}", attribute)
        try:
            return tuple(map(parse_number, words))
        except ValueError as error:
            raise self.error(f"{attribute or self.tag}: {error}", attribute) from None

    def error(self, message: str, attribute: str = "", *, rule: str = "") -> FormatError:
        """Return the error for the element, or for the value of one of its attributes."""
        return self.file.at(*self.place(attribute), message, rule=rule)

    def place(self, attribute: str = "") -> tuple[int, int]:
        """Return line and column of the element, or of the value of one of its attributes."""
        line, column, data = self.line, self.column, self.file.data
        name = re.compile(rb"""\b%s\s*=\s*["']""" % re.escape(attribute.encode()))
        value = name.search(data, self.offset, self.offset + _BLOCK) if attribute else None
        if value:
            before = data[self.offset : value.end()].decode("utf-8", "replace")
            line += before.count("\n")
            column = len(before) - before.rfind("\n") if "\n" in before else column + len(before)
        return line, column


def _parse(parser: expat.XMLParserType, xml: XmlFile) -> None:
    """Pass the whole text to the parser; its errors and those of Python's codecs become FormatErrors."""
    try:
        parser.Parse(xml.data, True)  # noqa: FBT003 - expat's only way to say that this is all
    except expat.ExpatError as error:
        if what := not_text(xml.data):
            raise FormatError(what, source=xml.source.name, line=1, column=1) from None
        problem = "it ends too early" if error.code == _ENDS_EARLY else expat.ErrorString(error.code)
        raise xml.at(error.lineno, error.offset + 1, f"not XML: {problem}") from None
    except (LookupError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        raise xml.at(1, 1, f"not XML: {error}") from None


def read_xml(file: InputFile, root: str = "", fmt: str = "") -> Element:
    """Return the root element.

    root: its expected tag, "" for any; fmt: name of the format, for the message about another root
    Raises FormatError if it is not XML, and for declarations of entities.
    """
    xml = XmlFile(Source(file.name, ""), file.read())
    top = Element(xml, "", {}, (0, 0, 0))  # above the root
    opened = [top]
    texts: list[list[str]] = [[]]
    parser = expat.ParserCreate()

    def place() -> tuple[int, int, int]:
        return parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, parser.CurrentByteIndex

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(opened) > DEEPEST_ELEMENT:
            raise xml.at(*place()[:2], f"more than {DEEPEST_ELEMENT} elements inside one another")
        element = Element(xml, tag, attributes, place())
        opened[-1].children.append(element)
        opened.append(element)
        texts.append([])

    def end(_: str) -> None:
        opened.pop().text = "".join(texts.pop()).strip()

    def add_text(text: str) -> None:
        texts[-1].append(text)

    def check_doctype(_: str, other: str | None, *_more: object) -> None:
        if other and _OTHER_ENTITY.search(xml.data.replace(b"\0", b"")):  # expat would omit these silently
            problem = f"a DOCTYPE with entities of {shown(other)} is not read; expand: xmllint --noent --loaddtd FILE"
            raise xml.at(*place()[:2], problem)

    def refuse(*_: object) -> NoReturn:
        raise xml.at(*place()[:2], "a DOCTYPE with entities is not read; expand them: xmllint --noent FILE")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = add_text
    parser.StartDoctypeDeclHandler = check_doctype
    parser.EntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    _parse(parser, xml)
    (found,) = top.children
    if root and found.tag != root:
        expected = f"{fmt} begins with <{root}>" if fmt else f"expected <{root}>"
        raise found.error(f"{expected}, found <{bare(found.tag)}>")
    return found
