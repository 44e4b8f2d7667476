"""The fast way through JSON lines of transforms: one pattern for one TransformStamped.

    {"header": {"stamp": {"sec": 12, "nanosec": 0}, "frame_id": "odom"}, "child_frame_id": "base", "transform": ..}
    {"transforms": [{"header": ..}, ..]}
    {"op": "publish", "topic": "/tf", "msg": {"transforms": [..]}}

The pattern takes plain numbers and plain names in the order of the message's definition, and nothing else: other
lines are left to the full reader, so that both give the same records.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.documents.json_reader import JSON_NUMBER
from frametool.ros.echo_blocks import plain_edge

if TYPE_CHECKING:
    from frametool.grammar.edges import Edge, Tally

GROUPS = {
    "NUMBER": f"({JSON_NUMBER})",
    "WHOLE": "(0|[1-9][0-9]{0,19})",
    "NAME": r'("[A-Za-z0-9_][\w/.+-]*")',  # a leading / is told of, with its place
    "TOPIC": r'("/[\w/]+")',
}
FIELDS = (
    '{"header": {"stamp": {"sec": WHOLE, "nanosec": WHOLE}, "frame_id": NAME}, "child_frame_id": NAME, '
    '"transform": {"translation": {"x": NUMBER, "y": NUMBER, "z": NUMBER}, '
    '"rotation": {"x": NUMBER, "y": NUMBER, "z": NUMBER, "w": NUMBER}}}'
)
ENVELOPE = '(?:{"op": "publish", "topic": TOPIC, "msg": )?'


def _pattern(layout: str) -> re.Pattern[str]:
    """Make the pattern of a layout; some tools leave the blanks behind colons and commas out."""
    layout = layout.replace("{", r"\{").replace("}", r"\}").replace(": ", ": ?").replace(", ", ", ?")
    for mark, group in GROUPS.items():
        layout = layout.replace(mark, group)
    return re.compile(layout, re.ASCII)


TRANSFORM = _pattern(FIELDS).match
BETWEEN = re.compile(", ?").match
LISTED = _pattern(ENVELOPE + r'{"transforms": \[').match


def plain_line(
    text: str, at: int, line: int, tally: Tally, *, normalize: bool = False
) -> tuple[str, list[Edge], int] | None:
    """Read the line of a text that begins at an offset: its topic, its edges, and where the next line begins.

    line: its number; normalize: take any non-zero quaternion.
    None for a line that is not plain; the tally is then as it was.
    """
    head = LISTED(text, at)
    topic = head[1] if head else None
    close = "" if head is None else "]}" if topic is None else "]}}"
    found = []
    rough = len(tally.rough)
    end = at if head is None else head.end()
    while entry := TRANSFORM(text, end):
        edge = plain_edge(entry.groups(), tally, line, normalize=normalize)
        if edge is None:
            break
        found.append(edge)
        end = entry.end()
        if head is None or (comma := BETWEEN(text, end)) is None:
            if text.startswith(close + "\n", end):
                return (topic or "")[1:-1], found, end + len(close) + 1
            break
        end = comma.end()
    del tally.rough[rough:]
    return None
