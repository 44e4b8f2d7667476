"""Messages and transforms of a recording in text, one after another: bounded memory, any length.

From the output of the echo tools (echo, csv1, csv2), and JSON lines (jsonl) of rosbridge and Foxglove; what the tools
or the shell print in between is skipped and counted.  A message is plain values, as the document reader returns them.

    %time,field.header.seq,field.header.stamp,field.header.frame_id,field.point.x,..      rostopic echo -p
    1795206353524626016,1,1795206353524626016,turtle1,1.0,..                               stamps in ns, nothing quoted
    1683377979,902062451,world,turtle1,5.5,5.5,0.0,0.0,0.0,0.0,1.0                         ros2 topic echo --csv

rostopic names every field once, in the header; later rows may have more or fewer transforms than that.  ros2 has no
header: the number of fields identifies the kind of message; several transforms follow one another.

The fast path for transforms as tools print them is one pattern for one transform.  It matches plain numbers and plain
names in the order of the message's definition, and nothing else: other messages are left to the full reader, so that
both return the same records.

    transforms:                                                           ros2 topic echo, rostopic echo
    - header:
        stamp:
          sec: 1683377979
    ..
    {"header": {"stamp": {"sec": 12, "nanosec": 0}, "frame_id": "odom"}, "child_frame_id": "base", "transform": ..}
    {"transforms": [{"header": ..}, ..]}
    {"op": "publish", "topic": "/tf", "msg": {"transforms": [..]}}
"""

from __future__ import annotations

import json
import re
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool import sizes
from frametool.documents.document import JSON_NUMBER, parse_documents
from frametool.documents.source import InputFile, Piece, Source, counted_from, documents, lines
from frametool.errors import FormatError, ValueInvalid, first_of, shown
from frametool.frames.stamps import BILLION
from frametool.geometry import floats, quaternion
from frametool.grammar.edges import Diagnostics, Edge, EdgeColumns, Options
from frametool.grammar.readers import Misfit, Path, Reading, as_mapping
from frametool.ros import messages
from frametool.ros.messages import STAMPS, body_of, is_pose, on_topic, stamp_problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import BinaryIO

    from frametool.geometry import Rigid


def _axes(part: str, axes: str = "xyz") -> list[str]:
    return [f"{part}.{axis}" for axis in axes]


_RIGID = ["child_frame_id", *_axes("transform.translation"), *_axes("transform.rotation", "xyzw")]
_HEADER2 = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"]
TRANSFORM1 = ["header.seq", "header.stamp", "header.frame_id", *_RIGID]
TRANSFORM2 = [*_HEADER2, *_RIGID]
_POSE = [*_HEADER2, *_axes("pose.position"), *_axes("pose.orientation", "xyzw")]
_MANY = re.compile(r"field\.(\w*?)0\.header\.seq")


def _entries(cells: Sequence[str], names: Sequence[str]) -> list[dict[str, Any]]:
    """Split one row into its transforms."""
    size = len(names)
    if not cells or len(cells) % size:
        raise Misfit(
            f"expected {size} cells for each transform, found {len(cells)} (nothing is quoted: a comma in a name?)"
        )
    return [_nested(names, cells[at : at + size]) for at in range(0, len(cells), size)]


def _nested(names: Sequence[str], cells: Sequence[str]) -> dict[str, Any]:
    """Return cells as a nested mapping by their dotted names; a stamp in nanoseconds becomes secs and nsecs."""
    message: dict[str, Any] = {}
    for name, cell in zip(names, cells, strict=True):
        *outer, last = name.split(".")
        inner = message
        for step in outer:
            inner = inner.setdefault(step, {})
        inner[last] = cell
        if last == "stamp":
            if not (cell.isascii() and cell.isdigit()):
                raise Misfit(f"stamp must be whole nanoseconds, found {shown(cell)}")
            seconds, nanoseconds = divmod(int(cell), BILLION)
            inner[last] = {"secs": str(seconds), "nsecs": str(nanoseconds)}
    return message


class TextMessage(NamedTuple):
    """One message in a text.

    value: its plain values; source: its text; line: number of its first line in the file
    document: index in the text, None for a row; received_ns: time of reception, if printed
    """

    value: Any
    source: Source
    line: int
    document: int | None = 0
    received_ns: int | None = None

    def error(self, misfit: Misfit) -> FormatError:
        """Return an error for this message, with its place in the whole file."""
        if self.document is None:
            error = FormatError(str(misfit), source=self.source.name, line=1, rule=misfit.rule)
        else:
            error = misfit.placed(self.source, self.document)
        error.line += self.line - 1
        return error


