"""Write results of records in another format, block by block: those with the same layout as rows, others one by one."""

from __future__ import annotations

import re
from functools import cached_property
from itertools import chain, islice
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Protocol

from frametool import sizes
from frametool.errors import NamedTuple
from frametool.formats.rows.csv import cells_of, row
from frametool.grammar.result import Style, write_poses

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from tempfile import SpooledTemporaryFile

    from frametool.rows.batch import RowPoses
    from frametool.rows.plain import Value
    from frametool.rows.sinks.as_rows import AlikeRows
    from frametool.text.spans import Ints, Spans


TOGETHER = 1 << 13  # results that are written as one block


class BlockResults(NamedTuple):
    """The results of the records of a block.

    batches: results with the same layout, together; values: single results, each with its position in the text
    text: the text of the block
    """

    batches: Sequence[AlikeRows]
    values: list[tuple[int, Value]]
    text: bytes = b""

    def posed(self) -> RowPoses | None:
        """Return the results as one block of poses; None if they are not one batch of poses."""
        return None if self.values or len(self.batches) != 1 else self.batches[0].poses()

    def placed(self) -> list[tuple[int, Value]]:
        """Return all results as values, each with its position, in the order of their records."""
        rows = (zip(batch.places.tolist(), batch.values(), strict=True) for batch in self.batches)
        return sorted(chain(self.values, *rows), key=itemgetter(0))

    def in_order(self) -> Iterator[Value]:
        """Yield all results as values, in the order of their records."""
        yield from map(itemgetter(1), self.placed())


def blocks_of(values: Iterable[Value]) -> Iterator[BlockResults]:
    """Yield single results in blocks of TOGETHER."""
    rest = enumerate(values)
    return (BlockResults((), each) for each in iter(lambda: [*islice(rest, TOGETHER)], []))


LINE = re.compile(rb'((?:[^"\n]|"[^"]*")*+)\n')


def text_in_order(lines: Sequence[tuple[int, bytes]], groups: Sequence[tuple[Ints, list[Spans]]]) -> bytes:
    """Return the text of single results and of groups of rows, in the order of their positions."""
    if not groups:
        return b"".join(map(itemgetter(1), lines))
    from frametool.rows.batch import texts_as_rows, written

    return written([*groups, texts_as_rows(lines)] if lines else groups)


class ResultWriter(Protocol):
    """A writer of the results of blocks; part of the text may be held back until the end."""

    def of_block(self, block: Any) -> bytes:
        """Add a block; return the text that can be written now."""

    def end(self) -> Iterable[bytes]:
        """Yield the rest of the text."""
        return ()


class Documents(ResultWriter):
    """Write results as lines of JSON or as documents of YAML."""

    def __init__(self, style: Style) -> None:
        """Begin without results."""
        self.style, self.exact = style, style.changed(precision=None, screen=False)
        self.parting = "---\n" if style.format == "yaml" else ""
        self.begun = False

    def of_block(self, block: BlockResults) -> bytes:
        """Return the text of a block."""
        lines = [(place, (self.parting + write_poses([value], self.style)).encode()) for place, value in block.values]
        groups = []
        for batch in block.batches:
            text = self.parting + write_poses([batch.marked.value], self.exact)
            groups.append((batch.places, batch.as_documents(text, self.style)))
        found = text_in_order(lines, groups)
        begun, self.begun = self.begun, self.begun or bool(found)
        return found if begun else found[len(self.parting) :]


def csv_rows(block: BlockResults, columns: dict[str, None], style: Style) -> bytes:
    """Return the rows of a block as a table; its new columns are added to `columns`."""
    rows: list[tuple[int, dict[str, Any], AlikeRows | None]] = [
        (place, cells_of(value, style), None) for place, value in block.values
    ]
    rows += [(int(each.places[0]), cells_of(each.marked.value, style), each) for each in block.batches]
    rows.sort(key=itemgetter(0))
    for _, cells, _ in rows:
        columns |= dict.fromkeys(cells)
    lines, groups = list[tuple[int, bytes]](), []
    for place, cells, alike in rows:
        if alike is None:
            lines.append((place, row([cells.get(name, "") for name in columns], style).encode()))
        else:
            groups.append((alike.places, alike.as_cells(cells, columns, style)))
    return text_in_order(lines, groups)


class CsvTable(ResultWriter):
    """Collect results into one table, which is written at the end, when all columns are known."""

    def __init__(self, style: Style) -> None:
        """Begin without columns."""
        self.style = style
        self.columns: dict[str, None] = {}
        self.sizes: list[tuple[int, int]] = []  # for each block the number of columns and of bytes

    def end(self) -> Iterator[bytes]:
        """Yield the table of all blocks."""
        if not self.columns:
            return
        yield row(self.columns, self.style).encode()
        with self.waiting:  # with columns there are rows, too
            self.waiting.seek(0)
            for count, size in self.sizes:
                text = self.waiting.read(size)
                missing = len(self.columns) - max(count, 1)  # a row without cells is a line, too
                yield LINE.sub(rb"\1" + b"," * missing + b"\n", text) if missing else text

    @cached_property
    def waiting(self) -> SpooledTemporaryFile[bytes]:
        """Return the temporary file that collects the rows."""
        from tempfile import SpooledTemporaryFile

        return SpooledTemporaryFile(sizes.TABLE)

    def of_block(self, block: BlockResults) -> bytes:
        """Add the rows of a block; returns no text."""
        text = csv_rows(block, self.columns, self.style)
        if text:
            self.waiting.write(text)
        self.sizes.append((len(self.columns), len(text)))
        return b""
