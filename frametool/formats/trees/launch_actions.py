"""What a launch file in any language comes down to: calls of the publisher, and what is said of all else."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import shown
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Sequence

PACKAGES = ("tf", "tf2_ros")
COMPOSABLE = "tf2_ros::StaticTransformBroadcasterNode"


class Action(NamedTuple):
    """One thing in a launch file that is told or read.

    arguments: of a call, as one text that a shell would part or as words
    unread: why there is nothing to read; "" if there is
    conditions: under which it starts, as they are written
    key: the attribute that holds the arguments
    """

    arguments: str | Sequence[str] = ()
    unread: str = ""
    conditions: Sequence[str] = ()
    key: str = ""
    line: int = 0
    column: int = 0


def not_read(why: str) -> Action:
    """Make the action for a call that cannot be read."""
    return Action(unread=f"{CALL} not read: {why}")


def not_followed(what: str, named: object) -> Action:
    """Make the action for a file that is included."""
    return Action(unread=f"{what} {shown(named)} is not followed; read that file too: --with FILE")


def composed() -> Action:
    """Make the action for a node that publishes without a call."""
    return not_read("it is a composable node, whose transform stands in its parameters")


def runs_publisher(words: Sequence[str]) -> bool:
    """Tell whether a command line starts the publisher."""
    return any(word.rsplit("/", 1)[-1] == CALL for word in words)
