"""YAML text to plain values, and to places, through the parser's events: knows YAML, no meaning.

The library's constructors are not used: they build numbers, dates and truth values out of names, and they let a small
text grow without bound.  The loop here keeps every scalar as text and counts depth and aliases as it goes.
"""

from __future__ import annotations

import re

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
from frametool.documents.marks import END, LEAF, LIST, MAP, find_marks
from frametool.documents.source import Source, error_at, place_of, placed_error
from frametool.documents.yaml_errors import translated
from frametool.documents.yaml_lines import put_back, split_run
from frametool.errors import FormatError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any, TypeAlias

    from frametool.documents.marks import Path, PlaceEvent

    Value: TypeAlias = dict[str, "Value"] | list["Value"] | str | None
    NodeEvent: TypeAlias = ScalarEvent | MappingStartEvent | SequenceStartEvent

MOST_ALIASES = 1000
SPARE_COPIES = 10_000  # what aliases may repeat, beside one value for each character of the text

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_ITEM = object()  # stands for the key while a list is filled
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_ODD_KEYS = frozenset(("", "<<"))
_OPENCV_HEAD = r"%YAML:1\.[0-9]+[^\r\n]*"
_OPENCV_TIGHT = r"(?m)^([ \t]*[\w.]+):(?=\S)"
_OPENCV_TAGS = frozenset(("tag:yaml.org,2002:opencv-matrix",))
_PLACE_KINDS: dict[type, int] = {
    ScalarEvent: LEAF,
    AliasEvent: LEAF,
    SequenceStartEvent: LIST,
    MappingStartEvent: MAP,
    SequenceEndEvent: END,
    MappingEndEvent: END,
}
_MOST_DIRECTIVES = 100  # libyaml compares each new %TAG with all before it


def parse_yaml(source: Source, allowed_tags: frozenset[str]) -> list[Value]:
    """Return the value of each document of a YAML text, None for an empty one.

    Mappings become dicts with text keys, sequences lists, scalars text, null values None.
    Tags that are allowed are read over.  Raises FormatError.
    """
    readable = readable_yaml(source)
    tags = allowed_tags if readable is source else allowed_tags | _OPENCV_TAGS
    try:
        with paused_collector():
            return _read_by_lines(readable, tags) or _Builder(readable, tags).build()
    except FormatError as error:
        if readable is source:
            raise
        place = _unshift((error.line, error.column), dict(_widened(source.text)))
        raise placed_error(source, *place, error.message) from None


def _read_by_lines(source: Source, tags: frozenset[str]) -> list[Value] | None:
    """Read a text that ends in a long list of plain flow maps; None for others and for mistakes."""
    split = split_run(source.text)
    if split is None:
        return None
    try:
        values = _Builder(Source(source.name, split[0]), tags).build()
    except FormatError:
        return None
    return values if put_back(values, split[1]) else None


def readable_yaml(source: Source) -> Source:
    """Return the source itself, or what OpenCV wrote turned into YAML: same lines, blanks after the colons."""
    text = source.text
    if text.count("\n%TAG") > _MOST_DIRECTIVES:
        raise error_at(source, text.index("\n%TAG") + 1, f"more than {_MOST_DIRECTIVES} %TAG directives")
    head = re.match(_OPENCV_HEAD, text) if text.startswith("%YAML:") else None
    return source if head is None else Source(source.name, re.sub(_OPENCV_TIGHT, r"\1: ", text[head.end() :]))


def yaml_marks(source: Source, paths: Sequence[Path]) -> dict[Path, tuple[tuple[int, int], tuple[int, int]]]:
    """Find the places (line, column) of keys and values; nothing for what the text does not hold."""
    readable = readable_yaml(source)
    found = {
        path: (_place(key), _place(value))
        for path, (key, value) in find_marks(_place_events(readable.text), paths).items()
    }
    if readable is source:
        return found
    lines = {place[0] for places in found.values() for place in places}
    shifts = {line: end for line, end in _widened(source.text) if line in lines}
    return {path: (_unshift(key, shifts), _unshift(value, shifts)) for path, (key, value) in found.items()}


