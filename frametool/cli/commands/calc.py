"""`frametool calc`: expressions over poses, points and numbers."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from frametool.calc.evaluate import Scope, evaluate_line, read_line
from frametool.calc.functions import FUNCTIONS
from frametool.calc.parser import Line, mentions_row, walk
from frametool.cli.calc_input import Expression, calculate_lines, file_named_in, talk, value_texts
from frametool.cli.command import Command, Inputs, argument, command_named, option, refuse
from frametool.cli.options import ColumnNames, reading_options, result_options, whole_pose_options
from frametool.cli.output import Output
from frametool.cli.streaming import Stream, stream_options
from frametool.cli.trees import load_tree
from frametool.documents.source import read_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    import click

    from frametool.calc.rows import RowExpressions
    from frametool.calc.values import Term
    from frametool.stream.request import Request

KINDS = ("point", "vector", "pose")


class CalcCommand(Command):
    """A command whose arguments may be expressions that begin with a minus: -(..), -[..], -norm(..)."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put a blank before such arguments, which click takes for options."""
        return super().parse_args(ctx, [f" {each}" if _begins_with_minus(each) else each for each in args])


def _begins_with_minus(argument: str) -> bool:
    """Distinguish an expression with a sign from an option."""
    behind = argument[1:].lstrip("- ")
    name, bracket, _ = behind.partition("(")
    return argument.startswith("-") and (behind[:1] in tuple('([{"') or (bool(bracket) and name in FUNCTIONS))


@command_named("calc", own=("input_path",), cls=CalcCommand)
@argument("arguments", Expression(), nargs=-1, metavar="[NAME=FILE ..] [EXPR ..]")
@option("--tree FILE", "the tree of look-ups; may be repeated  [default: FRAMETOOL_TREE]", name="trees", multiple=True)
@option("-e NAME=EXPR", "a result in its own columns: NAME, NAME_x ..; may be repeated; also EXPR, @FILE",
    Expression(), name="expressions", multiple=True)
@option("--as", "what the rows are  [default: as they look]", KINDS, name="kind")
@option("--time-column NAME", "of the time of @ row  [default: the one that looks so]", ColumnNames(), under="Time")
@stream_options
@whole_pose_options
@result_options("points")
@reading_options(streams=True)
def command(inputs: Inputs) -> int:
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
    stream, output = Stream(inputs), Output(inputs, "points")
    scope = Scope(degrees=inputs.deg, normalize=inputs.normalize)
    if any(map(inputs.peek, ("origin", "local_axes", "zone"))):
        from frametool.cli.earth import earth

        scope.earth = earth()
    texts = list(_expressions(inputs.arguments, inputs.expressions, scope))
    lines = [read_line(text) for text, _ in texts]
    scope.tree = _tree(inputs.trees, lines)
    if not lines:
        inputs.ask("origin", "local_axes", "zone")  # whatever comes
        return _without_expression(stream, output, scope)
    if stream.path is not None or any(mentions_row(line.tree) for line in lines):
        formula = _over_rows(lines, [is_option for _, is_option in texts], scope, output)
        formula.check((inputs.kind,) if inputs.kind else ("pose", "point", "vector"))
        request = _request(formula, inputs)
        return stream.run(request, output)
    output.pieces(value_texts(_results(lines, scope), output.style))
    return 0


def _expressions(arguments: Iterable[str], expressions: Iterable[str], scope: Scope) -> Iterator[tuple[str, bool]]:
    """Yield the expressions in order, and whether -e gave them; names of files are bound."""
    for text in () if tuple(arguments) == ("-",) else arguments:  # a lone - is standard input, read in any case
        if file_named_in(text, scope) is None:
            yield text.strip(), False
    for text in expressions:
        yield (read_text(text[1:]) if text.startswith("@") else text).strip(), True


def _tree(files: Sequence[str], lines: Sequence[Line]) -> Any:
    """Read the tree of bare look-ups: --tree, else what FRAMETOOL_TREE names, if any is asked for."""
    if files:
        return load_tree(files[0], files[1:], streams=True)
    asks = any(branch.kind == "lookup" and not branch.value[1] for line in lines for branch in walk(line.tree))
    return load_tree(".", streams=True) if os.environ.get("FRAMETOOL_TREE") and (asks or not lines) else None


def _results(lines: Sequence[Line], scope: Scope) -> Iterator[Term]:
    """Yield the values of expressions; one that is bound to a name is shown only where nothing follows it."""
    for at, line in enumerate(lines):
        term = evaluate_line(line, scope)
        if not line.name or at == len(lines) - 1:
            yield term


def _without_expression(stream: Stream, output: Output, scope: Scope) -> int:
    """Read expressions from a pipe, one a line, or talk at a terminal."""
    refuse(stream.path is not None, "-i FILE needs an expression over row")
    if sys.stdin is not None and sys.stdin.isatty():
        return talk(scope, output)
    return calculate_lines(stream, output, scope)


def _over_rows(lines: Sequence[Line], flags: Sequence[bool], scope: Scope, output: Output) -> RowExpressions:
    """Part lines into those whose results are written and those that only bind names."""
    from frametool.calc.rows import RowExpressions

    marked = [line for line, is_option in zip(lines, flags, strict=True) if is_option or not line.name]
    results = marked or [lines[-1]]
    names = [line.name for line in results]
    refuse(len(names) > 1 and not all(names), "rows get one result, or several with names: -e NAME=EXPR -e NAME=EXPR")
    refuse(twice := next((name for name in names if name and names.count(name) > 1), ""), f"-e {twice}= is given twice")
    bindings = [line for line in lines if line not in results]
    return RowExpressions(results, bindings, scope, output.style)


def _request(formula: RowExpressions, inputs: Inputs) -> Request:
    """Return what is asked of the rows."""
    from frametool.stream.request import Operation, Request
    from frametool.stream.stamp_source import Timed

    timed = Timed.of_rows(inputs.time_column or "") if formula.needs_time else None
    counters = not any(frame.isdecimal() for _, tree in formula.scope.trees for frame in tree.frames)
    return Request(
        Operation(moves=True, formula=formula), kind=inputs.kind or "", degrees=inputs.deg,
        normalize=inputs.normalize, timed=timed, frame_is_counter=counters, earth=formula.scope.earth,
    )  # fmt: skip
