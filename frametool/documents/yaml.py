"""Convert YAML text to plain values and their places, by the parser's events; knows only syntax.

The library's constructors are not used: they convert names to numbers, dates and booleans, and allow a small text to
grow without bound.  The loop here keeps every scalar as text and counts depth and aliases; the parser's errors become
one line with a hint.

    - {name: lidar, parent: base_link, xyz: [0.9, 0, 2.0], rpy_deg: [0, 0, 90]}
    - name: lidar
      parent: base_link

Long lists of such maps, as in big trees, differ from JSON only in the quotes.  If a strict pattern finds nothing else,
a few replacements make them JSON, which reads 100 000 of them in a quarter of the time that the parser needs for its
events (0.5 s against 2.1); anything unusual, also an error, is left to the parser.  In other texts plain values in
brackets after their key, `f1: {xyz: [0.9, 0, 2.0]}`, are read in the same way.
"""

from __future__ import annotations

import re
from contextlib import suppress

import yaml
from yaml import AliasEvent, MappingStartEvent, ScalarEvent, SequenceStartEvent, StreamEndEvent

from frametool import sizes
from frametool.documents.source import END, LEAF, LIST, MAP, TAG, Source, error_at, line_of, paused_collector, too_much
from frametool.errors import FormatError
from frametool.text.numbers import odd_characters

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from typing import Any, TypeAlias

    from frametool.documents.source import Event

    Value: TypeAlias = dict[str, "Value"] | list["Value"] | str | None
    NodeEvent: TypeAlias = ScalarEvent | MappingStartEvent | SequenceStartEvent

# plain words and numbers that have the same meaning in YAML and need no escapes in JSON
_WORD = r"(?:(?!(?:null|Null|NULL)[^\w./-])[A-Za-z_/][\w./-]*+|[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
_LIST = rf"\[{_WORD}(?:, {_WORD})*+\]"
_PAIR = rf"{_WORD}: (?:{_WORD}|{_LIST})"
_BLOCKS = rf"(?a)(?P<indent> *)- {_PAIR}\n(?:(?P=indent)(?:- |  ){_PAIR}\n)*+\Z"
_FLOWS = rf"(?a)(?P<indent> *)- \{{{_PAIR}(?:, {_PAIR})*+\}}\n(?:(?P=indent)- \{{{_PAIR}(?:, {_PAIR})*+\}}\n)*+\Z"
_BRACKETED = rf"(?am)^( {{0,99}}+(?:- )?{_WORD}: )(\{{{_PAIR}(?:, {_PAIR})*+\}}|{_LIST})$"
_NOT_PLAIN = r"""["'|>#&*!%@`?\t\r]"""  # quotes, comments, multi-line texts, anchors: brackets may be text there
_QUOTES = (
    ("{", '{"'), ("}", '"}'), (": ", '": "'), (", ", '", "'),
    ('"[', '["'), (']"', '"]'), ("\n[", '\n["'), ("]\n", '"]\n'),
)  # fmt: skip
STANDIN = "\ue000"  # replaces a value that is read as JSON


def split_run(text: str) -> tuple[str, list[Any]] | None:
    """Replace the list of plain maps at the end of a text by STANDIN; return the new text, and a list of this one list.

    Returns None if the text has no such end.
    """
    begin = re.search(r"(?m)^ {0,99}- (\{?)", text)
    run = begin and re.compile(_FLOWS if begin[1] else _BLOCKS).match(text, begin.start())
    if not begin or not run:
        return None
    indent = run["indent"]
    lines = run[0][len(indent) + 2 : -1]
    if begin[1]:
        lines = lines.replace(f"\n{indent}- ", "\n")
    else:  # block maps become flow maps, one per line
        lines = lines.replace(f"\n{indent}  ", ", ").replace(f"\n{indent}- ", "}\n{")
        lines = f"{{{lines}}}"
    items = _as_json(lines)
    return None if items is None else (f"{text[: run.start()]}{indent} {STANDIN}\n", [items])


def split_brackets(text: str) -> tuple[str, list[Any]] | None:
    """Replace each plain value in brackets that ends a line by STANDIN; return the new text, and the values in order.

    Returns None without such values, or if the text is not plain.
    """
    if re.search(_NOT_PLAIN, text):
        return None
    parts = re.split(_BRACKETED, text)  # text, key, value, text, key, value, ..
    found = parts[2::3]
    parts[2::3] = [STANDIN] * len(found)
    items = _as_json("\n".join(found)) if found else None
    return None if items is None else ("".join(parts), items)


def _as_json(lines: str) -> list[Any] | None:
    """Read one plain value in brackets per line as JSON; None for a duplicate key, or too many lists and maps."""
    from json import JSONDecoder

    if lines.count("{") + lines.count("[") > sizes.MOST_CONTAINERS:
        return None
    lines = f"\n{lines}\n"
    for plain, quoted in _QUOTES:
        lines = lines.replace(plain, quoted)
    lines = lines[1:-1].replace("\n", ",\n")
    items: list[Any] = JSONDecoder(object_pairs_hook=_distinct).decode(f"[{lines}]")
    return None if None in items else items


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any] | None:
    made = dict(pairs)
    return made if len(made) == len(pairs) else None


