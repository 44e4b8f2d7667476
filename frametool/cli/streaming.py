"""Streams on the command line: the options they add, and the run itself."""

from __future__ import annotations

import os
import sys
from functools import partial
from io import BufferedReader, FileIO
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.group import keep_setting, refuse_unused, settings
from frametool.cli.options import (
    FILE,
    STREAMED,
    UTF8,
    ColumnNames,
    Notations,
    in_option,
    input_forms,
    refuse_not_needed,
    say_if_verbose,
    together,
    verbose_option,
)
from frametool.cli.stderr import say, say_error
from frametool.documents.source import HEAD
from frametool.errors import FileProblem, FormatError
from frametool.formats.table import FORMATS, ORDERS, has_no_text, holds_arrays, is_recording, is_trajectory, readers
from frametool.stream.faults import MOST, NULL, ON_ERROR, ROWS_SKIPPED, STOP, BadRows

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
    from typing import TypeVar

    from frametool.cli.output import Output
    from frametool.documents.source import Source
    from frametool.stream.request import Request
    from frametool.stream.run import Outcome

    Function = TypeVar("Function", bound=Callable[..., Any])
    About = Callable[[], str] | None  # what else there is to say of a form

MOST_JOBS = 256
BAGS = (".bag", ".mcap", ".db3")
_STREAMS = ", ".join(readers(*STREAMED))
RECORDS = readers("records")


def _keep_order(context: click.Context, _option: click.Parameter, chosen: Any) -> Any:
    """Keep --from for files of frames too, whose quaternions may stand in lists (a callback of click)."""
    name = chosen[0].spec if chosen else ""
    settings(context).row_order = name if name in ORDERS else ""
    return chosen


OPTIONS = {
    "input_path": click.option(
        "-i", "--input", "input_path", type=FILE, metavar="FILE", help="stream this file instead of standard input"
    ),
    "given": click.option(
        "--from", "given", type=Notations(), metavar="REP", callback=_keep_order,
        help="what unnamed numbers are",
    ),
    "columns": click.option(
        "--columns", type=ColumnNames(), metavar="NAME,..", multiple=True,
        help="our columns, by name or number; once for each pose",
    ),
    "keep": click.option("--keep", is_flag=True, help="add the result's columns, leave ours"),
    "prefix": click.option(
        "--prefix", type=UTF8, default="", metavar="TEXT", help="begin the names of the result's columns so"
    ),
    "header": click.option(
        "--no-header", "header", is_flag=True, callback=lambda _context, _option, chosen: not chosen,
        help="a table without names; columns are numbered",
    ),
    "on_error": click.option(
        "--on-error", type=click.Choice(ON_ERROR), default=STOP, show_default=True, help="bad rows"
    ),
    "max_errors": click.option(
        "--max-errors", type=click.IntRange(0), default=MOST, show_default=True, metavar="N",
        help="report at most N bad rows, count all",
    ),
    "jobs": click.option(
        "--jobs", type=click.IntRange(0, MOST_JOBS), default=1, show_default=True, metavar="N",
        help="processes for a stream; 0 is all cores",
    ),
    "quiet": click.option(
        "--quiet", is_flag=True, callback=keep_setting, help="no progress and no word on forms on stderr"
    ),
}  # fmt: skip


SEVERAL = click.option(
    "-i", "--input", "input_path", type=FILE, multiple=True, metavar="FILE",
    help="stream this file, not stdin; several clouds become one",
)  # fmt: skip


def stream_options(function: Function, first: Any = OPTIONS["input_path"]) -> Function:
    """Add to a command the options of streams; `Stream` takes them.  first: the option for the input."""
    return together(first, in_option, *list(OPTIONS.values())[1:], verbose_option)(function)


