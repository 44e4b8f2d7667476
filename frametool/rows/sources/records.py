"""Process streams of JSON and YAML records: results replace the numbers in the text, or are written in another format.

A short stream is computed record by record, without numpy; in longer ones records with the same layout are computed
together as arrays.

After a broken JSON line, reading resumes at the next line.  It ends at the first broken item of an array, or at the
first broken value of several lines.  Text that is no record is a `Part` with a problem, so that it is always reported.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cached_property, partial
from io import BufferedReader
from itertools import chain, count
from json import JSONDecoder
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from frametool import sizes
from frametool.documents.document import parse_nodes
from frametool.errors import FormatError, FrametoolError, NamedTuple, ValueInvalid
from frametool.frames.stamps import read_header_stamp, read_stamp, stamp_text
from frametool.grammar.pose import Pose
from frametool.grammar.readers import STAMP_KEYS, in_nanoseconds
from frametool.grammar.result import NoResult, Style
from frametool.rows.faults import NULL, STOP, Fault, Outcome, RowNote
from frametool.rows.plain import ROUNDED, Outside, RecordText, plain, values_of_text
from frametool.rows.sinks.in_place import attempt, column_in, fault_at, nulled, rendered
from frametool.rows.sinks.results import BlockResults, text_in_order
from frametool.text.lines import Pieces, read_blocks, readiness, whole_lines, with_edits

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from frametool.geometry import Components
    from frametool.rows.evaluate import Run, State
    from frametool.rows.request import Request
    from frametool.rows.sinks.alike import RecordRows
    from frametool.rows.sinks.as_rows import AlikeRows
    from frametool.rows.sources.templates import Hit, RecordCutter
    from frametool.text.lines import ByteStream

_LEADING_COMMA = re.compile(rb"\A((?:\xef\xbb\xbf)?\s*\[?\s*),\s*")
LONG_MS = 20  # time to wait for the second block of a stream whose first is short
MOST_EXACT = 100  # bad records of one template in a block that are read again for their exact place
NO_END = "the array does not end: its ] is missing"
DOCUMENTS, LINES, VALUES, ARRAY = "documents", "lines", "values", "array"
MARK = b"\xef\xbb\xbf"
MUCH = 1 << 20  # bytes of one unfinished value beyond which it is scanned again only at twice the size

# a document may begin behind its dashes; the last is ros2's note of a loss
_SEPARATOR = re.compile(rb"^(?:---(?=\s)[ \t]*(?:\r?\n)?|\ttotal count: ?\d+---[ \t]*\r?\n)", re.MULTILINE)
_NO_DOCUMENT = re.compile(rb"(?:\xef\xbb\xbf)?(?:[ \t]*(?:#[^\n]*)?\r?(?:\n|\Z))*+(?:(?:\.\.\.|---)\s*)?")
_LINE = re.compile(rb"[^\n]*\n|[^\n]+\Z")
_SEVERAL = re.compile(rb"[}\]]\s*+(?:,\s*+)?+[{\[]|\}\s*+(?:,\s*+)?+[^\s,}\]]")
_AFTER = re.compile(rb"[ \t]*,?[ \t]*\r?\n?")
_GAP = re.compile(rb"\s*+(,?+)\s*+")
_OPENING = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[")
_DECODE = JSONDecoder(parse_int=str, parse_float=str, parse_constant=str).raw_decode  # numbers remain text
_WORD_AT_END = re.compile(r"[\w.+-]*\s*\Z")  # for example 1e of 1e-05
_BEHIND_ITEM = re.compile(rb"\s*+[^\s\[]")


def run_records(
    stream: ByteStream, fmt: str, request: Request, *, source: str, style: Style | None = None
) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records: text with results in place; with a style, results for a writer."""
    outcomes = _outcomes(stream, RecordBlocks(fmt, request, source, style))
    yield from _as_array(outcomes, request.on_error) if fmt == "json" and style is None else outcomes


