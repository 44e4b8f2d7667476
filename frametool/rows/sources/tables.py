"""Tables as streams: CSV and TSV with a header, or columns separated by blanks; other bytes are unchanged.

id,x,y,z,tag                            1305031102.1758 1.34 0.62 1.65 0.657 0.612 -0.295 -0.311
007,1.0,2.0,3.0,"a,b"                   (TUM: t x y z qx qy qz qw; s, m; the pose of the body in the world)

Knows the syntax of tables, the frames that their rows name, and the columns of trajectory formats.  Reads the head
once, then block by block.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cache
from itertools import chain
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FormatError, FrametoolError, Misused, NamedTuple, ValueInvalid, listing
from frametool.formats.table import FORMATS
from frametool.frames.stamps import BILLION, stamp_text
from frametool.geometry.representations import notation
from frametool.grammar.readers import EARTH_FRAMES, NORMALS, in_nanoseconds, stamp_column, stamp_places
from frametool.rows.batch import (
    Block,
    BlockNames,
    Coded,
    RowPoses,
    coded,
    read_stamps,
    spans_of,
    stamps_in,
    taken,
    written,
)
from frametool.rows.columns import has_pose_column, listed
from frametool.rows.evaluate import Run, State
from frametool.rows.faults import Fault, Outcome, RowNote
from frametool.rows.plan import Kept, Layout, Named, New, plan_table
from frametool.rows.request import SOME
from frametool.rows.shapes import NORMAL, POSE, RATE, Shape
from frametool.rows.sinks import In, Out
from frametool.text.lines import read_blocks, whole_lines, with_edits
from frametool.text.spans import (
    MARGIN,
    Cells,
    Ints,
    RecordEnds,
    Spans,
    split_blank,
    split_delimited,
    torn_record,
    without_quotes,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from frametool.rows.request import Request
    from frametool.text.lines import ByteStream

COUNTER = "frame"  # such a column often counts images

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
COMMENTS = re.compile(rb"(?:#[^\r\n]*|\s*(?:[\r\n]|\Z))*+")  # and blank lines
UNCLOSED = "a quote is opened here and not closed"


class Table(NamedTuple):
    """The syntax and the columns of a table.

    delimiter: between cells; b"" for blanks
    names: of the columns, None without a header; width: the number of cells in a row
    head: the text before the header, or before the first row
    header: the raw cells of the header; title: its line; line_end: the end of that line
    source: the name in messages
    normals: names of columns of vectors that rotate with points; stamped: a column named like stamps holds stamps
    """

    delimiter: bytes
    names: tuple[str, ...] | None
    width: int
    head: bytes = b""
    header: tuple[bytes, ...] = ()
    title: bytes = b""
    line_end: bytes = b"\n"
    source: str = ""
    normals: Sequence[tuple[str, ...]] = NORMALS
    stamped: bool = True

    def split(self, block: bytes) -> Cells:
        """Return the cells of a block."""
        if self.delimiter:
            return split_delimited(block, self.delimiter, self.width)
        return split_blank(block, self.width, comment=b"#")

    @property
    def called(self) -> tuple[str, ...]:
        """Return the names of the columns, or their numbers from 1."""
        return self.names or tuple(map(str, range(1, self.width + 1)))

    def cell(self, text: str) -> bytes:
        """Write a cell, quoted if a reader would split it."""
        cell, marks = text.encode(), {*self.delimiter, *b'"\n\r'} if self.delimiter else set[int]()
        return cell if marks.isdisjoint(cell) else b'"' + cell.replace(b'"', b'""') + b'"'

    def name(self, place: int) -> str:
        """Return the name of a column for messages."""
        return self.names[place] if self.names else f"column {place + 1}"

    def opening(self, layout: Layout) -> bytes:
        """Return the text before the first row of the output; the header is unchanged if no column changes."""
        grown = self.names and len(layout.columns) > self.width  # more columns than their format has need names
        if not (self.header or grown):
            return self.head
        own = self.header or [*map(self.cell, self.called)]
        cells = [self.cell(each.name) if isinstance(each, New) else own[each.place] for each in layout.columns]
        title = self.title if cells == [*self.header] else (self.delimiter or b" ").join(cells)
        return self.head + b"# " * (not self.header) + title + self.line_end


def open_table(
    block: bytes, fmt: str, *, header: bool, source: str, expected: object = None,
    known: Callable[[Sequence[str]], bool] = has_pose_column,
) -> tuple[Table, bytes]:  # fmt: skip
    """Read the head of a table from its first block; return the table and the rest of the block.

    expected: what --from declares for numbers without names; known: returns True if the words of a comment are a header
    """
    row = FORMATS[fmt].rows
    delimiter = (row.delimiter or "").encode()
    mark = BYTE_ORDER_MARK if block.startswith(BYTE_ORDER_MARK) else b""
    comments = COMMENTS.match(block, len(mark))[0]  # type: ignore[index]
    rest = block[len(mark) + len(comments) :]
    end = rest.find(b"\n") + 1 or len(rest)
    if delimiter and b'"' in rest[:end]:  # a quoted cell may hold line ends
        ends = split_delimited(rest, delimiter, 0).line_ends
        end = int(ends[0]) - MARGIN if len(ends) else len(rest)
    line = rest[:end]
    if delimiter and torn_record(line, delimiter) is not None:
        raise FormatError(UNCLOSED, source=source, line=1)
    title = line.rstrip(b"\r\n")
    bare = Table(delimiter, None, 0, mark + comments, source=source)
    own = _titled(title, bare._replace(line_end=line[len(title) :] or b"\n"))
    if not own.width and not (delimiter and comments):
        raise FormatError("no rows in it", source=source)
    count = 0  # names that are numbers
    for name in own.names or ():
        with suppress(ValueError):
            float(name)
            count += 1
    is_header = header and not (count == own.width if delimiter else count)
    if header and comments.strip() and not (is_header and known(own.names or ())):  # the last comment may be the header
        text = comments.rstrip()
        words = text[max(text.rfind(b"\n"), text.rfind(b"\r")) + 1 :].lstrip(b"# \t")
        before, behind = mark + text[: len(text) - len(words)], comments[len(text) :]
        above = _titled(words, own._replace(head=before, line_end=behind))
        if above.width and own.width in (0, above.width) and known(above.names or ()):
            return above, rest
    if is_header:
        return own, rest[end:]
    if header and not expected and delimiter and not row.columns and own.width != len(FORMATS["tum"].rows.columns):
        what = "the first line holds numbers and no names; give --no-header" if own.width else "no rows in it"
        raise FormatError(what, source=source, line=1)
    return bare._replace(width=own.width), rest


def _titled(title: bytes, table: Table) -> Table:
    """Return a table with the names in a line; without columns if the line is empty."""
    cells = tuple(cells_of(title, table.delimiter))
    return table._replace(names=tuple(map(_unquoted, cells)), width=len(cells), header=cells, title=title)


def cells_of(line: bytes, delimiter: bytes) -> list[bytes]:
    """Return the raw cells of one line."""
    if not delimiter:
        return line.split()
    count = int(split_delimited(line, delimiter, 0).counts[0]) if line.strip() else 0
    if not count:
        return []
    cells = split_delimited(line, delimiter, count)
    return [cells.column(index).text(0) for index in range(count)]


def _unquoted(cell: bytes) -> str:
    text = cell.decode("utf-8", "replace").strip()
    return text[1:-1].replace('""', '"') if len(text) > 1 and text[0] == text[-1] == '"' else text


def as_trajectory(table: Table, fmt: str, request: Request) -> tuple[Table, Request]:
    """Set the columns of a trajectory format, unless --from or --columns do; eight columns without names are TUM.

    Raises FormatError for a number of columns that the format does not allow.
    """
    row, names, asked = FORMATS[fmt].rows, table.names, request.rows
    if asked.given or asked.columns:
        return table, request
    if row.widths and table.width not in row.widths and (fmt == "kitti" or not names):
        counts = " or ".join(map(str, row.widths))
        line = table.head.count(b"\n") + 1
        raise FormatError(f"expected {counts} numbers a line, found {table.width}", source=table.source, line=line)
    if fmt not in ("kitti", "euroc"):
        tum = FORMATS["tum"].rows.columns
        columns = row.columns or (tum if table.width == len(tum) else ())
        return (table if names or not columns else table._replace(names=columns, width=len(columns))), request
    ours = names = row.columns
    if fmt == "euroc":
        names, ours = table.names or names[: table.width], ours[1:8]
        if (at := stamp_column(names)) is not None and not in_nanoseconds(names[at]):
            names = (*names[:at], f"{names[at]} [ns]", *names[at + 1 :])  # the unit of EuRoC, whatever the name
    bare, wanted = ([name.split("[")[0].strip() for name in each] for each in (names, ours))
    if missing := [name for name in wanted if name not in bare]:
        raise FormatError(f"no column {', '.join(missing)}", source=table.source, line=1)
    if asked.poses == 1:
        places = [bare.index(name) + 1 for name in wanted]
        chosen = ",".join(f"{place}-{place}" for place in places)  # ranges, because a column may be called 2
        request = request.with_rows(given=notation(row.rotation), columns=(chosen,))
    return table._replace(names=names), request


def run_table(
    stream: ByteStream, fmt: str, request: Request, *, source: str, header: bool = True
) -> Generator[Outcome]:
    """Yield the outcomes of a table: its head, then each block."""
    rows = TableRows(stream, fmt, request, source, header=header)
    yield Outcome(rows.table.opening(rows.layout), lines=rows.lines, size=rows.taken)
    for text in rows.texts:
        run, outcome, cells = rows.of_text(text)
        yield outcome._replace(text=written(run.groups(rows.parts_of(cells, run))))


class PlannedRows:
    """The rows of a table with their plan and the state between blocks.

    With `all_numbers` in the request, results are computed for another format and no text is planned.
    off: the largest deviation of a rotation; mended: the number of rotations that were normalised
    inputs: the numbers of the last block as read, one column per row
    unasked: the usual column of stamps, if rows move at the latest time because no option names it
    """

    def __init__(self, table: Table, request: Request) -> None:
        """Plan the rows of a table; raises FormatError or Misused if the request does not fit its columns."""
        timed, extra, self.unasked = request.timed, request.rows.stamp_or_weight_column, None
        usual = "" if (at := stamp_places(table.names)[0]) is None else table.name(at)
        is_cut = (request.window or request.offset_ns) and extra is None and not (timed and timed.name)
        if lacks_name := extra == "" or is_cut:
            request = request.with_rows(stamp_or_weight_column=usual)
        if timed is not None and not timed.name:  # rows move at the latest time; a formula uses the stamp itself
            self.unasked = timed._replace(name=usual) if usual else None
            request = request._replace(timed=None)
            if request.operation.formula and not request.operation.shown:
                lacks_name, self.unasked = True, None
                request = request._replace(timed=timed._replace(name=usual))
        if lacks_name and not usual:
            what = f"no column looks like stamps; name it with --time-column; columns: {listing(table.called)}"
            raise Misused(what, source=table.source, line=1)
        self.table, self.request = table, request
        try:
            self.plan, self.layout = plan_table(table, request)
        except ValueInvalid as error:
            raise FormatError(str(error), source=table.source, line=1) from None
        self.shape = self.plan.shapes[0] if self.plan.shapes else Shape(POSE)
        self.earth = EARTH_FRAMES[0] if self.shape.place is not None else None
        self.rename = request.for_kind(self.shape.kind).rename
        self.state, self.mended, self.off = State(), 0, 0.0

    @property
    def columns(self) -> str:
        """Return the columns of the table for messages."""
        return listed(self.table.called)

    def names_of(self, size: int, column: Callable[[int], Coded]) -> BlockNames:
        """Return the frames that `size` rows and their results name; column: returns the texts of a column."""
        named, frames = self.layout.named, self.layout.frames
        places = named if named != (None, None) else frames
        return self._renamed(places, size, column) if places and size else BlockNames(Coded((self.earth,)))

    def _renamed(self, places: Sequence[int | None], size: int, column: Callable[[int], Coded]) -> BlockNames:
        """Return the names in some columns, and those of their results."""
        asked = self.request
        texts = [Coded([""]) if place is None else column(place) for place in places]
        (parents, _), (names, _), codes = texts[0], texts[-1], texts[0].of_rows(size)
        found, of_row = np.unique(codes * len(names) + texts[-1].of_rows(size), return_inverse=True)
        pairs = [(parents[code // len(names)], names[code % len(names)]) for code in found.tolist()]
        if not asked.rows.poses:  # a look-up
            return BlockNames(texts[0] if len(places) == 1 else Coded([*map("\0".join, pairs)], of_row))
        called = next(self.table.name(place) for place in places if place is not None)
        may_count = called == COUNTER and COUNTER not in asked.rows.frames
        counters = {text for text in parents if may_count and asked.counts(text)}
        results, lost, bad = list(pairs), dict[int, str](), dict[int, tuple[str, str | FrametoolError]]()
        for at, pair in enumerate(pairs):
            try:
                old = None if pair[0] in counters else pair[0] or None, pair[1] or None
                new = old if self.rename is None else self.rename(*old)
                results[at] = pair[0] if pair[0] in counters else new[0] or "", new[1] or ""
            except FrametoolError as error:
                bad |= dict.fromkeys(np.flatnonzero(of_row == at).tolist(), (called, error))
            for place, name, result in zip(places, pair, results[at], strict=True):
                if place is not None and name and not result:  # the result lacks a frame that the row names
                    lost.setdefault(int((of_row == at).argmax()), name)
        known = [None if not text or text in counters else text for text in parents]
        own = Coded((self.earth,)) if self.earth else Coded(known, codes)
        return BlockNames(own, pairs, results, of_row, dict(sorted(lost.items())[:1]), bad)

    def ran(self, block: Block) -> Run:
        """Compute a block and sort its warnings."""
        run = Run(self.plan, block, self.state)
        self.mended += len(run.mended)
        self.off = max(self.off, run.off)
        for frame in block.frames[0].texts if run.count else ():
            with suppress(FrametoolError):  # unknown frames are reported as bad rows
                if self.unasked is not None and self.unasked.moves(frame):
                    remedy = f"give --time-column {quote(self.unasked.name)}, or --at TIME"
                    ignored = f"column {self.unasked.name!r} is not looked at, rows move at the latest time; {remedy}"
                    run.notes.append(RowNote(block.line_of(0), "latest", ignored))
                    self.unasked = None
        run.notes.sort()
        return run

    def poses_of(self, run: Run, column: Callable[[int], Any], lines: Ints) -> RowPoses:
        """Return the results of a block for another format.

        column: returns the cells of a column; lines: (n,) the lines of the block's rows, from 0
        """
        layout, block, plan = self.layout, run.block, self.plan
        rows, numbers = run.settled(run.end)
        self.inputs = np.reshape(run.columns, (len(run.columns), run.count))[:, rows]
        used = {*layout.times, *layout.places, *layout.named}
        others = [each.place for each in layout.columns if isinstance(each, Kept) and each.place not in used]
        extras = {self.table.name(place): taken(column(place), rows) for place in others}
        own = numbers.shape[1]
        if plan.shapes and plan.shapes[-1].kind in (NORMAL, RATE):  # vectors rotated with a pose come last
            own -= 3 * (len(plan.targets) - 1)
        for each in layout.columns:
            if isinstance(each, New) and isinstance(each.piece, Out) and each.piece.first >= own:
                extras[each.name] = numbers[:, each.piece.first]
        stamps = block.stamps[0][rows] if layout.times else None
        # the frames of geodetic positions and of formulas
        unnamed = (self.earth, None) if self.rename is None else self.rename(self.earth, None)
        parents, names = (
            [name] if place is None else block.names.texts(role, rows)
            for role, (place, name) in enumerate(zip(layout.named, unnamed, strict=True))
        )
        numbers = numbers[:, :own]
        if plan.targets[0].kind == POSE and plan.targets[0].unit is None:
            numbers = np.hstack([numbers[:, :1] * np.zeros(3), numbers])
        return RowPoses(numbers, stamps, lines[rows], parents, names, extras)


class TableRows(PlannedRows):
    """The rows of a table, block by block.

    texts: the blocks of text; taken, lines: the number of bytes and lines of the head
    """

    def __init__(self, stream: ByteStream, fmt: str, request: Request, source: str, *, header: bool = True) -> None:
        """Read the head of a table, and plan its rows; raises FormatError or Misused."""
        delimiter = (FORMATS[fmt].rows.delimiter or "").encode()
        blocks, first = read_blocks(stream, whole=RecordEnds(delimiter) if delimiter else whole_lines), b""
        for block in blocks:  # up to the first that holds more than comments
            first += block
            if COMMENTS.fullmatch(first.removeprefix(BYTE_ORDER_MARK)) is None:
                break
        if not first.removeprefix(BYTE_ORDER_MARK).strip():
            raise FormatError("nothing in it", source=source)
        expected = request.rows.given or request.rows.given_place
        known = has_pose_column if request.rows.poses else lambda names: stamp_column(names) is not None
        table, rest = open_table(first, fmt, header=header, source=source, expected=expected, known=known)
        super().__init__(*as_trajectory(table, fmt, request))
        self.texts, self.taken = chain((rest,) if rest else (), blocks), len(first) - len(rest)
        self.lines = first.count(b"\n", 0, self.taken)

    def steps(self) -> Iterator[tuple[RowPoses, Outcome]]:
        """Yield the results of each block for another format."""
        for text in chain((b"",), self.texts):  # first the columns, without rows
            run, outcome, cells = self.of_text(text)
            outcome = outcome if text else Outcome(b"", lines=self.lines, size=self.taken)
            yield self.poses_of(run, cells.column, cells.lines_before()[cells.rows]), outcome

    def of_text(self, text: bytes) -> tuple[Run, Outcome, Cells]:
        """Compute a block; nothing after a quote that is not closed is read."""
        table, layout = self.table, self.layout
        torn = torn_record(text, table.delimiter) if table.delimiter else None
        cells = table.split(text[:torn])
        if self.request.offset_ns and layout.times:
            cells = table.split(self._at_other_times(text[:torn], cells, self.request.offset_ns))
        block = self.block_of(cells)
        run = self.ran(block)
        faults = run.faults()
        if torn is not None:
            faults.append(Fault(text.count(b"\n", 0, torn), "", UNCLOSED, final=True))
        rows = len(block.places) + len(block.broken)
        return run, Outcome(b"", faults, rows, text.count(b"\n"), len(run.mended), run.notes, len(text)), cells

    def block_of(self, cells: Cells) -> Block:
        """Find the rows of a block: their numbers, names and stamps, and the lines that are copied."""
        table, layout = self.table, self.layout
        places = layout.places
        is_run = places and places == tuple(range(places[0], places[0] + len(places)))  # avoids a copy
        own = slice(places[0], places[-1] + 1) if is_run else list(places)
        numbers = Spans(cells.data, cells.starts[:, own], cells.ends[:, own])
        if places and (cells.data == ord('"')).any():
            numbers = without_quotes(numbers)
        names = self.names_of(len(cells.rows), lambda place: coded(cells.column(place)))
        times = [without_quotes(cells.column(place)) for place in layout.times]
        some_static = self.request.rows.stamps == SOME
        name = table.name(layout.times[0]) if times else ""
        stamps, late = stamps_in(times, name, some_static=some_static) if times else (None, {})
        unchanged, broken, before = [], [], cache(cells.lines_before)
        if len(cells.rows) < len(cells.counts):
            named = f" ({' '.join(table.names)})" if table.names and len(table.names) < 12 else ""
            for line in cells.odd_lines().tolist():
                raw = cells.line(line)
                if cells.counts[line] == 0 or (cells.counts[line] == 1 and not raw.strip()):
                    unchanged.append((line, raw))
                else:
                    reason = f"expected {table.width} cells{named}, found {int(cells.counts[line])}"
                    broken.append((line, Fault(int(before()[line]), "", reason, skipped=True)))
        line_of = lambda row: int(before()[cells.rows[row]])  # noqa: E731
        bad, frames = {**late, **names.bad}, [names.frames]
        return Block(numbers, {}, cells.rows, line_of, unchanged, broken, names, [stamps], bad, frames=frames)

    def parts_of(self, cells: Cells, run: Run) -> dict[Any, Spans]:
        """Return the unchanged text around the results of a block, and the names of frames in it."""
        return {
            (part := piece.part): self._names(cells, part.place, part.role, run) if isinstance(part, Named)
            else Spans(cells.data, _bounds(cells, part[0]), _bounds(cells, part[1]))
            for piece in (self.plan.pieces if run.count else ()) if isinstance(piece, In)
        }  # fmt: skip

    def _names(self, cells: Cells, place: int, role: int, run: Run) -> Spans:
        """Write names as cells; a name that does not change, or of a bad row, keeps its spelling."""
        names, of_row = run.block.names, run.block.names.of_row
        new = spans_of([self.table.cell(result[role]) for result in names.results])
        pairs = zip(names.pairs, names.results, strict=True)
        same = np.array([old[role] == result[role] for old, result in pairs])[of_row]
        same[[*run.reasons]] = True
        data, behind = np.concatenate([new.data, cells.data]), len(new.data)
        starts = np.where(same, cells.starts[:, place] + behind, new.starts[of_row])
        return Spans(data, starts, np.where(same, cells.ends[:, place] + behind, new.ends[of_row]))

    def _at_other_times(self, text: bytes, cells: Cells, offset_ns: int) -> bytes:
        """Return rows with an offset added to their stamps; an invalid stamp is unchanged, and reported later."""
        columns = [without_quotes(cells.column(place)) for place in self.layout.times]
        in_ns = in_nanoseconds(self.table.name(self.layout.times[0]))
        stamps, reasons = read_stamps(columns, in_ns=in_ns)
        edits = []
        for row in sorted({*range(len(stamps))} - {*reasons}):
            stamp = int(stamps[row]) + offset_ns
            for column, part in zip(columns, divmod(stamp, BILLION), strict=False):
                new = str(part) if len(columns) > 1 else stamp_text(column.text(row).decode(), stamp, in_ns=in_ns)
                edits.append((int(column.starts[row]) - MARGIN, int(column.ends[row]) - MARGIN, new.encode()))
        return with_edits(text, edits)


def _bounds(cells: Cells, at: int) -> Ints:
    """Return the offset of a bound in each row: 0 is the start of the line, 1 that of the first cell, 2 its end, .."""
    place, is_end = divmod(at - 1, 2)
    if 0 <= place < cells.starts.shape[1]:
        return (cells.ends if is_end else cells.starts)[:, place]
    return (cells.line_ends if at else cells.line_starts)[cells.rows]
