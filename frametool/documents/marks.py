"""From a path of keys and indices to the place where the text holds it: knows paths, no syntax."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import TypeAlias, TypeVar

    Path: TypeAlias = tuple[str | int, ...]
    Mark = TypeVar("Mark")
    PlaceEvent: TypeAlias = tuple[int, str, Mark]  # kind, text of a scalar, mark

LEAF, LIST, MAP, END = range(4)


def find_marks(events: Iterable[PlaceEvent[Mark]], paths: Sequence[Path]) -> dict[Path, tuple[Mark, Mark]]:
    """Walk the events of a text and keep the marks of keys and values on the way to the paths.

    A path is (document, key or index, ...).  Returns (mark of the key, mark of the value) for each path and each
    of its beginnings that the text holds; in a list both are the value's.  Of equal keys the first counts.
    """
    wanted = {path[:length] for path in paths for length in range(1, len(path) + 1)}
    found: dict[Path, tuple[Mark, Mark]] = {}
    walk = iter(events)
    outer: list[tuple[Path, str | int | None]] = []
    path: Path = ()
    step: str | int | None = 0  # the index or key that comes next; None where a key is awaited
    for kind, text, mark in walk:
        if kind == END:
            path, step = outer.pop()
            continue
        if step is None:
            step, key_mark = text, mark
            continue
        here = (*path, step)
        in_list = type(step) is int
        if here in wanted and here not in found:
            found[here] = (mark if in_list else key_mark, mark)
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


def _skip(walk: Iterator[PlaceEvent[Mark]]) -> None:
    """Pass over the rest of a list or map that has just begun."""
    depth = 1
    for kind, _, _ in walk:
        if kind == END:
            depth -= 1
            if not depth:
                return
        elif kind != LEAF:
            depth += 1


def longest_found(path: Path, found: dict[Path, tuple[Mark, Mark]]) -> Path:
    """Return the longest beginning of the path that was found: where something missing should have been."""
    return next((path[:length] for length in range(len(path), 0, -1) if path[:length] in found), ())
