"""Files of frames in, one tree out: merges what several files say and names the places where they disagree."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.collector import paused_collector
from frametool.documents.document import format_error, locate, locate_many
from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, alternatives
from frametool.formats import readers
from frametool.formats.assembly import Assembly, Rules
from frametool.formats.recordings import Recording, close_all, opened_together, refuse_unknown_joints
from frametool.grammar.edges import Answers, Samples

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from frametool.formats.assembly import Place
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree
    from frametool.grammar.edges import Edge


class EdgePlace(NamedTuple):
    """Where an edge was read."""

    file: Recording
    edge: Edge

    def error(self, message: str, kind: type[FormatError]) -> FormatError:
        """Make the error for this place."""
        if self.edge.path:
            return format_error(self.file.source, self.edge.path, message, error=kind)
        return kind(message, source=self.file.name, line=self.edge.line)

    def seen_from(self, other: Place) -> str:
        """Return `line 7`, or `other.yaml:7` beside a place in another file."""
        line = locate(self.file.text, self.edge.path)[0] if self.edge.path else self.edge.line
        same = isinstance(other, EdgePlace) and other.file.name == self.file.name
        return f"line {line}" if same else f"{self.file.name}:{line}"


class SamplesOfFile(NamedTuple):
    """Poses of one frame, and the file they were read from."""

    file: Recording
    samples: Samples

    def place(self, at: int) -> EdgePlace:
        """Return where one of them was read."""
        return EdgePlace(self.file, self.samples.edge(at))


def load(
    *paths: str | PathLike[str],
    moving: bool = False,
    policy: str = "frametool",
    keep_ns: int | None = None,
    normalize: bool = False,
    topics: Iterable[str] = (),
    format: str | None = None,  # noqa: A002 - what it is
    joints: Mapping[str, float | str] | str | PathLike[str] | None = None,
    frames: Sequence[str] = (),
    **answers: Any,
) -> FrameTree | TransformBuffer:
    """Read one or several files of frames and merge them: a FrameTree, or a TransformBuffer if anything moves.

    paths: files in any form that `frametool.FORMATS` reads a tree from; `-` is standard input.  format: its name there.
    moving: an edge with a single stamp answers only that instant; otherwise it counts as standing.
    policy, keep_ns: as TransformBuffer has them.  topics: those of a recording that are read  [default: all].
    normalize: take any non-zero quaternion and any matrix near a rotation.
    joints: values by name (radians, metres, or text with a unit), or a file of them.  frames: names of those that a
    form does not name, as (world, body).  answers: direction, camera_axes, dh, stamps as in `frametool.formats`.
    Raises FormatError, Unanswered and BadTopology with file, line and column; FileProblem.
    """
    rules = Rules(moving=moving, policy=policy, keep_ns=keep_ns, normalize=normalize)
    chosen = tuple(topics)
    if format is not None and format not in readers("tree"):
        raise ValueInvalid(f"no trees are read from {format!r}{alternatives(format, readers('tree'), 'forms')}")
    given = {} if joints is None or isinstance(joints, str | PathLike) else joints
    values = {name: value if isinstance(value, str) else repr(float(value)) for name, value in given.items()}
    joint_files = () if joints is None or given is joints else (str(joints),)
    known = Answers(tuple(frames), joints=values, joint_files=joint_files, **answers)
    files = (Recording(path, form=format, topics=chosen, answers=known) for path in paths)
    return load_sources(opened_together(files), rules)


def load_sources(
    sources: Sequence[Source | Recording], rules: Rules | None = None, places: dict[str, Place] | None = None
) -> FrameTree | TransformBuffer:
    """Merge the frames of several texts and files; otherwise as `load`.

    places: is filled with where each frame was first said to hang from its parent
    """
    assembly = Assembly(", ".join(source.name for source in sources), rules)
    try:
        with paused_collector():
            files = [Recording.inline(source) if isinstance(source, Source) else source for source in sources]
            for file in files:
                _add(assembly, file)
            refuse_unknown_joints(files)
            tree = assembly.finish()
    finally:
        close_all(sources)
    if places is not None:
        places |= assembly.places
    return tree


def lines_of(places: Sequence[Place]) -> list[tuple[str, int]]:
    """Return file and line of many places, each file walked once; 0 where a line says nothing."""
    edges = [place for place in places if isinstance(place, EdgePlace)]
    lines: dict[int, int] = {}
    for file in {id(each.file): each.file for each in edges}.values():
        inside = [each for each in edges if each.file is file and each.edge.path]
        found = locate_many(file.text, [each.edge.path for each in inside]) if inside else []
        lines |= {id(each): line for each, (line, _) in zip(inside, found, strict=True)}
    return [(each.file.name, lines.get(id(each), each.edge.line)) for each in edges]


def _add(assembly: Assembly, file: Recording) -> None:
    piece = None
    rules = assembly.rules
    for piece in file.pieces(raw=rules.policy != "frametool", normalize=rules.normalize):
        if isinstance(piece, Samples):
            assembly.add_samples(SamplesOfFile(file, piece))
        elif piece.parent is None:
            assembly.add_root(piece.child)
        else:
            assembly.add(piece.parent, piece.child, piece.components, piece.stamp_ns, EdgePlace(file, piece))
    if piece is None:
        raise FormatError("no frames in it", source=file.name)
    assembly.axes |= file.tally.axes