# compiled when an error needs them, not at start-up
_UNREADABLE = "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
_HINTS = {
    "mapping values are not allowed in this context": "; check the indentation, or quote a text that holds ': '",
    "found unexpected ':'": "; write a blank after the colon",
    "found character that cannot start any token": "; quote the text",
    "could not find expected ':'": "; a key needs ': ' after it",
    "did not find expected key": "; check the indentation and the brackets above",
    "did not find expected '-' indicator": "; check the indentation",
}


def translated(source: Source, error: Exception) -> FormatError:
    """Convert an error of the parser: lower case, with its place, and a hint if one is known."""
    if isinstance(error, yaml.MarkedYAMLError) and (mark := error.problem_mark or error.context_mark):
        line, column = line_of(source.text, mark.line + 1), mark.column
        problem, context = _one_line(error.problem or ""), _one_line(error.context or "")
        has_tab = "\t" in (line[column : column + 1], *line[:column].split(" "))
        if "maximum nesting depth" in problem:  # of libyaml, which reads ahead
            message = too_much(sizes.DEEPEST)
        elif has_tab and re.search("cannot start any token|tab character", problem):
            message = "a tab cannot indent YAML; use blanks"
        else:
            message = problem + (_HINTS.get(problem) or (f", {context}" if context else ""))
        return error_at(source, mark.index, message + _suspicion(source, mark.line + 1))
    if strange := re.search(_UNREADABLE, source.text):
        code = f"U+{ord(strange[0]):04X}"
        return error_at(source, strange.start(), f"the character {code} is not allowed in YAML or JSON; is this text?")
    return error_at(source, 0, _one_line(str(error)) or type(error).__name__)


def _suspicion(source: Source, line: int) -> str:
    """Return a hint at mistakes near an error that are hard to see: look-alikes, a missing blank, xacro."""
    for text in (line_of(source.text, line), line_of(source.text, line - 1) if line > 1 else ""):
        if strange := odd_characters(text):
            return f"; the line has {strange}"
        if "${" in text:
            return "; is this xacro? expand it first"
        if match := re.match(r"\s*(?:- +)*([\w./-]+):(?=[^\s:/])", text):
            return f"; write a blank after '{match[1]}:'"
    return ""


def _one_line(text: str) -> str:
    """Join the lines of the parser's text, in lower case."""
    return " ".join(text.split()).lower()


MOST_ALIASES = 1000
SPARE_COPIES = 10_000  # values that aliases may repeat, in addition to one per character of the text

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_ITEM = object()  # in place of the key while a list is filled
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_ODD_KEYS = frozenset(("", "<<"))
_ENDS = (yaml.MappingEndEvent, yaml.SequenceEndEvent)
_KINDS: dict[type, int] = {
    ScalarEvent: LEAF,
    AliasEvent: LEAF,
    SequenceStartEvent: LIST,
    MappingStartEvent: MAP,
    **dict.fromkeys(_ENDS, END),
}
_MOST_DIRECTIVES = 100  # libyaml compares each new %TAG with all previous ones


def parse_yaml(source: Source, tags: Collection[str] = ()) -> list[Value]:
    """Return the value of each document of a YAML text, None for an empty one.

    Mappings become dicts with text keys, sequences lists, scalars text, null values None.
    tags: of mappings that are read (`!!opencv-matrix`); the dict then has its tag under the key TAG.
    Raises FormatError.
    """
    if source.text.count("\n%TAG") > _MOST_DIRECTIVES:
        raise error_at(source, source.text.index("\n%TAG") + 1, f"more than {_MOST_DIRECTIVES} %TAG directives")
    text = source.text
    with paused_collector():
        # plain lists of maps, or values in brackets, of a long text are read as JSON; errors are left to the parser
        split = None if len(text) < sizes.ASIDE or STANDIN in text else split_run(text) or split_brackets(text)
        if split is not None:
            aside = iter(split[1])
            with suppress(FormatError):
                values = _Builder(Source(source.name, split[0]), tags, aside).build()
                if next(aside, None) is None:
                    return values
        return _Builder(source, tags).build()


def yaml_events(text: str) -> Iterator[Event]:
    """Yield the events of a text, its values in order with their places, up to the first error."""
    get: Callable[[], Any] = _Loader(text).get_event
    kinds = _KINDS
    try:
        while (kind := type(event := get())) is not StreamEndEvent:
            if kind in kinds:
                start = event.start_mark
                word, style = "", ""
                if kind is ScalarEvent:
                    word, style = event.value, event.style or ""
                elif kind is AliasEvent:
                    word = style = "*"
                elif kinds[kind] != END and event.flow_style:
                    style = "["
                yield kinds[kind], word, start.index, event.end_mark.index, style, start.column
    except yaml.YAMLError:
        return


