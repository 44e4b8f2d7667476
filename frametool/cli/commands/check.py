"""`frametool check`: mistakes in trees and recordings."""

from __future__ import annotations

import sys
from functools import partial
from math import radians
from typing import TYPE_CHECKING

from frametool.cli.command import EVERYTHING, FILE, Command, Inputs, argument, command_named, option, refuse_two_readers
from frametool.cli.options import file_options
from frametool.cli.sink import folded, in_colour, say, writing
from frametool.cli.trees import opened, state
from frametool.errors import Finding, FormatError, listing, warn
from frametool.lint.findings import RULES, WRITERS, level
from frametool.lint.rules import check
from frametool.lint.tree_diff import Tolerance, parse_tolerance

if TYPE_CHECKING:
    from collections.abc import Sequence

    import click

    from frametool.formats.load import FrameFile
    from frametool.stream.measurements import Measurement

FAILED = 1
TROUBLE = (r"(?m)^\S.*?: (?P<red>error): ", r"(?m)^\S.*?: (?P<magenta>warning): ")


class CheckCommand(Command):
    """A command whose help lists the rules."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Name the rules, with --help-all their levels and what they are about, then the exit codes."""
        formatter.write_paragraph()
        if ctx.meta.get(EVERYTHING):
            with formatter.section("Rules"):
                formatter.write_dl([(f"{rule} ({level})", about) for rule, (level, about) in RULES.items()])
        else:
            formatter.write_text(f"{len(RULES)} rules, explained by --help-all: {', '.join([*RULES][:6])} ..")
        super().format_epilog(ctx, formatter)


@command_named("check", cls=CheckCommand)
@argument("files", FILE, nargs=-1, required=True)
@option("-f --format", "format of the findings", (*WRITERS,), name="fmt", default="text")
@option("--strict", "exit with 1 for warnings too")
@option("--measured FILE", "compare these measurements (help solve) too", excludes=("each",), multiple=True)
@option("--tolerance LENGTH,ANGLE", "their allowed deviation  [3 sigmas, or 10mm,1deg]", requires=("measured",),
        kind=partial(parse_tolerance, otherwise=Tolerance(0.01, radians(1.0))))  # fmt: skip
@option("--each", "check each file separately; one without frames is a warning")
@file_options
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
    if inputs.each:
        findings = _one_by_one(files, normalize=normalize)
    else:
        count = len(files) + len(measured)
        rows = _read(opened(measured, behind=len(files), of=count), normalize=normalize) if measured else []
        recordings = opened(files, of=count)
        findings = _with_loops(recordings, rows, inputs.tolerance, normalize=normalize)
        state(recordings)
    text = WRITERS[fmt](findings)
    with writing(None) as write:
        is_seen = fmt == "text" and sys.stdout.isatty()
        write(in_colour("\n".join(map(folded, text.split("\n"))), TROUBLE) if is_seen else text)
    counts = {kind: sum(level(each) == kind for each in findings) for kind in ("error", "warning", "note")}
    summary = ", ".join(f"{count} {kind}{'s' * (count != 1)}" for kind, count in counts.items() if count)
    if summary or (fmt == "text" and sys.stdout.isatty()):
        say(summary or f"{listing(files)}: no findings ({len(RULES)} rules)")
    return FAILED if counts["error"] or (strict and counts["warning"]) else 0


def _one_by_one(files: Sequence[str], *, normalize: bool) -> list[Finding]:
    """Return what is wrong with each file alone; that one holds no frames, or is of an unknown format, is a warning."""
    findings = []
    for number, file in enumerate(files):
        try:
            recordings = opened([file], behind=number, of=len(files))
        except FormatError as error:
            findings.append(Finding("no-frames", error.message, error.source, error.line or 1, 1))
        else:
            findings += check(recordings, normalize=normalize, others=True)
            state(recordings)
    return findings


def _read(files: Sequence[FrameFile], *, normalize: bool) -> list[Measurement]:
    from frametool.stream.measurements import read_measurements

    rows = read_measurements(files, normalize=normalize)
    state(files, whole=False)
    return rows


def _with_loops(
    files: Sequence[FrameFile], rows: Sequence[Measurement], tolerance: Tolerance | None, *, normalize: bool
) -> list[Finding]:
    """Return what is wrong with files, then the measurements that do not agree; report what was not compared."""
    if not rows:
        return check(files, normalize=normalize)
    from frametool.fit.measured_tree import loops
    from frametool.frames.lookups import FrameTree

    tree = FrameTree()
    findings = check(files, normalize=normalize, tree=tree)
    found, lacking, apart = loops(tree, rows, tolerance)
    if lacking:
        warn(f"frames that the tree does not have, or that move; not compared: {listing(lacking)}")
    if apart:
        warn(f"{apart} of {len(rows)} measurements not compared: their frames are not connected by static frames")
    return [*findings, *found]
