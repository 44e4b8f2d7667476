"""Functions of numbers: sines and their kin, roots; angles in degrees keep right angles exact."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.demands import in_radians, need, plain_angle, plain_number, wanted
from frametool.calc.values import NUMBER, PLAIN, PLAIN_NUMBER, RADIAN, Term, Type, made
from frametool.geometry import trig

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.calc.demands import Trees
    from frametool.geometry.types import Components, Namespace, Number


def _sincos(angle: Number, xp: Namespace, *, degrees: bool) -> Components:
    """Return sine and cosine; exact at whole quarter turns in degrees."""
    found: Components = (trig.half_sincos_deg if degrees else trig.half_sincos)(2.0 * angle, xp)
    return found


def trigonometric(pick: Callable[[Number, Number], Number]) -> Callable[[str, Sequence[Term], Trees], Term]:
    """Return the rule of a function of an angle, made of its sine and cosine."""
    def rule(name: str, terms: Sequence[Term], _: Trees) -> Term:
        angle = plain_angle(wanted(terms[0]), f"{name}()")
        degrees = angle.type.degrees

        def kernel(value: Number, xp: Namespace) -> Components:
            return (pick(*_sincos(value, xp, degrees=degrees)),)

        return made(PLAIN_NUMBER, kernel, angle)

    return rule


def arc(kernel: Callable[..., Number], bound: float | None) -> Callable[[str, Sequence[Term], Trees], Term]:
    """Return the rule of a function whose value is an angle; `bound` is the largest number it takes."""
    def rule(name: str, terms: Sequence[Term], _: Trees) -> Term:
        def check(value: float) -> str:
            return f"{name}() takes -1 .. 1, found {value:g}" if bound is not None and abs(value) > bound else ""

        number = plain_number(wanted(terms[0]), f"{name}()")
        return made(Type(NUMBER, unit=RADIAN), lambda value, xp: (kernel(value, xp),), number, check=check)

    return rule


def arcsine(value: Number, xp: Namespace) -> Number:
    """Return the angle of a sine."""
    return trig.bearing(value, xp.sqrt((1.0 - value) * (1.0 + value)), 1.0, xp)


def arccosine(value: Number, xp: Namespace) -> Number:
    """Return the angle of a cosine."""
    return trig.bearing(xp.sqrt((1.0 - value) * (1.0 + value)), value, 1.0, xp)


def arctangent(value: Number, xp: Namespace) -> Number:
    """Return the angle of a tangent of any size."""
    steep = abs(value) > 1.0
    small = xp.where(steep, 1.0 / xp.where(steep, value, 1.0), value)
    angle = xp.doubled_arctan(small / (1.0 + xp.sqrt(1.0 + small * small)))
    return xp.where(steep, xp.copysign(trig.RIGHT_ANGLE, value) - angle, angle)


def sqrt(name: str, terms: Sequence[Term], _: Trees) -> Term:
    """Take the square root of a number and of its unit."""
    def check(value: float) -> str:
        return f"{name}() takes what is not negative, found {value:g}" if value < 0.0 else ""

    number = in_radians(need(wanted(terms[0]), (NUMBER,), name))
    unit = number.type.unit
    type_ = Type(NUMBER, unit=(unit[0] / 2.0, unit[1] / 2.0, unit[2] / 2.0)) if unit != PLAIN else PLAIN_NUMBER
    return made(type_, lambda value, xp: (xp.sqrt(value),), number, check=check)