def _outcomes(stream: ByteStream, work: RecordBlocks) -> Generator[Outcome]:
    """Yield the outcome of each block; an array without its closing bracket is a fault at the end."""
    blocks = read_blocks(stream, whole=work.splitter.whole)
    first = next(blocks, None)
    if first is None:
        return
    second: bytes | None = b""
    failed: FormatError | None = None
    if len(first) < sizes.SMALL and readiness(stream, unknown=True)(LONG_MS):
        try:
            second = next(blocks, None)
        except FormatError as error:  # raised after the results of the first block
            failed = error
    are_few = second is None and not work.request.in_order and len(work.splitter.parts(first)[0]) <= sizes.FEW
    is_open: bool | None = True
    for block in chain([first, second] if second else [first], blocks):
        outcome = work.outcome(block, are_few=are_few)
        is_open = is_open and outcome.is_open
        yield outcome
    if failed is not None:
        raise failed
    if is_open:
        yield Outcome(b"", (Fault(-1 if work.ended else 0, "", NO_END),), is_open=True)


def at_other_times(stream: ByteStream, fmt: str, offset_ns: int) -> BufferedReader:
    """Return a stream of records with an offset added to all stamps; a record that cannot be read is unchanged."""

    def pieces() -> Iterator[bytes]:
        splitter = Splitter(fmt)
        for block in read_blocks(stream, whole=splitter.whole):
            edits = []
            for part in splitter.parts(block)[0]:
                with suppress(FrametoolError, TypeError, UnicodeDecodeError):  # a list is no key
                    moved, _ = with_offset(block[part.start : part.end].decode(), offset_ns)
                    edits.append((part.start, part.end, moved.encode()))
            yield with_edits(block, edits)

    return BufferedReader(Pieces(filter(None, pieces())))


def with_offset(text: str, offset_ns: int) -> tuple[str, int]:
    """Return documents with an offset added to all stamps, and the number of stamps.

    A stamp is the value of one of STAMP_KEYS, or a pair of seconds and nanoseconds.
    """
    edits, pending = list[tuple[int, int, str]](), parse_nodes(text)
    for node in pending:  # grows by the values below each node
        if type(node.value) is list:
            pending += node.value
        members = {key: value for key, (_, value) in node.value.items()} if type(node.value) is dict else {}
        pending += members.values()
        texts = {key: value for key, value in members.items() if type(value.value) is str}
        own = [key for key in STAMP_KEYS if key in texts][:1]
        for keys in (own, ("sec", "nanosec"), ("secs", "nsecs")):
            found = [texts[key] for key in keys if key in texts]
            with suppress(ValueInvalid):
                if len(found) == 2:
                    stamp_ns = read_header_stamp(*(each.value for each in found))
                    parts = [*map(str, divmod(stamp_ns + offset_ns, 1_000_000_000))]
                elif found and keys is own:
                    in_ns = in_nanoseconds(keys[0])
                    stamp_ns = read_stamp(found[0].value, in_ns=in_ns)
                    parts = [stamp_text(found[0].value, stamp_ns + offset_ns, in_ns=in_ns)]
                else:
                    continue
                insides = ((each.start + bool(each.quote), each.end - bool(each.quote)) for each in found)
                edits += [(*inside, part) for inside, part in zip(insides, parts, strict=True)]
    return with_edits(text, edits), len(edits)


def _as_array(outcomes: Iterable[Outcome], on_error: str) -> Iterator[Outcome]:
    """Remove the comma before the first remaining record, and close an array that has no end.

    The text before the first record is held back, so that nothing is written if that record is an error.
    """
    any_kept, held = False, b""
    for outcome in outcomes:
        text = held + outcome.text
        if outcome.is_open is not None and not any_kept and outcome.kept:
            text = _LEADING_COMMA.sub(rb"\1", text)
        broken = any(each.final or each.reason == NO_END for each in outcome.faults)
        ends = on_error != STOP and outcome.is_open and broken
        text += b"]\n" if ends else b""
        any_kept = any_kept or bool(outcome.kept or ends)
        held = b"" if any_kept or outcome.is_open is None else text
        yield outcome._replace(text=text[len(held) :])
    if held:
        yield Outcome(held, ())


