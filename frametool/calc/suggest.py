"""What to write instead: expressions whose frames touch, found by trying, as texts that can be pasted.

A term appears as it was typed: bound names by their names, literals as they are, look-ups in a named tree as d[..].
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.tokens import frame_text
from frametool.errors import shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.calc.values import Term
    from frametool.frames.lookups import Frames

MOST = 2
"""Suggestions in one message."""


def _forms(term: Term) -> tuple[tuple[str, str | None, str | None], ...]:
    """Return a pose and its inverse: text, target, source."""
    target, source = term.type.target, term.type.source
    return (term.bracketed, target, source), (f"inv({term.text})", source, target)


def rewritten_products(left: Term, right: Term) -> Iterator[str]:
    """Yield the products of two poses, either inverted or not, in either order, whose frames touch."""
    pairs = [(a, b) for a in _forms(left) for b in _forms(right)]
    swapped = [(b, a) for a, b in pairs]
    tried = [pairs[2], pairs[1], pairs[3], swapped[0], swapped[1], swapped[2], swapped[3]]
    for (first, target, between), (second, touching, source) in tried:
        if between is not None and between == touching:
            yield f"{first} * {second}  (= {frame_text(target)}<-{frame_text(source)})"


def for_product(left: Term, right: Term, trees: Iterable[tuple[str, Frames]]) -> str:
    """Say how two poses that do not touch can be multiplied."""
    found = list(rewritten_products(left, right))[:MOST]
    if found:
        return f"frames that touch: {', or '.join(found)}"
    between = _looked_up(left.type.source, right.type.target, trees)
    return f"a lookup between them is missing: {between or _arrow(left.type.source, right.type.target)}"


def for_point(pose: Term, point: Term, trees: Iterable[tuple[str, Frames]]) -> str:
    """Say how a point in another frame can be moved."""
    if point.type.target == pose.type.target:
        return f"inv({pose.text}) takes points in {frame_text(pose.type.target)}"
    between = _looked_up(pose.type.source, point.type.target, trees)
    return f"{between or _arrow(pose.type.source, point.type.target)} stands between"


def for_same_frames(left: Term, right: Term) -> str:
    """Say how two poses of different frames go together; "" where nothing is found."""
    a, b = left.type, right.type
    if a.target is not None and a.target == b.source and a.source == b.target:
        return f"; inv({right.text}) is {frame_text(b.source)}<-{frame_text(b.target)}"
    if a.target is not None and a.target == b.target and a.source != b.source:
        seen = f"{frame_text(b.source)} seen from {frame_text(a.source)}"
        return f"; for {seen}: inv({left.text}) * {right.bracketed}"
    return ""


def for_one_target(left: Term, right: Term, trees: Iterable[tuple[str, Frames]]) -> str:
    """Say how two poses come to be seen from one frame; "" where nothing is found."""
    a, b = left.type, right.type
    if b.source == a.target:
        return f"; write inv({right.text}) for the second"
    if a.source == b.target:
        return f"; write inv({left.text}) for the first"
    if a.source is not None and a.source == b.source:
        return f"; write inv(..) for both: inv({left.text}), inv({right.text})"
    if (over := _looked_up(a.target, b.target, trees)) is not None:
        return f"; bring the second over: ({over}) * {right.bracketed}"
    return f"; a lookup between them is missing: {_arrow(a.target, b.target)}"


def for_other_frame(left: Term, right: Term, trees: Iterable[tuple[str, Frames]]) -> str:
    """Say how the second of two points or vectors comes into the frame of the first."""
    over = _looked_up(left.type.target, right.type.target, trees)
    if over is None:
        return f"; a lookup between them is missing: {_arrow(left.type.target, right.type.target)}"
    return f"; bring the second over: ({over}) * {right.bracketed}"


def _arrow(target: str | None, source: str | None) -> str:
    return f"{frame_text(target)}<-{frame_text(source)}"


def _looked_up(target: str | None, source: str | None, trees: Iterable[tuple[str, Frames]]) -> str | None:
    """Return a look-up of one of some trees, by name, that knows both frames; None where none does."""
    for name, tree in trees:
        if target in tree.frames and source in tree.frames and _connected(tree, target, source):
            return f"{name}[{_arrow(target, source)}]" if name else _arrow(target, source)
    return None


def _connected(tree: Frames, target: str | None, source: str | None) -> bool:
    """Tell whether a tree knows where one frame is seen from another."""
    from frametool.errors import LookupFailed

    try:
        tree.lookup_components(str(target), str(source))
    except LookupFailed:
        return False
    return True


def refuse_frames(left: Term, right: Term) -> str:
    """Name the two frames that do not touch."""
    return f"{shown(left.type.source)} and {shown(right.type.target)} do not touch"

