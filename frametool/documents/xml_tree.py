"""Part of an XML file as a tree of elements: those that a form has a use for; the rest is left out while reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from frametool.documents.xml_events import Element, XmlFile


class XmlNode:
    """One element: its attributes and place, its text, and those of the elements in it that are kept."""

    __slots__ = ("children", "element", "tag", "text")

    def __init__(self, element: Element) -> None:
        """Create it as it begins."""
        self.element = element
        self.tag = element.tag
        self.children: list[XmlNode] = []
        self.text = ""

    def all(self, *tags: str) -> Iterator[XmlNode]:
        """Yield the elements of some kinds that stand directly in it."""
        return (child for child in self.children if child.tag in tags)

    def first(self, tag: str) -> XmlNode | None:
        """Return the first element of a kind, if there is one."""
        for child in self.children:
            if child.tag == tag:
                return child
        return None

    def text_of(self, tag: str, default: str = "") -> str:
        """Return the text of the first element of a kind."""
        found = self.first(tag)
        return default if found is None else found.text

    def attribute(self, name: str) -> str:
        """Return an attribute; "" where it is missing."""
        return self.element.attributes.get(name, "").strip()


def read_nodes(xml: XmlFile, held: Mapping[str, Collection[str]]) -> XmlNode:
    """Return the root element with what is kept below it.

    held: the elements that are kept in each element, the root first; of all others nothing is.
    Raises FormatError.
    """
    top = next(iter(held))
    opened: list[XmlNode] = []
    skipped = 0  # the depth below which nothing is kept
    for element in xml.elements():
        if skipped and element.depth > skipped:
            continue
        skipped = 0
        if element.ends:
            if opened and opened[-1].element.depth == element.depth:
                ended = opened.pop()
                ended.text = element.text.strip()
                root = ended
        elif not opened and element.tag != top:
            raise xml.error(element, f"expected <{top}>, found <{element.tag}>")
        elif opened and element.tag not in held.get(opened[-1].tag, ()):
            skipped = element.depth
        else:
            made = XmlNode(element)
            if opened:
                opened[-1].children.append(made)
            opened.append(made)
    return root
