"""What a row has beside its point or pose: a covariance or a scale, read as its shape says, and moved along.

Loaded where a row or what moves it has one.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from frametool.errors import ValueInvalid
from frametool.geometry import rigid, uncertainty
from frametool.geometry.placed import inverse, pose_of, scale_of
from frametool.geometry.quaternion import TOLERATED
from frametool.geometry.rigid import EXACT, SCALED
from frametool.grammar.covariance import in_unit, of_sigmas
from frametool.stream.row_layout import IDENTITY, MOVERS, POINT, POSE, TWIST, VECTOR, WRENCH

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.geometry.types import Components, Namespace
    from frametool.stream.row_layout import Shape

MIRRORED = "the covariance cannot be carried through axes that mirror; leave it out"
SCALED_ALONE = (POINT, VECTOR, POSE)  # what a similarity moves


def with_own(
    shape: Shape, pose: Components, beside: Components, mover: Components | None, *, mirrors: bool
) -> tuple[Components, Components]:
    """Return a row's pose with its own covariance or scale, and what else stands beside it."""
    size = shape.covariance[0]
    given, rest = beside[:size], beside[size:]
    if mirrors and size > 1:
        raise ValueInvalid(MIRRORED)
    if shape.sigma:
        given = expanded(shape, given)
    elif size == uncertainty.POINT:  # of the position, or of the turn, alone: they turn as that of a vector
        if mover is not None and len(mover) > EXACT:
            raise ValueInvalid(f"covariance has {size} numbers; 36 are needed (6x6) where others count too")
        count = sum(shape.covariance)
        parts = [beside[at : at + size] for at in range(0, count, size)]
        turned = [part if mover is None else uncertainty.rotate_covariance(part, *mover[3:]) for part in parts]
        return pose, (*chain.from_iterable(turned), *beside[count:])
    if shape.inverse:
        back = inverse((*rigid.inverse(*pose), *given))
        return (back if size == 1 else (*pose, *back[EXACT:])), rest
    return (*pose, *given), rest


def of_multiple(
    shape: Shape, own: Components, rotation: Callable[[Components], Components], xp: Namespace
) -> Components:
    """Return the pose of a matrix that may be s R, and s: the root mean square of what each row is long.

    An s that is 1 to what a rotation may be off is 1; whether the rest is a rotation, `rotation` tells.
    """
    size = xp.sqrt(sum(entry * entry for entry in shape.rotation(own)) / 3.0)
    s = xp.where(abs(size - 1.0) <= TOLERATED, size - size + 1.0, size)
    bare = tuple(number / s if at in shape.rotation_at else number for at, number in enumerate(own))
    pose = pose_of((*shape.position(own), *rotation(bare)))
    return inverse((*pose, s)) if shape.inverse else (*pose, s)


def along_ecef(shape: Shape, own: Components, beside: Components) -> tuple[Shape, Components]:
    """Return what stands beside a place with its covariance along the axes of ECEF, from the axes there."""
    size, place = shape.covariance[0], shape.place
    given = beside[:size]
    if shape.sigma:
        given = expanded(shape, given)
        given = given if shape.kind == POSE else tuple(given[6 * i + j] for i in range(3) for j in range(3))
    turn = place._replace(level=False).turned(own[: place.size], IDENTITY) if place is not None else IDENTITY
    made = shape._replace(covariance=(len(given), *shape.covariance[1:]), sigma=())
    return made, (*uncertainty.rotate_covariance(given, *turn), *beside[size:])


def expanded(shape: Shape, numbers: Components) -> Components:
    """Return the covariance of a row's sigmas."""
    zero = numbers[0] - numbers[0]
    return of_sigmas([zero if at < 0 else in_unit(numbers[at], unit) for at, unit in shape.sigma])


def move(shape: Shape, own: Components, beside: Components, mover: Components, *, mirrors: bool) -> Components:
    """Move what is no pose by one, with its covariances; one that has a covariance gives what moves its own."""
    pose, kind = pose_of(mover), shape.kind
    if mirrors and shape.covariance:
        raise ValueInvalid(MIRRORED)
    if shape.sigma:
        given = expanded(shape, beside)
        beside = (*(given[6 * i + j] for i in range(3) for j in range(3)), *beside[shape.covariance[0] :])
        shape = shape._replace(covariance=(uncertainty.POINT,), sigma=())
    if len(mover) == SCALED:
        if kind not in SCALED_ALONE or shape.covariance:
            what = "a covariance" if shape.covariance else f"a {kind}"
            raise ValueInvalid(f"{what} cannot be carried through a scale; points, vectors and poses can")
        s = scale_of(mover)
        x, y, z = own
        return (*MOVERS[kind](*pose, s * x, s * y, s * z), *beside)
    moved = MOVERS[kind](*pose, *own)
    if len(mover) > EXACT:
        if kind not in (POINT, VECTOR):
            raise ValueInvalid(f"the covariance cannot be carried through to a {kind}; leave --covariance out")
        carry = uncertainty.of_point if kind == POINT else uncertainty.of_vector
        size = sum(shape.covariance[:1])
        found = carry(pose, mover[EXACT:], own, beside[:size] or None)
        return (*moved, *(found or ()), *beside[size:])
    for size in shape.covariance:
        if kind in (TWIST, WRENCH):
            turned = uncertainty.of_moved(MOVERS[kind], pose, beside[:size])
        else:
            turned = uncertainty.rotate_covariance(beside[:size], *pose[3:])
        moved, beside = (*moved, *turned), beside[size:]
    return (*moved, *beside)
