"""The transforms that launch files publish: the calls of static_transform_publisher in them, of ROS 1 and ROS 2.

    <node pkg="tf" type="static_transform_publisher" name="a" args="0.1 0 0.2 1.57 0 0 base cam 100"/>
    <node pkg="tf2_ros" exec="static_transform_publisher" args="--x 1 --frame-id base --child-frame-id cam"/>

XML of either ROS, YAML below `launch:`, and Python with `generate_launch_description`, which is parsed and never run.
The pose of the child in its parent, metres, radians; the arguments are those of `frametool.ros.publisher`. Only what
stands there literally is read: a call with `$(arg x)`, `LaunchConfiguration("x")` or arithmetic is listed as not
read, included files are named, and calls that start under a condition are read and listed.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.formats.detect import Beginning
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Reading
from frametool.ros import publisher

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import InputFile
    from frametool.formats.trees.launch_actions import Action
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

_PYTHON = re.compile(r"(?m)^ *(?:def |import |from \w[\w.]* import )")


def write_tree(tree: Frames, style: Style) -> str:
    """Return XML of ROS 2: one node an edge.

    Raises ValueInvalid for frames that move, and names that have no place there.
    """
    from html import escape

    if moving := [track.child for track in tree.tracks() if not track.standing]:
        raise ValueInvalid(f"{publisher.moving_frames(moving[:10])}; give --at TIME")
    lines = publisher.write_tree(tree, style.in_form("static2")).splitlines()
    if unsafe := next((line for line in lines if "$(" in line), None):
        names = unsafe[unsafe.index("--frame-id") :]
        raise ValueInvalid(f"a frame name with $( has no place in a launch file: {shown(names)}")
    node = f'  <node pkg="tf2_ros" exec="{publisher.CALL}" args="{{}}"/>\n'
    return f"<launch>\n{''.join(node.format(escape(line)) for line in lines)}</launch>\n"


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield what each call publishes, and note what could not be read."""
    count = unread = 0
    for action in _actions(file):
        if action.unread:
            unread += action.is_call
            options.tally.note_each(action.unread, action.line)
            continue
        if edge := _edge(action, file, options):
            count += 1
            yield edge
    calls = "1 static transform" if count == 1 else f"{count} static transforms"
    options.tally.about = calls + (f" ({unread} not read)" if unread else "")


def _actions(file: InputFile) -> Iterator[Action]:
    """Choose between the three languages of launch files."""
    begin = Beginning(file.head())
    if begin.xml:
        from frametool.formats.trees import launch_xml

        return launch_xml.actions(file)
    if file.path.endswith(".py") or _PYTHON.search(begin.text):
        from frametool.formats.trees import launch_python

        return launch_python.actions(file.source)
    from frametool.formats.trees import launch_yaml

    return launch_yaml.actions(file.source)


def _edge(action: Action, file: InputFile, options: Options) -> Edge | None:
    """Read the arguments of one call; None if they are wrong and reading goes on behind the error."""
    reading = Reading(Source(file.name, ""), normalize=options.normalize)
    try:
        pose = (
            publisher.read_call(action.arguments, reading)
            if isinstance(action.arguments, str)
            else publisher.read_words(action.arguments, reading)
        )
    except ValueInvalid as error:
        options.report(
            FormatError(str(error), source=file.name, line=action.line, column=action.column, rule=error.rule)
        )
        return None
    parent, child = reading.bare(pose.parent or ""), reading.bare(pose.name or "")
    for note in reading.notes:
        options.tally.note(note, action.line)
    if action.conditions:
        told = " and ".join(dict.fromkeys(action.conditions))
        options.tally.note_each(f"frame {shown(child)} is published under a condition: {told}", action.line)
    return Edge(parent, child, pose.components, line=action.line)
