"""Texts and places in them: files, decoding, limits, lines and columns, snippets, streams in pieces.

The module knows no syntax.  Lines and columns are counted from 1; lines end as in YAML, so that places agree with the
parser.

A document may have a million frames, but no short text may allocate gigabytes.  Therefore these are limited: depth,
which needs stack; lists and maps, which need thirty times the memory of their text; the expansion of aliases.
"""

from __future__ import annotations

import gc
import os
import re
import sys
import time
from bisect import bisect_right
from contextlib import contextmanager, suppress
from functools import cached_property
from io import BufferedReader, BytesIO, FileIO
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from frametool import sizes
from frametool.errors import LONGEST_NAME, FileProblem, FormatError, NamedTuple, cells, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
    from os import PathLike
    from typing import BinaryIO, TypeVar

    from frametool.text.lines import ByteStream

    Value = TypeVar("Value")
    Path: TypeAlias = tuple[str | int, ...]
    # kind, text of a scalar, start, end, quote of a scalar or bracket of a container ("" for a block), column
    Event: TypeAlias = tuple[int, str, int, int, str, int]

MOST_KEPT, MOST_KEPT_BYTES = 32, 1 << 28  # values, and bytes of the files and texts they were read from
SETTLED_NS = 50_000_000  # a younger file is not cached: it may change again within one tick of the file system's clock


def too_much(depth: int) -> str:
    """Return the message for a limit that is exceeded at a depth: the levels, or the number of lists and maps."""
    if depth >= sizes.DEEPEST:
        return f"nested deeper than {sizes.DEEPEST} levels"
    return f"more than {sizes.MOST_CONTAINERS} lists and maps in one file; split it"


HEAD = 1 << 16  # bytes of a file that are inspected before it is read
UTF16 = (b"\xff\xfe", b"\xfe\xff")
LOOKED_AT = 4096
MAGIC = {
    b"\x7fELF": "a program (ELF)",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF (view_frames writes frames.gv next to it)",
    b"\x1f\x8b": "gzip data; unpack it first",
    b"BZh": "bzip2 data; unpack it first",
    b"\xfd7zXZ": "xz data; unpack it first",
    b"\x28\xb5\x2f\xfd": "zstd data; unpack it first",
    b"PK\x03\x04": "a zip archive; unpack it first",
    b"\x93NUMPY": "a NumPy array",
    b"\x89HDF": "HDF5",
    b"PAR1": "Parquet",
    b"LASF": "a LAS point cloud",
    b"glTF": "a binary glTF scene",
    b"PXR-USDC": "a USD scene",
}
_CONTROLS = bytes(code for code in range(32) if code not in b"\t\n\r\f\x1b")

_LINE_END = "\r\n|[\r\n\x85\u2028\u2029]"
_WIDEST_SNIPPET = 74  # and three dots on either side

LEAF, LIST, MAP, END = range(4)  # kinds of events
TAG = "!"  # the key for the tag of a mapping of YAML: no plain key looks like it


class Source(NamedTuple):
    """A text with its name for messages; `first_line` and `first_column` are its start in the named file."""

    name: str
    text: str
    first_line: int = 1
    first_column: int = 1

    def place(self, line: int, column: int) -> tuple[int, int]:
        """Return a place in the text as a place in the named file."""
        return self.first_line + line - 1, column + (self.first_column - 1) * (line == 1)


class Verbatim(str):
    """A number or boolean as written, which is written again unchanged, without quotes."""

    __slots__ = ()


State: TypeAlias = tuple[str, int, int, int, int]  # name, time of change, size, device, inode


def states_of(path: str) -> list[State]:
    """Return the state of a file, which differs after a change; for a folder, those of its files.  Raises OSError."""
    found = [(each.name, each.stat()) for each in os.scandir(path)] if os.path.isdir(path) else [("", os.stat(path))]
    return sorted((name, at.st_ctime_ns, at.st_size, at.st_dev, at.st_ino) for name, at in found)


class Pasted(Source):
    """A text converted from a pasted one; errors about it have no place."""


_noted: list[dict[str, list[State]]] = []  # each receives the state of every file when `opened` opens it


