"""The prompt of `calc`: lines are read and answered until Ctrl-D; with readline where Python has it."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import click

from frametool.calc.evaluate import evaluate_line, read_line
from frametool.cli.calc_completion import BETWEEN_WORDS, Completer
from frametool.cli.calc_names import file_named_in
from frametool.cli.calc_output import value_texts
from frametool.cli.commands.help import topic
from frametool.cli.sink import writing
from frametool.cli.stderr import say_error, tell
from frametool.errors import FrametoolError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.calc.scope import Scope
    from frametool.cli.output import Output

PROMPT = "> "
LONGEST_HISTORY = 1000  # lines
ENDS = ("exit", "quit")


def talk(scope: Scope, output: Output) -> int:
    """Answer lines until Ctrl-D; errors go on, Ctrl-C forgets the line."""
    if output.path is not None:
        raise click.UsageError("-o FILE is for expressions that are given or piped, not for the prompt")
    prompt = PROMPT if sys.stdout.isatty() else ""
    with _readline(scope):
        while True:
            try:
                line = input(prompt)
                if line.strip() in ENDS:
                    return 0
                if line.strip():
                    _answer(line, scope, output)
            except EOFError:
                if prompt:
                    tell("")
                return 0
            except KeyboardInterrupt:
                tell("")


def _answer(line: str, scope: Scope, output: Output) -> None:
    """Print the value of a line, or what is wrong with it."""
    if line.strip() == "help":
        with writing(None) as write:
            write(topic("calc"))
        return
    try:
        found = file_named_in(line, scope)
        if found is None:
            output.pieces(value_texts([evaluate_line(read_line(line), scope)], output.style))
    except click.UsageError as error:
        tell(f"frametool: {error.format_message()}")
    except BrokenPipeError:
        raise
    except FrametoolError as error:
        say_error(error, in_json=False)


@contextmanager
def _readline(scope: Scope) -> Iterator[None]:
    """Complete words and keep a history while lines are read; without readline lines are just read."""
    try:
        import readline
    except ImportError:
        yield
        return
    path = history_path()
    readline.set_completer_delims(BETWEEN_WORDS)
    readline.set_completer(Completer(scope, readline))
    is_editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if is_editline else "tab: complete")
    readline.set_history_length(LONGEST_HISTORY)
    with suppress(OSError):
        readline.read_history_file(path)
    try:
        yield
    finally:
        readline.set_completer(None)
        with suppress(OSError):
            os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
            readline.write_history_file(path)


def history_path() -> str:
    """Return the file of the history, as the XDG base directories have it."""
    state = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    return os.path.join(state, "frametool_history")
