"""Tell what somebody pasted from what has always been a stream of rows or records: arguments and standard input."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from io import BufferedReader, BytesIO
from typing import TYPE_CHECKING

from frametool.documents.source import Source, decode
from frametool.errors import FormatError
from frametool.grammar.readers import NotARotation
from frametool.stream.faults import Misused

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.geometry.representations import Notation
    from frametool.stream.request import Request

INLINE = "argument"
LONGEST_REMEMBERED = 4096  # characters
# the grammar's own, or a header; compiled when first needed
_PLAIN = r"""\s*(?![ijk]\s*$|[xyzw]:\s*[-+.\d]+\s*,|Out\[)(?:\{\s*["}\w][^,{]*:|[A-Za-z_"'%#][\w"'-]*\s*(?:[,:\t]|$))"""
_NO_HEADER = r"\s*[A-Za-z_]\w*:\s*\n|\s*\w+\s*=|\s*(?:R|Model|- Pose[^:]*):\s*\["  # of a table; the last: GTSAM, Gazebo
_NO_JSON = r"\d\.(?=[\s,\]])|;"

_ROW = r"\[(?:[^\[\],]*,){%s}[^\[\],]*\]\s*,?\s*"
_LISTED_ROWS = rf"\s*(?:\[\s*(?:{_ROW % 3}){{3}}\]|(?:{_ROW % '2,3'}){{3,4}}\Z)"


def is_inline(text: str) -> bool:
    """Tell a mapping or list written on the command line from a file's name."""
    return text.startswith(("{", "["))


def is_pasted(text: str, given: Notation | None = None) -> bool:
    """Tell a text with a pose in it from a file's name; what exists is a file.

    Raises FormatError for a text that is known and cannot be taken.
    """
    if is_inline(text) or text == "-":
        return is_inline(text)
    if os.path.exists(text):
        return False
    has_key = "\n" in text or re.match(r"\w+: *[\[{]", text) is not None
    return has_key or rewritten(Source(INLINE, text), given) is not None


def rewritten(
    source: Source, given: Notation | None = None, *, normalize: bool = False, points: bool = False
) -> Source | None:
    """Return a text that was pasted as one of the grammar; None for one that is."""
    if source.name == INLINE and len(source.text) <= LONGEST_REMEMBERED:
        return _rewritten_argument(source, given, normalize=normalize, points=points)
    return _rewritten(source, given, normalize=normalize, points=points)


def _rewritten(source: Source, given: Notation | None, *, normalize: bool, points: bool) -> Source | None:
    if re.match(_PLAIN, source.text) and "\n" not in source.text.strip():
        return None
    from frametool.ros.pasted_blocks import in_grammar

    try:
        return in_grammar(source, given, normalize=normalize, points=points)
    except FormatError as error:
        if source.name == INLINE and not isinstance(error.__cause__, NotARotation):
            error.exit_code = 2  # misuse, where numbers in a file are bad data
        raise


_rewritten_argument = lru_cache(8)(_rewritten)  # an argument is looked at before it is read


def rejoined(values: Sequence[str]) -> tuple[str, ...]:
    """Put together what the shell took apart: `[0, 0, 0.7, 0.7]` and `0.7 + 0.7k` without quotes."""
    text = " ".join(values)
    is_apart = len(values) > 1 and (
        any(value[-1:] == "," for value in values[:-1])
        or (values[0][:1] in ("[", "(") and values[0].count("[") > values[0].count("]"))
        or (re.fullmatch(r"[-+\d.eE*ijk ]+", text) is not None and any(each in text for each in "ijk"))
    )
    return (text,) if is_apart else tuple(values)


def pasted_stream(stream: BufferedReader, name: str, request: Request) -> tuple[Source | None, BufferedReader]:
    """Return what was pasted into a stream as text of the grammar, and the stream, with all that is in it if not.

    Only a beginning with which no stream of rows or records has a result is read to its end.
    """
    head = stream.peek()[:4096].decode("utf-8", "replace").lstrip("\ufeff")
    if re.match(_PLAIN, head) and not re.match(_NO_HEADER, head):
        return None, stream
    from frametool.ros.pasted_blocks import MOST_PASTED, in_grammar

    given = None if request.operation.moves else request.given
    if not _is_free(head, given, request):
        return None, stream
    data = stream.read(MOST_PASTED + 1)
    if len(data) > MOST_PASTED:
        raise FormatError(f"begins as what is pasted, which is {MOST_PASTED} bytes at most; give --in", source=name)
    source = Source(name, decode(data, name))
    found = in_grammar(source, given, normalize=request.normalize, points=request.operation.moves)
    return found, BufferedReader(BytesIO(data))


def _is_free(head: str, given: Notation | None, request: Request) -> bool:
    """Tell whether a beginning is none of a stream of rows or records that has a result."""
    from frametool.ros.pasted_blocks import may_be_pasted

    if not may_be_pasted(head):
        return False
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    first = lines[0]
    if first[0] in "[({" and re.match(r"[\[\s]*[-+.\d]\S*\s*,", first):
        return not request.operation.moves and (given is not None or _is_long(head) or bool(re.search(_NO_JSON, head)))
    cells = first.split()
    if not all(re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?", cell) for cell in cells):
        return True
    if request.operation.moves:
        return False
    if _is_counted([line.split() for line in lines[:2]]):
        return True
    matrix = given is None or given.representation.whole is not None
    if (len(cells), len(lines)) == (3, 3) and matrix:
        return given is not None or _only_a_matrix(lines, request)
    if matrix:
        return (len(cells), len(lines)) in ((4, 3), (4, 4)) or (given is None and (len(cells), len(lines)) == (12, 1))
    return len(cells) == 1 and len(lines) > 1


def _is_counted(rows: list[list[str]]) -> bool:
    """Tell the heading of a print of pandas, which counts its columns, before a row that begins with its own count."""
    counts = [str(at) for at in range(len(rows[0]))]
    return len(rows) > 1 and rows[0] == counts and rows[1][0] == "0" and len(rows[1]) == len(counts) + 1


def _is_long(head: str) -> bool:
    """Tell a list of 9, 12 or 16 numbers, three rows of four, and rows one below the other from other lists."""
    found = re.match(r"\s*\[([^\[\]]*)\]", head)
    return (found is not None and found[1].count(",") in (8, 11, 15)) or re.match(_LISTED_ROWS, head) is not None


def _only_a_matrix(lines: list[str], request: Request) -> bool:
    """Tell whether three rows of three numbers are a matrix, where positions alone would have no result.

    Raises Misused where they may be either.
    """
    if request.poses == 1 and request.operation.keeps_position:
        return True
    from frametool.grammar.pasted import is_rotation

    if not is_rotation([line.split() for line in lines]):
        return False
    raise Misused("three rows of three numbers may be a rotation or positions; give --from matrix, or --in columns")
