from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from frametool.text.spans import MARGIN, Spans, framed, join


def spans_of(table: list[list[bytes]]) -> Spans:
    """Put the texts of a table into one array, in reverse, so that their order there is not the wanted one."""
    flat = [text for row in table for text in row][::-1]
    lengths = np.array([len(text) for text in flat], np.int64)
    ends = MARGIN + np.cumsum(lengths)
    shape = (len(table), len(table[0]))
    return Spans(framed(b"".join(flat)), (ends - lengths)[::-1].reshape(shape), ends[::-1].reshape(shape))


TABLES = st.integers(1, 4).flatmap(
    lambda columns: st.lists(
        st.lists(st.binary(max_size=12), min_size=columns, max_size=columns), min_size=1, max_size=9
    )
)


@given(TABLES)
def test_joined_spans_are_the_texts_one_after_the_other(table: list[list[bytes]]) -> None:
    assert join([spans_of(table)]) == b"".join(text for row in table for text in row)


@given(st.lists(st.tuples(st.binary(max_size=9), st.binary(max_size=200)), min_size=1, max_size=20))
def test_spans_of_several_arrays_alternate_and_may_be_long(rows: list[tuple[bytes, bytes]]) -> None:
    left, right = spans_of([[first] for first, _ in rows]), spans_of([[second] for _, second in rows])
    assert join([left, right]) == b"".join(first + second for first, second in rows)


def test_many_rows_are_joined_over_the_bounds_of_batches() -> None:
    table = [[b"%d," % number, b"x" * (number % 70) + b"\n"] for number in range(20000)]
    assert join([spans_of(table)]) == b"".join(text for row in table for text in row)


def test_no_rows_are_joined_to_nothing() -> None:
    column, table = np.empty(0, np.int64), np.empty((0, 2), np.int64)
    assert join([Spans(framed(b""), column, column), Spans(framed(b""), table, table)]) == b""


def test_a_framed_block_stands_between_margins() -> None:
    data = framed(b"abc")
    assert data[MARGIN : MARGIN + 3].tobytes() == b"abc"
    assert not data[:MARGIN].any()
    assert not data[MARGIN + 3 :].any()