class ReadCache:
    """The last values read from files, valid as long as these are unchanged.

    Each value is stored with the states of its files when it was read, and their size.
    """

    def __init__(self) -> None:
        """Create an empty cache."""
        self._values: dict[Hashable, tuple[Any, dict[str, list[State]], int]] = {}

    def read(self, key: Hashable, files: Iterable[str], size: int, read: Callable[[], Value]) -> Value:
        """Return the result of `read`, from the cache if neither its files nor others that it opened have changed.

        key: everything that determines what is read
        size: of texts that are read in addition to files
        """
        found = self._values.pop(key, None)
        is_current = False
        with suppress(OSError):
            is_current = found is not None and all(states_of(path) == states for path, states in found[1].items())
        if found is None or not is_current:
            noted = {path: states_of(path) for path in files}
            _noted.append(noted)
            try:
                value = read()
            finally:
                _noted.pop()
            states = [state for each in noted.values() for state in each]
            plain = all(os.path.isfile(path) or os.path.isdir(path) for path in noted)  # which can be read again
            if not plain or max((changed for _, changed, *_ in states), default=0) >= time.time_ns() - SETTLED_NS:
                return value
            found = value, noted, size + sum(state[2] for state in states)
        self._values[key] = found  # as the newest entry
        while len(self._values) > MOST_KEPT or sum(size for *_, size in self._values.values()) > MOST_KEPT_BYTES:
            del self._values[next(iter(self._values))]
        return found[0]


def opened(path: str | PathLike[str]) -> BufferedReader:
    """Open a file, or standard input for `-`, with a buffer that allows peeking.

    Raises FileProblem.
    """
    name = str(path)
    if name == "-":
        if sys.stdin is None:
            raise FileProblem("standard input is closed")
        stdin = sys.stdin.buffer
        return stdin if isinstance(stdin, BufferedReader) else BufferedReader(stdin)  # type: ignore[arg-type]
    try:
        for noted in _noted:
            noted[name] = states_of(name)
        return BufferedReader(FileIO(os.fspath(path)), HEAD)
    except OSError as error:
        called = name if 0 < len(name) <= LONGEST_NAME else shown(name)
        is_numbers = re.match(r".*(?:^|\s)[-+]?[\d.]+[\s,]+[-+]?[\d.]+[\s,]", name)
        hint = "; taken for a file's name: numbers say what they are by --from REP" if is_numbers else ""
        raise FileProblem(f"{called}: {(error.strerror or str(error)).lower()}{hint}") from None
    except (ValueError, TypeError) as error:
        raise FileProblem(f"{shown(name)} is no file name: {error}") from None


# documents that end with the next one, or the stream: YAML that begins with a key or a list item, and XML
_OVER_LINES = rb"""- |["']?[A-Za-z_][\w./-]*["']?[ \t]*:\s|\s*<"""


def _data(begin: bytes) -> bytes:
    """Return the complete lines of a text, without leading comments, blank lines and `---`."""
    return re.sub(rb"\A(?:\xef\xbb\xbf)?(?:(?:#.*|---)?[ \t\r]*\n)*", b"", begin[: begin.rfind(b"\n") + 1])


def has_line(begin: bytes) -> bool:
    """Return True if a complete line of data has arrived that does not begin a document of many lines."""
    data = _data(begin)
    return bool(data) and not re.match(_OVER_LINES, data)


def has_record(begin: bytes) -> bool:
    """Return True if a document, a line of JSON, or two lines of a table have arrived."""
    data = _data(begin)
    if re.match(_OVER_LINES, data):
        return re.search(rb"(?m)^---\s*$", data) is not None
    return re.match(rb"\s*[{[].*[]}],?\s*\n|\s*[^\s{[].*\n(?:#.*\n)*[^#\n].*\n", data) is not None


def decode(data: bytes, name: str) -> str:
    """Decode bytes: UTF-8, or UTF-16 with a byte order mark; the mark is removed.

    Raises FormatError at the first invalid byte.
    """
    encoding = "utf-16" if data.startswith(UTF16) else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        start = error.start + (3 if encoding == "utf-8-sig" and data.startswith(b"\xef\xbb\xbf") else 0)
        before, what = data[:start].decode(encoding, "ignore"), not_text(data)
        if not what:  # the snippet shows the text before the byte, and after it with replacements
            after = data[start : start + 200].decode(encoding, "replace")
            label = "UTF-16" if encoding == "utf-16" else "UTF-8"
            problem = f"not {label}: byte 0x{data[start]:02x} does not belong there; convert the file (from Latin-1?)"
            raise error_at(Source(name, before + after), len(before), problem) from None
    else:
        if "\0" not in text:
            return text
        before, what = text[: text.index("\0")], not_text(data) or "not text: it holds a NUL byte"
    ((line, column),) = places_of(f"{before}.", [len(before)])
    raise FormatError(what, source=name, line=line, column=column)


