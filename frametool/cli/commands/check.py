"""Inspect files: `check` finds mistakes, `diff` differences, `monitor` gaps; `formats` explains file formats."""

from __future__ import annotations

import sys
from functools import partial
from math import radians
from typing import TYPE_CHECKING

from frametool.cli import options
from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse, refuse_two_readers
from frametool.cli.output import Output
from frametool.cli.sink import folded, in_colour, say, say_error, say_first, show, writing
from frametool.cli.trees import FRAME, frame_name, load_sides, lookup_time_ns, opened, report_files
from frametool.errors import Finding, FormatError, listing, warn
from frametool.formats.table import FORMATS, format_entry
from frametool.lint.monitor import monitor
from frametool.lint.rules import RULES, WRITERS, check, github_command, level
from frametool.lint.tree_diff import Tolerance, diff, entry, parse_tolerance

if TYPE_CHECKING:
    from collections.abc import Sequence

    import click

    from frametool.fit.blunders import Measurement
    from frametool.formats.load import FrameFile

FAILED = 1
MARKS = (r"(?m)^\S.*?: (?P<red>error): ", r"(?m)^\S.*?: (?P<magenta>warning): ")


def _rules(formatter: click.HelpFormatter, everything: bool) -> None:
    """Write the rules, with --help-all their levels and meanings."""
    if everything:
        with formatter.section("Rules"):
            formatter.write_dl([(f"{rule} ({level})", about) for rule, (level, about) in RULES.items()])
    else:
        formatter.write_text(f"{len(RULES)} rules, explained by --help-all: {', '.join([*RULES][:6])} ..")


@command_named("check", lists=_rules)
@argument("files", FILE, nargs=-1, required=True)
@option("-f --format", "format of the findings", (*WRITERS,), name="fmt", default="text")
@option("--strict", "exit with 1 for warnings too")
@option("--measured FILE", "compare these measurements (help solve) too", excludes=("each",), multiple=True)
@option("--tolerance LENGTH,ANGLE", "their allowed deviation  [3 sigmas, or 10mm,1deg]", requires=("measured",),
        kind=partial(parse_tolerance, otherwise=Tolerance(0.01, radians(1.0))))  # fmt: skip
@option("--each", "check each file separately; one without frames is a warning")
@options.file_options
def check_command(inputs: Inputs) -> int:
    """Look for mistakes in FILES, trees and recordings, read as one tree.

    \b
      frametool check robot.yaml
      frametool check drive.yaml --strict
      frametool check robot.yaml --measured measurements.yaml
      frametool check robot.yaml drive.yaml -f json || true
      frametool check --each robot.yaml arm.urdf camchain.yaml

    Each finding is one line: file:line:column: level: message [rule]. The exit code is 1 if there is an error, with
    --strict also for a warning; notes never fail. - is standard input, also what `ros2 topic echo /tf` prints.
    """
    files, measured, normalize = inputs.files, inputs.measured, inputs.normalize
    fmt, strict = inputs.fmt, inputs.strict
    refuse_two_readers((*files, *measured))
    findings: list[Finding] = []
    if inputs.each:  # a file without frames, or of an unknown format, is a warning
        for number, name in enumerate(files):
            try:
                recordings = opened(inputs, [name], behind=number, of=len(files))
            except FormatError as error:
                findings.append(Finding("no-frames", error.message, error.source, error.line or 1, 1))
            else:
                findings += check(recordings, normalize=normalize, others=True)
                report_files(inputs, recordings)
    else:
        count = len(files) + len(measured)
        rows: list[Measurement] = []
        if measured:
            from frametool.rows.measurements import read_measurements

            recordings = opened(inputs, measured, behind=len(files), of=count)
            rows = read_measurements(recordings, normalize=normalize)
            report_files(inputs, recordings)
        recordings = opened(inputs, files, of=count)
        findings = _with_loops(recordings, rows, inputs.tolerance, normalize=normalize)
        report_files(inputs, recordings)
    text = WRITERS[fmt](findings)
    with writing(None) as write:
        on_terminal = fmt == "text" and sys.stdout.isatty()
        write(in_colour("\n".join(map(folded, text.split("\n"))), MARKS) if on_terminal else text)
    counts = {kind: sum(level(each) == kind for each in findings) for kind in ("error", "warning", "note")}
    summary = ", ".join(f"{count} {kind}{'s' * (count != 1)}" for kind, count in counts.items() if count)
    if summary or (fmt == "text" and sys.stdout.isatty()):
        say(summary or f"{listing(files)}: no findings ({len(RULES)} rules)")
    return FAILED if counts["error"] or (strict and counts["warning"]) else 0


