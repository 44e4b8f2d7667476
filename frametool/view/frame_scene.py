"""What is drawn of a tree: which frames, seen in which one, at which time; poses and trails in its metres.

Knows no form: the page, SVG, PNG, GLB and the terminal ask here.
"""

from __future__ import annotations

import re
from functools import cached_property
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, shown
from frametool.frames.buffer import TransformBuffer
from frametool.frames.snapshot import Snapshot
from frametool.geometry import earth as wgs84
from frametool.geometry import floats, rigid
from frametool.geometry.place import ECEF as EARTH
from frametool.geometry.place import ENU
from frametool.geometry.rigid import IDENTITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack
    from frametool.geometry.types import Rigid

    Point = tuple[float, float, float]

PARTS = 8  # of the way between two stamps, so that a trail is round where a frame turns
FEW_STAMPS = 500  # above, a trail has one point a stamp
FURTHEST = 1e30  # metres; beyond, nothing is drawn: programs that read GLB have float32
STILL = 1e-9  # metres: a frame that stays within has no trail
MOST_STAMPS = 4000  # of a trail; of more, every second, third, .. is taken


class Trail(NamedTuple):
    """Where a frame went: stretches of points, in metres, cut where its parent changes or data are missing."""

    frame: str
    stretches: list[list[Point]]


def _expression(text: str) -> re.Pattern[str]:
    """Compile a regular expression; what Python would warn of is nobody's business here."""
    import warnings

    try:
        with warnings.catch_warnings(action="ignore", category=FutureWarning):
            return re.compile(text)
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueInvalid(f"{shown(text)} is no regular expression: {error}") from None


class Ground(NamedTuple):
    """What is drawn in the place of the Earth's frame: level axes, x east and y north, at a frame that stands there."""

    name: str
    pose: Rigid


def _ground(tree: Frames) -> Ground | None:
    """Return the ground below the first frame on the Earth, one that stands still if there is any."""
    earth = tree.resolve_name(EARTH)
    there = sorted((track for track in tree.tracks() if track.parent == earth), key=lambda track: not track.is_static)
    if not there or earth not in tree.roots:
        return None
    x, y, z = there[0].components[:3]
    lat, lon, alt = wgs84.lla(x, y, z, floats)
    if not isfinite(alt):
        return None
    return Ground(f"enu at {there[0].child}", (x, y, z, *wgs84.ecef_from_axes(lat, lon, ENU, floats)))


def _on(tree: Frames, ground: Ground) -> Frames:
    """Return the same frames with the ground in the place of the Earth's frame."""
    earth, found = tree.resolve_name(EARTH), TransformBuffer(name=tree.name)
    for frame in tree.frames:
        found.add_root(ground.name if frame == earth else frame)
    for track in tree.tracks():
        for stamp_ns, parent, pose in track.walk():
            above, seen = (ground.name, rigid.relative(*ground.pose, *pose)) if parent == earth else (parent, pose)
            found.insert_components(above, track.child, seen, stamp_ns)
    found.camera_axes, found.covariances = tree.camera_axes, tree.covariances
    return found


