"""Choose the frames of a tree to draw, in a fixed frame and at a time, with poses and trails in metres.

The page, SVG, PNG, GLB and the terminal use this module.  It also projects to pixels orthographically, and places
names without overlaps, in a grid of cells.
"""

from __future__ import annotations

import math
import re
import warnings
from collections import Counter
from functools import cached_property
from itertools import chain, pairwise, product
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, printable, shown
from frametool.frames.buffer import TransformBuffer
from frametool.frames.topology import Snapshot
from frametool.geometry import earth as wgs84
from frametool.geometry import floats, quaternion, rigid
from frametool.geometry.place import ECEF as EARTH
from frametool.geometry.place import ENU
from frametool.text.numbers import parse_angle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.frames.lookups import Frames
    from frametool.frames.track import MovingTrack
    from frametool.geometry import Rigid

    Point = tuple[float, float, float]
    Eye = tuple[float, float]  # azimuth and elevation, radians
    Ground = tuple[str, Rigid]  # replaces ecef: a name, and the pose in ecef of axes east, north, up at a frame
    Box = tuple[float, float, float, float]  # left, top, right, bottom
    Label = tuple[str, "Flat", Box, float]  # a name, the point it labels, its box in whole cells, its distance in lines

PARTS = 8  # points of a trail per stamp, so that it is round where a frame turns
FEW_STAMPS = 500  # with more, a trail has one point per stamp
FURTHEST = 1e30  # metres; nothing is drawn beyond, because GLB has float32
STILL = 1e-9  # metres: a frame that moves less has no trail
MOST_STAMPS = 4000  # of a trail; if there are more, only every second, third, .. is used


def _on_ground(tree: Frames, ground: Ground | None) -> tuple[Ground | None, Frames]:
    """Return the ground, and the tree with it in place of ecef; (None, tree) without frames on the Earth.

    ground: by default at the first frame in ecef, a static one if there is any
    """
    earth, found = tree.resolve_name(EARTH), TransformBuffer(name=tree.name)
    if ground is None:
        tracks = sorted(tree.tracks(), key=lambda track: not track.is_static)
        there = next((track for track in tracks if track.parent == earth), None)
        if there is None or earth not in tree.roots:
            return None, tree
        lat, lon, alt = wgs84.lla(*there.components[:3], floats)
        if not isfinite(alt):
            return None, tree
        ground = f"enu at {there.child}", (*there.components[:3], *wgs84.ecef_from_axes(lat, lon, ENU, floats))
    name, pose = ground
    for frame in tree.frames:
        found.add_root(name if frame == earth else frame)
    for track in tree.tracks():
        for stamp_ns, parent, seen in track.walk():
            above, moved = (name, rigid.relative(*pose, *seen)) if parent == earth else (parent, seen)
            found.insert_components(above, track.child, moved, stamp_ns)
    return ground, found


