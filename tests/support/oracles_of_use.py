"""What must hold however the tool is used; the parts of a fuzz that all its tests share.

A campaign: `FUZZ=20000 pytest -m fuzz`. The number of cases a test tries follows FUZZ; each case has a seed of its own,
so that one that fails is tried again with `FUZZ_SEED=<seed> FUZZ=1`.
"""

from __future__ import annotations

import io
import json
import os
import random
import signal
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from frametool import cli
from frametool.cli.commands.batch import reader, streams, writer

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

CASES = int(os.environ.get("FUZZ", "300"))
FIRST = int(os.environ.get("FUZZ_SEED", "0"))
CODES = {0, 1, 2, 3, 4, 5}
WORK = 20.0  # seconds of processor time: far more than any case needs, so that only what never ends is found
MOST_OUTPUT = 1 << 25  # bytes


class NeverEnds(BaseException):
    """Report a case that works on and on."""


class TooMuch(BaseException):
    """Report a case that writes more than anyone asked for."""


class Ending(NamedTuple):
    """What a run left behind."""

    status: int
    out: bytes
    err: str


class _Out(io.BytesIO):
    def write(self, data: object) -> int:
        if self.tell() > MOST_OUTPUT:
            raise TooMuch
        return super().write(data)  # type: ignore[arg-type]


class Tool:
    """The command line in this process, with the oracles that hold for every use of it."""

    def __call__(self, *arguments: str, stdin: bytes = b"") -> Ending:
        """Run a command and check what must hold of every run."""
        out, err = _Out(), io.BytesIO()
        try:
            with _limited_work(), streams(reader(io.BytesIO(stdin)), writer(out), writer(err, "backslashreplace")):
                status = cli.run(list(arguments))
        except BaseException as error:
            error.add_note(f"FUZZ_SEED={last[0]} FUZZ=1: frametool {arguments}")
            raise
        ending = Ending(status, out.getvalue(), err.getvalue().decode())
        check(arguments, ending)
        return ending


def check(arguments: tuple[str, ...], ending: Ending) -> None:
    """Check the contract of every run: exit code, what is said, no raw control character, strict JSON."""
    assert ending.status in CODES, ending.status
    assert ending.err.replace("\n", "").replace("\t", "").isprintable(), ending.err
    assert "Traceback" not in ending.err
    assert ending.status == 0 or ending.err or arguments[:1] == ("diff",), "an error without a word"
    for line in ending.err.splitlines():
        assert len(line) < 2000 or "file name too long" in line, f"quotes without end: {line[:300]}"
    if ending.status == 0 and {"-f", "json"} <= set(arguments):
        for line in ending.out.decode().splitlines():
            json.loads(line, parse_constant=_no_number)


def some(values: list[str], seed: str) -> list[str]:
    """Choose a tenth as many of the values as there are cases: all of them in a long campaign."""
    return random.Random(f"{FIRST} {seed}").sample(values, min(len(values), CASES // 10 + 1))  # noqa: S311 - a seed


def _no_number(text: str) -> None:
    raise AssertionError(f"{text} is not JSON")


@contextmanager
def _limited_work() -> Iterator[None]:
    def give_up(_number: int, _frame: FrameType | None) -> None:
        raise NeverEnds

    before = signal.signal(signal.SIGPROF, give_up)
    signal.setitimer(signal.ITIMER_PROF, WORK)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def cases(share: float = 1.0) -> Iterator[random.Random]:
    """Yield one generator a case; a test that is slow takes a smaller share."""
    for seed in range(FIRST, FIRST + max(1, round(CASES * share))):
        last.append(seed)
        yield random.Random(seed)  # noqa: S311 - a seed


last: deque[int] = deque([FIRST], maxlen=1)  # the seed of the case that runs, for the report of one that fails

HOSTILE = [
    "", " ", "-", "--", ".", "0", "-0", "-0.0", "1", "-1", "00", "1.", ".5", "1e3", "1e-320", "1e308", "-1e308", "1e400", "-1e400",
    "1e-400", "nan", "-nan", "NaN", "inf", "-inf", "Infinity", "infinity", "9" * 20, "9" * 400, "-" + "9" * 30, "1" + "0" * 5000, "0x10", "0o10",
    "1_000", "1,5", "1;2", "½", "٣", "\N{FULLWIDTH DIGIT ONE}", "1e", "e1", "+1", "+-1", "--1", "1 2", "1:2", "1:2:3", "0:1:0", "0:1:1e-9",
    "0:1e9:1", "a:b:c", "::", "1ns", "-1ns", "1.5ns", "9" * 30 + "ns", "latest", "now", "pi", "-pi/2", "1/0", "pi/0", "1e400deg", "90deg", "1rad",
    "null", "~", "true", "yes", "[]", "{}", "[1]", "{a: 1}", "[1, 2, 3]", '{"xyz": [1, 2, 3]}', "{xyz: [nan, 0, 0]}", "{xyz: [1e400, 0, 0]}",
    "{rpy: [0, 0, 90]}", "{quaternion: {x: 0, y: 0, z: 0, w: 0}}", '"', "'", "\\", "#", "%", "&a", "*a", "!t", "|", ">", "@", "`", "\x1b[31m", "\x00",
    "\x7f", "\x9b", "\u2028", "\u202e", "\ufeff", "\ufffd", "\U0001f422", "é" * 300, "a" * 3000, "(" * 500, "[" * 500, "{" * 500, "\t", "\n", "\r\n",
]  # fmt: skip
