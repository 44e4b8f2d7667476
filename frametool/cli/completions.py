"""What the shell offers in the place of names that are in no list of choices: axes, and columns of the input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.cli.command import Text

if TYPE_CHECKING:
    from collections.abc import Iterable

    import click
    from click.shell_completion import CompletionItem


class AxesName(Text):
    """A convention of axes, or the change from one to another: A_from_B."""

    name = "axes"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Offer the conventions; behind `_from_` those it may come from."""
        from frametool.geometry.conventions import AXES, MIRRORED

        begun, joint, _ = incomplete.partition("_from_")
        known = {name: about for name, (_, about) in AXES.items()} | dict.fromkeys(MIRRORED, "mirrored")
        offered = {f"{begun}{joint}{name}" if joint else name: about for name, about in known.items() if name != begun}
        return _items(offered.items(), incomplete)


class ColumnNames(Text):
    """Columns of the input, or keys of its records, with commas between them."""

    name = "name"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Offer those of the file that -i names."""
        done, comma, begun = incomplete.rpartition(",")
        path = ctx.params.get("input_path")
        found = _names_in(str(path)) if path and path != "-" else []
        return _items(((done + comma + name, "") for name in found), done + comma + begun)


def _items(offered: Iterable[tuple[str, str]], begun: str) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem

    return [CompletionItem(name, help=about or None) for name, about in offered if name.startswith(begun)]


def _names_in(path: str) -> list[str]:
    """Return the names of a table's columns, or the outermost keys of records; none for what cannot be read."""
    from frametool.documents.source import HEAD
    from frametool.errors import FrametoolError
    from frametool.formats.detect import Beginning, detect
    from frametool.stream.table import open_table
    from frametool.stream.table_stream import DELIMITERS

    try:
        with open(path, "rb") as file:
            head = file.read(HEAD)
        form, _ = detect(head, "rows", "records", name=path)
        if form not in DELIMITERS:
            return sorted(".".join(each) for each in Beginning(head).json_paths)
        return list(open_table(head, DELIMITERS[form], header=True, source=path)[0].names or ())
    except (OSError, FrametoolError):
        return []  # nothing to offer, and a completion must not print
