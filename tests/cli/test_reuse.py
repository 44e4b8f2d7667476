"""A command that is called again reads its arguments as click reads them at the first call."""

from __future__ import annotations

import copy
from importlib import import_module
from random import Random
from typing import TYPE_CHECKING, Any

import click
import pytest

from frametool.cli.commands import COMMANDS
from frametool.cli.group import Reused, settings
from frametool.geometry.representations import Notation

if TYPE_CHECKING:
    from collections.abc import Iterator

VALUES = [
    "1", "-1e-3", "0.5", "-inf", "a.yaml", "map", "-", "--", "rpy_deg", "quaternion,euler:rzyx", "json", "yaml", "nope", "skip",
    "null", "{xyz: [1, 2, 3]}", "", "4,2,0", "d=norm(row)", "x=1", "-(1)", "text", "enu", "--nope", "-h", "90deg", "full", "-jx=1",
]  # fmt: skip


def commands() -> Iterator[tuple[str, Reused]]:
    """Yield every command that is no group, those of groups too."""
    for name, (module, _) in COMMANDS.items():
        command = import_module(module).command
        if isinstance(command, click.Group):
            context = click.Context(command)
            inner = {f"{name} {word}": command.get_command(context, word) for word in command.list_commands(context)}
        else:
            inner = {name: command}
        yield from ((named, each) for named, each in inner.items() if isinstance(each, Reused))


def parsed(command: click.Command, words: list[str]) -> tuple[Any, ...]:
    """Return what a command makes of words: its parameters and notes, or what it refuses."""
    try:
        context = command.make_context("x", list(words))
    except (click.ClickException, click.exceptions.Exit) as error:
        return type(error), str(error)
    return {name: plain(value) for name, value in context.params.items()}, vars(settings(context)), context.args


def plain(value: Any) -> Any:
    """Return a value in which notations compare by what they are."""
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    return (value.spec, value.degrees) if isinstance(value, Notation) else value


def some_words(command: click.Command, random: Random) -> list[str]:
    """Return words that may be arguments of a command: some of its options, with and without values, and values."""
    options = [name for param in command.params if isinstance(param, click.Option) for name in (*param.opts, *param.secondary_opts)]
    words = random.choices(VALUES[:6], k=random.randrange(4))
    for _ in range(random.randrange(5)):
        option = random.choice(options or ["-o"])
        words += random.choice([[option], [option, random.choice(VALUES)], [f"{option}={random.choice(VALUES)}"], [random.choice(VALUES)]])
    return words


@pytest.mark.parametrize(("name", "command"), [pytest.param(*each, id=each[0]) for each in commands()])
def test_words_mean_the_same_at_every_call(name: str, command: Reused) -> None:
    random = Random(name)  # noqa: S311 - a test's
    again, taken = copy.copy(command), 0
    parsed(again, [])
    for _ in range(200):
        words = some_words(command, random)
        first = copy.copy(command)
        first._calls = 0  # noqa: SLF001 - a command nobody has called
        outcome = parsed(first, words)
        assert parsed(again, words) == outcome, words
        taken += isinstance(outcome[0], dict)
    assert taken > 2
