"""What went in this release, and what to use instead."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from frametool.cli.command import OPTIONAL

if TYPE_CHECKING:
    from collections.abc import Sequence

# an option, alone or behind its command, an option with a value, or a subcommand -> what to use instead
REPLACED = {
    "--jobs": "split the input, `split -n l/8 ROWS part. && ls part.* | xargs -P 8 -I{} frametool .. -i {} -o {}.out`",
    "sim sweep": 'a loop in Python over `frametool.simulate(..)` of `FollowController("ros1", gain_linear=2)`',
    "view --live": "the page plays what moves, `frametool view TREE --open`",
    "--explain=latex": "--explain=markdown has the formulas as LaTeX; pandoc makes a document of it",
    "view --sliders": "a robot's page has its sliders; --no-sliders leaves them out",
    "compare --end": "--stop says the same",
    "align --end": "--stop says the same",
    "--tf2": "numbers are tf2's anyway; --cache 10 keeps as much as its buffer, --moving reads one stamp as it does",
    "--explain-full": "--explain writes every product",
    "--array": 'NPZ is not read; one NPY for each array, `numpy.save("NEW.npy", numpy.load("OLD.npz")["NAME"])`',
    **{f"{name} {value}": f"{name}={value}" for name, values in OPTIONAL.items() for value in values},
}


def replacement(arguments: Sequence[str]) -> str | None:
    """Return the sentence on the first word of a command line that went; None where all are in use."""
    for before, word in pairwise(("", *arguments)):
        option = word.partition("=")[0]
        for name in (option, word, f"{before} {word}", f"{arguments[0]} {option}"):
            if name in REPLACED:
                return f"{name} is gone: {REPLACED[name]}"
    return None
