from __future__ import annotations

import math
import re
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numbers_at_hand import HOSTILE, NO_NUMBERS, NUMBERS, SHAPES, random_bits

from frametool.text.parse import parse_floats
from frametool.text.spans import MARGIN, Spans, framed

PLAIN_NUMBER = re.compile(r"[ \t]*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?[ \t]*", re.ASCII)
FINITE = [value for value in HOSTILE if math.isfinite(value)]


def spans_of(texts: list[str]) -> Spans:
    lengths = np.array([len(text) for text in texts], np.int64)
    ends = MARGIN + np.cumsum(lengths + 1) - 1
    return Spans(framed("\n".join(texts).encode("latin1")), ends - lengths, ends)


def read(texts: list[str]) -> list[str]:
    """Give the floats in hexadecimals, so that every bit counts, and `bad` for those reported."""
    values, bad = parse_floats(spans_of(texts))
    return ["bad" if place in bad else value.hex() for place, value in enumerate(values.tolist())]


def read_by_python(texts: list[str]) -> list[str]:
    good = [bool(PLAIN_NUMBER.fullmatch(text)) and math.isfinite(float(text)) for text in texts]
    return [float(text).hex() if fine else "bad" for text, fine in zip(texts, good, strict=True)]


@pytest.mark.parametrize("style", ["%r", "%.6f", "%.18e", "%.9f", "%.17g", "%.25f", "%.0f", " %.6f"])
def test_every_hostile_float_reads_as_python_reads_it(style: str) -> None:
    texts = [style % value for value in FINITE]
    assert read(texts) == read_by_python(texts)


@pytest.mark.parametrize("text", [*NUMBERS, *SHAPES])
def test_a_number_reads_as_python_reads_it(text: str) -> None:
    assert read([text, "1.5"]) == [float(text).hex(), (1.5).hex()]


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_what_is_no_plain_number_is_reported_and_nan(text: str) -> None:
    values, bad = parse_floats(spans_of(["1.0", text, "2.0"]))
    assert bad.tolist() == [1]
    assert [values[0], values[2]] == [1.0, 2.0]
    assert math.isnan(values[1])


@given(st.lists(st.text("0123456789.eE+- \t:/", max_size=14), max_size=12))
def test_texts_nearly_numbers_are_judged_as_python_judges_them(texts: list[str]) -> None:
    assert read(texts) == read_by_python(texts)


@given(st.lists(st.from_regex(PLAIN_NUMBER, fullmatch=True), max_size=12))
def test_any_plain_numbers_together_read_as_python_reads_them(texts: list[str]) -> None:
    assert read(texts) == read_by_python(texts)


@given(st.floats(min_value=1e-10, max_value=1e15), st.integers(14, 40))
def test_middles_of_two_floats_and_their_neighbourhood_read_as_python_reads_them(value: float, digits: int) -> None:
    with localcontext() as context:
        context.prec = 900
        middle = (Decimal(value) + Decimal(float(np.nextafter(value, np.inf)))) / 2
        texts = [f"{middle:f}", f"{middle:f}"[:digits], f"{middle:.{digits}e}", f"{middle:.17e}"]
    assert read(texts) == read_by_python(texts)


def test_values_keep_the_shape_of_their_cells_and_bad_places_their_order() -> None:
    flat = spans_of(["1", "x", "2", "3", "4", ""])
    values, bad = parse_floats(Spans(flat.data, flat.starts.reshape(3, 2), flat.ends.reshape(3, 2)))
    assert values.shape == (3, 2)
    assert values[1].tolist() == [2.0, 3.0]
    assert bad.tolist() == [1, 5]


def test_no_cells_are_no_values() -> None:
    values, bad = parse_floats(spans_of([]))
    assert (len(values), len(bad)) == (0, 0)


@pytest.mark.large
@pytest.mark.parametrize("style", ["%r", "%.18e", "%.17g", "%.12e"])
def test_many_floats_of_all_exponents_read_as_python_reads_them(style: str) -> None:
    texts = [style % value for value in random_bits(500_000) if math.isfinite(value)]
    assert read(texts) == read_by_python(texts)
