"""Results of records as one table of CSV: its columns are those of all rows, so that it waits until all are known."""

from __future__ import annotations

import re
from operator import itemgetter
from tempfile import SpooledTemporaryFile
from typing import TYPE_CHECKING

from frametool import sizes
from frametool.formats.rows.csv import cells_of, row

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.grammar.result import Style
    from frametool.stream.record_results import BlockResults

LINE = re.compile(rb'((?:[^"\n]|"[^"]*")*+)\n')


class CsvTable:
    """Put results together as one table."""

    def __init__(self, style: Style) -> None:
        """Begin without columns."""
        self.style = style
        self.columns: dict[str, None] = {}
        self.waiting = SpooledTemporaryFile(sizes.TABLE)  # noqa: SIM115 - closed with the table
        self.sizes: list[tuple[int, int]] = []  # of each block the columns that it has, and its bytes

    def pieces(self, blocks: Iterable[BlockResults]) -> Iterator[bytes]:
        """Yield the table of all blocks."""
        with self.waiting:
            for block in blocks:
                self._add(block)
            if not self.columns:
                return
            yield row(self.columns, self.style).encode()
            self.waiting.seek(0)
            for count, size in self.sizes:
                text = self.waiting.read(size)
                missing = len(self.columns) - max(count, 1)  # a row without cells is a line all the same
                yield LINE.sub(rb"\1" + b"," * missing + b"\n", text) if missing else text

    def _add(self, block: BlockResults) -> None:
        """Add the rows of a block."""
        singles = [(place, cells_of(value, self.style)) for place, value in block.values]
        found: list[tuple[int, Iterable[str]]] = list(singles)
        marked = [cells_of(batch.marked.value, self.style) for batch in block.batches]
        found += [(int(batch.places[0]), cells) for batch, cells in zip(block.batches, marked, strict=True)]
        for _, names in sorted(found, key=itemgetter(0)):
            self.columns |= dict.fromkeys(names)
        lines = [
            (place, row([cells.get(name, "") for name in self.columns], self.style).encode())
            for place, cells in singles
        ]
        if block.batches:
            from frametool.stream.csv_rows import merged

            text = merged(lines, block.batches, marked, [*self.columns], self.style)
        else:
            text = b"".join(line for _, line in lines)
        self.waiting.write(text)
        self.sizes.append((len(self.columns), len(text)))
