from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frametool.text.spans import Cells, Spans, split_blank, split_delimited, whole_records, without_quotes

TEXT = st.text('ab1,"\n# .', max_size=5)
ROWS = st.lists(st.lists(TEXT, min_size=1, max_size=4), max_size=6)


def texts(cells: Cells) -> list[list[bytes]]:
    spans = Spans(cells.data, cells.starts, cells.ends)
    return [[spans.text(row, column) for column in range(spans.starts.shape[1])] for row in range(len(cells.rows))]


def unquoted(text: bytes) -> str:
    found = re.fullmatch(b'"((?:[^"]|"")*)"(.*)|(.*)', text, re.DOTALL)
    assert found
    return (found[3] or (found[1] or b"").replace(b'""', b'"') + (found[2] or b"")).decode()


def assert_as_csv_reads(block: bytes) -> None:
    expected = list(csv.reader(io.StringIO(block.decode(), newline="")))
    for columns in range(1, 5):
        cells = split_delimited(block, b",", columns)
        assert cells.counts.tolist() == [len(row) for row in expected]
        assert [[unquoted(text) for text in row] for row in texts(cells)] == [r for r in expected if len(r) == columns]
        assert b"".join(cells.line(index) for index in range(len(cells.counts))) == block


@given(ROWS, st.sampled_from(["\n", "\r\n"]), st.booleans())
def test_cells_are_those_the_csv_module_finds(rows: list[list[str]], line_end: str, ended: bool) -> None:  # noqa: FBT001
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=line_end).writerows(rows)
    written = text.getvalue()
    assert_as_csv_reads((written if ended else written.removesuffix(line_end)).encode())


STRAY_QUOTES = [b'a,5" pipe,b\nc,"d""e",f\n', b'a,"b"c,d\n"x,\ny",z,w\n', b'"a"b"c,d\n', b'a,b"\n"c,d"\n', b'""\n']
EMPTY_LINES = [b"", b"\n\n", b"a", b",\n,"]


@pytest.mark.parametrize("block", [*STRAY_QUOTES, *EMPTY_LINES])
def test_stray_quotes_and_empty_lines_are_read_as_the_csv_module_reads_them(block: bytes) -> None:
    assert_as_csv_reads(block)


@given(st.text("ab 1\t.#\n", max_size=40))
def test_cells_between_blanks_are_those_split_finds(text: str) -> None:
    lines = text.removesuffix("\n").split("\n") if text else []
    words = [[] if line.startswith("#") else line.split() for line in lines]
    for columns in (1, 2, 3):
        cells = split_blank(text.encode(), columns)
        assert cells.counts.tolist() == [len(row) for row in words]
        assert texts(cells) == [[word.encode() for word in row] for row in words if len(row) == columns]


def test_a_line_with_another_number_of_cells_is_named_with_its_count() -> None:
    cells = split_delimited(b"1,2,3\n4,5\n6,7,8\n9,,,\n", b",", 3)
    assert cells.rows.tolist() == [0, 2]
    assert cells.odd_lines().tolist() == [1, 3]
    assert cells.counts[cells.odd_lines()].tolist() == [2, 4]


def test_a_comment_is_a_line_without_cells() -> None:
    cells = split_blank(b"# a b\n1 2\n", 2)
    assert (cells.counts.tolist(), texts(cells)) == ([0, 2], [[b"1", b"2"]])


def test_a_line_is_found_by_the_line_ends_before_it_also_behind_cells_of_several_lines() -> None:
    cells = split_delimited(b'"a\n\nb",1\nc,2\n', b",", 2)
    assert cells.lines_before().tolist() == [0, 3]


def test_one_carriage_return_belongs_to_the_line_end() -> None:
    assert texts(split_delimited(b"a,b\r\r\nc,\r\n", b",", 2)) == [[b"a", b"b\r"], [b"c", b""]]


def test_quotes_around_a_cell_can_be_left_out() -> None:
    column = without_quotes(split_delimited(b'"1.5",2\n1.5,2\n",2\n"",3\n', b",", 2).column(0))
    assert [column.text(row) for row in range(len(column.starts))][:2] == [b"1.5", b"1.5"]


@given(st.text('a,"\n', max_size=30))
def test_whole_records_end_where_the_csv_module_ends_a_record(text: str) -> None:
    block = text.encode()
    end = whole_records(block)
    behind = list(csv.reader(io.StringIO(text, newline="")))
    parts = [list(csv.reader(io.StringIO(part.decode(), newline=""))) for part in (block[:end], block[end:])]
    assert parts[0] + parts[1] == behind
    assert end == 0 or block[end - 1 : end] == b"\n"


def test_a_long_text_has_its_cells_at_the_places_numpy_finds_the_commas() -> None:
    block = b"".join(b"%d,%d\n" % (number, number * number) for number in range(5000))
    cells = split_delimited(block, b",", 2)
    assert np.array_equal(cells.ends[:, 0], np.flatnonzero(cells.data == ord(",")))
