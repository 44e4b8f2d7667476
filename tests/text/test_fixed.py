from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numbers_at_hand import HOSTILE, random_bits

from frametool.text.spans import join
from frametool.text.write import float_spans


def lines(values: list[float], precision: int) -> list[str]:
    return join([float_spans(np.array(values, np.float64).reshape(-1, 1), b"\n", precision)]).decode().splitlines()


def by_percent(values: list[float], precision: int) -> list[str]:
    return [f"{value:z.{precision}f}" for value in values]


@pytest.mark.parametrize("precision", [0, 1, 6, 9, 15, 20])
def test_every_hostile_float_is_written_as_percent_writes_it(precision: int) -> None:
    assert lines(HOSTILE, precision) == by_percent(HOSTILE, precision)


@given(st.lists(st.floats(), max_size=10), st.integers(0, 18))
def test_any_floats_together_are_written_as_percent_writes_them(values: list[float], precision: int) -> None:
    assert lines(values, precision) == by_percent(values, precision)


@given(st.integers(-(10**7), 10**7), st.integers(0, 20), st.integers(0, 15))
def test_exact_halves_go_to_the_even_digit(numerator: int, power: int, precision: int) -> None:
    values = [numerator / 2**power, float(np.nextafter(numerator / 2**power, 1e300))]
    assert lines(values, precision) == by_percent(values, precision)


@given(st.integers(-(10**12), 10**12), st.integers(0, 14))
def test_decimal_halves_go_where_their_float_lies(digits: int, precision: int) -> None:
    values = [float(f"{digits}5e-{precision + 1}")]
    assert lines(values, precision) == by_percent(values, precision)


def test_rows_are_written_with_the_separator_of_each_column() -> None:
    assert join([float_spans(np.array([[1.0, -0.0], [1e20, -2.5]]), b",\n", 1)]) == b"1.0,0.0\n100000000000000000000.0,-2.5\n"


def test_no_rows_are_no_text() -> None:
    assert join([float_spans(np.empty((0, 2)), b",\n", 6)]) == b""


@pytest.mark.large
@pytest.mark.parametrize("precision", range(18))
def test_many_floats_are_written_as_percent_writes_them(precision: int) -> None:
    rng = np.random.default_rng(precision)
    values = [*random_bits(50_000), *(rng.uniform(-1, 1, 50_000) * 10.0 ** rng.integers(-8, 16, 50_000)).tolist()]
    assert lines(values, precision) == by_percent(values, precision)


@pytest.mark.parametrize("precision", range(19))
def test_zero_keeps_its_sign_as_it_does_in_python(precision: int) -> None:
    values = [-0.0, 0.0, -5e-324, -0.4, -0.5, -0.05, -1e-7, 1e300, -1e22]
    for some in (values, values[:1], values[:2] * 20):
        assert lines(some, precision) == by_percent(some, precision)
