"""Turn signals that end a run into exceptions, so that every `with` block cleans up."""

from __future__ import annotations

# the module `signal` makes enumerations of its numbers, which are 2 % of the start of `compose`
import _signal as signal  # type: ignore[import-not-found]
import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

# number -> name of the signals that the system has: Windows has no SIGHUP
ENDING = {getattr(signal, name): name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)}


class Terminated(BaseException):
    """Report a signal that ends the process; its name is the message."""


class _Signals:
    """The handler of signals, and the state that determines what it does.

    owns_process: the program is the whole process, not called by another program
    cleans_up: there is something to clean up, so an exception is raised even during an import
    writing: a block of lines is being written; interrupted: Ctrl-C was pressed meanwhile
    """

    owns_process = False
    cleans_up = False
    writing = False
    interrupted = False

    def end(self, number: int, frame: FrameType | None) -> None:
        """Raise the exception that ends the run; the first Ctrl-C is deferred while lines are being written."""
        name = ENDING[number]
        while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
            frame = frame.f_back
        if frame and not self.cleans_up and not self.writing:
            # an exception raised during an import may be printed there, and lost
            os._exit(130 if number == signal.SIGINT else end_by_signal(name))
        if number != signal.SIGINT:
            for each in ENDING:
                signal.signal(each, signal.SIG_IGN)  # `timeout` sends it twice: do not interrupt the cleanup
            raise Terminated(name)
        if self.interrupted or not self.writing:
            raise KeyboardInterrupt
        self.interrupted = True


STATE = _Signals()


def with_signals(run: Callable[[list[str]], int], arguments: list[str]) -> int:
    """Run the program with handlers for its signals; an ignored one, as SIGHUP under nohup, is left ignored."""
    STATE.owns_process = True
    caught = [each for each in ENDING if signal.getsignal(each) not in (signal.SIG_IGN, None)]
    try:
        for number in caught:
            signal.signal(number, STATE.end)
        return run(arguments)
    except Terminated as error:
        return end_by_signal(str(error))
    finally:
        for number in caught:
            signal.signal(number, signal.SIG_DFL)


def end_by_signal(name: str) -> int:
    """End the process by a signal, which the caller then sees; inside another program return its exit status."""
    number = getattr(signal, name, None)
    if number is None:  # SIGPIPE on Windows
        return 1
    if STATE.owns_process:
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    return 128 + int(number)  # as in a shell; also if the signal is blocked