class _Builder:
    """The values of one text while they are built, and the state that rare events need."""

    __slots__ = ("aliases", "anchors", "aside", "copies", "documents", "open", "source", "tags")

    def __init__(self, source: Source, tags: Collection[str], aside: Iterator[Value] | None = None) -> None:
        """Start with an empty list of documents, the accepted tags, the values for STANDIN, and the budget."""
        self.source = source
        self.tags = tags
        self.aside = aside
        self.anchors: dict[str, Value] = {}
        self.aliases = MOST_ALIASES
        self.copies = SPARE_COPIES + len(source.text)
        self.documents: list[Value] = []
        self.open: list[tuple[dict[str, Value] | list[Value], object]] = []

    def build(self) -> list[Value]:
        """Return the values of all documents; raises FormatError, also for the parser's errors."""
        try:
            self._run(_Loader(self.source.text).get_event)
        except FormatError:
            raise
        except (yaml.YAMLError, ValueError, RecursionError) as error:
            raise translated(self.source, error) from None
        return self.documents

    def _run(self, get: Callable[[], Any]) -> None:
        """Process events until the stream ends.

        `current` is the dict or list being filled and `key` the key waiting for its value: None if a key is next, _ITEM
        in a list.  A single function, because two million events pass through it for 100 000 frames.
        """
        stack, nulls, refused_keys, item, aside, ends = self.open, _NULLS, _ODD_KEYS, _ITEM, self.aside, _ENDS
        current: Any = self.documents
        key: Any = item
        room = sizes.MOST_CONTAINERS
        value: Value
        while True:
            event = get()
            kind = type(event)
            if kind is ScalarEvent:
                value = event.value
                if key is None:
                    if value in current or value in refused_keys:
                        self._refuse_key(event, current)
                    key = value
                    if event.tag is not None or event.anchor is not None:
                        self._note(event, value)
                    continue
                if value in nulls and not event.style:
                    value = None
                elif aside and value == STANDIN and not event.style:
                    value = next(aside)
            elif kind is MappingStartEvent or kind is SequenceStartEvent:
                value = {} if kind is MappingStartEvent else []
                if key is None:
                    raise self._error(event, "a key must be one text, not a list or map")
                room -= 1
                if len(stack) >= sizes.DEEPEST or not room:
                    raise self._error(event, too_much(len(stack)))
            elif kind in ends:
                current, key = stack.pop()
                continue
            elif kind is AliasEvent:
                value = self._repeat(event, current, key)
            elif kind is StreamEndEvent:
                return
            else:
                continue
            if key is item:
                current.append(value)
            else:
                current[key] = value
                key = None
            if kind is AliasEvent:
                continue
            if event.tag is not None or event.anchor is not None:
                self._note(event, value)
            if kind is not ScalarEvent:
                stack.append((current, key))
                current = value
                key = None if kind is MappingStartEvent else item

    def _note(self, event: NodeEvent, value: Value) -> None:
        """Store the tag of a mapping if it is accepted, else raise FormatError; store the value of an anchor."""
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            if tag not in self.tags or type(value) is not dict:
                raise self._error(event, f"tag {tag} is not read here")
            value[TAG] = tag
        if event.anchor is not None:
            self.anchors[event.anchor] = value

    def _refuse_key(self, event: ScalarEvent, current: Any) -> None:
        """Raise FormatError for a key that is a duplicate, empty or a merge key; a quoted << is a name."""
        if event.value == "":
            raise self._error(event, "an empty key; write a name, or quotes around a blank one")
        if event.value in current:
            from frametool.documents.source import repeated_key

            raise repeated_key(self.source, yaml_events(self.source.text))
        if not event.style:
            raise self._error(event, "merge keys (<<) are not supported; write the entries out")

    def _repeat(self, event: AliasEvent, current: object, key: object) -> Value:
        """Return a copy of the value of an alias; raises FormatError for an unknown one, and above the limits."""
        from frametool.documents.source import levels

        name = str(event.anchor)
        if key is None:
            raise self._error(event, f"alias *{name} cannot be a key")
        if name not in self.anchors:
            raise self._error(event, f"alias *{name} has no anchor &{name} before it")
        value = self.anchors[name]
        if value is current or any(value is container for container, _ in self.open):
            raise self._error(event, f"alias *{name} is inside its own anchor")
        self.aliases -= 1
        if self.aliases < 0:
            raise self._error(event, f"more than {MOST_ALIASES} aliases")
        root: list[Value] = [value]
        for depth, level in enumerate(levels(root)):  # so that no depth can exhaust the stack
            if depth > sizes.DEEPEST - len(self.open):
                raise self._error(event, too_much(sizes.DEEPEST))
            for container in level:
                self.copies -= len(container)
                if self.copies < 0:
                    raise self._error(event, f"aliases repeat more than {SPARE_COPIES + len(self.source.text)} values")
                for at, inner in list(container.items() if type(container) is dict else enumerate(container)):
                    if type(inner) is dict or type(inner) is list:
                        container[at] = inner.copy()
        return root[0]

    def _error(self, event: Any, message: str) -> FormatError:
        """Return the error for the place where an event begins."""
        return error_at(self.source, event.start_mark.index, message)
