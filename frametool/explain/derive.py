"""The derivation of each operation on poses and records: from the input as written to the result of the command.

Every derivation ends with the command's own result, after a check that it leads to it.
"""

from __future__ import annotations

import itertools
import math
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FrametoolError, ValueInvalid, printable, shown
from frametool.explain import operations
from frametool.explain.operations import OtherAxes, WrittenPose, chain, frames_of
from frametool.explain.render import Explanation
from frametool.explain.run import DIGITS, Row, Sheet
from frametool.frames.lookups import Frames
from frametool.geometry import floats, quaternion, representations
from frametool.grammar import pose_algebra
from frametool.grammar.pose_algebra import Lookups, looked_up_across
from frametool.grammar.result import Result, Style, pose_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.grammar.pose import Pose


METRES, RADIANS, DEGREES = "m", "rad", "deg"
CLOSE = 1e-12  # radians; and of positions, relative to the largest of them or a metre
REPORT = "this is a mistake in frametool, please report it"
ANGLE_UNITS = {"distance": METRES, "angle": RADIANS, "angle_deg": DEGREES}


class DerivationWrong(FrametoolError):
    """A derivation that does not lead to the result: a bug, never to be printed."""


class DerivationStyle(NamedTuple):
    """How a derivation is written.

    style: notations, unit and sign of the result
    digits: significant digits; None for all
    """

    style: Style
    digits: int | None = DIGITS

    @property
    def notations(self) -> Sequence[Notation]:
        """Return the notations of the result."""
        return self.style.notations or (representations.notation("quaternion"),)


def explained(plan: DerivationStyle, title: str, write: Callable[[Sheet], None]) -> Explanation:
    """Write a derivation; if rounding errors shown as 0 lead too far away, as near singular numbers, without that."""
    for clean in dict.fromkeys((plan.digits is not None, False)):
        sheet = Sheet(plan.digits, clean=clean)
        try:
            write(sheet)
            break
        except DerivationWrong:
            if not clean:
                raise
    return Explanation(title, sheet.items)


def derived_pose(plan: DerivationStyle, title: str, own: Result, way: Callable[[Sheet], Rigid]) -> Explanation:
    """Write the derivation of a pose, then of its notations; `own` is the command's result."""
    return explained(plan, title, lambda sheet: end_with_pose(sheet, way(sheet), own, plan))


def end_with_pose(sheet: Sheet, derived: Rigid, own: Result, plan: DerivationStyle) -> None:
    """Continue from the quaternion to the requested notations, check them, and end with the command's own result.

    Numbers of a notation are compared as rotations, also near gimbal lock.
    """
    pose, style = own.pose, plan.style
    rows: list[Row] = []
    if pose.position is not None:
        check_vector(sheet, derived[:3], pose.position)
        if not any(each.representation.whole for each in plan.notations):
            rows.append(row("xyz", "xyz", pose.position, METRES))
    target = quaternion.unit(*pose.components[3:], floats)
    for each in plan.notations:
        degrees, whole, angles = each.in_degrees(style.degrees), each.representation.whole, each.representation.angles
        ends = operations.from_quaternion(sheet, derived[3:], each, degrees=degrees, keep_sign=style.keep_sign)
        found = each.to_quaternion(tuple(ends), floats, degrees=degrees)
        off = quaternion.distance(*quaternion.normalized(*found, floats), *target, floats) if any(found) else math.inf
        if not off <= CLOSE * sheet.stretch:
            raise DerivationWrong(f"the derivation in {each.spec} is off by {off:.3g} rad from the result; {REPORT}")
        if whole and pose.position is not None:
            sheet.say("The 4x4 matrix of the pose: R on the left, the position as the fourth column, 0 0 0 1 below.")
        numbers = pose_numbers(pose, each, style)
        if whole is not None:  # a matrix, a row a line
            size = math.isqrt(len(numbers))
            lines = [(("",) * size, numbers[at : at + size], "") for at in range(0, len(numbers), size)]
        else:  # an axis and its angle are two lines
            cut = angles[0] if angles else len(numbers)
            angular = each.names[cut:], numbers[cut:], DEGREES if degrees else RADIANS
            lines = [part for part in ((each.names[:cut], numbers[:cut], ""), angular) if part[1]]
        rows += (row(each.spec * (not at), *line) for at, line in enumerate(lines))
    rows += [row(key, [""], [own.extras[key]], unit) for key, unit in ANGLE_UNITS.items() if key in own.extras]
    sheet.result(f"{printable(pose.parent)}_from_{printable(pose.name)}" if pose.parent and pose.name else "", rows)


def check_vector(sheet: Sheet, derived: Sequence[float], own: Sequence[float]) -> None:
    """Compare positions or other vectors; raises DerivationWrong."""
    sheet.reached(own)
    off = max(abs(a - b) for a, b in zip(derived, own, strict=True))
    if not off <= CLOSE * sheet.reach * sheet.stretch:
        raise DerivationWrong(f"the derivation is off by {off:.3g} from the result; {REPORT}")


def row(label: str, names: Sequence[str], numbers: Sequence[float], unit: str = "") -> Row:
    """Return a line of the result, with all digits."""
    return Row(label, [(name, repr(number + 0.0)) for name, number in zip(names, numbers, strict=True)], unit)


