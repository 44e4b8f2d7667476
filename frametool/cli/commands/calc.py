"""`frametool calc`: expressions over poses, points and numbers."""

from __future__ import annotations

import os
import re
import sys
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from frametool.calc.evaluate import BETWEEN_WORDS, Scope, completions, evaluate_line, read_line, term_of
from frametool.calc.functions import ANGLES, FUNCTIONS, LIST, NUMBER, POINT, POSE, VECTOR, Term, numbers_in, wanted
from frametool.calc.parser import RADIAN, Line, mentions_row, walk
from frametool.cli.command import Command, Inputs, Text, argument, command_named, option, refuse
from frametool.cli.commands.help import topic
from frametool.cli.options import COLUMN, OF_EARTH, pose_result_options, reading_options
from frametool.cli.poses import source_of
from frametool.cli.sink import say_error, show, write_lines
from frametool.cli.streaming import Task, stream_options
from frametool.cli.trees import load_tree
from frametool.documents.source import HEAD, InputFile, decode, opened
from frametool.errors import FrametoolError, ValueInvalid, printable
from frametool.formats.rows.csv import write_poses as write_rows
from frametool.formats.table import FORMATS, is_trajectory
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style
from frametool.grammar.result import write_poses as write_documents
from frametool.rows.faults import STOP, Fault

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.cli.output import Output
    from frametool.rows.request import Request


LIKE_A_FILE = r"(?!row\.)[^\s(){}\[\]*<>\"']*\.[A-Za-z]\w*"


def file_named_in(inputs: Inputs, text: str, scope: Scope) -> Term | None:
    """Bind the name of `NAME=FILE` (`-`: standard input) to the file's content and return that; None for other texts.

    A text that looks like a file name must be an existing file.  Raises FileProblem, FormatError.
    """
    head, equals, tail = text.partition("=")
    name, path = head.strip(), tail.strip()
    if not equals or not name.isidentifier() or not path:
        return None
    if path != "-" and not os.path.exists(path) and not re.fullmatch(LIKE_A_FILE, path):
        return None
    read_line(f"{name}=0")  # refuses a name that is taken
    from frametool.calc.rows import poses_of_table, values_of_document

    fmt = "yaml"
    if path != "-":
        from frametool.formats.detect import detect

        with opened(path) as file:  # neither a table nor a document: a tree
            fmt = detect(file.read(HEAD), "tree", "rows", "records", name=path, otherwise=fmt)
    found, source = None, None
    if "rows" in FORMATS[fmt].reads:
        found = poses_of_table(path, fmt, normalize=scope.normalize, degrees=scope.degrees)
    elif "records" in FORMATS[fmt].reads:
        source = source_of(path)
        found = values_of_document(source, scope)
    if found is None:
        from frametool.formats.load import load_sources

        tree = load_sources([source]) if source and path == "-" else load_tree(inputs, path, streams=True)
        found = term_of(name, tree)
    scope.names[name] = found._replace(text=name)
    return scope.names[name]


def _offer_words(ctx: click.Context, incomplete: str) -> Mapping[str, str]:
    """Offer completions of the last word."""
    scope, trees, inputs = Scope(), ctx.params.get("trees"), Inputs(ctx.params, {})
    scope.tree = load_tree(inputs, trees[0], trees[1:]) if trees else None
    for each in ctx.params.get("arguments") or ():
        file_named_in(inputs, each, scope)
    cut = max(incomplete.rfind(mark) for mark in BETWEEN_WORDS) + 1
    before, word = incomplete[:cut], incomplete[cut:]
    return dict.fromkeys((before + each for each in completions(scope, word, before)), "")


EXPRESSION = Text(offers=_offer_words)


def plain_result(term: Term, style: Style) -> Any:
    """Convert a value to a result: a pose to a Result, a number to a float, others to a mapping."""
    type_, numbers = term.type, numbers_in(term, degrees=style.degrees)
    frame = {} if type_.target is None else {"frame": type_.target}
    if type_.kind == POSE:
        return Result(Pose.of(numbers, type_.source, type_.target))
    if type_.kind == NUMBER:
        return float(numbers[0])
    if type_.kind == ANGLES:
        return frame | {"rpy_deg" if style.degrees else "rpy": list(numbers)}
    if type_.kind == POINT and style.place is not None:
        from frametool.grammar.place import point_entry

        return point_entry(type_.target, numbers, style.place)
    return frame | {type_.kind: list(numbers)}


