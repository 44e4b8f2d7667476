"""What operators and functions demand of their values: one frame, the same frames, plain numbers, angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc import suggest
from frametool.calc.tokens import CalcError
from frametool.calc.values import ANGLES, LIST, NUMBER, PLAIN, POSE, RADIAN, TO_RADIANS, TREE, Term, Type, made, meet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.lookups import Frames

    Trees = Sequence[tuple[str, Frames]]


def in_radians(term: Term) -> Term:
    """Return an angle with its number in radians."""
    if not term.type.degrees:
        return term
    return made(term.type._replace(degrees=False), lambda angle: (angle * TO_RADIANS,), term, functions=False)


def wanted(term: Term) -> Term:
    """Refuse a tree or a list where one value is wanted."""
    if term.type.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if term.type.kind == LIST:
        raise CalcError(f"{term.text} is a list of {len(term.items)}; only mean(..) takes one")
    return term


def common(left: Term, right: Term, trees: Trees) -> str | None:
    """Return the one frame that two points or vectors are seen in."""
    a, b = left.type, right.type
    if not meet(a.target, b.target):
        hint = suggest.for_other_frame(left, right, trees)
        raise CalcError(f"{a.named} and {b.named}: both must be seen from one frame{hint}")
    return a.target if a.target is not None else b.target


def same_frames(terms: Sequence[Term], what: str) -> Type:
    """Return the frames that all of some poses have; refuse poses of different ones."""
    first = terms[0]
    type_ = first.type
    for term in terms[1:]:
        other = term.type
        if not (meet(type_.target, other.target) and meet(type_.source, other.source)):
            hint = suggest.for_same_frames(first, term)
            raise CalcError(f"{what} needs two poses of the same frames, found {type_} and {other}{hint}")
        type_ = Type(
            POSE,
            other.target if type_.target is None else type_.target,
            other.source if type_.source is None else type_.source,
        )
    return type_


def one_target(left: Term, right: Term, what: str, trees: Trees) -> None:
    """Refuse two poses that are not seen from one frame; whose poses they are may differ."""
    if not meet(left.type.target, right.type.target):
        hint = suggest.for_one_target(left, right, trees)
        raise CalcError(f"{what} compares two poses seen from one frame, found {left.type} and {right.type}{hint}")


def plain_angle(term: Term, what: str) -> Term:
    """Take an angle, or a plain number as radians."""
    if term.type.kind != NUMBER or term.type.unit not in (PLAIN, RADIAN):
        raise CalcError(f"{what} takes an angle, found {term.type.named}")
    return term


def plain_number(term: Term, what: str) -> Term:
    """Take a number without a unit."""
    if term.type.kind != NUMBER or term.type.unit != PLAIN:
        raise CalcError(f"{what} takes a plain number, found {term.type.named}")
    return term


def need(term: Term, kinds: Sequence[str], what: str) -> Term:
    """Refuse a value of another kind."""
    if term.type.kind not in kinds:
        articles = " or ".join(f"a {kind}" if kind != ANGLES else kind for kind in kinds)
        raise CalcError(f"{what}() takes {articles}, found {term.type.named}")
    return term
