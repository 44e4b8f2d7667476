"""What forms in YAML and JSON share: each document through one function, what is wrong or odd with its place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import locate_many, parse_documents
from frametool.errors import FormatError, Unanswered, bare
from frametool.formats.tree_reader import without_slashes
from frametool.grammar.readers import Misfit, Reading

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from frametool.documents.input_file import InputFile
    from frametool.documents.source import Source
    from frametool.grammar.edges import Edge, Options, Tally
    from frametool.grammar.readers import Note, Path

    Take = Callable[[Any, Reading], Iterable[Edge]]


class Unclear(Misfit):
    """Report a value whose meaning an option has to tell."""

    def placed(self, source: Source, document: int) -> FormatError:
        """Make the error that names the line and column."""
        return answerable(super().placed(source, document))


def answerable(error: FormatError) -> Unanswered:
    """Make of an error one that an option answers."""
    place = {"source": error.source, "line": error.line, "column": error.column, "snippet": error.snippet}
    return Unanswered(error.message, **place)  # type: ignore[arg-type]


def document_edges(file: InputFile, options: Options, take: Take, tags: Collection[str] = ()) -> Iterator[Edge]:
    """Yield the edges that `take` finds in each document of a file, with their paths from the top of the text.

    take: (value, reading) to edges whose paths begin in the document; raises Misfit, or keeps it with `reading.refuse`.
    tags: of YAML, that the form has.
    Errors go to `options.report`, what is odd to `options.tally`.
    """
    source = file.source
    try:
        documents = parse_documents(source.text, source.name, tags)
    except FormatError as error:
        options.report(error)
        return
    for document in documents:
        reading = Reading(source, normalize=options.normalize)
        reading.faults = []
        try:
            for edge in take(document.value, reading):
                yield without_slashes(edge, reading)._replace(path=(document.index, *edge.path))
        except Misfit as misfit:
            reading.faults.append(misfit)
        for fault in reading.faults:
            placed = fault.placed(source, document.index)
            if isinstance(placed, Unanswered):
                raise placed
            options.report(placed)
        paths = [(document.index, *note.path) for note in reading.notes]
        remember(reading.notes, (line for line, _ in locate_many(source.text, paths)), options.tally)


def remember(notes: Iterable[Note], lines: Iterable[int], tally: Tally) -> None:
    """Keep what was odd, each with its line and behind the keys that lead to it."""
    for note, line in zip(notes, lines, strict=True):
        tally.note_each(f"{bare(dotted(note.path))}: {note.message}" if note.path else note.message, line, note.rule)


def dotted(path: Path) -> str:
    """Name a place in a document by its keys: `cam0.T_cam_imu`."""
    return ".".join(str(step) for step in path)
