"""The fast way through `ros2 topic echo /tf` and `rostopic echo /tf`: one pattern for one transform.

    transforms:
    - header:
        stamp:
          sec: 1683377979
    ..

The pattern takes what the two tools print for plain numbers and plain names, and nothing else: other documents are
left to the full reader, so that both give the same records.

The fast way through JSON lines of transforms: one pattern for one TransformStamped.

    {"header": {"stamp": {"sec": 12, "nanosec": 0}, "frame_id": "odom"}, "child_frame_id": "base", "transform": ..}
    {"transforms": [{"header": ..}, ..]}
    {"op": "publish", "topic": "/tf", "msg": {"transforms": [..]}}

The pattern takes plain numbers and plain names in the order of the message's definition, and nothing else: other
lines are left to the full reader, so that both give the same records.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.json import JSON_NUMBER
from frametool.frames.stamps import BILLION
from frametool.geometry import floats, quaternion
from frametool.grammar.edges import Edge

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Tally

INFINITE = float("inf")
LATEST = 1 << 32  # seconds that no message can hold
NUMBER = "([-+0-9.eE]+)"
WHOLE = " *([0-9]{1,20})"
NAME = r"""([A-Za-z0-9_/][\w/.+-]*|"[^"\\\n]+"|'[^'\n]+')"""

FIELDS = """\
header:
  stamp:
    sec:WHOLE
    nanosec:WHOLE
  frame_id: NAME
child_frame_id: NAME
transform:
  translation:
    x: NUMBER
    y: NUMBER
    z: NUMBER
  rotation:
    x: NUMBER
    y: NUMBER
    z: NUMBER
    w: NUMBER
"""
ROS2 = "- " + FIELDS[:-1].replace("\n", "\n  ") + "\n"
ROS1 = (
    ("  -\n" + FIELDS[:-1]).replace("\n", "\n    ").replace("nanosec", "nsecs").replace(" sec:", " secs:")
    .replace("header:", "header:\n      seq: [0-9]+") + "\n"
)  # fmt: skip


class Spelling(NamedTuple):
    """How one of the tools prints a transform: a matcher of it, how many lines it takes, in which it begins."""

    match: Callable[[str, int], re.Match[str] | None]
    lines: int
    first: int


def _spelling(layout: str) -> Spelling:
    """Make the matcher of a layout; rostopic leaves a blank where a block opens."""
    pattern = layout.replace(":\n", ": ?\n").replace("-\n", "- ?\n")
    for mark, group in (("NUMBER", NUMBER), ("WHOLE", WHOLE), ("NAME", NAME)):
        pattern = pattern.replace(mark, group)
    first = layout[: layout.index("header")].count("\n")
    return Spelling(re.compile(pattern, re.ASCII).match, layout.count("\n"), first)


SPELLINGS = (_spelling(ROS2), _spelling(ROS1))
HEAD = re.compile("transforms: ?\n").match
TAIL = "---\n"


class Blocks:
    """Read plain documents of a text one after the other; stop where one is not plain.

    `at` is the offset reached, always at the beginning of a document, and `line` its number.
    """

    __slots__ = ("at", "line", "normalize", "tally", "text")

    def __init__(self, text: str, line: int, tally: Tally, *, normalize: bool = False) -> None:
        """Start at the top of a text; normalize: take any non-zero quaternion."""
        self.normalize = normalize
        self.text = text
        self.at = 0
        self.line = line
        self.tally = tally

    def edges(self) -> Iterator[Edge]:
        """Yield the records of the documents from `at` on, up to one that is not plain."""
        text = self.text
        while head := HEAD(text, self.at):
            spelling = SPELLINGS[text.startswith("  ", head.end())]
            found = []
            rough = len(self.tally.rough)
            at, line = head.end(), self.line + 1
            while entry := spelling.match(text, at):
                edge = plain_edge(entry.groups(), self.tally, line + spelling.first, normalize=self.normalize)
                if edge is None:
                    del self.tally.rough[rough:]
                    return
                found.append(edge)
                at = entry.end()
                line += spelling.lines
            if not text.startswith(TAIL, at) and (at < len(text) or not found):
                del self.tally.rough[rough:]
                return
            self.at, self.line = at + len(TAIL), line + 1
            yield from found


def plain_edge(texts: tuple[str, ...], tally: Tally, line: int, *, normalize: bool) -> Edge | None:
    """Make the record of one transform's texts; None for one that needs a closer look."""
    parent, child = tally.names[texts[2]], tally.names[texts[3]]
    try:
        components = unit_components(tally, line, *map(float, texts[4:]), normalize=normalize)
    except ValueError:
        return None
    seconds, nanoseconds = int(texts[0]), int(texts[1])
    if not parent or not child or components is None or nanoseconds >= BILLION or seconds >= LATEST:
        return None
    return Edge(parent, child, components, seconds * BILLION + nanoseconds, line)


def unit_components(
    tally: Tally, line: int, tx: float, ty: float, tz: float, x: float, y: float, z: float, w: float, *,
    normalize: bool = False,
) -> Rigid | None:
    """Check the numbers of one transform as every door does; None for those that are refused there."""
    squared = x * x + y * y + z * z + w * w
    if not abs(tx) + abs(ty) + abs(tz) < INFINITE:
        return None
    if abs(squared - 1.0) <= quaternion.UNIT:
        return tx, ty, tz, x, y, z, w
    off = abs(squared**0.5 - 1.0)
    if not off <= quaternion.TOLERATED and not (normalize and 0.0 < squared < INFINITE):
        return None
    if off > quaternion.SILENT and not normalize:
        tally.rough.append(line)
    return tx, ty, tz, *quaternion.normalized(x, y, z, w, floats)


GROUPS = {
    "NUMBER": f"({JSON_NUMBER})",
    "WHOLE": "(0|[1-9][0-9]{0,19})",
    "NAME": r'("[A-Za-z0-9_][\w/.+-]*")',  # a leading / is told of, with its place
    "TOPIC": r'("/[\w/]+")',
}
JSON_FIELDS = (
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


TRANSFORM = _pattern(JSON_FIELDS).match
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
