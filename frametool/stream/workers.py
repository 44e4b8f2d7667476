"""Blocks over several processes: dealt out to whoever is free, their results in the order of the blocks.

A block goes to a worker through memory that both share, and what becomes of it comes back in the same place; a socket
for each worker carries the word that it is there.  A worker that dies shuts its socket, which its parent notices; a
parent that dies shuts them all, which ends its workers even in the middle of a block.

Workers are forked: what they do with a block holds functions and open trees that cannot be sent.  That is safe here
on Linux and macOS alike, as no other thread computes anything and no library that minds being forked is called; where
a system cannot fork, `can_spread` says so.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from contextlib import closing
from mmap import mmap
from multiprocessing import connection, get_context
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, NamedTuple

from frametool import sizes
from frametool.errors import FrametoolError, FrametoolWarning, heard_by, warn
from frametool.text.lines import BULK_BYTES, ByteRange

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from multiprocessing.connection import Connection

    from frametool.stream.run import Outcome

    Process = Callable[[bytes], Outcome]

ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
MOST_WAITING = 2  # blocks a worker may have ahead, so that it never waits for its parent
PLACES = 3  # for blocks, a worker: those ahead and one whose result waits for its turn; memory stays flat


class WorkerDied(FrametoolError):
    """Report a process that ended before its work was done: killed, or out of memory."""

    exit_code = 5


class Parcel(NamedTuple):
    """A block or a text on its way: in a shared place, where it is not too large for one."""

    place: int
    size: int
    whole: bytes | None = None


class Task(NamedTuple):
    """What a worker is to do: a block, or where it stands in a file, and the place for what becomes of it."""

    place: int
    block: Parcel | ByteRange


class Reply(NamedTuple):
    """What a worker sends back for a block: its outcome, or what was raised instead, and the warnings."""

    text: Parcel | None
    outcome: Outcome | None
    error: BaseException | None
    warned: list[tuple[str, str, type[FrametoolWarning]]]


class Places:
    """Memory that is shared with the processes forked later, in places of one size."""

    def __init__(self, count: int) -> None:
        """Reserve it; raises OSError where there is not so much."""
        self.size = 4 * sizes.BLOCK  # no more of it is used than is written; what is larger goes by the socket
        self._memory = mmap(-1, count * self.size)
        self.free = list(range(count))

    def put(self, place: int, text: bytes) -> Parcel:
        """Put a text in a place if it fits."""
        if len(text) > self.size:
            return Parcel(place, len(text), text)
        start = place * self.size
        self._memory[start : start + len(text)] = text
        return Parcel(place, len(text))

    def look(self, parcel: Parcel) -> bytes | memoryview:
        """Return a text as it stands there, until the place is free for others."""
        if parcel.whole is not None:
            return parcel.whole
        start = parcel.place * self.size
        return memoryview(self._memory)[start : start + parcel.size]


class Dealt:
    """A block that is out: who has it, its place, and the answer once it has come."""

    __slots__ = ("place", "reply", "worker")

    def __init__(self, worker: Worker, place: int) -> None:
        """Begin without an answer."""
        self.worker = worker
        self.place = place
        self.reply: Reply | None = None


def can_spread() -> bool:
    """Tell whether the system can fork processes."""
    return hasattr(os, "fork")


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def spread(process: Process, blocks: Iterable[bytes | ByteRange], jobs: int) -> Generator[Outcome]:
    """Deal blocks out to forked processes, and yield what becomes of them in order; a warning is passed on once.

    The text of an outcome is good until the next one is asked for.  What ends the blocks, or a worker's work on one,
    is raised after what became of those before.
    """
    with closing(Team(process, jobs)) as team:
        yield from team.outcomes(blocks)


class Team:
    """Workers that are started as blocks come, up to a number of them."""

    def __init__(self, process: Process, jobs: int) -> None:
        """Start none yet."""
        self.process = process
        self.jobs = jobs
        self.places = Places(PLACES * jobs)
        self.workers: list[Worker] = []
        self.dealt: deque[Dealt] = deque()  # in the order of the blocks
        self._warned: set[str] = set()

    def outcomes(self, blocks: Iterable[bytes | ByteRange]) -> Iterator[Outcome]:
        """Yield what becomes of blocks; of one so small that it was typed at once."""
        failure: list[Exception] = []
        for block in _until_failure(blocks, failure):
            while not self._has_room():
                if self.places.free and self.dealt[0].reply is None:
                    self._hear()
                else:
                    yield from self._oldest()
            self._deal(block)
            while self.dealt and not isinstance(block, ByteRange) and len(block) < BULK_BYTES:
                yield from self._oldest()
        while self.dealt:
            yield from self._oldest()
        if failure:
            raise failure[0]

    def _has_room(self) -> bool:
        """Tell whether there is a place for a block, and a worker that may take it."""
        free = len(self.workers) < self.jobs or any(worker.is_free for worker in self.workers)
        return bool(self.places.free) and free

    def _deal(self, block: bytes | ByteRange) -> None:
        """Send a block to the worker that has the fewest."""
        worker = min(self.workers, key=lambda each: len(each.has), default=None)
        if worker is None or (worker.has and len(self.workers) < self.jobs):
            worker = Worker(self.process, self.places, [each.connection for each in self.workers])
            self.workers.append(worker)
        dealt = Dealt(worker, self.places.free.pop())
        worker.send(Task(dealt.place, block if isinstance(block, ByteRange) else self.places.put(dealt.place, block)))
        worker.has.append(dealt)
        self.dealt.append(dealt)

    def _hear(self) -> None:
        """Wait for an answer, and take all that have come."""
        busy = {worker.connection: worker for worker in self.workers if worker.has}
        for each in connection.wait(list(busy)):
            worker = busy[each]  # type: ignore[index]
            worker.has.popleft().reply = worker.receive()

    def _oldest(self) -> Iterator[Outcome]:
        """Yield what became of the oldest block that is out, and free its place then; raises what its worker raised."""
        while (answer := self.dealt[0].reply) is None:
            self._hear()
        place = self.dealt.popleft().place
        for message, rule, kind in answer.warned:
            if message not in self._warned:
                self._warned.add(message)
                warn(message, rule=rule, kind=kind)
        if answer.outcome is None or answer.text is None:
            raise answer.error or AssertionError
        yield answer.outcome._replace(text=self.places.look(answer.text))
        self.places.free.append(place)

    def close(self) -> None:
        """End all workers, whatever they are doing."""
        for worker in self.workers:
            worker.end()


class Worker:
    """A forked process and the socket to it; `has` are the blocks it has not answered, oldest first."""

    def __init__(self, process: Process, places: Places, others: list[Connection]) -> None:
        """Start it; `others` are sockets of its parent which it must not keep open."""
        context = get_context("fork")
        self.has: deque[Dealt] = deque()
        self.connection, theirs = context.Pipe()
        arguments = (process, places, theirs, [*others, self.connection])
        self.process = context.Process(target=_work, args=arguments, daemon=True)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # no handler of the parent's may run in the worker
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    @property
    def is_free(self) -> bool:
        """Tell whether it may take another block."""
        return len(self.has) < MOST_WAITING

    def send(self, task: Task) -> None:
        """Send a task; the worker's receiver takes it at once."""
        try:
            self.connection.send(task)
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


