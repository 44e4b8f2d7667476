"""Streams on the command line: the options they add, and the run itself."""

from __future__ import annotations

import os
import re
import sys
from functools import partial
from io import BufferedReader
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options
from frametool.cli.command import Inputs, option, refuse, say_if_typed, together
from frametool.cli.stderr import say, say_error
from frametool.documents.source import HEAD, Source, has_line, has_record, opened
from frametool.errors import FormatError
from frametool.formats.table import (
    BAG,
    FORMATS,
    by_suffix,
    has_no_text,
    holds_arrays,
    is_recording,
    is_trajectory,
    readers,
)
from frametool.stream.faults import MOST, NULL, ON_ERROR, ROWS_SKIPPED, STOP, BadRow, BadRows

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from frametool.cli.output import Output
    from frametool.stream.faults import Outcome
    from frametool.stream.request import Request

    About = Callable[[], str] | None  # what else there is to say of a format

TOP = 2  # lines of a table up to its first row: what is bad there may be bad in every row
BAGS = tuple(name for name, row in FORMATS.items() if row.reader == BAG)
_MAGICS: list[Any] = [what for name in BAGS for kind, what in FORMATS[name].magic if kind == "magic"]
_STREAMS = ", ".join(readers(*options.STREAMED))
RECORDS = readers("records")


_of_rows = partial(option, under="Rows")
_ROWS = (
    option("--from REP", "representation of bare numbers", options.Notations(), name="from_rep", under="Rotations"),
    _of_rows("--columns NAME,..", "pose columns by name or number, once per pose; or one key of records, a.b",
             options.ColumnNames(), multiple=True),
    _of_rows("--keep", "append result columns, keep the input's"),
    _of_rows("--prefix TEXT", "prefix of the result's column names", options.utf8, default=""),
    _of_rows("--on-error", "bad rows", ON_ERROR, default=STOP),
    _of_rows("--max-errors N", "report at most N bad rows, but count all", click.IntRange(0), default=MOST),
    _of_rows("--no-header", "table without a header; columns are numbered", name="header",
             callback=lambda _context, _option, chosen: not chosen),
    option("--quiet", "suppress progress and notes on files", under="Files"),
)  # fmt: skip
_INPUT = _of_rows("-i --input FILE", "read this file instead of standard input", name="input_path")
_SEVERAL = "read this file, not stdin; several clouds become one"
SEVERAL = _of_rows("-i --input FILE", _SEVERAL, name="input_path", multiple=True)


def stream_options(function: Any, first: Any = _INPUT) -> Any:
    """Add to a command the options of streams; `Stream` takes them.  first: the option for the input."""
    return together(first, options.in_option, *_ROWS, options.verbose_option)(function)


