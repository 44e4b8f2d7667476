"""Completion of expressions, at the prompt and in the shell: frames on both sides of an arrow, names, functions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.calc.functions import FUNCTIONS
from frametool.calc.scope import Scope
from frametool.calc.tokens import frame_text
from frametool.cli.command import Text
from frametool.errors import FrametoolError, heard_by

if TYPE_CHECKING:
    from collections.abc import Iterable

    from click.shell_completion import CompletionItem

BETWEEN_WORDS = " \t()[]{},*^@+="
WORDS = ("row", "pi", "ans", "as ", "in ")


class Expression(Text):
    """An expression, completed from --tree and from the files that were named before it."""

    name = "expression"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Offer what its last word may become."""
        from click.shell_completion import CompletionItem

        scope = Scope()
        with heard_by(lambda *_: None):
            _fill(scope, ctx.params.get("trees") or (), ctx.params.get("arguments") or ())
        cut = max(incomplete.rfind(mark) for mark in BETWEEN_WORDS) + 1
        before, word = incomplete[:cut], incomplete[cut:]
        return [CompletionItem(before + each) for each in Completer(scope, None).completions(word, before)]


def _fill(scope: Scope, trees: Iterable[str], named: Iterable[str]) -> None:
    """Read the trees; a completion says nothing of what cannot be read."""
    from frametool.cli.calc_names import file_named_in
    from frametool.cli.trees import load_tree

    first, *more = [*trees, ""]
    try:
        scope.tree = load_tree(first, [each for each in more if each]) if first else None
        for each in named:
            file_named_in(each, scope)
    except (FrametoolError, click.UsageError):
        pass


class Completer:
    """Completes frames on both sides of an arrow, names, and functions with their bracket."""

    def __init__(self, scope: Scope, line: Any) -> None:
        """Take what there is to name, and readline, which knows the line."""
        self.scope = scope
        self.line = line
        self.found: list[str] = []

    def __call__(self, text: str, state: int) -> str | None:
        """Return one completion after the other."""
        if state == 0:
            self.found = self.completions(text, self.line.get_line_buffer()[: self.line.get_begidx()])
        return self.found[state] if state < len(self.found) else None

    def completions(self, text: str, before: str) -> list[str]:
        """Return all completions of a word behind the rest of a line."""
        frames = sorted(frame_text(frame) for frame in self._frames(before))
        head, arrow, tail = text.partition("<-")
        if arrow:
            return [f"{head}<-{frame}" for frame in frames if frame.startswith(tail)]
        if self._tree_before(before) is not None:
            words: Iterable[str] = ()
        else:
            words = (*self.scope.names, *(f"{name}(" for name in FUNCTIONS), *WORDS)
        known = [*words, *(f"{frame}<-" for frame in frames)]
        return [word for word in known if word.startswith(text)]

    def _tree_before(self, before: str) -> Any:
        """Return the tree whose bracket is open right before a word."""
        name = before[:-1].rstrip().rpartition(" ")[2] if before.endswith("[") else ""
        bare = name.lstrip("()[]{},*^@+=-/")
        term = self.scope.names.get(bare)
        return None if term is None else term.tree

    def _frames(self, before: str) -> Iterable[str]:
        tree = self._tree_before(before) or self.scope.tree
        return () if tree is None else tree.frames