def _with_loops(
    files: Sequence[FrameFile], rows: Sequence[Measurement], tolerance: Tolerance | None, *, normalize: bool
) -> list[Finding]:
    """Return the findings on files, then the measurements that do not agree; report those that were not compared."""
    if not rows:
        return check(files, normalize=normalize)
    from frametool.fit.blunders import disagreements
    from frametool.frames.lookups import FrameTree

    tree = FrameTree()
    findings = check(files, normalize=normalize, tree=tree)
    found, missing, unconnected = disagreements(tree, rows, tolerance)
    if missing:
        warn(f"frames that the tree does not have, or that move; not compared: {listing(missing)}")
    if unconnected:
        warn(f"{unconnected} of {len(rows)} measurements not compared: their frames are not connected by static frames")
    return [*findings, *found]


DIFFERENT, TROUBLE = 1, 2
EXIT_CODES = "Exit codes: 0 the same, 1 different, 2 trouble of any kind, with files too."


@command_named("diff", epilog=EXIT_CODES)
@argument("a", FILE)
@argument("b", FILE)
@option("--with-a FILE", "merge this file into A; may be repeated", multiple=True)
@option("--with-b FILE", "merge this file into B; may be repeated", multiple=True)
@option("--at TIME", "compare at this time: seconds, nanoseconds with ns  [default: the latest of each]",
        options.read_time)  # fmt: skip
@option("--seen-from FRAME", "also show motion as seen from this frame  [default: the root of A]", FRAME)
@option("--tolerance LENGTH,ANGLE", "largest difference that is ignored, e.g. 1mm,0.1deg  [default: 1e-9 m, 1e-9 rad]",
    parse_tolerance, default=Tolerance())  # fmt: skip
@option("--all", "also list the frames that did not move", name="everything")
@options.file_options
@options.list_options("github")
def diff_command(inputs: Inputs) -> int:
    """Compare two trees, calibrations or recordings, A and B, in any formats.

    \b
      frametool diff robot.yaml robot.yaml
      sed 's/0.285/0.3/' robot.yaml | frametool diff - robot.yaml --tolerance 9mm
      frametool diff drive.yaml drive.yaml --at 2.5 --seen-from base_link

    Lists frames that only one has, frames with another parent, and for all others how far they moved from A to B: in
    their own parent, and as seen from the root, so that two structures of one robot can be compared. The largest motion
    comes first, frames that only moved with their parent last. Signs of quaternions and the order of names are ignored.
    Cameras of both files whose intrinsics differ are listed with the numbers of A -> B.
    Moving frames are compared at their latest time and sample by sample, or with --at at one time.

    A and B are files, - for standard input, or . for the file that FRAMETOOL_TREE names. --in and --frames are taken in
    the order of the files: A, those of --with-a, B, those of --with-b; one alone applies to both.
    """
    output = Output(inputs, "report", otherwise="text")
    (one, of_one), (other, of_other) = load_sides(inputs, (inputs.a, *inputs.with_a), (inputs.b, *inputs.with_b))
    start = inputs.seen_from and frame_name(inputs.seen_from, one)
    comparison = diff(one, other, at_ns=lookup_time_ns(inputs.at), seen_from=start, tolerance=inputs.tolerance)
    inputs.note(*comparison.notes)
    differences = [*comparison.differences, *(comparison.unmoved if inputs.everything else ())]
    if output.style.format == "github":
        from frametool.formats.load import lines_of

        # each difference has the line of its frame in B, or else in A
        known = {each.frame: of_other.get(each.frame) or of_one.get(each.frame) for each in comparison.differences}
        placed = {frame: place for frame, place in known.items() if place is not None}
        where = dict(zip(placed, lines_of([*placed.values()]), strict=True))
        commands = []
        for each in comparison.differences:
            file, line = where.get(each.frame, ("", 0))
            commands.append(github_command("error", each.sentence, file=file, line=line, title=each.kind))
        output.text("".join(commands))
    elif output.style.format == "text":
        from frametool.view.reports import write_diff

        output.text(write_diff(differences))
    else:
        output.report(list(map(entry, differences)))
    if comparison.uncompared:
        count = len(comparison.uncompared)
        say(f"{count} frame{'s' * (count != 1)} not compared: no data in A and B; --at chooses another time")
        return TROUBLE
    return DIFFERENT if comparison.differences else 0