class Stream:
    """The stream of a command, as its options describe it."""

    def __init__(self, inputs: Inputs) -> None:
        """Look at what the options say; each is asked for where it counts."""
        self._tell = partial(say_error, in_json=inputs.peek("format_name") == "json")
        self.inputs = inputs
        path = inputs.peek("input_path")
        self.paths: Sequence[str] = path if isinstance(path, tuple) else () if path is None else (path,)
        self.path: str | None = self.paths[0] if self.paths and self.paths[0] != "-" else None
        self._opened: BufferedReader | None = None
        self.within = ""  # the format of the records in a bag
        notations: Any = inputs.peek("from_rep") or (None,)
        refuse(len(notations) > 1, "--from takes one representation")
        self.notation: Any = notations[0]
        self.place = ""
        if self.notation is not None and self.notation.representation.is_place:
            self.notation, self.place = None, self.notation.representation.name

    def opened(self) -> BufferedReader:
        """Open the input once: of a pipe, what a first reader has taken is gone for a second; raises FileProblem."""
        if self._opened is None:
            self.inputs.ask("input_path")
            name = "-" if self.path is None else self.path
            say_if_typed(name)
            self._opened = self.messages() or opened(name)
            if not self._opened.seekable():
                from frametool.text.lines import arrived

                self._opened = arrived(self._opened, self._shows_format, HEAD)
        return self._opened

    def _shows_format(self, begin: bytes) -> bool:
        """Return True if what comes later does not change the format that is found."""
        if has_record(begin):
            return True
        if not has_line(begin):
            return False
        try:
            return bool(self.chosen_format() or self._detected(begin, is_table=self._says_columns(), quiet=True))
        except FormatError:
            return False

    def messages(self) -> BufferedReader | None:
        """Return the points, poses or fixes of the bag that -i names as JSON lines; None for any other file.

        Raises FormatError for a bag without any, unless it may hold clouds instead.
        """
        if self._opened is not None or not self.path or not _may_be_bag(self.path):
            return self._opened
        if not is_bag(self.path):
            return None
        from frametool.grammar.edges import Diagnostics
        from frametool.recordings.messages import open_records

        self._opened = open_records(self.path, self.inputs.topics, Diagnostics())
        self.within = "json"
        self.inputs.leave(topics=())
        return self._opened

    def read_clouds_as_rows(self) -> None:
        """Let the points of a cloud be rows of CSV, which has room for more columns."""
        begin = self.opened().peek()
        fmt = "" if self.within else self.chosen_format() or (_signed(begin, self.name) if begin else "")
        if holds_arrays(fmt):
            from frametool.text.lines import Pieces

            opened = self.opened()
            self._opened, self.within = BufferedReader(Pieces(self._rows_of_cloud(fmt, opened), opened)), "csv"

    def _rows_of_cloud(self, fmt: str, opened: BufferedReader) -> Iterator[bytes]:
        from frametool.cli.trees import answers
        from frametool.grammar.result import Style
        from frametool.stream.as_poses import FormatConverter
        from frametool.stream.request import Request

        bad, row = self.policy(self.name, "row"), 1
        request = Request(on_error=self.inputs.on_error, by_default=True)
        for made in FormatConverter(fmt, request, self.name, Style("csv", ()), answers()).outcomes(opened):
            bad.take([fault._replace(line=fault.line + row) for fault in made.faults])
            row += made.lines
            if made.text:
                yield bytes(made.text)

    def has_input(self) -> bool:
        """Return True if something is piped in."""
        if sys.stdin is None or sys.stdin.isatty() or not sys.stdin.readable():
            return False
        return bool(self.opened().peek(1))

    def takes_rows(self, path: str) -> bool:
        """Stream a file that an argument names if it is a table; one of records, or none known, is not touched.

        What can be read once only, as `<(command)`, is streamed whatever it holds.
        """
        once = os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path))
        is_rows = once or _may_be_bag(path) or (self.chosen_format() or _format_of(path)) not in ("", *RECORDS)
        if path == "-" or not is_rows:
            return False
        self.path = path
        return True

    def chosen_format(self) -> str:
        """Return the format that --in names for the stream, "" if it names none."""
        others, fmt = options.input_formats(streams=True)
        if others and not self.inputs.reads_trees:
            both = f"--in {others[0]} and --in {fmt}: there is one stream"
            raise click.UsageError(both if fmt else f"--in {others[0]} is not streamed; streams are {_STREAMS}")
        return fmt

    @property
    def name(self) -> str:
        """Return what messages call the stream."""
        return self.path or "stdin"

    def run(self, request: Request, output: Output, *, tables_only: bool = False) -> int:
        """Run the stream and return its exit status."""
        from frametool.formats.detect import refuse_robots

        self.inputs.ask("input_path", "on_error", "max_errors")
        with self.opened() as source:
            head = source.peek()
            if head.lstrip()[:1] == b"<":
                refuse_robots(head, self.name)
            try:
                return self._run_opened(source, request, output, tables_only=tables_only)
            except FormatError as error:
                raise self._with_remedy(error, head) from None

    def _with_remedy(self, error: FormatError, head: bytes) -> FormatError:
        """Return the error that ends a stream with what to do."""
        from frametool.formats.detect import with_hint

        if isinstance(error, BadRow) and not (error.fault.final or head[:1] == b"[" or error.fault.line <= TOP):
            error.remedy = "; --on-error skip goes on"
        return with_hint(error, head, self.name, chosen=bool(self.chosen_format()))

    def _run_opened(self, stream: BufferedReader, request: Request, output: Output, *, tables_only: bool) -> int:
        """Run the stream, of whatever format it is."""
        fmt = self.within or self.chosen_format()
        signed = fmt or _signed(stream.peek(), self.name)
        is_listed = is_trajectory(signed) or holds_arrays(signed)
        if not (fmt or tables_only or self._says_columns() or is_listed):
            from frametool.cli.poses import pasted_stream

            pasted, stream = pasted_stream(stream, self.name, request, self.notation, self.place)
            if pasted is not None:
                return self._run_pasted(pasted, request, output)
        fmt = fmt or self._detected(stream.peek(), is_table=tables_only or self._says_columns())
        if fmt == "kitti" and self.notation and not self.chosen_format():
            fmt = "columns"  # --from says what the numbers are, and nothing of pictures
        if request.poses:
            self.inputs.ask(*FORMATS[fmt].required_options)
        if output.chosen is None and (output.path or "").endswith(".bin") and not fmt.endswith("-bin"):
            raise click.UsageError(f"-o {output.path} does not name its format; give -f kitti-bin or nuscenes-bin")
        refuse(tables_only and fmt in RECORDS, f"frames are looked up for the rows of a table, not of {fmt}")
        request = self._completed(request, output, fmt)
        if request.offset_ns and fmt in RECORDS:
            from frametool.stream.record_stream import at_other_times

            stream = at_other_times(stream, fmt, request.offset_ns)
        elif request.offset_ns and "arrays" in FORMATS[fmt].reads:
            raise click.UsageError(f"--time-offset is for text, {fmt} holds numbers; convert it to csv first")
        output.take_axes(FORMATS[fmt].poses.axes, request.operation)
        if is_trajectory(fmt) and not output.notations:
            request = request._replace(notations=())  # its rows stay what they are
        if fmt in RECORDS and (output.chosen or fmt) != fmt and request.gathered is None:
            return self._run_as_values(stream, fmt, request, output)
        way = self._way(fmt, request, output)
        outcomes, about = way(stream, fmt, request, output)
        bad = self.policy(self.name, "row" if holds_arrays(fmt) else "line")
        outcomes = outcomes if request.gathered is None else request.gathered.placing(outcomes, bad.place)
        status = self._write(outcomes, output, bad, gathers=request.gathered is not None)
        if output.path and request.gathered is None:
            output.report_suffix(_kept(fmt, output) if way == self._as_poses else fmt)
        if about is not None and (assumed := about()) and not self.inputs.quiet:
            say(f"{self.name}: {assumed}")
        return status

    def _detected(self, begin: bytes, *, is_table: bool, quiet: bool = False) -> str:
        """Find the format of the stream by what it begins with, and by its name."""
        from frametool.formats.detect import detect

        fmt = detect(begin, *options.STREAMED, name=self.path or "", otherwise="columns" if is_table else "")
        if self.inputs.verbose and not quiet:
            say(f"{self.name}: read as {fmt} ({FORMATS[fmt].summary})")
        return fmt

    def _way(self, fmt: str, request: Request, output: Output) -> Callable[..., tuple[Generator[Outcome], About]]:
        """Choose how rows become results: their text edited, as columns of numbers, or as poses in another format."""
        from frametool.formats.rows.pose_rows import is_turned
        from frametool.stream.row_layout import POSE, Shape

        gathers = request.gathered is not None
        if holds_arrays(fmt) and (gathers or output.chosen is None or holds_arrays(output.chosen)):
            return self._as_columns
        listed = holds_arrays(fmt) or (is_trajectory(fmt) and not FORMATS[fmt].is_table)
        is_kindred = output.chosen == "csv" and fmt in ("tsv", "semicolon")
        if gathers or fmt in RECORDS or is_kindred:
            return self._as_poses if gathers and listed else self._as_text
        # a trajectory has no room for more columns, or for other ones
        no_room = output.is_trajectory and bool(request.extras(Shape(POSE)) or output.notations)
        no_room |= output.is_trajectory and output.style.place is not None
        turns = bool(output.style.axes) and not output.notations
        no_room |= turns and is_turned(output.style.changed(format=output.chosen or fmt))
        return self._as_poses if listed or no_room or output.chosen not in (None, fmt) else self._as_text

    def _as_columns(self, stream: Any, fmt: str, request: Request, output: Output) -> tuple[Generator[Outcome], About]:
        """Write columns of numbers in the format they came in, or in another that holds such."""
        from importlib import import_module

        from frametool.cli.trees import answers
        from frametool.documents.source import InputFile
        from frametool.grammar.edges import Diagnostics, Options, Topics
        from frametool.stream.column_stream import run_columns

        if output.path is None and request.gathered is None and sys.stdout.isatty():
            raise click.UsageError(f"{fmt} is no text for a terminal; give -o FILE, or -f csv, or pipe it")
        module: Any = import_module(FORMATS[fmt].reader)
        file = InputFile(self.path or "-", stream)
        file.format = fmt
        opened = module.open_columns(file, Options(Diagnostics(), Topics(), answers=answers()))
        into: Any = module
        if output.chosen is not None and request.gathered is None:
            into = import_module(FORMATS[output.chosen].writer)
        style = output.style.changed(format=output.chosen or fmt)
        request = request._replace(by_default=not output.notations)
        return run_columns(opened, request, style, source=self.name, into=None if into is module else into), None

    def _as_poses(self, stream: Any, fmt: str, request: Request, output: Output) -> tuple[Generator[Outcome], About]:
        """Write the results of rows, or of poses that no table holds, in another format."""
        from frametool.cli.trees import answers
        from frametool.stream.as_poses import FormatConverter

        target = output.chosen or _kept(fmt, output)
        refuse(target not in FORMATS, f"--format {target} is for single results and records, not for a stream of {fmt}")
        request = request._replace(by_default=not output.notations)
        converted = FormatConverter(fmt, request, self.name, output.style.changed(format=target), answers())
        outcomes = converted.outcomes(stream, header=self.inputs.header)
        return outcomes, lambda: converted.tally.assumed

    def _as_text(self, stream: Any, fmt: str, request: Request, _output: Output) -> tuple[Generator[Outcome], None]:
        """Put the results where the numbers stood; all other text stays."""
        if request.gathered is not None:
            request = request._replace(notations=())
        if fmt in RECORDS:
            from frametool.stream.record_stream import run_records

            return run_records(stream, fmt, request, source=self.name), None
        from frametool.stream.table_stream import run_table

        return run_table(stream, fmt, request, source=self.name, header=self.inputs.header), None

    def _says_columns(self) -> bool:
        """Return True if an option says that the stream is a table."""
        looked = self.inputs.peek
        return bool(looked("columns") or looked("keep") or looked("prefix") or looked("header") is False)

    def _run_pasted(self, source: Source, request: Request, output: Output) -> int:
        """Write the results of a text that was pasted."""
        from frametool.stream.record_values import read_poses, results

        self.inputs.ask("from_rep")
        if request.gathered is not None:
            request.gathered.add(read_poses(source, request), source.name)
            return 0
        request = request._replace(notations=request.notations or output.notations)
        output.values(results(source, request, output.style))
        return 0

    def _run_as_values(self, stream: Any, fmt: str, request: Request, output: Output) -> int:
        """Write the results of records in another format than theirs."""
        from frametool.stream.record_results import stream_rows

        if self.inputs.on_error == NULL and output.chosen not in ("csv", *RECORDS):
            raise click.UsageError(f"--on-error null: {output.chosen} cannot hold a row without a result; give skip")
        bad = self.policy(self.name)
        request = request._replace(by_default=has_no_text(output.chosen or "") and not output.notations)
        if is_recording(output.chosen or ""):
            request = request._replace(place=None)  # a fix is made of ecef, unless of what was read
        output.rows(_then_closed(self.opened(), stream_rows(stream, fmt, request, output.style, bad)))
        return ROWS_SKIPPED if bad.count else 0

    def policy(self, name: str, counted: str = "line") -> BadRows:
        """Return what reports and counts the bad rows of a source."""
        return BadRows(name, self.inputs.on_error, most=self.inputs.max_errors, tell=self._tell, counted=counted)

    def _completed(self, request: Request, output: Output, fmt: str) -> Request:
        """Add what the stream's options say to the request."""
        inputs = self.inputs
        adds = bool(request.poses) or request.operation.formula is None  # look-ups add by themselves
        if fmt not in RECORDS and output.chosen not in RECORDS and adds and request.gathered is None:
            request = request._replace(keep=inputs.keep)
        if (fmt not in RECORDS or request.operation.only_adds) and request.gathered is None:
            request = request._replace(prefix=inputs.prefix)
        if request.poses:
            inputs.ask("from_rep")
            request = request._replace(columns=inputs.columns)
        several = fmt in RECORDS and "," in ",".join(request.columns)
        refuse(several, "--columns names one key of records, as detections.pose")
        if not has_no_text(output.chosen or fmt):
            inputs.ask("precision")
        return request._replace(
            given=request.given or self.notation, notations=request.notations or output.notations,
            place=output.style.changed(format=output.chosen or fmt).place, given_place=self.place,
            precision=output.style.precision, keep_sign=output.style.keep_sign, on_error=inputs.on_error,
        )  # fmt: skip

    def _write(self, outcomes: Generator[Outcome], output: Output, bad: BadRows, *, gathers: bool) -> int:
        """Write what becomes of each block as it comes, unless somebody gathers it; return the exit status."""
        from contextlib import closing, nullcontext

        from frametool.stream.faults import run
        from frametool.view.progress import ProgressBar

        with (
            nullcontext(lambda _: None) if gathers else output.opened() as write,
            ProgressBar(os.path.getsize(self.path) if self.path else None, quiet=self.inputs.quiet) as progress,
            self.opened(),  # closed before a file takes its place, which Windows asks for
            closing(outcomes),
        ):
            return run(outcomes, write, bad, progress.advance)


