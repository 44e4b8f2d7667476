"""Write results to standard output, whole lines at a time, or atomically to a file or a folder.

On a terminal, text for people has styles, and is paged if it is longer than the screen.
Messages go to stderr, only by `say` and `write_lines`, which never fail; errors are sentences or JSON.
"""

from __future__ import annotations

import os
import re
import stat
import sys
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, BinaryIO, TextIO

import click

from frametool.cli.signals import STATE
from frametool.errors import FileProblem, FrametoolError, ValueInvalid, printable, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    Write = Callable[[str | bytes | memoryview], None]

CHECKS: list[Callable[[], None]] = []  # called before anything is written; each may raise a usage error
BAG_FILE, BAG_DATA = "metadata.yaml", (".mcap", ".db3")  # a folder with other files is not replaced
STYLES = {"bold": 1, "dim": 2, "red": 31, "green": 32, "magenta": 35, "cyan": 36}  # legible on dark and light
HELP_MARKS = (  # patterns with a style in help texts: of commands, topics, formats and the cookbook
    r"(?m)^ +(?P<green>(?:\$ .*|(?:frametool|printf|sed) .*))",
    r"\A(?P<bold>Usage:|(?!Usage:).*)",
    r"(?m)^(?P<bold>[A-Za-z][\w ]*(?: \([^)\n]*\))?:|\S.*\?)$",
    r"(?m)^  (?P<cyan>[a-z][\w-]*)  +(?=\S)",
    r"(?<![\w-])(?P<cyan>--?[a-zA-Z][\w-]*)",
)
LONGEST_BEGIN = 40  # characters of the final name in that of the temporary file: names are limited to 255 bytes


@contextmanager
def writing(path: str | None, *, force: bool = False, folder: bool = False) -> Iterator[Write]:
    """Open the output and yield a function that writes to it; each piece of text is flushed when the call returns.

    path: None or `-` is standard output.  A pipe, a device or one of the process's own streams is written to
    directly.  Anything else is written to `NAME.PID.part` next to it, which replaces the file when the block ends
    without an error (preserving its mode and owner; the target, if the path is a link) and is removed otherwise; only
    `kill -9` leaves it behind.
    folder: the output is a new folder; a piece that has a name begins the file of this name
    Raises FileProblem if the file exists and `force` is not set, or cannot be written; BrokenPipeError if the reader
    of a pipe is gone; the errors of CHECKS.
    """
    if path in (None, "-", "/dev/stdout"):
        yield writer_into(sys.stdout.buffer, "standard output")
    elif folder or not is_special(path):
        with _replacing(path, force=force, folder=folder) as write:
            yield write
    else:
        number = _own_stream(path)
        with file_errors(path):
            special = open(path if number is None else os.dup(number), "wb", buffering=0)  # noqa: SIM115 - closed below
        with special:
            yield writer_into(special, path)


@contextmanager
def _replacing(path: str, *, force: bool, folder: bool) -> Iterator[Write]:
    """Yield a function that writes a temporary file or folder, which replaces `path` if the block succeeds."""
    refuse = partial(refuse_existing, path, force=force, folder=folder)
    refuse()
    STATE.cleans_up = True
    place = os.path.realpath(path)
    parent, name = os.path.split(place)
    part = os.path.join(parent, f"{name[:LONGEST_BEGIN]}.{os.getpid()}.part")
    try:
        with ExitStack() as opened:
            mode = 0o600 if os.path.exists(path) else 0o666  # private until it gets the mode of the old file
            yield _folder_writer(part, path, opened) if folder else _file_writer(part, path, opened, mode)
            check()
        refuse()  # again, now that the part is complete
        with file_errors(path):
            if folder:
                with suppress(FileNotFoundError):
                    os.rename(place, f"{part}.before")
                os.rename(part, place)
                _remove(f"{part}.before")
                return
            with suppress(FileNotFoundError):  # preserve the mode of the old file and, if permitted, its owner
                known = os.stat(place)
                with suppress(OSError, AttributeError):  # Windows has no chown
                    os.chown(part, known.st_uid, known.st_gid)
                os.chmod(part, stat.S_IMODE(known.st_mode))
            os.replace(part, place)
    except BaseException:
        _remove(part)
        raise


