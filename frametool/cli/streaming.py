"""Run streams on the command line: options, formats, bad rows; for commands on poses also arguments and --explain."""

from __future__ import annotations

import os
import re
import sys
from contextlib import closing, nullcontext, suppress
from functools import partial
from importlib import import_module
from io import BufferedReader
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options
from frametool.cli.command import Inputs, option, refuse, say_if_typed, together
from frametool.cli.output import QUATERNION, Output
from frametool.cli.poses import inline_misuse, is_pasted, pasted_stream, pose_source, values_of, without_inverse
from frametool.cli.sink import say, say_error
from frametool.documents.source import HEAD, InputFile, Source, has_line, has_record, opened
from frametool.errors import FormatError, heard_by, warn
from frametool.formats import table
from frametool.formats.table import BAG, FORMATS, holds, is_trajectory, readers
from frametool.grammar.result import Style
from frametool.rows.faults import MOST, NULL, ON_ERROR, SKIP, STOP, BadRow, BadRows, Outcome, run, written_by

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence
    from contextlib import AbstractContextManager

    from frametool.explain.derive import WrittenPose
    from frametool.explain.render import Explanation
    from frametool.grammar.edges import Diagnostics
    from frametool.rows.conversion import Step
    from frametool.rows.request import Request
    from frametool.rows.samples import MeanRows

TOP = 2  # lines of a table up to its first row: an error in these is probably in every row
BAGS = tuple(name for name, row in FORMATS.items() if row.reader == BAG)
_MAGICS: list[Any] = [what for name in BAGS for kind, what in FORMATS[name].magic if kind == "magic"]
RECORDS = readers("records")
ONE_RECORD = "--explain derives one record; write it as an argument"
KEPT_FORMAT = "--unwrap is for rows that keep their format; convert them first"


_of_rows = partial(option, under="Rows")
_ROWS = together(
    options.in_option,
    option("--from REP", "representation of bare numbers", options.NOTATION, name="from_rep", under="Rotations"),
    _of_rows("--columns NAME,..", "pose columns by name or number, once per pose; or one key of records, a.b",
             options.COLUMN, multiple=True),
    _of_rows("--keep", "append result columns, keep the input's"),
    _of_rows("--prefix TEXT", "prefix of the result's column names", options.utf8),
    _of_rows("--on-error", "bad rows", ON_ERROR, default=STOP),
    _of_rows("--max-errors N", "report at most N bad rows, but count all", click.IntRange(0), default=MOST),
    _of_rows("--no-header", "table without a header; columns are numbered"),
    option("--quiet", "suppress progress and notes on files", under="Files"),
    options.verbose_option,
)  # fmt: skip
_input = partial(_of_rows, "-i --input FILE", name="input_path")
stream_options = together(_input("read this file instead of standard input"), _ROWS)
several_stream_options = together(_input("read this file, not stdin; several clouds become one", multiple=True), _ROWS)
pose_stream_options = together(stream_options, options.pose_reading_options)


explain_option = partial(
    option, "--explain [=FORM]", "derive the result step by step (help explain)", under="Result"
)  # fmt: skip
EXPLAIN = explain_option()