def read_messages(stream: BinaryIO, name: str, tally: Diagnostics) -> Iterator[TextMessage | FormatError]:
    """Yield the messages printed by the echo tools; for an unreadable one its error."""
    for piece in documents(stream, name):
        yield from piece_messages(piece, name, "echo", tally)


def piece_messages(piece: Piece, name: str, fmt: str, tally: Diagnostics) -> Iterator[TextMessage | FormatError]:
    """Yield the messages of a piece of text: documents that end in `---`, or lines of jsonl."""
    texts: Iterable[tuple[int, str]] = _data_lines(piece, tally)
    if fmt != "jsonl":
        texts = ((line, messages.without_noise(text, line, tally)) for text, line in _cut(piece, "---\n", 1))
    for line, text in texts:
        try:
            with counted_from(line):
                found = parse_documents(text, name)
        except FormatError as error:
            yield error
            continue
        yield from (TextMessage(each.value, each.source, line, each.index) for each in found)


def line_texts(stream: BinaryIO, name: str, tally: Diagnostics) -> Iterator[tuple[int, str]]:
    """Yield the lines that are neither blank nor noise, with their numbers."""
    for piece in lines(stream, name):
        yield from _data_lines(piece, tally)


def _data_lines(piece: Piece, tally: Diagnostics) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(messages.without_noise(piece.text, piece.line, tally).split("\n"), piece.line):
        if line.strip():
            yield number, line


def _csv(stream: BinaryIO, name: str, tally: Diagnostics) -> Iterator[TextMessage | FormatError]:
    """Yield the messages of rows of `rostopic echo -p`, below a header, or of `ros2 topic echo --csv`, without one.

    Yields an error for a row that does not fit its header, or that is neither a pose nor transforms.
    """
    header: list[str] = []
    for number, line in line_texts(stream, name, tally):
        cells = line.split(",")
        if cells[0] == "%time":
            header = cells
            continue
        try:
            if not header and len(cells) == len(_POSE):
                value = _nested(_POSE, cells)
            elif not header:
                value = {"transforms": _entries(cells, TRANSFORM2)}
            elif many := _MANY.fullmatch("".join(header[1:2])):
                value = {many[1]: _entries(cells[1:], TRANSFORM1)}
            elif len(cells) == len(header):
                value = _nested([name.removeprefix("field.") for name in header[1:]], cells[1:])
            else:
                raise Misfit(f"expected {len(header)} cells, found {len(cells)}")
        except Misfit as misfit:
            yield FormatError(str(misfit), source=name, line=number)
            continue
        received = int(cells[0]) if header and cells[0].isdecimal() else None
        yield TextMessage(value, Source(name, line), number, None, received)


_HEADER = re.compile(r"\bheader\b")


def read(file: InputFile, options: Options) -> Iterator[Edge | EdgeColumns]:
    """Yield the transforms of every message, in the order of the recording."""
    if file.format in {"echo", "jsonl"}:
        cut, end = (documents, "---\n") if file.format == "echo" else (lines, "\n")
        for piece in cut(file.stream, file.name):
            for stretch in _cut(piece, end, sizes.STRETCH):
                yield from _plain(stretch, end, file, options)
    else:
        for message in _csv(file.stream, file.name, options.tally):
            yield from _message_edges(message, options)


def _cut(piece: Piece, end: str, size: int) -> Iterator[Piece]:
    """Split a piece at ends of documents or lines into chunks of about `size` characters, or one longer document."""
    text, line = piece
    at = 0
    while at < len(text):
        last = text.rfind(end, at, at + size) if at + size < len(text) else len(text)
        if last < 0:
            last = text.find(end, at)
        stretch = text[at : last + len(end) if last >= 0 else len(text)]
        yield Piece(stretch, line)
        line += stretch.count("\n")
        at += len(stretch)


