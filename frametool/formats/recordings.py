"""Recordings of transforms: files, bags and standard input, read as a stream of samples in bounded memory."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, Any

from frametool.documents.chunks import Piece, documents, lines
from frametool.documents.source import MOST_CHARACTERS, Source, decode, read_text
from frametool.errors import FileProblem, FormatError, ValueInvalid, warn
from frametool.formats.detect import BAGS, FORMS, HEAD, detect
from frametool.grammar.readers import Misfit, Reading, as_mapping
from frametool.ros import messages
from frametool.ros.message_stream import Message, document_messages, end_of_document, read_messages
from frametool.ros.samples import Sample, Tally

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from os import PathLike
    from typing import BinaryIO

    from frametool.grammar.readers import Path
    from frametool.ros.samples import Components

    Report = Callable[[FormatError], None]

_HEADER = re.compile(r"\bheader\b")


class Recording:
    """A file that was opened and looked at: its name for messages, its form, its bytes."""

    def __init__(self, path: str | PathLike[str], stream: BinaryIO | None = None) -> None:
        """Open a file, a bag's folder, or standard input for `-`, and detect its form.

        stream: what was opened already, with nothing of it read.  Raises FileProblem.
        """
        self.path = str(path)
        self.name = "stdin" if self.path == "-" else self.path
        self.form = "bag2"
        self.tally = Tally()
        self.raw = False
        self.stream: BinaryIO | None = None
        if not _is_bag_folder(self.path):
            self.stream = stream or _opened(self.path)
            self.form = detect(self.stream.peek(HEAD)[:HEAD])  # type: ignore[attr-defined]

    @property
    def holds_samples(self) -> bool:
        """Tell a recording from a tree in YAML or JSON."""
        return self.form != "tree"

    @property
    def described(self) -> str:
        """Say what the file was taken for."""
        return f"{self.name}: {FORMS[self.form]}"

    def text(self) -> str:
        """Return the whole text of a tree."""
        if self.stream is None or self.path != "-":
            self.close()
            return read_text(self.path)
        return decode(self.stream.read(4 * MOST_CHARACTERS + 1), self.name)

    def close(self) -> None:
        """Let go of a file; standard input stays open."""
        if self.stream is not None and self.path != "-":
            self.stream.close()

    def samples(self, report: Report | None = None, *, tell: bool = True, raw: bool = False) -> Iterator[Sample]:
        """Yield the samples in the order they were recorded, then warn of what was odd.

        report: takes the errors, and reading goes on behind them; without it the first one is raised.
        tell: without it what was odd is only kept, in `tally`.  raw: messages in text as tf2 receives them, unchecked.
        """
        self.raw = raw
        try:
            yield from _samples(self, report or _raise)
        finally:
            self.close()
        for told in self.tally.told() if tell else ():
            warn(f"{self.name}:{told.line}: {told.message}")


def samples_of(recording: Recording, report: Report | None = None) -> Iterator[Sample]:
    """Yield what a recording or a tree holds as samples; the frames of a tree that stands still have no stamp."""
    if recording.holds_samples:
        yield from recording.samples(report)
        return
    from frametool.formats.load import edges_of

    for found in edges_of(Source(recording.name, recording.text())):
        edge = found.edge
        if edge.parent is not None:
            yield Sample(edge.parent, edge.child, edge.pose.components, edge.stamp_ns)


def open_messages(path: str, stream: BinaryIO) -> Recording | None:
    """Take a stream that begins with a ROS message, as text or JSON lines; None for any other, nothing of it read."""
    head = stream.peek(HEAD)[:HEAD]  # type: ignore[attr-defined]
    return Recording(path, stream) if detect(head) in ("echo", "jsonl") else None


def _raise(error: FormatError) -> None:
    raise error


def _is_bag_folder(path: str) -> bool:
    """Tell the folder that ROS 2 records into."""
    import os

    return os.path.isdir(path) and os.path.exists(os.path.join(path, "metadata.yaml"))


def _opened(path: str) -> BinaryIO:
    """Open for reading with a buffer that can be looked into."""
    import io

    if path == "-":
        if sys.stdin is None:
            raise FileProblem("standard input is closed")
        stdin = sys.stdin.buffer
        return stdin if hasattr(stdin, "peek") else io.BufferedReader(stdin)  # type: ignore[type-var]
    try:
        return open(path, "rb", buffering=HEAD)
    except OSError as error:
        raise FileProblem(f"{path}: {(error.strerror or str(error)).lower()}") from None
    except ValueError as error:
        raise FileProblem(f"{path!r} is no file name: {error}") from None


def _samples(recording: Recording, report: Report) -> Iterator[Sample]:
    """Choose the reader."""
    if recording.form in BAGS:
        from frametool.ros.bags import read_bag

        try:
            yield from read_bag(recording.path, recording.tally)
        except FormatError as error:
            report(error)
        return
    if recording.stream is not None and recording.form == "echo":
        for piece in documents(recording.stream, recording.name):
            yield from _echo(piece, recording, report)
    elif recording.stream is not None and recording.form == "calls":
        for piece in lines(recording.stream, recording.name):
            yield from _calls(piece, recording, report)
    elif recording.stream is not None:
        for message in read_messages(recording.stream, recording.name, recording.form, recording.tally):
            yield from _message_samples(message, recording, report)


def _echo(piece: Piece, recording: Recording, report: Report) -> Iterator[Sample]:
    """Read plain documents fast and the others in full."""
    from frametool.ros.echo_blocks import Blocks

    blocks = Blocks(piece.text, piece.line, recording.tally)
    while True:
        if not recording.raw:
            yield from blocks.samples()
        if blocks.at >= len(piece.text):
            return
        text = piece.text[blocks.at : end_of_document(piece.text, blocks.at)]
        for message in document_messages(Piece(text, blocks.line), recording.name, recording.tally):
            yield from _message_samples(message, recording, report)
        blocks.at += len(text)
        blocks.line += text.count("\n")


def _calls(piece: Piece, recording: Recording, report: Report) -> Iterator[Sample]:
    """Read one call of static_transform_publisher from each line."""
    from frametool.ros.publisher import read_call

    for number, line in enumerate(piece.text.split("\n"), piece.line):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        reading = Reading(Source(recording.name, line))
        try:
            pose = read_call(line, reading)
        except ValueInvalid as error:
            report(FormatError(str(error), source=recording.name, line=number, rule=error.rule))
            continue
        for note in reading.notes:
            recording.tally.note(note, number)
        yield Sample(pose.parent or "", pose.name or "", pose.components, None, number)


def _message_samples(message: Message | FormatError, recording: Recording, report: Report) -> Iterator[Sample]:
    """Yield the samples of one message; what is wrong with one of them does not touch the others."""
    if isinstance(message, FormatError):
        report(message)
        return
    try:
        found = list(_transforms(message.value, (), recording.tally))
    except Misfit as misfit:
        report(message.error(misfit))
        return
    numbers = _header_lines(message, len(found))
    still = messages.topic_of(message.value).endswith("tf_static")
    for (transform, path), line in zip(found, numbers, strict=True):
        reading = Reading(message.source)
        try:
            parent, child, components, stamp_ns = _read(transform, reading, recording, line)
        except Misfit as misfit:
            report(message.error(misfit.below(*path)))
            continue
        yield Sample(parent, child, components, None if still else stamp_ns, line, message.received_ns)


def _read(
    transform: dict[str, Any], reading: Reading, recording: Recording, line: int
) -> tuple[str, str, Components, int | None]:
    """Read one transform; notes of rotations that had to be normalised are counted, one sentence for all."""
    if recording.raw and "header" in transform:
        from frametool.ros.tf2_input import read_transform

        return read_transform(transform)
    parent, child, position, rotation, stamp_ns = messages.read_transform(transform, reading)
    for note in reading.notes:
        recording.tally.note(note, line)
    return parent, child, (*position, *rotation), stamp_ns


def _transforms(value: Any, path: Path, tally: Tally) -> Iterator[tuple[dict[str, Any], Path]]:
    """Yield every transform of a message, or of a list of messages; count messages that hold none."""
    if type(value) is list:
        for index, item in enumerate(value):
            yield from _transforms(item, (*path, index), tally)
        return
    mapping = as_mapping(value, "a message with transforms")
    inner = mapping["msg"] if messages.is_envelope(mapping) else mapping
    if messages.is_message(inner):
        yield from messages.messages(mapping, path)
    elif "op" in mapping:
        topic = str(mapping.get("topic") or f"op {mapping['op']}")
        tally.others[topic] = tally.others.get(topic, 0) + 1
    else:
        keys = ", ".join(map(repr, list(mapping)[:8]))
        raise Misfit(f"expected a message with transforms, found the keys {keys}", path)


def _header_lines(message: Message, count: int) -> list[int]:
    """Return the lines on which the transforms of a message begin."""
    if message.source.text.count("\n") > 1:
        text = message.source.text
        offsets = [match.start() for match in _HEADER.finditer(text)]
        if len(offsets) == count:
            return [message.line + text.count("\n", 0, offset) for offset in offsets]
    return [message.line] * count