class Task:
    """The work of one command: its stream or arguments, and the output of its results, by the options.

    plan: the style of the derivation with --explain, else None
    window: the first and last nanosecond of --start and --stop, None without both
    """

    _opened: BufferedReader | None = None
    within = ""  # the format of records that were extracted from a bag or a cloud
    plan: Style | None = None

    def __init__(self, inputs: Inputs, *what: str, output: Output | None = None) -> None:
        """Read the options; those that have an effect here are marked as used.

        what: the kinds of results of the command, unless `output` is passed
        """
        self.inputs, self.normalize, self.place = inputs, bool(inputs.normalize), ""
        self.output = output = output or Output(inputs, *what)
        path = inputs.peek("input_path")
        self.paths: Sequence[str] = path if isinstance(path, tuple) else () if path is None else (path,)
        self.path: str | None = self.paths[0] if self.paths and self.paths[0] != "-" else None
        self.name: str = self.path or "stdin"  # of the stream, in messages
        # these options are only for tables
        self._is_table = any(map(inputs.peek, ("columns", "keep", "prefix", "no_header")))
        self.notation: Any = inputs.peek("from_rep")
        if self.notation is not None and self.notation.representation.is_place:
            self.notation, self.place = None, self.notation.representation.name
        self.window = options.window_of(inputs)
        if inputs.explain:
            refuse(output.chosen not in (None, "text"), f"--explain writes text or markdown, not {output.chosen}")
            notations = output.style.notations or QUATERNION
            self.plan = output.style.changed(precision=significant(inputs.precision), notations=notations)

    def opened(self) -> BufferedReader:
        """Return the opened input, always the same stream, because a pipe cannot be read twice; raises FileProblem."""
        if self._opened is None:
            self.inputs.use("input_path")
            name = "-" if self.path is None else self.path
            say_if_typed(name)
            self._opened = self.messages() or opened(name)
            if not self._opened.seekable():
                from frametool.text.lines import arrived

                self._opened = arrived(self._opened, self._shows_format, HEAD)
        return self._opened

    def _shows_format(self, begin: bytes) -> bool:
        """Return True if the beginning of the stream is long enough to detect its format."""
        if has_record(begin) or not has_line(begin):
            return has_record(begin)
        with suppress(FormatError):
            return bool(self.format_of(begin, is_table=self._is_table))
        return False

    def messages(self) -> BufferedReader | None:
        """Return the points, poses or fixes of the bag of -i as JSON lines; None for other files and bags of clouds.

        Raises FormatError for a bag without any of these.
        """
        if self._opened is None and self.path and is_bag(self.path):
            from frametool.grammar.edges import Diagnostics
            from frametool.recordings.contents import open_records

            self._opened = open_records(self.path, self.inputs.topics, Diagnostics())
            self.within = "json"
            self.inputs.update(topics=())
        return self._opened

    def read_clouds_as_rows(self) -> None:
        """Replace a cloud by rows of CSV with its points, to which columns can be added."""
        from frametool.formats.detect import by_sign

        opened = self.opened()
        fmt = self.within or self.chosen_format() or by_sign(opened.peek(), *options.STREAMED, name=self.name) or ""
        if holds(fmt, "arrays"):
            from frametool.text.lines import Pieces

            self._opened, self.within = BufferedReader(Pieces(self._rows_of_cloud(fmt, opened), opened)), "csv"

    def _rows_of_cloud(self, fmt: str, opened: BufferedReader) -> Iterator[bytes]:
        from frametool.cli.trees import answers
        from frametool.rows.conversion import FormatConverter
        from frametool.rows.request import Request, ResultOptions

        bad, row = self.policy(self.name, "row"), 1
        request = Request(on_error=self.inputs.on_error, results=ResultOptions(default_notation=True))
        for made in FormatConverter(fmt, request, self.name, Style("csv", ()), answers(self.inputs)).outcomes(opened):
            bad.take([fault._replace(line=fault.line + row) for fault in made.faults])
            row += made.lines
            if made.text:
                yield bytes(made.text)

    def has_input(self) -> bool:
        """Return True if standard input is not a terminal and not empty."""
        if sys.stdin is None or sys.stdin.isatty() or not sys.stdin.readable():
            return False
        return bool(self.opened().peek(1))

    def has_table(self, argument: str) -> bool:
        """Return True if the file of an argument is a table, a bag, or a pipe (`<(command)`), which then is the stream.

        A pipe can be read only once, so it is streamed whatever its format is.
        """
        if argument == "-" or is_pasted(argument, self.notation):
            return False
        once = os.path.exists(argument) and not (os.path.isfile(argument) or os.path.isdir(argument))
        if not (once or is_bag(argument)):
            try:
                with open(argument, "rb") as file:
                    if self.format_of(file.read(HEAD), name=argument) in RECORDS:
                        return False
            except (OSError, ValueError):  # not readable, or of an unknown format
                return False
        self.path = self.name = argument
        return True

    def chosen_format(self) -> str:
        """Return the format of the stream by --in, "" if it is not set."""
        others = [*self.inputs.input_formats]
        fmt = options.take_stream_format(others)
        if others and not self.inputs.reads_trees:
            both = f"--in {others[0]} and --in {fmt}: there is one stream"
            streams = ", ".join(readers(*options.STREAMED))
            raise click.UsageError(both if fmt else f"--in {others[0]} is not streamed; streams are {streams}")
        return fmt

    def run(self, request: Request, rows: MeanRows | None = None) -> int:
        """Run the stream and return its exit status; a FormatError gets a hint about what to do.

        rows: collects the results, which are then not written
        """
        from frametool.formats.detect import with_hint

        self.inputs.use("input_path", "on_error", "max_errors")
        with self.opened() as source:
            head = source.peek()
            try:
                return self._run_opened(source, request, rows)
            except FormatError as error:
                if isinstance(error, BadRow) and not (error.fault.final or head[:1] == b"[" or error.fault.line <= TOP):
                    error.remedy = "; --on-error skip goes on"
                raise with_hint(error, head, self.name, chosen=bool(self.chosen_format())) from None

    def _run_opened(self, stream: BufferedReader, request: Request, rows: MeanRows | None) -> int:
        """Detect the format of the stream and run it."""
        looks_up = not request.rows.poses and request.operation.formula is None
        output, is_table = self.output, looks_up or self._is_table
        fmt = self.within or self.chosen_format()
        from frametool.formats.detect import by_sign

        signed = fmt or by_sign(stream.peek(), *options.STREAMED, name=self.name) or ""
        may_be_pasted = signed == "kitti" or not (is_trajectory(signed) or holds(signed, "arrays"))  # one row is a pose
        if may_be_pasted and not (fmt or is_table):
            pasted, stream = pasted_stream(stream, self.name, request, self.notation, self.place)
            if pasted is not None:
                self.inputs.use("from_rep")
                if rows is None:
                    output.values(values_of([pasted], request, output))
                else:
                    rows.add(pasted, request, name=pasted.name)
                return 0
        if not fmt:
            fmt = self.format_of(stream.peek(), is_table=is_table)
            if self.inputs.verbose:
                say(f"{self.name}: read as {fmt} ({FORMATS[fmt].summary})")
            if fmt == "kitti" and self.notation:
                fmt = "columns"  # with --from, 12 numbers per row are not poses of KITTI
        if output.chosen is None and (output.path or "").endswith(".bin") and not fmt.endswith("-bin"):
            raise click.UsageError(f"-o {output.path} does not name its format; give -f kitti-bin or nuscenes-bin")
        refuse(looks_up and fmt in RECORDS, f"frames are looked up for the rows of a table, not of {fmt}")
        request = self._with_stream_options(request, fmt, alone=rows is None)
        if request.offset_ns and fmt in RECORDS:
            from frametool.rows.sources.records import at_other_times

            stream = at_other_times(stream, fmt, request.offset_ns)
        of_numbers = f"--time-offset is for text, {fmt} holds numbers; convert it to csv first"
        refuse(request.offset_ns and holds(fmt, "arrays"), of_numbers)
        output.set_camera_axes(FORMATS[fmt].rows.axes, request.operation)
        if is_trajectory(fmt) and not output.notations:
            request = request.with_results(notations=())  # rows are written in their own representation
        bad = self.policy(self.name, "row" if holds(fmt, "arrays") else "line")
        if rows is not None:
            outcomes, written, tally = rows.take(self._steps(stream, fmt, request), bad.place), "", None
        else:
            outcomes, written, tally = self._outcomes(stream, fmt, request)
        progress: AbstractContextManager[Callable[[int, int], None] | None] = nullcontext()
        if not self.inputs.quiet and sys.stderr is not None and sys.stderr.isatty():
            from frametool.view.text import progress_bar

            progress = progress_bar(os.path.getsize(self.path) if self.path else None)
        with (
            output.opened() if rows is None else nullcontext(lambda _: None) as write,
            progress as advance,
            self.opened(),  # Windows cannot replace a file that is open
            closing(outcomes),
        ):
            status = run(outcomes, write, bad, advance)
        if rows is None:
            output.report_suffix(written)
        if tally is not None and tally.assumed:
            self.inputs.note(f"{self.name}: {tally.assumed}")
        return status

    def format_of(self, begin: bytes, *, name: str = "", is_table: bool = False) -> str:
        """Return the format of the stream: that of --in, else detected from its first bytes and its name."""
        from frametool.formats.detect import detect

        otherwise, chosen = "columns" if is_table else "", self.within or self.chosen_format()
        return chosen or detect(begin, *options.STREAMED, name=name or self.path or "", otherwise=otherwise)

    def _outcomes(self, stream: Any, fmt: str, request: Request) -> tuple[Generator[Outcome], str, Diagnostics | None]:
        """Return the results of the rows: as columns of numbers, as poses in another format, or in place.

        Also returns the format of the results, and the diagnostics of the input format.
        """
        from frametool.formats.rows.pose_rows import is_turned
        from frametool.rows.shapes import POSE, Shape

        output, chosen = self.output, self.output.chosen
        if holds(fmt, "arrays") and (chosen is None or holds(chosen, "arrays")):
            return self._columns(stream, fmt, request), fmt, None
        listed = holds(fmt, "arrays") or (is_trajectory(fmt) and not FORMATS[fmt].is_table)
        is_kindred = chosen == "csv" and fmt in ("tsv", "semicolon")
        # a trajectory cannot hold more columns, or other ones
        is_rewritten = output.notations or output.style.place
        no_room = output.is_trajectory and bool(is_rewritten or request.operation.extras(Shape(POSE)))
        turns = output.style.axes and not output.notations and is_turned(output.style.changed(format=chosen or fmt))
        converts = not (is_kindred or fmt in RECORDS) and (chosen not in (None, fmt) or no_room or turns)
        if listed or converts:
            refuse(request.results.unwrap, KEPT_FORMAT)
            from frametool.cli.trees import answers
            from frametool.rows.conversion import FormatConverter

            target = chosen or (fmt if "poses" in FORMATS[fmt].writes and not output.notations else "csv")
            refuse(target not in FORMATS, f"-f {target} is for single results and records, not for a stream of {fmt}")
            request = request.with_results(default_notation=not output.notations)
            driver = FormatConverter(fmt, request, self.name, output.style.changed(format=target), answers(self.inputs))
            return driver.outcomes(stream, header=not self.inputs.no_header), target, driver.tally
        if fmt in RECORDS:
            return *self._records(stream, fmt, request, chosen or ""), None
        from frametool.rows.sources.tables import run_table

        return run_table(stream, fmt, request, source=self.name, header=not self.inputs.no_header), fmt, None

    def _steps(self, stream: Any, fmt: str, request: Request) -> Iterator[Step]:
        """Return the results of each block as poses, without writing them."""
        from frametool.cli.trees import answers
        from frametool.rows.samples import steps_of

        request = request.with_results(default_notation=True, notations=())
        if fmt in RECORDS:
            return steps_of(stream, fmt, request, self.name)
        header = not self.inputs.no_header
        return steps_of(stream, fmt, request, self.name, answers=answers(self.inputs), header=header)

    def _records(self, stream: Any, fmt: str, request: Request, chosen: str) -> tuple[Generator[Outcome], str]:
        """Return the results of records, in place or in the chosen format, and the format."""
        from frametool.rows.sources.records import run_records

        if chosen in ("", fmt):
            return run_records(stream, fmt, request, source=self.name), fmt
        if request.on_error == NULL and chosen not in ("csv", *RECORDS):
            raise click.UsageError(f"--on-error null: {chosen} cannot hold a row without a result; give skip")
        refuse(request.results.unwrap and holds(chosen, "arrays"), KEPT_FORMAT)
        by_format = holds(chosen, "arrays", "recording") and not self.output.notations
        request = request.with_results(default_notation=by_format)
        if table.holds(chosen, "recording"):
            request = request.with_results(place=None)  # fixes are written from ecef, or unchanged
        outcomes = run_records(stream, fmt, request, source=self.name, style=self.output.style)
        return written_by(self.output.writer(), outcomes, request.on_error), chosen

    def _columns(self, stream: Any, fmt: str, request: Request) -> Generator[Outcome]:
        """Return the results as columns of numbers, in the input's format or another format of columns."""
        from frametool.rows.sources.column_files import OtherColumns, run_columns

        output = self.output
        instead = "give -o FILE, or -f csv, or pipe it"
        refuse(output.path is None and sys.stdout.isatty(), f"{fmt} is no text for a terminal; {instead}")
        columns = open_columns(InputFile(self.path or "-", stream), fmt)
        style = output.style.changed(format=output.chosen or fmt)
        request = request.with_results(default_notation=not output.notations)
        if output.chosen and FORMATS[output.chosen].writer != FORMATS[fmt].reader:
            return OtherColumns([(columns, request, self.name)], style).outcomes()
        return run_columns(columns, request, style, source=self.name)

    def policy(self, name: str, counted: str = "line") -> BadRows:
        """Return the policy that reports and counts the bad rows of a source."""
        tell = partial(say_error, in_json=self.inputs.peek("format_name") == "json")
        return BadRows(name, self.inputs.on_error, most=self.inputs.max_errors, tell=tell, counted=counted)

    def _with_stream_options(self, request: Request, fmt: str, *, alone: bool) -> Request:
        """Add the options of the stream to the request; alone: True if the results are written, not collected."""
        inputs, output = self.inputs, self.output
        is_table = fmt not in RECORDS
        adds = bool(request.rows.poses) or request.operation.formula is None  # formulas alone append anyway
        if is_table and output.chosen not in RECORDS and adds and alone:
            request = request.with_results(keep=inputs.keep)
        if (is_table or request.operation.only_adds) and alone:
            request = request.with_results(prefix=inputs.prefix or "")
        if request.rows.poses:
            inputs.use("from_rep", *{*FORMATS[fmt].required_options} - {"stamps"})
            request = request.with_rows(columns=inputs.columns)
        several = not is_table and "," in ",".join(request.rows.columns)
        refuse(several, "--columns names one key of records, as detections.pose")
        if not holds(output.chosen or fmt, "arrays", "recording"):
            inputs.use("precision")
        place = output.style.changed(format=output.chosen or fmt).place
        on_error = SKIP if inputs.on_error == NULL and not alone else inputs.on_error  # no empty rows to collect
        return request._replace(on_error=on_error).with_results(place=place)

    def request(self, *, notations: tuple[Any, ...] = (), **fields: Any) -> Request:
        """Return the request for rows and records by the options.

        fields: further fields of Request and RowOptions
        """
        from frametool.rows.request import Request, ResultOptions, RowOptions

        inputs, style = self.inputs, self.output.style
        if self.window:
            inputs.use("start", "stop")
            fields["stamp_or_weight_column"] = fields.get("stamp_or_weight_column") or ""
        for name in ("values", "poses", "pose", "a", "b"):
            value = inputs.peek(name) or ()
            for text in [value] if isinstance(value, str) else value:
                bare = without_inverse(text)[0].strip()
                if not (bare.startswith("{") and ":" in bare):  # not a mapping, whose keys name the representation
                    inputs.use("from_rep")
        if is_on_earth := bool(style.place or self.place or any(map(inputs.peek, options.OF_EARTH))):
            from frametool.cli.earth_options import earth

            fields["earth"] = earth(inputs)
        fields = {
            "given": self.notation, "given_place": self.place, "degrees": style.degrees, "normalize": self.normalize,
            "offset_ns": 0 if inputs.reads_trees else inputs.time_offset or 0, "window": self.window, **fields,
        }  # fmt: skip
        rows = RowOptions(**{name: fields.pop(name) for name in RowOptions._fields if name in fields})
        results = ResultOptions(
            notations or self.output.notations, is_on_earth and not self.output.notations, place=style.place,
            precision=style.precision, keep_sign=style.keep_sign,
        )  # fmt: skip
        made = Request(rows=rows, results=results, **fields)
        self.output.set_camera_axes("", made.operation)
        return made

    def only_arguments(self, arguments: Sequence[str | Source | None]) -> None:
        """Mark --in as used if an argument is a file; raises a usage error if -i is set too."""
        refuse(self.path is not None, "-i FILE and arguments are two inputs; give one")
        if any(isinstance(each, str) and os.path.exists(each) for each in arguments):
            self.inputs.use("input_formats")

    def stream_request(self, arguments: Sequence[str], request: Request) -> Request | None:
        """Return the request for the stream if the only argument is `-`, a table, or an inverse of these; else None."""
        bare, is_inverse = without_inverse(arguments[0]) if arguments else ("-", False)
        if len(arguments) > 1 or (bare != "-" and (self.path or not self.has_table(bare))):
            return None
        return request.of_inverses() if is_inverse else request

    def write_results(self, argument: str | Source, request: Request, timed: dict[str, Any] | None = None) -> int:
        """Write the results of the records of one argument: inline, a file, or the stream of the command.

        timed: replaces the stamp of each result; {} removes it
        """
        if isinstance(argument, str) and (streamed := self.stream_request([argument], request)):
            return self.run(streamed)
        self.only_arguments([argument])
        values = values_of([argument], request, self.output)
        if timed is not None:
            from frametool.rows.plain import at_time

            values = (at_time(each, timed) for each in values)
        self.output.values(values)
        return 0

    def read_written(self, argument: str | Source | None, *, warned: bool = False) -> WrittenPose:
        """Read the single pose of an argument with its original representation, for a derivation.

        warned: its warnings were already written
        """
        if isinstance(argument, str):
            argument, is_inverse = without_inverse(argument)
            if is_inverse:
                return self.read_written(argument, warned=warned).turned()
        from frametool.rows.derivations import written_poses

        request = self.request()
        with inline_misuse(), heard_by(lambda *_: None) if warned else nullcontext():
            source = pose_source(one_argument(argument), request)
            found = written_poses(source, degrees=request.rows.degrees, normalize=request.rows.normalize)
        refuse(len(found) != 1, f"--explain derives one pose, {source.name} holds {len(found)}")
        if found[0].pose.covariance is not None:
            warn(f"{source.name}: --explain derives the pose alone; its covariance is left out")
        return found[0]

    def derive(self, operation: str, *parts: Any, **more: Any) -> int:
        """Write the derivation of an operation to the output."""
        from frametool.explain import derive

        made: Explanation = getattr(derive, operation)(self.plan, *parts, **more)
        self.output.text(made.render(self.inputs.explain))
        return 0


def open_columns(file: InputFile, fmt: str) -> Any:
    """Open a file of a format of columns of numbers."""
    file.format = fmt
    return import_module(FORMATS[fmt].reader).open_columns(file)


def is_bag(path: str) -> bool:
    """Return True for a bag, by its first bytes (for an empty file by its suffix), or for the folder of one."""
    if not os.path.isfile(path):
        from frametool.formats.detect import of_folder

        return of_folder(path) in BAGS
    with open(path, "rb") as file:
        head = file.read(HEAD)
    return bool(re.match(b"|".join(_MAGICS), head, re.DOTALL) if head else table.by_suffix(path, BAGS))


def significant(precision: int | None) -> int | None:
    """Return the number of significant digits of --precision for derivations; None for all."""
    from frametool.explain.run import DIGITS

    refuse(precision == 0, "--precision counts significant digits with --explain; give 1 or more, or full")
    return DIGITS if precision is None else None if precision == options.FULL else precision


def one_argument(argument: str | Source | None) -> str | Source:
    """Return an argument with a record unchanged; raises click.UsageError for standard input, which is a stream."""
    refuse(argument in (None, "-"), f"standard input is a stream; {ONE_RECORD}")
    return argument or ""
