"""The end of every derivation: the command's own result, and the check that the derivation leads to it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from frametool.calc.explain.from_quaternion import FROM_QUATERNION
from frametool.calc.explain.render import Explanation
from frametool.calc.explain.sheet import DEGREES, DIGITS, METRES, RADIANS, Row, Sheet
from frametool.errors import FrametoolError, printable
from frametool.geometry import floats, quaternion
from frametool.geometry.representations import notation
from frametool.grammar.result import Result, Style, carries_position, pose_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.grammar.readers import Quaternion

CLOSE = 1e-12  # radians; and of positions, relative to the largest of them or a metre
TWO_NAMES = "Half a turn has two names: +180 and -180 deg are the same angle; the result shows the other one."
REPORT = "this is a mistake in frametool, please report it"
UNITS = {"distance": METRES, "angle": RADIANS, "angle_deg": DEGREES}


class DerivationWrong(FrametoolError):
    """Report a derivation that does not lead to the result: a mistake in this program, never to be printed."""


class DerivationStyle(NamedTuple):
    """How a derivation is written.

    style: notations, unit and sign of the result
    digits: significant ones; None for all
    every: all products of long chains are written out
    """

    style: Style
    digits: int | None = DIGITS
    every: bool = False

    @property
    def notations(self) -> Sequence[Notation]:
        """Return the notations of the result."""
        return self.style.notations or (notation("quaternion"),)


def explained(title: str, write: Callable[[Sheet], None], plan: DerivationStyle) -> Explanation:
    """Write a derivation; where setting noise to 0 leads too far away, as beside singular numbers, without that."""
    for clean in dict.fromkeys((plan.digits is not None, False)):
        sheet = Sheet(plan.digits, clean=clean, every=plan.every)
        try:
            write(sheet)
            break
        except DerivationWrong:
            if not clean:
                raise
    return Explanation(title, sheet.items)


def end_with_pose(sheet: Sheet, derived: Rigid, own: Result, plan: DerivationStyle) -> None:
    """Go on from the quaternion to the notations asked for, check both, and end with the command's own result."""
    if own.pose.position is not None:
        check_vector(sheet, derived[:3], own.pose.position)
    for each in plan.notations:
        check_rotation(sheet, each, written(sheet, derived[3:], each, plan), own, plan)
        matrix_of_pose(sheet, each, own)
    end(sheet, own, plan)


def written(sheet: Sheet, q: Quaternion, form: Notation, plan: DerivationStyle) -> Sequence[float]:
    """Add the way from the quaternion to a notation; return its numbers."""
    block = FROM_QUATERNION[form.representation.name]
    return block(sheet, q, form.bound_axes(), plan.style.in_degrees(form), plan.style.keep_sign)


def matrix_of_pose(sheet: Sheet, form: Notation, own: Result) -> None:
    """Say how the matrix of a rotation becomes that of a pose."""
    if carries_position(form) and own.pose.position is not None:
        sheet.say("The 4x4 matrix of the pose: R on the left, the position as the fourth column, 0 0 0 1 below.")


def check_rotation(sheet: Sheet, form: Notation, numbers: Sequence[float], own: Result, plan: DerivationStyle) -> None:
    """Compare numbers of a notation with the result's, as rotations: so also beside lock.

    Raises DerivationWrong.
    """
    degrees = plan.style.in_degrees(form)
    target = quaternion.unit(*own.pose.components[3:], floats)
    found = form.to_quaternion(tuple(numbers), floats, degrees=degrees)
    off = quaternion.distance(*quaternion.normalized(*found, floats), *target, floats) if any(found) else math.inf
    if not off <= CLOSE * sheet.stretch:
        raise DerivationWrong(f"the derivation in {form.spec} is off by {off:.3g} rad from the result; {REPORT}")
    final = form.from_quaternion(*target, floats, degrees=degrees, keep_sign=plan.style.keep_sign)
    turn = 180.0 if degrees else math.pi
    if any(abs(numbers[at] - final[at]) > turn for at in form.representation.angles):
        sheet.caveat(TWO_NAMES)


def check_vector(sheet: Sheet, derived: Sequence[float], own: Sequence[float]) -> None:
    """Compare positions or other vectors; raises DerivationWrong."""
    sheet.reached(own)
    off = max(abs(a - b) for a, b in zip(derived, own, strict=True))
    if not off <= CLOSE * sheet.reach * sheet.stretch:
        raise DerivationWrong(f"the derivation is off by {off:.3g} from the result; {REPORT}")


def end(sheet: Sheet, own: Result, plan: DerivationStyle) -> None:
    """End with the command's own result."""
    pose = own.pose
    named = f"{printable(pose.parent)}_from_{printable(pose.name)}" if pose.parent and pose.name else ""
    rows: list[Row] = []
    if pose.position is not None and not any(carries_position(each) for each in plan.notations):
        rows.append(row("xyz", "xyz", pose.position, METRES))
    for each in plan.notations:
        rows += _rotation_rows(own, each, plan.style)
    rows += [row(key, [""], [own.extras[key]], unit) for key, unit in UNITS.items() if key in own.extras]
    rows += covariance_rows(own.extras.get("covariance", ()))
    sheet.result(named, rows)


def row(label: str, names: Sequence[str], numbers: Sequence[float], unit: str = "") -> Row:
    """Return a line of the result, every digit shown."""
    return Row(label, [(name, repr(number + 0.0)) for name, number in zip(names, numbers, strict=True)], unit)


def covariance_rows(numbers: Sequence[float]) -> list[Row]:
    """Return a covariance as six rows."""
    return [row("covariance" * (not at), [""] * 6, numbers[at : at + 6]) for at in range(0, len(numbers), 6)]


def _rotation_rows(own: Result, form: Notation, style: Style) -> list[Row]:
    """Return the lines of one notation; a matrix has several."""
    _, numbers = pose_numbers(own.pose, form, style)
    size = math.isqrt(len(numbers))
    label = form.spec
    if form.representation.whole is not None:
        return [
            row(label if not at else "", [""] * size, numbers[at : at + size]) for at in range(0, len(numbers), size)
        ]
    angles = form.representation.angles
    unit = (DEGREES if style.in_degrees(form) else RADIANS) if angles else ""
    if len(angles) == len(numbers):
        return [row(label, form.names, numbers, unit)]
    if not angles:
        return [row(label, form.names, numbers)]
    size = angles[0]  # the axis comes first, then the angle
    return [row(label, form.names[:size], numbers[:size]), row("", form.names[size:], numbers[size:], unit)]