def value_texts(terms: Iterable[Term], style: Style) -> Iterator[str]:
    """Yield the text of each value in the format of a style, with its separator.

    Each is yielded before the next one is computed, except for the rows of a table, which share their columns.
    """
    values = (item for term in terms for item in (term.items if term.type.kind == LIST else (wanted(term),)))
    if style.format == "csv":
        yield write_rows((_cells(value, style) for value in values), style)
        return
    before = ""
    for value in values:
        text = _for_people(value, style) if style.format == "text" else _for_programs(value, style)
        if before and style.format == "yaml":
            yield "---\n"
        elif before and style.format == "text" and (before.count("\n") > 1 or text.count("\n") > 1):
            yield "\n"
        yield text
        before = text


def _for_people(term: Term, style: Style) -> str:
    """Return one value as text for people."""
    from frametool.view.text import write_points, write_poses

    def text(values: Sequence[float]) -> str:
        return "  ".join(style.number(value + 0.0) for value in values)

    type_, result = term.type, plain_result(term, style)
    radians, degrees = (text(numbers_in(term, degrees=each)) for each in (False, True))
    frame = "" if type_.target is None else f" in {printable(type_.target)}"
    if type_.kind == POSE and (type_.target is None) == (type_.source is None):
        return write_poses([result], style)
    if type_.kind == POSE:
        return f"{type_}\n{write_poses([Result(result.pose._replace(name=None, parent=None), result.extras)], style)}"
    if type_.kind in (POINT, VECTOR):  # a geodetic position is a mapping
        return (write_points if type_.kind in result else write_documents)([result], style)
    if type_.unit == RADIAN:
        return f"{degrees} deg  ({radians} rad)\n" if style.degrees else f"{radians} rad  ({degrees} deg)\n"
    if type_.kind == NUMBER:
        return f"{radians} {type_.unit}".rstrip() + "\n"
    if type_.kind == ANGLES:
        return f"rpy  {radians}  rad{frame}\n     {degrees}  deg\n"
    twist = term.at(None)
    return f"linear  {text(twist[:3])}  m\nangular  {text(twist[3:])}  rad{frame}\n"


def _for_programs(term: Term, style: Style) -> str:
    """Return one value as a document or line of a machine-readable format."""
    fmt, result, kind = style.format, plain_result(term, style), term.type.kind
    if kind == POSE and is_trajectory(fmt):
        from frametool.rows.conversion import poses_text

        return poses_text([result], style)
    held = {"arrays": "columns of numbers", "recording": "messages"}
    if what := next((held[each] for each in FORMATS[fmt].writes if each in held), ""):
        raise ValueInvalid(f"{fmt} holds {what}: calc writes rows of -i in it, not single values")
    if kind not in (POSE, POINT, VECTOR) and fmt not in ("json", "yaml"):
        raise ValueInvalid(f"{fmt} has no form for {term.type.named}; write it as text, json, yaml or csv")
    module = import_module(FORMATS[fmt].writer)
    return str((module.write_poses if kind == POSE else module.write_points)([result], style))


def _cells(term: Term, style: Style) -> Any:
    """Return one value as a row of a table: each number in its own column."""
    from frametool.calc.rows import NAMES, RESULT

    result = plain_result(term, style)
    if isinstance(result, Result) or (style.place is not None and term.type.kind == POINT):
        return result
    if isinstance(result, float):
        return {RESULT: result}
    *frame, (key, numbers) = result.items()
    names = [name + "_deg" * (key == "rpy_deg") for name in NAMES[term.type.kind]]
    return dict(frame) | dict(zip(names, numbers, strict=True))


def displayed(values: Iterable[tuple[Line, Term]]) -> Iterator[Term]:
    """Yield the values to print: those without a name, and that of the last line."""
    last = None
    for line, term in values:
        last = term if line.name else None
        if not line.name:
            yield term
    if last is not None:
        yield last


