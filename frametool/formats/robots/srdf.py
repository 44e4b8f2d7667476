"""SRDF, what MoveIt knows of a robot beside its URDF: states with names, and the joint that holds the robot.

    <virtual_joint name="base" type="fixed" parent_frame="world" child_link="link0"/>
    <group_state name="ready" group="arm"><joint name="elbow" value="0.5"/></group_state>

Radians and metres.  A state is values of joints; a planar joint has x y theta, a floating one x y z qx qy qz qw.  A
virtual joint is an edge, at the identity unless told.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from frametool.documents.source import InputFile, Source
from frametool.documents.xml import Element, XmlFile, XmlNode, read_nodes
from frametool.errors import FormatError, Unanswered, alternatives, shown
from frametool.formats.robots.model import Joint, Link
from frametool.formats.robots.posture import Posture, Setting

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.readers import Path

KINDS = ("fixed", "planar", "floating")
HELD = {"robot": ("virtual_joint", "group_state"), "group_state": ("joint",)}


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of the virtual joints."""
    xml = XmlFile(file)
    links: dict[str, Link] = {}
    for node in read_nodes(xml, HELD, "SRDF", texts=False).all("virtual_joint"):
        element = node.element
        name, kind = xml.required(element, "name"), xml.required(element, "type")
        if kind not in KINDS:
            message = f"virtual joint {shown(name)} has the type {shown(kind)}{alternatives(kind, KINDS, 'types')}"
            raise xml.error(element, message, "type")
        if name in links:
            raise xml.error(element, f"virtual joint {shown(name)} twice; first in line {links[name].line}", "name")
        parent, child = (options.tally.names.bare(xml.required(element, end)) for end in ("parent_frame", "child_link"))
        if kind == "fixed":
            links[name] = Link(parent, child, line=element.line, fixed=name)
        else:
            joint = Joint(name, kind, (0.0, 0.0, 1.0), line=element.line)
            links[name] = Link(parent, child, joints=(joint,), line=element.line)
    if not links:
        raise FormatError("no virtual joint, so no frames; --joints FILE:STATE reads its states", source=file.name)
    yield from Posture.of(links.values(), options).edges(links.values())


def read_joints(file: InputFile, state: str) -> Iterator[Setting]:
    """Yield the values of joints in a state, named as STATE, or GROUP/STATE where groups have different ones.

    Raises Unanswered without a state, FormatError for one that is not there.
    """
    xml = XmlFile(file)
    states: dict[str, list[str]] = {}
    first: dict[str, tuple[str, Element]] = {}
    for node in read_nodes(xml, HELD, "SRDF", texts=False).all("group_state"):
        name, group = xml.required(node.element, "name"), node.element.attributes.get("group", "")
        states.setdefault(name, []).append(group)
        for each in node.children if state in (name, f"{group}/{name}") else ():
            joint, value = xml.required(each.element, "name"), xml.required(each.element, "value")
            known, before = first.setdefault(joint, (value, each.element))
            if known != value:
                groups = " or ".join(f"{file.name}:{group}/{state}" for group in states.get(state, ()))
                message = f"joint {shown(joint)} has another value in line {before.line}; say which: {groups}"
                raise xml.error(each.element, message, "value")
            refuse = partial(_refused, each)
            yield Setting(joint, _value(xml, each.element, value), None, refuse, Source(xml.name, ""), loose=True)
    if not first:
        raise _not_chosen(file.name, state, states)


def _value(xml: XmlFile, element: Element, text: str) -> Any:
    """Return a value as the grammar of joints has it: one number, or a pose."""
    words = text.split()
    if len(words) <= 1:
        return repr(xml.numbers(element, "value", 1)[0])
    texts = [repr(number) for number in xml.numbers(element, "value", 3 if len(words) == 3 else 7)]
    if len(texts) == 3:
        return {"xyz": [*texts[:2], "0"], "rpy": ["0", "0", texts[2]]}
    return {"xyz": texts[:3], "xyzw": texts[3:]}


def _refused(node: XmlNode, problem: str, _below: Path) -> FormatError:
    return node.error(problem, "value")


def _not_chosen(name: str, state: str, states: dict[str, list[str]]) -> FormatError:
    """Say which states there are."""
    if not states:
        return FormatError("no states (group_state) in it", source=name)
    if not state:
        spelled = " or ".join(f"--joints {name}:{each}" for each in [*states][:5])
        return Unanswered(f"say which state: {spelled}", source=name)
    if state in states or any(state == f"{group}/{each}" for each, groups in states.items() for group in groups):
        return FormatError(f"state {shown(state)} has no joints", source=name)
    return FormatError(f"no state {shown(state)}{alternatives(state, states, 'states')}", source=name)