MOST_REPORTED = 3  # frames that are published on the topics of two robots
YEAR_S = 31_557_600


@command_named("monitor")
@argument("recording", FILE)
@argument("frames", FRAME, nargs=-1, metavar="[TARGET SOURCE]")
@option("--with FILE", "read this file too; may be repeated", name="more", multiple=True, under="Files")
@options.offset_option
@options.file_options
@options.result_options("report")
def monitor_command(inputs: Inputs) -> int:
    """Print the rate, count, first and last stamp, largest gap, delay and jumps of each edge of RECORDING.

    \b
      frametool monitor drive.yaml
      frametool monitor drive.yaml map box --format json
      frametool sim follow --duration 2 --emit tf | frametool monitor -

    RECORDING is a bag, a tree that moves, or what `ros2 topic echo /tf` prints. With TARGET and SOURCE only the edges
    between them are reported, and the interval in which all of them have data. Rates are in stamp time; the delay is
    the recorder's clock minus the stamp, known only from bags and `rostopic echo -p`. A gap is the longest pause
    between two stamps, in the order of time; back counts samples that come after a later stamp, reparented the changes
    of parent; gaps are pauses 5 times the median one. length_m is that of the path, speed_mean and speed_max metres a
    second from stamp to stamp. A jump is a step 10 times the median one and longer than 0.1 m or 0.2 rad.
    """
    frames = inputs.frames
    refuse(len(frames) not in (0, 2), f"name TARGET and SOURCE, or neither; found {len(frames)} frames")
    output = Output(inputs, "report")
    files = opened(inputs, (inputs.recording, *inputs.more))
    clashes: list[FormatError] = []
    report = monitor(files, *frames, normalize=inputs.normalize, clashing=clashes.append)
    inputs.use("time_offset")
    report_files(inputs, files)
    tell = partial(say_error, in_json=output.chosen == "json")
    say_first(clashes, MOST_REPORTED, "frames come by two topics", tell)
    if any(abs(each["delay_max_s"] or 0.0) > YEAR_S for each in report):
        say("note: stamps and the recorder's clock are years apart (simulated time?): the delays say nothing")
    output.report(report)
    return FAILED if clashes else 0


@command_named("formats")
@argument("name", options.format_among(FORMATS, "known"), required=False)
@options.list_options()
def formats_command(inputs: Inputs) -> None:
    """List the file formats that are read and written: suffixes, meaning of the numbers, required options.

    \b
      frametool formats
      frametool formats yaml
      frametool formats -f json

    The names are those of --in and -f. `asks for` lists options for what a format does not specify. A format is
    detected by content first, then by the suffix of the file; --in NAME overrides this. NAME shows one format in full,
    with an example if there is one. `frametool help formats` explains the options that files need.
    """
    from frametool.view.reports import write_format, write_formats

    output, name = Output(inputs, "report", otherwise="text"), inputs.name
    entries = list(map(format_entry, FORMATS if name is None else [name]))
    if output.style.format == "text":
        text = write_formats(entries) if name is None else write_format(entries[0])
        show(text, paged=True) if output.path is None else output.text(text)
        return
    if output.style.format == "csv":  # a list is one cell
        for entry in entries:
            entry |= {key: " ".join(value) for key, value in entry.items() if isinstance(value, tuple)}
    output.report(entries)