def _until_failure(blocks: Iterable[bytes | ByteRange], failure: list[Exception]) -> Iterator[bytes | ByteRange]:
    """Yield blocks; keep what ends them if that is an error."""
    try:
        yield from blocks
    except Exception as error:  # noqa: BLE001 - raised again behind what becomes of the blocks
        failure.append(error)


def _work(process: Process, places: Places, socket: Connection, others: list[Connection]) -> None:
    """Reply blocks until the parent is gone, which also ends a block that is being worked on."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears it too, and ends its workers
    for number in ENDING[1:]:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    for other in others:
        other.close()
    tasks: SimpleQueue[Task] = SimpleQueue()

    def receive() -> None:
        try:
            while True:
                tasks.put(socket.recv())
        except (EOFError, OSError):
            os._exit(0)

    try:
        Thread(target=receive, daemon=True).start()
        while True:
            socket.send(_answer(process, places, tasks.get()))
    finally:
        os._exit(1)  # the parent is gone, or there is no memory: it notices, and nobody else has to be told


def _answer(process: Process, places: Places, task: Task) -> Reply:
    """Process a block and put its text where the block was."""
    warned: list[tuple[str, str, type[FrametoolWarning]]] = []
    try:
        with heard_by(lambda *warning: warned.append(warning)):
            block = task.block
            outcome = process(block.read() if isinstance(block, ByteRange) else bytes(places.look(block)))
        text = places.put(task.place, bytes(outcome.text))
        return Reply(text, outcome._replace(text=b""), None, warned)
    except Exception as error:  # noqa: BLE001 - raised again by the parent
        return Reply(None, None, error, warned)
