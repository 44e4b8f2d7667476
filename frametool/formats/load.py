"""Files of frames in, one tree out: merges what several files say and names the places where they disagree."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import BadTopology, FormatError, warn
from frametool.formats.documents import Source, format_error, locate_many, parse_documents, read_text
from frametool.formats.trees import read_edges
from frametool.formats.values import Misfit, Reading
from frametool.frames.tree import FrameTree

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from os import PathLike

    from frametool.formats.trees import Edge
    from frametool.formats.values import Path


class Found(NamedTuple):
    """An edge and where it was read."""

    edge: Edge
    source: Source
    document: int

    @property
    def path(self) -> Path:
        """Give the path that leads to it from the top of its source."""
        return (self.document, *self.edge.path)


def load(*paths: str | PathLike[str]) -> FrameTree:
    """Read one or several files of frames and merge them into one tree.

    paths: YAML or JSON in the forms of `frametool.formats.trees`; `-` is standard input.
    Raises FormatError and BadTopology with file, line and column; FileProblem.
    """
    return load_sources([Source("stdin" if str(path) == "-" else str(path), read_text(path)) for path in paths])


def load_sources(sources: Sequence[Source]) -> FrameTree:
    """Merge the frames of several texts into one tree; otherwise as `load`."""
    tree = FrameTree(", ".join(source.name for source in sources))
    first: dict[str, Found] = {}
    for source in sources:
        for found in edges_of(source):
            _hang(tree, first, found)
    return tree


def edges_of(source: Source) -> Iterator[Found]:
    """Read the edges of one text, then tell what was odd about it."""
    notes = []
    count = 0
    for document in parse_documents(source.text, source.name):
        reading = Reading(source)
        try:
            for edge in read_edges(document.value, reading):
                count += 1
                yield Found(_without_slashes(edge, reading), source, document.index)
        except Misfit as misfit:
            raise format_error(source, (document.index, *misfit.path), str(misfit), key=misfit.key) from None
        notes += [((document.index, *path), message) for path, message in reading.notes]
    if not count:
        raise FormatError("no frames in it", source=source.name)
    tell(source, notes)


def _without_slashes(edge: Edge, reading: Reading) -> Edge:
    """Take one leading `/` off the names, which tf2 has given up, and say so."""
    for name in (edge.child, edge.parent):
        if name is not None and name.startswith("/") and len(name) > 1:
            reading.here = edge.path
            reading.note(f"frame {name!r}: the leading / is no part of a name and was left out")
    parent = edge.parent and (edge.parent.removeprefix("/") or edge.parent)
    return edge._replace(child=edge.child.removeprefix("/") or edge.child, parent=parent)


def tell(source: Source, notes: list[tuple[Path, str]], most: int = 10) -> None:
    """Warn of what was noted while reading, each with its place; only count what exceeds `most`."""
    places = locate_many(source.text, [path for path, _ in notes[:most]])
    for (line, column), (_, message) in zip(places, notes[:most], strict=True):
        warn(f"{source.name}:{line}:{column}: {message}")
    if len(notes) > most:
        warn(f"{source.name}: {len(notes) - most} more like these")


def _hang(tree: FrameTree, first: dict[str, Found], found: Found) -> None:
    """Add what was found to the tree, or say where it clashes with what was there."""
    edge = found.edge
    if edge.parent is None:
        tree.add_root(edge.child)
        return
    earlier = first.setdefault(edge.child, found)
    if earlier is not found and edge.stamp_ns != earlier.edge.stamp_ns and edge.parent == earlier.edge.parent:
        message = f"frame {edge.child!r} moves: its stamps differ; only trees that stand still are read"
        raise format_error(found.source, found.path, message)
    try:
        tree.add_components(edge.parent, edge.child, edge.pose.components)
    except BadTopology as error:
        message = str(error) if earlier is found else _clash(earlier, found)
        raise format_error(found.source, found.path, message, error=BadTopology) from None


def _clash(earlier: Found, found: Found) -> str:
    """Say what two edges disagree about, and where each stands."""
    child = earlier.edge.child
    places = [_place(each, found.source) for each in (earlier, found)]
    if earlier.edge.parent == found.edge.parent:
        return f"frame {child!r} has two different poses in {earlier.edge.parent!r}: {places[0]} and {places[1]}"
    parents = [f"{each.edge.parent!r} ({place})" for each, place in zip((earlier, found), places, strict=True)]
    return f"frame {child!r} has two parents: {' and '.join(parents)}"


def _place(found: Found, here: Source) -> str:
    """Give `line 7`, or `other.yaml:7` in another source."""
    line, _ = locate_many(found.source.text, [found.path])[0]
    return f"line {line}" if found.source.name == here.name else f"{found.source.name}:{line}"
