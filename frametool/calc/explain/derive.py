"""One derivation for each operation on poses: from what is written to the result of the command."""

from __future__ import annotations

import itertools
from functools import reduce
from typing import TYPE_CHECKING

from frametool.calc.explain.agreement import (
    CLOSE,
    REPORT,
    DerivationStyle,
    DerivationWrong,
    check_rotation,
    check_vector,
    end,
    end_with_pose,
    explained,
    matrix_of_pose,
    written,
)
from frametool.calc.explain.chain import MOST_SHOWN, chain, joined_across
from frametool.calc.explain.given import Given, frames_of
from frametool.calc.explain.operations import between, compose, extent, inverse, relative
from frametool.calc.explain.other_axes import with_other_axes
from frametool.calc.explain.short_ways import SHORT
from frametool.errors import printable
from frametool.grammar import pose_algebra
from frametool.grammar.looked_up import looked_up, looked_up_across
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.calc.explain.other_axes import OtherAxes
    from frametool.calc.explain.render import Explanation
    from frametool.calc.explain.sheet import Sheet
    from frametool.frames.lookups import Frames
    from frametool.geometry.representations import Notation
    from frametool.geometry.types import Rigid
    from frametool.grammar.pose import Pose


def derive_convert(
    given: Given, plan: DerivationStyle, *, own: Pose | None = None, change: OtherAxes | None = None
) -> Explanation:
    """Derive one pose or rotation in the notations asked for.

    own: what the command makes of it.  change: of its axes.
    """
    result = Result(own or given.pose)

    def write(sheet: Sheet) -> None:
        sheet.reached(given.position)
        hub: Rigid | None = None
        for form in plan.notations:
            numbers = None if change or given.inverse else _short_way(sheet, given, form, plan)
            if numbers is None:
                if hub is None:
                    hub = _hub(sheet, given, change)
                    if result.pose.position is not None:
                        check_vector(sheet, hub[:3], result.pose.position)
                numbers = written(sheet, hub[3:], form, plan)
            check_rotation(sheet, form, numbers, result, plan)
            matrix_of_pose(sheet, form, result)
        end(sheet, result, plan)

    return explained(f"{_title(given)} to {', '.join(form.spec for form in plan.notations)}", write, plan)


def _title(given: Given) -> str:
    return "identity" if given.notation is None else given.notation.spec


def _hub(sheet: Sheet, given: Given, change: OtherAxes | None) -> Rigid:
    """Add the way from what is written to the position and the quaternion."""
    q = given.quaternion(sheet)
    x, y, z = given.position
    pose: Rigid = (x, y, z, *q)
    if given.inverse:
        pose = inverse(sheet, pose, "child", "parent")
    return pose if change is None else with_other_axes(sheet, pose, change)


def _short_way(sheet: Sheet, given: Given, form: Notation, plan: DerivationStyle) -> Sequence[float] | None:
    """Add the way that passes the quaternion by, where there is one."""
    if given.notation is None:
        return None
    way = SHORT.get((given.notation.representation.name, form.representation.name))
    if way is None:
        return None
    return way(sheet, given.numbers, given.notation.bound_axes(), given.degrees, plan.style.in_degrees(form))


def _say_given(sheet: Sheet, given: Sequence[Given], labels: Sequence[tuple[str, str]]) -> None:
    """List the poses as they are written."""
    sheet.heading("Given")
    for each, (target, source) in zip(given, labels, strict=True):
        each.say(sheet, target, source)


