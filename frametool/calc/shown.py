"""Values as results: the mappings that machine formats write and read back, and the line a person reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.calc.demands import in_radians
from frametool.calc.tokens import CalcError
from frametool.calc.values import ANGLES, LIST, NUMBER, POSE, RADIAN, TREE, TWIST, unit_text
from frametool.errors import printable
from frametool.geometry.trig import RADIAN as DEGREES
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.calc.values import Term
    from frametool.grammar.result import Style


def plain_results(term: Term, style: Style) -> Iterator[Any]:
    """Yield a value as results: a pose as a Result, a number bare, all else a mapping; of a list each item."""
    type_ = term.type
    if type_.kind == TREE:
        raise CalcError(f"{term.text} is a tree; ask it: {term.text}[TARGET<-SOURCE]")
    if type_.kind == LIST:
        for item in term.items:
            yield from plain_results(item, style)
        return
    numbers = term.at(None)
    if type_.kind == POSE:
        yield Result(Pose.of(numbers, type_.source, type_.target))
    elif type_.kind == NUMBER:
        yield angle_in(term, degrees=style.degrees) if type_.unit == RADIAN else numbers[0]
    elif type_.kind == ANGLES:
        degrees = style.degrees
        angles = [each * DEGREES for each in numbers] if degrees else list(numbers)
        yield _in_frame(term) | {"rpy_deg" if degrees else "rpy": angles}
    else:
        yield _in_frame(term) | {type_.kind: list(numbers)}


def _in_frame(term: Term) -> dict[str, Any]:
    return {} if term.type.target is None else {"frame": term.type.target}


def angle_in(term: Term, *, degrees: bool) -> float:
    """Return an angle in degrees or radians; what was given in degrees comes out as it was."""
    if degrees and term.type.degrees:
        return float(term.at(None)[0])
    radians = float(in_radians(term).at(None)[0])
    return radians * DEGREES if degrees else radians


def line_of_value(term: Term, style: Style) -> str:
    """Return a value other than a pose or a point on a line, for a person."""
    type_, numbers = term.type, term.at(None)
    frame = "" if type_.target is None else f" in {printable(type_.target)}"
    if type_.kind == NUMBER and type_.unit == RADIAN:
        radians, degrees = (_text(angle_in(term, degrees=each), style) for each in (False, True))
        return f"{degrees} deg  ({radians} rad)\n" if style.degrees else f"{radians} rad  ({degrees} deg)\n"
    if type_.kind == NUMBER:
        return f"{_text(numbers[0], style)} {unit_text(type_.unit)}".rstrip() + "\n"
    if type_.kind == ANGLES:
        radians, degrees = ("  ".join(_text(each * unit, style) for each in numbers) for unit in (1.0, DEGREES))
        return f"rpy  {radians}  rad{frame}\n     {degrees}  deg\n"
    assert type_.kind == TWIST  # noqa: S101 - all other kinds are written elsewhere
    linear, angular = ("  ".join(_text(each, style) for each in part) for part in (numbers[:3], numbers[3:]))
    return f"linear  {linear}  m\nangular  {angular}  rad{frame}\n"


def _text(value: float, style: Style) -> str:
    return style.number(value + 0.0)
