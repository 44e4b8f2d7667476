"""Where a stream's bytes go: standard output, whole lines at a time, or a file that is there whole or not at all."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from frametool.errors import FileProblem

if TYPE_CHECKING:
    from types import FrameType, TracebackType
    from typing import BinaryIO, Self


def die_of_closed_pipe() -> None:
    """End as `cat` does when its reader is gone: killed by SIGPIPE, without a word."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still buffered must not raise again
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGPIPE)


def is_special(path: str) -> bool:
    """Tell whether a path is there and no plain file: a device, a pipe, a link such as /dev/stdout."""
    return os.path.lexists(path) and (os.path.islink(path) or not os.path.isfile(path))


class Sink:
    """Take blocks of whole lines; Ctrl-C waits until a block is out, so that no line is cut."""

    def __init__(self, path: str | None, *, force: bool = False) -> None:
        """Write to a temporary file beside `path`, or to standard output; raises FileProblem if the file exists."""
        self.path = path
        self._owner = os.getpid()
        self._part = f"{path}.{os.getpid()}.part"
        self._in_place = path is not None and is_special(path)
        self._writing = self._interrupted = False
        self._stream = self._opened(force=force) if path else sys.stdout.buffer

    def _opened(self, *, force: bool) -> BinaryIO:
        if not force and os.path.isfile(str(self.path)):
            raise FileProblem(f"{self.path}: exists; give --force to replace it")
        if self._in_place:
            return self._to_special()
        try:
            return open(self._part, "xb")
        except OSError as error:
            raise self._problem(error) from None

    def _to_special(self) -> BinaryIO:
        """Open what is no plain file as it is: a device must not be replaced by one."""
        try:
            return open(str(self.path), "wb")
        except OSError as error:
            raise self._problem(error) from None

    def __enter__(self) -> Self:
        """Take over Ctrl-C, and with a temporary file the signals that would leave it behind."""
        self._before = {signal.SIGINT: signal.signal(signal.SIGINT, self._interrupt)}
        for number in (signal.SIGTERM, signal.SIGHUP):
            if self.path and not self._in_place and signal.getsignal(number) is signal.SIG_DFL:
                self._before[number] = signal.signal(number, self._give_up)
        return self

    def write(self, block: bytes) -> None:
        """Write whole lines at once."""
        self._writing = True
        try:
            self._stream.write(block)
            self._stream.flush()
        except OSError as error:
            if self.path:
                raise self._problem(error) from None
            if not isinstance(error, BrokenPipeError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still buffered is lost anyway
                raise FileProblem(f"standard output: {(error.strerror or str(error)).lower()}") from None
            raise
        finally:
            self._writing = False
        if self._interrupted:
            raise KeyboardInterrupt

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        if not self._writing or self._interrupted:
            raise KeyboardInterrupt
        self._interrupted = True

    def _give_up(self, number: int, _frame: FrameType | None) -> None:
        """Take the temporary file away, and die of the signal; the processes of --jobs only die."""
        if os.getpid() == self._owner:
            os.unlink(self._part)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def __exit__(
        self, kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Put the file in its place if all went well, else leave nothing."""
        for number, before in self._before.items():
            signal.signal(number, before)
        if not self.path:
            return
        with suppress(OSError):  # each block was flushed: what fails again was told
            self._stream.close()
        if self._in_place:
            return
        if kind is None:
            os.replace(self._part, self.path)
        else:
            os.unlink(self._part)

    def _problem(self, error: OSError) -> FileProblem:
        return FileProblem(f"{self.path}: {(error.strerror or str(error)).lower()}")
