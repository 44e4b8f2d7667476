"""The content of a file of frames: edges, and diagnostics about the file."""

from __future__ import annotations

from itertools import repeat
from types import MappingProxyType
from typing import Any

from frametool.errors import Finding, FormatError, NamedTuple, listing, shown
from frametool.grammar.readers import Path, is_slashed, slash_note

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from frametool.geometry import Components, Rigid
    from frametool.geometry.camera import Camera

    Report = Callable[[FormatError], None]


class Edge(NamedTuple):
    """The pose of `child` in `parent`: parent_from_child, static or at one time.

    parent: None for a root
    components: tx, ty, tz (metres), x, y, z, w (unit)
    stamp_ns: None if static
    line: line number in the file, 0 if unknown
    received_ns: the time at which the recorder received it, if known
    path: the keys that lead to it in a document
    topic: the topic on which it was published, if known
    covariance: 36 entries as in `geometry.uncertainty`, the same for all samples of a frame; None: exact
    camera: the camera of the child, if its entry has one
    """

    parent: str | None
    child: str
    components: Rigid
    stamp_ns: int | None = None
    line: int = 0
    received_ns: int | None = None
    path: Path = ()
    topic: str = ""
    covariance: Components | None = None
    camera: Camera | None = None


class EdgeColumns(NamedTuple):
    """Edges, column by column, in the order of the file: all moving, or all static.

    is_ordered: the stamps should be in order, as in a trajectory; those of a recording need not be
    """

    parents: Sequence[str]
    children: Sequence[str]
    stamps_ns: Sequence[int | None]
    components: Sequence[Rigid]
    lines: Sequence[int]
    topics: Iterable[str] = ()
    received_ns: Iterable[int | None] = ()
    is_ordered: bool = False

    def edges(self) -> Iterator[Edge]:
        """Yield the rows as edges."""
        parents, children, stamps_ns, components, lines, topics, received_ns, _ = self
        return map(
            Edge, parents, children, components, stamps_ns, lines, received_ns or repeat(None), repeat(()),
            topics or repeat(""),
        )  # fmt: skip


def at_other_times(piece: Edge | EdgeColumns, offset_ns: int) -> Edge | EdgeColumns:
    """Return a piece of a file with an offset added to its stamps."""
    if isinstance(piece, Edge):
        return piece if piece.stamp_ns is None else piece._replace(stamp_ns=piece.stamp_ns + offset_ns)
    return piece._replace(stamps_ns=[None if stamp is None else stamp + offset_ns for stamp in piece.stamps_ns])


def stop(error: FormatError) -> None:
    """Raise an error: the default reaction of a reader."""
    raise error


class Names(dict[str, str]):
    """Frame names by their text: without quotes and one leading `/`; each is parsed once."""

    def __init__(self, note: Callable[..., None] | None = None) -> None:
        """Create an empty table; note: receives the warning about a name that began with `/`, as `Diagnostics.note`."""
        super().__init__()
        self._note = note

    def __missing__(self, text: str) -> str:
        """Parse a name; "" for a text that YAML takes for null, which is not a name."""
        name = text[1:-1].replace("''", "'") if text[0] in "\"'" else text
        self[text] = "" if text in {"null", "Null", "NULL"} else self.bare(name)
        return self[text]

    def bare(self, name: str) -> str:
        """Remove one leading `/`, as tf2 does, and record it."""
        if not is_slashed(name):
            return name
        if self._note is not None:
            self._note(slash_note(name), 1, "slash")
        return name[1:]


class Diagnostics:
    """Diagnostics about a file: collected while it is read, emitted at the end."""

    def __init__(self) -> None:
        """Create empty diagnostics; `rough` and `noise` hold line numbers, `others` counts by topic.

        assumed: what was assumed because the file does not state it, with the option that sets it; or what was omitted
        axes: frame -> the axes of a camera frame, `optical` or `opengl`
        drawn: of a file without poses, child -> the rate of its edge
        projected: the largest deviation of a matrix from a rotation, in formats that round them
        robot: of a file with joints, the values of fixed joints, the links that they move, and joints without a value
        unknown_joints: joints with a value that the file does not have, each with its error; another file may have them
        """
        self.assumed = ""
        self.axes: dict[str, str] = {}
        self.drawn: dict[str, str] = {}
        self.robot: tuple[Mapping[str, Any], list[Any], list[str]] | None = None
        self.unknown_joints: dict[str, FormatError] = {}
        self.names = Names(self.note)
        self.noise: list[tuple[int, str]] = []
        self.projected = 0.0
        self.rough: list[int] = []
        self.others: dict[str, int] = {}
        self.notes: dict[str, Finding] = {}

    def note(self, message: str, line: int, rule: str = "odd") -> None:
        """Record a message once; for normalised rotations only the lines."""
        if rule == "rounded":
            self.rough.append(line)
        else:
            self.notes.setdefault(message, Finding(rule, message, line=line))

    def note_all(self, notes: Iterable[Finding], line: int) -> None:
        """Record the warnings raised while one line was read."""
        for note in notes:
            self.note(note.message, line, note.rule)

    def note_each(self, message: str, line: int, rule: str = "odd") -> None:
        """Record a message about one line, even if the same was recorded for other lines."""
        self.notes.setdefault(f"{line}: {message}", Finding(rule, message, line=line))

    def findings(self) -> Iterator[Finding]:
        """Yield one finding for each kind of problem."""
        if self.rough:
            count = "a quaternion was" if len(self.rough) == 1 else f"{len(self.rough)} quaternions were"
            yield Finding("rounded", f"{count} off norm 1 by up to 1e-3 and normalised", line=self.rough[0])
        if self.projected > PROJECTED_IN_SILENCE:
            yield Finding("rounded", projection(self.projected), line=1)
        if self.noise:
            line, text = self.noise[0]
            count = "a line" if len(self.noise) == 1 else f"{len(self.noise)} lines"
            yield Finding("noise", f"{count} printed between messages skipped: {shown(text)}", line=line)
        if self.others:
            kinds = ", ".join(f"{count} on {topic}" for topic, count in self.others.items())
            yield Finding("odd", f"messages without transforms were left out: {kinds}", line=1)
        yield from self.notes.values()


