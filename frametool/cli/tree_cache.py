"""Trees that several lines of a batch name, read once for as long as their files stay as they are."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, NamedTuple

from frametool.cli.pasted_input import is_inline
from frametool.documents.source import noting_files, states_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

    from frametool.documents.source import FileState
    from frametool.frames.buffer import TransformBuffer
    from frametool.frames.tree import FrameTree

    Tree = FrameTree | TransformBuffer

MOST = 32  # trees
SETTLED_NS = 50_000_000  # a file that was written just now may change again within one tick of its clock


class Kept(NamedTuple):
    """A tree, and the files it was read from as they were then."""

    tree: Tree
    files: dict[str, list[FileState]]

    def is_current(self) -> bool:
        """Tell whether all files still are what was read."""
        try:
            return all(states_of(path) == states for path, states in self.files.items())
        except OSError:
            return False


class TreeCache:
    """The trees that were named last, by their arguments and by all that says how they are read."""

    def __init__(self) -> None:
        """Create an empty cache."""
        self._kept: dict[Hashable, Kept] = {}

    def tree(self, arguments: Sequence[str], options: Hashable, read: Callable[[], Tree]) -> Tree:
        """Return the tree of some arguments: as it was read before, or read anew."""
        key = (tuple(arguments), options)
        if (kept := self._kept.pop(key, None)) is not None and kept.is_current():
            self._kept[key] = kept  # as the youngest
            return kept.tree
        with noting_files() as files:
            for argument in arguments:
                if not is_inline(argument) and os.path.exists(argument):
                    files[argument] = states_of(argument)
            tree = read()
        if _may_be_kept(files):
            self._kept[key] = Kept(tree, files)
            if len(self._kept) > MOST:
                del self._kept[next(iter(self._kept))]
        return tree


def _may_be_kept(files: dict[str, list[FileState]]) -> bool:
    """Tell whether files can be read again, and whether a change would show."""
    plain = all(os.path.isfile(path) or os.path.isdir(path) for path in files)
    youngest = max((state.ctime_ns for states in files.values() for state in states), default=0)
    return plain and youngest < time.time_ns() - SETTLED_NS