def _place(mark: Any) -> tuple[int, int]:
    """Return line and column from 1 of the parser's mark, which counts from 0."""
    return mark.line + 1, mark.column + 1


def _widened(text: str) -> Iterator[tuple[int, int]]:
    """Return line and column of each colon that got a blank."""
    return (place_of(text, match.end() - 1) for match in re.finditer(_OPENCV_TIGHT, text))


def _unshift(place: tuple[int, int], shifts: dict[int, int]) -> tuple[int, int]:
    """Take the inserted blank off a column."""
    line, column = place
    return line, column - (line in shifts and column > shifts[line])


def _place_events(text: str) -> Iterator[PlaceEvent[Any]]:
    """Reduce the parser's events to what finding places needs; what cannot be parsed ends them."""
    get: Callable[[], Any] = _Loader(text).get_event
    kinds = _PLACE_KINDS
    try:
        while (kind := type(event := get())) is not StreamEndEvent:
            if kind in kinds:
                yield kinds[kind], event.value if kind is ScalarEvent else "", event.start_mark
    except yaml.YAMLError:
        return


class _Builder:
    """Build the values of one text; holds what the rare events need beside the loop."""

    __slots__ = ("aliases", "allowed", "anchors", "copies", "documents", "open", "source")

    def __init__(self, source: Source, allowed: frozenset[str]) -> None:
        """Start with an empty list of documents, and the budget for aliases."""
        self.source = source
        self.allowed = allowed
        self.anchors: dict[str, Value] = {}
        self.aliases = MOST_ALIASES
        self.copies = SPARE_COPIES + len(source.text)
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
        stack, nulls, odd_keys, item = self.open, _NULLS, _ODD_KEYS, _ITEM
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

    def _note(self, event: NodeEvent, value: Value) -> None:
        """Refuse a tag that is not allowed; remember what an anchor names."""
        if event.tag is not None and event.tag not in self.allowed:
            raise self._error(event, f"tag {_tag_shown(event.tag)} is not read here")
        if event.anchor is not None:
            self.anchors[event.anchor] = value

    def _refuse_key(self, event: ScalarEvent, current: Any) -> None:
        """Raise for a key that is there already, is empty or asks for a merge; a quoted << is a name."""
        if event.value == "":
            raise self._error(event, "an empty key; write a name, or quotes around a blank one")
        if event.value in current:
            first = yaml_marks(self.source, [(*self._path(), event.value)])
            line, column = next(reversed(first.values()))[0]
            raise self._error(event, f"key {event.value!r} stands twice; first at {line}:{column}")
        if not event.style:
            raise self._error(event, "merge keys (<<) are not supported; write the entries out")

    def _path(self) -> Path:
        """Return the path of what is being filled: the last index or key at each level."""
        levels = [container for container, _ in self.open]
        return tuple(len(level) - 1 if isinstance(level, list) else next(reversed(level)) for level in levels)

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
        return placed_error(self.source, *_place(event.start_mark), message)


def _children(container: dict[str, Value] | list[Value]) -> list[tuple[Any, Value]]:
    """Return keys or indices with their values."""
    return list(container.items() if isinstance(container, dict) else enumerate(container))


def _tag_shown(tag: str) -> str:
    """Return a tag as it is written."""
    return tag.replace("tag:yaml.org,2002:", "!!")


def node_events(text: str) -> Iterator[Any]:
    """Yield the events of scalars, aliases, lists and maps with their marks."""
    get: Callable[[], Any] = _Loader(text).get_event
    kinds = (ScalarEvent, AliasEvent, SequenceStartEvent, MappingStartEvent, SequenceEndEvent, MappingEndEvent)
    while type(event := get()) is not StreamEndEvent:
        if isinstance(event, kinds):
            yield event