def _plain(piece: Piece, end: str, file: InputFile, options: Options) -> Iterator[Edge | EdgeColumns]:
    """Yield the edges of a piece: plain messages by the fast path, at once or by bisection, others in full."""
    found = plain_columns(*piece, options.tally, normalize=options.normalize)
    if found and not found.topics:
        yield found
    elif found:
        for edge in found.edges():
            if options.topics.takes(edge.topic):
                yield on_topic(edge, file.name, options)
    elif len(halves := [*_cut(piece, end, len(piece.text) // 2 + 1)]) > 1:
        for half in halves:
            yield from _plain(half, end, file, options)
    else:
        for message in piece_messages(piece, file.name, file.format, options.tally):
            yield from _message_edges(message, options)


def _message_edges(message: TextMessage | FormatError, options: Options) -> Iterator[Edge]:
    """Yield the edges of one message; an error in one of them is reported and does not affect the others."""
    if isinstance(message, FormatError):
        options.report(message)
        return
    try:
        found = list(_transforms(message.value, (), options))
    except Misfit as misfit:
        options.report(message.error(misfit))
        return
    text = message.source.text
    starts = [match.start() for match in _HEADER.finditer(text)] if text.count("\n") > 1 else []
    numbers = [message.line + text.count("\n", 0, start) for start in starts]  # lines on which headers begin
    if len(numbers) != len(found):
        numbers = [message.line] * len(found)
    topic = messages.topic_of(message.value)
    for (transform, path), line in zip(found, numbers, strict=True):
        if topic and not options.topics.takes(topic):
            continue
        reading = Reading(message.source, normalize=options.normalize)
        try:
            body = body_of(topic, options.answers)
            parent, child, position, rotation, stamp_ns = messages.read_transform(transform, reading, body)
        except Misfit as misfit:
            options.report(message.error(misfit.below(*path)))
            continue
        options.tally.note_all(reading.notes, line)
        edge = Edge(parent, child, (*position, *rotation), stamp_ns, line, message.received_ns, (), topic)
        yield on_topic(edge, message.source.name, options) if topic else edge


def _transforms(value: Any, path: Path, options: Options) -> Iterator[tuple[dict[str, Any], Path]]:
    """Yield every transform of a message, or of a list of messages, with its path; count messages without transforms.

    A pose counts as a transform if its topic was chosen, or if messages have no topics.
    """
    if type(value) is list:
        for index, item in enumerate(value):
            yield from _transforms(item, (*path, index), options)
        return
    mapping, others = as_mapping(value, "a message with transforms"), options.tally.others
    inner, below = (mapping["msg"], (*path, "msg")) if messages.is_envelope(mapping) else (mapping, path)
    topic = messages.topic_of(mapping)
    options.topics.seen.add(topic)
    if is_pose(inner) and (inner is mapping or options.topics.chooses(topic)):
        yield inner, below
    elif not is_pose(inner) and messages.is_message(inner):
        yield from messages.messages(mapping, path)
    elif "op" in mapping:
        topic = str(mapping.get("topic") or f"op {mapping['op']}")
        others[topic] = others.get(topic, 0) + 1
    else:
        keys = first_of(list(mapping), 8, quote=shown)
        raise Misfit(f"expected a message with transforms, found the keys {keys}", path)


# --- the fast path for plain transforms ---


INFINITE = float("inf")
STAMPED = {"stamp": {"sec": "WHOLE", "nanosec": "WHOLE"}, "frame_id": "NAME"}
STAMPED1 = {"seq": "COUNT", "stamp": {"secs": "WHOLE", "nsecs": "WHOLE"}, "frame_id": "NAME"}
PLACED = {
    "child_frame_id": "NAME",
    "transform": {"translation": dict.fromkeys("xyz", "NUMBER"), "rotation": dict.fromkeys("xyzw", "NUMBER")},
}
FIELDS, FIELDS1 = {"header": STAMPED, **PLACED}, {"header": STAMPED1, **PLACED}  # of ROS 2 and of ROS 1


def _block(fields: dict[str, Any], indent: str) -> str:
    """Return fields as the echo tools print them."""
    lines = (
        f"{indent}{key}:\n{_block(each, indent + '  ')}" if type(each) is dict else f"{indent}{key}: {each}\n"
        for key, each in fields.items()
    )
    return "".join(lines)


ECHO_GROUPS = {
    ":\n": ": ?\n",  # rostopic writes a space before a nested block
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

    opening: of a message, with a group if it names a topic; entry: of one transform
    gap: between two transforms; closing: of the last message
    lines: number of lines of one transform, 0 if a message is one line; first: index of the line that errors name
    """

    opening: re.Pattern[str]
    entry: re.Pattern[str]
    gap: re.Pattern[str]
    closing: re.Pattern[str]
    lines: int = 0
    first: int = 0


def _layout(groups: dict[str, str], opening: str, entry: str, between: str, closing: str) -> MessageLayout:
    """Return a layout from the texts of its parts, in which `groups` maps words to patterns."""
    lines, first = entry.count("\n"), entry[: entry.index("header")].count("\n")
    for word, pattern in groups.items():
        opening, entry = opening.replace(word, pattern), entry.replace(word, pattern)
    gap, end = f"{between}|{closing}{opening}", f"{closing}|\\Z" if lines else closing
    begins, each, inner, ends = (re.compile(part, re.ASCII) for part in (opening, entry, gap, end))
    return MessageLayout(begins, each, inner, ends, lines, first)


ECHOED = f"- {_block(FIELDS, '  ')[2:]}", f"  -\n{_block(FIELDS1, '    ')}"
ON_LINES = json.dumps(FIELDS), json.dumps(FIELDS1)
LAYOUTS = [  # of each kind of text, as ROS 2 and as ROS 1 write it
    [_layout(groups, opening, entry, between, closing) for entry in entries]
    for groups, opening, entries, between, closing in (
        (ECHO_GROUPS, "transforms:\n", ECHOED, "", "---\n"),
        (JSON_GROUPS, PUBLISHED + TRANSFORMS, ON_LINES, ", ?", r"\]\}\}\n"),
        (JSON_GROUPS, TRANSFORMS, ON_LINES, ", ?", r"\]\}\n"),
        (JSON_GROUPS, "", ON_LINES, "\n", "\n"),
    )
]
ROS1_BEGINS = "  ", '{"header": {"seq"', '{"header":{"seq"'
EACH = 12  # items that `split` returns per transform: text, two parts of the stamp, two names, seven numbers


def plain_columns(text: str, line: int, tally: Diagnostics, *, normalize: bool = False) -> EdgeColumns | None:
    """Return the edges of a text that begins on a line; None, without warnings, if it has other than plain messages.

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
    parents, children = ([*map(tally.names.__getitem__, parts[at::EACH])] for at in (3, 4))
    stamps = [*map(int, parts[1::EACH])], [*map(int, parts[2::EACH])]
    rows = zip(*(map(float, parts[at::EACH]) for at in range(5, EACH)), strict=True)
    steps = {gap: gap.count("\n") + layout.lines for gap in found}
    lines = [*accumulate(map(steps.__getitem__, gaps), initial=line + begin.count("\n") + layout.first)]
    topics: Iterator[str] | tuple[()] = ()
    if opened.re.groups:
        named = (str(found[gap][1] or "")[1:-1] for gap in gaps)  # type: ignore[index]
        topics = accumulate(named, lambda before, topic: topic or before, initial=opened[1][1:-1])
    try:
        return edge_columns((parents, children), stamps, rows, lines, tally, normalize=normalize, topics=topics)
    except ValueError:  # invalid values, or not numbers
        return None


def edge_columns(
    names: tuple[Sequence[str], Sequence[str]], stamps: Iterable[Sequence[int]], rows: Iterable[Rigid],
    lines: Sequence[int], tally: Diagnostics, *, normalize: bool, topics: Iterable[str] = (),
    received_ns: Iterable[int] = (),
) -> EdgeColumns:  # fmt: skip
    """Return edges with unit quaternions; raises ValueInvalid for invalid values, without warnings about numbers.

    names: of parents and of children; stamps: seconds and nanoseconds; rows: components as they were read
    """
    seconds, nanoseconds = stamps
    if not all(map(all, names)):
        raise ValueInvalid("an empty frame name")
    if problem := stamp_problem(max(seconds), max(nanoseconds), STAMPS[0]):  # stamps here are never below the range
        raise problem
    rough: list[int] = []
    components = [unit_components(row, line, rough, normalize) for row, line in zip(rows, lines, strict=True)]
    tally.rough += rough
    stamps_ns = [second * BILLION + part for second, part in zip(seconds, nanoseconds, strict=True)]
    return EdgeColumns(*names, stamps_ns, components, lines, topics, received_ns)


def unit_components(numbers: Rigid, line: int, rough: list[int], normalize: bool) -> Rigid:  # noqa: FBT001 - fast
    """Return tx, ty, tz, x, y, z, w with a unit quaternion; raises ValueInvalid for numbers that every reader refuses.

    normalize: accept any non-zero quaternion.  rough: receives the line if the quaternion was off by more than
        rounding.
    """
    tx, ty, tz, x, y, z, w = numbers
    squared = x * x + y * y + z * z + w * w
    if abs(tx) + abs(ty) + abs(tz) < INFINITE:
        if abs(squared - 1.0) <= quaternion.UNIT:
            return numbers
        off = abs(squared**0.5 - 1.0)
        if off <= quaternion.TOLERATED or (normalize and 0.0 < squared < INFINITE):
            if off > quaternion.SILENT and not normalize:
                rough.append(line)
            return tx, ty, tz, *quaternion.normalized(x, y, z, w, floats)
    problem = quaternion.complaint(x, y, z, w, normalize=normalize)
    raise problem or ValueInvalid("its position is not finite", rule="not-finite")
