"""Where the records of a text stand: YAML documents, JSON lines, JSON values over several lines, arrays of them.

Knows the syntax around records and none of their meaning.  What is no record is a part of its own with the problem
it has, so that nothing passes unseen; after it the next record is looked for where a line or an object begins.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.text.lines import whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

DOCUMENTS, LINES, VALUES, ARRAY = "documents", "lines", "values", "array"
MARK = b"\xef\xbb\xbf"
MUCH = 1 << 20  # bytes of one unfinished value from which it is looked at only when twice as much has come

_SEPARATOR = re.compile(rb"^(?:---|\ttotal count: ?\d+---)[ \t]*\r?\n", re.MULTILINE)  # the last: ros2's note of a loss
_NO_DOCUMENT = re.compile(rb"(?:\xef\xbb\xbf)?(?:[ \t]*(?:#[^\n]*)?\r?(?:\n|\Z))*+(?:(?:\.\.\.|---)\s*)?")
_LINE = re.compile(rb"[^\n]*\n|[^\n]+\Z")
_SEVERAL = re.compile(rb"[}\]]\s*+(?:,\s*+)?+[{\[]|\}\s*+(?:,\s*+)?+[^\s,}\]]")
_AFTER = re.compile(rb"[ \t]*,?[ \t]*\r?\n?")
_GAP = re.compile(rb"\s*(,?)\s*")
_OPENING = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[")
_WORD_AT_END = re.compile(r"[\w.+-]*\s*\Z")  # such as the 1e of 1e-05
_LINE_OF_NEXT = re.compile(rb"\n([ \t]*+(?:,[ \t]*+)?+)[{\[]")
_NEXT_ITEM = re.compile(rb"\}[ \t]*+(?:,[ \t]*+)?+(?=\{)|\n[ \t]*+(?:,[ \t]*+)?+(?=[{\[])")
MOST_KEYS = 100  # first keys of broken records that stand nowhere else
_FIRST_KEY = re.compile(rb"\{\s*+\"[^\"\n]*+\"")
_TOKEN = re.compile(rb'"(?:[^"\\\n]|\\.)*+"?|[{}\[\]]')
_WORD = re.compile(rb"[\]}]*+[^\[\]{}\n]*+")
_ITEM = re.compile(rb"[\]}]*+[^\[\]{},\n]*+")
_BEHIND_ITEM = re.compile(rb"\s*+[^\s\[]")
_INSIDE = re.compile(rb"\]\s*+[,\]}]")  # a bracket that does not end the array, whatever went wrong before it


class Part(NamedTuple):
    """A record in a text, and what goes with it.

    begin: where the comma or blanks before it begin, if they vanish with it
    start, end: the record itself
    after: where what follows it ends, if that vanishes with it
    problem: why it is no record; "" where reading it decides
    outside: it stands where not even null can be written
    """

    begin: int
    start: int
    end: int
    after: int
    problem: str = ""
    outside: bool = False


class Parts(NamedTuple):
    """The records of a block; `closed` where an array ends in it."""

    parts: list[Part]
    closed: bool = False


class Splitter:
    """Cut a stream into records; `layout` is "" until the first line of JSON has been seen."""

    def __init__(self, form: str) -> None:
        """Take `json` or `yaml`."""
        self.layout = DOCUMENTS if form == "yaml" else ""
        self._looked = 0

    def whole(self, text: bytes) -> int:
        """Return how many bytes of what has come are whole records; called with more until some are."""
        if self.layout == DOCUMENTS:
            return self._whole_documents(text)
        self.layout = self.layout or _layout_of(text, final=False)
        if self.layout in ("", LINES):
            return whole_lines(text) if self.layout else 0
        if MUCH < len(text) < 2 * self._looked:
            return 0
        found = self._values(text, final=False).parts
        ended = [part for part in found if self._has_ended(text, part)]
        good = [part for part in ended if not part.problem]
        end = (good or ended)[-1].after if ended else 0
        if ended and not good and self._values(text[:end], final=True).parts != found[: found.index(ended[-1]) + 1]:
            end = 0  # where the last one ends is told by what follows
        self._looked = 0 if end else len(text)
        return end

    def _has_ended(self, text: bytes, part: Part) -> bool:
        """Tell whether a text can be cut behind a record so that either piece means what it meant."""
        if self.layout != ARRAY:
            return part.after < len(text) or text.endswith(b"\n")
        return bool(_BEHIND_ITEM.match(text, part.end))

    def _whole_documents(self, text: bytes) -> int:
        """Return the end of the last separator; what has been looked at is not looked at again."""
        ends = [found.end() for found in _SEPARATOR.finditer(text, text.rfind(b"\n", 0, self._looked) + 1)]
        self._looked = 0 if ends else len(text)
        return ends[-1] if ends else 0

    def parts(self, text: bytes, match: Callable[[int], int | None] | None = None) -> Parts:
        """Return the records of a block of whole records, or of the rest of a stream.

        match: gives the end of a record that is known to begin at a place.
        """
        if self.layout == DOCUMENTS:
            return Parts(list(_documents(text)))
        self.layout = self.layout or _layout_of(text, final=True)
        if self.layout == LINES:
            return Parts([part for line in _LINE.finditer(text) for part in self._line(text, *line.span())])
        return self._values(text, final=True, match=match)

    def _line(self, text: bytes, start: int, end: int) -> list[Part]:
        """Return the record of a line, or several."""
        line = text[start:end]
        body = line.strip(b" \t\r\n,").removeprefix(MARK)
        if not body:
            return []
        begin = start + line.find(body)
        if not _SEVERAL.search(body):
            return [_with_separator(text, begin, begin + len(body))]
        found = _scanned(body, 0, array=False, final=True, match=None).parts
        parts = [_with_separator(text, begin + each.start, begin + each.end, each.problem) for each in found]
        kept = text.rfind(body[-1:], start, end) + 1  # the end of the line goes with none of several
        return [part._replace(after=min(part.after, kept)) for part in parts] if len(parts) > 1 else parts

    def _values(self, text: bytes, *, final: bool, match: Callable[[int], int | None] | None = None) -> Parts:
        """Scan JSON values one after the other, in an array with commas between them."""
        opening = _OPENING.match(text) if self.layout == ARRAY else None
        start = opening.end() if opening else 3 if text.startswith(MARK) else 0
        found = _scanned(text, start, array=self.layout == ARRAY, final=final, match=match, first=bool(opening))
        if self.layout == ARRAY:
            return found
        return Parts([_with_separator(text, each.start, each.end, each.problem) for each in found.parts])


def _with_separator(text: bytes, start: int, end: int, problem: str = "") -> Part:
    """Let what follows a record on its line go with it."""
    after = _AFTER.match(text, end)
    return Part(start, start, end, after.end() if after else end, problem)


def _layout_of(text: bytes, *, final: bool) -> str:
    """Tell how JSON is laid out by its first line; "" where that has not come yet."""
    body = text.removeprefix(MARK).lstrip()
    if body.startswith(b"["):
        following = body[1:].lstrip(b" \t\r")[:1]
        if following in (b"{", b"]", b"\n", b""):
            return ARRAY if following or final else ""
    end = body.find(b"\n")
    if not body or (end < 0 and not final):
        return ""
    line = body if end < 0 else body[:end]
    _, problem = _value(line.decode("latin-1").rstrip(" \t\r,"), 0)
    if body.startswith(b"[") and b"{" in (body if problem is None else line):
        return ARRAY  # its first item is no record: lists of numbers hold no objects
    return VALUES if problem is None else LINES


TOO_DEEP = "nested too deeply"


def _value(text: str, at: int) -> tuple[int, str | None]:
    """Return the end of the JSON value at a place and ""; or where it goes wrong and why: None if it is cut off."""
    try:
        return _decoder()(text, at)[1], ""
    except RecursionError:
        return at, TOO_DEEP
    except ValueError as error:
        place: int = getattr(error, "pos", at)
        message: str = getattr(error, "msg", str(error))
        is_cut = _WORD_AT_END.match(text, place) or message.startswith("Unterminated string")
        return place, None if is_cut else f"not JSON: {message[:1].lower()}{message[1:]}"


def _decoder() -> Callable[[str, int], tuple[object, int]]:
    """Return the decoder; numbers stay text, so that none is too long."""
    global _decode  # noqa: PLW0603 - made once, when JSON is first met
    if _decode is None:
        from json import JSONDecoder

        _decode = JSONDecoder(parse_int=str, parse_float=str, parse_constant=str).raw_decode
    return _decode


_decode: Callable[[str, int], tuple[object, int]] | None = None


def _scanned(
    data: bytes,
    at: int,
    *,
    array: bool,
    final: bool,
    match: Callable[[int], int | None] | None,
    first: bool = True,
) -> Parts:
    """Scan values from a place on; one that may go on behind the text ends the scan, or is a part if it is final."""
    found: list[Part] = []
    text = data.decode("latin-1")  # keeps every offset; the syntax of JSON is ASCII
    broken = _Broken(data, array=array, final=final)
    needs_comma = array and not first
    while True:
        gap = _GAP.match(data, at)
        start, comma = (gap.end(), gap[1]) if gap else (at, b"")
        if start >= len(data):
            if comma and array and final:
                found.append(Part(at, start - 1, start, start, "no record follows this comma"))
            return Parts(found)
        opening = data[start : start + 1]
        problem = "a comma is missing before this record" if needs_comma and not comma else ""
        if array and opening == b"]" and not _INSIDE.match(data, start):
            if not final:
                return Parts(found)
            if comma:
                found.append(Part(at, start, start, start, "no record follows this comma"))
            return Parts([*found, *_behind(data, start + 1)], closed=True)
        if array and opening == b",":
            found.append(Part(at, start, start, start, "no record stands between two commas"))
            at, needs_comma = start, False
            continue
        end = match(start) if match else None
        if end is None:
            end, wrong = broken.fails.get(start) or (
                _value(text, start) if broken.closed.get(start) != 0 else (len(data), None)
            )
            if wrong is None and not final:
                return Parts(found)
            if wrong != "":
                broken.note(start, end if wrong != TOO_DEEP else len(data), wrong)
                own = _own_indent(data, at, start, array=array, first=first and not found)
                end = broken.end(start, end if wrong else len(data), own)
                if not end:
                    return Parts(found)
                problem = _value(text[start:end], 0)[1] or ("" if opening in b"[{" else "not JSON: no value")
                problem = problem or "not JSON: it is cut off"
        found.append(Part(at if array else start, start, end, end, problem))
        at, needs_comma = end, array


def _behind(data: bytes, at: int) -> Iterator[Part]:
    """Yield what follows an array, if anything does."""
    rest = data[at:].strip()
    if rest:
        start = data.find(rest, at)
        yield Part(at, start, start + len(rest), len(data), "text behind the end of the array", outside=True)


def _own_indent(data: bytes, at: int, start: int, *, array: bool, first: bool) -> int:
    """Return how far a value is indented that stands behind a place; -1 where it does not begin its line."""
    line = data.rfind(b"\n", at, start)
    if line >= 0 or first:
        return start - line - 1 if line >= 0 else start - at + array
    return -1 if array else 0


class _Broken:
    """Where values that go wrong end in a text; keeps what was found for the next of them."""

    def __init__(self, data: bytes, *, array: bool, final: bool) -> None:
        """Take a text, and whether nothing comes behind it."""
        self.data = data
        self.array = array
        self.final = final
        self.closed: dict[int, int] = {}  # behind which place a bracket is closed: 0 for one of the other kind, or none
        self.single: set[bytes] = set()  # keys that do not come again
        self.fails: dict[int, tuple[int, str | None]] = {}  # where a value behind some place goes wrong, and why

    def note(self, start: int, wrong: int, why: str | None) -> None:
        """Note the values inside one that went wrong which are open there: they go wrong at the same place."""
        if start in self.fails:
            return
        opened: list[int] = []
        for token in _TOKEN.finditer(self.data, start, wrong):
            if token[0] in (b"{", b"["):
                opened.append(token.start())
            elif token[0] in (b"}", b"]") and opened:
                opened.pop()
        self.fails.update(dict.fromkeys(opened, (wrong, why)))

    def end(self, start: int, wrong: int, own: int) -> int:
        """Return where a value ends; 0 where what decides it may be behind the text.

        It ends before a line that begins with a bracket and is not indented deeper, even if that could be a part of
        it, or where its brackets are closed, else before what begins as it does, or the next object, or at the end.
        """
        data = self.data
        if data[start : start + 1] not in (b"{", b"["):
            word = (_ITEM if self.array else _WORD).match(data, start)
            end = word.end() if word else start
            return 0 if end == len(data) and not self.final else max(start + len(data[start:end].rstrip()), start + 1)
        lines = _LINE_OF_NEXT.finditer(data, start) if own >= 0 else ()
        limit = next((line.start() for line in lines if len(line[1]) <= own), None)
        last = len(data) if limit is None else limit
        if start not in self.closed:
            self._close(start, last, settled=limit is None and self.final)
        if 0 < self.closed.get(start, 0) <= last:
            return self.closed[start]
        if limit is None and not self.final and start not in self.closed:
            return 0
        end = self._alike(start, last, own)
        if end < 0 and limit is None:
            if not self.final:
                return 0
            line = data.rfind(b"\n", start, wrong + 1)
            items = _NEXT_ITEM.finditer(data, wrong if line < 0 else line)
            found = next((each for each in items if own < 0 or each[0][0] != 10), None)
            end = last if found is None else found.start() + (found[0][0] != 10)
        elif end < 0:
            end = last
        body = data[start:end].rstrip(b" \t\r\n,")
        if self.array and end == len(data) and body.endswith(b"]") and body.count(b"]") > body.count(b"["):
            body = body[:-1].rstrip()
        return start + max(len(body), 1)

    def _close(self, start: int, last: int, *, settled: bool) -> None:
        """Note where each bracket from a place on is closed, up to the one there."""
        opened: list[int] = []
        for token in _TOKEN.finditer(self.data, start, last):
            if token[0] in (b"{", b"["):
                opened.append(token.start())
            elif token[0] in (b"}", b"]"):
                if self.data[opened[-1]] + 2 != ord(token[0]):
                    settled = True
                    break
                self.closed[opened.pop()] = token.end()
                if not opened:
                    return
        if settled:
            self.closed.update(dict.fromkeys(opened, 0))

    def _alike(self, start: int, last: int, own: int) -> int:
        """Return where an object begins with the first key of one; -1 if none does."""
        key = _FIRST_KEY.match(self.data, start)
        if key is None or key[0] in self.single or len(self.single) > MOST_KEYS:
            return -1
        at = self.data.find(key[0], start + 1, last)
        while own >= 0 and at > 0 and not self.data[self.data.rfind(b"\n", start, at) + 1 : at].strip(b" \t,"):
            at = self.data.find(key[0], at + 1, last)  # deeper in the lines of its own
        if at < 0 and last == len(self.data):
            self.single.add(key[0])
        return at


def _documents(text: bytes) -> Iterator[Part]:
    """Yield the documents of a YAML text that hold more than comments, each with the separator behind it."""
    start = 0
    for mark in _SEPARATOR.finditer(text):
        yield from _document(text, start, mark.start() if mark[0].startswith(b"-") else mark.end(), mark.end())
        start = mark.end()
    yield from _document(text, start, len(text), len(text))


def _document(text: bytes, start: int, end: int, after: int) -> Iterator[Part]:
    start += len(MARK) * text.startswith(MARK, start)
    if not _NO_DOCUMENT.fullmatch(text, start, end):
        yield Part(start, start, end, after)
