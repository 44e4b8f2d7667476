"""The transforms that launch files publish: calls of static_transform_publisher, of ROS 1 and ROS 2.

    <node pkg="tf" type="static_transform_publisher" name="a" args="0.1 0 0.2 1.57 0 0 base cam 100"/>
    <node pkg="tf2_ros" exec="static_transform_publisher" args="--x 1 --frame-id base --child-frame-id cam"/>

XML of either ROS, YAML below `launch:`, and Python with `generate_launch_description`, which is parsed and never run.
The pose of the child in its parent, metres, radians; the arguments are those of `frametool.ros.publisher`. Only literal
values are read: a call with `$(arg x)`, `LaunchConfiguration("x")` or arithmetic is listed as not read, included files
are named, and calls that start under a condition are read and listed.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from frametool.documents.document import format_error, locate_many, parse_documents
from frametool.documents.xml import XmlFile
from frametool.errors import ValueInvalid, shown
from frametool.formats.detect import Beginning
from frametool.formats.trees.launch_actions import COMPOSABLE, COMPOSED, PACKAGES, Action, runs_publisher
from frametool.grammar.readers import Misfit, kind
from frametool.ros import publisher

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from frametool.documents.source import InputFile, Source
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Edge, Options
    from frametool.grammar.readers import Path
    from frametool.grammar.result import Style

_PYTHON = re.compile(r"(?m)^ *(?:def |import |from \w[\w.]* import )")
_SUBSTITUTION = re.compile(r"\$\([^()]*\)?")
_NO, _YES = ("0", "false"), ("1", "true")


def write_tree(tree: Frames, style: Style) -> str:
    """Return XML of ROS 2: one node per edge.

    Raises ValueInvalid for moving frames, and names that cannot be written.
    """
    from html import escape

    if moving := [track.child for track in tree.tracks() if not track.is_static]:
        raise ValueInvalid(f"{publisher.moving_frames(moving[:10])}; give --at TIME")
    lines = publisher.write_tree(tree, style.with_format("static2")).splitlines()
    if unsafe := next((line for line in lines if "$(" in line), None):
        names = unsafe[unsafe.index("--frame-id") :]
        raise ValueInvalid(f"a frame name with $( cannot be written in a launch file: {shown(names)}")
    node = f'  <node pkg="tf2_ros" exec="{publisher.CALL}" args="{{}}"/>\n'
    return f"<launch>\n{''.join(node.format(escape(line)) for line in lines)}</launch>\n"


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edge of each call, and record what could not be read."""
    for action in _actions(file):
        if action.unread:
            options.tally.note_each(action.unread, action.line)
        elif edge := publisher.read_edge(action.arguments, file, options, action.line, action.column):
            if action.conditions:
                conditions = " and ".join(dict.fromkeys(action.conditions))
                message = f"frame {shown(edge.child)} is published under a condition: {conditions}"
                options.tally.note_each(message, action.line)
            yield edge


def _actions(file: InputFile) -> Iterator[Action]:
    """Select the reader of one of the three languages of launch files."""
    begin = Beginning(file.head())
    if begin.xml:
        return _of_xml(file)
    if file.path.endswith(".py") or _PYTHON.search(begin.text):
        from frametool.formats.trees import launch_python

        return launch_python.actions(file.source)
    return _of_yaml(file.source)


def _of_xml(file: InputFile) -> Iterator[Action]:
    """Yield the calls and the included files in XML, in order."""
    xml = XmlFile(file)
    groups: list[tuple[int, list[str]]] = []  # enclosing groups: their depth, their conditions
    for element in xml.elements():
        if element.depth == 1 and element.tag != "launch":
            raise xml.error(element, f"expected <launch>, found <{element.tag}>")
        if element.ends:
            if groups and groups[-1][0] == element.depth:
                groups.pop()
            continue
        own = _conditions(element.attributes)
        if element.tag == "group":
            groups.append((element.depth, own))
            continue
        conditions = [each for _, group in groups for each in group] + own
        if action := _action(element.tag, element.attributes, conditions, "<include>"):
            line, column = xml.place(element, action.key)
            yield action._replace(line=line, column=column)


def _of_yaml(source: Source) -> Iterator[Action]:
    """Yield the calls and the included files below `launch:`, in order."""
    found: list[tuple[Path, Action]] = []
    for document in parse_documents(source.text, source.name):
        top = (document.index, "launch")
        try:
            if type(document.value) is not dict or "launch" not in document.value:
                raise Misfit(f"expected launch: and a list of actions, found {kind(document.value)}", top)
            for path, tag, entry, conditions in _entries(document.value["launch"], top, []):
                if action := _action(tag, entry, conditions, "include"):
                    found.append(((*path, action.key) if action.key else path, action))
        except Misfit as misfit:
            raise format_error(source, misfit.path, str(misfit)) from None
    places = locate_many(source.text, [path for path, _ in found])
    for (_, action), (line, column) in zip(found, places, strict=True):
        yield action._replace(line=line, column=column)


def _entries(entries: Any, path: Path, conditions: list[str]) -> Iterator[tuple[Path, str, dict[str, Any], list[str]]]:
    """Yield the actions of a list: the path, the kind, the fields, and the conditions of each."""
    if entries is None:
        return
    if type(entries) is not list:
        raise Misfit(f"expected a list of actions, found {kind(entries)}", path)
    for index, entry in enumerate(entries):
        if type(entry) is not dict:
            raise Misfit(f"expected an action as - node: .., found {kind(entry)}", (*path, index))
        for tag, inner in entry.items():
            here = (*path, index, tag)
            under = conditions + _conditions(inner) if type(inner) is dict else conditions
            if tag == "group" and type(inner) is list:
                yield from _entries(inner, here, under)
            elif tag == "group" and type(inner) is dict:
                yield from _entries(inner.get("children"), (*here, "children"), under)
            elif tag == "node_container" and type(inner) is dict and type(inner.get("composable_node")) is list:
                for number, node in enumerate(inner["composable_node"]):
                    if type(node) is dict:
                        yield (*here, "composable_node", number), "composable_node", node, under
            elif type(inner) is dict:
                yield here, tag, inner, under


def _conditions(entry: Mapping[str, Any]) -> list[str]:
    """Return the attributes `if` and `unless`."""
    return [f'{key}="{entry[key]}"' for key in ("if", "unless") if type(entry.get(key)) is str]


def _action(tag: str, entry: Mapping[str, Any], conditions: list[str], include: str) -> Action | None:
    """Return the action of one element or entry; None if it starts no publisher."""
    command = entry.get("cmd")
    if tag == "include":
        return Action.not_followed(include, entry.get("file", ""))
    if tag == "composable_node":
        return COMPOSED if entry.get("plugin") == COMPOSABLE else None
    if tag == "node" and entry.get("pkg") in PACKAGES and entry.get("exec", entry.get("type")) == publisher.CALL:
        key = "args"
    elif tag == "executable" and type(command) is str and runs_publisher(command.split()):
        key = "cmd"
    else:
        return None
    text = entry.get(key)
    if type(text) is not str:
        return Action.not_read(f"its {key} must be text, found {kind(text)}" if key in entry else f"it has no {key}")
    if substitution := _SUBSTITUTION.search(text):
        return Action.not_read(f"its arguments have {shown(substitution[0])}", key)
    open_conditions = []
    for condition in conditions:
        word, value = condition[:-1].lower().split('="', 1)
        if value in (_NO if word == "if" else _YES):
            return Action.not_read(f"it never starts ({condition})", key)
        if value not in (*_NO, *_YES):
            open_conditions.append(condition)
    return Action(text, conditions=open_conditions, key=key)
