"""YAML text to plain values, and to places, through the parser's events: knows YAML, no meaning.

The library's constructors are not used: they build numbers, dates and truth values out of names, and they let a small
text grow without bound.  The loop here keeps every scalar as text and counts depth and aliases as it goes.
"""

from __future__ import annotations

import yaml
from yaml.events import (
    AliasEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from frametool.documents.collector import paused_collector
from frametool.documents.limits import DEEPEST, MOST_CONTAINERS, too_much
from frametool.documents.marks import END, LEAF, LIST, MAP, repeated_key
from frametool.documents.source import Source, error_at
from frametool.documents.yaml_errors import translated
from frametool.documents.yaml_lines import BRACKETS, put_back, split_brackets, split_run
from frametool.errors import FormatError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from typing import Any, TypeAlias

    from frametool.documents.marks import Event

    Value: TypeAlias = dict[str, "Value"] | list["Value"] | str | None
    NodeEvent: TypeAlias = ScalarEvent | MappingStartEvent | SequenceStartEvent

TAG = "!"  # key under which a mapping has its tag: no plain key of YAML looks so
MOST_ALIASES = 1000
SPARE_COPIES = 10_000  # what aliases may repeat, beside one value for each character of the text

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_ITEM = object()  # stands for the key while a list is filled
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_ODD_KEYS = frozenset(("", "<<"))
_KINDS: dict[type, int] = {
    ScalarEvent: LEAF,
    AliasEvent: LEAF,
    SequenceStartEvent: LIST,
    MappingStartEvent: MAP,
    SequenceEndEvent: END,
    MappingEndEvent: END,
}
_MOST_DIRECTIVES = 100  # libyaml compares each new %TAG with all before it


def parse_yaml(source: Source, tags: Collection[str] = ()) -> list[Value]:
    """Return the value of each document of a YAML text, None for an empty one.

    Mappings become dicts with text keys, sequences lists, scalars text, null values None.
    tags: of mappings that are read (`!Rpy`, `!!opencv-matrix`); the dict then has its tag under the key TAG.
    Raises FormatError.
    """
    if source.text.count("\n%TAG") > _MOST_DIRECTIVES:
        raise error_at(source, source.text.index("\n%TAG") + 1, f"more than {_MOST_DIRECTIVES} %TAG directives")
    with paused_collector():
        return _read_by_lines(source, tags) or _read_without_brackets(source) or _Builder(source, tags).build()


def _read_by_lines(source: Source, tags: Collection[str]) -> list[Value] | None:
    """Read a text that ends in a long list of plain maps; None for others and for mistakes."""
    split = split_run(source.text)
    if split is None:
        return None
    try:
        values = _Builder(Source(source.name, split[0]), tags).build()
    except FormatError:
        return None
    return values if put_back(values, split[1]) else None


def _read_without_brackets(source: Source) -> list[Value] | None:
    """Read a plain text whose values in brackets are read aside; None for others and for mistakes."""
    split = split_brackets(source.text)
    if split is None:
        return None
    builder = _Builder(Source(source.name, split[0]), ())
    builder.aside = iter(split[1])
    try:
        values = builder.build()
    except FormatError:
        return None
    return values if next(builder.aside, None) is None else None


def yaml_events(text: str) -> Iterator[Event]:
    """Yield the values of a text in order, with their places; what cannot be parsed ends them."""
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
    """Build the values of one text; holds what the rare events need beside the loop."""

    __slots__ = ("aliases", "anchors", "aside", "copies", "documents", "open", "source", "tags")

    def __init__(self, source: Source, tags: Collection[str]) -> None:
        """Start with an empty list of documents, the tags that are read, and the budget for aliases."""
        self.source = source
        self.tags = tags
        self.anchors: dict[str, Value] = {}
        self.aliases = MOST_ALIASES
        self.copies = SPARE_COPIES + len(source.text)
        self.aside: Iterator[Value] | None = None  # what BRACKETS stand for, if they stand for anything
        self.documents: list[Value] = []
        self.open: list[tuple[dict[str, Value] | list[Value], object]] = []

    def build(self) -> list[Value]:
        """Run the loop; what the parser itself refuses becomes our one-line error."""
        try:
            self._run(_Loader(self.source.text).get_event)
        except FormatError:
            raise
        except (yaml.YAMLError, ValueError, RecursionError) as error:
            raise translated(self.source, error) from None
        return self.documents

    def _run(self, get: Callable[[], Any]) -> None:
        """Take events until the stream ends.

        `current` is the dict or list being filled and `key` the key waiting for its value: None where a key comes
        next, _ITEM in a list.  One function, because two million events pass through it for 100 000 frames.
        """
        stack, nulls, odd_keys, item, brackets = self.open, _NULLS, _ODD_KEYS, _ITEM, self.aside and BRACKETS
        current: Any = self.documents
        key: Any = item
        room = MOST_CONTAINERS
        value: Value
        while True:
            event = get()
            kind = type(event)
            if kind is ScalarEvent:
                value = event.value
                if key is None:
                    if value in current or value in odd_keys:
                        self._refuse_key(event, current)
                    key = value
                    if event.tag is not None or event.anchor is not None:
                        self._note(event, value)
                    continue
                if value in nulls and not event.style:
                    value = None
                elif value == brackets:
                    value = self._from_aside(event)
            elif kind is MappingStartEvent or kind is SequenceStartEvent:
                value = {} if kind is MappingStartEvent else []
                if key is None:
                    raise self._error(event, "a key must be one text, not a list or map")
                room -= 1
                if len(stack) >= DEEPEST or not room:
                    raise self._error(event, too_much(len(stack)))
            elif kind is MappingEndEvent or kind is SequenceEndEvent:
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

    def _from_aside(self, event: ScalarEvent) -> Value:
        """Return the next value that was read aside: a list or a map of lists."""
        if len(self.open) + 2 > DEEPEST:
            raise self._error(event, too_much(DEEPEST))
        return next(self.aside or iter(()), None)

    def _note(self, event: NodeEvent, value: Value) -> None:
        """Keep the tag of a mapping if it is one that is read, refuse others; remember what an anchor names."""
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            if tag not in self.tags or type(value) is not dict:
                raise self._error(event, f"tag {tag} is not read here")
            value[TAG] = tag
        if event.anchor is not None:
            self.anchors[event.anchor] = value

    def _refuse_key(self, event: ScalarEvent, current: Any) -> None:
        """Raise for a key that is there already, is empty or asks for a merge; a quoted << is a name."""
        if event.value == "" and not (event.style and self.tags):  # Drake's name of the only body
            raise self._error(event, "an empty key; write a name, or quotes around a blank one")
        if event.value in current:
            raise repeated_key(self.source, yaml_events(self.source.text))
        if not event.style:
            raise self._error(event, "merge keys (<<) are not supported; write the entries out")

    def _repeat(self, event: AliasEvent, current: object, key: object) -> Value:
        """Return a copy of what the alias stands for, within the budget."""
        name = str(event.anchor)
        if key is None:
            raise self._error(event, f"alias *{name} cannot be a key")
        if name not in self.anchors:
            raise self._error(event, f"alias *{name} has no anchor &{name} before it")
        value = self.anchors[name]
        if value is current or any(value is container for container, _ in self.open):
            raise self._error(event, f"alias *{name} stands inside what it repeats")
        self.aliases -= 1
        if self.aliases < 0:
            raise self._error(event, f"more than {MOST_ALIASES} aliases")
        return self._copy(event, value)

    def _copy(self, event: AliasEvent, value: Value) -> Value:
        """Copy level by level, so that no depth can exhaust the stack."""
        root: list[Value] = [value]
        level: list[Any] = [root]
        for _ in range(DEEPEST + 1 - len(self.open)):
            below = []
            for container in level:
                self.copies -= len(container)
                if self.copies < 0:
                    raise self._error(event, f"aliases repeat more than {SPARE_COPIES + len(self.source.text)} values")
                for key, inner in _children(container):
                    if type(inner) is dict or type(inner) is list:
                        container[key] = inner.copy()
                        below.append(container[key])
            if not below:
                return root[0]
            level = below
        raise self._error(event, too_much(DEEPEST))

    def _error(self, event: Any, message: str) -> FormatError:
        """Make the error for the place where an event begins."""
        return error_at(self.source, event.start_mark.index, message)


def _children(container: dict[str, Value] | list[Value]) -> list[tuple[Any, Value]]:
    """Return keys or indices with their values."""
    return list(container.items() if isinstance(container, dict) else enumerate(container))
