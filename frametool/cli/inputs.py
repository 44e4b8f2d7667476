"""What the running command is given: its arguments and options, and which of them the way that runs has asked for.

An option that was given and that nobody has asked for when the first result is written would be ignored: it is a usage
error, and nothing is written.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.geometry.place import Earth

INPUTS = "frametool.inputs"  # the key in a context's `meta`
# what stands for an option of several values in a command without it
WITHOUT = {"input_forms": (), "topics": (), "joints": (), "joint_files": (), "named_frames": (), "messages": ()}
# options that any way may ignore: they are about what is said, not about what is done
OF_MESSAGES = ("quiet", "verbose")


class Inputs:
    """The arguments and options of a command, by the names of its parameters; to read one is to ask for it.

    forms_read: the forms of what was read, each with the options that say what it leaves open
    reads_trees: whether files of frames are opened: --in is then about these too
    earth: what the options say of places on the Earth, made when first needed
    """

    def __init__(self, values: Mapping[str, Any], idle: dict[str, str] | None = None) -> None:
        """Keep the values; idle: the options that were given, each as it is called."""
        self._values = {**values}
        self._idle = {} if idle is None else idle
        self.forms_read: tuple[tuple[str, tuple[str, ...]], ...] = ()
        self.reads_trees = False
        self.earth: Earth | None = None

    @classmethod
    def of(cls, context: click.Context) -> Inputs:
        """Return what a context has parsed."""
        idle = {name: called for name, called in told_options(context).items() if name not in OF_MESSAGES}
        return cls(context.params, idle)

    def __getattr__(self, name: str) -> Any:
        """Return the value of an argument or option, which counts as asked for; None where the command has none."""
        if name.startswith("_"):
            raise AttributeError(name)
        self._idle.pop(name, None)
        return self._values.get(name, WITHOUT.get(name))

    def peek(self, name: str) -> Any:
        """Return a value that is looked at and not used."""
        return self._values.get(name, WITHOUT.get(name))

    def ask(self, *names: str) -> None:
        """Count options as asked for."""
        for name in names:
            self._idle.pop(name, None)

    def leave(self, **values: Any) -> None:
        """Put what other readers have left in the place of what was given."""
        self._values |= values

    def but(self, **values: Any) -> Inputs:
        """Return these inputs with other values."""
        return Inputs(self._values | values, self._idle)

    def idle(self) -> set[str]:
        """Return the options that were given and that nobody has asked for."""
        return {*self._idle}

    def refuse_idle(self) -> None:
        """Raise a usage error for options that were given and that nobody has asked for."""
        if self._idle:
            has = "has" if len(self._idle) == 1 else "have"
            raise click.UsageError(f"{', '.join(self._idle.values())} {has} no effect here")


class Option(click.Option):
    """An option with what it says about other options of its command, by the names of their parameters.

    excludes: those that cannot stand beside it
    requires: without any of these it has no meaning
    """

    def __init__(
        self, *names: Any, excludes: Sequence[str] = (), requires: Sequence[str] = (), **rest: Any
    ) -> None:
        """Keep both beside what click keeps."""
        super().__init__(*names, **rest)
        self.excludes, self.requires = excludes, requires


option = partial(click.option, cls=Option)


def told_options(context: click.Context) -> dict[str, str]:
    """Return the options that stand on the command line, by their parameters, each as it is called."""
    told = click.core.ParameterSource.COMMANDLINE
    return {
        each.name or "": each.opts[-1] for each in context.command.params
        if isinstance(each, click.Option) and context.get_parameter_source(each.name or "") is told
    }  # fmt: skip


def check_together(context: click.Context) -> None:
    """Raise a usage error for options that do not belong together."""
    told = told_options(context)
    known = {each.name: each for each in context.command.params if isinstance(each, Option)}
    for name, called in told.items():
        if name not in known:
            continue
        if other := next((told[each] for each in known[name].excludes if each in told), ""):
            raise click.UsageError(f"{called} and {other} exclude each other", context)
        needed = known[name].requires
        if needed and not any(map(context.params.get, needed)):
            choices = " or ".join(known[each].opts[-1] for each in needed if each in known)
            raise click.UsageError(f"{called} needs {choices}", context)


def inputs() -> Inputs:
    """Return the inputs of the running command; where none runs, nothing is set but --quiet."""
    context = click.get_current_context(silent=True)
    if context is None:
        return Inputs({"quiet": True})
    found: Inputs = context.meta.get(INPUTS) or Inputs(context.params)
    return found
