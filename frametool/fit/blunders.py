"""Measured poses between frames, the common mistakes in them, and their differences from a known tree."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frametool.errors import Finding, NotConnected, printable
from frametool.fit import least_squares as lsq
from frametool.geometry.conventions import axes_change
from frametool.geometry.transform import Rotation, Transform
from frametool.lint.tree_diff import Tolerance

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.frames.lookups import FrameTree
    from frametool.geometry import Array, Rigid


class Measurement(NamedTuple):
    """The measured pose of a child in its parent.

    components: tx, ty, tz, x, y, z, w; metres
    covariance: 36 numbers as ROS orders them, in the parent's axes; None if unknown
    place: file and line, `m.yaml:12`, followed by the column if the line has several measurements
    written: representation of its rotation, "rpy" or "rotvec", and the three numbers as read, in radians
    """

    parent: str
    child: str
    components: Rigid
    covariance: tuple[float, ...] | None = None
    place: str = ""
    id: str | None = None
    written: tuple[str, tuple[float, float, float]] | None = None

    @property
    def transform(self) -> Transform:
        """Return parent_from_child."""
        return Transform.of(*self.components)

    def with_rotation(self, x: float, y: float, z: float, w: float) -> Transform:
        """Return the transform with another rotation, a quaternion."""
        return Transform.of(*self.components[:3], x, y, z, w)

    def rescaled(self, factor: float) -> Transform:
        """Return the transform with its translation times a factor."""
        x, y, z, *turn = self.components
        return Transform.of(x * factor, y * factor, z * factor, *turn)

    def with_angles(self, change: Callable[[Array], Array], *kinds: str) -> Transform | None:
        """Return the transform with changed angles; None if its rotation was not written in one of these `kinds`."""
        kind, angles = self.written or ("", ())
        if kind not in kinds:
            return None
        read = Rotation.from_rpy if kind == "rpy" else Rotation.from_rotvec
        return self.with_rotation(*read(change(np.array(angles))).components)


NEAR = Tolerance(0.01, math.radians(1.0))  # the tolerance of measurements without a covariance
FITTING = 4.0  # sigmas: a mistake explains a measurement if undoing it leaves at most this residual
ALIKE = 0.5  # sigmas: mistakes whose results differ by less than this are equally good
TIE = 1e-9  # of u: an improvement below this does not count
O = Transform(axes_change("flu", "optical"), (0.0, 0.0, 0.0))  # body_from_optical, in the notation of papers


# each mistake and the function that undoes it; None if it does not apply to the measurement
BLUNDERS: dict[str, Callable[[Measurement], Transform | None]] = {
    "inverted": lambda m: m.transform.inverse(),
    "rotation inverted": lambda m: m.with_rotation(*m.transform.rotation.inverse().components),
    "translation of the inverse": lambda m: m.with_rotation(*m.transform.rotation.inverse().components).inverse(),
    "wxyz taken for xyzw": lambda m: m.with_rotation(*m.components[4:], m.components[3]),
    "xyzw taken for wxyz": lambda m: m.with_rotation(m.components[6], *m.components[3:6]),
    "millimetres": lambda m: m.rescaled(1e-3), "metres taken for millimetres": lambda m: m.rescaled(1e3),
    "degrees taken for radians": lambda m: m.with_angles(np.radians, "rpy", "rotvec"),
    "radians taken for degrees": lambda m: m.with_angles(np.degrees, "rpy", "rotvec"),
    "yaw, pitch, roll taken for roll, pitch, yaw": lambda m: m.with_angles(np.flip, "rpy"),
    "optical axes of the child": lambda m: m.transform @ O.inverse(),
    "optical axes of the parent": lambda m: O @ m.transform, "body axes of the child": lambda m: m.transform @ O,
    "body axes of the parent": lambda m: O.inverse() @ m.transform,
}  # fmt: skip


def best_blunder(measurement: Measurement, pose: Transform, information: Array) -> str | None:
    """Return the mistake that best explains the difference between a measurement and a pose; None if none does.

    pose: of the child in the parent; information: the inverse covariance (6, 6) of the measurement
    Undoing the mistake must bring the measurement within 4 sigmas of the pose, and nearer than it was.  If noise cannot
    distinguish several, the first of BLUNDERS is returned: a rotation by 180 degrees is its own inverse.
    """
    meant = {words: made for words, blunder in BLUNDERS.items() if (made := blunder(measurement)) is not None}
    tried = [*meant.values(), measurement.transform]
    off = lsq.errors(pose, lsq.stacked(tried))
    u = lsq.sigmas(off, information)
    best = int(u[:-1].argmin())
    if u[best] > FITTING or u[best] >= u[-1] * (1 - TIE):
        return None
    as_good = (lsq.sigmas(off - off[best], information) <= ALIKE) & (u <= FITTING)
    return list(meant)[int(as_good.argmax())]


def split_place(place: str) -> tuple[str, int, int]:
    """Split `file:line:column` into its parts; a missing line or column is 0."""
    file, line, column = re.fullmatch(r"(?s)(.*?)(?::(\d+))?(?::(\d+))?", place).groups("0")  # type: ignore[union-attr]
    return file, int(line), int(column)


def disagreements(
    tree: FrameTree, measurements: Sequence[Measurement], tolerance: Tolerance | None
) -> tuple[list[Finding], list[str], int]:
    """Compare measurements with a tree.

    tolerance: largest difference; None: 3 sigmas if a measurement has a covariance, else 10 mm and 1 deg
    Returns a finding for each measurement that differs, the frames missing in the tree, and the number of measurements
    whose frames the tree does not connect.
    """
    findings, missing, unconnected = [], dict[str, None](), 0
    for each in measurements:
        unknown = [name for name in each[:2] if name not in tree.frames]
        missing |= dict.fromkeys(unknown)
        if unknown:
            continue
        try:
            pose = tree.lookup(each.parent, each.child)
        except NotConnected:
            unconnected += 1
            continue
        error = lsq.errors(pose, each.transform)
        metres, radians = map(float, lsq.length(error.reshape(2, 3)))
        if tolerance is None and each.covariance is not None:
            information = np.linalg.pinv(np.reshape(each.covariance, (6, 6)), hermitian=True)
            u = lsq.sigmas(error[None], information)[0]
            agrees, sigmas = u <= lsq.KEPT, f" ({u:.1f} sigmas)"
        else:
            near = tolerance or NEAR
            agrees, sigmas = metres <= near.metres and radians <= near.radians, ""
            # scaled so that u is `FITTING` sigmas where both metres and radians reach the tolerance
            sigma = np.maximum(np.repeat([near.metres, near.radians], 3), lsq.LEAST) / FITTING / 3**0.5
            information = np.diag(sigma**-2.0)
        if not agrees:
            words = best_blunder(each, pose, information)
            off = f"{lsq.off_text(metres, radians)}{sigmas} off the tree"
            message = f"{printable(each.parent)}<-{printable(each.child)} is {off}"
            message += f"; fits when {words}" if words else ""
            findings.append(Finding("loop", message, *split_place(each.place)))
    return findings, [*missing], unconnected
