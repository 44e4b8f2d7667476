"""JSON and YAML records as streams: each keeps its spelling and all its other keys, byte for byte."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.errors import FormatError, FrametoolError
from frametool.stream.faults import NULL, SKIP, STOP, Fault
from frametool.stream.json_array import closed, with_commas_between
from frametool.stream.run import Outcome, mapped
from frametool.stream.scalar import result_of
from frametool.stream.template import learn
from frametool.text.lines import read_blocks, whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator

    from frametool.stream.request import Request
    from frametool.text.lines import Source

FEW = 16  # records at the end of which a stream that is already complete needs no numpy
SMALL = 1 << 14  # bytes
_DOCUMENT_END = re.compile(rb"^---[ \t]*\r?\n", re.MULTILINE)
_TOKEN = re.compile(rb'"(?:[^"\\]|\\.)*(?:"|\\?\Z)|[{}\[\]]', re.DOTALL)  # a string that is cut off hides its brackets
_SEVERAL = re.compile(rb"\}\s*,?\s*\{")
_BEHIND_ARRAY = re.compile(rb"(?<=\})\s*(?:\]\s*|,\s*(?=\{))([^\s,\]}].*\S)", re.DOTALL)
_LEFT_OVER = re.compile(rb"[\s,\]\[]*([^\s,\]\[].*\S|[^\s,\]\[])", re.DOTALL)
_LINE = re.compile(rb"[^\n]*\n|[^\n]+\Z")
_AFTER_RECORD = re.compile(rb"[ \t]*,?[ \t]*\r?\n?")
_NO_DOCUMENT = re.compile(rb"(?:[ \t]*(?:#[^\n]*)?\r?(?:\n|\Z))*+(?:(?:\.\.\.|---)\s*)?")
MARK = b"\xef\xbb\xbf"


def run_records(
    stream: Source, form: str, request: Request, *, source: str, jobs: int = 1, size: int = 0
) -> Generator[Outcome]:
    """Yield the outcomes of a stream of records."""
    outcomes = _outcomes(stream, form, request, source=source, jobs=jobs, size=size)
    try:
        if form == "json":
            kept = with_commas_between(outcomes) if request.on_error == SKIP else outcomes
            yield from closed(kept, request.on_error)
        else:
            yield from outcomes
    finally:
        outcomes.close()  # ends the processes of several jobs


def _outcomes(
    stream: Source, form: str, request: Request, *, source: str, jobs: int, size: int
) -> Generator[Outcome]:
    options = {"size": size} if size else {}
    splitter = Splitter(form)
    blocks = read_blocks(stream, whole=splitter.whole, **options)
    first = next(blocks, None)
    if first is None:
        return
    second = next(blocks, None) if len(first) < SMALL and _has_ended(stream) else b""
    records = splitter.records(first) if second is None else []
    if second is None and len(records) <= FEW and not request.in_order:
        yield from _singly(first, records, form, request, source)
        return
    from frametool.stream.record_blocks import Work

    work = Work(splitter, form, request, source)
    jobs = 1 if request.in_order else jobs
    yield from mapped(work, _again(first, second, blocks), jobs)


def _again(first: bytes, second: bytes | None, blocks: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    if second:
        yield second
    yield from blocks


def _has_ended(stream: Source) -> bool:
    """Tell whether a stream has nothing more to come, or will have within a moment."""
    import select

    try:
        poll = select.poll()
        poll.register(stream.fileno(), select.POLLIN | select.POLLHUP)  # type: ignore[attr-defined]
    except (AttributeError, OSError, ValueError):
        return True
    events = poll.poll(20)
    return bool(events)


class Splitter:
    """Cut text into records; what stands between them (blank lines, brackets, commas) passes."""

    def __init__(self, form: str) -> None:
        """Know the form; whether JSON's records are lines shows in the first one."""
        self.form = form
        self.lines: bool | None = None if form == "json" else False

    def whole(self, text: bytes) -> int:
        """Return how many bytes are whole records."""
        if self.form == "yaml":
            ends = [found.end() for found in _DOCUMENT_END.finditer(text)]
            return ends[-1] if ends else 0
        if self.lines is None:
            lines = whole_lines(text)
            is_long_array = not lines and len(text) > SMALL and text.removeprefix(MARK).lstrip().startswith(b"[")
            self.lines = False if is_long_array else _first_line_is_whole(text[:lines])
        if self.lines is None:
            return 0
        return whole_lines(text) if self.lines else self._pretty(text)[1]

    def records(self, text: bytes) -> list[tuple[int, int]]:
        """Return where each record of a block stands."""
        if self.form == "yaml":
            return _documents(text)
        if self.lines is None:
            self.lines = _first_line_is_whole(text)
        if not self.lines:
            found, end = self._pretty(text)
            behind = _LEFT_OVER.match(text, end) if found else None
            return [*found, behind.span(1)] if behind else found
        return [span for found in _LINE.finditer(text) for span in self._in_line(text, found.start(), found.end())]

    def _in_line(self, text: bytes, start: int, end: int) -> list[tuple[int, int]]:
        """Return the records of a line: one, unless an array has several there."""
        span = _trimmed(text, start, end)
        if span is None or not (_SEVERAL.search(text, *span) or _BEHIND_ARRAY.search(text, *span)):
            return [span] if span else []
        found, stop = self._pretty(text[span[0] : span[1]])
        inner = [(span[0] + a, span[0] + b) for a, b in found]
        behind = _BEHIND_ARRAY.match(text, span[0] + stop, span[1])
        if behind and found:
            return [*inner, behind.span(1)]
        return inner if stop == span[1] - span[0] else [span]

    def _pretty(self, text: bytes) -> tuple[list[tuple[int, int]], int]:
        """Find objects that span lines, by their brackets."""
        found, depth, start, end = [], 0, 0, 0
        for token in _TOKEN.finditer(text):
            mark = token[0]
            if mark in (b"{", b"[") and (depth or mark == b"{"):
                start = start if depth else token.start()
                depth += 1
            elif mark in (b"}", b"]") and depth:
                depth -= 1
                if not depth:
                    end = token.end()
                    found.append((start, end))
        return found, end


