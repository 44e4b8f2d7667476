"""The edges of a recording, and whether those of a tree can be added to them.

Of each edge only its first values are kept, and whether others follow: memory does not grow with the recording.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import BadTopology, bare, first_of, shown
from frametool.frames.topology import resolve_name, static_and_moving, to_root, two_parents
from frametool.geometry import floats, quaternion, rigid
from frametool.grammar.edges import Names, Topics

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Rigid
    from frametool.recordings.transforms import RawTransform

SAME = 1e-12  # metres, of positions a metre long, and radians: what composing and writing numbers leaves
STATIC = "tf_static"
MOST_NAMED = 8  # edges


class RecordedEdge:
    """What a recording says of one frame: its parents, its topics, its first values, and whether others follow."""

    __slots__ = ("is_static", "numbers", "parents", "topics", "varies")

    def __init__(self, numbers: Rigid) -> None:
        """Begin with the first message that has it."""
        self.numbers = numbers
        self.parents: dict[str, None] = {}
        self.topics: dict[str, None] = {}
        self.is_static = self.varies = False

    @property
    def moves(self) -> bool:
        """Tell whether the frame moves."""
        return self.varies and not self.is_static


class AddedEdge(NamedTuple):
    """An edge that stands still: parent_from_child."""

    parent: str
    child: str
    numbers: Rigid

    def __str__(self) -> str:
        """Return `parent -> child`."""
        return f"{bare(self.parent)} -> {bare(self.child)}"


class EdgePlan(NamedTuple):
    """The edges of a tree, by what is done with them in a recording that has them with the same values or others."""

    added: list[AddedEdge]
    same: list[AddedEdge]
    replaced: list[AddedEdge]


class RecordedEdges:
    """The edges of a recording, by their children."""

    def __init__(self, name: str) -> None:
        """Begin without any; `name` is that of the recording in messages."""
        self.name = name
        self.known: dict[str, RecordedEdge] = {}
        self.names, self._topics = Names(), Topics()
        self._conflicts: dict[str, str] = {}  # of frames that come from two robots
        self._topic_of: dict[str, str] = {}  # frame -> the topic by which it came first

    def add(self, topic: str, transform: RawTransform) -> None:
        """Add a transform."""
        parent, child, numbers = self.bare(transform.parent), self.bare(transform.child), transform.numbers
        edge = self.known.get(child)
        if edge is None:
            edge = self.known[child] = RecordedEdge(numbers)
        if parent not in edge.parents or topic not in edge.topics:
            edge.parents[parent] = edge.topics[topic] = None
            edge.is_static |= topic.endswith(STATIC)
            self._topic_of.setdefault(parent, topic)
            self._topic_of.setdefault(child, topic)
            if problem := self._topics.conflict(topic, child):
                self._conflicts[child] = problem
        if not edge.varies and numbers != edge.numbers:
            edge.varies = not is_same(numbers, edge.numbers)

    def bare(self, name: str) -> str:
        """Return a frame's name without a leading slash."""
        return self.names.bare(name) if name else ""

    @property
    def frames(self) -> dict[str, str]:
        """Return all frames, each with the topic by which it came first."""
        return self._topic_of

    def topic_for(self, edge: AddedEdge, added: Iterable[AddedEdge]) -> str:
        """Return the topic that an edge is added on: `tf_static` beside what the frames came by that it hangs from."""
        parents = {each.child: each.parent for each in added}
        line = [*to_root(edge.parent, parents.get), edge.child]
        topic = next((self._topic_of[frame] for frame in line if frame in self._topic_of), "/tf")
        return f"{topic.rpartition('/')[0]}/{STATIC}"

    def apart(self, added: Sequence[AddedEdge]) -> list[str]:
        """Return the roots of edges that are added and hang together with nothing that is here."""
        parents, known = {each.child: each.parent for each in added}, self._topic_of.keys()
        root_of = {edge: to_root(edge.parent, parents.get)[-1] for edge in added}
        held = {root for edge, root in root_of.items() if not known.isdisjoint((edge.parent, edge.child))}
        return sorted({*root_of.values()} - held) if known else []

    def plan(self, tree: Frames, *, replace: bool) -> EdgePlan:
        """Sort the edges of a tree: missing here, there with the same values, or there with others.

        replace: the last may be there
        Raises BadTopology for a frame that moves here or there, has another parent or would hang below itself, and for
        other values without `replace`.
        """
        found = EdgePlan([], [], [])
        for track in tree.tracks():
            child, parent = (resolve_name(frame, self._topic_of) for frame in (track.child, track.parent))
            if not track.is_static:
                raise static_and_moving(child, f" moves in {bare(tree.name)}; --with adds what stands still")
            edge, known = AddedEdge(parent, child, track.components), self.known.get(child)
            if known is None:
                found.added.append(edge)
                continue
            self._refuse_other(edge, known, tree.name)
            same = not known.varies and is_same(known.numbers, edge.numbers)
            (found.same if same else found.replaced).append(edge)
        if found.replaced and not replace:
            raise BadTopology(self._others(found.replaced, tree.name), rule="two-poses")
        self._refuse_cycles(found.added)
        return found

    def _refuse_other(self, edge: AddedEdge, known: RecordedEdge, tree: str) -> None:
        """Raise BadTopology for a frame with another parent, one that moves, and one that comes from two robots."""
        here = f"{self.name}, {first_of([*known.topics], MOST_NAMED)}"
        if edge.child in self._conflicts:
            raise BadTopology(self._conflicts[edge.child], source=self.name, rule="two-topics")
        if others := [parent for parent in known.parents if parent != edge.parent]:
            raise two_parents(edge.child, others[0], edge.parent, (here, bare(tree)))
        if known.moves:
            both = f"it moves in {shown(edge.parent)} ({here}) and stands still in it ({bare(tree)})"
            raise static_and_moving(edge.child, f": {both}")

    def _others(self, edges: list[AddedEdge], tree: str) -> str:
        """Say which edges have other values, and how far off they are."""
        told = []
        for edge in edges:
            known = self.known[edge.child]
            metres, radians = rigid.distance(*known.numbers, *edge.numbers, xp=floats)
            off = f"{metres:.3g} m and {radians * floats.RADIAN:.3g} deg off"
            told.append(f"{edge} on {first_of([*known.topics], MOST_NAMED)} ({off})")
        what = first_of(told, MOST_NAMED)
        return f"{self.name}: other values than in {bare(tree)}: {what}; --replace puts those of {bare(tree)} in"

    def _refuse_cycles(self, added: list[AddedEdge]) -> None:
        """Raise BadTopology where edges that are added hang a frame below itself."""
        parents = {child: [*edge.parents][-1] for child, edge in self.known.items()}
        parents |= {edge.child: edge.parent for edge in added}
        for edge in added:
            to_root(edge.child, parents.get)