class FrameScene:
    """The frames of a tree to draw.

    tree: the tree, with the ground instead of ecef
    names: all frames, parents before children by the first parents; index: name -> position in this list
    tracks: name -> track, of the moving frames
    fixed: the frame in which everything is drawn
    at_ns: the time, None if nothing moves; span_ns: the first and the last stamp
    target, source: the two frames whose transform is shown, if any
    chosen: the frames that are drawn
    path_only: draw only the frames between target and source
    """

    def __init__(
        self, tree: Frames, *, fixed: str | None = None, at_ns: int | None = None, below: str | None = None,
        only: str | None = None, target: str | None = None, source: str | None = None, path_only: bool = False,
        ground: Ground | None = None,
    ) -> None:  # fmt: skip
        """Choose what is drawn.

        fixed: by default the target, or `below`, or the root of most frames.
        ground: that of another scene; by default at the first frame in ecef.
        at_ns: by default the first time at which all moving edges have data.
        below: only this frame and its descendants.  only: a regular expression that names must match.
        Raises UnknownFrame; ValueInvalid for an empty tree, an invalid expression, or one that matches nothing.
        """
        if not tree.frames:
            raise ValueInvalid("no frames in it: nothing to draw")
        self.ground: Ground | None = None
        if tree.resolve_name(EARTH) not in (fixed, below, target, source):
            # in ecef, frames are too far from the origin to be seen
            self.ground, tree = _on_ground(tree, ground)
        tree.require(*filter(None, (fixed, below, target, source)))
        self.tree = tree
        self.tracks: dict[str, MovingTrack] = {track.child: track for track in tree.tracks() if not track.is_static}
        self.names = _in_order(tree)
        self.index = {name: number for number, name in enumerate(self.names)}
        self.target, self.source, self.path_only = target, source, path_only
        first = [track.first_ns for track in self.tracks.values()]
        self.span_ns = min(first, default=0), max((track.last_ns for track in self.tracks.values()), default=0)
        self.at_ns = (max(first) if at_ns is None else at_ns) if first else None
        self.fixed = fixed or target or below or Counter(Snapshot(tree).roots.values()).most_common(1)[0][0]
        self.chosen = {name for name in self.names if self.ground is None or name != self.ground[0]}
        if below is not None:
            self.chosen &= {*Snapshot(tree, self.at_ns).below(below)}
        if path_only and target and source:
            self.chosen &= set(tree.path(target, source, self.at_ns))
        if only is not None:
            try:
                with warnings.catch_warnings(action="ignore", category=FutureWarning):
                    matches = re.compile(only)
            except (re.error, OverflowError, RecursionError) as error:
                raise ValueInvalid(f"{shown(only)} is not a regular expression: {error}") from None
            self.chosen = {name for name in self.chosen if matches.search(name)}
        if not self.chosen:
            raise ValueInvalid(f"no frame is left to draw: nothing matches{f' {shown(only)}' * (only is not None)}")

    def poses(self) -> dict[str, Rigid]:
        """Return the pose in `fixed` of every chosen frame that is connected to it at the time."""
        now = Snapshot(self.tree, self.at_ns)
        seen = now.seen_from(self.fixed)
        if now.roots[self.fixed] in now.without_data:
            seen = {self.fixed: seen[self.fixed]}
        return {name: seen[name] for name in self.names if name in seen and name in self.chosen}

    @cached_property
    def trails(self) -> dict[str, list[list[Point]]]:
        """Return the path in `fixed` of each chosen moving frame, in metres.

        It is split into stretches where parents change or data are missing.
        """
        found = {}
        for name in (name for name in self.tracks if name in self.chosen):
            import numpy as np

            # poses at, and between, the stamps of all moving frames on its path
            movers = self._movers_above(name) | self._movers_above(self.fixed)
            stamps = sorted({stamp for mover in movers for stamp, _, _ in self.tracks[mover].walk()})
            stamps = stamps[:: -(-len(stamps) // MOST_STAMPS) or 1]
            parts = 1 if len(stamps) > FEW_STAMPS else PARTS
            times = [a + (b - a) * part // parts for a, b in pairwise(stamps) for part in range(parts)] + stamps[-1:]
            with np.errstate(over="ignore", invalid="ignore"):  # points too far away are not drawn
                points = self.tree.lookup_many(self.fixed, name, times, missing="nan").xyz
            known = np.abs(points).max(axis=1) < FURTHEST
            changes = sorted(stamp for mover in movers for stamp in self.tracks[mover].changes())
            epoch = np.searchsorted(changes, times, side="right")
            cuts = np.flatnonzero((known[1:] != known[:-1]) | (epoch[1:] != epoch[:-1])) + 1
            pieces = [piece for piece, here in zip(np.split(points, cuts), known[[0, *cuts]], strict=True) if here]
            if pieces and np.ptp(np.concatenate(pieces), axis=0).max() >= STILL:
                found[name] = [[(x, y, z) for x, y, z in piece.tolist()] for piece in pieces]
        return found

    def _movers_above(self, name: str) -> set[str]:
        """Return the moving frames on any path from a frame to a root."""
        seen, waiting = {name}, [name]
        for each in waiting:  # the list grows in the loop
            if track := self.tree.track(each):
                above = {parent for _, parent, _ in track.walk()} if track.varies else {track.parent}
                waiting += above - seen
                seen |= above
        return seen & self.tracks.keys()


def can_be_drawn(point: Sequence[float]) -> bool:
    """Return True if a point is near enough to be drawn."""
    return all(abs(value) < FURTHEST for value in point)


def _in_order(tree: Frames) -> list[str]:
    """Return the frames in depth-first order, by the first parents."""
    children: dict[str, list[str]] = {}
    for track in tree.tracks():
        children.setdefault(next(track.walk())[1], []).append(track.child)
    order, waiting = [], [*reversed(tree.roots)]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children.get(order[-1], []))
    return [*dict.fromkeys([*order, *tree.frames])]  # frames in a cycle of first parents come last


# name -> azimuth and elevation of the eye, radians; front looks along -x, side along +y, top down
EYES = {
    "slanted": (-0.9, 0.5),
    "front": (0.0, 0.0),
    "side": (-math.pi / 2.0, 0.0),
    "top": (-math.pi / 2.0, math.pi / 2.0),
}


def parse_eye(text: str) -> Eye:
    """Parse a name of EYES, or AZ,EL in degrees, and return azimuth and elevation in radians.

    Raises ValueInvalid.
    """
    if text in EYES:
        return EYES[text]
    angles = map(parse_angle, cells := [*map(str.strip, text.split(","))])
    if len(cells) != 2:
        raise ValueInvalid(f"expected {', '.join(EYES)} or AZ,EL in degrees, found {shown(text)}")
    azimuth, elevation = (each if unit == "rad" else math.radians(math.fmod(each, 360.0)) for each, unit in angles)
    if abs(elevation) > math.pi / 2.0:
        raise ValueInvalid(f"the elevation must be -90 .. 90 degrees, found {shown(cells[1])}")
    return azimuth, elevation


AXIS_PART = 0.55  # length of a drawn axis, in median distances between a frame and its parent
USUAL_LINK = 0.5  # metres, if there is no such distance
LEAST = 1e-9  # metres; closer frames are on one point
# radius of the cluster: REACH times that of NEAR_PART of the frames, if some frame is VERY_FAR times as far away
REACH, NEAR_PART, VERY_FAR, FEWEST = 2.5, 0.7, 4.0, 4


class Flat(NamedTuple):
    """A point in the picture: pixels to the right and down, and metres toward the eye."""

    x: float
    y: float
    depth: float


class Size(NamedTuple):
    """A picture's size.

    width, height: in pixels, or dots of a terminal.
    margin: pixels for names on each side.
    axes: minimum and maximum length of drawn axes, in pixels.
    cell: width and height of the cells in which names are placed; line: height of a name, whole cells.
    measure: returns the width of a text.
    """

    width: float
    height: float
    margin: float
    axes: tuple[float, float]
    cell: tuple[int, int]
    line: float
    measure: Callable[[str], float]


class Projection:
    """The projection of a scene to pixels.

    poses: name -> pose in `fixed`, of the drawn frames
    trails: of the moving frames
    links: (parent, child) if both are drawn
    origins: name -> pixels; nearest_last: the names from the farthest to the nearest
    axis: length of a drawn axis in metres
    scale: pixels per metre
    view: unit vectors to the right, up, and toward the eye
    """

    def __init__(self, scene: FrameScene, size: Size, eye: Eye = EYES["slanted"], *, most: bool = False) -> None:
        """Fit the scene into the picture; most: ignore a few frames that are far from the others."""
        self.scene, self.size = scene, size
        sa, ca, se, ce = (function(angle) for angle in eye for function in (math.sin, math.cos))
        self.view = (-sa, ca, 0.0), (-se * ca, -se * sa, ce), (ce * ca, ce * sa, se)
        self.poses = {name: pose for name, pose in scene.poses().items() if can_be_drawn(pose[:3])}
        self.trails = scene.trails
        parents = {name: scene.tree.parent(name, scene.at_ns) for name in self.poses}
        self.links = [(parent, name) for name, parent in parents.items() if parent in self.poses and parent]
        lengths = sorted(math.dist(self.poses[parent][:3], self.poses[name][:3]) for parent, name in self.links)
        lengths = [length for length in lengths if length > LEAST]
        usual = lengths[len(lengths) // 2] if lengths else USUAL_LINK
        fitted: list[Sequence[float]] = [self.poses[name][:3] for name in (self.cluster() if most else self.poses)]
        if len(fitted) == len(self.poses):
            fitted += (point for stretches in self.trails.values() for stretch in stretches for point in stretch)
        self.low, self.high = _bounds(fitted)
        self.centre = [(low + high) / 2.0 for low, high in zip(self.low, self.high, strict=True)]
        flat = [self.turned(point) for point in fitted]
        (left, down, _), (right, up, _) = _bounds(flat)
        self.middle = (left + right) / 2.0, (down + up) / 2.0
        room = [max(pixels - 2.0 * size.margin, 0.2 * pixels) for pixels in size[:2]]
        self.scale = min(
            room[0] / max(right - left, LEAST),
            room[1] / max(up - down, LEAST),
            0.4 * min(size[:2]) / (AXIS_PART * usual),  # do not magnify a single frame
        )
        self.origins = {name: self.at(pose[:3]) for name, pose in self.poses.items()}
        self.nearest_last = sorted(self.poses, key=lambda name: self.origins[name].depth)
        shortest, longest = (pixels / self.scale for pixels in size.axes)
        self.axis = min(max(AXIS_PART * usual, shortest), longest)

    def cluster(self) -> list[str]:
        """Return the frames near the median position, or all frames if none is far from these."""
        middle = [sorted(column)[len(self.poses) // 2] for column in zip(*self.poses.values(), strict=True)][:3]
        away = {name: math.dist(pose[:3], middle) for name, pose in self.poses.items()}
        far = sorted(away.values())
        reach = REACH * far[int(NEAR_PART * (len(far) - 1))] if len(far) >= FEWEST else 0.0
        is_apart = reach > 0.0 and far[-1] > VERY_FAR * reach
        return [name for name, metres in away.items() if not is_apart or metres <= reach]

    def holds(self, place: Flat) -> bool:
        """Return True if a point is inside the picture."""
        return 0.0 <= place.x < self.size.width and 0.0 <= place.y < self.size.height

    def turned(self, point: Sequence[float]) -> Point:
        """Return the coordinates of a point along `view`: metres to the right, up, and toward the eye."""
        (a, b, c), (d, e, f), (g, h, i) = self.view
        x, y, z = point
        return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z

    def at(self, point: Sequence[float]) -> Flat:
        """Return the pixels of a point in metres."""
        right, up, toward = self.turned(point)
        across = self.size.width / 2.0 + (right - self.middle[0]) * self.scale
        return Flat(across, self.size.height / 2.0 - (up - self.middle[1]) * self.scale, toward)

    def tips(self, pose: Rigid) -> list[Flat]:
        """Return the tips of the axes x, y, z of a pose."""
        x, y, z, *rotation = pose
        r11, r12, r13, r21, r22, r23, r31, r32, r33 = quaternion.to_matrix(*rotation)
        columns = ((r11, r21, r31), (r12, r22, r32), (r13, r23, r33))
        return [self.at((x + self.axis * dx, y + self.axis * dy, z + self.axis * dz)) for dx, dy, dz in columns]

    def axes(self, name: str) -> list[tuple[int, Flat]]:
        """Return the axes 0, 1, 2 of a frame with their tips, from the farthest to the nearest."""
        return sorted(enumerate(self.tips(self.poses[name])), key=lambda each: each[1].depth)

    def label(
        self, words: str, length: float, point: Flat, left: float, middle: float, away: float = 0.0
    ) -> Iterator[Label]:
        """Yield a label at a position, aligned with the cells, if it is inside the picture."""
        (wide, high), line = self.size.cell, self.size.line
        left, top = wide * round(left / wide), high * round((middle - line / 2.0) / high)
        right, bottom = left + wide * math.ceil(length / wide), top + line
        if left >= 0.0 and right <= self.size.width and top >= 0.0 and bottom <= self.size.height:
            yield words, point, (left - MARGIN, top, right + MARGIN, bottom), away

    def ground(self) -> tuple[float, list[tuple[Point, Point, bool]]]:
        """Return the grid on z = 0: its spacing in metres, and its lines (begin, end, True if through the origin)."""
        wide = max(self.high[0] - self.low[0], self.high[1] - self.low[1], 4.0 * self.axis)
        step = rounded(wide / 8.0)
        first = [math.floor(low / step - 0.6) for low in self.low]
        last = [math.ceil(high / step + 0.6) for high in self.high]
        (left, near), (right, far) = ([number * step for number in ends[:2]] for ends in (first, last))
        across = [((k * step, near, 0.0), (k * step, far, 0.0), k == 0) for k in range(first[0], last[0] + 1)]
        along = [((left, k * step, 0.0), (right, k * step, 0.0), k == 0) for k in range(first[1], last[1] + 1)]
        return step, across + along


def rounded(length: float) -> float:
    """Return a length rounded to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(length))
    factor = length / power
    return (1.0 if factor < 1.5 else 2.0 if factor < 3.5 else 5.0 if factor < 7.5 else 10.0) * power


def _bounds(points: Iterable[Sequence[float]]) -> tuple[list[float], list[float]]:
    """Return the bounding box of points; zeros without points."""
    columns = list(zip(*points, strict=True)) or [(0.0,)] * 3
    return [min(column) for column in columns], [max(column) for column in columns]


DISTANCES = (0.6, 1.1, 1.75, 2.7, 3.9, 5.4)  # of a name from its frame, in heights of a line
SIDES = ((1.0, -0.6), (1.0, 0.6), (-1.0, -0.6), (-1.0, 0.6), (0.0, -1.3), (0.0, 1.3), (1.0, 0.0), (-1.0, 0.0))
SAME = 3.0  # pixels within which frames share a name
MOST_SHARED = 2  # names in one label
MARGIN = 2.0  # pixels on both sides of a name
LONGEST = 60  # characters of a name
WIDE, THIN = "mwMW_@", "il.·tfjrI "


def placed_names(
    flat: Projection, blocked: Iterable[Box] = (), outside: Iterable[Iterator[Label]] = ()
) -> tuple[list[Label], int]:
    """Place a name next to each group of frames on one point inside the picture, nearest first.

    Names never overlap each other and, if possible, no axis: each is at the first free spot, or else at the first
    one that overlaps only axes.
    blocked: boxes to keep free.  outside: spots for further names, best first, which are placed before the others
    Returns the labels, and the number of names without a spot.
    """
    (wide, high), line, measure = flat.size.cell, flat.size.line, flat.size.measure

    def cells_of(box: Box) -> Iterator[tuple[int, int]]:
        """Return the cells that a box covers; a point covers one."""
        left, top, right, bottom = box
        spans = ((int(left // wide), math.ceil(right / wide)), (int(top // high), math.ceil(bottom / high)))
        across, down = (range(begin, max(end, begin + 1)) for begin, end in spans)
        return product(across, down)

    def spots(point: Flat, names: list[str]) -> Iterator[Label]:
        """Yield the labels around a point, best first; a label at a side begins or ends at its spot."""
        words = words_of(names)
        length = measure(words)
        for away, (dx, dy) in product(DISTANCES, SIDES):
            left = point.x + dx * away * line - (1.0 - dx) / 2.0 * length
            yield from flat.label(words, length, point, left, point.y + dy * away * line, away)

    groups: dict[tuple[int, int], tuple[Flat, list[str]]] = {}
    for name in reversed(flat.nearest_last):
        if flat.holds(point := flat.origins[name]):
            groups.setdefault((round(point.x / SAME), round(point.y / SAME)), (point, []))[1].append(name)
    taken: set[tuple[float, float]] = {cell for box in blocked for cell in cells_of(box)}
    taken |= {(x // wide, y // high) for x, y, _ in flat.origins.values()}
    axes = {
        ((begin.x + part * (end.x - begin.x)) // wide, (begin.y + part * (end.y - begin.y)) // high)
        for name, begin in flat.origins.items() for end in flat.tips(flat.poses[name]) for part in (0.4, 0.7, 1.0)
    }  # fmt: skip
    placed: list[Label] = []
    hidden = 0
    inside = ((spots(point, names), len(names)) for point, names in groups.values())
    for found, count in chain(((each, 1) for each in outside), inside):
        free = [spot for spot in found if taken.isdisjoint(cells_of(spot[2]))]
        if free:
            best = next((spot for spot in free if axes.isdisjoint(cells_of(spot[2]))), free[0])
            taken.update(cells_of(best[2]))
            placed.append(best)
        else:
            hidden += count
    return placed, hidden


def text_width(words: str, size: float = 12.0) -> float:
    """Return an upper estimate of the width of a text in pixels."""
    return size * sum(0.9 if letter in WIDE else 0.36 if letter in THIN else 0.62 for letter in words) + 2.0


def words_of(names: list[str]) -> str:
    """Return the label of frames on one point: some of their names, and the number of the others."""
    shown_names = map(printable, names[:MOST_SHARED])
    words = " · ".join(name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in shown_names)
    return words + (f" +{len(names) - MOST_SHARED}" if len(names) > MOST_SHARED else "")
