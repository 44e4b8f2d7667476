"""CSV of results that come one after the other: rows wait in a file until it is known which columns there are.

The columns are those of all rows, in the order they are first met, so that a row lacks only the last of them.
"""

from __future__ import annotations

import pickle
from itertools import islice
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from frametool.formats.rows.csv import pose_cells, record_cells, row
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.grammar.result import Style

BATCH = 1000


class SpooledRows(NamedTuple):
    """Rows that follow each other and have as many columns."""

    columns: int
    rows: list[str]


def table_pieces(values: Iterable[Result | dict[str, Any]], style: Style) -> Iterator[str]:
    """Yield the table of results as `write_poses` and `write_points` write it; in memory are some rows of it.

    Poses with others among them become mappings as these are.
    """
    remaining = iter(values)
    with TemporaryFile() as poses, TemporaryFile() as rows, TemporaryFile() as others:
        spool, is_mixed = TableSpool(rows, style), False
        while batch := list(islice(remaining, BATCH)):
            if not is_mixed and not all(isinstance(each, Result) for each in batch):
                spool, is_mixed = TableSpool(others, style), True
                for before in _loaded(poses):
                    spool.add(_cells_of_mapping(each, style) for each in before)
            if is_mixed:
                spool.add(_cells_of_mapping(each, style) for each in batch)
            else:
                pickle.dump(batch, poses, pickle.HIGHEST_PROTOCOL)
                spool.add(pose_cells(each, style) for each in batch if isinstance(each, Result))
        yield from spool.pieces()


def _cells_of_mapping(value: Result | dict[str, Any], style: Style) -> dict[str, Any]:
    return dict(record_cells(value.mapping(style) if isinstance(value, Result) else value))


class TableSpool:
    """Rows of a table in a file."""

    def __init__(self, file: IO[bytes], style: Style) -> None:
        """Begin without columns."""
        self.file = file
        self.style = style
        self.columns: list[str] = []

    def add(self, rows: Iterable[dict[str, Any]]) -> None:
        """Write rows, given as cells by column."""
        written: list[str] = []
        for cells in rows:
            names = [*cells]
            if names != self.columns and (more := [name for name in names if name not in self.columns]):
                self._keep(written)
                written = []
                self.columns += more
            told = cells.values() if names == self.columns else [cells.get(name, "") for name in self.columns]
            written.append(row(told, self.style))
        self._keep(written)

    def _keep(self, rows: list[str]) -> None:
        if rows:
            pickle.dump(SpooledRows(len(self.columns), rows), self.file, pickle.HIGHEST_PROTOCOL)

    def pieces(self) -> Iterator[str]:
        """Yield the header, and then the rows with empty cells for what came later."""
        if self.columns:
            yield row(self.columns, self.style)
        for size, rows in _loaded(self.file):
            lacking = "," * (len(self.columns) - size)
            yield "".join(f"{each[:-1]}{lacking}\n" for each in rows) if lacking else "".join(rows)


def _loaded(file: IO[bytes]) -> Iterator[Any]:
    """Yield what was put into a file."""
    file.seek(0)
    while file.peek(1):  # type: ignore[attr-defined]
        yield pickle.load(file)  # noqa: S301 - written here
