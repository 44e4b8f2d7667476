"""Stamps in bulk: what the reader of one stamp says of every cell, to the nanosecond."""

from __future__ import annotations

import pytest
from flow import stamp_of, stamps_of
from hypothesis import given
from hypothesis import strategies as st

NANOSECONDS = st.integers(-(1 << 65), 1 << 65)
DECIMALS = st.tuples(st.integers(0, 10**11), st.text("0123456789", max_size=18)).map(lambda pair: f"{pair[0]}.{pair[1]}")
CELLS = st.one_of(
    DECIMALS, NANOSECONDS.map(str), NANOSECONDS.map("{}ns".format), st.floats().map(repr), st.text("0123456789.-+ens \"'", max_size=30)
)


def refused(cells: list[str], *, in_ns: bool) -> list[str]:
    return [cell for cell, found in zip(cells, stamps_of(cells, in_ns=in_ns), strict=True) if isinstance(found, str)]


@pytest.mark.filterwarnings("ignore:stamps such as")  # a whole number may look like milliseconds
@pytest.mark.parametrize("in_ns", [True, False])
@given(cells=st.lists(CELLS, min_size=1, max_size=40))
def test_a_column_is_read_as_its_cells_are(cells: list[str], *, in_ns: bool) -> None:
    assert stamps_of(cells, in_ns=in_ns) == [stamp_of(cell, in_ns=in_ns) for cell in cells]


@pytest.mark.parametrize(
    ("cell", "stamp_ns"),
    [
        ("1700000000.123456789", 1_700_000_000_123_456_789),
        ("1700000000.1", 1_700_000_000_100_000_000),
        ("1700000000123456789ns", 1_700_000_000_123_456_789),
        ("1.7e9", 1_700_000_000_000_000_000),
        ("0.000000001000", 1),
        ("0.30000000000000004", 300_000_000),  # as Python prints 3 * 0.1
        ("1.036220000000000030e-01", 103_622_000),  # as numpy.savetxt does
        ("9.9999999995", 10_000_000_000),
        ("0.0000000025", 2),
        ("-0.5", -500_000_000),
        (" 12. ", 12_000_000_000),
        ("9223372036.854775807", (1 << 63) - 1),
    ],
)
def test_no_nanosecond_is_lost(cell: str, stamp_ns: int) -> None:
    assert stamps_of([cell, "1"], in_ns=False) == [stamp_ns, 10**9]


@pytest.mark.parametrize("cell", ["9223372036.854775808", "noon", "", "1_0", "0x1", "1.2.3", "nan", "."])
def test_what_is_no_time_is_named(cell: str) -> None:
    assert refused(["1.5", cell], in_ns=False) == [cell]


@pytest.mark.parametrize("cell", ["1.5", "1.0", "12s", "-", "9223372036854775808"])
def test_nanoseconds_are_whole(cell: str) -> None:
    assert refused([cell, "-7", "1700000000123456789"], in_ns=True) == [cell]
