"""Kernels of poses with a scale or a covariance: seven components alone, eight with a scale, 43 with a covariance.

The eighth is s of the similarity p' = s R p + t; the 36 are the entries that `uncertainty` describes.  A pose alone is
exact and has scale 1.  No pose has both.  Components are floats or arrays of one shape.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.geometry import rigid
from frametool.geometry.rigid import EXACT, SCALED, UNCERTAIN

if TYPE_CHECKING:
    from frametool.geometry.types import Components, Number, Rigid

NOT_BOTH = "the covariance cannot be carried through a scale; leave one of them out"
SIMILARITY = "scale: a similarity, not a pose; apply --transform, compose and invert take it"


def compose(a: Components, b: Components) -> Components:
    """Return a_from_c of a_from_b and b_from_c: s = s1 s2, R = R1 R2, t = t1 + s1 R1 t2."""
    if len(a) == len(b) == EXACT:
        return rigid.compose(*a, *b)
    first, second = pose_of(a), pose_of(b)
    if SCALED in (len(a), len(b)):
        if UNCERTAIN in (len(a), len(b)):
            raise ValueInvalid(NOT_BOTH)
        s1, s2 = scale_of(a), scale_of(b)
        x, y, z = second[:3]
        return (*rigid.compose(*first, s1 * x, s1 * y, s1 * z, *second[3:]), s1 * s2)
    from frametool.geometry import uncertainty

    entries = uncertainty.propagate_compose(first, covariance_of(a), second, covariance_of(b))
    return (*rigid.compose(*first, *second), *(entries or ()))


def inverse(a: Components) -> Components:
    """Return b_from_a of a_from_b: 1/s, R', -R' t / s."""
    pose = pose_of(a)
    x, y, z, *rotation = rigid.inverse(*pose)
    if len(a) == SCALED:
        s = scale_of(a)
        return (x / s, y / s, z / s, *rotation, 1.0 / s)
    if len(a) == EXACT:
        return (x, y, z, *rotation)
    from frametool.geometry import uncertainty

    return (x, y, z, *rotation, *uncertainty.propagate_inverse(pose, a[EXACT:]))


def relative(a: Components, b: Components) -> Components:
    """Return the pose of b in a: inverse(a) b."""
    pose = rigid.relative(*pose_of(a), *pose_of(b))
    if SCALED in (len(a), len(b)):
        raise ValueInvalid(SIMILARITY)
    return pose if len(a) == len(b) == EXACT else (*pose, *compose(inverse(a), b)[EXACT:])


def pose_of(a: Components) -> Rigid:
    """Return the seven components of a pose."""
    tx, ty, tz, x, y, z, w = a[:EXACT]
    return tx, ty, tz, x, y, z, w


def covariance_of(a: Components) -> Components | None:
    """Return the covariance of a pose; None if it is exact."""
    return a[EXACT:] if len(a) == UNCERTAIN else None


def scale_of(a: Components) -> Number:
    """Return the scale of a similarity; 1 for a pose."""
    return a[EXACT] if len(a) == SCALED else 1.0
