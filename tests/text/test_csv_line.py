"""One line of CSV against the library's reader, and back."""

from __future__ import annotations

import csv

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frametool.formats.rows.csv import quoted, split_line

CELLS = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=8), min_size=1, max_size=6)


@given(CELLS)
def test_what_is_quoted_is_split_again(cells: list[str]) -> None:
    line = ",".join(map(quoted, cells))
    assert [cell.text for cell in split_line(line)] == [cell if quoted(cell) != cell else cell.strip() for cell in cells]


@pytest.mark.parametrize("line", ["a,b", '"a,b",c', '"a""b",c', "a,", ",", 'a"b,c', 'x,"1"'])
def test_cells_are_those_of_the_librarys_reader_with_the_column_of_each(line: str) -> None:
    cells = split_line(line)
    assert [cell.text for cell in cells] == next(csv.reader([line]))
    assert [line[cell.column - 2] for cell in cells[1:]] == [","] * (len(cells) - 1)


@pytest.mark.parametrize("line", ['"open,x', '"a"b,c'])
def test_a_quote_that_is_not_closed_is_text(line: str) -> None:
    assert [cell.text for cell in split_line(line)] == line.split(",")