def _kept(fmt: str, output: Output) -> str:
    """Return the format in which poses that no table holds are written, if none is chosen."""
    return fmt if "poses" in FORMATS[fmt].writes and not output.notations else "csv"


def _then_closed(stream: Any, results: Iterable[Any]) -> Iterator[Any]:
    """Yield the results of a stream, and close it behind them."""
    with stream:
        yield from results


def _may_be_bag(path: str) -> bool:
    """Recognize a bag by its suffix, or a folder."""
    return by_suffix(path, BAGS) is not None or os.path.isdir(path)


def _signed(begin: bytes, name: str) -> str:
    """Return the format that a stream shows, if it is no single row of a pose, which may have been pasted."""
    from frametool.formats.detect import by_sign

    fmt = by_sign(begin, *options.STREAMED, name=name) or ""
    return "" if fmt == "kitti" else fmt


def _format_of(path: str) -> str:
    """Return the format of a file by what is in it; "" where nothing tells, or it cannot be read."""
    from frametool.formats.detect import detect

    try:
        with open(path, "rb") as file:
            return detect(file.read(HEAD), *options.STREAMED, name=path)
    except (OSError, ValueError):
        return ""


def is_bag(path: str) -> bool:
    """Recognize a bag by its first bytes, or as a folder."""
    if not os.path.isfile(path):
        from frametool.formats.detect import of_folder

        return of_folder(path) in BAGS
    with open(path, "rb") as file:
        head = file.read(HEAD)
    return re.match(b"|".join(_MAGICS), head, re.DOTALL) is not None if head else by_suffix(path, BAGS) is not None
