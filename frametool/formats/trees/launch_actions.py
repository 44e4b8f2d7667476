"""The actions of a launch file in any language: calls of the publisher, and messages about the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import shown
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Sequence

PACKAGES = ("tf", "tf2_ros")
COMPOSABLE = "tf2_ros::StaticTransformBroadcasterNode"


class Action(NamedTuple):
    """One item of a launch file that is read or reported.

    arguments: of a call, as one text for a shell or as words
    unread: why there is nothing to read; "" if there is
    conditions: under which it starts, as written
    key: the attribute with the arguments
    """

    arguments: str | Sequence[str] = ()
    unread: str = ""
    conditions: Sequence[str] = ()
    key: str = ""
    line: int = 0
    column: int = 0

    @classmethod
    def not_read(cls, why: str, key: str = "") -> Action:
        """Return the action for a call that cannot be read."""
        return cls(unread=f"{CALL} not read: {why}", key=key)

    @classmethod
    def not_followed(cls, what: str, named: object) -> Action:
        """Return the action for an included file."""
        return cls(unread=f"{what} {shown(named)} is not followed; read that file too: --with FILE")


COMPOSED = Action.not_read("it is a composable node, whose transform is in its parameters")


def runs_publisher(words: Sequence[str]) -> bool:
    """Return True if a command line starts the publisher."""
    return any(word.rsplit("/", 1)[-1] == CALL for word in words)
