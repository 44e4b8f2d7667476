"""Completion in bash, zsh and fish: their scripts, and what they are passed.

click finds what fits. The scripts, and what passes between them and the tool, are our own: those of click differ with
its versions, and part words at a colon or a comma.
"""

from __future__ import annotations

import os

import click
from click.shell_completion import ShellComplete, split_arg_string

from frametool.cli.sink import writing

SCRIPTS = os.path.join(os.path.dirname(__file__), "completions")  # of each shell; the wheel installs them too


def answer(command: click.Command, variable: str, wanted: str, line: str) -> int:
    """Print what a shell asks for; return 0.

    variable: by which it asks
    wanted: `words`, those that may end the line, each between its type and its meaning; or `bash_source` and the like
    """
    shells = sorted(os.listdir(SCRIPTS))
    if wanted == "words":
        text = "".join("\t".join(row) + "\n" for row in _offers(command, variable, line) if "".join(row).isprintable())
    elif (shell := wanted.removesuffix("_source")) in shells:
        with open(os.path.join(SCRIPTS, shell), encoding="utf-8") as script:
            text = script.read()
    else:
        known = ", ".join(f"{each}_source" for each in shells)
        raise click.UsageError(f"{variable} is {wanted!r}; it prints the completions of a shell as {known}")
    with writing(None) as write:
        write(text)
    return 0


def _offers(command: click.Command, variable: str, line: str) -> list[tuple[str, str, str]]:
    """Return type, word and meaning of what may end a line; all of the word, also what comes before a `=`."""
    *words, begun = split_arg_string(f"{line}.")  # the point: behind a blank a word begins
    option = begun[: begun.find("=") + 1] if begun.startswith("--") else ""
    known = list(map(os.path.expanduser, words[1:]))
    found = ShellComplete(command, {}, "frametool", variable).get_completions(known, begun[:-1])
    return [(each.type, option + each.value, each.help or "") for each in found]