class Found:
    """The results, faults and warnings of one block while it is processed.

    items: results of single records, by position; runs, alike: those of records with the same layout
    cutter: finds records with a known layout, None in short streams; singles: records matched to a layout one by one
    kept: number of records with a result, or with null instead of one
    """

    def __init__(self, text: bytes, cutter: RecordCutter | None) -> None:
        """Start with the text of the block."""
        self.text, self.cutter = text, cutter
        self.items, self.faults, self.notes = list[tuple[int, Any]](), list[tuple[int, Fault]](), list[RowNote]()
        self.singles: list[tuple[Part, Hit]] = []
        self.runs: list[Run] = []
        self.alike: list[AlikeRows] = []
        self.rows = self.kept = self.mended = 0


class RecordBlocks:
    """Process blocks of records: results replace the numbers in the text, or are passed to a writer."""

    def __init__(self, fmt: str, request: Request, source: str, style: Style | None = None) -> None:
        """Start without templates."""
        self.fmt, self.style, operation = fmt, style, request.operation
        self.request = request if style is None else request.with_results(rewrite_records=True)
        self.splitter = Splitter(fmt)
        self._read = partial(attempt, fmt=fmt, request=self.request, name=source)
        shows_all = operation.shown is not None or (request.results.place is not None and not operation.looks_back)
        learns = (sizes.LEARNED or request.in_order) and not (style is not None and shows_all)
        self._is_singly = not learns  # compute all records one by one
        self.ended = True  # whether the last block ended with a line

    @cached_property
    def _bulk(self) -> tuple[RecordCutter, State, RecordRows | None]:
        """Return the cutter, the state carried from block to block, and, with a style, the maker of rows."""
        from frametool.rows.evaluate import State
        from frametool.rows.sources.templates import RecordCutter

        rows = None
        if self.style is not None:
            from frametool.rows.sinks.alike import RecordRows

            rows = RecordRows(self.request, self.style, is_yaml=self.fmt == "yaml")
        return RecordCutter(self.splitter, self._read), State(), rows

    def outcome(self, text: bytes, *, are_few: bool) -> Outcome:
        """Return the outcome of a block; are_few: compute its records one by one."""
        found = Found(text, None if are_few or self._is_singly else self._bulk[0])
        closed = self._take(0, len(text), found) if found.cutter is None else self._run(found)
        self.ended = text.endswith(b"\n")
        found.faults.sort()
        stops = self.request.on_error == STOP and found.faults
        end = found.faults[0][0] if stops else len(text) + 1
        items = sorted((each for each in found.items if each[0] < end), key=itemgetter(0))
        written, results = b"", None
        if self.style is None:
            written = text_in_order(items, [group for run in found.runs for group in run.groups(run.block.parts, end)])
        else:
            alike = [each.take((each.places < end).nonzero()[0]) for each in found.alike] if stops else found.alike
            results = BlockResults([each for each in alike if len(each.places)], items, text)
        is_open = None if self.splitter.layout != ARRAY else not closed
        return Outcome(
            written, [*map(itemgetter(1), found.faults)], found.rows, text.count(b"\n"), found.mended,
            sorted(found.notes, key=RowNote.place), len(text), found.kept, is_open, results,
        )  # fmt: skip

    def _take(self, start: int, end: int, found: Found) -> bool:
        """Process records one by one and copy the text between them; return True if an array ends there."""
        text, cutter, keeps_text, at = found.text, found.cutter, self.style is None, start
        parts, closed = self.splitter.parts(text[start:end])
        for part, line in _with_lines(text, (each.behind(start) for each in parts) if start else parts):
            if part.begin > at and keeps_text:
                found.items.append((at, text[at : part.begin]))
            at = part.after
            hit = None if cutter is None else cutter.match(text, part)
            if hit is None:
                made = self._read(text, part, line)
                if cutter is not None and isinstance(made, RecordText):
                    hit = cutter.learned(made, text, part)
                if hit is None:
                    self._alone(part, made, line, found)
            if hit is not None:
                found.singles.append((part, hit))
            if found.faults and self.request.on_error == STOP:
                return closed
        if at < end and keeps_text:
            found.items.append((at, text[at:end]))
        return closed

    def _alone(
        self, part: Part, made: RecordText | Fault, line: int, found: Found, parts: Sequence[Components] | None = None
    ) -> None:
        """Add the result of one record, or its fault; parts: the components of its results, if already computed."""
        style, place, record = self.style, part.begin, found.text[part.start : part.end]
        if isinstance(made, RecordText):
            try:
                answers = made.answers(parts)
                if style is None:
                    items: list[tuple[int, Any]] = [(place, part.around(found.text, rendered(made, answers) or record))]
                else:
                    starts = made.starts(part.start, answers) if b"\n" in record.strip() else count(part.start)
                    items = [*zip(starts, values_of_text(made, answers, style), strict=False)]
                found.notes += made.notes_at(line, column_in(found.text, part.start), answers)
            except FrametoolError as error:
                made = fault_at(made.source, error, line + made.line)
            else:
                found.mended += [note.rule for note in made.notes].count(ROUNDED) if made.notes else 0
                found.rows, found.kept = found.rows + 1, found.kept + 1
                found.items += items
                return
        if isinstance(made.reason, Outside):
            return
        found.rows += 1
        found.faults.append((place, made))
        if self.request.on_error == NULL and not made.final:
            found.kept += 1
            is_json = self.fmt == "json"
            if style is None:  # itself, with null in the place of numbers, or null
                body = record.rstrip(b"\r\n")
                text, has_numbers = nulled(body, json=is_json)
                row = (text if has_numbers else "null").encode() + record[len(body) :]
                found.items.append((place, part.around(found.text, row)))
            else:
                found.items.append((part.start, _no_result(record, style, json=is_json)))

    def _run(self, found: Found) -> bool:
        """Compute records with a known layout as arrays, the others one by one; return True if an array ends there.

        A bad record is read once more by itself, for an error with its exact place.
        """
        from frametool.rows.evaluate import Run
        from frametool.rows.sources.templates import block_of, by_template, in_order, plan_of
        from frametool.text.spans import framed

        text, (cutter, state, rows), closed = found.text, self._bulk, False
        cuts, rest = cutter.cut(text) if self.splitter.layout in (LINES, DOCUMENTS) else ([], [(0, len(text))])
        for start, end in rest:
            closed = self._take(start, end, found)
        cuts = by_template(cuts, found.singles)
        cuts = in_order(cuts) if self.request.in_order else cuts
        data = framed(text if cuts else b"")
        for cut in cuts:
            template, left = cut.template, set[int]()
            plan = rows.plan(template) if rows else plan_of(template, self.request, yaml=self.fmt == "yaml")
            called = cut.frames(text)
            run = Run(plan, block_of(cut, called, data, text, plan.request), state)
            if rows is not None:
                alike, left = rows.take(cut, run, called)
                found.alike += alike
            alone = sorted({*run.reasons, *left})
            found.rows += len(cut.starts) - len(alone)
            found.kept += len(run.rows) - len(left)
            found.mended += len({*run.mended} - left)
            found.runs.append(run)
            for at, (part, line) in enumerate(_with_lines(text, (Part(*cut.place(row)) for row in alone))):
                reason = run.reasons.get(row := alone[at])
                made = self._read(text, part, line) if reason is None or at < MOST_EXACT else None
                if made is None or (reason is not None and not isinstance(made, Fault)):
                    made = Fault(run.block.line_of(row), *(reason or ("", "")))
                self._alone(part, made, line, found, run.parts_of(row) if self.request.in_order else None)
            found.notes += run.notes
            if len(cut.starts):
                found.notes += [each._replace(line=run.block.line_of(0)) for each in template.notes]
        return closed