def in_colour(text: str, marks: Iterable[str]) -> str:
    """Return text for a terminal: each named group of the patterns has the style of its name; unchanged with NO_COLOR.

    Where two overlap, the first pattern is used.
    """
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") in ("dumb", "unknown"):
        return text
    codes = [0] * len(text)
    for mark in marks:
        for found in re.finditer(mark, text):
            for name, part in found.groupdict().items():
                begin, end = found.span(name)
                if part and not any(codes[begin:end]):
                    codes[begin:end] = [STYLES[name]] * (end - begin)
    pieces, begin = [], 0
    for code, run in groupby(codes):
        piece = text[begin : (begin := begin + len(list(run)))]
        pieces.append(f"\x1b[{code}m{piece}\x1b[0m" if code else piece)
    return "".join(pieces)


def show(text: str, *, paged: bool) -> None:
    """Write a help text to standard output; on a terminal with styles, and paged if longer than the screen."""
    from shutil import get_terminal_size

    on_terminal = sys.stdout.isatty() and os.environ.get("TERM") != "dumb"
    if on_terminal and paged and text.count("\n") >= get_terminal_size().lines:
        check()
        click.echo_via_pager(in_colour(text, HELP_MARKS).removesuffix("\n"))
        return
    with writing(None) as write:
        write(in_colour(text, HELP_MARKS) if on_terminal else text)


def check() -> None:
    """Call all CHECKS."""
    for each in CHECKS:
        each()


def refuse_existing(path: str | None, *, force: bool, folder: bool = False) -> None:
    """Raise FileProblem for a path that `writing` must not replace: without --force, or a folder that is not a bag."""
    if path is None or path == "-" or not os.path.exists(path) or (is_special(path) and not folder):
        return
    if not force:
        raise FileProblem(f"{printable(path)}: exists; give --force to replace it")
    if folder and not os.path.isdir(path):
        raise FileProblem(f"{printable(path)}: is a file; a folder is to be written there")
    names = os.listdir(path) if folder else ()
    if others := sorted(name for name in names if name != BAG_FILE and not name.endswith(BAG_DATA)):
        raise FileProblem(f"{printable(path)}: holds more than a bag ({shown(others[0])}); it is not replaced")


def is_special(path: str) -> bool:
    """Return True if a path is not a regular file: a device, a pipe, a folder, or one of the process's streams."""
    return _own_stream(path) is not None or (os.path.exists(path) and not os.path.isfile(path))


def _own_stream(path: str) -> int | None:
    """Return the descriptor of a path such as /dev/stdout, None for other paths."""
    found = re.fullmatch(r"(?:/dev|/proc/self)/fd/(\d+)", path)
    return int(found[1]) if found else {"/dev/stdout": 1, "/dev/stderr": 2}.get(path)


def encoded(text: str) -> bytes:
    """Return text in UTF-8; raises ValueInvalid for undecodable bytes of a file name."""
    try:
        return text.encode()
    except UnicodeEncodeError as error:
        raise ValueInvalid(f"{shown(error.object[error.start :])} cannot be written as UTF-8 text") from None


def writer_into(stream: BinaryIO, name: str) -> Write:
    """Return a function that runs the checks and writes pieces to an open stream; messages use its name."""

    def write(piece: str | bytes | memoryview) -> None:
        check()
        view = memoryview(encoded(piece) if isinstance(piece, str) else piece)
        STATE.writing = True  # Ctrl-C is deferred until the block of lines is written
        try:
            with file_errors(name):
                while view:  # an unbuffered stream may write only a part
                    view = view[stream.write(view) :]
                stream.flush()
        finally:
            STATE.writing = False
        if STATE.interrupted:
            STATE.interrupted = False
            raise KeyboardInterrupt

    return write


