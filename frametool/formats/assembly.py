"""Edges put together: a FrameTree while everything stands still, a TransformBuffer once something moves.

Knows nothing of text: whoever reads says where each edge stood.
"""

from __future__ import annotations

from bisect import bisect_left
from itertools import islice
from operator import lt

from frametool.errors import BadTopology, FormatError, Tf2Warning, ValueInvalid, shown, warn
from frametool.frames.policy import Refused
from frametool.frames.tree import FrameTree

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Protocol

    from frametool.frames.buffer import TransformBuffer
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Samples

    class Place(Protocol):
        """Where an edge was read."""

        def error(self, message: str, kind: type[FormatError]) -> FormatError:
            """Make the error for this place."""

        def seen_from(self, other: Place) -> str:
            """Name this place beside another one: `line 7`, or `other.yaml:7` in another source."""

    class PlacedSamples(Protocol):
        """Poses of one frame, and where each was read."""

        @property
        def samples(self) -> Samples:
            """Return the poses."""

        def place(self, at: int) -> Place:
            """Return where one of them was read."""


class Rules:
    """How frames are taken that move, and rotations that are none."""

    __slots__ = ("keep_ns", "moving", "normalize", "policy")

    def __init__(
        self, *, moving: bool = False, policy: str = "frametool", keep_ns: int | None = None, normalize: bool = False
    ) -> None:
        """Keep the rules.

        moving: an edge with one stamp answers only that instant, as in tf2; otherwise it stands still.
        policy, keep_ns: as TransformBuffer has them.
        normalize: any non-zero quaternion and any matrix near a rotation is taken.
        """
        self.moving = moving
        self.normalize = normalize
        self.policy = policy
        self.keep_ns = keep_ns

    def __repr__(self) -> str:
        """Name the rules with their values."""
        return f"Rules({', '.join(f'{name}={getattr(self, name)!r}' for name in self.__slots__)})"


class Replaced:
    """A sample that took the place of another one at the same stamp."""

    __slots__ = ("child", "earlier", "later", "parent", "stamp_ns")

    def __init__(self, parent: str, child: str, stamp_ns: int, earlier: Place, later: Place) -> None:
        """Keep what was said last, and where the two stood."""
        self.parent = parent
        self.child = child
        self.stamp_ns = stamp_ns
        self.earlier = earlier
        self.later = later

    @property
    def places(self) -> str:
        """Name both places."""
        return f"{self.earlier.seen_from(self.later)} and {self.later.seen_from(self.later)}"