def _no_result(record: bytes, style: Style, *, json: bool) -> NoResult:
    """Return the other fields of a bad record; in a table the cells of its numbers are empty."""
    is_table = style.format == "csv"
    root = next(iter(parse_nodes(nulled(record, json=json)[0])), None)
    kept = {
        key: plain(node) for key, (_, node) in (root.value.items() if root and type(root.value) is dict else ())
        if not is_table or any(plain(leaf) is not None for leaf in node.leaves())
    }  # fmt: skip
    return NoResult(Pose(), kept)


def _with_lines(text: bytes, parts: Iterable[Part]) -> Iterator[tuple[Part, int]]:
    """Yield records in the order of the text, each with its line, counted from 0."""
    line = counted = 0
    for part in parts:
        line, counted = line + text.count(b"\n", counted, part.start), part.start
        yield part, line


# --- positions of records in a text, by syntax alone ---


class Part(NamedTuple):
    """The position of a record in a text.

    begin, after: the record with the comma, blanks or separator that are removed together with it
    start, end: the record itself, or the text from the place of the error
    problem: the error if it is no record; "" if only parsing it can tell
    final: nothing after it can be read
    """

    begin: int
    start: int
    end: int
    after: int
    problem: str = ""
    final: bool = False

    def around(self, text: bytes, record: bytes) -> bytes:
        """Return another record with the text around this one."""
        return text[self.begin : self.start] + record + text[self.end : self.after]

    def behind(self, start: int) -> Part:
        """Return the position in a text with `start` bytes more at its beginning."""
        return self._replace(
            begin=self.begin + start, start=self.start + start, end=self.end + start, after=self.after + start
        )