def not_text(data: bytes) -> str:
    """Return a description of bytes that are no text; "" if they may be text in another encoding."""
    head = data[:LOOKED_AT]
    for magic, what in MAGIC.items():
        if head.startswith(magic):
            return f"not text but {what}"
    if head.startswith(UTF16):
        return "UTF-16, which is not read here; convert it: iconv -f UTF-16 -t UTF-8"
    controls = len(head) - len(head.translate(None, _CONTROLS))
    try:
        most = len(head) // 10 if head[:-3].decode() else 0
    except UnicodeDecodeError as error:  # Latin-1 has bytes that are not UTF-8, but no controls
        most = 0 if error.start < len(head) - 6 else len(head) // 10
    return "not text but binary data" if controls > max(2, most) else ""


def places_of(text: str, offsets: Sequence[int]) -> list[tuple[int, int]]:
    """Return line and column of each offset, in one pass over the text.

    All offsets after the last non-blank character, where parsers report missing ones, have the place after it.
    """
    last = len(text.rstrip(" \t\r\n"))
    begins = [0, *(end.end() for end in re.finditer(_LINE_END, text[: max(offsets, default=0)]))]
    places = []
    for offset in offsets:
        at = min(offset, last)
        line = bisect_right(begins, at)
        places.append((line, at - begins[line - 1] + 1))
    return places


def error_at(source: Source, offset: int, message: str, error: type[FormatError] = FormatError) -> FormatError:
    """Return the error for an offset in the source's text, with the source line and a caret below it."""
    if isinstance(source, Pasted):
        return error(message, source=source.name)
    ((line, column),) = places_of(source.text, [offset])
    snippet = pointer(line_of(source.text, line), column)
    return error(message, source=source.name, line=line, column=column, snippet=snippet)


def line_of(text: str, line: int) -> str:
    """Return a line of the text without its end; the last one if there are fewer lines."""
    lines = re.split(_LINE_END, text, maxsplit=line)
    return lines[min(line, len(lines)) - 1]


