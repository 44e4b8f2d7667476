"""`frametool compare`: how far trajectories are from a reference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import OPTIONAL, Inputs, argument, command_named, option, refuse
from frametool.cli.comparing import comparisons, error_options, pairing_options, trajectory_options
from frametool.cli.options import file_with, list_options, reading_options, suffix_of
from frametool.cli.output import Output
from frametool.cli.sink import refuse_existing, writing
from frametool.cli.stderr import say
from frametool.errors import FrametoolError
from frametool.stream.faults import ROWS_SKIPPED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.fit.comparison import Comparison
    from frametool.fit.numbers import Limit

EXCEEDED, TROUBLE = 1, 2
EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 rows skipped, 5 file; --fail: 0 within, 1 exceeded, 2 error."
TABLES = ("csv", "markdown", "latex")
REPORTS = {".html": "html", ".htm": "html", ".svg": "svg"}


def _format_of(path: str | None) -> str:
    """Return the format of a report by its suffix, "" for anything else."""
    return REPORTS.get(suffix_of(path or ""), "")


def _read_limits(text: str) -> list[Limit]:
    from frametool.fit.numbers import parse_limits

    return parse_limits(text)


@command_named("compare", epilog=EXIT_CODES)
@argument("ref")
@argument("est", nargs=-1, required=True, metavar="EST..")
@pairing_options
@error_options
@option("--rows [=ate|rpe|kitti]", "one row per pair, step or segment: CSV, JSON", OPTIONAL["--rows"])
@option("--explain", "the formulas with this run's numbers", ("text",), under="Result")
@option("--fail LIMIT,..", "exit with 1 if a limit is exceeded: ate>5cm", _read_limits, name="limits")
@option("--report FILE.html|svg", "also write a report in one file; with -o instead", file_with(*REPORTS))
@trajectory_options
@reading_options()
@list_options("markdown", "latex")
def command(inputs: Inputs) -> int:
    """Compare trajectories with a reference: absolute and relative errors.

    \b
      frametool compare truth.tum odometry.tum --offset auto
      frametool compare truth.tum truth.tum mono.tum --align sim3 -f markdown
      frametool compare antenna.csv truth.tum --mount auto --report error.html
      frametool compare truth.tum mono.tum --align sim3 --fail 'ate>1m,paired<90%'

    REF and EST are trajectories or positions in any format (help trajectories).
    """
    path, chosen, rows, explain, report = inputs.output, inputs.format_name, inputs.rows, inputs.explain, inputs.report
    limits, est = inputs.limits, inputs.est
    instead = path if chosen is None and _format_of(path) else None
    for name in filter(None, (report, instead)):
        refuse_existing(name, force=inputs.force)
    refuse(instead and rows, "--rows are CSV or JSON, no picture; write them with -f, or leave them out")
    if len(est) > 1 and "svg" in (_format_of(report), _format_of(instead)):
        raise click.UsageError("an SVG shows one comparison; write .html for several")
    if explain and (rows or instead or chosen not in (None, "text")):
        raise click.UsageError("--explain writes text; leave --rows, -f and pictures out")
    output = Output(inputs, "report", otherwise="text")
    try:
        found, skipped = comparisons(inputs.ref, est, inputs)
        from frametool.fit.numbers import numbers
        from frametool.view.reports import write_explanation

        every = [numbers(each) for each in found]
        asked = [(each, limit) for each in every for limit in limits or ()]
        passed = [(each, limit, now) for each, limit in asked if (now := limit.passed(each)) is not None]
        for name in filter(None, (report, instead)):
            _write_report(found, name, force=inputs.force)
        if explain:
            output.text("\n".join(map(write_explanation, every)))
        elif not instead:
            _write(output, found, every, rows)
    except FrametoolError as error:
        if limits:
            error.exit_code = TROUBLE
        raise
    for each, limit, now in passed:
        say(f"limit exceeded: {each['est']}: {limit.name} is {now:.6g}, {limit.text}")
    return EXCEEDED if passed else (TROUBLE if limits else ROWS_SKIPPED) if skipped else 0


def _write_report(found: Sequence[Comparison], path: str, *, force: bool) -> None:
    """Write the pictures of a comparison, with the command that made them."""
    import shlex

    from frametool.view.comparison_page import write_report

    with writing(path, force=force) as write:
        write(write_report(found, _format_of(path), shlex.join(["frametool", *click.get_current_context().obj])))


def _write(output: Output, found: Sequence[Any], every: list[dict[str, Any]], rows: str | None) -> None:
    """Write rows, a table, or each comparison by itself."""
    from frametool.fit.numbers import rows as rows_of
    from frametool.view.reports import write_comparison, write_table

    fmt = output.style.format
    if rows:
        several = len(found) > 1
        records = [{"est": each.names[1]} | row if several else row for each in found for row in rows_of(each, rows)]
        output.style = output.style.changed(format="csv" if fmt == "text" else fmt)
        output.report(records)
    elif fmt in TABLES or (fmt == "text" and len(every) > 1):
        output.text(write_table(every, fmt))
    elif fmt == "text":
        output.text(write_comparison(every[0]))
    else:
        output.report(every)
