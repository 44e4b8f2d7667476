"""Recordings named on the command line: files, standard input, bags."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from frametool.formats.recordings import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence


def opened(arguments: Sequence[str], *, verbose: bool = False) -> list[Recording]:
    """Open recordings; standard input can be named once, and must not be a terminal."""
    if list(arguments).count("-") > 1:
        raise click.UsageError("standard input can be read once; only one argument may be -")
    if "-" in arguments and sys.stdin.isatty():
        raise click.UsageError("standard input is a terminal; pipe something in, or name a file")
    found = [Recording(_file(argument)) for argument in arguments]
    for recording in found if verbose else ():
        click.echo(f"frametool: {recording.described}", err=True)
    return found


def _file(argument: str) -> str:
    """Give the file that an argument stands for; `.` is the one that FRAMETOOL_TREE names."""
    return os.environ.get("FRAMETOOL_TREE") or argument if argument == "." else argument


verbose_option = click.option("-v", "--verbose", is_flag=True, help="say on stderr what each file was taken for")
