"""The fast path for transforms as tools print them: one pattern for one transform.

    transforms:                                                           ros2 topic echo, rostopic echo
    - header:
        stamp:
          sec: 1683377979
    ..
    {"header": {"stamp": {"sec": 12, "nanosec": 0}, "frame_id": "odom"}, "child_frame_id": "base", "transform": ..}
    {"transforms": [{"header": ..}, ..]}
    {"op": "publish", "topic": "/tf", "msg": {"transforms": [..]}}

The patterns match plain numbers and plain names in the order of the message's definition, and nothing else: other
messages are left to the full reader, so that both return the same records.
"""

from __future__ import annotations

import json
import re
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.json import JSON_NUMBER
from frametool.errors import ValueInvalid
from frametool.frames.stamps import BILLION
from frametool.geometry import floats, quaternion
from frametool.grammar.edges import EdgeColumns
from frametool.ros.messages import STAMPS, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Diagnostics

INFINITE = float("inf")
STAMPED = {"stamp": {"sec": "WHOLE", "nanosec": "WHOLE"}, "frame_id": "NAME"}
STAMPED1 = {"seq": "COUNT", "stamp": {"secs": "WHOLE", "nsecs": "WHOLE"}, "frame_id": "NAME"}
PLACED = {
    "child_frame_id": "NAME",
    "transform": {"translation": dict.fromkeys("xyz", "NUMBER"), "rotation": dict.fromkeys("xyzw", "NUMBER")},
}
FIELDS, FIELDS1 = {"header": STAMPED, **PLACED}, {"header": STAMPED1, **PLACED}  # of ROS 2, and of ROS 1


def _block(fields: dict[str, Any], indent: str) -> str:
    """Return fields as the echo tools print them."""
    lines = (
        f"{indent}{key}:\n{_block(each, indent + '  ')}" if type(each) is dict else f"{indent}{key}: {each}\n"
        for key, each in fields.items()
    )
    return "".join(lines)


ECHO_GROUPS = {
    ":\n": ": ?\n",  # rostopic writes a blank where a block opens
    "-\n": "- ?\n",
    "NUMBER": "([-+0-9.eE]+)",
    "COUNT": "[0-9]+",
    "WHOLE": " *([0-9]{1,20})",
    "NAME": r"""([A-Za-z0-9_/][\w/.+-]*|"[^"\\\n]+"|'[^'\n]+')""",
}
PUBLISHED = '{"op": "publish", "topic": TOPIC, "msg": '
TRANSFORMS = '{"transforms": LIST'
JSON_GROUPS = {
    "{": r"\{",
    "}": r"\}",
    ": ": ": ?",  # some tools omit the blanks after colons and commas
    ", ": ", ?",
    "LIST": r"\[",
    '"NUMBER"': f"({JSON_NUMBER})",
    '"COUNT"': "[0-9]+",
    '"WHOLE"': "(0|[1-9][0-9]{0,19})",
    '"NAME"': r'("[A-Za-z0-9_][\w/.+-]*")',  # a leading / is reported with its place
    "TOPIC": r'("/[\w/]+")',
}


class MessageLayout(NamedTuple):
    """How a tool writes messages of transforms: the patterns of one transform, and of the text around it.

    opening: of a message, with a group if it names a topic; closing: of the last one; gap: between two transforms
    lines: of one transform, 0 if a message is one line; first: the line that counts as its place
    """

    opening: re.Pattern[str]
    entry: re.Pattern[str]
    gap: re.Pattern[str]
    closing: re.Pattern[str]
    lines: int = 0
    first: int = 0


def _layout(groups: dict[str, str], opening: str, entry: str, between: str, closing: str, *lines: int) -> MessageLayout:
    """Return a layout made from the texts of its parts, in which `groups` replaces words by patterns."""
    for word, pattern in groups.items():
        opening, entry = opening.replace(word, pattern), entry.replace(word, pattern)
    gap, end = f"{between}|{closing}{opening}", f"{closing}|\\Z" if lines else closing
    first, each, inner, last = (re.compile(part, re.ASCII) for part in (opening, entry, gap, end))
    return MessageLayout(first, each, inner, last, *lines)


def _echoed(entry: str) -> MessageLayout:
    """Return the layout of documents printed by a tool."""
    lines = entry.count("\n"), entry[: entry.index("header")].count("\n")
    return _layout(ECHO_GROUPS, "transforms:\n", entry, "", "---\n", *lines)


def _on_lines(opening: str, between: str, closing: str) -> list[MessageLayout]:
    """Return the layouts of a kind of lines, in ROS 2 and in ROS 1."""
    return [_layout(JSON_GROUPS, opening, json.dumps(each), between, closing) for each in (FIELDS, FIELDS1)]


