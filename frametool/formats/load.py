"""Files of frames in, one tree out: merges what several files say and names the places where they disagree."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.documents.collector import paused_collector
from frametool.documents.document import format_error, locate_many, parse_documents
from frametool.documents.source import Source, read_text
from frametool.errors import FormatError, warn
from frametool.formats.assembly import Assembly, Rules
from frametool.formats.tree_reader import read_edges
from frametool.grammar.readers import Misfit, Reading
from frametool.ros.message_parts import slash_note

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from os import PathLike

    from frametool.formats.assembly import Place
    from frametool.formats.recordings import Recording
    from frametool.formats.tree_reader import Edge
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree
    from frametool.grammar.readers import Note, Path


class Found(NamedTuple):
    """An edge and where it was read."""

    edge: Edge
    source: Source
    document: int

    @property
    def path(self) -> Path:
        """Return the path that leads to it from the top of its source."""
        return (self.document, *self.edge.path)

    def error(self, message: str, kind: type[FormatError]) -> FormatError:
        """Make the error for its place."""
        return format_error(self.source, self.path, message, error=kind)

    def seen_from(self, other: Place) -> str:
        """Return `line 7`, or `other.yaml:7` beside a place in another source."""
        line, _ = locate_many(self.source.text, [self.path])[0]
        same = isinstance(other, Found) and other.source.name == self.source.name
        return f"line {line}" if same else f"{self.source.name}:{line}"


def load(
    *paths: str | PathLike[str], moving: bool = False, policy: str = "frametool", keep_ns: int | None = None
) -> FrameTree | TransformBuffer:
    """Read one or several files of frames and merge them: a FrameTree, or a TransformBuffer if anything moves.

    paths: trees in YAML or JSON (`frametool.formats.tree_reader`) and recordings (`frametool.formats.detect`); `-` is
    standard input.
    moving: an edge with a single stamp answers only that instant; otherwise it counts as standing.
    policy, keep_ns: as TransformBuffer has them.
    Raises FormatError and BadTopology with file, line and column; FileProblem.
    """
    return load_sources([open_source(path) for path in paths], Rules(moving=moving, policy=policy, keep_ns=keep_ns))


def open_source(path: str | PathLike[str]) -> Source | Recording:
    """Open a file, a bag's folder or, for `-`, standard input; what is no recording is read whole.

    Raises FileProblem, and FormatError for what is no text.
    """
    if _is_plainly_tree(str(path)):
        return Source(str(path), read_text(path))
    from frametool.formats.recordings import Recording

    recording = Recording(path)
    return recording if recording.holds_samples else Source(recording.name, recording.text())


def _is_plainly_tree(path: str) -> bool:
    """Tell a tree from what its first bytes say, without loading the readers of recordings (10 ms)."""
    try:
        with open(path, "rb") as stream:
            head = stream.read(4096)
    except (OSError, ValueError):
        return False
    return head.startswith((b"frames:", b'{"frames"')) or b"\nframes:" in head


def load_sources(sources: Sequence[Source | Recording], rules: Rules | None = None) -> FrameTree | TransformBuffer:
    """Merge the frames of several texts and recordings; otherwise as `load`."""
    assembly = Assembly(", ".join(source.name for source in sources), rules)
    raw = assembly.rules.policy != "frametool"
    with paused_collector():
        for source in sources:
            if isinstance(source, Source):
                _add_tree(assembly, source, raw=raw)
            else:
                _add_recording(assembly, source, raw=raw)
        return assembly.finish()


def _add_tree(assembly: Assembly, source: Source, *, raw: bool) -> None:
    for found in edges_of(source, raw=raw):
        edge = found.edge
        if edge.parent is None:
            assembly.add_root(edge.child)
        else:
            assembly.add(edge.parent, edge.child, edge.pose.components, edge.stamp_ns, found)


def _add_recording(assembly: Assembly, recording: Recording, *, raw: bool) -> None:
    sample = None
    for sample in recording.samples(raw=raw):
        spot = Spot(recording.name, sample.line)
        assembly.add(sample.parent, sample.child, sample.components, sample.stamp_ns, spot)
    if sample is None:
        raise FormatError("no frames in it", source=recording.name)


class Spot(NamedTuple):
    """A line of a recording."""

    source: str
    line: int

    def error(self, message: str, kind: type[FormatError]) -> FormatError:
        """Make the error for this line."""
        return kind(message, source=self.source, line=self.line)

    def seen_from(self, other: Place) -> str:
        """Return `line 7`, or `tf.txt:7` beside a place in another file."""
        same = isinstance(other, Spot) and other.source == self.source
        return f"line {self.line}" if same else f"{self.source}:{self.line}"


def edges_of(source: Source, *, raw: bool = False) -> Iterator[Found]:
    """Read the edges of one text, then tell what was odd about it; raw: messages as tf2 receives them."""
    notes: list[Note] = []
    count = 0
    for document in parse_documents(source.text, source.name):
        reading = Reading(source, raw=raw)
        try:
            for edge in read_edges(document.value, reading):
                count += 1
                yield Found(edge if raw else without_slashes(edge, reading), source, document.index)
        except Misfit as misfit:
            raise misfit.placed(source, document.index) from None
        notes += [note._replace(path=(document.index, *note.path)) for note in reading.notes]
    if not count:
        raise FormatError("no frames in it", source=source.name)
    tell(source, notes)


def without_slashes(edge: Edge, reading: Reading) -> Edge:
    """Take one leading `/` off the names, which tf2 has given up, and say so."""
    if edge.child[0] != "/" and (edge.parent or "")[:1] != "/":
        return edge
    for name in (edge.child, edge.parent):
        if name is not None and name.startswith("/") and len(name) > 1:
            reading.here = edge.path
            reading.note(slash_note(name), rule="slash")
    parent = edge.parent and (edge.parent.removeprefix("/") or edge.parent)
    return edge._replace(child=edge.child.removeprefix("/") or edge.child, parent=parent)


def tell(source: Source, notes: list[Note], most: int = 10) -> None:
    """Warn of what was noted while reading, each with its place; only count what exceeds `most`."""
    places = locate_many(source.text, [note.path for note in notes[:most]])
    for (line, column), note in zip(places, notes[:most], strict=True):
        warn(f"{source.name}:{line}:{column}: {note.message}")
    if len(notes) > most:
        warn(f"{source.name}: {len(notes) - most} more like these")
