"""What several lines of a batch read from the same files, read once for as long as these stay as they are."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.cli.pasted_input import is_inline
from frametool.documents.source import noting_files, states_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence
    from typing import TypeVar

    from frametool.documents.source import FileState

    Value = TypeVar("Value")

MOST = 32  # values
MOST_BYTES = 1 << 28  # of the files and texts they were read from
SETTLED_NS = 50_000_000  # a file that was written just now may change again within one tick of its clock


class Remembered(NamedTuple):
    """A value, and the files it was read from as they were then."""

    value: Any
    files: dict[str, list[FileState]]
    size: int

    def is_current(self) -> bool:
        """Tell whether all files still are what was read."""
        try:
            return all(states_of(path) == states for path, states in self.files.items())
        except OSError:
            return False


class TreeCache:
    """What was read last, mostly trees, by the arguments and by all that says how they are read."""

    def __init__(self) -> None:
        """Create an empty cache."""
        self._kept: dict[Hashable, Remembered] = {}

    def read(self, arguments: Sequence[str], options: Hashable, read: Callable[[], Value]) -> Value:
        """Return what `read` makes of some arguments: as it did before, or anew."""
        key = (tuple(arguments), options)
        if (kept := self._kept.pop(key, None)) is not None and kept.is_current():
            self._kept[key] = kept  # as the youngest
            return kept.value  # type: ignore[no-any-return]
        texts = [argument for argument in arguments if is_inline(argument)]
        with noting_files() as files:
            for argument in arguments:
                if argument not in texts and os.path.exists(argument):
                    files[argument] = states_of(argument)
            value = read()
        if _may_be_kept(files):
            size = sum(map(len, texts)) + sum(state.size for states in files.values() for state in states)
            self._kept[key] = Remembered(value, files, size)
            self._forget()
        return value

    def _forget(self) -> None:
        """Forget the oldest values where there are too many, or too large ones."""
        while len(self._kept) > MOST or sum(kept.size for kept in self._kept.values()) > MOST_BYTES:
            del self._kept[next(iter(self._kept))]


def _may_be_kept(files: dict[str, list[FileState]]) -> bool:
    """Tell whether files can be read again, and whether a change would show."""
    plain = all(os.path.isfile(path) or os.path.isdir(path) for path in files)
    youngest = max((state.ctime_ns for states in files.values() for state in states), default=0)
    return plain and youngest < time.time_ns() - SETTLED_NS
