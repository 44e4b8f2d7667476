"""What the YAML parser complains of, in one line that a person can act on."""

from __future__ import annotations

import re

from yaml.error import MarkedYAMLError

from frametool.documents.source import Source, error_at, line_of
from frametool.errors import shown
from frametool.text.numbers import odd_characters

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.errors import FormatError

# compiled when an error asks for them, not at start-up
_UNREADABLE = "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
_ABOUT_TABS = "cannot start any token|tab character"
_ABOUT_BEGINNINGS = "cannot start any token|scanning a directive"
_NEVER_FIRST = ("@", "`", "%")
_LONGEST_SHOWN = 40
_HINTS = {
    "mapping values are not allowed in this context": "; check the indentation, or quote a text that holds ': '",
    "found unexpected ':'": "; write a blank after the colon",
    "could not find expected ':'": "; a key needs ': ' after it",
    "did not find expected key": "; check the indentation and the brackets above",
    "did not find expected '-' indicator": "; check the indentation",
}


def translated(source: Source, error: Exception) -> FormatError:
    """Make our error of the parser's: lower case, placed, with a hint where one is known."""
    if isinstance(error, MarkedYAMLError) and (mark := error.problem_mark or error.context_mark):
        line = mark.line + 1
        message = _message(error, line_of(source.text, line), mark.column + 1)
        return error_at(source, mark.index, message + _suspicion(source, line))
    if odd := re.search(_UNREADABLE, source.text):
        code = f"U+{ord(odd[0]):04X}"
        return error_at(source, odd.start(), f"the character {code} may not stand in YAML or JSON; is this text?")
    return error_at(source, 0, _one_line(str(error)) or type(error).__name__)


def _suspicion(source: Source, line: int) -> str:
    """Name what people do not see in the line of an error or the one before: odd characters, a missing blank, xacro."""
    for text in (line_of(source.text, line), line_of(source.text, line - 1) if line > 1 else ""):
        if odd := odd_characters(text):
            return f"; the line has {odd}"
        if "${" in text:
            return "; is this xacro? expand it first"
        if match := re.match(r"\s*(?:- +)*([\w./-]+):(?=[^\s:/])", text):
            return f"; write a blank after '{match[1]}:'"
    return ""


def _one_line(text: str) -> str:
    """Join the lines of the parser's text, in lower case."""
    return " ".join(text.split()).lower()


def _message(error: MarkedYAMLError, line: str, column: int) -> str:
    """Say what is wrong at a column of a line, after the parser's problem and context."""
    problem, context = _one_line(error.problem or ""), _one_line(error.context or "")
    word = line[column - 1 :].split(maxsplit=1)[0] if line[column - 1 :].strip() else ""
    if "\t" in (line[column - 1 : column], *line[: column - 1].split(" ")) and re.search(_ABOUT_TABS, problem):
        return "a tab cannot indent YAML; use blanks"
    if "scanning a directive" in context:
        word = line.split(maxsplit=1)[0] if line.strip() else ""
    if word.startswith(_NEVER_FIRST) and re.search(_ABOUT_BEGINNINGS, problem + context):
        name = word.rstrip(":,]}")[:_LONGEST_SHOWN]
        return f'nothing can begin with {shown(word[0])} here; quote the name: "{name}"'
    if word == ":" and problem == "did not find expected key":
        return "an empty key; write a name before the colon"
    begun = f" begun at line {error.context_mark.line + 1}" if error.context_mark else ""
    return problem + (_HINTS.get(problem) or (f", {context}{begun}" if context else ""))
