"""The command line: its table of commands, and the edge where whatever goes wrong becomes a line and an exit code.

Nothing is imported here that takes time: from the first moment on Ctrl-C ends the process without a traceback.

What Python and the system could not do, in words of ours.
"""

from __future__ import annotations

import gc
import os
import sys
from io import TextIOWrapper
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

# name -> (module, what it does); help, completion and the README's check are derived from this table
COMMANDS = {
    "convert": ("frametool.cli.commands.convert", "one rotation or pose in other representations"),
    "compose": ("frametool.cli.commands.compose", "product of poses, left to right: a_from_b, b_from_c -> a_from_c"),
    "invert": ("frametool.cli.commands.invert", "the inverse of a pose: a_from_b -> b_from_a"),
    "relative": ("frametool.cli.commands.relative", "the pose of B seen from A, with distance and angle"),
    "mean": ("frametool.cli.commands.mean", "the mean of poses or rows, and how far they lie from it"),
    "between": ("frametool.cli.commands.between", "the shortest rotation from one direction to another"),
    "interpolate": ("frametool.cli.commands.interpolate", "poses between A and B at fractions of the way"),
    "lookup": ("frametool.cli.commands.lookup", "where SOURCE is seen from TARGET in a tree of frames"),
    "apply": ("frametool.cli.commands.apply", "points, vectors and poses moved into another frame"),
    "fk": ("frametool.cli.commands.fk", "where TIP of a robot is seen from BASE, for rows of joint values"),
    "tree": ("frametool.cli.commands.tree", "the tree of frames, drawn or written in another form"),
    "view": ("frametool.cli.commands.view", "the frames seen: in the terminal, as a page that turns, as a picture"),
    "calc": ("frametool.cli.commands.calc", "expressions over poses whose frames are checked like units"),
    "echo": ("frametool.cli.commands.echo", "where SOURCE is seen from TARGET as a recording goes by"),
    "monitor": ("frametool.cli.commands.monitor", "rate, interval, gaps and jumps of each edge of a recording"),
    "static": ("frametool.cli.commands.static", "static_transform_publisher arguments, written and read"),
    "check": ("frametool.cli.commands.check", "what is wrong or odd in trees and recordings"),
    "diff": ("frametool.cli.commands.diff", "what differs between two trees, calibrations or recordings"),
    "batch": ("frametool.cli.commands.batch", "many commands, one a line, in one process"),
    "formats": ("frametool.cli.commands.formats", "the forms of files that are read and written, and what they mean"),
    "help": ("frametool.cli.commands.help", "a subject on one screen: pose, euler, axes, time, streams and more"),
    "sim": ("frametool.cli.commands.sim", "turtlesim and its followers, without ROS and without a screen"),
}
IN_OUT, INTERRUPTED = 5, 130  # exit codes
COLLECTED_EVERY = (50_000, 20, 100)  # objects, and rounds of them: a tree is no garbage, and walking it takes longest
TROUBLE = {"diff": 2}  # command -> its one exit code for whatever goes wrong, as that of diff(1)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line as a program of its own and exit with its status."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads that nothing here uses cost memory
    gc.set_threshold(*COLLECTED_EVERY)
    try:
        from frametool.cli.signals import with_signals

        status = with_signals(run, sys.argv[1:] if arguments is None else list(arguments))
    except KeyboardInterrupt:
        status = INTERRUPTED
    sys.exit(status)


def run(arguments: list[str]) -> int:
    """Run one command; whatever goes wrong becomes one line on stderr and an exit code."""
    from frametool.cli.signals import die_of
    from frametool.cli.stderr import discard, say, say_warning
    from frametool.documents.source import DEEPEST
    from frametool.errors import heard_by

    in_out = TROUBLE.get(arguments[0] if arguments else "", IN_OUT)
    if sys.stdout is None:
        say("standard output is closed")
        return in_out
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.encoding.lower() != "utf-8":
        sys.stdout.reconfigure(encoding="utf-8")  # the same bytes in every locale
    sys.setrecursionlimit(max(sys.getrecursionlimit(), 20 * DEEPEST))  # a document may be so deep, a walk some calls
    status = 0
    try:
        with heard_by(say_warning):
            status = _run(arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        from signal import SIGPIPE

        status = die_of(SIGPIPE)  # as `cat` does when its reader is gone
    except TROUBLES as error:
        if status != in_out or not isinstance(error, OSError):  # else it was told, and the buffer fails again
            say(words_of(error))
        if isinstance(error, OSError):
            discard(sys.stdout)
        status = in_out
    return status


def _run(arguments: list[str]) -> int:
    """Run one command; closed pipes and other trouble with stdout are the caller's."""
    from frametool.cli.group import answered, called
    from frametool.cli.stderr import say_error, wants_json
    from frametool.errors import FrametoolError

    try:
        return answered(lambda: called(arguments), arguments)
    except KeyboardInterrupt:
        return INTERRUPTED
    except FrametoolError as error:
        say_error(error, in_json=wants_json(arguments))
        return TROUBLE.get(arguments[0] if arguments else "", error.exit_code)


TROUBLES = (MemoryError, ImportError, OSError)


def words_of(trouble: Exception) -> str:
    """Say what Python or the system could not do."""
    if isinstance(trouble, MemoryError):
        return "out of memory"
    if isinstance(trouble, ImportError):  # numpy's tells of missing memory and files in many lines, the cause last
        return f"a library cannot be loaded: {str(trouble).strip().splitlines()[-1]}"
    return (getattr(trouble, "strerror", None) or str(trouble)).lower()