LAYOUTS = (
    (_echoed(f"- {_block(FIELDS, '  ')[2:]}"), _echoed(f"  -\n{_block(FIELDS1, '    ')}")),
    _on_lines(PUBLISHED + TRANSFORMS, ", ?", r"\]\}\}\n"),
    _on_lines(TRANSFORMS, ", ?", r"\]\}\n"),
    _on_lines("", "\n", "\n"),
)
ROS1_BEGINS = "  ", '{"header": {"seq"', '{"header":{"seq"'
EACH = 12  # items that `split` returns per transform: text, two parts of the stamp, two names, seven numbers


def plain_columns(text: str, line: int, tally: Diagnostics, *, normalize: bool = False) -> EdgeColumns | None:
    """Return the edges of a text that begins on a line; None, and no warnings, if not every message is plain.

    A single `split` finds all transforms, and the remaining text shows whether there is anything else.
    normalize: accept any non-zero quaternion.
    """
    layouts, opened = next((row, match) for row in LAYOUTS if (match := row[0].opening.match(text)))
    layout = layouts[text.startswith(ROS1_BEGINS, opened.end())]
    parts = layout.entry.split(text)
    begin, *gaps, end = parts[::EACH] if len(parts) > 1 else ("none", "")
    found = {gap: layout.gap.fullmatch(gap) for gap in {*gaps}}
    if begin != opened[0] or not all(found.values()) or not layout.closing.fullmatch(end):
        return None
    parents, children = ([tally.names[name] for name in parts[at::EACH]] for at in (3, 4))
    stamps = [*map(int, parts[1::EACH])], [*map(int, parts[2::EACH])]
    rows = zip(*(map(float, parts[at::EACH]) for at in range(5, EACH)), strict=True)
    steps = {gap: gap.count("\n") + layout.lines for gap in found}
    lines = [*accumulate(map(steps.__getitem__, gaps), initial=line + begin.count("\n") + layout.first)]
    topics: Iterator[str] | tuple[()] = ()
    if opened.re.groups:
        named = (str(found[gap][1] or "")[1:-1] for gap in gaps)  # type: ignore[index]
        topics = accumulate(named, lambda before, topic: topic or before, initial=opened[1][1:-1])
    return edge_columns((parents, children), stamps, rows, lines, tally, normalize=normalize, topics=topics)


def edge_columns(
    names: tuple[Sequence[str], Sequence[str]], stamps: Iterable[Sequence[int]], rows: Iterable[Rigid],
    lines: Sequence[int], tally: Diagnostics, *, normalize: bool, topics: Iterable[str] = (),
    received_ns: Iterable[int] = (),
) -> EdgeColumns | None:  # fmt: skip
    """Return edges with unit quaternions; None, and no warnings about numbers, if one of them is refused.

    names: of parents and of children; stamps: seconds and nanoseconds; rows: components as they were read
    """
    seconds, nanoseconds = stamps
    is_refused = any(stamp_problem(pick(seconds), pick(nanoseconds), STAMPS[0]) for pick in (min, max))
    if is_refused or not all(map(all, names)):
        return None
    rough = len(tally.rough)
    try:
        components = [unit_components(row, line, tally, normalize) for row, line in zip(rows, lines, strict=True)]
    except ValueError:  # of numbers that are refused, or no numbers
        del tally.rough[rough:]
        return None
    stamps_ns = [second * BILLION + part for second, part in zip(seconds, nanoseconds, strict=True)]
    return EdgeColumns(*names, stamps_ns, components, lines, topics, received_ns)


def unit_components(numbers: Rigid, line: int, tally: Diagnostics, normalize: bool) -> Rigid:  # noqa: FBT001 - fast
    """Return tx, ty, tz, x, y, z, w with a unit quaternion; raises ValueInvalid for numbers that every reader refuses.

    normalize: accept any non-zero quaternion.  The tally records the line of one that was off.
    """
    tx, ty, tz, x, y, z, w = numbers
    squared = x * x + y * y + z * z + w * w
    if abs(tx) + abs(ty) + abs(tz) < INFINITE:
        if abs(squared - 1.0) <= quaternion.UNIT:
            return numbers
        off = abs(squared**0.5 - 1.0)
        if off <= quaternion.TOLERATED or (normalize and 0.0 < squared < INFINITE):
            if off > quaternion.SILENT and not normalize:
                tally.rough.append(line)
            return tx, ty, tz, *quaternion.normalized(x, y, z, w, floats)
    problem = quaternion.complaint(x, y, z, w, normalize=normalize)
    raise problem or ValueInvalid("its position is not finite", rule="not-finite")
