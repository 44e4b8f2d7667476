"""Where the records of a text are: YAML documents, JSON lines, JSON values over several lines, arrays of them.

Knows the syntax around records and none of their meaning.  What is no record is a part of its own with the problem
it has, so that nothing passes unseen.  Behind a broken line the next one is read; an array, or a value over several
lines, ends what can be read where it goes wrong.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

from frametool.errors import NamedTuple
from frametool.text.lines import whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

NO_END = "the array does not end: its ] is missing"
DOCUMENTS, LINES, VALUES, ARRAY = "documents", "lines", "values", "array"
MARK = b"\xef\xbb\xbf"
MUCH = 1 << 20  # bytes of one unfinished value from which it is looked at only when twice as much has come
TOO_DEEP = "nested too deeply"

_SEPARATOR = re.compile(rb"^(?:---|\ttotal count: ?\d+---)[ \t]*\r?\n", re.MULTILINE)  # the last: ros2's note of a loss
_NO_DOCUMENT = re.compile(rb"(?:\xef\xbb\xbf)?(?:[ \t]*(?:#[^\n]*)?\r?(?:\n|\Z))*+(?:(?:\.\.\.|---)\s*)?")
_LINE = re.compile(rb"[^\n]*\n|[^\n]+\Z")
_SEVERAL = re.compile(rb"[}\]]\s*+(?:,\s*+)?+[{\[]|\}\s*+(?:,\s*+)?+[^\s,}\]]")
_AFTER = re.compile(rb"[ \t]*,?[ \t]*\r?\n?")
_GAP = re.compile(rb"\s*+(,?+)\s*+")
_OPENING = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[")
_WORD_AT_END = re.compile(r"[\w.+-]*\s*\Z")  # such as the 1e of 1e-05
_BEHIND_ITEM = re.compile(rb"\s*+[^\s\[]")


class Part(NamedTuple):
    """A record in a text, and what goes with it.

    begin: where the comma or blanks before it begin, if they vanish with it
    start, end: the record itself, or from where it goes wrong
    after: where what follows it ends, if that vanishes with it
    problem: why it is no record; "" where reading it decides
    final: nothing behind it can be read
    """

    begin: int
    start: int
    end: int
    after: int
    problem: str = ""
    final: bool = False

    def behind(self, start: int) -> Part:
        """Return where a record is in a text that has so much before the one it was found in."""
        return self._replace(
            begin=self.begin + start, start=self.start + start, end=self.end + start, after=self.after + start
        )


class Splitter:
    """Cut a stream into records; `layout` is "" until the first line of JSON has been seen."""

    def __init__(self, fmt: str) -> None:
        """Take `json` or `yaml`."""
        self.layout = DOCUMENTS if fmt == "yaml" else ""
        self._looked = 0

    def whole(self, text: bytes) -> int:
        """Return how many bytes of what has come are whole records; called with more until some are."""
        if self.layout == DOCUMENTS:  # what has been looked at is not looked at again
            ends = [found.end() for found in _SEPARATOR.finditer(text, text.rfind(b"\n", 0, self._looked) + 1)]
            self._looked = 0 if ends else len(text)
            return ends[-1] if ends else 0
        self.layout = self.layout or _layout_of(text, final=False)
        if self.layout in ("", LINES):
            return whole_lines(text) if self.layout else 0
        if MUCH < len(text) < 2 * self._looked:
            return 0
        ended = 0
        for part in self._values(text, final=False)[0]:  # a text is cut so that either piece means what it meant
            if part.final or self.layout != ARRAY:
                is_end = part.final or part.after < len(text) or text.endswith(b"\n")
            else:
                is_end = bool(_BEHIND_ITEM.match(text, part.end))
            ended = part.after if is_end else ended
        self._looked = 0 if ended else len(text)
        return ended

    def parts(self, text: bytes) -> tuple[list[Part], bool]:
        """Return the records of a block of whole records, or of a stream's rest, and whether an array ends in it."""
        if self.layout == DOCUMENTS:
            return list(_documents(text)), False
        self.layout = self.layout or _layout_of(text, final=True)
        if self.layout == LINES:
            return [part for line in _LINE.finditer(text) for part in _of_line(text, *line.span())], False
        return self._values(text, final=True)

    def _values(self, text: bytes, *, final: bool) -> tuple[list[Part], bool]:
        """Scan JSON values one after the other, in an array with commas between them."""
        opening = _OPENING.match(text) if self.layout == ARRAY else None
        start = opening.end() if opening else 3 if text.startswith(MARK) else 0
        return _scanned(text, start, array=self.layout == ARRAY, final=final, first=bool(opening))


def _of_line(text: bytes, start: int, end: int) -> list[Part]:
    """Return the record of a line, or several."""
    line = text[start:end]
    body = line.strip(b" \t\r\n,").removeprefix(MARK)
    if not body:
        return []
    begin = start + line.find(body)
    found, _ = _scanned(body, 0, array=False, final=True) if _SEVERAL.search(body) else ([], False)
    if len(found) > 1:  # the end of the line goes with none of several
        return [each.behind(begin)._replace(final=False) for each in found]
    stop = begin + len(body)
    return [Part(begin, begin, stop, _after(text, stop), found[0].problem if found else "")]


def _after(text: bytes, end: int) -> int:
    """Return the end of what follows a record on its line, which goes with it."""
    found = _AFTER.match(text, end)
    return found.end() if found else end


def _layout_of(text: bytes, *, final: bool) -> str:
    """Return how JSON is laid out by its first lines; "" where they have not come yet."""
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
        return ARRAY  # its first item is no record: lists of numbers hold no objects
    if problem is not None:
        return LINES
    # the first line ends within a value, which goes on in the rest or is broken
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


@cache
def _decoder() -> Callable[[str, int], tuple[object, int]]:
    """Return the decoder; numbers stay text, so that none is too long."""
    from json import JSONDecoder

    return JSONDecoder(parse_int=str, parse_float=str, parse_constant=str).raw_decode


def _scanned(
    data: bytes, at: int, *, array: bool, final: bool, first: bool = True
) -> tuple[list[Part], bool]:
    """Scan values from a place on; one that may go on behind the text ends the scan, or is a part if it is final."""
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
        found.append(Part(at if array else start, start, end, end if array else _after(data, end), problem))
        at, needs_comma = end, array


def _documents(text: bytes) -> Iterator[Part]:
    """Yield the documents of a YAML text that hold more than comments, each with the separator behind it."""
    start = 0
    for mark in (*_SEPARATOR.finditer(text), None):
        after = len(text) if mark is None else mark.end()
        end = mark.start() if mark and mark[0].startswith(b"-") else after
        start += len(MARK) * text.startswith(MARK, start)
        if not _NO_DOCUMENT.fullmatch(text, start, end):
            yield Part(start, start, end, after)
        start = after
