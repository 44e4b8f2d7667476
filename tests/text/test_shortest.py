from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numbers_at_hand import HOSTILE, random_bits

from frametool.text.spans import join
from frametool.text.write import float_spans, shortest_decimals


def lines(values: list[float]) -> list[str]:
    return join([float_spans(np.array(values, np.float64).reshape(-1, 1), b"\n")]).decode().splitlines()


def test_every_hostile_float_is_written_as_repr_writes_it() -> None:
    assert lines(HOSTILE) == [repr(value) for value in HOSTILE]


@given(st.lists(st.floats(), max_size=20))
def test_any_floats_together_are_written_as_repr_writes_them(values: list[float]) -> None:
    assert lines(values) == [repr(value) for value in values]


@given(st.integers(-(10**15), 10**15), st.integers(0, 25))
def test_short_decimals_come_back_as_they_were(digits: int, places: int) -> None:
    value = float(f"{digits}e-{places}")
    assert lines([value, 1 / 3]) == [repr(value), repr(1 / 3)]


def test_short_decimals_among_themselves_are_written_as_repr_writes_them() -> None:
    rounded = np.round(np.random.default_rng(5).uniform(-1000, 1000, 2000), 6)
    values = [*rounded.tolist(), 0.0, -0.0, 100.0]
    assert lines(values) == [repr(value) for value in values]


def test_rows_are_written_with_the_separator_of_each_column() -> None:
    values = np.array([[1.0, -0.0, 1e-5], [0.1, 1e22, 3.0]])
    assert join([float_spans(values, b",;\n")]) == b"1.0,-0.0;1e-05\n0.1,1e+22;3.0\n"


def test_no_rows_are_no_text() -> None:
    assert join([float_spans(np.empty((0, 3)), b",,\n")]) == b""


def test_hardly_any_ordinary_float_is_left_to_python() -> None:
    values = np.random.default_rng(7).uniform(0.0, 100.0, 20000)
    assert len(shortest_decimals(values).unsure) == 0


@pytest.mark.large
def test_three_million_floats_of_all_exponents_are_written_as_repr_writes_them() -> None:
    values = random_bits(3_000_000)
    assert lines(values) == [repr(value) for value in values]
