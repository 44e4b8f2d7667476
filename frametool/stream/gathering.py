"""Poses of a whole stream gathered in arrays, for what needs all of them at once."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import ValueInvalid
from frametool.grammar.readers import EARTH_FRAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Components
    from frametool.grammar.pose import Pose
    from frametool.stream.faults import Outcome
    from frametool.stream.row_layout import Shape
    from frametool.text.spans import Flags, Floats


class Gathered:
    """The poses that were read so far, in metres and as unit quaternions, and a number or text with each."""

    def __init__(self, *, named: bool = False, labelled: bool = False) -> None:
        """Begin with none; named: so that `places` says where each was read; labelled: by texts with them."""
        self.labelled = labelled
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

    def groups(self) -> Iterator[tuple[str, Gathered]]:
        """Yield the poses by their labels, in the order in which these came."""
        if not self._extra:
            raise ValueInvalid("what was pasted has no columns or keys to group it by; leave --by out")
        rows, labels = self.transforms, np.concatenate(self._extra).tolist()
        for label in dict.fromkeys(labels):
            at = [row for row, each in enumerate(labels) if each == label]
            part = copy(self)
            part._poses = [np.stack(rows.components, -1)[at]]  # noqa: SLF001 - its own
            part._extra, part.places = [], [self.places[row] for row in at] if self.places else []  # noqa: SLF001
            yield label, part

    @property
    def weights(self) -> Floats | None:
        """Return the numbers with the poses; None if there are none."""
        return np.concatenate(self._extra) if self._extra else None
