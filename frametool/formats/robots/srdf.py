"""SRDF, what MoveIt knows of a robot beside its URDF: states with names, and the joint that holds the robot.

    <virtual_joint name="base" type="fixed" parent_frame="world" child_link="link0"/>
    <group_state name="ready" group="arm"><joint name="elbow" value="0.5"/></group_state>

Radians and metres.  A state is values of joints; a planar joint has x y theta, a floating one x y z qx qy qz qw.  A
virtual joint is an edge, at the identity unless told.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.source import Source
from frametool.documents.xml import XmlFile
from frametool.errors import FormatError, Unanswered, alternatives, bare, shown
from frametool.formats.robots.joints import IDENTITY, Joint
from frametool.formats.robots.posture import Posture, Setting
from frametool.grammar.edges import Edge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.documents.xml import Element
    from frametool.grammar.edges import Options
    from frametool.grammar.readers import Path

KINDS = ("fixed", "planar", "floating")
PARTED = "/"  # between group and state, where a state's name alone is not enough


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of the virtual joints."""
    xml = XmlFile(file)
    found: dict[str, Element] = {}
    for element in _elements(xml):
        if element.depth == 2 and element.tag == "virtual_joint":
            name, kind = _attribute(xml, element, "name"), _attribute(xml, element, "type")
            if kind not in KINDS:
                message = f"virtual joint {shown(name)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
                raise xml.error(element, message, "type")
            if name in found:
                raise xml.error(element, f"virtual joint {shown(name)} twice; first in line {found[name].line}", "name")
            found[name] = element
    if not found:
        raise FormatError("no virtual joint, so no frames; --joints FILE:STATE reads its states", source=file.name)
    joints = [
        Joint(name, element.attributes["type"], (0.0, 0.0, 1.0), line=element.line)
        for name, element in found.items()
        if element.attributes["type"] != "fixed"
    ]
    fixed = found.keys() - {joint.name for joint in joints}
    posture = Posture(joints, options, lambda joint, problem: xml.error(found[joint.name], problem), fixed=fixed)
    for name, element in found.items():
        parent, child = (
            options.tally.names.bare(_attribute(xml, element, end)) for end in ("parent_frame", "child_link")
        )
        if name in fixed:
            yield Edge(parent, child, IDENTITY, line=element.line)
        else:
            yield from posture.edges(parent, child, IDENTITY, name, element.line)


def read_joints(file: InputFile, state: str) -> Iterator[Setting]:
    """Yield the values of joints in a state, told as STATE, or GROUP/STATE where groups have different ones.

    Raises Unanswered without a state, FormatError for one that is not there.
    """
    xml = XmlFile(file)
    states: dict[str, list[str]] = {}
    chosen = False
    first: dict[str, tuple[str, Element]] = {}
    for element in _elements(xml):
        if element.depth == 2:
            chosen = False
            if element.tag == "group_state":
                name, group = _attribute(xml, element, "name"), element.attributes.get("group", "")
                states.setdefault(name, []).append(group)
                chosen = state in (name, f"{group}{PARTED}{name}")
        elif chosen and element.depth == 3 and element.tag == "joint":
            joint, value = _attribute(xml, element, "name"), _attribute(xml, element, "value")
            known, before = first.setdefault(joint, (value, element))
            if known != value:
                groups = " or ".join(f"{file.name}:{group}{PARTED}{state}" for group in states.get(state, ()))
                message = f"joint {shown(joint)} has another value in line {before.line}; say which: {groups}"
                raise xml.error(element, message, "value")
            refuse = partial(_refused, xml, element)
            yield Setting(joint, _value(xml, element, value), None, refuse, Source(xml.name, ""), loose=True)
    if not first:
        raise _not_chosen(file.name, state, states)


def _elements(xml: XmlFile) -> Iterator[Element]:
    for element in xml.elements(deepest=3, ends=False):
        if element.depth == 1 and element.tag != "robot":
            raise xml.error(element, f"SRDF begins with <robot>, found <{bare(element.tag)}>")
        yield element


def _attribute(xml: XmlFile, element: Element, name: str) -> str:
    value = element.attributes.get(name)
    if not value:
        raise xml.error(element, f"<{element.tag}> has no {name}", name if value is not None else "")
    return value


def _value(xml: XmlFile, element: Element, text: str) -> Any:
    """Return a value as the grammar of joints has it: one number, or a pose."""
    words = text.split()
    if len(words) <= 1:
        return words[0] if words else ""
    numbers = xml.numbers(element, "value", 3 if len(words) == 3 else 7)
    texts = [repr(number) for number in numbers]
    if len(texts) == 3:
        return {"xyz": [*texts[:2], "0"], "rpy": ["0", "0", texts[2]]}
    return {"xyz": texts[:3], "xyzw": texts[3:]}


def _refused(xml: XmlFile, element: Element, problem: str, _below: Path) -> FormatError:
    return xml.error(element, problem, "value")


def _not_chosen(name: str, state: str, states: dict[str, list[str]]) -> FormatError:
    """Say which states there are."""
    if not states:
        return FormatError("no states (group_state) in it", source=name)
    if not state:
        spelled = " or ".join(f"--joints {name}:{each}" for each in [*states][:5])
        return Unanswered(f"say which state: {spelled}", source=name)
    if state in states or any(state == f"{group}{PARTED}{each}" for each, groups in states.items() for group in groups):
        return FormatError(f"state {shown(state)} has no joints", source=name)
    return FormatError(f"no state {shown(state)}{alternatives(state, states, 'states')}", source=name)
