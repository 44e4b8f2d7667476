"""A JSON array from which records were left out: the commas between those that are left."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.stream.run import Outcome

_BEGIN = rb"(?:\xef\xbb\xbf)?\s*\[\s*"
_ARRAY = re.compile(_BEGIN)
_COMMA_AT_END = re.compile(rb",\s*\Z")
_OPEN_BEGIN = re.compile(rb"(\A" + _BEGIN + rb"),\s*|\A,(\s*)(?=[,\]])")
_COMMA_TOO_MANY = re.compile(rb'("(?:[^"\\]|\\.)*")|,(?=\s*[,\]])', re.DOTALL)


def with_commas_between(outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """Drop the commas that skipped records leave; what is no array passes.

    A comma at the end of a block waits until it is known whether a record follows.
    """
    held, is_array = b"", False
    for outcome in outcomes:
        is_array = is_array or bool(_ARRAY.match(outcome.text))
        if not is_array:
            yield outcome
            continue
        text = held + outcome.text
        if outcome.faults:
            text = _COMMA_TOO_MANY.sub(rb"\1", text)
        text = _OPEN_BEGIN.sub(rb"\1\2", text)
        waits = _COMMA_AT_END.match(text, text.rfind(b",")) if b"," in text else _ARRAY.fullmatch(text)
        held = waits[0] if waits else b""
        yield outcome._replace(text=text[: len(text) - len(held)])
    if held:
        yield outcome._replace(text=held, faults=(), rows=0, lines=0, mended=0, doubted=(), size=0)
