"""What the YAML parser complains of, in one line that a person can act on."""

from __future__ import annotations

import re

from yaml.error import MarkedYAMLError

from frametool.formats.source import Source, error_at, line_of, placed_error

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.errors import FormatError

_UNREADABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")
_HINTS = {
    "mapping values are not allowed in this context": "; check the indentation, or quote a text that holds ': '",
    "could not find expected ':'": "; a key needs ': ' after it",
    "did not find expected key": "; check the indentation and the brackets above",
    "did not find expected '-' indicator": "; check the indentation",
}


def translated(source: Source, error: Exception) -> FormatError:
    """Make our error of the parser's: lower case, placed, with a hint where one is known."""
    if isinstance(error, MarkedYAMLError) and (mark := error.problem_mark or error.context_mark):
        line, column = mark.line + 1, mark.column + 1
        message = _message(error, line_of(source.text, line)[column - 1 : column])
        return placed_error(source, line, column, message)
    if odd := _UNREADABLE.search(source.text):
        code = f"U+{ord(odd[0]):04X}"
        return error_at(source, odd.start(), f"the character {code} may not stand in YAML or JSON; is this text?")
    return error_at(source, 0, " ".join(str(error).lower().split()) or type(error).__name__)


def _message(error: MarkedYAMLError, character: str) -> str:
    """Say what is wrong at a character, after the parser's problem and context."""
    problem = " ".join(str(error.problem or "").split())
    if "cannot start any token" in problem:
        return _cannot_start(character)
    hint = _HINTS.get(problem, "")
    context = f" {error.context}" if error.context and not hint else ""
    begun = f" begun at line {error.context_mark.line + 1}" if context and error.context_mark else ""
    return (problem + hint if not context else f"{problem}{context and ','}{context}{begun}").lower()


def _cannot_start(character: str) -> str:
    """Say why nothing begins with a character, and what to write."""
    if character == "\t":
        return "a tab cannot indent YAML; use blanks"
    return f'nothing can begin with {character!r} here; quote the name, as in "{character}name"'
