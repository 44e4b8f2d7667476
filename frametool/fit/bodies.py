"""Frames that are fixed to each other move as one body; every frame has its place in one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import ValueInvalid, alternatives, listing, shown
from frametool.fit.graph import Groups
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from frametool.geometry.types import Rigid
    from frametool.stream.measurements import Measurement

    Fixed = Sequence[tuple[str, str, Rigid]]

MOST = 1000  # frames
APART = 1e-6  # metres, radians: what two exact ways to one frame may differ by
LISTED = 150  # characters of names in the message on frames that nothing connects


class Bodies(NamedTuple):
    """The bodies that measured and fixed frames form.

    frames: in order of first mention; number: the body of each, 0 that of the root
    pose: where each is in its body; in the root's body that is where it is in the root
    parent: of each frame that keeps its entry, the frame it is fixed in
    """

    root: str
    frames: tuple[str, ...]
    number: dict[str, int]
    pose: dict[str, Transform]
    parent: dict[str, str]

    @property
    def size(self) -> int:
        """Return how many bodies there are."""
        return 1 + max(self.number.values())


def bodies_of(measurements: Sequence[Measurement], root: str | None, fixed: Fixed) -> Bodies:
    """Gather frames into bodies; raises ValueInvalid for an unknown root and edges that contradict each other."""
    edges = [*((m.parent, m.child) for m in measurements), *((parent, child) for parent, child, _ in fixed)]
    frames = tuple(dict.fromkeys(name for edge in edges for name in edge))
    if len(frames) > MOST:
        raise ValueInvalid(f"{len(frames)} frames; solve takes at most {MOST}")
    if root is None:
        children = {child for _, child in edges}
        root = next((name for name in frames if name not in children), frames[0])
    elif root not in frames:
        raise ValueInvalid(f"unknown root {shown(root)}{alternatives(root, frames, 'frames')}")
    near: dict[str, list[tuple[str, Transform]]] = {name: [] for name in frames}
    for parent, child, components in fixed:
        near[parent].append((child, Transform.of(*components)))
        near[child].append((parent, Transform.of(*components).inverse()))
    number: dict[str, int] = {}
    pose: dict[str, Transform] = {}
    for start in (root, *frames):
        if start not in number:
            number[start], pose[start] = len(set(number.values())), Transform.identity()
            reached = [start]
            for name in reached:  # grows while it is walked
                for other, edge in near[name]:
                    if other not in number:
                        number[other], pose[other] = number[start], pose[name] @ edge
                        reached.append(other)
                    _require_same(name, other, pose[name] @ edge, pose[other])
    return Bodies(root, frames, number, pose, _entries(frames, fixed))


def _require_same(name: str, other: str, one: Transform, two: Transform) -> None:
    metres, radians = one.distance(two)
    if metres > APART or radians > APART:
        off = f"{1e3 * metres:.1f} mm {math.degrees(radians):.1f} deg"
        raise ValueInvalid(f"{shown(other)} is fixed in {shown(name)} in two ways, {off} apart; fix one of them")


def _entries(frames: tuple[str, ...], fixed: Fixed) -> dict[str, str]:
    """Return the parent of each frame that keeps one: every fixed edge but those that would close a loop."""
    index = {name: at for at, name in enumerate(frames)}
    groups, parents = Groups(len(frames)), {}
    for parent, child, _ in fixed:
        if child not in parents and groups.join(index[child], index[parent]):
            parents[child] = parent
    return parents


def require_connected(bodies: Bodies, pairs: Iterable[tuple[int, int]]) -> None:
    """Raise ValueInvalid, with the frames in their groups, where rows do not join all bodies."""
    joined = Groups(bodies.size, pairs)
    groups: dict[int, list[str]] = {}
    for name in bodies.frames:
        groups.setdefault(joined.of(bodies.number[name]), []).append(name)
    if len(groups) > 1:
        most = next(most for most in (*range(20, 0, -1), 0) if not most or len(_grouped(groups, most)) <= LISTED)
        raise ValueInvalid(f"no measurement connects {_grouped(groups, max(most, 1))[:LISTED]}")


def _grouped(groups: dict[int, list[str]], most: int) -> str:
    parts = [listing(names, most) for names in list(groups.values())[: most + (len(groups) == most + 1)]]
    more = len(groups) - len(parts)
    return " | ".join(parts) + (f" | {more} more groups" if more else "")
