"""Signals that end a run: one handler turns them into exceptions, so that every `with` cleans up behind itself."""

from __future__ import annotations

import os
import signal

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

# those that the system has: Windows knows no SIGHUP
ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Terminated(BaseException):
    """Report the signal that asks the process to end; its name is the message."""


class _Signals:
    """Whether the process is ours, a line is being written, and Ctrl-C came meanwhile.

    cleans_up: there is what to clean up: what ends the run is raised, in the middle of an import too
    """

    owns_process = False
    cleans_up = False
    writing = False
    interrupted = False

    def end(self, number: int, frame: FrameType | None) -> None:
        """Raise what ends the run; the first Ctrl-C waits until the line that is being written is out."""
        name = signal.Signals(number).name
        while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
            frame = frame.f_back
        if frame and not self.cleans_up and not self.writing:
            # what is raised in the middle of an import may be printed there, and lost
            os._exit(130 if number == signal.SIGINT else die_of(name))
        if number != signal.SIGINT:
            for each in ENDING:
                signal.signal(each, signal.SIG_IGN)  # `timeout` sends it twice: nothing cuts the cleaning short
            raise Terminated(name)
        if self.interrupted or not self.writing:
            raise KeyboardInterrupt
        self.interrupted = True


STATE = _Signals()


def with_signals(run: Callable[[list[str]], int], arguments: list[str]) -> int:
    """Run the program with its signals taken over; one that is ignored, as SIGHUP under nohup, stays ignored."""
    STATE.owns_process = True
    caught = [each for each in ENDING if signal.getsignal(each) not in (signal.SIG_IGN, None)]
    try:
        for number in caught:
            signal.signal(number, STATE.end)
        return run(arguments)
    except Terminated as error:
        return die_of(str(error))
    finally:
        for number in caught:
            signal.signal(number, signal.SIG_DFL)


def die_of(name: str) -> int:
    """End as a program that does not catch the signal, so that the caller sees it; within another program return."""
    number = getattr(signal, name, None)
    if number is None:  # SIGPIPE on Windows
        return 1
    if STATE.owns_process:
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    return 128 + int(number)  # where the signal is blocked: what a shell would say
