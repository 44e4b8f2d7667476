"""`frametool.explain`: the derivation of an operation, as its command prints it with --explain."""

from __future__ import annotations

import sys
from inspect import signature
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.explain.derive import (
    ByPose,
    ByTree,
    DerivationStyle,
    derive_apply,
    derive_compose,
    derive_convert,
    derive_interpolate,
    derive_invert,
    derive_lookup,
    derive_relative,
    record_source,
)
from frametool.explain.follow import FollowStep, derive_follow
from frametool.explain.given import given_pose
from frametool.explain.sheet import DIGITS
from frametool.frames.lookups import Frames
from frametool.geometry.representations import notations
from frametool.grammar.result import Style

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.explain.render import Explanation


def explain(
    operation: str, *operands: Any, to: str = "quaternion", precision: int | None = DIGITS, full: bool = False,
    degrees: bool = False, keep_sign: bool = False, **options: Any,
) -> Explanation:  # fmt: skip
    """Derive what an operation does, step by step: formula, formula with these numbers, value with its unit.

        print(frametool.explain("convert", {"rpy_deg": [10, 20, 30]}, to="matrix"))
        frametool.explain("lookup", tree, "map", "camera", at_ns=2_500_000_000).markdown()

    operation, operands: convert POSE; compose POSE ..; invert POSE; relative A B; interpolate A B FRACTION;
        lookup TREE TARGET SOURCE (at_ns, source_at_ns, fixed); apply TREE TARGET SOURCE RECORD (at_ns, kind) or apply
        POSE RECORD (kind); follow STEPS of `follow_steps`.  A POSE is a mapping, its text, a Transform or a Rotation.
    to: notations separated by commas.  precision: significant digits, None for all.  full: also all products of long
    chains.  degrees: bare angles are in degrees, in and out.
    Raises ValueInvalid; what the operation raises.
    """
    if operation not in OPERATIONS:
        raise ValueInvalid(f"no operation {shown(operation)}{alternatives(operation, OPERATIONS, 'operations')}")
    if precision is not None and precision < 1:
        raise ValueInvalid(f"precision counts significant digits, 1 or more; found {precision}")
    chosen = tuple(form for spec in to.split(",") for form in notations(spec.strip()))
    plan = DerivationStyle(Style("text", chosen, degrees=degrees, keep_sign=keep_sign), precision, full)
    try:
        signature(OPERATIONS[operation]).bind(plan, *operands, **options)
    except TypeError as error:
        raise ValueInvalid(f"explain {operation}: {error}") from None
    poses = POSES.get(operation, 0)
    given = [given_pose(each, degrees=degrees) for each in operands[:poses]]
    return OPERATIONS[operation](plan, *given, *operands[poses:], **options)


def _convert(plan: DerivationStyle, pose: Any) -> Explanation:
    return derive_convert(pose, plan)


def _compose(plan: DerivationStyle, *poses: Any) -> Explanation:
    if not poses:
        raise ValueInvalid("compose takes at least one pose")
    return derive_compose(poses, plan)


def _invert(plan: DerivationStyle, pose: Any) -> Explanation:
    return derive_invert(pose, plan)


def _relative(plan: DerivationStyle, a: Any, b: Any) -> Explanation:
    return derive_relative(a, b, plan)


def _interpolate(plan: DerivationStyle, a: Any, b: Any, fraction: float) -> Explanation:
    return derive_interpolate(a, b, float(fraction), plan)


def _lookup(plan: DerivationStyle, tree: Frames, target: str, source: str, **options: Any) -> Explanation:
    if not isinstance(tree, Frames):
        raise ValueInvalid(f"expected a tree as frametool.load returns it, found {shown(tree)}")
    return derive_lookup(tree, target, source, plan, **options)


def _apply(plan: DerivationStyle, *operands: Any, at_ns: int | None = None, kind: str = "") -> Explanation:
    by_tree = bool(operands) and isinstance(operands[0], Frames)
    if len(operands) not in ((3, 4) if by_tree else (2,)):
        raise ValueInvalid("apply takes TREE TARGET [SOURCE] RECORD, or POSE RECORD")
    degrees = plan.style.degrees
    if by_tree:
        tree, target, *source, record = operands
        way: ByTree | ByPose = ByTree(tree, target, source[0] if source else None, at_ns)
    else:
        pose, record = operands
        way = ByPose(given_pose(pose, degrees=degrees))
    return derive_apply(way, record_source(record, kind), plan, kind=kind, degrees=degrees)


def _follow(plan: DerivationStyle, steps: Any) -> Explanation:
    found = [steps] if isinstance(steps, FollowStep) else list(steps) if isinstance(steps, (list, tuple)) else []
    if not found or not all(isinstance(each, FollowStep) for each in found):
        raise ValueInvalid(f"expected the steps of follow_steps, found {shown(steps)}")
    return derive_follow(found, plan)


POSES = {"convert": 1, "compose": sys.maxsize, "invert": 1, "relative": 2, "interpolate": 2}  # operands that are poses
OPERATIONS: dict[str, Callable[..., Explanation]] = {
    "convert": _convert,
    "compose": _compose,
    "invert": _invert,
    "relative": _relative,
    "interpolate": _interpolate,
    "lookup": _lookup,
    "apply": _apply,
    "follow": _follow,
}