def convert(
    plan: DerivationStyle, pose: WrittenPose, *, own: Pose | None = None, change: OtherAxes | None = None
) -> Explanation:
    """Derive one pose or rotation in the requested notations.

    own: the command's result.  change: of its axes.
    """

    def way(sheet: Sheet) -> Rigid:
        sheet.reached(pose.position)
        x, y, z = pose.position
        found: Rigid = (x, y, z, *pose.quaternion(sheet))
        if pose.inverse:
            found = operations.inverse(sheet, found, "child", "parent")
        return found if change is None else operations.with_other_axes(sheet, found, change)

    title = "identity" if pose.notation is None else pose.notation.spec
    return derived_pose(
        plan, f"{title} to {', '.join(notation.spec for notation in plan.notations)}", Result(own or pose.pose), way
    )


def derived_from(sheet: Sheet, poses: Sequence[WrittenPose], labels: Sequence[tuple[str, str]]) -> list[Rigid]:
    """List the poses as written, and add the derivation of each; `labels` are its target and source."""
    sheet.heading("Given")
    for each, label in zip(poses, labels, strict=True):
        each.say(sheet, *label)
    return [each.components(sheet, *label) for each, label in zip(poses, labels, strict=True)]


def compose(plan: DerivationStyle, *poses: WrittenPose) -> Explanation:
    """Derive the product of poses."""
    if not poses:
        raise ValueInvalid("compose takes at least one pose")
    own = Result(reduce(pose_algebra.product, [each.pose for each in poses]))
    names = frames_of([each.pose for each in poses])
    labels = list(itertools.pairwise(names))

    def way(sheet: Sheet) -> Rigid:
        pose, *factors = derived_from(sheet, poses, labels)
        for factor, (middle, last) in zip(factors, labels[1:], strict=True):
            pose = operations.compose(sheet, pose, factor, (names[0], middle, last))
        return pose

    return derived_pose(plan, f"{names[0]}_from_{names[-1]}", own, way)


def invert(plan: DerivationStyle, pose: WrittenPose) -> Explanation:
    """Derive the inverse of a pose."""
    own = Result(pose_algebra.inverse(pose.pose))
    target, source = frames_of([pose.pose])

    def way(sheet: Sheet) -> Rigid:
        (found,) = derived_from(sheet, [pose], [(target, source)])
        return operations.inverse(sheet, found, target, source)

    return derived_pose(plan, f"{source}_from_{target}", own, way)


def relative(plan: DerivationStyle, a: WrittenPose, b: WrittenPose) -> Explanation:
    """Derive the pose of B in A, with distance and angle."""
    own = pose_algebra.relative(a.pose, b.pose)
    frames, labels = _three_frames(a, b)

    def way(sheet: Sheet) -> Rigid:
        one, other = derived_from(sheet, [a, b], labels)
        pose = operations.relative(sheet, one, other, frames)
        values = sheet.play("extent", operations.posed("", pose), frame=frames[1])
        for name, found in zip(pose_algebra.RELATIVE_EXTRAS, ("d", "angle", "angle_deg"), strict=True):
            value = values[found]
            if abs(value - own.extras[name]) > 100.0 * CLOSE * sheet.reach:
                raise DerivationWrong(f"the derived {name} is {value!r}, not {own.extras[name]!r}; {REPORT}")
        return pose

    return derived_pose(plan, f"{frames[1]}_from_{frames[2]}", own, way)


def interpolate(plan: DerivationStyle, a: WrittenPose, b: WrittenPose, fraction: float) -> Explanation:
    """Derive the pose at a fraction from A to B."""
    fraction = float(fraction)
    own = Result(pose_algebra.interpolated(a.pose, b.pose, fraction))
    frames, labels = _three_frames(a, b)

    def way(sheet: Sheet) -> Rigid:
        one, other = derived_from(sheet, [a, b], labels)
        return operations.between(sheet, one, other, fraction)

    return derived_pose(plan, f"{frames[1]} to {frames[2]} at {fraction!r}", own, way)


def _three_frames(a: WrittenPose, b: WrittenPose) -> tuple[tuple[str, str, str], list[tuple[str, str]]]:
    """Return the common reference frame of two poses and their bodies, and the two labels of the poses."""
    names = a.pose.parent or b.pose.parent or "world", a.pose.name or "A", b.pose.name or "B"
    world, first, second = map(printable, names)
    return (world, first, second), [(world, first), (world, second)]


def lookup(
    plan: DerivationStyle, tree: Frames, target: str, source: str, *, at_ns: int | None = None,
    source_at_ns: int | None = None, fixed: str | None = None,
) -> Explanation:  # fmt: skip
    """Derive the pose of one frame of a tree in another; with `fixed` across two times."""
    if not isinstance(tree, Frames):
        raise ValueInvalid(f"expected a tree as frametool.load returns it, found {shown(tree)}")
    if fixed is None:
        own = Lookups(tree, carried=False).result(target, source, at_ns)
    else:
        own = looked_up_across(tree, target, at_ns, source, source_at_ns, fixed)

    def way(sheet: Sheet) -> Rigid:
        if fixed is None:
            return chain(sheet, tree, target, source, at_ns)
        with sheet.about("where the target was"):
            first = chain(sheet, tree, target, fixed, at_ns)
        with sheet.about("where the source was"):
            second = chain(sheet, tree, fixed, source, source_at_ns)
        sheet.play("across", {})
        return operations.compose(sheet, first, second, (printable(target), printable(fixed), printable(source)))

    return derived_pose(plan, f"{printable(target)}_from_{printable(source)}", own, way)
