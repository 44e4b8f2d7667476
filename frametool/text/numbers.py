"""Read numbers, lengths and angles as people write them, each from its own text.

A number is one of YAML 1.2 and JSON (`1e-3`, `-.5`, `5.`, `010` is ten); the additions of YAML 1.1 (base 60,
octal, hexadecimal, underscores) are refused with the reason.  Units follow numbers and names of columns: `2cm`,
`x_mm`, `yaw [deg]`; an angle may also be a multiple of pi.
"""

from __future__ import annotations

import math
import re

from frametool.errors import ValueInvalid, shown

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import TypeAlias

    Angle: TypeAlias = tuple[float, str | None]  # value; "deg", "rad", or None if the text has no unit

LENGTHS = {"": 1.0, "m": 1.0, "cm": 100.0, "mm": 1000.0, "um": 1e6}  # units per metre
ANGLES = {"deg": True, "degree": True, "degrees": True, "°": True, "rad": False, "radian": False, "radians": False}
BRACKETS = r"(?<!\s)\s*+[\[(]\s*+((?:\s*+[^\[\]()\s]++)*+)\s*+[\])]$"


# float() also reads blanks, underscores, nan and other scripts' digits; of these characters only decimal numbers
_DECIMAL_CHARACTERS = "0123456789.-+eE"
_strip = str.strip  # raises TypeError for anything but text
_INFINITE = float("inf")
# possessive: no backtracking, which would need quadratic time
_DECIMAL = r"(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?+[0-9]++)?+"
# patterns are compiled at first use, not at start-up: most texts are plain numbers
_WITH_UNIT = rf"([-+]?{_DECIMAL}) ?(deg|rad|°)"
_MULTIPLE_OF_PI = rf"([-+]?)({_DECIMAL})? ?\*? ?(?:pi|π) ?(?:/ ?({_DECIMAL}))?"
_LENGTH = rf"([-+]?{_DECIMAL}) ?(m|cm|mm|um)"
MOST_FRACTIONS = 1_000_000  # of one range
_ODD_MINUS = "\u2212\u2010\u2011\u2012\u2013\u2014\ufe63\uff0d"


class NotFinite(ValueInvalid):
    """A number that is nan, inf, or beyond the range of doubles."""

    rule = "not-finite"


def parse_number(text: str) -> float:
    """Read a finite decimal number, correctly rounded.

    Raises ValueInvalid with a message that quotes the text and the reason.
    """
    if not _strip(text, _DECIMAL_CHARACTERS):
        try:
            value = float(text)
        except ValueError:
            pass
        else:
            if -_INFINITE < value < _INFINITE:
                return value
    raise _refusal(text, _reason(text))


def parse_angle(text: str) -> Angle:
    """Read an angle: a number, `90deg`, `90 deg`, `90°`, `1.57rad`, `pi/2`, `-3pi/4`, `2*pi`.

    Returns the value and its unit "deg" or "rad", or None if the text has no unit.
    Multiples of pi are returned in degrees: pi/2 is (90.0, "deg"), so that quarter turns are exact.
    Raises ValueInvalid.
    """
    if not _strip(text, _DECIMAL_CHARACTERS):
        return parse_number(text), None
    if match := re.fullmatch(_WITH_UNIT, text):
        return parse_number(match[1]), "rad" if match[2] == "rad" else "deg"
    if (match := re.fullmatch(_MULTIPLE_OF_PI, text)) and not re.match(r"[-+]? ?\*", text):
        divisor = parse_number(match[3] or "1")
        if not divisor:
            raise ValueInvalid(f"{shown(text)} divides by zero")
        degrees = parse_number(match[2] or "1") * 180.0 / divisor  # multiplied first: 3pi/4 is 540 / 4, exact
        if degrees == _INFINITE:
            raise NotFinite(f"{shown(text)} is not finite")
        return -degrees if match[1] == "-" else degrees, "deg"
    reason = _reason(text)
    if reason in {_UNKNOWN, _UNIT, _ANGLE} and re.search("deg|rad|pi|°|π", text, re.IGNORECASE):
        reason = "is not an angle; write a number, 90deg, 1.57rad or pi/2"
    elif reason == _UNIT:
        reason = "is not an angle: the units are deg and rad"
    raise _refusal(text, reason)


def parse_length(text: str) -> float:
    """Read a length in metres: a number, or `2cm`, `20 mm`, `0.02m`, `20um`; raises ValueInvalid."""
    if not _strip(text, _DECIMAL_CHARACTERS):
        return parse_number(text)
    if match := re.fullmatch(_LENGTH, text):
        return parse_number(match[1]) / LENGTHS[match[2]]  # dividing rounds once: 0.02 from 2cm
    reason = _reason(text)
    if reason in {_UNKNOWN, _UNIT, _ANGLE} and any(map(str.isdigit, text)):
        reason = _NO_LENGTH
    raise _refusal(text, reason)


def parse_share(text: str) -> float:
    """Read a share, `10%` or a number from 0 to 1; raises ValueInvalid."""
    found = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*(%?)", text.strip())
    share = float(found[1]) / (100 if found[2] else 1) if found else 2.0
    if share > 1.0:
        raise ValueInvalid(f"{shown(text)} is not a share; write 10%, or 0.1")
    return share


def parse_lengths(text: str) -> tuple[float, ...]:
    """Read positive lengths in metres, with commas between them; raises ValueInvalid."""
    try:
        lengths = tuple(float(each.strip().removesuffix("m")) for each in text.split(","))
    except ValueError:
        lengths = ()
    if not lengths or min(lengths) <= 0:
        raise ValueInvalid(f"{shown(text)} are no lengths; write metres with commas: 100,200,400")
    return lengths


