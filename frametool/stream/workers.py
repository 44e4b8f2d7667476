"""Blocks over several processes: dealt out in turn, so that what becomes of them comes back in order.

Each worker has a socket of its own.  A worker that dies shuts it, which its parent notices; a parent that dies shuts
them all, which ends its workers even in the middle of a block.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from contextlib import closing
from multiprocessing import get_context
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, NamedTuple

from frametool.errors import FrametoolError, FrametoolWarning, heard_by, warn

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from multiprocessing.connection import Connection

    from frametool.stream.run import Outcome

    Process = Callable[[bytes], Outcome]

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
MOST_WAITING = 2  # blocks a worker may have ahead: memory stays flat


class WorkerDied(FrametoolError):
    """Report a process that ended before its work was done: killed, or out of memory."""

    exit_code = 5


class Reply(NamedTuple):
    """What a worker sends back for a block: its outcome, or what was raised instead, and the warnings."""

    outcome: Outcome | None
    error: BaseException | None
    warned: list[tuple[str, str, type[FrametoolWarning]]]


def spread(process: Process, blocks: Iterable[bytes], jobs: int) -> Generator[Outcome]:
    """Deal blocks out to forked processes, and yield what becomes of them in order; a warning is passed on once."""
    with closing(Team(process, jobs)) as team:
        for block in blocks:
            if team.is_busy:
                yield team.next_outcome()
            team.deal(block)
        while team.dealt:
            yield team.next_outcome()


class Team:
    """Workers that are started as blocks come, up to a number of them."""

    def __init__(self, process: Process, jobs: int) -> None:
        """Start none yet."""
        self.process = process
        self.jobs = jobs
        self.workers: list[Worker] = []
        self.dealt: deque[Worker] = deque()  # who has the blocks that are out, in their order
        self._count = 0
        self._warned: set[str] = set()

    @property
    def is_busy(self) -> bool:
        """Tell whether all workers have as many blocks as they may."""
        return len(self.dealt) >= MOST_WAITING * self.jobs

    def deal(self, block: bytes) -> None:
        """Send a block to the worker whose turn it is."""
        turn = self._count % self.jobs
        if turn == len(self.workers):
            self.workers.append(Worker(self.process, [each.connection for each in self.workers]))
        self.workers[turn].send(block)
        self.dealt.append(self.workers[turn])
        self._count += 1

    def next_outcome(self) -> Outcome:
        """Return what became of the oldest block that is out; raises what its worker raised."""
        answer = self.dealt.popleft().receive()
        for message, rule, kind in answer.warned:
            if message not in self._warned:
                self._warned.add(message)
                warn(message, rule=rule, kind=kind)
        if answer.outcome is None:
            raise answer.error or AssertionError
        return answer.outcome

    def close(self) -> None:
        """End all workers, whatever they are doing."""
        for worker in self.workers:
            worker.end()


class Worker:
    """A forked process and the socket to it."""

    def __init__(self, process: Process, others: list[Connection]) -> None:
        """Start it; `others` are sockets of its parent which it must not keep open."""
        context = get_context("fork")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(process, theirs, [*others, self.connection]), daemon=True)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # no handler of the parent's may run in the worker
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def send(self, block: bytes) -> None:
        """Send a block; the worker's receiver takes it at once."""
        try:
            self.connection.send_bytes(block)
        except OSError:
            raise self._died() from None

    def receive(self) -> Reply:
        """Wait for the answer to the oldest block."""
        try:
            answer: Reply = self.connection.recv()
        except (EOFError, OSError):
            raise self._died() from None
        return answer

    def end(self) -> None:
        """Kill it; it holds nothing that would have to be saved."""
        self.process.kill()
        self.process.join()
        self.connection.close()

    def _died(self) -> WorkerDied:
        self.process.join(1.0)
        status = self.process.exitcode or 0
        how = f"died of {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        return WorkerDied(f"a process of --jobs {how}; the result is not complete")


def _work(process: Process, connection: Connection, others: list[Connection]) -> None:
    """Reply blocks until the parent is gone, which also ends a block that is being worked on."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears it too, and ends its workers
    for number in ENDING[1:]:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    for other in others:
        other.close()
    blocks: SimpleQueue[bytes] = SimpleQueue()

    def receive() -> None:
        try:
            while True:
                blocks.put(connection.recv_bytes())
        except (EOFError, OSError):
            os._exit(0)

    try:
        Thread(target=receive, daemon=True).start()
        while True:
            connection.send(_answer(process, blocks.get()))
    finally:
        os._exit(1)  # the parent is gone, or there is no memory: it notices, and nobody else has to be told


def _answer(process: Process, block: bytes) -> Reply:
    warned: list[tuple[str, str, type[FrametoolWarning]]] = []
    try:
        with heard_by(lambda *warning: warned.append(warning)):
            return Reply(process(block), None, warned)
    except Exception as error:  # noqa: BLE001 - raised again by the parent
        return Reply(None, error, warned)
