"""The blunders that people make when they write down a measurement, and which of them explains one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import Finding, NotConnected, printable
from frametool.fit.least_squares import applied, length
from frametool.fit.rigid_arrays import PoseArrays
from frametool.fit.robust import KEPT
from frametool.geometry.conventions import axes_change
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.lint.tree_diff import Tolerance
from frametool.stream.measurements import Measurement, parted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.frames.lookups import FrameTree
    from frametool.geometry.types import Array

NEAR = Tolerance(0.01, math.radians(1.0))  # where nothing says how sure a measurement is
LEAST = 1e-9  # metres, radians
FITTING = 4.0  # sigmas: a blunder explains a measurement that it brings this near
ALIKE = 0.5  # sigmas: blunders that make so nearly the same of a measurement are equally good
TIE = 1e-9  # of u: what is not nearer than this explains nothing
O = Transform(axes_change("flu", "optical"), (0.0, 0.0, 0.0))  # body_from_optical, as in papers


def _translation_of_inverse(m: Measurement) -> Transform:
    rotation = m.transform.rotation
    return Transform(rotation, -rotation.apply(m.components[:3]))


def _yaw_first(m: Measurement) -> Transform | None:
    if m.written is None or m.written[0] != "rpy":
        return None
    return m.turned(*Rotation.from_rpy(m.written[1][::-1]).components)


# what a measurement was meant to be, if this blunder was made
BLUNDERS: dict[str, Callable[[Measurement], Transform | None]] = {
    "inverted": lambda m: m.transform.inverse(),
    "rotation inverted": lambda m: m.turned(*m.transform.rotation.inverse().components),
    "translation of the inverse": _translation_of_inverse,
    "wxyz taken for xyzw": lambda m: m.turned(*m.components[4:], m.components[3]),
    "xyzw taken for wxyz": lambda m: m.turned(m.components[6], *m.components[3:6]),
    "millimetres": lambda m: m.shifted(1e-3),
    "metres taken for millimetres": lambda m: m.shifted(1e3),
    "degrees taken for radians": lambda m: m.reread(math.radians),
    "radians taken for degrees": lambda m: m.reread(math.degrees),
    "yaw, pitch, roll taken for roll, pitch, yaw": _yaw_first,
    "optical axes of the child": lambda m: m.transform @ O.inverse(),
    "optical axes of the parent": lambda m: O @ m.transform,
    "body axes of the child": lambda m: m.transform @ O,
    "body axes of the parent": lambda m: O.inverse() @ m.transform,
}


def best_blunder(measurement: Measurement, pose: PoseArrays, information: Array) -> str | None:
    """Name the blunder that best explains a measurement of a pose; None where none does.

    pose: where the child is in the parent; information: the inverse covariance (6, 6) of the measurement
    It must bring the measurement within 4 sigmas, and nearer than it is as it stands.  Of blunders that noise cannot
    tell from the best, the first is named: half a turn is its own inverse.
    """
    meant = {words: made for words, blunder in BLUNDERS.items() if (made := blunder(measurement)) is not None}
    tried = [*meant.values(), measurement.transform]
    poses = PoseArrays.of(Transform.of(*map(np.array, zip(*(each.components for each in tried), strict=True))))
    errors = pose.at(None).errors(poses)
    u = _sigmas(errors, information)
    best = int(u[:-1].argmin())
    if u[best] > FITTING or u[best] >= u[-1] * (1 - TIE):
        return None
    as_good = (_sigmas(errors - errors[best], information) <= ALIKE) & (u <= FITTING)
    return list(meant)[int(as_good.argmax())]


def loops(
    tree: FrameTree, measurements: Sequence[Measurement], tolerance: Tolerance | None
) -> tuple[list[Finding], list[str], int]:
    """Compare measurements with a tree: findings of those that are off, frames it lacks, how many have no way in it.

    tolerance: what still agrees; None: 3 sigmas where a measurement has a covariance, else 10 mm and 1 deg
    """
    findings, lacking, apart = [], dict[str, None](), 0
    for each in measurements:
        unknown = [name for name in each[:2] if name not in tree.frames]
        lacking |= dict.fromkeys(unknown)
        if unknown:
            continue
        try:
            pose = PoseArrays.of(tree.lookup(each.parent, each.child))
        except NotConnected:
            apart += 1
            continue
        error = pose.errors(PoseArrays.of(each.transform))
        metres, radians = map(float, length(error.reshape(2, 3)))
        if tolerance is None and each.covariance is not None:
            information = np.linalg.pinv(np.reshape(each.covariance, (6, 6)), hermitian=True)
            u = _sigmas(error[None], information)[0]
            agrees, sigmas = u <= KEPT, f" ({u:.1f} sigmas)"
        else:
            near = tolerance or NEAR
            agrees, sigmas = metres <= near.metres and radians <= near.radians, ""
            # `FITTING` sigmas are reached where both halves reach the tolerance
            sigma = np.maximum(np.repeat([near.metres, near.radians], 3), LEAST) / FITTING / 3**0.5
            information = np.diag(sigma**-2.0)
        if not agrees:
            words = best_blunder(each, pose, information)
            off = f"{1e3 * metres:.1f} mm {math.degrees(radians):.1f} deg{sigmas} off the tree"
            message = f"{printable(each.parent)}<-{printable(each.child)} is {off}"
            message += f"; fits when {words}" if words else ""
            findings.append(Finding("loop", message, *parted(each.place)))
    return findings, [*lacking], apart


def _sigmas(errors: Array, information: Array) -> Array:
    squares = (errors * applied(information, errors)).sum(-1)
    found: Array = np.sqrt(np.maximum(squares, 0.0) / 6)
    return found