class Stream:
    """The stream of a command, as its options describe it."""

    def __init__(self, options: dict[str, Any]) -> None:
        """Take the stream's options out of a command's."""
        self._tell = partial(say_error, in_json=options.get("format_name") == "json")
        self.options = {name: options.pop(name) for name in OPTIONS if name in options}
        self.given = one_notation(self.options.get("given"))
        self.given_place = ""
        if self.given is not None and self.given.representation.is_place:
            self.given, self.given_place = None, self.given.representation.name
        given = self.options.get("input_path")
        self.paths: Sequence[str] = given if isinstance(given, tuple) else (given,) if given else ()
        self.path: str | None = self.paths[0] if self.paths else None
        if self.path == "-":
            self.path = None
        self._opened: BufferedReader | None = None
        self.within = ""  # the form of the records in a bag

    def opened(self) -> BufferedReader:
        """Open the input once: of a pipe, what a first reader has taken is gone for a second; raises FileProblem."""
        if self._opened is None:
            self._opened = self.messages() or _opened(self.path)
        return self._opened

    def messages(self) -> BufferedReader | None:
        """Return the points, poses or fixes of the bag that -i names as JSON lines; None for any other file.

        Raises FormatError for a bag without any, unless it may hold clouds instead.
        """
        if self._opened is not None or not self.path or not _may_be_bag(self.path):
            return self._opened
        from frametool.cli.cloud_files import is_bag

        if not is_bag(self.path):
            return None
        from frametool.grammar.edges import Tally
        from frametool.ros.bag_records import open_records

        topics = settings().topics
        self._opened = open_records(self.path, topics, Tally())
        self.within, settings().topics = "json", ()
        return self._opened

    def has_input(self) -> bool:
        """Tell whether something is piped in."""
        if sys.stdin is None or sys.stdin.isatty() or not sys.stdin.readable():
            return False
        return bool(self.opened().peek(1))

    def is_wanted(self, argument: object) -> bool:
        """Tell whether standard input or -i FILE is to be read in this argument's place."""
        if self.path is not None and argument not in (None, "-"):
            raise click.UsageError(f"-i FILE and {argument} are two inputs; give one")
        return self.path is not None or argument in (None, "-")

    def takes_rows(self, path: str) -> bool:
        """Stream a file that an argument names if it is a table; one of records, or none known, is not touched.

        What can be read once only, as `<(command)`, is streamed whatever it holds.
        """
        once = os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path))
        is_rows = once or _may_be_bag(path) or (self.told_form() or _form_of(path)) not in ("", *RECORDS)
        if path == "-" or not is_rows:
            return False
        self.path = path
        return True

    @staticmethod
    def told_form() -> str:
        """Return the form that --in names for the stream, "" if it names none."""
        others, form = input_forms(streams=True)
        if others and not settings().reads_trees:
            both = f"--in {others[0]} and --in {form}: there is one stream"
            raise click.UsageError(both if form else f"--in {others[0]} is not streamed; streams are {_STREAMS}")
        return form

    @property
    def name(self) -> str:
        """Return what messages call the stream."""
        return self.path or "stdin"

    def run(self, request: Request, output: Output, *, tables_only: bool = False) -> int:
        """Run the stream and return its exit status."""
        from frametool.formats.detect import refuse_robots, with_hint

        with self.opened() as given:
            head = given.peek()
            if head.lstrip()[:1] == b"<":
                refuse_robots(head, self.name)
            try:
                return self._run_opened(given, request, output, tables_only=tables_only)
            except FormatError as error:
                raise with_hint(error, head, self.name, told=bool(self.told_form())) from None

    def _run_opened(self, stream: BufferedReader, request: Request, output: Output, *, tables_only: bool) -> int:
        """Run the stream, of whatever form it is."""
        form = self.told_form() or self.within
        signed = form or _signed(stream.peek(), self.name)
        is_listed = is_trajectory(signed) or holds_arrays(signed)
        if not (form or tables_only or self._says_columns() or is_listed):
            pasted, stream = self._pasted(stream, request)
            if pasted is not None:
                return self._run_pasted(pasted, request, output)
        form = form or self._detected(stream.peek(), is_table=tables_only or self._says_columns())
        if form == "kitti" and self.given and not self.told_form():
            form = "columns"  # --from says what the numbers are, and nothing of pictures
        refuse_not_needed((form,), "stamps", "edges", "array")
        if output.told is None and (output.path or "").endswith(".bin") and not form.endswith("-bin"):
            raise click.UsageError(f"-o {output.path} does not say its form; give -f kitti-bin or nuscenes-bin")
        if tables_only and form in RECORDS:
            raise click.UsageError(f"frames are looked up for the rows of a table, not of {form}")
        request = self._completed(request, output, form)
        if request.offset_ns and form in RECORDS:
            from frametool.stream.record_stream import at_other_times

            stream = at_other_times(stream, form, request.offset_ns)
        elif request.offset_ns and "arrays" in FORMATS[form].reads:
            raise click.UsageError(f"--time-offset is for text, {form} holds numbers; convert it to csv first")
        output.take_axes(FORMATS[form].poses.axes, request.operation)
        if is_trajectory(form) and not output.notations:
            request = request._replace(notations=())  # its rows stay what they are
        if form in RECORDS and (output.told or form) != form and request.gathered is None:
            return self._run_as_values(stream, form, request, output)
        way = self._way(form, request, output)
        keeps = ("camera_axes",) if way == self._as_text else FORMATS[form].asks
        asked = tuple(ask for ask in FORMATS[form].asks if ask in keeps)
        settings().inputs = (*settings().inputs, (form, asked))
        outcomes, about = way(stream, form, request, output)
        if request.gathered is not None:
            outcomes = request.gathered.placing(outcomes, self.policy(self.name, _counted(form)).place)
        status = self._write(outcomes, output, gathers=request.gathered is not None, counted=_counted(form))
        if about is not None and (states := FORMATS[form].states) and not self.options["quiet"]:
            say(f"{self.name}: {FORMATS[form].summary}{about()}; {states}")
        return status

    def _detected(self, begin: bytes, *, is_table: bool) -> str:
        """Find the form of the stream by what it begins with, and by its name."""
        from frametool.formats.detect import detect

        form, known_by = detect(begin, *STREAMED, name=self.path or "", otherwise="columns" if is_table else "")
        if known_by:
            say_if_verbose(f"{self.name}: read as {form} ({FORMATS[form].summary}), known by {known_by}")
        return form

    def _way(self, form: str, request: Request, output: Output) -> Callable[..., tuple[Generator[Outcome], About]]:
        """Choose how rows become results: their text edited, as columns of numbers, or as poses in another form."""
        from frametool.formats.rows.pose_rows import is_turned
        from frametool.stream.row_layout import POSE, Shape

        gathers = request.gathered is not None
        if holds_arrays(form) and (gathers or output.told is None or holds_arrays(output.told)):
            return self._as_columns
        listed = holds_arrays(form) or (is_trajectory(form) and not FORMATS[form].is_table)
        is_kindred = output.told == "csv" and form in ("tsv", "semicolon")
        if gathers or form in RECORDS or is_kindred:
            return self._as_poses if gathers and listed else self._as_text
        # a trajectory has no room for more columns, or for other ones
        no_room = output.is_trajectory and bool(request.extras(Shape(POSE)) or output.notations)
        no_room |= output.is_trajectory and output.style.place is not None
        no_room |= not output.notations and is_turned(output.style.in_form(output.told or form))
        return self._as_poses if listed or no_room or output.told not in (None, form) else self._as_text

    def _as_columns(
        self, stream: Any, form: str, request: Request, output: Output
    ) -> tuple[Generator[Outcome], About]:
        """Write columns of numbers in the form they came in, or in another that holds such."""
        from importlib import import_module

        from frametool.cli.trees import answers
        from frametool.documents.source import InputFile
        from frametool.grammar.edges import Options, Tally, Topics
        from frametool.stream.column_stream import run_columns

        self._jobs(f"{form} holds numbers, no text")
        if output.path is None and request.gathered is None and sys.stdout.isatty():
            raise click.UsageError(f"{form} is no text for a terminal; give -o FILE, or -f csv, or pipe it")
        module: Any = import_module(FORMATS[form].reader)
        file = InputFile(self.path or "-", stream)
        file.form = form
        opened = module.open_columns(file, Options(Tally(), Topics(), answers=answers()))
        into: Any = module
        if output.told is not None and request.gathered is None:
            into = import_module(FORMATS[output.told].writer)
        style = output.style.in_form(output.told or form)
        request = request._replace(by_default=not output.notations)
        outcomes = run_columns(opened, request, style, source=self.name, into=None if into is module else into)
        now = f", now in {request.result_frame}" if request.result_frame and request.operation.moves else ""
        return outcomes, lambda: now

    def _as_poses(self, stream: Any, form: str, request: Request, output: Output) -> tuple[Generator[Outcome], About]:
        """Write the results of rows, or of poses that no table holds, in another form."""
        from frametool.cli.trees import answers
        from frametool.stream.as_poses import FormatConverter

        keeps = "poses" in FORMATS[form].writes and not output.notations
        target = output.told or (form if keeps else "csv")
        if target not in FORMATS:
            raise click.UsageError(f"--format {target} is for single results and records, not for a stream of {form}")
        self._jobs(f"rows become {target} one after the other")
        request = request._replace(by_default=not output.notations)
        converted = FormatConverter(form, request, output.style.in_form(target), self.name, answers())
        outcomes = converted.outcomes(stream, header=self.options["header"])
        return outcomes, lambda: ", " * bool(converted.tally.about) + converted.tally.about

    def _as_text(self, stream: Any, form: str, request: Request, _output: Output) -> tuple[Generator[Outcome], None]:
        """Put the results where the numbers stood; all other text stays."""
        if request.gathered is not None:
            request = request._replace(notations=())
        jobs = self._jobs("each row needs those before it" if request.in_order else "")
        if form in RECORDS:
            from frametool.stream.record_stream import run_records

            return run_records(stream, form, request, source=self.name, jobs=jobs), None
        from frametool.stream.table_stream import run_table

        return run_table(stream, form, request, source=self.name, header=self.options["header"], jobs=jobs), None

    def _says_columns(self) -> bool:
        """Tell whether an option says that the stream is a table."""
        options = self.options
        return bool(options["columns"] or options["keep"] or options["prefix"] or not options["header"])

    def _pasted(self, stream: BufferedReader, request: Request) -> tuple[Source | None, BufferedReader]:
        """Look for what was pasted; the stream is then another, with the same in it."""
        from frametool.cli.poses import pasted_stream

        return pasted_stream(stream, self.name, request._replace(given=request.given or self.given))

    @staticmethod
    def _run_pasted(source: Source, request: Request, output: Output) -> int:
        """Write the results of a text that was pasted."""
        from frametool.stream.record_values import read_poses, results

        if request.gathered is not None:
            request.gathered.add(read_poses(source, request), source.name)
            return 0
        request = request._replace(notations=request.notations or output.notations)
        output.values(results(source, request, output.style))
        return 0

    def _run_as_values(self, stream: Any, form: str, request: Request, output: Output) -> int:
        """Write the results of records in another form than theirs."""
        from frametool.stream.record_results import stream_rows

        self._jobs(f"records become {output.told} one after the other")
        if self.options["on_error"] == NULL and output.told not in ("csv", *RECORDS):
            raise click.UsageError(f"--on-error null: {output.told} has no place for a row without a result; give skip")
        bad = self.policy(self.name)
        request = request._replace(by_default=has_no_text(output.told or "") and not output.notations)
        if is_recording(output.told or ""):
            request = request._replace(place=None)  # a fix is made of ecef, unless of what was read
        output.rows(_then_closed(self.opened(), stream_rows(stream, form, request, output.style, bad)))
        return ROWS_SKIPPED if bad.count else 0

    def policy(self, name: str, counted: str = "line") -> BadRows:
        """Return what reports and counts the bad rows of a source."""
        return BadRows(
            name, self.options["on_error"], most=self.options["max_errors"], tell=self._tell, counted=counted
        )

    def _completed(self, request: Request, output: Output, form: str) -> Request:
        """Add what the stream's options say to the request."""
        options = self.options
        prefix = options["prefix"] and not request.operation.only_adds
        if (options["keep"] and output.told in RECORDS) or (form in RECORDS and (options["keep"] or prefix)):
            raise click.UsageError("--keep and --prefix are for tables; a record holds one pose")
        if form in RECORDS:
            refuse_unused("is for tables; a record names its own numbers", "columns", "header")
        if has_no_text(output.told or form) and request.gathered is None:
            refuse_unused(f"is not used: {output.told or form} holds numbers, not their text", "precision")
        return request._replace(
            given=request.given or self.given,
            notations=request.notations or output.notations,
            place=output.style.in_form(output.told or form).place,
            given_place=self.given_place,
            precision=output.style.precision,
            keep_sign=output.style.keep_sign,
            columns=options["columns"],
            keep=options["keep"],
            prefix=options["prefix"],
            on_error=options["on_error"],
        )

    def _write(self, outcomes: Generator[Outcome], output: Output, *, gathers: bool, counted: str) -> int:
        """Write what becomes of each block as it comes, unless somebody gathers it; return the exit status."""
        from contextlib import closing, nullcontext

        from frametool.stream.run import run
        from frametool.view.progress import ProgressBar

        with (
            nullcontext(lambda _: None) if gathers else output.opened() as write,
            ProgressBar(os.path.getsize(self.path) if self.path else None, quiet=self.options["quiet"]) as progress,
            self.opened(),  # closed before a file takes its place, which Windows asks for
            closing(outcomes),  # ends the processes of --jobs
        ):
            return run(outcomes, write, self.policy(self.name, counted), progress.advance)

    def _jobs(self, obstacle: str) -> int:
        """Return how many processes do the work: one where something is in the way of more, which is said."""
        if self.options["jobs"] == 1:
            return 1
        from frametool.stream.workers import can_spread, cores

        jobs: int = min(self.options["jobs"] or cores(), MOST_JOBS)
        obstacle = obstacle or ("" if can_spread() else "this system cannot fork processes")
        if jobs == 1 or not obstacle:
            return jobs
        say(f"--jobs does not help here: {obstacle}; one process does the work")
        return 1


