"""`--explain`: the derivation with this run's numbers in place of the result."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.options import FULL, together
from frametool.errors import FormatError, heard_by

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeVar

    from frametool.cli.output import Output
    from frametool.cli.streaming import Stream
    from frametool.documents.source import Source
    from frametool.explain.derive import DerivationStyle
    from frametool.explain.given import Given
    from frametool.explain.render import Explanation
    from frametool.geometry.representations import Notation

    Function = TypeVar("Function", bound=Callable[..., Any])

FORMS = ("text", "markdown", "latex")
ONE_RECORD = "--explain derives one record; write it as an argument"
EXPLAIN = click.option(
    "--explain", type=click.Choice(FORMS), metavar="[=FORM]", help="derive the result step by step (help explain)",
)  # fmt: skip


def explain_options(function: Function) -> Function:
    """Add to a command the options of derivations; `Explaining` takes them."""
    every = click.option("--explain-full", is_flag=True, help="that with all products of long chains")
    return together(EXPLAIN, every)(function)


class Explaining:
    """Whether a derivation is wanted, and in which form; true if one is."""

    def __init__(self, options: dict[str, Any]) -> None:
        """Take the options out of a command's; `--explain-full` alone wants text."""
        self.every: bool = options.pop("explain_full")
        self.form: str = options.pop("explain") or ("text" if self.every else "")
        self._precision: int | None = options.get("precision")

    def __bool__(self) -> bool:
        """Return whether a derivation is wanted."""
        return bool(self.form)

    def plan(self, output: Output, stream: Stream | None = None) -> DerivationStyle:
        """Return how to derive; refuse what a derivation cannot be: a machine format, a stream."""
        from frametool.explain.derive import DerivationStyle

        if output.told not in (None, "text"):
            raise click.UsageError(f"--explain writes {', '.join(FORMS)}, not {output.told}; leave one of them out")
        if stream is not None and stream.path is not None:
            raise click.UsageError(f"-i FILE is a stream; {ONE_RECORD}")
        return DerivationStyle(output.style, significant(self._precision), self.every)

    def write(self, explanation: Explanation, output: Output) -> int:
        """Write a derivation where the result would go."""
        output.text(explanation.render(self.form))
        return 0


def significant(precision: int | None) -> int | None:
    """Return how many significant digits --precision asks for; None for all."""
    from frametool.explain.sheet import DIGITS

    if precision == 0:
        raise click.UsageError("--precision counts significant digits with --explain; give 1 or more, or full")
    return DIGITS if precision is None else None if precision == FULL else precision


def one_argument(argument: str | Source | None) -> str | Source:
    """Return an argument that holds a record; standard input is a stream."""
    if argument in (None, "-"):
        raise click.UsageError(f"standard input is a stream; {ONE_RECORD}")
    return argument or ""


def given(
    argument: str | Source | None, notation: Notation | None = None, *, degrees: bool, normalize: bool,
    warned: bool = False,
) -> Given:  # fmt: skip
    """Read the one pose of an argument as it is written.

    notation: of numbers that do not say theirs.  warned: its warnings are on stderr already.
    """
    from frametool.cli.poses import pose_source, usage_if_inline
    from frametool.explain.given import given_poses

    try:
        source = pose_source(one_argument(argument), notation, normalize=normalize)
        with heard_by(lambda *_: None) if warned else nullcontext():
            found = given_poses(source, degrees=degrees, normalize=normalize)
    except FormatError as error:
        raise usage_if_inline(error) from None
    if len(found) != 1:
        raise click.UsageError(f"--explain derives one pose, {source.name} holds {len(found)}")
    return found[0]


def all_given(
    arguments: Sequence[str], notation: Notation | None = None, *, degrees: bool, normalize: bool
) -> list[Given]:
    """Read one pose from each argument, as they are written."""
    return [given(each, notation, degrees=degrees, normalize=normalize) for each in arguments]