def calculate_lines(stream: Task, scope: Scope) -> int:
    """Write the value of each line of standard input, and return the exit status.

    Stops at the first error; with --on-error skip it continues after errors and returns 3.
    """
    bad, count = stream.policy("stdin"), 0

    def values() -> Iterator[tuple[Line, Term]]:
        nonlocal count
        for number, data in enumerate(iter(sys.stdin.buffer.readline, b"") if sys.stdin else (), 1):
            text = decode(data, "stdin").rstrip("\r\n")
            if not text.strip() or text.lstrip().startswith("#"):
                continue
            count += 1
            try:
                line = read_line(text)
                yield line, evaluate_line(line, scope)
            except FrametoolError as error:
                if bad.on_error == STOP:
                    raise
                bad.take([Fault(number, str(error.details().get("column", "")), error)])

    stream.output.pieces(value_texts(displayed(values()), stream.output.style))
    return bad.finish(count)


LONGEST_HISTORY = 1000  # lines


def run_prompt(inputs: Inputs, scope: Scope, output: Output) -> int:
    """Evaluate lines until Ctrl-D; continue after errors; Ctrl-C discards the line."""
    refuse(output.path is not None, "-o FILE is for expressions on the command line or in a pipe, not for the prompt")
    prompt = "> " if sys.stdout.isatty() else ""
    with _readline(scope):
        while True:
            try:
                line = input(prompt)
                if (word := line.strip()) in ("exit", "quit"):
                    return 0
                if word == "help":
                    show(topic("calc"), paged=False)
                elif word and file_named_in(inputs, line, scope) is None:
                    output.pieces(value_texts([evaluate_line(read_line(line), scope)], output.style))
            except EOFError:
                if prompt:
                    write_lines("")
                return 0
            except KeyboardInterrupt:
                write_lines("")
            except click.UsageError as error:
                write_lines(f"frametool: {error.format_message()}")
            except FrametoolError as error:
                say_error(error)


@contextmanager
def _readline(scope: Scope) -> Iterator[None]:
    """Complete words and keep a history while lines are read, if readline is available."""
    try:
        import readline
    except ImportError:
        yield
        return
    state = os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state")  # as the XDG base directories
    path = os.path.join(state, "frametool_history")

    def complete(text: str, state: int) -> str | None:
        found = completions(scope, text, readline.get_line_buffer()[: readline.get_begidx()])
        return found[state] if state < len(found) else None

    readline.set_completer_delims(BETWEEN_WORDS)
    readline.set_completer(complete)
    is_editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if is_editline else "tab: complete")
    readline.set_history_length(LONGEST_HISTORY)
    with suppress(OSError):
        readline.read_history_file(path)
    try:
        yield
    finally:
        readline.set_completer(None)
        with suppress(OSError):
            os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
            readline.write_history_file(path)


KINDS = ("point", "vector", "pose")


class CalcCommand(Command):
    """The command, whose arguments may be expressions that begin with a minus: -(..), -[..], -norm(..)."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put a space before arguments that begin with a minus, which click would take for options."""
        shielded = []
        for each in args:
            behind = each[1:].lstrip("- ")
            name, bracket, _ = behind.partition("(")
            is_signed = behind[:1] in tuple('([{"') or (bracket and name in FUNCTIONS)
            shielded.append(f" {each}" if each.startswith("-") and is_signed else each)
        return super().parse_args(ctx, shielded)


@command_named("calc", own=("input_path",), cls=CalcCommand)
@argument("arguments", EXPRESSION, nargs=-1, metavar="[NAME=FILE ..] [EXPR ..]")
@option("--tree FILE", "the tree of look-ups; may be repeated  [default: FRAMETOOL_TREE]", name="trees", multiple=True)
@option("-e NAME=EXPR", "a result in its own columns: NAME, NAME_x ..; may be repeated; also EXPR, @FILE",
    EXPRESSION, name="expressions", multiple=True)
