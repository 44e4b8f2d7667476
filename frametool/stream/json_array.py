"""A JSON array from which records were left out: the commas between those that are left."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from frametool.stream.faults import NULL, STOP, Fault
from frametool.stream.run import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_BEGIN = rb"(?:\xef\xbb\xbf)?\s*\[\s*"
_ARRAY = re.compile(_BEGIN)
_COMMA_AT_END = re.compile(rb",\s*\Z")
_OPEN_BEGIN = re.compile(rb"(\A" + _BEGIN + rb"),\s*|\A,(\s*)(?=[,\]])")
_COMMA_TOO_MANY = re.compile(rb'("(?:[^"\\]|\\.)*")|,(?=\s*[,\]])', re.DOTALL)

_NULLS_AFTER = re.compile(rb"\]\s*(?:null\s*)+\Z")
_NULLS = re.compile(rb"\s*(?:null\s*)*")


def closed(outcomes: Iterable[Outcome], on_error: str) -> Iterator[Outcome]:
    """Make the lack of a closing bracket a fault, and mend it unless the run stops; leave no null behind an array."""
    is_array, tail, faulty, line = None, b"", False, 0
    for outcome in outcomes:
        text = outcome.text
        if outcome.faults and is_array is not False and on_error == NULL:
            text = _NULLS_AFTER.sub(b"]\n", text)
            text = b"" if is_array and tail.endswith(b"]") and _NULLS.fullmatch(text) else text
        if is_array is None and text.strip():
            is_array = bool(_ARRAY.match(text))
        tail = text.rstrip() or tail
        faulty = bool(outcome.faults)
        line = outcome.lines
        yield outcome._replace(text=text)
    if is_array and not tail.endswith(b"]"):
        fault = Fault(-1 if line else 0, "", "the array does not end: its ] is missing")
        end = b"null]\n" if tail.endswith(b",") else b"]\n"
        yield Outcome(b"" if on_error == STOP else end, () if faulty else (fault,))


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
    held = held.lstrip(b",")
    if held:
        yield outcome._replace(text=held, faults=(), rows=0, lines=0, mended=0, doubted=(), size=0)
