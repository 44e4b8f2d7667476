"""`frametool.explain`: the derivation of an operation, as its command prints it with --explain."""

from __future__ import annotations

import sys
from inspect import signature
from typing import TYPE_CHECKING, Any

from frametool.documents.source import Source
from frametool.errors import ValueInvalid, alternatives, shown
from frametool.explain import derive
from frametool.explain.derive import DerivationStyle, WrittenPose
from frametool.explain.run import DIGITS
from frametool.frames.lookups import Frames
from frametool.geometry.representations import notation, notations
from frametool.geometry.rotation import Rotation
from frametool.geometry.transform import Transform
from frametool.grammar.pose import Pose
from frametool.grammar.result import Style
from frametool.sim.followed import FollowStep, derive_follow
from frametool.stream.request import RowOptions
from frametool.stream.written import ByTree, derive_record, written_poses

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.explain.render import Explanation

INLINE = "argument"


def explain(
    operation: str, *operands: Any, to: str = "quaternion", precision: int | None = DIGITS, degrees: bool = False,
    keep_sign: bool = False, **options: Any,
) -> Explanation:  # fmt: skip
    """Derive an operation step by step: formula, formula with these numbers, value with its unit.

        print(frametool.explain("convert", {"rpy_deg": [10, 20, 30]}, to="matrix"))
        frametool.explain("lookup", tree, "map", "camera", at_ns=2_500_000_000).markdown()

    operation, operands: convert POSE; compose POSE ..; invert POSE; relative A B; interpolate A B FRACTION;
        lookup TREE TARGET SOURCE (at_ns, source_at_ns, fixed); apply TREE TARGET SOURCE RECORD (at_ns, kind) or apply
        POSE RECORD (kind); follow STEPS of `follow_steps`.  A POSE is a mapping, its text, a Transform or a Rotation.
    to: notations separated by commas.  precision: significant digits, None for all.  degrees: bare angles are in
        degrees, in and out.
    Raises ValueInvalid; also the errors of the operation.
    """
    if operation not in OPERATIONS:
        raise ValueInvalid(f"no operation {shown(operation)}{alternatives(operation, OPERATIONS, 'operations')}")
    if precision is not None and precision < 1:
        raise ValueInvalid(f"precision counts significant digits, 1 or more; found {precision}")
    chosen = tuple(each for spec in to.split(",") for each in notations(spec.strip()))
    plan = DerivationStyle(Style("text", chosen, degrees=degrees, keep_sign=keep_sign), precision)
    try:
        signature(OPERATIONS[operation]).bind(plan, *operands, **options)
    except TypeError as error:
        raise ValueInvalid(f"explain {operation}: {error}") from None
    poses = POSES.get(operation, 0)
    written = [_pose(each, degrees=degrees) for each in operands[:poses]]
    return OPERATIONS[operation](plan, *written, *operands[poses:], **options)


def _pose(value: Any, *, degrees: bool) -> WrittenPose:
    """Read one pose: a mapping, its text, a Transform or a Rotation.

    Raises ValueInvalid, FormatError.
    """
    if isinstance(value, (str, dict, list)):
        found = written_poses(_source(value), degrees=degrees)
        if len(found) != 1:
            raise ValueInvalid(f"a derivation is of one pose, {INLINE} holds {len(found)}")
        return found[0]
    if not isinstance(value, (Transform, Rotation)) or value.shape:
        raise ValueInvalid(f"expected one pose: a mapping, its text, a Transform or a Rotation; found {value!r:.60}")
    pose = Pose.of(value.components) if isinstance(value, Transform) else Pose(None, value.components)
    x, y, z, *rotation = pose.components
    return WrittenPose(pose, notation("quaternion"), rotation, position=(x, y, z))


def _source(value: Any) -> Source:
    """Return a text, or a mapping or list as text."""
    from frametool.documents.json import dump

    return Source(INLINE, value if isinstance(value, str) else dump(value))


def _apply(plan: DerivationStyle, *operands: Any, at_ns: int | None = None, kind: str = "") -> Explanation:
    by_tree = bool(operands) and isinstance(operands[0], Frames)
    if len(operands) not in ((3, 4) if by_tree else (2,)):
        raise ValueInvalid("apply takes TREE TARGET [SOURCE] RECORD, or POSE RECORD")
    degrees = plan.style.degrees
    if by_tree:
        tree, target, *source, record = operands
        way: ByTree | WrittenPose = ByTree(tree, target, source[0] if source else None, at_ns)
    else:
        pose, record = operands
        way = _pose(pose, degrees=degrees)
    if not isinstance(record, (str, dict)):
        try:
            x, y, z = map(float, record)
        except (TypeError, ValueError):
            raise ValueInvalid(f"expected three numbers or a mapping, found {shown(record)}") from None
        record = {kind or "point": [x, y, z]}
    return derive_record(plan, way, _source(record), RowOptions(kind=kind, degrees=degrees))


def _follow(plan: DerivationStyle, steps: Any) -> Explanation:
    found = [steps] if isinstance(steps, FollowStep) else list(steps) if isinstance(steps, (list, tuple)) else []
    if not found or not all(isinstance(each, FollowStep) for each in found):
        raise ValueInvalid(f"expected the steps of follow_steps, found {shown(steps)}")
    return derive_follow(plan, found)


POSES = {"convert": 1, "compose": sys.maxsize, "invert": 1, "relative": 2, "interpolate": 2}  # operands that are poses
OPERATIONS: dict[str, Callable[..., Explanation]] = {
    "convert": derive.convert, "compose": derive.compose, "invert": derive.invert, "relative": derive.relative,
    "interpolate": derive.interpolate, "lookup": derive.lookup, "apply": _apply, "follow": _follow,
}  # fmt: skip
