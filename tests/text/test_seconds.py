"""Seconds in floats: the nanoseconds of the decimal that they print as."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest

from frametool.text.parse import nanoseconds_of


def by_decimal(seconds: float) -> int:
    """Return the nanoseconds of what a float prints as, by decimal arithmetic."""
    return round(Decimal(repr(seconds)) * 10**9)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-3, 1.0, 1e3, 9e6, 1e7, 1.7e9, 9e9])
@pytest.mark.parametrize("decimals", [0, 1, 3, 6, 9, 17])
def test_floats_are_the_decimals_that_they_print_as(size: float, decimals: int) -> None:
    seconds = np.round(np.random.default_rng(1).uniform(-size, size, 2000), decimals)
    stamps, none = nanoseconds_of(seconds)
    assert not none.any()
    assert stamps.tolist() == [by_decimal(each) for each in seconds.tolist()]


@pytest.mark.parametrize("odd", [0.0, -0.0, 5e-324, 1e-300, 0.1 + 0.2, 2.5e-9, 3.5e-9, 2.0**33, 4.999999999999999e-10])
def test_odd_sizes_are_no_exception(odd: float) -> None:
    stamps, none = nanoseconds_of(np.array([odd, 1e-7, -odd, 1e9]))
    assert not none.any()
    assert stamps.tolist() == [by_decimal(odd), 100, by_decimal(-odd), 10**18]


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), -float("inf"), 1e10, -1e300])
def test_what_is_no_time_is_told(odd: float) -> None:
    assert nanoseconds_of(np.array([1.5, odd, 2.5]))[1].tolist() == [False, True, False]
