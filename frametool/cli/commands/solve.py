"""`frametool solve`: the transforms that measurements mean."""

from __future__ import annotations

import os
from os.path import realpath
from typing import TYPE_CHECKING

import click

from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse, refuse_two_readers
from frametool.cli.comparing import read_span
from frametool.cli.options import ColumnNames, file_with, reading_options, result_options, suffix_of, whole_pose_options
from frametool.cli.output import Output
from frametool.cli.sink import refuse_existing, writing
from frametool.cli.stderr import tell
from frametool.errors import ValueInvalid, shown, warn

if TYPE_CHECKING:

    from frametool.view.fit_text import Solution

EXIT_CODES = "Exit codes: 0 done, 1 bad data, not solvable or undecided, 2 usage, 5 file."
SHAPES = ("hand_eye", "points")
FORMATS_OF_SCALE = ("text", "yaml", "json", "csv")


def _read_names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len({*names}) < len(names):
        raise ValueInvalid(f"{shown(text)}: names stand with commas between them, each once")
    return names


@command_named("solve", epilog=EXIT_CODES)
@argument("files", FILE, nargs=-1, required=True, metavar="FILE.. | GRIPPER TARGET | SAMPLES | A B")
@option("--root FRAME", "root of the result  [default: a frame that is never a child]", excludes=SHAPES)
@option("--fix TREE", "exact edges that are not changed; may be repeated", FILE, excludes=SHAPES, multiple=True)
@option("--without FILE:LINE", "ignore this row; may be repeated", excludes=SHAPES, multiple=True)
@option("--hand-eye", "pose of a camera from poses of gripper and target", excludes=("points",))
@option("--eye-to-hand", "the camera is static, the target moves", requires=("hand_eye",))
@option("--max-gap TIME", "longest time between paired stamps  [default: 50ms]", read_span,
    name="max_gap_ns", requires=("hand_eye",))  # fmt: skip
@option("--columns NAME,..", "columns of GRIPPER, then of TARGET, in one table", ColumnNames(),
    multiple=True, requires=("hand_eye",), under="Rows")  # fmt: skip
@option("--points", "A<-B from matched points")
@option("--scale", "estimate the scale from A to B too", requires=("points",))
@option("--names NAME,..", "BASE,GRIPPER,CAMERA,TARGET, or A,B", _read_names, requires=("hand_eye", "points"))
@option("--no-robust", "use all rows, outliers too")
@option("--report FILE.json|csv", "statistics of the fit and of each row", file_with(".json", ".csv"))
@reading_options()
@whole_pose_options
@result_options("tree", "trajectory")
def command(inputs: Inputs) -> None:
    """Estimate transforms from measurements, with sigmas; outliers are rejected and listed.

    \b
      frametool solve measurements.yaml -o solved.yaml
      frametool solve --hand-eye gripper.csv target.csv -o camera.yaml
      frametool solve --hand-eye hand_eye_samples.json -f handeye
      frametool solve --points points_a.csv points_b.csv --scale --report fit.json

    A measurement is {parent, child, a pose, sigma or covariance}: the pose of child in parent, in any file that `tree`
    reads. The result is a tree with covariances and one root. GRIPPER holds base<-gripper, TARGET camera<-target, row
    by row or by their stamps; SAMPLES are {gripper, target}, columns gripper_x .. target_qw, or of moveit_calibration
    or easy_handeye. Points are matched by id, else by row; a column weight counts.
    """
    for library in ("OPENBLAS", "OMP", "MKL"):  # sums come out in one order: the same bytes each run
        os.environ[f"{library}_NUM_THREADS"] = "1"
    hand_eye, points, files = inputs.hand_eye, inputs.points, inputs.files
    refuse_two_readers(files)
    if hand_eye and len(files) > 2:
        raise click.UsageError(f"--hand-eye takes GRIPPER TARGET, or one file of SAMPLES, found {len(files)} files")
    refuse(points and len(files) != 2, f"--points takes two files, A B, found {len(files)}")
    wanted, named = (4, "four names, BASE,GRIPPER,CAMERA,TARGET") if hand_eye else (2, "two names, A,B")
    refuse(len(inputs.peek("names") or ()) not in (0, wanted), f"--names takes {named}")
    report, path, force = inputs.report, inputs.output, inputs.force
    refuse(report and path and realpath(report) == realpath(path), "--report and -o name one file")
    for name in filter(None, (report, path)):
        refuse_existing(name, force=force)
    output = Output(inputs, "tree", "trajectory")
    if points and inputs.scale and output.style.format not in FORMATS_OF_SCALE:
        raise ValueInvalid(f"{output.style.format} has no place for a scale; write json, yaml or csv")
    from frametool.cli import solving

    solve = solving.solved_hand_eye if hand_eye else solving.solved_points if points else solving.solved_tree
    found = solve(inputs, files, robust=not inputs.no_robust)
    from frametool.view.fit_text import write_left_out, write_solution

    if said := (write_left_out if inputs.quiet else write_solution)(found):
        tell(said.rstrip("\n"))
    if report:
        _write_report(found, report, force=force)
    _write(output, found, on_hand=not (hand_eye and inputs.eye_to_hand))
    if count := len(found.left_out):
        warn(f"{count} outlier{'s' * (count > 1)} rejected; --no-robust uses all rows")


def _write(output: Output, found: Solution, *, on_hand: bool) -> None:
    """Write the result: a tree, or entries where there is a scale; as hand-eye calibration only the camera."""
    entries = [each for each in found.frames if each.parent is not None]
    if output.style.format == "csv" or found.scale_sigma is not None:
        from frametool.grammar.pose import Pose
        from frametool.grammar.result import Result, uncertain

        poses = [Pose.of(each.components, each.name, each.parent)._replace(scale=found.scale) for each in entries]
        output.values([Result(pose, uncertain(each.covariance)) for pose, each in zip(poses, entries, strict=True)])
    elif output.style.format == "handeye" and found.shape == "hand-eye":
        from frametool.formats.trees.calibrations import write_mount

        camera, target = entries
        warn(f"handeye: {shown(target.name)} in {shown(str(target.parent))} and covariances left out")
        output.text(write_mount(str(camera.parent), camera.name, camera.components, output.style, on_hand=on_hand))
    else:
        from frametool.frames.lookups import FrameTree
        from frametool.geometry.transform import Transform

        tree = FrameTree("the result")
        for each in found.frames:
            if each.parent is None:
                tree.add_root(each.name)
            else:
                tree.add(each.parent, each.name, Transform.of(*each.components), each.covariance)
        output.tree(tree)


def _write_report(found: Solution, path: str, *, force: bool) -> None:
    """Write the numbers of the fit as one document, or those of its rows as a table."""
    from frametool.view.fit_text import report, row_report

    if suffix_of(path) == ".csv":
        from frametool.formats.rows.csv import write_points
        from frametool.grammar.result import Style

        text = write_points([row_report(each, in_cells=True) for each in found.rows], Style("csv"))
    else:
        from frametool.documents.json import dump

        text = f"{dump(report(found))}\n"
    with writing(path, force=force) as write:
        write(text)