@option("--as", "what the rows are  [default: as they look]", KINDS, name="kind")
@option("--time-column NAME", "of the time of @ row  [default: the one that looks so]", COLUMN, under="Time")
@stream_options
@pose_result_options("points")
@reading_options
def calc_command(inputs: Inputs) -> int:
    """Calculate with poses whose frames are checked like units.

    \b
      frametool calc --tree robot.yaml 'inv(map<-base_link) * (map<-tool)'
      frametool calc --tree robot.yaml '(map<-lidar) * [1, 0, 0]' 'inv(map<-tool)'
      frametool calc d=drive.yaml 'dist(d[map<-box @ 1s], d[map<-box @ 3s])'
      frametool calc --tree robot.yaml '(map<-lidar) * row' -i cloud.csv
      frametool calc -e 'd=norm(trans(row))' -e 'heading=rpy(row)' -i walk.tum

    `frametool help calc` is the language on one screen. NAME=FILE gives a name to a tree, a pose, or a list of poses;
    NAME=EXPR to a value. An expression with row is computed for each row of -i FILE or standard input and replaces
    what the row was. Without an expression a terminal gets a prompt; from a pipe one expression a line is read.
    """
    task = Task(inputs, "points")
    output = task.output
    scope = Scope(degrees=inputs.deg, normalize=inputs.normalize)
    if any(map(inputs.peek, OF_EARTH)):
        from frametool.cli.earth_options import earth

        scope.earth = earth(inputs)
    alone = () if inputs.arguments == ("-",) else inputs.arguments  # a single - is standard input
    texts = [text.strip() for text in alone if file_named_in(inputs, text, scope) is None]
    named = [(InputFile(each[1:]).text if each.startswith("@") else each).strip() for each in inputs.expressions]
    lines = [read_line(text) for text in (*texts, *named)]
    if inputs.trees:
        scope.tree = load_tree(inputs, inputs.trees[0], inputs.trees[1:], streams=True)
    elif os.environ.get("FRAMETOOL_TREE"):  # only read if an expression has a lookup without a tree's name
        asks = any(branch.kind == "lookup" and not branch.value[1] for line in lines for branch in walk(line.tree))
        scope.tree = load_tree(inputs, ".", streams=True) if asks or not lines else None
    if not lines:
        inputs.use(*OF_EARTH)  # any line may use them
        refuse(task.path is not None, "-i FILE needs an expression over row")
        is_prompt = sys.stdin is not None and sys.stdin.isatty()
        return run_prompt(inputs, scope, output) if is_prompt else calculate_lines(task, scope)
    if task.path is not None or any(mentions_row(line.tree) for line in lines):
        return task.run(_over_rows(lines, len(texts), scope, task))
    values = ((line, evaluate_line(line, scope)) for line in lines)
    output.pieces(value_texts(displayed(values), output.style))
    return 0


def _over_rows(lines: Sequence[Line], behind: int, scope: Scope, task: Task) -> Request:
    """Return the request for rows: the results of -e, or of the last line, are written; other lines bind names.

    behind: the number of lines that precede those of -e
    """
    from frametool.calc.rows import RowExpressions
    from frametool.rows.request import Operation, Timed

    inputs = task.inputs
    results = [line for at, line in enumerate(lines) if at >= behind or not line.name] or [lines[-1]]
    names = [line.name for line in results]
    refuse(len(names) > 1 and not all(names), "rows get one result, or several with names: -e NAME=EXPR -e NAME=EXPR")
    refuse(twice := next((name for name in names if name and names.count(name) > 1), ""), f"-e {twice}= appears twice")
    formula = RowExpressions(results, [line for line in lines if line not in results], scope, task.output.style)
    formula.check((inputs.kind,) if inputs.kind else ("pose", "point", "vector"))
    timed = Timed(inputs.time_column or "") if formula.needs_time else None
    counters = not any(any(map(str.isdecimal, tree.frames)) for _, tree in formula.scope.trees)
    return task.request(
        operation=Operation(moves=True, formula=formula), timed=timed, earth=formula.scope.earth,
        kind=inputs.kind or "", frame_is_counter=counters,
    )  # fmt: skip