class Splitter:
    """Split a stream into records; `layout` is "" until the first line of JSON has been read."""

    def __init__(self, fmt: str) -> None:
        """Take `json` or `yaml`."""
        self.layout = DOCUMENTS if fmt == "yaml" else ""
        self._looked = 0

    def whole(self, text: bytes) -> int:
        """Return the number of bytes that are whole records; called again with more text while it is 0."""
        if self.layout == DOCUMENTS:  # continue where the last search ended
            ends = [found.end() for found in _SEPARATOR.finditer(text, text.rfind(b"\n", 0, self._looked) + 1)]
            self._looked = 0 if ends else len(text)
            return ends[-1] if ends else 0
        self.layout = self.layout or _layout_of(text, final=False)
        if self.layout in ("", LINES):
            return whole_lines(text) if self.layout else 0
        if MUCH < len(text) < 2 * self._looked:
            return 0
        ended = 0
        for part in self._values(text, final=False)[0]:  # a cut must not change the meaning of the text
            if part.final or self.layout != ARRAY:
                is_end = part.final or part.after < len(text) or text.endswith(b"\n")
            else:
                is_end = bool(_BEHIND_ITEM.match(text, part.end))
            ended = part.after if is_end else ended
        self._looked = 0 if ended else len(text)
        return ended

    def parts(self, text: bytes) -> tuple[list[Part], bool]:
        """Return the records of a block, or of the rest of a stream, and whether an array ends in it."""
        if self.layout == DOCUMENTS:
            return list(_documents(text)), False
        self.layout = self.layout or _layout_of(text, final=True)
        if self.layout == LINES:
            return [part for line in _LINE.finditer(text) for part in _of_line(text, *line.span())], False
        return self._values(text, final=True)

    def _values(self, text: bytes, *, final: bool) -> tuple[list[Part], bool]:
        """Scan JSON values in sequence, or in an array with commas between them."""
        opening = _OPENING.match(text) if self.layout == ARRAY else None
        start = opening.end() if opening else 3 if text.startswith(MARK) else 0
        return _scanned(text, start, array=self.layout == ARRAY, final=final, first=bool(opening))


def _of_line(text: bytes, start: int, end: int) -> list[Part]:
    """Return the records of a line, usually one."""
    line = text[start:end]
    body = line.strip(b" \t\r\n,").removeprefix(MARK)
    if not body:
        return []
    begin = start + line.find(body)
    found, _ = _scanned(body, 0, array=False, final=True) if _SEVERAL.search(body) else ([], False)
    if len(found) > 1:  # none of several records includes the end of the line
        return [each.behind(begin)._replace(final=False) for each in found]
    stop = begin + len(body)
    after = _AFTER.match(text, stop).end()  # type: ignore[union-attr]
    return [Part(begin, begin, stop, after, found[0].problem if found else "")]


