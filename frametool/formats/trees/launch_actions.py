"""What the readers of launch files have in common: a call of the publisher, and which texts are literal."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import shown
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Sequence

PACKAGES = frozenset(("tf", "tf2_ros"))
COMPOSABLE = "tf2_ros::StaticTransformBroadcasterNode"
IN_PARAMETERS = "it is a composable node, whose transform stands in its parameters"
_SUBSTITUTION = re.compile(r"\$\([^()]*\)?")
_NO, _YES = ("0", "false"), ("1", "true")


class Action(NamedTuple):
    """One thing in a launch file that is told or read.

    arguments: of a call, as one text that a shell would part or as words
    unread: why there is nothing to read; "" if there is
    conditions: under which it starts, as they are written
    """

    line: int
    column: int = 0
    arguments: str | Sequence[str] = ()
    unread: str = ""
    conditions: tuple[str, ...] = ()

    @property
    def is_call(self) -> bool:
        """Tell whether this is a call of the publisher."""
        return self.unread.startswith(CALL)


def not_read(why: str, line: int, column: int = 0) -> Action:
    """Make the action for a call that cannot be read."""
    return Action(line, column, unread=f"{CALL} not read: {why}")


def not_followed(what: str, named: object, line: int) -> Action:
    """Make the action for a file that is included."""
    return Action(line, unread=f"{what} {shown(named)} is not followed; read that file too: --with FILE")


def call(arguments: str, line: int, column: int, conditions: Sequence[str]) -> Action:
    """Make the action for a call whose arguments are one text, which may have substitutions."""
    if found := _SUBSTITUTION.search(arguments):
        return not_read(f"its arguments have {shown(found[0])}", line, column)
    if off := next((each for each in conditions if is_off(each)), ""):
        return not_read(f"it never starts ({off})", line, column)
    return Action(line, column, arguments, conditions=tuple(each for each in conditions if not _is_literal(each)))


def condition(keys: dict[str, str]) -> list[str]:
    """Return what the attributes `if` and `unless` say, as text."""
    return [f'{key}="{keys[key]}"' for key in ("if", "unless") if key in keys]


def _is_literal(text: str) -> bool:
    return text.split('"')[1].lower() in (*_NO, *_YES)


def is_off(text: str) -> bool:
    """Tell whether a condition is literal and never holds."""
    key, value = text.split('="', 1)
    return value[:-1].lower() in (_NO if key == "if" else _YES)


def runs_publisher(words: Sequence[str]) -> bool:
    """Tell whether a command line starts the publisher."""
    return any(word.rsplit("/", 1)[-1] == CALL for word in words)