class FrameScene:
    """The frames of a tree as they are drawn.

    tree: what they come from
    names: every frame, parents before children by the first parents
    tracks: of the frames that move, by name
    fixed: the frame that all is seen in
    at_ns: the time; None where nothing moves
    target, source: the two frames whose transform is asked for, if any
    chosen: the frames that are drawn; None for all
    path_only: whether only those between target and source are drawn
    """

    def __init__(
        self, tree: Frames, *, fixed: str | None = None, at_ns: int | None = None, below: str | None = None,
        only: str | None = None, target: str | None = None, source: str | None = None, path_only: bool = False,
        ground: Ground | None = None,
    ) -> None:  # fmt: skip
        """Choose what is drawn.

        fixed: left out, the target, or `below`, or the root of most frames; on the Earth the ground.
        ground: that of another scene; left out, below the first frame that stands on the Earth.
        at_ns: left out, the first time that all moving edges have.
        below: only this frame and those that hang from it.  only: a regular expression that names must match.
        Raises UnknownFrame; ValueInvalid for an empty tree, a bad expression, or one that matches nothing.
        """
        if not tree.frames:
            raise ValueInvalid("no frames in it: nothing to draw")
        self.ground = None if tree.resolve_name(EARTH) in (fixed, below, target, source) else ground or _ground(tree)
        if self.ground is not None:  # the Earth's centre is no place to look from
            tree = _on(tree, self.ground)
        tree.require(*filter(None, (fixed, below, target, source)))
        self.tree = tree
        self.tracks: dict[str, MovingTrack] = {track.child: track for track in tree.tracks() if not track.is_static}
        self.names, self._roots = _in_order(tree, {name: _first_parent(tree, name) for name in tree.frames})
        self.target, self.source, self.path_only = target, source, path_only
        if self.tracks and at_ns is None:
            at_ns = max(track.first_ns for track in self.tracks.values())
        self.at_ns = at_ns if self.tracks else None
        self.fixed = fixed or target or below or max(self._roots, key=lambda root: self._roots[root])
        self.chosen = self._choice(below, only)

    @property
    def span_ns(self) -> tuple[int, int]:
        """Return the first and the last stamp of all."""
        return (
            min((track.first_ns for track in self.tracks.values()), default=0),
            max((track.last_ns for track in self.tracks.values()), default=0),
        )

    def _choice(self, below: str | None, only: str | None) -> set[str] | None:
        """Return the names to draw."""
        if below is None and only is None and not self.path_only and self.ground is None:
            return None
        chosen = {name for name in self.names if self.ground is None or name != self.ground.name}
        if below is not None:
            chosen &= {*Snapshot(self.tree, self.at_ns).below(below)}
        if self.path_only and self.target and self.source:
            chosen &= set(self.tree.path(self.target, self.source, self.at_ns))
        if only is not None:
            matches = _expression(only)
            chosen = {name for name in chosen if matches.search(name)}
        if not chosen:
            raise ValueInvalid(f"no frame is left to draw: nothing matches{f' {shown(only)}' * (only is not None)}")
        return chosen

    def parent(self, name: str) -> str | None:
        """Return the parent of a frame at the time; None for a root and where it is not known."""
        return self.tree.parent(name, self.at_ns)

    def poses(self) -> dict[str, Rigid]:
        """Return the pose in `fixed` of every chosen frame that is connected to it at the time, parents first."""
        now = Snapshot(self.tree, self.at_ns)
        root = now.roots[self.fixed]
        if root in now.without_data:
            return {self.fixed: IDENTITY} if self._is_chosen(self.fixed) else {}
        names, in_root = self.names, now.seen_from(root)
        if any(track.varies for track in self.tracks.values()):  # only changing parents can upset the order
            names, _ = _in_order(self.tree, {name: self.parent(name) for name in names})
        back = rigid.inverse(*in_root[self.fixed].components)
        return {
            name: IDENTITY if name == self.fixed else rigid.compose(*back, *in_root[name].components)
            for name in names
            if name in in_root and self._is_chosen(name)
        }

    def _is_chosen(self, name: str) -> bool:
        return self.chosen is None or name in self.chosen

    @cached_property
    def trails(self) -> list[Trail]:
        """Return where each chosen frame that moves went in `fixed`."""
        chosen = ((name, self._stretches(name)) for name in self.tracks if self._is_chosen(name))
        return [Trail(name, stretches) for name, stretches in chosen if stretches]

    def _stretches(self, name: str) -> list[list[Point]]:
        """Look a frame up at the stamps of all that moves on its way, and between them."""
        import numpy as np

        movers = self._movers_above(name) | self._movers_above(self.fixed)
        stamps = sorted({stamp for mover in movers for stamp, _, _ in self.tracks[mover].walk()})
        stamps = stamps[:: -(-len(stamps) // MOST_STAMPS) or 1]
        parts = 1 if len(stamps) > FEW_STAMPS else PARTS
        times = [a + (b - a) * part // parts for a, b in pairwise(stamps) for part in range(parts)] + stamps[-1:]
        with np.errstate(over="ignore", invalid="ignore"):  # what is too far is not drawn
            points = self.tree.lookup_many(self.fixed, name, times, missing="nan").xyz
        known: NDArray[np.bool_] = np.max(np.abs(points), axis=1) < FURTHEST
        changes = sorted(stamp for mover in movers for stamp in self.tracks[mover].changes())
        epoch = np.searchsorted(changes, times, side="right")
        cuts = np.flatnonzero((known[1:] != known[:-1]) | (epoch[1:] != epoch[:-1])) + 1
        pieces = [piece for piece, here in zip(np.split(points, cuts), known[[0, *cuts]], strict=True) if here]
        if not pieces or np.ptp(np.concatenate(pieces), axis=0).max() < STILL:
            return []
        return [[(x, y, z) for x, y, z in piece.tolist()] for piece in pieces]

    def _movers_above(self, name: str) -> set[str]:
        """Return the moving frames on any way from a frame to a root."""
        seen, waiting = {name}, [name]
        for each in waiting:  # it grows as it is walked
            if track := self.tree.track(each):
                above = {parent for _, parent, _ in track.walk()} if track.varies else {track.parent}
                waiting += above - seen
                seen |= above
        return seen & self.tracks.keys()


def can_be_drawn(point: Sequence[float]) -> bool:
    """Tell whether a point is near enough to be drawn."""
    return all(abs(value) < FURTHEST for value in point)


def _first_parent(tree: Frames, name: str) -> str | None:
    track = tree.track(name)
    if track is None or track.is_static:
        return tree.parent(name)
    return track.parent_near(track.first_ns)


def _in_order(tree: Frames, parents: dict[str, str | None]) -> tuple[list[str], dict[str, int]]:
    """Return the frames as a walk through the tree meets them, and how many hang from each root."""
    children: dict[str | None, list[str]] = {}
    for name, parent in parents.items():
        children.setdefault(parent if parent in parents else None, []).append(name)
    order: list[str] = []
    sizes = {}
    for root in children.get(None, []):
        before, waiting = len(order), [root]
        while waiting:
            order.append(waiting.pop())
            waiting += reversed(children.get(order[-1], []))
        sizes[root] = len(order) - before
    return order or list(tree.frames), sizes or {tree.frames[0]: 1}
