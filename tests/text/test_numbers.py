"""Numbers follow YAML 1.2 and JSON; what looks like a number and is none says why."""

from __future__ import annotations

import ast
import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from frametool.errors import ValueInvalid, shown
from frametool.text.numbers import parse_angle, parse_number

NUMBERS = {
    "1e-3": 0.001,
    "1E5": 1e5,
    "1.0e5": 1e5,
    "1e+3": 1000.0,
    "+.5": 0.5,
    "-.5": -0.5,
    "5.": 5.0,
    "010": 10.0,
    "08": 8.0,
    "-0": -0.0,
    "0" * 5000 + "1": 1.0,
    "1e-400": 0.0,
    "0.1000000000000000055511151231257827021181583404541015625": 0.1,
}

REASONS = {
    "0x10": "not a decimal number",
    "0o10": "not a decimal number",
    "0b11": "not a decimal number",
    "1_000": "not a decimal number",
    "1:30": "not a decimal number",
    "12:30.5": "not a decimal number",
    "nan": "not finite",
    ".nan": "not finite",
    "-.inf": "not finite",
    "Infinity": "not finite",
    "1e400": "not finite",
    "9" * 5000: "not finite",
    "1,5": "decimal comma",
    "10cm": "bare number",
    "1.5 m": "bare number",
    "45deg": "unit",
    "${radians(90)}": "xacro",
    "$(arg x)": "xacro",
    "\u22121.5": "minus sign",
    "\uff11": "fullwidth digit one",
    "1\u00a0": "no-break space",
    "": "empty",
    "true": "truth value",
    "1 2 3": "several numbers",
    " 1": "blanks around",
    "foo": "not a number",
    "--1": "not a number",
    "1e": "not a number",
    ".": "not a number",
    "e5": "not a number",
}

ANGLES = {
    "1.5": (1.5, None),
    "90deg": (90.0, "deg"),
    "90 deg": (90.0, "deg"),
    "-1e1deg": (-10.0, "deg"),
    "90°": (90.0, "deg"),
    "1.57rad": (1.57, "rad"),
    "pi": (180.0, "deg"),
    "-pi": (-180.0, "deg"),
    "pi/2": (90.0, "deg"),
    "-3pi/4": (-135.0, "deg"),
    "2*pi": (360.0, "deg"),
    "2*pi/3": (120.0, "deg"),
    "0.5pi": (90.0, "deg"),
    "+pi / 6": (30.0, "deg"),
}


@pytest.mark.parametrize(("text", "value"), NUMBERS.items(), ids=lambda item: str(item)[:20])
def test_a_decimal_number_is_read(text: str, value: float) -> None:
    assert parse_number(text).hex() == value.hex()


@settings(deadline=None)
@given(some.floats(allow_nan=False, allow_infinity=False))
def test_shortest_text_reads_back_to_the_same_bits(value: float) -> None:
    assert parse_number(repr(value)).hex() == value.hex()


@pytest.mark.parametrize(("text", "reason"), REASONS.items(), ids=lambda item: ascii(item)[:20])
def test_what_is_no_number_says_why(text: str, reason: str) -> None:
    with pytest.raises(ValueInvalid, match=reason) as caught:
        parse_number(text)
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize(("text", "angle"), ANGLES.items())
def test_an_angle_keeps_the_unit_it_was_written_in(text: str, angle: tuple[float, str | None]) -> None:
    assert parse_angle(text) == angle


@pytest.mark.parametrize(
    "text", ["pi/0", "*pi", "90grad", "10cm", "pi2", "degrees", "", "1e400deg", "nan", "1,5deg", "1e308pi"]
)
def test_what_is_no_angle_is_refused(text: str) -> None:
    with pytest.raises(ValueInvalid):
        parse_angle(text)


@settings(max_examples=300, deadline=None)
@given(some.text(max_size=12) | some.text("0123456789.+-eE_:,x pi/*degra", max_size=12))
def test_any_text_is_a_finite_number_or_refused_in_one_line(text: str) -> None:
    for parse in (parse_number, lambda each: parse_angle(each)[0]):
        try:
            assert math.isfinite(parse(text))
        except ValueInvalid as error:
            assert "\n" not in str(error)  # noqa: PT017 - either outcome is right


LONG = 100_000  # with work that grew with the square of the length, each of these would take minutes
LONG_TEXTS = [
    "1" * LONG + "pi/" + "2" * LONG + "x", "1_" * LONG + "x", "_" * LONG + "x", "1" * LONG + "x", "1 " * LONG + "x",
    " " * LONG + "1" + " " * LONG + "x", "5" + " " * LONG + "\n", "1:" * LONG + "x", "1," * LONG, "." * LONG, "-" * LONG,
    "$" * LONG, "1" * LONG + "e", "1pi" + " " * LONG, "0x" + "_" * LONG + "g", "1." * LONG, "1e" * LONG, "\0" * LONG,
]  # fmt: skip


@pytest.mark.parametrize("text", LONG_TEXTS, ids=[f"{text[:4]!r} {number}" for number, text in enumerate(LONG_TEXTS)])
def test_long_texts_are_refused_in_time_that_grows_with_their_length(text: str) -> None:
    for parse in (parse_number, parse_angle):
        with pytest.raises(ValueInvalid):
            parse(text)


@given(some.text(max_size=200))
@settings(deadline=None)
def test_what_is_quoted_is_at_most_60_characters_escapes_included(text: str) -> None:
    quoted = re.sub(r"\.\.\. \([0-9]+ characters\)$", "", shown(text))
    assert len(quoted) <= 62
    assert quoted == repr(text) or text.startswith(ast.literal_eval(quoted))


@pytest.mark.parametrize("text", ["\x1b[31m" * 20, "\0" * 61, "\u202e" * 30, "x" * 61, "\U0001f600" * 59 + "\n\n"])
def test_a_quote_is_cut_between_characters_and_says_how_many_there_are(text: str) -> None:
    assert len(shown(text)) <= 62 + len(f"... ({len(text)} characters)")
    assert shown(text).endswith(f"... ({len(text)} characters)")