def parse_fractions(text: str) -> list[float]:
    """Read a fraction, several separated by commas, or START:STOP:STEP with decimal steps."""
    if ":" not in text:
        return [parse_number(each.strip()) for each in text.split(",")]
    from decimal import Decimal

    parts = text.split(":")
    if len(parts) != 3:
        raise ValueInvalid(f"{shown(text)} is not a range; a range is START:STOP:STEP, as 0:1:0.25")
    start, stop, step = (Decimal(repr(parse_number(each.strip()))) for each in parts)
    if step <= 0 or stop < start:
        raise ValueInvalid(f"{shown(text)}: STEP must be positive and STOP not before START")
    count = int((stop - start) / step) + 1
    if count > MOST_FRACTIONS:
        raise ValueInvalid(f"{shown(text)} has more than {MOST_FRACTIONS} fractions")
    return [float(start + at * step) for at in range(count)]


def number_or_none(text: str) -> float:
    """Read a number, nan for an empty text; raises ValueInvalid."""
    return parse_number(text) if text else math.nan


def read_number_or_angle(
    text: str, degrees: bool | None, *, metres: bool = False  # noqa: FBT001 - None: not an angle
) -> float:
    """Read a cell: a number, an angle or a length, plain or with a unit; raises ValueInvalid.

    degrees: unit of a plain angle and of the result, False for radians; None: not an angle
    metres: True for a length
    """
    if degrees is None:
        return parse_length(text) if metres else parse_number(text)
    value, unit = parse_angle(text)
    if unit is None or (unit == "deg") == degrees:
        return value
    return math.degrees(value) if degrees else math.radians(value)


def _refusal(text: str, reason: str) -> ValueInvalid:
    """Return NotFinite for nan, inf and numbers beyond doubles, ValueInvalid for anything else that is not a number."""
    return (NotFinite if reason == _NOT_FINITE else ValueInvalid)(f"{shown(text)} {reason}")


def explain_number(text: str) -> str:
    """Return why a text is not a number, and what to write instead."""
    return f"{shown(text)} {_reason(text)}"


_UNKNOWN = "is not a number"
_NO_LENGTH = "is not a length; write metres, or a unit: 2cm, 20mm, 0.02m"


def half_unit(text: str) -> float:
    """Return half a unit of the last written digit of a number; 0 without a point: such a number is exact."""
    digits, _, exponent = text.strip(" \t\"'").lower().partition("e")
    _, point, decimals = digits.partition(".")
    return 0.5 * 10.0 ** min(int(exponent or 0) - len(decimals), 300) if point and decimals.isdigit() else 0.0


_UNIT = "has a unit where a bare number is expected"
_ANGLE = "is an angle with a unit where a bare number is expected"


def _reason(text: str) -> str:
    """Return the first known mistake in a text that is not a number."""
    if bad := odd_characters(text):
        return f"has {bad}"
    return next((reason for pattern, reason in _MISTAKES if re.fullmatch(pattern, text, _LOOSELY)), _UNKNOWN)


_NOT_FINITE = "is not finite"
_NOT_DECIMAL = "is not a decimal number"
_LOOSELY = re.IGNORECASE | re.DOTALL
_MISTAKES = (
    (r"\s*", "is empty where a number is expected"),
    (r"[-+]?\.?(nan|inf|infinity)", _NOT_FINITE),
    (rf"[-+]?{_DECIMAL}", _NOT_FINITE),
    (r".*\$[({].*", "is a xacro expression; expand it with xacro first"),
    (r"[-+]?[0-9]+,[0-9]+(e[-+]?[0-9]+)?", "has a decimal comma; write a point"),
    (r"[-+]?0x[0-9a-f_]+|[-+]?0[ob][0-9_]+", f"{_NOT_DECIMAL}; write it in base ten"),
    (r"[-+]?[0-9]+(:[0-9]+)+(\.[0-9]*)?", f"{_NOT_DECIMAL}; base 60 is not read"),
    (r"[-+]?[0-9.]*+_[0-9._]*+(e[-+]?[0-9_]+)?", f"{_NOT_DECIMAL}; leave out the underscores"),
    (rf"\s++[-+]?{_DECIMAL}\s*|[-+]?{_DECIMAL}\s+", "has blanks around the number"),
    (rf"[-+]?{_DECIMAL}(\s++[-+]?{_DECIMAL})++", "is several numbers where one is expected"),
    (r"true|false|yes|no|on|off", "is a truth value where a number is expected"),
    (r"null|~", "is empty where a number is expected"),
    (rf"[-+]?{_DECIMAL}e[-+]?", _UNKNOWN),
    (rf"[-+]?{_DECIMAL}\s*(deg|rad|°)(rees|ians?)?|{_MULTIPLE_OF_PI}", _ANGLE),
    (rf"[-+]?{_DECIMAL}\s*[a-zµ°%\"'].*", _UNIT),
)


def odd_characters(text: str) -> str:
    """Return a description of the first look-alike character: minus signs, wide digits, invisible blanks.

    Returns "" without such characters.
    """
    bad = next((c for c in text if ord(c) > 126 and (c in _ODD_MINUS or c.isdigit() or not c.isprintable())), None)
    if bad is None:
        return ""
    from unicodedata import name

    kind = "a look-alike of '-'" if bad in _ODD_MINUS else "a digit of another script" if bad.isdigit() else "invisible"
    return f"{name(bad, 'a control character').lower()} (U+{ord(bad):04X}), {kind}"
