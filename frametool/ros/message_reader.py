"""Transforms out of ROS messages in text: what the echo tools print, their CSV, rosbridge and Foxglove JSON lines."""

from __future__ import annotations

import re
from itertools import count
from typing import TYPE_CHECKING, Any

from frametool.documents.chunks import Piece, documents, lines
from frametool.errors import FormatError, shown
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Misfit, Reading, as_mapping
from frametool.ros import messages
from frametool.ros.echo_blocks import Blocks
from frametool.ros.json_blocks import plain_line
from frametool.ros.message_stream import Message, document_messages, end_of_document, line_messages, read_messages
from frametool.ros.pose_messages import body_of, is_pose, read_pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.input_file import InputFile
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Options
    from frametool.grammar.readers import Path

_HEADER = re.compile(r"\bheader\b")


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the transforms of every message, in the order they were recorded."""
    if file.form == "echo":
        for piece in documents(file.stream, file.name):
            yield from _echo(piece, file.name, options)
    elif file.form == "jsonl":
        for piece in lines(file.stream, file.name):
            yield from _json_lines(piece, file.name, options)
    else:
        for message in read_messages(file.stream, file.name, file.form, options.tally):
            yield from _message_edges(message, options)


def _echo(piece: Piece, name: str, options: Options) -> Iterator[Edge]:
    """Read plain documents fast and the others in full."""
    blocks = Blocks(piece.text, piece.line, options.tally, normalize=options.normalize)
    while True:
        if not options.raw:
            yield from blocks.edges()
        if blocks.at >= len(piece.text):
            return
        text = piece.text[blocks.at : end_of_document(piece.text, blocks.at)]
        for message in document_messages(Piece(text, blocks.line), name, options.tally):
            yield from _message_edges(message, options)
        blocks.at += len(text)
        blocks.line += text.count("\n")


def _json_lines(piece: Piece, name: str, options: Options) -> Iterator[Edge]:
    """Read plain lines fast and the others in full."""
    at, text = 0, piece.text
    plains = not options.raw and not options.topics.chosen
    for line in count(piece.line):
        if at >= len(text):
            return
        if plains and (plain := plain_line(text, at, line, options.tally, normalize=options.normalize)):
            topic, edges, at = plain
            for edge in edges:
                if not topic:
                    yield edge
                elif options.topics.takes(topic):
                    yield _on_topic(edge, topic, name, options)
        else:
            end = text.find("\n", at) + 1 or len(text) + 1
            for message in line_messages(text[at : end - 1], line, name, options.tally):
                yield from _message_edges(message, options)
            at = end


def _message_edges(message: Message | FormatError, options: Options) -> Iterator[Edge]:
    """Yield the edges of one message; what is wrong with one of them does not touch the others."""
    if isinstance(message, FormatError):
        options.report(message)
        return
    try:
        found = list(_transforms(message.value, (), options))
    except Misfit as misfit:
        options.report(message.error(misfit))
        return
    numbers = _header_lines(message, len(found))
    topic = messages.topic_of(message.value)
    for (transform, path), line in zip(found, numbers, strict=True):
        if topic and not options.topics.takes(topic):
            continue
        reading = Reading(message.source, normalize=options.normalize)
        try:
            parent, child, components, stamp_ns = _read(transform, reading, options, line, topic)
        except Misfit as misfit:
            options.report(message.error(misfit.below(*path)))
            continue
        edge = Edge(parent, child, components, stamp_ns, line, message.received_ns)
        yield _on_topic(edge, topic, message.source.name, options) if topic else edge


def _on_topic(edge: Edge, topic: str, name: str, options: Options) -> Edge:
    """Keep the topic that an edge came by: what comes by tf_static has no stamp; one frame by two topics is a fault."""
    if problem := options.topics.conflict(topic, edge.child):
        options.report(FormatError(problem, source=name, line=edge.line, column=1, rule="two-topics"))
    return edge._replace(topic=topic, stamp_ns=None if topic.endswith("tf_static") else edge.stamp_ns)


def _read(
    transform: dict[str, Any], reading: Reading, options: Options, line: int, topic: str
) -> tuple[str, str, Rigid, int | None]:
    """Read one transform; notes of rotations that had to be normalised are counted, one sentence for all."""
    if options.raw and "header" in transform:
        from frametool.ros.tf2_input import read_transform

        return read_transform(transform)
    if is_pose(transform):
        found = read_pose(transform, reading, body_of(topic, options.answers))
    else:
        found = messages.read_transform(transform, reading)
    parent, child, position, rotation, stamp_ns = found
    for note in reading.notes:
        options.tally.note(note, line)
    return parent, child, (*position, *rotation), stamp_ns


def _transforms(value: Any, path: Path, options: Options) -> Iterator[tuple[dict[str, Any], Path]]:
    """Yield every transform of a message, or of a list of messages; count messages that hold none.

    A pose counts where its topic was chosen, or where topics are not named.
    """
    if type(value) is list:
        for index, item in enumerate(value):
            yield from _transforms(item, (*path, index), options)
        return
    tally = options.tally
    mapping = as_mapping(value, "a message with transforms")
    enveloped = messages.is_envelope(mapping)
    inner = mapping["msg"] if enveloped else mapping
    topic = messages.topic_of(mapping)
    options.topics.seen.add(topic)
    if is_pose(inner) and (not enveloped or options.topics.chooses(topic)):
        yield inner, (*path, "msg") if enveloped else path
    elif not is_pose(inner) and messages.is_message(inner):
        yield from messages.messages(mapping, path)
    elif "op" in mapping:
        topic = str(mapping.get("topic") or f"op {mapping['op']}")
        tally.others[topic] = tally.others.get(topic, 0) + 1
    else:
        keys = ", ".join(map(shown, list(mapping)[:8]))
        raise Misfit(f"expected a message with transforms, found the keys {keys}", path)


def _header_lines(message: Message, count: int) -> list[int]:
    """Return the lines on which the transforms of a message begin."""
    if message.source.text.count("\n") > 1:
        text = message.source.text
        offsets = [match.start() for match in _HEADER.finditer(text)]
        if len(offsets) == count:
            return [message.line + text.count("\n", 0, offset) for offset in offsets]
    return [message.line] * count