@contextmanager
def file_errors(name: str) -> Iterator[None]:
    """Convert errors of the system into FileProblem with the name of the file, except for a closed pipe."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise FileProblem(f"{printable(name)}: {(error.strerror or str(error)).lower()}") from None


def _file_writer(part: str, path: str, opened: ExitStack, mode: int = 0o666) -> Write:
    """Create a temporary file and return a function that writes to it."""
    with file_errors(path):
        file = open(part, "xb", buffering=0, opener=lambda name, flags: os.open(name, flags, mode))  # noqa: SIM115
    return writer_into(opened.enter_context(file), path)


def _folder_writer(part: str, path: str, opened: ExitStack) -> Write:
    """Create a folder and return a function that writes its files; a piece with a name begins the file of this name."""
    write: Write | None = None

    def fill(piece: str | bytes | memoryview) -> None:
        nonlocal write
        if name := getattr(piece, "name", ""):
            write = _file_writer(os.path.join(part, name), path, opened)
        if write is not None and piece:  # the first piece has a name
            write(piece)

    with file_errors(path):
        os.mkdir(part)
    return fill


def _remove(part: str) -> None:
    """Remove a file or a folder, if it exists."""
    if os.path.isdir(part):
        from shutil import rmtree

        rmtree(part, ignore_errors=True)
    with suppress(OSError):
        os.unlink(part)


LOCATIONS: list[dict[str, Any]] = []  # source and line of a batch; all messages begin with the last one


def write_lines(text: str) -> None:
    """Write lines to stderr; if it is closed or its disk is full they are dropped, and the results are still valid."""
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)  # noqa: T201 - the only print of messages
    except OSError:
        discard(sys.stderr)


def say(text: str) -> None:
    """Write a message to stderr after the program's name, wrapped on a terminal."""
    where = "{source}:{line}: ".format(**LOCATIONS[-1]) if LOCATIONS else ""
    text = printable(f"frametool: {where}{text}")
    write_lines(folded(text) if sys.stderr is not None and sys.stderr.isatty() else text)


def folded(line: str) -> str:
    """Wrap a line between words at the width of the terminal; the rest is indented."""
    from shutil import get_terminal_size

    width = get_terminal_size().columns
    if len(line) <= width:
        return line
    from textwrap import fill

    return fill(line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def say_warning(message: str, rule: str = "") -> None:
    """Write a warning.

    With --quiet, the warning about a leading slash in names is omitted: the tree is as intended.  The warning about the
    unit that is assumed for stamps by their size is written once.
    """
    if rule in ("slash", "by-size"):
        context = click.get_current_context()
        if context.params.get("quiet") or context.meta.get(rule):
            return
        context.meta[rule] = rule == "by-size"
    say(f"warning: {message}")


def say_error(error: FrametoolError, *, in_json: bool = False, fate: str = "") -> None:
    """Write an error: as a sentence with the source line, or as a JSON object with its kind, message and fields.

    In a batch the location in the object is the line of the batch; that of the error itself is then under `input`.
    fate: what happens to the line or time with the error, e.g. `line skipped`
    """
    fate = f" ({fate})" if fate else ""
    if in_json:
        from frametool.documents.writers import dump_json

        message, details = str(error), dict(error.details())
        if LOCATIONS:
            own = {key: details.pop(key) for key in ("source", "line", "column") if key in details}
            message = f"{'{source}:{line}: '.format(**LOCATIONS[-1])}{message}"
            details = {**LOCATIONS[-1], **({"input": own} if own else {}), **details}
        write_lines(dump_json({"error": error.kind, "message": f"{message}{fate}", **details}))
        return
    say(f"{error}{getattr(error, 'remedy', '')}{fate}")
    if snippet := getattr(error, "snippet", ""):
        write_lines(snippet)


def say_first(
    texts: Sequence[Any], most: int, more: str, report: Callable[[Any], object], end: Callable[[str], object] = say
) -> None:
    """Report the first `most` texts, or one more if that is all, and the number of the others."""
    most += len(texts) == most + 1
    for each in texts[:most]:
        report(each)
    if len(texts) > most:
        end(f"{len(texts) - most} more {more}")


def discard(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that flushing its buffer does not fail again when the process ends."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


SYSTEM_ERRORS = (MemoryError, ImportError, OSError)


def system_message(error: Exception) -> str:
    """Return the message for an error of Python or the system."""
    if isinstance(error, MemoryError):
        return "out of memory"
    if isinstance(error, ImportError):  # numpy's message has many lines, the cause is the last
        return f"a library cannot be loaded: {str(error).strip().splitlines()[-1]}"
    return (getattr(error, "strerror", None) or str(error)).lower()


def wants_json(arguments: Sequence[str]) -> bool:
    """Return True if the arguments of a command ask for JSON."""
    is_one_word = "--format=json" in arguments or "-fjson" in arguments
    return is_one_word or any(name in ("-f", "--format") and value == "json" for name, value in pairwise(arguments))
