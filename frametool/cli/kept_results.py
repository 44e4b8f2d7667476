"""Results that a batch keeps under names instead of printing them, as the text that then stands for them."""

from __future__ import annotations

import json
import os
import sys
from contextlib import contextmanager, redirect_stdout
from io import BytesIO, TextIOWrapper
from typing import TYPE_CHECKING, Any

from frametool.documents.limits import MOST_CHARACTERS
from frametool.errors import ValueInvalid, alternatives
from frametool.grammar.rotation import ROTATION_KEYS
from frametool.stream.faults import Misused
from frametool.stream.record import PARTS, POINT_KEYS

if TYPE_CHECKING:
    from collections.abc import Iterator

    import click

OF_TREES = frozenset(("frames", "transforms", "static_transforms"))
OF_RECORDS = {*POINT_KEYS, *ROTATION_KEYS, *PARTS, "x", "y", "z"}
READABLE = ("json", "yaml")  # the same numbers; other forms are for printing
KEPT_ARE = "a name keeps one pose, point, number or tree"


class KeptResults:
    """The results of lines `NAME = COMMAND`."""

    def __init__(self) -> None:
        """Create it without any."""
        self._texts: dict[str, str] = {}
        self._lost: dict[str, int] = {}

    def value_of(self, name: str) -> str:
        """Return what stands for a name; raise Misused for one that has no value."""
        if name in self._texts:
            return self._texts[name]
        if name in self._lost:
            raise Misused(f"${name} has no value: line {self._lost[name]}, which sets it, has failed")
        known = alternatives(name, self._texts, "names") if self._texts else "; no line before has kept a result"
        shells = "variables of the shell are not known here" if name in os.environ else "a dollar sign is $$"
        raise Misused(f"unknown name ${name}{known}; {shells}")

    def keep(self, name: str, text: str) -> None:
        """Keep a result that was printed as JSON."""
        _refuse_other_results(name, text)
        self._texts[name] = text.strip()
        self._lost.pop(name, None)

    def lose(self, name: str, line: int) -> None:
        """Forget what a name stood for: the line that sets it has failed."""
        self._texts.pop(name, None)
        self._lost[name] = line


def _refuse_other_results(name: str, text: str) -> None:
    """Raise ValueInvalid for what is not one pose, point, number or tree."""
    lines = text.count("\n")
    if lines != 1:
        raise ValueInvalid(f"{name}: the command has {lines or 'no'} result{'s' * (lines != 1)}; {KEPT_ARE}")
    try:
        value = json.loads(text)
    except ValueError:
        raise ValueInvalid(f"{name}: the result is text; {KEPT_ARE}") from None
    keys = set(value) if isinstance(value, dict) else set()
    if not (isinstance(value, float | int) or keys & OF_TREES or keys & OF_RECORDS):
        raise ValueInvalid(f"{name}: the result is a report; {KEPT_ARE}")


def print_as_json(name: str, context: click.Context) -> None:
    """Let a command that is about to run print what can be kept; raise Misused where it cannot."""
    formats: Any = next((each.type for each in context.command.params if each.name == "format_name"), None)
    if "json" not in getattr(formats, "choices", ()):
        raise Misused(f"{name}: {context.info_name} has no result that can be kept; {KEPT_ARE}")
    params = context.params
    for param, option in (("output", "-o FILE"), ("explain", "--explain"), ("explain_full", "--explain-full")):
        if params.get(param):
            raise Misused(f"{name}: a result is kept or written, not both; leave {option} or {name} = out")
    if params["format_name"] not in (None, *READABLE):
        raise Misused(f"{name}: -f {params['format_name']} is for printing, and {name} is kept; leave it out")
    params["format_name"] = "json"


@contextmanager
def captured() -> Iterator[BytesIO]:
    """Yield what takes everything that is printed in the block."""
    held = _Limited()
    stream = TextIOWrapper(held, "utf-8")
    try:
        with redirect_stdout(stream):
            yield held
            sys.stdout.flush()
    finally:
        stream.detach()


class _Limited(BytesIO):
    """Bytes, no more of them than a document may have."""

    def write(self, data: Any) -> int:
        """Take some more."""
        if self.tell() + len(data) > MOST_CHARACTERS:
            raise ValueInvalid(f"a result of more than {MOST_CHARACTERS} bytes; {KEPT_ARE}")
        return super().write(data)
