"""`frametool check`: what is wrong or odd in trees and recordings."""

from __future__ import annotations

import sys
from shutil import get_terminal_size
from typing import TYPE_CHECKING

import click

from frametool.cli.options import FILE, Command, file_options
from frametool.cli.sink import writing
from frametool.cli.stderr import say
from frametool.cli.trees import opened, state
from frametool.lint.findings import RULES, WRITERS
from frametool.lint.rules import check

if TYPE_CHECKING:
    from collections.abc import Sequence

FAILED = 1


class CheckCommand(Command):
    """A command whose help lists the rules."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the rules with their levels, then the exit codes."""
        with formatter.section("Rules"):
            formatter.write_dl([(f"{rule} ({level})", about) for rule, (level, about) in RULES.items()])
        super().format_epilog(ctx, formatter)


@click.command(cls=CheckCommand, name="check")
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("-f", "--format", "form", type=click.Choice(tuple(WRITERS)), default="text", show_default=True,
              help="how findings are written")  # fmt: skip
@click.option("--strict", is_flag=True, help="let warnings fail too")
@file_options
def command(files: Sequence[str], form: str, strict: bool, normalize: bool) -> int:
    """Look for mistakes in FILES, trees and recordings, taken together as one tree.

    \b
      frametool check robot.yaml
      frametool check drive.yaml --strict
      frametool check robot.yaml --format github
      ros2 topic echo /tf > tf.txt; frametool check tf.txt tf_static.txt

    Each finding is one line: file:line:column: level: message [rule]. The status is 1 if there is an error, with
    --strict also if there is a warning; notes never fail. - is standard input.
    """
    recordings = opened(files)
    findings = check(recordings, normalize=normalize)
    state(recordings)
    text = WRITERS[form](findings)
    with writing(None) as write:
        write(_in_terminal(text) if form == "text" and sys.stdout.isatty() else text)
    counts = {level: sum(each.level == level for each in findings) for level in ("error", "warning", "note")}
    summary = ", ".join(f"{count} {level}{'s' * (count != 1)}" for level, count in counts.items() if count)
    if summary:
        say(summary)
    return FAILED if counts["error"] or (strict and counts["warning"]) else 0


def _in_terminal(text: str) -> str:
    """Break lines between words where the terminal ends."""
    from textwrap import TextWrapper

    wrapper = TextWrapper(
        get_terminal_size().columns, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )
    return "".join(f"{wrapper.fill(line)}\n" for line in text.splitlines())
