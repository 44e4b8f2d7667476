"""Recordings named on the command line: files, standard input, bags."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from frametool.cli.trees import announce, tree_file
from frametool.formats.recordings import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence


def opened(arguments: Sequence[str]) -> list[Recording]:
    """Open recordings and trees; standard input can be named once, and must not be a terminal."""
    if list(arguments).count("-") > 1:
        raise click.UsageError("standard input can be read once; only one argument may be -")
    if "-" in arguments and sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe something in, or name a file")
    found = [Recording(tree_file(argument)) for argument in arguments]
    for recording in found:
        announce(recording)
    return found
