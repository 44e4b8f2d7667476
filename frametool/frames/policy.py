"""What a buffer accepts: frametool's own rules.  Those of tf2 are in `frametool.frames.tf2`."""

from __future__ import annotations

from math import isfinite

from frametool.errors import BadTopology, NotConnected, UnknownFrame, ValueInvalid
from frametool.frames.no_data import no_data
from frametool.frames.path import edges_between
from frametool.frames.stamps import format_stamp

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.errors import LookupFailed
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.track import Track
    from frametool.geometry.types import Rigid


class Policy:
    """The rules of a buffer and the words of its refusals; these here are frametool's, the stricter ones."""

    zero_counts = True  # whether a newest stamp of 0 is a time like any other
    refuses_cycles = True
    listing_decimals = 3  # of stamps, where frames are listed
    default_keep_ns: int | None = None

    def admit(
        self, parent: str, child: str, components: Rigid, authority: str,  # noqa: ARG002 - tf2's words name it
    ) -> tuple[str, str, Rigid]:
        """Return names and numbers as they are kept.

        Raises ValueInvalid, BadTopology.
        """
        if not parent or not child:
            raise ValueInvalid(f"an edge needs two frames, found parent {parent!r} and child {child!r}")
        if parent == child:
            raise BadTopology(f"frame {child!r} is its own parent")
        if not all(map(isfinite, components)):
            raise ValueInvalid(f"the pose of {child!r} in {parent!r} is not finite: {' '.join(map(repr, components))}")
        return parent, child, components

    def settle_kind(self, track: Track, *, standing: bool) -> bool:
        """Say whether a further sample counts as standing."""
        if track.standing != standing:
            raise BadTopology(f"frame {track.child!r} both stands still and moves")
        return standing

    def stand(self, track: Track, parent: str, components: Rigid) -> None:
        """Take a further value of a standing frame: only the same."""
        if parent != track.parent:
            raise BadTopology(f"frame {track.child!r} has two parents: {track.parent!r} and {parent!r}")
        if components != track.samples[0]:
            raise BadTopology(f"frame {track.child!r} has two different poses in {parent!r}")

    def refuse_old(self, track: Track, stamp_ns: int, keep_ns: int, authority: str) -> None:  # noqa: ARG002
        """Refuse a sample older than what a buffer keeps."""
        newest = track.stamps[-1]
        if newest - keep_ns > stamp_ns:
            raise ValueInvalid(
                f"a sample of {track.child!r} at {format_stamp(stamp_ns)} is older than the buffer keeps: "
                f"{format_stamp(keep_ns)} s before its newest at {format_stamp(newest)}",
            )

    def repeat(self, track: Track, at: int, parent: str, components: Rigid, authority: str) -> bool:  # noqa: ARG002
        """Take a sample at the stamp of sample `at`: the last one holds.  Returns whether other data were replaced."""
        if track.parents[at] == parent and track.samples[at] == components:
            return False
        track.replace(at, parent, components)
        return True

    def unknown(self, name: str, role: str, buffer: TransformBuffer) -> LookupFailed:  # noqa: ARG002
        """Report a frame nobody has heard of."""
        return UnknownFrame(name, known=buffer.frames, where=buffer.name)

    def is_bad_name(self, name: str) -> bool:  # noqa: ARG002
        """Say whether a name cannot be asked for at all."""
        return False

    def unconnected(self, error: NotConnected, target: str, source: str) -> LookupFailed:  # noqa: ARG002
        """Report two frames of different trees."""
        return error

    def prune_before(self, track: Track, keep_ns: int) -> None:
        """Prune ahead of a new sample: not here."""

    def prune_after(self, track: Track, keep_ns: int) -> None:
        """Prune after a new sample."""
        track.drop_before(track.stamps[-1] - keep_ns)

    def looped(
        self, buffer: TransformBuffer, error: BadTopology, target: str, source: str, at_ns: int | None,
    ) -> tuple[list[str], list[str]]:  # fmt: skip
        """Find the way where the newest parents form a circle: only by parents known at the very time."""
        if at_ns is None:
            raise error
        return edges_between(target, source, lambda frame: buffer.parent_exactly(frame, at_ns))

    def refuse_depth(
        self, buffer: TransformBuffer, target: str, source: str, at_ns: int | None,
    ) -> None:  # fmt: skip
        """Refuse ways that are too long: none is."""

    def missing(
        self, buffer: TransformBuffer, target: str, source: str, at_ns: int, way: list[Track],  # noqa: ARG002
    ) -> LookupFailed:
        """Report that an edge on the way has no data at a time."""
        return no_data(target, source, at_ns, way)


FRAMETOOL = Policy()
