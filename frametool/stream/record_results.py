"""Streams of records in another format: what is alike becomes rows together, all else a result at a time."""

from __future__ import annotations

import re
from itertools import chain, count
from operator import itemgetter
from tempfile import SpooledTemporaryFile
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool import sizes
from frametool.documents.document import parse_nodes
from frametool.errors import FormatError, FrametoolError
from frametool.formats.rows.csv import cells_of, row
from frametool.formats.trees.written_poses import write_poses
from frametool.grammar.pose import Pose
from frametool.grammar.result import NoResult
from frametool.stream.faults import NULL, STOP, Fault, tell_of_rounding
from frametool.stream.record_text import RecordText, attempt, fault_at, nulled
from frametool.stream.record_values import ROUNDED, Teller, plain, values_of_text
from frametool.stream.splitter import ARRAY, NO_END, Splitter
from frametool.text.lines import read_blocks

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.grammar.result import Style
    from frametool.stream.faults import BadRows
    from frametool.stream.record_rows import RecordBatch, RecordRows
    from frametool.stream.record_values import Value
    from frametool.stream.request import Request
    from frametool.stream.row_poses import RowPoses
    from frametool.text.lines import ByteStream


class BlockResults(NamedTuple):
    """What the records of a block became: rows of those that are alike, and single results, each with its place."""

    batches: Sequence[RecordBatch]
    values: list[tuple[int, Value]]

    def posed(self) -> RowPoses | None:
        """Return the rows as one block of poses; None where they are more, or others."""
        if self.values or len(self.batches) != 1:
            return None
        from frametool.stream.record_rows import poses_of

        return poses_of(self.batches[0])

    def in_order(self) -> Iterator[Value]:
        """Yield all results as values, in the order of their records."""
        found = self.values
        if self.batches:
            from frametool.stream.record_rows import values_of

            rows = (zip(batch.places.tolist(), values_of(batch), strict=True) for batch in self.batches)
            found = sorted(chain(found, *rows), key=itemgetter(0))
        yield from map(itemgetter(1), found)


def stream_rows(stream: ByteStream, fmt: str, request: Request, style: Style, bad: BadRows) -> Iterator[BlockResults]:
    """Yield the results of a stream of records, block by block; bad ones are reported as rows are."""
    splitter = Splitter(fmt)
    operation, request = request.operation, request._replace(canonical=True)
    singly = operation.shown is not None or (request.place is not None and not operation.looks_back)
    alike: RecordRows | None = None
    line, rows = 1, 0
    teller = Teller(most=1)
    for block in read_blocks(stream, whole=splitter.whole):
        at = 0
        batches: Sequence[RecordBatch] = ()
        few = splitter.parts(block).parts if singly or (len(block) < sizes.SMALL and not request.in_order) else []
        alone: Iterable[tuple[Any, Any, Any]] = ((part, None, None) for part in few)
        mended = 0
        if not singly and not 0 < len(few) <= sizes.FEW:
            from frametool.stream.record_rows import RecordRows

            alike = alike or RecordRows(splitter, fmt, request, style, bad.source)
            batches, alone, mended = alike.of_block(block, teller.counts)
        values: list[tuple[int, Value]] = []
        rows += len({*chain.from_iterable(each.cut.starts[:, 0].tolist() for each in batches)})
        for part, parts, reason in alone:
            rows += 1
            line, at = line + block.count(b"\n", at, part.start), part.start
            before = bad.count
            known = attempt(block, part, fmt, request, bad.source, line - 1, teller.tell)
            fault = known if isinstance(known, Fault) else reason and Fault.of(line - 1, *reason)
            if isinstance(known, RecordText) and not fault:
                try:
                    found = values_of_text(known, style, teller, parts)
                    values += zip(count(part.start), found, strict=False)
                except FormatError as error:
                    fault = fault_at(known.source, error)
                except FrametoolError as error:
                    fault = Fault.of(line - 1, "", error)
            fault = fault and fault._replace(line=fault.line + 1)
            if fault is not None and (fault.final or bad.on_error == STOP):
                yield BlockResults([each.take((each.places < part.start).nonzero()[0]) for each in batches], values)
            bad.take([fault] if fault else [])
            if bad.count > before and bad.on_error == NULL:
                values.append((part.start, _no_result(block[part.start : part.end], fmt, style)))
        teller.counts[ROUNDED] += mended
        yield BlockResults(batches, values)
        line += block.count(b"\n", at)
    if splitter.layout == ARRAY and splitter.is_open:
        bad.take([Fault(line - block.endswith(b"\n"), "", NO_END)])
    tell_of_rounding(bad.source, teller.counts[ROUNDED], rows)
    bad.finish(rows)


def _no_result(record: bytes, fmt: str, style: Style) -> NoResult:
    """Return what a bad record says besides its numbers; in a table those are empty cells under names of their own."""
    try:
        text = record.decode()
        said = plain(parse_nodes(nulled(text, json=fmt == "json") or text)[0])
    except (FormatError, UnicodeDecodeError, IndexError, TypeError):  # broken: no parser has taken it before
        said = None
    kept = said if type(said) is dict else {}
    return NoResult(Pose(), {key: value for key, value in kept.items() if style.format != "csv" or _says(value)})


def _says(value: Any) -> bool:
    """Return True if there is more than null in a value."""
    inner = value.values() if type(value) is dict else value if type(value) is list else None
    return value is not None if inner is None else any(map(_says, inner))


LINE = re.compile(rb'((?:[^"\n]|"[^"]*")*+)\n')


def text_of(singles: Sequence[tuple[int, str]], batches: Sequence[RecordBatch], rows: Sequence[Any]) -> bytes:
    """Return single results and the rows of batches in the order of their places."""
    lines = [(place, text.encode()) for place, text in singles]
    if not batches:
        return b"".join(text for _, text in lines)
    from frametool.stream.rows import texts_as_rows, written

    groups = [(batch.places, spans) for batch, spans in zip(batches, rows, strict=True)]
    return written([*groups, texts_as_rows(lines)] if lines else groups)


def documents(blocks: Iterable[BlockResults], style: Style) -> Iterator[bytes]:
    """Yield results as lines of JSON or as documents of YAML."""
    parting, begun = "---\n" if style.format == "yaml" else "", False
    exact = style.changed(precision=None, screen=False)
    for block in blocks:
        singles = [(place, parting + write_poses([value], style)) for place, value in block.values]
        rows = []
        for batch in block.batches:
            from frametool.stream.text_rows import in_document

            rows.append(batch.text(in_document(parting + write_poses([batch.marked.value], exact), style), style))
        text = text_of(singles, block.batches, rows)
        yield text if begun else text[len(parting) :]
        begun = begun or bool(text)


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
        marked = [cells_of(batch.marked.value, self.style) for batch in block.batches]
        firsts = [(int(batch.places[0]), cells) for batch, cells in zip(block.batches, marked, strict=True)]
        for _, names in sorted([*singles, *firsts], key=itemgetter(0)):
            self.columns |= dict.fromkeys(names)
        lines = [(place, row([cells.get(name, "") for name in self.columns], self.style)) for place, cells in singles]
        rows = []
        for batch, cells in zip(block.batches, marked, strict=True):
            from frametool.stream.text_rows import in_table

            rows.append(batch.text(in_table(cells, self.columns, self.style), self.style))
        text = text_of(lines, block.batches, rows)
        self.waiting.write(text)
        self.sizes.append((len(self.columns), len(text)))
