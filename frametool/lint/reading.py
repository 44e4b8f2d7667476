"""Trees and recordings read for `check`: what is wrong with one entry does not hide the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import locate_many, parse_documents
from frametool.errors import FormatError
from frametool.formats.tree_reader import read_edges, without_slashes
from frametool.grammar.readers import Misfit, Note, Reading
from frametool.lint.findings import Finding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from frametool.documents.source import Source
    from frametool.formats.recordings import Recording
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Path

    Find = Callable[[Finding], None]

WRITTEN_XYZW = frozenset(("quaternion", "xyzw", "rotation", "orientation", "transform"))


class Seen(NamedTuple):
    """An edge, or one sample of it, and where it stands; `looks_w_first` if it was written x, y, z, w with x = 1."""

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


def read_all(recording: Recording, find: Find) -> Iterator[Seen]:
    """Yield everything that can be read of a file, and report what cannot."""
    if recording.holds_samples:
        yield from _read_recording(recording, find)
    else:
        yield from _read_tree(recording.source, find)


def _read_recording(recording: Recording, find: Find) -> Iterator[Seen]:
    def report(error: FormatError) -> None:
        find(Finding(error.rule or "syntax", error.message, error.source, error.line, error.column))

    for sample in recording.edges(report, tell=False):
        w_first = looks_w_first(sample.components)
        column = 1 if sample.line else 0
        yield Seen(sample.parent or "", *sample[1:4], recording.name, sample.line, column, w_first)
    for told in recording.tally.told():
        find(Finding(told.rule, told.message, recording.name, told.line, 1))


def looks_w_first(components: Rigid) -> bool:
    """Tell the rotation that the identity becomes when w is written first and read last."""
    x, y, z, w = components[3:]
    return bool(abs(x) == 1.0 and y == z == w == 0.0)


class _Entry(NamedTuple):
    """A document with one entry of a larger one; paths that begin with `here` stand at `there` in that one."""

    value: Any
    here: Path
    there: Path

    def place(self, path: Path) -> Path:
        """Return the path in the larger document."""
        return (*self.there, *path[len(self.here) :])


def _read_tree(source: Source, find: Find) -> Iterator[Seen]:
    """Read a tree entry by entry; places are looked up once, for all of them."""
    try:
        documents = parse_documents(source.text, source.name)
    except FormatError as error:
        find(Finding("syntax", error.message, source.name, error.line, error.column))
        return
    said: list[Note] = []
    edges: list[tuple[Any, Path, bool]] = []
    for document in documents:
        for entry in _entries(document.value):
            _read_entry(entry, document.index, source, said, edges)
    places = locate_many(source.text, [path for _, _, path in said] + [path for _, path, _ in edges])
    for (rule, message, _), (line, column) in zip(said, places, strict=False):
        find(Finding(rule, message, source.name, line, column))
    for (edge, _, w_first), (line, column) in zip(edges, places[len(said) :], strict=True):
        yield Seen(edge.parent, edge.child, edge.components, edge.stamp_ns, source.name, line, column, w_first)


def _read_entry(
    entry: _Entry, document: int, source: Source,
    said: list[Note], edges: list[tuple[Any, Path, bool]],
) -> None:  # fmt: skip
    """Read one entry; what it gives and what is to be said of it is kept with its path."""
    reading = Reading(source)
    try:
        for found in read_edges(entry.value, reading):
            edge = without_slashes(found, reading)
            if edge.parent is not None:
                path = (document, *entry.place(edge.path))
                edges.append((edge, path, _written_w_first(entry, edge)))
    except Misfit as misfit:
        said.append(Note(misfit.rule or "syntax", str(misfit), (document, *entry.place(misfit.path))))
    said += [note._replace(path=(document, *entry.place(note.path))) for note in reading.notes]


def _written_w_first(entry: _Entry, edge: Any) -> bool:
    """Tell what looks like a quaternion with w first from half a turn that was written as angles."""
    value = entry.value
    for step in edge.path:
        value = value[step]
    return looks_w_first(edge.components) and type(value) is dict and not WRITTEN_XYZW.isdisjoint(value)


def _entries(value: Any) -> Iterator[_Entry]:
    """Take a document apart into documents with one entry each."""
    if type(value) is list:
        yield from (_Entry([item], (0,), (index,)) for index, item in enumerate(value))
        return
    if type(value) is dict:
        for key in ("frames", "transforms", "static_transforms"):
            if type(value.get(key)) is list and value[key]:
                yield from (
                    _Entry({**value, key: [item]}, (key, 0), (key, index)) for index, item in enumerate(value[key])
                )
                return
        if type(value.get("frames")) is dict:
            yield from _nested(value)
            return
    yield _Entry(value, (), ())


def _nested(value: dict[str, Any]) -> Iterator[_Entry]:
    """Walk a nested tree: each frame with its parent, without its children."""
    about = {key: each for key, each in value.items() if key != "frames"}
    roots = value["frames"].items()
    pending: list[tuple[str, Any, Path]] = [(root, children, ("frames", root)) for root, children in roots]
    for parent, children, path in pending:
        if type(children) is not dict:
            if children is not None:
                yield _Entry({**about, "frames": {parent: children}}, ("frames", parent), path)
            continue
        for child, entry in children.items():
            there = (*path, child)
            alone = {key: each for key, each in entry.items() if key != "children"} if type(entry) is dict else entry
            yield _Entry({**about, "frames": {parent: {child: alone}}}, ("frames", parent, child), there)
            if type(entry) is dict and "children" in entry:
                pending.append((child, entry["children"], (*there, "children")))
