"""From a path of keys and indices to the place where the text holds it: knows paths, no syntax."""

from __future__ import annotations

from frametool.documents.source import error_at, places_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import TypeAlias

    from frametool.documents.source import Source
    from frametool.errors import FormatError

    Path: TypeAlias = tuple[str | int, ...]
    # kind, text of a scalar, start, end, quote of a scalar or bracket of a container ("" for a block), column
    Event: TypeAlias = tuple[int, str, int, int, str, int]

LEAF, LIST, MAP, END = range(4)


def find_marks(events: Iterable[Event], paths: Sequence[Path]) -> dict[Path, tuple[int, int]]:
    """Walk the events of a text and keep the offsets of keys and values on the way to the paths.

    A path is (document, key or index, ...).  Returns (offset of the key, offset of the value) for each path and each
    of its beginnings that the text holds; in a list both are the value's.  Of equal keys the first counts.
    """
    wanted = {path[:length] for path in paths for length in range(1, len(path) + 1)}
    found: dict[Path, tuple[int, int]] = {}
    walk = iter(events)
    outer: list[tuple[Path, str | int | None]] = []
    path: Path = ()
    step: str | int | None = 0  # the index or key that comes next; None where a key is awaited
    key_start = 0
    for kind, text, start, *_ in walk:
        if kind == END:
            path, step = outer.pop()
            continue
        if step is None:
            step, key_start = text, start
            continue
        here = (*path, step)
        if here in wanted and here not in found:
            found[here] = (start if type(step) is int else key_start, start)
            if len(found) == len(wanted):
                break
        step = step + 1 if isinstance(step, int) else None
        if kind != LEAF:
            if here in wanted:
                outer.append((path, step))
                path, step = here, 0 if kind == LIST else None
            else:
                _skip(walk)
    return found


def _skip(walk: Iterator[Event]) -> None:
    """Pass over the rest of a list or map that has just begun."""
    depth = 1
    for kind, *_ in walk:
        if kind != LEAF:
            depth += -1 if kind == END else 1
            if not depth:
                return


def mark_of(path: Path, found: dict[Path, tuple[int, int]], *, key: bool) -> int:
    """Return the offset of the key or value at a path; of what is missing, that of the nearest value around it."""
    for length in range(len(path), 0, -1):
        if path[:length] in found:
            return found[path[:length]][not (key and length == len(path))]
    return 0


def repeated_key(source: Source, events: Iterable[Event]) -> FormatError:
    """Make the error for the first key that its map holds twice, or that is empty."""
    opened: list[dict[str, int] | None] = [None]  # the keys of a map; None for a list
    key_next = False
    for kind, text, start, *_ in events:
        keys = opened[-1]
        if kind == END:
            opened.pop()
        elif key_next and keys is not None:
            if not text or text in keys:
                places = places_of(source.text, [keys.get(text, 0)])
                said = "key {!r} stands twice; first at {}:{}".format(text, *places[0]) if text else "an empty key"
                return error_at(source, start, said)
            keys[text] = start
        elif kind != LEAF:
            opened.append({} if kind == MAP else None)
        key_next = opened[-1] is not None and not (kind == LEAF and key_next)
    return error_at(source, 0, "a key stands twice")
