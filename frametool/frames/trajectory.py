"""The poses of one frame over time: the type of trajectories that are read, compared and written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import ValueInvalid
from frametool.geometry import arrays, quaternion
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from typing import Any

    from frametool.geometry.types import Array

WORLD, BODY = "world", "body"  # default names


class Trajectory(NamedTuple):
    """Poses of `body` in `world`, or only its positions.

    stamps_ns: integers of shape (n,), or None if poses are only numbered; xyz: (n, 3), metres
    xyzw: unit quaternions (n, 4), or None if there are only positions
    lines: line numbers in the file, from 1; None if unknown
    """

    stamps_ns: Any
    xyz: Any
    xyzw: Any = None
    world: str = WORLD
    body: str = BODY
    lines: Any = None

    def _repr_html_(self) -> str | None:
        """Show it in a notebook as a terminal does."""
        import frametool

        return frametool.html_of(self)

    @property
    def size(self) -> int:
        """The number of poses."""
        return len(self.xyz)

    @property
    def rotation(self) -> Rotation | None:
        """The rotations, if there are any."""
        return None if self.xyzw is None else Rotation.of(*columns(self.xyzw))

    @property
    def poses(self) -> Transform:
        """The poses; raises ValueInvalid if there are only positions."""
        if self.xyzw is None:
            raise ValueInvalid("positions alone are not poses: rotations are needed here")
        return Transform.of(*columns(self.xyz), *columns(self.xyzw))

    def with_poses(self, poses: Transform) -> Trajectory:
        """Return the trajectory with other poses."""
        return self._replace(xyz=np.stack(poses.components[:3], -1), xyzw=np.stack(poses.components[3:], -1))

    def at(self, index: Any) -> Trajectory:
        """Select poses as numpy does."""
        stamps = None if self.stamps_ns is None else self.stamps_ns[index]
        turns, lines = (None if each is None else each[index] for each in (self.xyzw, self.lines))
        return self._replace(stamps_ns=stamps, xyz=self.xyz[index], xyzw=turns, lines=lines)

    def numbered(self) -> Trajectory:
        """Return the trajectory with the indices of its poses as seconds."""
        return self._replace(stamps_ns=np.arange(self.size, dtype=np.int64) * 1_000_000_000)

    def disorder(self, name: str) -> list[str]:
        """Return what `in_order` changes in a trajectory with a name, one sentence each."""
        stamps = np.array([], np.int64) if self.stamps_ns is None else self.stamps_ns
        doubled = len(stamps) - len(np.unique(stamps))
        said = [f"{name}: stamps are out of order; sorted"] * bool((np.diff(stamps) < 0).any())
        have = "pose has" if doubled == 1 else "poses have"
        return said + [f"{name}: {doubled} {have} the stamp of another; the last counts"] * bool(doubled)

    def in_order(self) -> Trajectory:
        """Return the trajectory sorted by its stamps; the last of equal stamps counts."""
        if self.stamps_ns is None or not np.any(np.diff(self.stamps_ns) <= 0):
            return self
        order = np.argsort(self.stamps_ns, kind="stable")
        last = np.append(np.diff(self.stamps_ns[order]) > 0, True)
        return self.at(order[last])


def columns(rows: Array) -> list[Array]:
    """Return the columns of rows, each of them contiguous."""
    return list(np.ascontiguousarray(np.asarray(rows, np.float64).T))


def way(xyz: Array) -> Array:
    """Return the path length in metres up to each position."""
    x, y, z = np.diff(xyz, axis=0).T
    return np.append(0.0, np.cumsum(quaternion.magnitude(x, y, z, arrays)))