def pointer(line: str, column: int) -> str:
    """Return the line, shortened if long, with a caret below the column; wide characters count twice."""
    if len(line) > _WIDEST_SNIPPET:  # a window around the column
        begin = max(0, min(column - _WIDEST_SNIPPET // 2, len(line) - _WIDEST_SNIPPET))
        end, head = begin + _WIDEST_SNIPPET, "..." if begin else ""
        column += len(head) - begin
        line = head + line[begin:end] + ("..." if end < len(line) else "")
    visible = "".join(c if c.isprintable() or c == "\t" else "\ufffd" for c in line)
    gap = "".join("\t" if each == "\t" else " " * cells(each) for each in visible[: column - 1])
    return f"{visible}\n{gap}^"


class InputFile:
    """A file, standard input for `-`, or a folder; its contents are read once, as a stream or as one text."""

    def __init__(self, path: str | PathLike[str], stream: BinaryIO | None = None, *, folder: bool = False) -> None:
        """Open a file.

        stream: an opened stream, not yet read; folder: there is nothing to open.
        Raises FileProblem.
        """
        self.path = str(path)
        self.name = "stdin" if self.path == "-" else self.path
        self.format = ""
        self.siblings: Sequence[InputFile] = ()  # all files that are read together
        self.stream: BinaryIO = BufferedReader(BytesIO()) if folder else stream or opened(path)
        self._is_pipe = not self.stream.seekable()

    def head(self) -> bytes:
        """Return the first bytes without consuming them."""
        if self._is_pipe:
            from frametool.text.lines import arrived

            self.stream = arrived(self.stream, has_record, HEAD)  # type: ignore[arg-type]
            self._is_pipe = False
        head: bytes = self.stream.peek(HEAD)[:HEAD]  # type: ignore[attr-defined]
        return head

    def read(self) -> bytes:
        """Read the whole file, and close it.

        Raises FileProblem when it cannot be read, FormatError when it is too long.
        """
        try:
            data = self.stream.read(sizes.MOST_CHARACTERS + 1)
        except OSError as error:
            raise FileProblem(f"{self.name}: {(error.strerror or str(error)).lower()}") from None
        finally:
            self.close()
        if len(data) > sizes.MOST_CHARACTERS:
            raise self.error(f"longer than {sizes.MOST_CHARACTERS} bytes, the most in one file; split it")
        return data

    @cached_property
    def text(self) -> str:
        """Return the whole text; raises as `read` does, and FormatError if it is not text."""
        return decode(self.read(), self.name)

    @property
    def source(self) -> Source:
        """Return the whole text with its name."""
        return Source(self.name, self.text)

    def error(
        self, message: str, line: int = 0, column: int = 0, *, kind: type[FormatError] = FormatError
    ) -> FormatError:
        """Return the error for a line, a place in the text, or the whole file."""
        snippet = pointer(self.text.split("\n")[line - 1].rstrip("\r"), column) if column else ""
        return kind(message, source=self.name, line=line, column=column, snippet=snippet)

    def close(self) -> None:
        """Close a file; standard input remains open."""
        if self.path != "-":
            self.stream.close()


@contextmanager
def paused_collector() -> Iterator[None]:
    """Disable the garbage collector in the block: it would traverse the growing result again and again."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def levels(value: Any) -> Iterator[list[Any]]:
    """Yield the lists and maps in a list, level by level from itself on; a caller may change those of a level."""
    level = [value]
    while level:
        yield level
        level = [
            inner
            for outer in level
            for inner in (outer.values() if type(outer) is dict else outer)
            if type(inner) is dict or type(inner) is list
        ]


def repeated_key(source: Source, events: Iterable[Event]) -> FormatError:
    """Return the error for the first key that its map has twice, or that is empty."""
    opened: list[dict[str, int] | None] = [None]  # the keys of a map; None for a list
    key_next = False
    for kind, text, start, *_ in events:
        keys = opened[-1]
        if kind == END:
            opened.pop()
        elif key_next and keys is not None:
            if not text or text in keys:
                places = places_of(source.text, [keys.get(text, 0)])
                said = "key {!r} appears twice; first at {}:{}".format(text, *places[0]) if text else "an empty key"
                return error_at(source, start, said)
            keys[text] = start
        elif kind != LEAF:
            opened.append({} if kind == MAP else None)
        key_next = opened[-1] is not None and not (kind == LEAF and key_next)
    return error_at(source, 0, "a key appears twice")


# --- text in pieces that end at a document or a line: recordings of any size in bounded memory ---


class Piece(NamedTuple):
    """Complete documents or lines of a text, and the number of their first line, from 1."""

    text: str
    line: int


def lines(stream: BinaryIO, name: str, whole: Callable[[bytes], int] | None = None) -> Iterator[Piece]:
    """Split a stream after line ends; a piece has as many lines as arrived in one block.

    whole: as in `read_blocks`.  Line ends become those of Unix, which does not change line numbers.
    Raises FormatError if it is not UTF-8, and for a line or document that is too long.
    """
    from frametool.text.lines import read_blocks, whole_lines

    line = 1
    blocks = read_blocks(cast("ByteStream", stream), whole=whole or whole_lines, longest=sizes.MOST_CHARACTERS)
    for block in blocks:
        if block.startswith(UTF16):  # which has other line ends
            block += b"".join(blocks)  # noqa: PLW2901
        with counted_from(line):
            text = decode(block, name)
        yield Piece(text.replace("\r\n", "\n") if "\r" in text else text, line)
        line += text.count("\n")


def documents(stream: BinaryIO, name: str) -> Iterator[Piece]:
    """Split a stream after lines that end in `---`; a piece has as many documents as arrived in one block."""
    return lines(stream, name, _whole_documents)


def _whole_documents(text: bytes) -> int:
    """Return the number of bytes up to the last line that ends in `---`; without one, minus those of complete lines.

    `ros2 topic echo` appends the three dashes to its note about a lost message.
    """
    ends = (text.rfind(end) + len(end) for end in (b"---\n", b"---\r\n") if end in text)
    return max(ends, default=-1 - text.rfind(b"\n"))


@contextmanager
def counted_from(line: int) -> Iterator[None]:
    """Shift the lines of errors in the block to those of the whole file; line: that of the text's first line."""
    try:
        yield
    except FormatError as error:
        error.line += line - 1 if error.line else 0
        raise