def is_same(a: Rigid, b: Rigid) -> bool:
    """Tell whether two transforms are one, whatever the sign of their quaternions; zeros are no rotation."""
    if not (any(a[3:]) and any(b[3:])):
        return a == b
    metres, radians = rigid.distance(*_unit(*a), *_unit(*b), xp=floats)
    return bool(metres <= SAME * (1.0 + max(map(abs, a[:3]))) and radians <= SAME)


def _unit(tx: float, ty: float, tz: float, x: float, y: float, z: float, w: float) -> Rigid:
    return tx, ty, tz, *quaternion.normalized(x, y, z, w, floats)


def replaced(message: Any, edges: dict[str, AddedEdge], bare_name: Callable[[str], str]) -> bool:
    """Put other numbers into some edges of a message of transforms; return True if it has any of them."""
    found = [(each, edges.get(bare_name(each.child_frame_id))) for each in message.transforms]
    for each, edge in found:
        if edge is not None:
            put(each.transform.translation, edge.numbers[:3])
            put(each.transform.rotation, edge.numbers[3:])
    return any(edge for _, edge in found)


def put(part: Any, numbers: Sequence[float]) -> None:
    """Put numbers into x, y, z and w of a part of a message."""
    for name, number in zip("xyzw", numbers, strict=False):
        setattr(part, name, number)
