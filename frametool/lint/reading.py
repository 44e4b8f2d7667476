"""Trees and recordings read for `check`: what is wrong with one entry does not hide the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import locate_many, parse_documents
from frametool.errors import FormatError, Unanswered
from frametool.formats.tree_reader import read_edges, without_slashes
from frametool.grammar.readers import Misfit, Note, Reading
from frametool.lint.findings import Finding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.documents.document import Document
    from frametool.documents.source import Source
    from frametool.formats.recordings import Recording
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Edge

    Find = Callable[[Finding], None]

WRITTEN_XYZW = frozenset(("quaternion", "xyzw", "rotation", "orientation", "transform"))


class Statement(NamedTuple):
    """An edge, or one sample of it, and where it stands.

    looks_w_first: it was written x, y, z, w with x = 1
    """

    parent: str
    child: str
    components: Rigid
    stamp_ns: int | None
    source: str
    line: int
    column: int
    looks_w_first: bool

    def finding(self, rule: str, message: str) -> Finding:
        """Make a finding for this place."""
        return Finding(rule, message, self.source, self.line, self.column)


def read_all(recording: Recording, find: Find, *, normalize: bool = False) -> Iterator[Statement]:
    """Yield everything that can be read of a file, and report what cannot."""
    if recording.holds_samples:
        yield from _read_recording(recording, find, normalize=normalize)
    else:
        yield from _read_tree(recording.source, find, normalize=normalize)


def _read_recording(recording: Recording, find: Find, *, normalize: bool) -> Iterator[Statement]:
    def report(error: FormatError) -> None:
        find(Finding(error.rule or "syntax", error.message, error.source, error.line, error.column))

    in_documents = []
    try:
        for edge in recording.edges(report, tell=False, normalize=normalize):
            if edge.path:
                in_documents.append(edge)
            elif edge.parent is not None:
                yield _stated(edge, recording.name, edge.line, 1 if edge.line else 0)
    except Unanswered:
        raise
    except FormatError as error:  # behind which nothing can be read
        report(error)
    places = locate_many(recording.text, [edge.path for edge in in_documents]) if in_documents else []
    for edge, (line, column) in zip(in_documents, places, strict=True):
        if edge.parent is not None:
            # here matrices and angles are written, and quaternions by names or always w first
            yield _stated(edge, recording.name, line, column)._replace(looks_w_first=False)
    if counts := recording.topics.counts:
        listed = ", ".join(f"{topic} ({count})" for topic, count in counts.items())
        find(Finding("topics", f"transforms on {listed}", recording.name, 1, 1))
    for told in recording.tally.told():
        find(Finding(told.rule, told.message, recording.name, told.line, 1))


def _stated(edge: Edge, source: str, line: int, column: int) -> Statement:
    return Statement(edge.parent or "", *edge[1:4], source, line, column, looks_w_first(edge.components))


def looks_w_first(components: Rigid) -> bool:
    """Return whether a rotation is what the identity becomes when w is written first and read last."""
    x, y, z, w = components[3:]
    return bool(abs(x) == 1.0 and y == z == w == 0.0)


def _read_tree(source: Source, find: Find, *, normalize: bool) -> Iterator[Statement]:
    """Read a tree; places are looked up once, for all that was found and read."""
    try:
        documents = parse_documents(source.text, source.name)
    except FormatError as error:
        find(Finding("syntax", error.message, source.name, error.line, error.column))
        return
    said: list[Note] = []
    edges = []
    for document in documents:
        edges += _read_document(document, Reading(source, normalize=normalize), said)
    places = locate_many(source.text, [*(note.path for note in said), *(edge.path for edge, _ in edges)])
    for note, (line, column) in zip(said, places, strict=False):
        find(Finding(note.rule, note.message, source.name, line, column))
    for (edge, w_first), place in zip(edges, places[len(said) :], strict=True):
        yield Statement(edge.parent or "", *edge[1:4], source.name, *place, w_first)


def _read_document(document: Document, reading: Reading, said: list[Note]) -> list[tuple[Edge, bool]]:
    """Return the edges of a document, each with whether it looks written w first; keep what is to be said."""
    reading.faults = []
    edges = []
    try:
        for found in read_edges(document.value, reading):
            edge = without_slashes(found, reading)
            if edge.parent is not None:
                w_first = looks_w_first(edge.components) and _written_xyzw(document.value, edge)
                edges.append((edge._replace(path=(document.index, *edge.path)), w_first))
    except Misfit as misfit:
        reading.faults.append(misfit)
    faults = (Note(misfit.rule or "syntax", str(misfit), misfit.path) for misfit in reading.faults)
    said += [note._replace(path=(document.index, *note.path)) for note in (*faults, *reading.notes)]
    return edges


def _written_xyzw(value: Any, edge: Edge) -> bool:
    """Return whether an edge's rotation was written as a quaternion, not as angles."""
    for step in edge.path:
        value = value[step]
    return type(value) is dict and not WRITTEN_XYZW.isdisjoint(value)