PROJECTED_IN_SILENCE = 1e-9  # deviation from orthonormal after a few products of numbers with 17 digits


def projection(off: float) -> str:
    """Return the message that matrices were replaced by rotations."""
    return f"the matrices are orthonormal only to {off:.2g}; the nearest rotation of each was taken"


class Topics:
    """The topics of a recording: transforms by topic, which ones are read, and frames that two topics publish."""

    def __init__(self, chosen: Iterable[str] = ()) -> None:
        """Read the chosen topics, with or without a leading `/`; all of them if none is chosen."""
        self.chosen = frozenset(topic.strip("/") for topic in chosen)
        self.counts: dict[str, int] = {}
        self.seen: set[str] = set()  # topics, also those without transforms
        self._first: dict[str, str] = {}  # child -> the first topic that published it
        self._reported: set[tuple[str, str]] = set()

    def takes(self, topic: str) -> bool:
        """Count a transform; return True if its topic is read."""
        self.counts[topic] = self.counts.get(topic, 0) + 1
        return not self.chosen or topic.strip("/") in self.chosen

    def chooses(self, topic: str) -> bool:
        """Return True if a topic is chosen by name; only then are its poses read, not just transforms."""
        return topic.strip("/") in self.chosen

    def conflict(self, topic: str, child: str) -> str:
        """Return an error if a frame is published in two namespaces, as by two robots; once for each frame."""
        first = self._first.setdefault(child, topic)
        if first == topic or (child, topic) in self._reported:
            return ""
        ends = [f"/{each}" for each in (first, topic)]  # `tf` and `tf_static` of one namespace belong together
        if len({each.removesuffix("_static") if each.endswith("/tf_static") else each for each in ends}) == 1:
            return ""
        self._reported.add((child, topic))
        return f"frame {child!r} comes by {first} and by {topic}; choose with --topic {first} or --topic {topic}"

    def missing(self) -> str:
        """Return an error if none of the chosen topics exists; files without topics are always read."""
        known = {*self.counts, *self.seen} - {""}
        if not self.chosen or not known or any(map(self.chooses, self.counts)):
            return ""
        return f"no transforms on {', '.join(sorted(self.chosen))}; topics: {listing(known, near=min(self.chosen))}"


class Answers(NamedTuple):
    """Options for what the format of a file does not specify.

    frames: names of the frames that the format does not name, in its order: the world, then the body
    direction: of matrices whose key does not state it, `parent-from-child` or `child-from-parent`
    camera_axes: of cameras, `optical` (x right, y down, z forward) or `opengl` (x right, y up, z back)
    dh: `standard` or `modified` Denavit-Hartenberg parameters
    stamps: a file with a timestamp for each pose, one per line
    edges: read the edges of a pose graph instead of its vertices
    joints: values of joints as text: NAME -> 30deg, 0.5, 2cm or a pose
    joint_files: files with values of joints, with or without timestamps
    order: of quaternions in lists, `xyzw` or `wxyz`
    time_offset: nanoseconds added to all stamps, or `FromFirst`
    """

    frames: tuple[str, ...] = ()
    direction: str = ""
    camera_axes: str = ""
    dh: str = ""
    stamps: str = ""
    edges: bool = False
    joints: Mapping[str, str] = MappingProxyType({})
    joint_files: tuple[str, ...] = ()
    order: str = ""
    time_offset: int = 0

    def names(self, *defaults: str) -> tuple[str, ...]:
        """Return the names of a format's frames: those of the option, then the format's defaults."""
        renamed = (name[is_slashed(name) :] for name in self.frames[: len(defaults)])
        return (*renamed, *defaults[len(self.frames) :])


class Options(NamedTuple):
    """How a file of frames is read.

    tally: collects the diagnostics
    topics: those that are read
    report: receives errors, and reading continues after them
    normalize: accept any non-zero quaternion and any matrix near a rotation
    answers: options for what the format does not specify
    """

    tally: Diagnostics
    topics: Topics
    report: Report = stop
    normalize: bool = False
    answers: Answers = Answers()
