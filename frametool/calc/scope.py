"""What expressions may name, and where messages point: values, trees, the row of a stream."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc.literals import Literals

if TYPE_CHECKING:
    from frametool.calc.values import Term, Type
    from frametool.errors import FrametoolError
    from frametool.frames.lookups import Frames


class Scope:
    """What an expression may name: values, trees, the tree of bare look-ups, the row of a stream.

    row: the type of a row; None outside of streams
    seen: the frames of all that was evaluated
    """

    def __init__(
        self,
        *,
        tree: Frames | None = None,
        names: dict[str, Term] | None = None,
        literals: Literals | None = None,
        row: Type | None = None,
    ) -> None:
        """Keep all of it; `names` grows as lines bind."""
        self.tree = tree
        self.names = {} if names is None else names
        self.literals = literals or Literals()
        self.row = row
        self.seen: set[str | None] = {None}

    def with_row(self, row: Type) -> Scope:
        """Return the same scope for rows of a type, its names its own."""
        return Scope(tree=self.tree, names=dict(self.names), literals=self.literals, row=row)

    @property
    def trees(self) -> list[tuple[str, Frames]]:
        """Return the trees by the names that look-ups in them have; the tree of bare ones first."""
        named = [(name, term.tree) for name, term in self.names.items() if term.tree is not None]
        return [("", self.tree), *named] if self.tree is not None else named


def pointed(error: FrametoolError, text: str) -> FrametoolError:
    """Add the expression with a caret to an error that says its place."""
    at = getattr(error, "at", None)
    if at is not None and not getattr(error, "snippet", ""):
        from frametool.documents.source import line_of, places_of, pointer

        ((row, column),) = places_of(f"{text}.", [at]) if at < len(text) else [_end_of(text)]
        shown_line = pointer(line_of(text, row), column)
        error.fields = {**error.fields, "column": column}
        error.snippet = "\n".join(f"  {each}" for each in shown_line.split("\n"))  # type: ignore[attr-defined]
    return error


def _end_of(text: str) -> tuple[int, int]:
    """Return line and column behind the last character that shows."""
    lines = text.rstrip().splitlines() or [""]
    return len(lines), len(lines[-1]) + 1