class Assembly:
    """What has been read so far, and where the first word on each frame stood."""

    def __init__(self, name: str, rules: Rules | None = None) -> None:
        """Create an empty assembly; `name` says in messages where they come from."""
        self.name = name
        self.rules = rules or Rules()
        self.tree = FrameTree(name)
        self.buffer: TransformBuffer | None = None
        self._first: dict[str, tuple[str, Rigid, Place]] = {}  # child -> what was said first
        self._places: dict[str, dict[int, Place]] = {}  # child -> stamp -> where that sample stood
        self._replaced: list[Replaced] = []
        self._stamps: dict[str, int] = {}  # child -> its one stamp, while it has no other
        self._moves: set[str] = set()
        self._whole: dict[str, list[PlacedSamples]] = {}  # child -> samples that were taken in one piece
        self.axes: dict[str, str] = {}  # frame -> the axes of the camera it is

    @property
    def places(self) -> dict[str, Place]:
        """Return where each frame that has a parent was first said to hang from it."""
        return {child: place for child, (_, _, place) in self._first.items()}

    def add_root(self, frame: str) -> None:
        """Make a frame known that has no parent (yet)."""
        (self.tree if self.buffer is None else self.buffer).add_root(self._kept(frame))

    def _kept(self, name: str) -> str:
        """Return the name under which the buffer keeps a frame: tf2 strips one slash."""
        return name if self.rules.policy == "frametool" else name.removeprefix("/")

    def add(self, parent: str, child: str, components: Rigid, stamp_ns: int | None, place: Place) -> None:
        """Add one edge, or one sample of it.

        Raises BadTopology and FormatError with the place; where tf2 would log and drop, that is a warning in its words.
        """
        try:
            if self.buffer is None and stamp_ns is None and self.rules.policy == "frametool":
                self._hang(parent, child, components, place)
            else:
                self._record(self._moving(), parent, child, components, stamp_ns, place)
        except BadTopology as error:
            raise self._placed(error, parent, child, place) from None
        except Refused as refused:
            tell_rejected(refused.lines)
        except ValueInvalid as error:
            raise place.error(str(error), FormatError) from None

    def add_samples(self, placed: PlacedSamples) -> None:
        """Add the poses of one frame: in one piece where nothing can be wrong with their order, else one by one."""
        parent, child, stamps_ns, components, _ = placed.samples
        if not stamps_ns:
            return
        if self._takes_whole(placed.samples):
            try:
                self._moving().insert_many(parent, child, stamps_ns, components)
            except BadTopology as error:
                raise self._placed(error, parent, child, placed.place(0)) from None
            self._first.setdefault(child, (parent, components[0], placed.place(0)))
            self._stamps.setdefault(child, stamps_ns[0])
            self._moves.add(child)
            self._whole.setdefault(child, []).append(placed)
            return
        for at, (stamp_ns, pose) in enumerate(zip(stamps_ns, components, strict=True)):
            self.add(parent, child, pose, stamp_ns, placed.place(at))

    def _takes_whole(self, samples: Samples) -> bool:
        """Tell whether samples can only follow what is known: of a frame that is new or moves in the same parent."""
        if self.rules.policy != "frametool" or self.rules.keep_ns is not None or len(samples.stamps_ns) == 1:
            return False
        track = None if self.buffer is None else self.buffer.track(samples.child)
        if track is None:
            follows = samples.child not in self._first
        else:
            follows = samples.child in self._moves and not track.standing and track.parent == samples.parent
            follows = follows and track.last_ns < samples.stamps_ns[0]  # type: ignore[union-attr]
        return follows and all(map(lt, samples.stamps_ns, islice(samples.stamps_ns, 1, None)))

    def _place_before(self, child: str, stamp_ns: int) -> Place | None:
        """Find where the sample of a stamp stood among those taken in one piece."""
        for placed in self._whole.get(child, ()):
            at = bisect_left(placed.samples.stamps_ns, stamp_ns)
            if at < len(placed.samples.stamps_ns) and placed.samples.stamps_ns[at] == stamp_ns:
                return placed.place(at)
        return None

    def finish(self) -> FrameTree | TransformBuffer:
        """Return the tree, or the buffer if anything moves."""
        made = self._finished()
        made.camera_axes |= self.axes
        return made

    def _finished(self) -> FrameTree | TransformBuffer:
        if self.buffer is None:
            return self.tree
        standing = set()
        if not self.rules.moving:
            moving = [track.child for track in self.buffer.tracks() if not track.standing]
            standing = {child for child in moving if child not in self._moves}
        for child in standing:
            self.buffer.make_stand(child)
        self._tell_replaced(standing)
        if self.rules.policy != "frametool":
            return self.buffer
        tree = self._standing_tree(self.buffer)
        return self.buffer if self.buffer.moves else tree

    def _hang(self, parent: str, child: str, components: Rigid, place: Place) -> None:
        """Add an edge that stands still."""
        self._first.setdefault(child, (parent, components, place))
        self.tree.add_components(parent, child, components)

    def _moving(self) -> TransformBuffer:
        """Return the buffer; at the first stamp it takes over what stands still."""
        if self.buffer is None:
            from frametool.frames.buffer import TransformBuffer

            self.buffer = TransformBuffer(keep_ns=self.rules.keep_ns, policy=self.rules.policy, name=self.name)
            for frame in self.tree.frames:
                self.buffer.add_root(frame)
            for child, (parent, components, _) in self._first.items():
                self.buffer.insert_components(parent, child, components)
        return self.buffer

    def _record(
        self, buffer: TransformBuffer, parent: str, child: str, components: Rigid, stamp_ns: int | None, place: Place
    ) -> None:
        """Add a sample, or a standing edge beside samples."""
        received, child = child, self._kept(child)
        track = buffer.track(child)
        settled = track is not None and child not in self._moves and (track.standing or stamp_ns is None)
        if track is not None and settled and (track.parent, track.components) == (parent, components):
            return  # said again, once with and once without a stamp
        self._first.setdefault(child, (parent, components, place))
        if stamp_ns is not None and self._stamps.setdefault(child, stamp_ns) != stamp_ns:
            self._moves.add(child)
        elif stamp_ns is not None and track is not None and self.rules.policy != "frametool":
            self._moves.add(child)  # tf2 takes no stamp twice: what comes twice was not latched
        replaced = buffer.insert_components(parent, received, components, stamp_ns)
        if stamp_ns is not None:
            places = self._places.setdefault(child, {})
            if replaced:
                earlier = places.get(stamp_ns) or self._place_before(child, stamp_ns) or place
                self._replaced.append(Replaced(parent, child, stamp_ns, earlier, place))
            places[stamp_ns] = place

    def _tell_replaced(self, standing: set[str], most: int = 10) -> None:
        """Refuse standing frames with two values; warn of moving ones with two poses at one stamp."""
        from frametool.frames.stamps import format_stamp

        for each in self._replaced:
            if each.child in standing:
                raise self._placed(BadTopology("", rule="two-poses"), each.parent, each.child, each.later)
        for each in self._replaced[:most]:
            what = f"frame {shown(each.child)} has two poses at {format_stamp(each.stamp_ns)}: {each.places}"
            warn(f"{self.name}: {what}; the last one holds")
        if len(self._replaced) > most:
            warn(f"{self.name}: {len(self._replaced) - most} more stamps with two poses of one frame")

    def _standing_tree(self, buffer: TransformBuffer) -> FrameTree:
        """Return all that stands still as a tree, held to a tree's rules."""
        tree = FrameTree(self.name)
        for frame in buffer.frames:
            tree.add_root(frame)
        for track in buffer.tracks():
            if track.standing:
                try:
                    tree.add_components(track.parent, track.child, track.components)
                except BadTopology as error:
                    raise self._first[track.child][2].error(str(error), BadTopology) from None
        return tree

    def _placed(self, error: BadTopology, parent: str, child: str, place: Place) -> FormatError:
        """Make the error for a place; where it contradicts what was said before, both places are named."""
        message = str(error)
        known = self._first.get(child)
        if error.rule not in ("cycle", "self") and known is not None and known[2] is not place:
            first, second = known[2].seen_from(place), place.seen_from(place)
            if known[0] != parent:
                parents = f"{shown(known[0])} ({first}) and {shown(parent)} ({second})"
                message = f"frame {shown(child)} has two parents: {parents}"
            elif error.rule == "two-poses":
                message = f"frame {shown(child)} has two different poses in {shown(parent)}: {first} and {second}"
            else:
                message = f"{error}: {first} and {second}"
        return place.error(message, BadTopology)


def tell_rejected(lines: list[str]) -> None:
    """Warn in the words that tf2 logs when it drops a transform."""
    for line in lines:
        warn(line, kind=Tf2Warning)