def _layout_of(text: bytes, *, final: bool) -> str:
    """Return the layout of JSON by its first lines; "" if they have not arrived yet."""
    body = text.removeprefix(MARK).lstrip()
    if body.startswith(b"["):
        following = body[1:].lstrip(b" \t\r")[:1]
        if following in (b"{", b"]", b"\n", b""):
            return ARRAY if following or final else ""
    first, end, rest = body.partition(b"\n")
    if not body or not (end or final):
        return ""
    _, problem = _value(first.decode("latin-1").rstrip(" \t\r,"), 0)
    if body.startswith(b"[") and b"{" in (body if problem is None else first):
        return ARRAY  # the first item is no record: lists of numbers hold no objects
    if problem is not None:
        return LINES
    # the first line ends within a value, which continues or is broken
    second, end, _ = rest.partition(b"\n")
    if not (end or final):
        return ""
    if not second.startswith(b"{"):
        return VALUES if rest.strip() else LINES
    second = second.rstrip(b" \t\r")
    if _value(second.decode("latin-1"), 0) == (len(second), ""):
        return LINES
    _, problem = _value(body.decode("latin-1"), 0)
    return VALUES if problem == "" else "" if problem is None and not final else LINES


def _value(text: str, at: int) -> tuple[int, str | None]:
    """Return the end of the JSON value at an offset and "", or the place and message of an error (None if cut off)."""
    try:
        return _DECODE(text, at)[1], ""
    except RecursionError:
        return at, "nested too deeply"
    except ValueError as error:
        place: int = getattr(error, "pos", at)
        message: str = getattr(error, "msg", str(error))
        is_cut = _WORD_AT_END.match(text, place) or message.startswith("Unterminated string")
        return place, None if is_cut else f"not JSON: {message[:1].lower()}{message[1:]}"


def _scanned(data: bytes, at: int, *, array: bool, final: bool, first: bool = True) -> tuple[list[Part], bool]:
    """Scan values from an offset; unless the text is final, a value that may continue after it ends the scan."""
    found: list[Part] = []
    text = data.decode("latin-1")  # keeps every offset; the syntax of JSON is ASCII
    needs_comma = array and not first
    while True:
        gap = _GAP.match(data, at)
        start, comma = (gap.end(), gap[1]) if gap else (at, b"")
        opening = data[start : start + 1]
        if comma and array and final and opening in (b"", b"]"):
            found.append(Part(at, start - (not opening), start, start, "no record follows this comma"))
        if not opening or (array and opening == b"]" and not final):
            return found, False
        if array and opening == b"]":
            if rest := data[start + 1 :].strip():
                begin = data.find(rest, start + 1)
                behind = "text behind the end of the array"
                found.append(Part(start + 1, begin, begin + len(rest), len(data), behind, final=True))
            return found, True
        if array and opening == b",":
            found.append(Part(at, start, start, start, "no record stands between two commas"))
            at, needs_comma = start, False
            continue
        end, wrong = _value(text, start)
        if wrong is None and not final:
            return found, False
        if wrong != "":
            problem, begin, place = wrong or "not JSON: it is cut off", at if array else start, end if wrong else start
            return [*found, Part(begin, place, len(data), len(data), problem, final=True)], False
        problem = "a comma is missing before this record" if needs_comma and not comma else ""
        after = end if array else _AFTER.match(data, end).end()  # type: ignore[union-attr]
        found.append(Part(at if array else start, start, end, after, problem))
        at, needs_comma = end, array


def _documents(text: bytes) -> Iterator[Part]:
    """Yield the documents of a YAML text that hold more than comments, each with the separator after it."""
    start = 0
    for mark in (*_SEPARATOR.finditer(text), None):
        after = len(text) if mark is None else mark.end()
        end = mark.start() if mark and mark[0].startswith(b"-") else after
        start += len(MARK) * text.startswith(MARK, start)
        if not _NO_DOCUMENT.fullmatch(text, start, end):
            yield Part(start, start, end, after)
        start = after
