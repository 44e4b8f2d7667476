"""Poses of a whole stream gathered in arrays, for what needs all of them at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Components
    from frametool.grammar.pose import Pose
    from frametool.stream.row_layout import Shape
    from frametool.text.spans import Flags, Floats


class Gathered:
    """The poses that were read so far, in metres and as unit quaternions, and a number that stands beside each."""

    def __init__(self) -> None:
        """Begin with none."""
        self.placed = self.turned = self.uncertain = False
        self._poses: list[Floats] = []
        self._beside: list[Floats] = []

    def take(self, shape: Shape, pose: Components, kept: Flags, beside: Floats | None) -> None:
        """Add the rows of a block that are kept: components of a pose, and what stands beside them."""
        self.placed |= shape.whole or shape.unit is not None
        self.turned |= shape.notation is not None
        rows = np.stack([np.broadcast_to(np.asarray(part, np.float64), len(kept)) for part in pose[:7]], axis=-1)
        self._poses.append(rows[kept])
        if beside is not None:
            self._beside.append(beside[kept])

    def add(self, poses: Sequence[Pose]) -> None:
        """Add poses that were read one by one."""
        self.placed |= any(pose.position is not None for pose in poses)
        self.turned |= any(pose.rotation is not None for pose in poses)
        self.uncertain |= any(pose.covariance is not None for pose in poses)
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
    def weights(self) -> Floats | None:
        """Return the numbers beside the poses; None if there are none."""
        return np.concatenate(self._beside) if self._beside else None
