"""What a file of frames comes down to: edges, and what is worth telling of how they were written."""

from __future__ import annotations

from itertools import repeat
from types import MappingProxyType
from typing import Any, NamedTuple

from frametool.errors import Finding, listing, shown
from frametool.grammar.readers import is_slashed, slash_note

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from frametool.errors import FormatError
    from frametool.geometry.types import Components, Rigid
    from frametool.grammar.readers import Path

    Report = Callable[[FormatError], None]


class Edge(NamedTuple):
    """The pose of `child` in `parent`: parent_from_child, for good or at one time.

    parent: None for a root
    components: tx, ty, tz (metres), x, y, z, w (unit)
    stamp_ns: None where it stands still
    line: on which it was written, 0 if that says nothing
    received_ns: when the recorder got it, if that is known
    path: in a document, the way to it from the top of the text
    topic: by which it came, if that is known
    covariance: 36 entries as `geometry.uncertainty` has them, the same for all samples of a frame; None: exact
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


class Samples(NamedTuple):
    """Many poses of one frame that moves, in one piece: what as many edges would say.

    stamps_ns, components, lines: of each pose, in the order they were written
    """

    parent: str
    child: str
    stamps_ns: Sequence[int]
    components: Sequence[Rigid]
    lines: Sequence[int]

    def edge(self, at: int) -> Edge:
        """Return one of the poses as an edge."""
        return Edge(self.parent, self.child, self.components[at], self.stamps_ns[at], self.lines[at])

    def edges(self) -> Iterator[Edge]:
        """Yield the poses as edges."""
        return map(self.edge, range(len(self.stamps_ns)))


class EdgeColumns(NamedTuple):
    """Edges of several frames that move, column by column, in the order they were written."""

    parents: Sequence[str]
    children: Sequence[str]
    stamps_ns: Sequence[int]
    components: Sequence[Rigid]
    lines: Sequence[int]
    topics: Iterable[str] = ()

    def edges(self) -> Iterator[Edge]:
        """Yield them as edges."""
        parents, children, stamps_ns, components, lines, topics = self
        return map(
            Edge, parents, children, components, stamps_ns, lines, repeat(None), repeat(()), topics or repeat("")
        )  # fmt: skip


def at_other_times(piece: Edge | Samples | EdgeColumns, offset_ns: int) -> Edge | Samples | EdgeColumns:
    """Return what was read of a file with so much added to its stamps."""
    if isinstance(piece, Edge):
        return piece if piece.stamp_ns is None else piece._replace(stamp_ns=piece.stamp_ns + offset_ns)
    return piece._replace(stamps_ns=[stamp + offset_ns for stamp in piece.stamps_ns])


def stop(error: FormatError) -> None:
    """Raise an error: what a reader does with one unless it is told otherwise."""
    raise error


class Names(dict[str, str]):
    """Frame names by the text they stand in: quotes off, one leading `/` off; each is worked out once."""

    def __init__(self) -> None:
        """Create an empty table; `slashed` collects the names that began with `/`."""
        super().__init__()
        self.slashed: list[str] = []

    def __missing__(self, text: str) -> str:
        """Work a name out; "" for a text that YAML takes for nothing, which is no name."""
        name = text[1:-1].replace("''", "'") if text[0] in "\"'" else text
        self[text] = "" if text in {"null", "Null", "NULL"} else self.bare(name)
        return self[text]

    def bare(self, name: str) -> str:
        """Take one leading `/` off, as tf2 does, and remember it."""
        if not is_slashed(name):
            return name
        if name not in self.slashed:
            self.slashed.append(name)
        return name[1:]


class Tally:
    """What is worth telling about a recording once it is read: counted here, told at the end."""

    __slots__ = (
        "assumed", "axes", "drawn", "names", "noise", "notes", "others", "projected", "robot", "rough",
        "unknown_joints",
    )  # fmt: skip

    def __init__(self) -> None:
        """Create an empty tally; `rough` and `noise` hold line numbers, `others` counts by topic.

        assumed: what the file does not say and was taken for granted, with the option that says it, or was left out
        axes: frame -> the axes of the camera it is, `optical` or `opengl`
        drawn: of a file without poses, child -> how often its edge comes
        projected: how far the worst matrix was from a rotation, in forms that round them
        robot: of a file that values of joints are about, the values of those that stand still and the links they move
        unknown_joints: those told of that it does not have, each with the error that says so, for another file may
        """
        self.assumed = ""
        self.axes: dict[str, str] = {}
        self.drawn: dict[str, str] = {}
        self.robot: tuple[Mapping[str, Any], list[Any]] | None = None
        self.unknown_joints: dict[str, FormatError] = {}
        self.names = Names()
        self.noise: list[tuple[int, str]] = []
        self.projected = 0.0
        self.rough: list[int] = []
        self.others: dict[str, int] = {}
        self.notes: dict[str, Finding] = {}

    def note(self, message: str, line: int, rule: str = "odd") -> None:
        """Keep a sentence, once; of rotations that had to be normalised only the lines."""
        if rule == "rounded":
            self.rough.append(line)
        else:
            self.notes.setdefault(message, Finding(rule, message, line=line))

    def note_all(self, notes: Iterable[Finding], line: int) -> None:
        """Keep what was noted while one line was read."""
        for note in notes:
            self.note(note.message, line, note.rule)

    def note_each(self, message: str, line: int, rule: str = "odd") -> None:
        """Keep a sentence about one line, also where it was said of other lines."""
        self.notes.setdefault(f"{line}: {message}", Finding(rule, message, line=line))

    def told(self) -> Iterator[Finding]:
        """Yield one sentence for each kind of oddity."""
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
        for name in self.names.slashed:
            self.notes.setdefault(slash_note(name), Finding("slash", slash_note(name), line=1))
        yield from self.notes.values()


PROJECTED_IN_SILENCE = 1e-9  # what seventeen digits and some products leave of orthonormal rows


def projection(off: float) -> str:
    """Say that matrices were replaced by rotations."""
    return f"the matrices are orthonormal only to {off:.2g}; the nearest rotation of each was taken"


class Topics:
    """The topics of a recording: how many transforms came by each, which are read, and which frames come by two."""

    def __init__(self, chosen: Iterable[str] = ()) -> None:
        """Read the topics chosen, with or without a leading `/`; all of them if none is."""
        self.chosen = frozenset(topic.strip("/") for topic in chosen)
        self.counts: dict[str, int] = {}
        self.seen: set[str] = set()  # topics, also those without transforms
        self._first: dict[str, str] = {}  # child -> the topic it came by first
        self._told: set[tuple[str, str]] = set()

    def takes(self, topic: str) -> bool:
        """Count a transform; return whether its topic is read."""
        self.counts[topic] = self.counts.get(topic, 0) + 1
        return not self.chosen or topic.strip("/") in self.chosen

    def chooses(self, topic: str) -> bool:
        """Return True if a topic was named; only then are messages read that are poses and no transforms."""
        return topic.strip("/") in self.chosen

    def conflict(self, topic: str, child: str) -> str:
        """Return what is wrong if a frame comes from two namespaces, as of two robots; told once of each frame."""
        first = self._first.setdefault(child, topic)
        if first == topic or _source_of(first) == _source_of(topic) or (child, topic) in self._told:
            return ""
        self._told.add((child, topic))
        return f"frame {child!r} comes by {first} and by {topic}; choose with --topic {first} or --topic {topic}"

    def missing(self) -> str:
        """Return what is wrong if none of the topics chosen is there; what names no topics is read in any case."""
        known = {*self.counts, *self.seen} - {""}
        if not self.chosen or not known or any(map(self.chooses, self.counts)):
            return ""
        return f"no transforms on {', '.join(sorted(self.chosen))}; topics: {listing(known, near=min(self.chosen))}"


def _source_of(topic: str) -> str:
    """Return what publishes on a topic: `tf` and `tf_static` of one namespace belong together."""
    return topic.removesuffix("_static") if topic.endswith("/tf_static") or topic == "tf_static" else topic


class Answers(NamedTuple):
    """What options say about files whose form leaves it open.

    frames: names of the frames that a form does not name, in its order: the world, then what is seen from it
    direction: of matrices whose key does not say it, `parent-from-child` or `child-from-parent`
    camera_axes: of cameras, `optical` (x right, y down, z forward) or `opengl` (x right, y up, z back)
    dh: `standard` or `modified` Denavit-Hartenberg parameters
    stamps: a file with a time for each pose, one a line
    edges: of a graph of poses the edges are wanted, not the vertices
    joints: values of joints as they were written: NAME -> 30deg, 0.5, 2cm or a pose
    joint_files: files with values of joints, over time or for good
    order: of quaternions in lists, `xyzw` or `wxyz`
    time_offset: nanoseconds that are added to all stamps, or `FromFirst`
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
        """Return the names of a form's frames: as told, then its own."""
        told = (name[is_slashed(name) :] for name in self.frames[: len(defaults)])
        return (*told, *defaults[len(self.frames) :])


class Options(NamedTuple):
    """How a file of frames is read.

    tally: takes what is worth telling at the end
    topics: which are read
    report: takes the errors, and reading goes on behind them
    normalize: any non-zero quaternion and any matrix near a rotation is taken
    answers: what the form leaves open
    """

    tally: Tally
    topics: Topics
    report: Report = stop
    normalize: bool = False
    answers: Answers = Answers()
