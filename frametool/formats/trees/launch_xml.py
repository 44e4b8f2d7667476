"""Launch files in XML, of ROS 1 (`type=`) and ROS 2 (`exec=`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.documents.xml import XmlFile
from frametool.formats.trees.launch_actions import (
    COMPOSABLE,
    IN_PARAMETERS,
    PACKAGES,
    Action,
    call,
    condition,
    not_followed,
    not_read,
    runs_publisher,
)
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.documents.xml import Element


def actions(file: InputFile) -> Iterator[Action]:
    """Yield the calls and what is included, in order."""
    xml = XmlFile(file)
    outer: list[tuple[int, list[str]]] = []  # groups around: their depth, their conditions
    for element in xml.elements():
        if element.depth == 1 and element.tag != "launch":
            raise xml.error(element, f"expected <launch>, found <{element.tag}>")
        if element.ends:
            if outer and outer[-1][0] == element.depth:
                outer.pop()
            continue
        own = condition(element.attributes)
        if element.tag == "group":
            outer.append((element.depth, own))
            continue
        conditions = [each for _, group in outer for each in group] + own
        if element.tag == "include":
            yield not_followed("<include>", element.attributes.get("file", ""), element.line)
        elif element.tag == "composable_node" and element.attributes.get("plugin") == COMPOSABLE:
            yield not_read(IN_PARAMETERS, element.line, element.column)
        elif arguments := _command(element):
            yield _call(xml, element, arguments, conditions)


def _command(element: Element) -> str:
    """Return the attribute that holds the publisher's arguments; "" for other elements."""
    attributes = element.attributes
    program = attributes.get("exec", attributes.get("type"))
    if element.tag == "node" and attributes.get("pkg") in PACKAGES and program == CALL:
        return "args"
    if element.tag == "executable" and runs_publisher(attributes.get("cmd", "").split()):
        return "cmd"
    return ""


def _call(xml: XmlFile, element: Element, attribute: str, conditions: Sequence[str]) -> Action:
    if attribute not in element.attributes:
        return not_read(f"it has no {attribute}", element.line, element.column)
    return call(element.attributes[attribute], *xml.place(element, attribute), conditions)
