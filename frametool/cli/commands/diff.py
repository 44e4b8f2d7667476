"""`frametool diff`: what differs between two trees, calibrations or recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.options import at_ns, file_options, list_options, read_time
from frametool.cli.output import Output
from frametool.cli.sink import say
from frametool.cli.trees import FRAME, frame_name, load_sides
from frametool.formats.load import EdgePlace, lines_of
from frametool.lint.findings import github_command
from frametool.lint.tree_diff import Tolerance, TreeComparison, diff, entry, parse_tolerance

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


DIFFERENT, TROUBLE = 1, 2
EXIT_CODES = "Exit codes: 0 the same, 1 different, 2 trouble of any kind, with files too."


@command_named("diff", epilog=EXIT_CODES)
@argument("a", FILE)
@argument("b", FILE)
@option("--with-a FILE", "merge this file into A; may be repeated", multiple=True)
@option("--with-b FILE", "merge this file into B; may be repeated", multiple=True)
@option("--at TIME", "compare at this time: seconds, nanoseconds with ns  [default: the latest of each]", read_time)
@option("--seen-from FRAME", "also show motion as seen from this frame  [default: the root of A]", FRAME)
@option("--tolerance LENGTH,ANGLE", "largest difference that is ignored, e.g. 1mm,0.1deg  [default: 1e-9 m, 1e-9 rad]",
    parse_tolerance, default=Tolerance())  # fmt: skip
@option("--all", "also list the frames that did not move", name="everything")
@file_options
@list_options("github")
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
    sides = (inputs.a, *inputs.with_a), (inputs.b, *inputs.with_b)
    (one, of_one), (other, of_other) = load_sides(*sides, normalize=inputs.normalize)
    start = inputs.seen_from and frame_name(inputs.seen_from, one)
    comparison = diff(one, other, at_ns=at_ns(inputs.at), seen_from=start, tolerance=inputs.tolerance)
    inputs.note(*comparison.notes)
    differences = [*comparison.differences, *(comparison.unmoved if inputs.everything else ())]
    if output.style.format == "github":
        output.text(_annotations(comparison, (of_one, of_other)))
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


def _annotations(found: TreeComparison, places: Sequence[Mapping[str, EdgePlace]]) -> str:
    """Return workflow commands, each at the line where B says where the frame is, or else A."""
    in_a, in_b = places
    known = {each.frame: in_b.get(each.frame) or in_a.get(each.frame) for each in found.differences}
    placed = {frame: place for frame, place in known.items() if place is not None}
    where = dict(zip(placed, lines_of([*placed.values()]), strict=True))
    lines = []
    for each in found.differences:
        file, line = where.get(each.frame, ("", 0))
        lines.append(github_command("error", each.sentence, file=file, line=line, title=each.kind))
    return "".join(lines)