def derive_compose(given: Sequence[Given], plan: DerivationStyle) -> Explanation:
    """Derive the product of poses."""
    poses = [each.pose for each in given]
    own = Result(reduce(pose_algebra.product, poses))
    names = frames_of(len(poses) + 1, poses)
    labels = list(itertools.pairwise(names))

    def write(sheet: Sheet) -> None:
        brief = len(given) > MOST_SHOWN and not sheet.every
        _say_given(sheet, given, labels)
        if brief:
            sheet.say("A long chain: one product a line; --explain-full writes every product out.")
            factors: list[Rigid] = [each.pose.components for each in given]
        else:
            factors = [each.components(sheet, *label) for each, label in zip(given, labels, strict=True)]
        pose = factors[0]
        for at, factor in enumerate(factors[1:], 1):
            pose = compose(sheet, pose, factor, (names[0], names[at], names[at + 1]), brief=brief)
        end_with_pose(sheet, pose, own, plan)

    return explained(f"{names[0]}_from_{names[-1]}", write, plan)


def derive_invert(given: Given, plan: DerivationStyle) -> Explanation:
    """Derive the inverse of a pose."""
    own = Result(pose_algebra.inverse(given.pose))
    target, source = frames_of(2, [given.pose])

    def write(sheet: Sheet) -> None:
        _say_given(sheet, [given], [(target, source)])
        pose = inverse(sheet, given.components(sheet, target, source), target, source)
        end_with_pose(sheet, pose, own, plan)

    return explained(f"{source}_from_{target}", write, plan)


def derive_relative(a: Given, b: Given, plan: DerivationStyle) -> Explanation:
    """Derive B seen from A, with distance and angle."""
    own = pose_algebra.relative(a.pose, b.pose)
    world = printable(a.pose.parent or b.pose.parent or "world")
    first, second = printable(a.pose.name or "A"), printable(b.pose.name or "B")

    def write(sheet: Sheet) -> None:
        _say_given(sheet, [a, b], [(world, first), (world, second)])
        poses = [a.components(sheet, world, first), b.components(sheet, world, second)]
        pose = relative(sheet, poses[0], poses[1], (world, first, second))
        found = extent(sheet, pose, first)
        for name, value in zip(pose_algebra.RELATIVE_EXTRAS, found, strict=True):
            if abs(value - own.extras[name]) > 100.0 * CLOSE * sheet.reach:
                raise DerivationWrong(f"the derived {name} is {value!r}, not {own.extras[name]!r}; {REPORT}")
        end_with_pose(sheet, pose, own, plan)

    return explained(f"{first}_from_{second}", write, plan)


def derive_interpolate(a: Given, b: Given, fraction: float, plan: DerivationStyle) -> Explanation:
    """Derive the pose at a fraction of the way from A to B."""
    own = Result(pose_algebra.interpolated(a.pose, b.pose, fraction))
    world = printable(a.pose.parent or b.pose.parent or "world")
    first, second = printable(a.pose.name or "A"), printable(b.pose.name or "B")

    def write(sheet: Sheet) -> None:
        _say_given(sheet, [a, b], [(world, first), (world, second)])
        poses = [a.components(sheet, world, first), b.components(sheet, world, second)]
        end_with_pose(sheet, between(sheet, poses[0], poses[1], fraction), own, plan)

    return explained(f"{first} to {second} at {fraction!r}", write, plan)


def derive_lookup(
    frames: Frames, target: str, source: str, plan: DerivationStyle, *, at_ns: int | None = None,
    source_at_ns: int | None = None, fixed: str | None = None,
) -> Explanation:  # fmt: skip
    """Derive the pose of one frame of a tree in another; with `fixed` across two times."""
    if fixed is None:
        own = looked_up(frames, target, source, at_ns)
    else:
        own = looked_up_across(frames, target, at_ns, source, source_at_ns, fixed)

    def write(sheet: Sheet) -> None:
        if fixed is None:
            pose = chain(sheet, frames, target, source, at_ns)
        else:
            with sheet.about("where the target was"):
                first = chain(sheet, frames, target, fixed, at_ns)
            with sheet.about("where the source was"):
                second = chain(sheet, frames, fixed, source, source_at_ns)
            pose = joined_across(sheet, first, second, (printable(target), printable(fixed), printable(source)))
        end_with_pose(sheet, pose, own, plan)

    return explained(f"{printable(target)}_from_{printable(source)}", write, plan)