def _then_closed(stream: Any, results: Iterable[Any]) -> Iterator[Any]:
    """Yield the results of a stream, and close it behind them."""
    with stream:
        yield from results


def _may_be_bag(path: str) -> bool:
    """Tell a bag by its suffix, or a folder."""
    return path.endswith(BAGS) or os.path.isdir(path)


def _counted(form: str) -> str:
    """Return what places count in a form."""
    return "row" if holds_arrays(form) else "line"


def _signed(begin: bytes, name: str) -> str:
    """Return the form that a stream shows, if it is no single row of a pose, which may have been pasted."""
    from frametool.formats.detect import by_sign

    form = by_sign(begin, *STREAMED, name=name) or ""
    return "" if form == "kitti" else form


def _opened(path: str | None) -> BufferedReader:
    """Open the input; raises FileProblem."""
    if path is None:
        if sys.stdin is None:
            raise FileProblem("standard input is closed")
        if sys.stdin.isatty():
            say("reading from the terminal; end with Ctrl-D")
        stream = sys.stdin.buffer
        return stream if isinstance(stream, BufferedReader) else BufferedReader(stream)  # type: ignore[arg-type]
    try:
        return BufferedReader(FileIO(path), HEAD)
    except OSError as error:
        raise FileProblem(f"{path}: {(error.strerror or str(error)).lower()}") from None


def _form_of(path: str) -> str:
    """Return the form of a file by what is in it; "" where nothing tells, or it cannot be read."""
    from frametool.formats.detect import detect

    try:
        with open(path, "rb") as file:
            return detect(file.read(HEAD), *STREAMED, name=path)[0]
    except (OSError, ValueError):
        return ""


def one_notation(given: Any) -> Any:
    """Take the one representation of --from."""
    if given and len(given) > 1:
        raise click.UsageError("--from takes one representation")
    return given[0] if given else None
