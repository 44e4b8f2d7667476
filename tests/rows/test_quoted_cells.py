"""What a cell in quotes may hold does not depend on how the stream was cut."""

from __future__ import annotations

import pytest
from flow import MOVE, flow
from sized import sized

ROWS = b"x,y,z,note\n1,2,3,a\n"


@pytest.mark.parametrize(
    "cell", [b'"' + b"a\n" * 20_000 + b'"', b'"' + b"x" * 1_100_000 + b'"', b'"' + b'""\n' * 11_000 + b'"']
)
def test_a_long_cell_passes_in_blocks_of_any_size(cell: bytes) -> None:
    text = ROWS + b"4,5,6," + cell + b"\n7,8,9,b\n"
    whole = flow(text, MOVE, size=len(text) + 1)
    assert (whole.status, whole.told) == (0, [])
    assert b"," + cell + b"\n" in whole.text
    for size in (1000, 1 << 16, 1 << 19):
        assert flow(text, MOVE, size=size) == whole


def test_a_record_beyond_the_limit_is_refused_with_its_line_whatever_the_block() -> None:
    for cell in (b'"' + b"a\n" * 3000 + b'"', b"x" * 5000):
        text = ROWS + b"4,5,6," + cell + b"\n7,8,9,b\n"
        with sized(record=5000):
            found = [flow(text, MOVE, size=size) for size in (7, 100, 4096, 1 << 16)]
        assert found[0].told == [
            "the record that begins in line 3 is longer than 5000 bytes: this is not text in lines, or a quote is not closed"
        ]
        assert found[0].status == 1
        assert all(each == found[0] for each in found)


def test_a_quote_that_is_never_closed_is_a_fault_with_its_line_whatever_the_block() -> None:
    text = ROWS + b'4,5,6,"b\n' + b"7,8,9,c\n" * 2000
    found = [flow(text, MOVE, size=size) for size in (7, 100, 4096, 1 << 16)]
    assert found[0].told[0].startswith("in:3:")
    assert all(each == found[0] for each in found)
