"""Poses of a whole stream gathered in arrays, for what needs all of them at once."""

from __future__ import annotations

from math import degrees, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid
from frametool.grammar.readers import EARTH_FRAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Components
    from frametool.grammar.pose import Pose
    from frametool.grammar.result import Result
    from frametool.stream.faults import Outcome
    from frametool.stream.row_layout import Shape
    from frametool.text.spans import Flags, Floats


class Gathered:
    """The poses that were read so far, in metres and as unit quaternions, and a number or text with each."""

    def __init__(self, *, named: bool = False, by: str | None = None) -> None:
        """Begin with none; named: so that `places` says where each was read; by: the column or key of their labels."""
        self.by = by
        self.places: list[str] = []
        self._lines: list[int] | None = [] if named else None  # of the block that was read last
        self.placed = self.turned = self.uncertain = self.stamped = False
        self.frame: str | None = None  # that of the Earth, where what was gathered is placed there
        self._poses: list[Floats] = []
        self._extra: list[Floats] = []

    def take(
        self, shape: Shape, pose: Components, kept: Flags, extra: Floats | None, line_of: Callable[[int], int]
    ) -> None:
        """Add the rows of a block that are kept: components of a pose, and what comes with them."""
        if self._lines is not None:
            self._lines += map(line_of, np.flatnonzero(kept).tolist())
        self.placed |= shape.whole or shape.unit is not None
        self.turned |= shape.notation is not None
        rows = np.stack([np.broadcast_to(np.asarray(part, np.float64), len(kept)) for part in pose[:7]], axis=-1)
        self._poses.append(rows[kept])
        if extra is not None:
            self._extra.append(extra[kept])

    def placing(self, outcomes: Iterable[Outcome], place: Callable[[int], str]) -> Generator[Outcome]:
        """Pass the outcomes of blocks, and keep the places of what was taken from each; place: names a line."""
        line = 1
        for outcome in outcomes:
            if self._lines is not None:
                self.places += [place(line + below) for below in self._lines]
                self._lines = []
            line += outcome.lines
            yield outcome

    def add(self, poses: Sequence[Pose], name: str = "") -> None:
        """Add poses that were read one by one from something with a name."""
        self.places += [f"{name}, pose {at}" for at in range(1, len(poses) + 1)] if len(poses) > 1 else [name]
        self.placed |= any(pose.position is not None for pose in poses)
        self.turned |= any(pose.rotation is not None for pose in poses)
        self.frame = next((pose.parent for pose in poses if pose.parent in EARTH_FRAMES), self.frame)
        self.uncertain |= any(pose.covariance is not None for pose in poses)
        self.stamped |= any(pose.stamp_ns is not None for pose in poses)
        self._poses.append(np.array([pose.components for pose in poses], np.float64).reshape(-1, 7))

    @property
    def transforms(self) -> Transform:
        """Return all poses as one batch; raises ValueInvalid if there are none."""
        from frametool.geometry.transform import Transform

        rows = np.concatenate([np.empty((0, 7)), *self._poses])
        if not len(rows):
            raise ValueInvalid("no poses to take the mean of")
        return Transform.of(*map(np.ascontiguousarray, rows.T))

    @property
    def extra(self) -> Any:
        """Return the numbers or texts with the poses, (n,); None if there are none."""
        return np.concatenate(self._extra) if self._extra else None


def means_of(
    gathered: Gathered, values: list[float] | None, *, robust: bool
) -> Iterator[tuple[Result, list[str]]]:
    """Yield the mean of all poses, or of those of each label, with its spread, and a message for each outlier."""
    from frametool.fit.calibration import solve_mean
    from frametool.fit.least_squares import length, off_text
    from frametool.grammar.pose import Pose
    from frametool.grammar.result import Result, uncertain

    poses, extra = gathered.transforms, gathered.extra
    rows_of: dict[str, Any] = {}
    if gathered.by is not None:
        if extra is None:
            raise ValueInvalid("what was pasted has no columns or keys to group it by; leave --by out")
        for row, label in enumerate(extra.tolist()):
            rows_of.setdefault(label, []).append(row)
    weights = None if gathered.by is not None else extra if values is None else values
    for label, rows in (rows_of or {"": range(len(poses))}).items():
        found = solve_mean(poses[rows] if rows_of else poses, weights=weights, robust=robust)
        (metres, radians), (farthest, widest), covariance = found.rms, found.most, found.covariance
        extras: dict[str, Any] = {} if gathered.by is None else {gathered.by: label}
        extras |= {"count": len(found.used)} | ({"used": int(found.used.sum())} if robust else {})
        left_out: list[str] = []
        for at in found.left_out.nonzero()[0].tolist():
            off = off_text(*length(found.residuals[at].reshape(2, 3)), digits=2)
            left_out.append(f"{gathered.places[rows[at]]}: left out, {off} off (u {found.u[at]:.1f})")
        pose = Pose.of(found.transform.components)
        if gathered.placed:
            extras |= {"distance_rms": metres, "distance_max": farthest}
        if gathered.turned:
            extras |= {"angle_rms": radians, "angle_rms_deg": degrees(radians)}
            extras |= {"angle_max": widest, "angle_max_deg": degrees(widest)}
        if covariance is not None:
            if gathered.placed:
                extras |= {f"std_{axis}": sqrt(covariance[at, at]) for at, axis in enumerate("xyz")}
            if gathered.turned:
                angle = sqrt(covariance[3:, 3:].trace())
                extras |= {"std_angle": angle, "std_angle_deg": degrees(angle)}
            extras |= uncertain((covariance if gathered.turned else covariance[:3, :3]).ravel().tolist())
        position, rotation = pose.position if gathered.placed else None, pose.rotation if gathered.turned else None
        yield Result(Pose(position, rotation, None, gathered.frame), extras), left_out