def _first_line_is_whole(text: bytes) -> bool | None:
    """Tell whether JSON comes as one record a line, as in JSON Lines or an array of lines; None if none begins."""
    for line in text.removeprefix(MARK).splitlines():
        inner = line.strip().removeprefix(b"[").strip(b" \t,")
        if inner in (b"", b"]"):
            continue
        depth = 0
        for token in _TOKEN.finditer(line.strip() if not inner.startswith(b"{") else inner):
            depth += 1 if token[0] in (b"{", b"[") else -1 if token[0] in (b"}", b"]") else 0
            if depth < 0:
                break
        return depth <= 0
    return None


def _trimmed(text: bytes, start: int, end: int) -> tuple[int, int] | None:
    """Return the record in a line: without blanks, the brackets of an array around it and commas after it."""
    line = text[start:end]
    body = line.strip(b" \t\r\n")
    if body.startswith(MARK):
        body = body[3:]
    if body.startswith(b"[") and body[1:].lstrip().startswith(b"{"):
        body = body[1:].lstrip()
    if body.startswith(b"{"):
        body = body.rstrip(b" \t,")
        if body.endswith(b"]"):
            body = body[:-1].rstrip(b" \t,")
    else:
        body = body.rstrip(b",") if body.startswith(b"[") else body.strip(b",")
    if body in (b"", b"[", b"]"):
        return None
    begin = start + line.find(body)
    return begin, begin + len(body)


def _documents(text: bytes) -> list[tuple[int, int]]:
    """Return the documents of a YAML text that hold more than comments, without the lines of `---`."""
    found, start = [], 3 if text.startswith(MARK) else 0
    for mark in _DOCUMENT_END.finditer(text):
        found.append((start, mark.start()))
        start = mark.end()
    found.append((start, len(text)))
    return [span for span in found if not _NO_DOCUMENT.fullmatch(text, *span)]


def _singly(text: bytes, records: list[tuple[int, int]], form: str, request: Request, source: str) -> Iterator[Outcome]:
    """Yield the outcome of the few records of a whole stream."""
    out, faults, at = [], [], 0
    for start, end in records:
        between, at = text[at:start], end
        out.append(between)
        line = text.count(b"\n", 0, start)
        result = attempt(text[start:end], form, request, source, line, _rendered(request))
        if isinstance(result, Fault):
            faults.append(result)
            if request.on_error == NULL:
                out.append(null_of(text[start:end]))
            else:
                at = end_of_record(text, end, form)
            if request.on_error == STOP:
                at = len(text)
                break
        else:
            out.append(result)
    yield Outcome(b"".join([*out, text[at:]]), faults, len(records), text.count(b"\n"), size=len(text))


def null_of(record: bytes) -> bytes:
    """Return what stands for a record without a result; its line end, if it has one, stays."""
    body = record.rstrip(b"\r\n")
    return b"null" + record[len(body) :]


def _rendered(request: Request) -> Callable[..., bytes]:
    return lambda learned: result_of(learned, request).encode()


def end_of_record(text: bytes, end: int, form: str) -> int:
    """Return where a record ends with what parts it from the next."""
    if form == "yaml":
        mark = _DOCUMENT_END.match(text, end)
        return mark.end() if mark else end
    following = _AFTER_RECORD.match(text, end)
    return following.end() if following else end


def attempt(
    text: bytes, form: str, request: Request, source: str, line: int, use: Callable[..., bytes]
) -> bytes | Fault:
    """Learn from a record and use it, or say what is wrong with it; `line` counts from 0."""
    record = None
    try:
        record = learn(_decoded(text, source, line), request, json=form == "json", source=source, line=line + 1)
        if record is None:
            return text
        return use(record)
    except FormatError as error:
        column = getattr(error, "column_name", "") or (str(error.column) if error.column else "")
        return Fault(max(error.line, 1) - 1, column, error.message, kind=error.kind)
    except FrametoolError as error:
        below = record.line if record else 0
        return Fault.of(line + below, getattr(error, "column_name", ""), error)


def _decoded(text: bytes, source: str, line: int) -> str:
    try:
        return text.decode()
    except UnicodeDecodeError as error:
        problem = f"not UTF-8 text: byte 0x{text[error.start]:02x}"
        raise FormatError(problem, source=source, line=line + 1 + text.count(b"\n", 0, error.start)) from None
