"""`frametool solve`: estimate transforms from measurements."""

from __future__ import annotations

import os
from functools import partial
from itertools import compress
from math import degrees, hypot, sqrt
from typing import TYPE_CHECKING, Any

from frametool.cli import options
from frametool.cli.command import FILE, Inputs, argument, command_named, option, refuse, refuse_two_readers
from frametool.cli.commands.compare import trajectory
from frametool.cli.output import Output
from frametool.cli.sink import refuse_existing, say_error, write_lines
from frametool.cli.trees import answers, load_tree, opened, report_files
from frametool.errors import ValueInvalid, alternatives, first_of, shown, warn
from frametool.geometry.rigid import IDENTITY
from frametool.grammar.pose import Pose
from frametool.grammar.result import SPELLED, Result, uncertain
from frametool.rows.faults import BadRows
from frametool.view.reports import Solution, sigma_entry, write_left_out, write_solution

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from frametool.geometry import Array
    from frametool.geometry.transform import Transform


NAMES = ("base", "gripper", "camera", "target")
ROW_KEYS = ("place", "row", "id", "parent", "child", "distance", "angle", "u", "used", "checked", "fits")
UNSURE = 1.2  # factor by which input sigmas must be too small to be reported


def solved_tree(inputs: Inputs, files: Sequence[str], *, robust: bool) -> Solution:
    """Estimate the tree of the measurements in files, with the edges of --fix."""
    from frametool.fit.blunders import split_place
    from frametool.fit.measured_tree import solve_tree
    from frametool.rows.measurements import read_measurements, without

    recordings = opened(inputs, files)
    rows = read_measurements(recordings, normalize=inputs.normalize)
    report_files(inputs, recordings)
    inputs.refuse_unused("topics")
    for each in recordings:
        own = [row for row in rows if split_place(row.place)[0] == each.name]
        first = f": {own[0].parent}<-{own[0].child} .." if own else ""
        count = f"{len(own)} row{'s' * (len(own) != 1)}"
        inputs.note(f"{each.name}: {count}, each the pose of child in parent{first}")
    rows, fixed = without(rows, inputs.without), None
    if inputs.fix:
        fixed = load_tree(inputs, inputs.fix[0], inputs.fix[1:])
        if moving := next((track.child for track in fixed.tracks() if not track.is_static), None):
            raise ValueInvalid(f"{fixed.name}: {shown(moving)} moves; fixed frames must be static (tree --at TIME)")
        if not {*fixed.frames} & (measured := {name for row in rows for name in row[:2]}):
            known = alternatives(one := fixed.frames[0], measured, "frames")
            raise ValueInvalid(f"{fixed.name}: no frame of it is measured: {shown(one)}{known}")
    found = solve_tree(rows, root=inputs.root, fixed=fixed, robust=robust)
    if found.sigma_factor > UNSURE:
        warn(f"the sigmas of the input are {found.sigma_factor:.2g} times too small for what the used rows are off")
    poses, exact = [], {name for name in found.frames if fixed and fixed.track(name)}
    for name in sorted(found.frames, key=lambda name: name != found.root):
        track = found.tree.track(name)  # its parent is the root, or its parent in --fix
        parent, pose = (track.parent, track.components) if track else (None, IDENTITY)
        poses.append(_pose(name, parent, pose, found.tree.covariances.get(name)))
    unknown = [str(each.name) for each in poses if each.parent and each.name not in exact and not each.covariance]
    if unknown:
        warn(f"no covariance of {first_of(unknown, 5)}: neither loops nor sigmas say how sure that is")
    alone = [m.place for m, checked in zip(found.measurements, found.checked, strict=True) if not checked]
    inputs.note(f"in no loop, cannot be cross-checked: {first_of(alone, 5)}" if alone else None)
    labels = [(m.place, m.id, m.parent, m.child) for m in found.measurements]
    return _solution("tree", found, poses, labels, found.root, exact)


def _pose(name: str, parent: str | None, components: Iterable[Any], covariance: Iterable[float] | None) -> Pose:
    """Return the pose of a frame, with 0.0 for -0.0."""
    return Pose.of((*(float(part) + 0.0 for part in components), *(covariance or ())), name, parent)


def _side(parent: str, name: str, pose: Transform, covariance: Array | None) -> list[Pose]:
    """Return the pose of a frame in a root, after the entry of the root."""
    listed = None if covariance is None else covariance.ravel().tolist()
    return [_pose(parent, None, IDENTITY, None), _pose(name, parent, pose.components, listed)]


def _solution(
    shape: str, found: Any, poses: list[Pose], labels: Iterable[tuple[Any, ...]], root: str | None,
    fixed: Collection[str | None] = (),
) -> Solution:  # fmt: skip
    """Return the solution with the residuals of its rows, in metres and, for poses, in radians.

    labels: location, id, parent and child of each row
    """

    def of(name: str, otherwise: Any = None) -> Any:
        return getattr(found, name, otherwise)

    count, used = len(found.used), found.used.tolist()
    sigma = found.sigma if isinstance(found.sigma, tuple | None) else (found.sigma, None)
    own = found.u.tolist(), used, map(bool, of("checked", [found.dof > 0] * count)), of("fits", [None] * count)
    rows = []
    for at, ((place, *names), off, *rest) in enumerate(zip(labels, found.residuals.tolist(), *own, strict=True), 1):
        angle = hypot(*off[3:]) if len(off) > 3 else None
        rows.append(dict(zip(ROW_KEYS, (place, at, *names, hypot(*off[:3]), angle, *rest), strict=True)))
    frames = [
        {"name": each.name, "parent": each.parent, "sigma": sigma_entry(each),
         "rows": of("rows", {}).get(each.name, sum(used)), "checked": of("frame_checked", {}).get(each.name, True)}
        for each in poses
    ]  # fmt: skip
    numbers = {
        "shape": shape, "root": root, "count": count, "used": sum(used), "dof": found.dof,
        **dict(zip(("rms_distance", "rms_angle"), found.rms, strict=True)),
        "sigma": sigma and dict(zip(("xyz", "rpy"), sigma, strict=True)), "noise_at": of("noise_at"),
        "scale_sigma": of("scale_sigma"), "frames": frames, "measurements": rows,
    }  # fmt: skip
    gone = of("left_out", ~found.used).tolist()  # without rows of weight 0
    return Solution(numbers, poses, [*compress(rows, gone)], fixed, of("turns"))


def solved_hand_eye(inputs: Inputs, files: Sequence[str], *, robust: bool) -> Solution:
    """Estimate the pose of a camera on a gripper, or next to a robot: two files of poses, or one of samples."""
    from frametool.fit.hand_eye import solve_hand_eye
    from frametool.rows.pairs import paired_samples, read_samples

    eye_to_hand = inputs.eye_to_hand
    if len(files) == 1:
        (fmt,) = options.for_each(inputs.input_formats, 1)
        columns, normalize = inputs.columns, inputs.normalize
        samples = read_samples(files[0], eye_to_hand=eye_to_hand, normalize=normalize, fmt=fmt, columns=columns)
    else:
        formats, gap = options.for_each(inputs.input_formats, 2), inputs.max_gap_ns
        read = [trajectory(inputs, file, fmt)[:2] for file, fmt in zip(files, formats, strict=True)]
        for each, name in read:
            refuse(gap is not None and each.stamps_ns is None, f"--max-gap is not used: {name} has no stamps")
        (gripper_poses, first), (target_poses, second) = read
        samples = paired_samples(gripper_poses, target_poses, (first, second), gap)
    named = [each or name for each, name in zip(samples.names, NAMES, strict=True)]
    called = base, gripper, camera, target = tuple(inputs.names or named)
    if len({*called}) < len(NAMES):
        raise ValueInvalid(f"two of the frames {', '.join(called)} are called alike; give --names")
    holder, other = (base, gripper) if eye_to_hand else (gripper, base)
    second, number = f"; {samples.files[1]}:" if len(files) > 1 else ",", len(samples.places)
    taken = f"{samples.files[0]}: {base}<-{gripper}{second} {camera}<-{target}; {number} sample{'s' * (number != 1)}"
    inputs.note(taken, samples.taken, f"solving for {holder}<-{camera} and {other}<-{target}")
    found = solve_hand_eye(samples.gripper, samples.target, eye_to_hand=eye_to_hand, robust=robust, names=called)
    sigmas: list[Any] = [found.covariance_x, found.covariance_z]
    if not samples.placed:
        sure = " and ".join(f"{degrees(sqrt(each[3:, 3:].trace() / 3)):.2g} deg" for each in sigmas)
        warn(f"no positions: only the rotations are solved (sigma {sure}); xyz 0, 0, 0 stands for what is not known")
        sigmas = [None, None]
    poses = _side(holder, camera, found.x, sigmas[0]) + _side(other, target, found.z, sigmas[1])
    labels = [(place, None, camera, target) for place in samples.places]
    return _solution("hand-eye", found, poses, labels, None)


def solved_points(inputs: Inputs, files: Sequence[str], *, robust: bool) -> Solution:
    """Estimate the transform between two files of matched points."""
    from frametool.fit.matched_points import solve_points
    from frametool.rows.pairs import matched, read_points

    policy = partial(BadRows, tell=say_error)
    named = zip(files, options.for_each(inputs.input_formats, 2), strict=True)
    a, b = (read_points(file, fmt=fmt, answers=answers(inputs), policy=policy) for file, fmt in named)
    found_names = (a.frame, b.frame) if a.frame and b.frame and a.frame != b.frame else ("A", "B")
    names = target, source = tuple(inputs.names or found_names)
    pairs = matched(a, b)
    how, ids = "by row" if pairs.ids is None or a.ids is None or b.ids is None else "by id", pairs.ids
    points = f"{a.file}: points in {target}; {b.file}: points in {source}"
    inputs.note(f"{points}; {len(pairs.places)} matched {how}")
    weights, scale = pairs.weights, inputs.scale
    found = solve_points(pairs.target, pairs.source, weights=weights, scale=scale, robust=robust, names=names)
    root, pose = _side(target, source, found.transform, found.covariance)
    poses = [root, pose._replace(scale=found.scale)]
    labels = [(place, ids[at] if ids else None, target, source) for at, place in enumerate(pairs.places)]
    return _solution("points", found, poses, labels, target)


EXIT_CODES = "Exit codes: 0 done, 1 bad data, not solvable or undecided, 2 usage, 5 file."
SHAPES = ("hand_eye", "points")


@command_named("solve", epilog=EXIT_CODES)
@argument("files", FILE, nargs=-1, required=True, metavar="FILE.. | GRIPPER TARGET | SAMPLES | A B")
@option("--root FRAME", "root of the result  [default: a frame that is never a child]", excludes=SHAPES)
@option("--fix TREE", "exact edges that are not changed; may be repeated", FILE, excludes=SHAPES, multiple=True)
@option("--without FILE:LINE", "ignore this row; may be repeated", excludes=SHAPES, multiple=True)
@option("--hand-eye", "pose of a camera from poses of gripper and target", excludes=("points",))
@option("--eye-to-hand", "the camera is static, the target moves", requires=("hand_eye",))
@option("--max-gap TIME", "longest time between paired stamps  [default: 50ms]", options.read_span,
    name="max_gap_ns", requires=("hand_eye",))  # fmt: skip
@option("--columns NAME,..", "columns of GRIPPER, then of TARGET, in one table", options.COLUMN,
    multiple=True, requires=("hand_eye",), under="Rows")  # fmt: skip
@option("--points", "A<-B from matched points")
@option("--scale", "estimate the scale from A to B too", requires=("points",))
@option("--names NAME,..", "BASE,GRIPPER,CAMERA,TARGET, or A,B", options.read_names, requires=("hand_eye", "points"))
@option("--no-robust", "use all rows, outliers too")
@option("--report FILE.json|csv", "statistics of the fit and of each row",
    partial(options.read_path, suffixes=(".json", ".csv")))  # fmt: skip
@options.reading_options
@options.pose_result_options("tree", "trajectory")
def solve_command(inputs: Inputs) -> None:
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
    for library in ("OPENBLAS", "OMP", "MKL"):  # a fixed order of sums: the same bytes in each run
        os.environ[f"{library}_NUM_THREADS"] = "1"
    hand_eye, points, files = inputs.hand_eye, inputs.points, inputs.files
    refuse_two_readers(files)
    count = len(files)
    refuse(hand_eye and count > 2, f"--hand-eye takes GRIPPER TARGET, or one file of SAMPLES, found {count} files")
    refuse(points and count != 2, f"--points takes two files, A B, found {count}")
    wanted, named = (4, "four names, BASE,GRIPPER,CAMERA,TARGET") if hand_eye else (2, "two names, A,B")
    refuse(len({*(inputs.names or ())}) not in (0, wanted), f"--names takes {named}; no two may be the same")
    report, path, force = inputs.report, inputs.output, inputs.force
    refuse(report and path and os.path.realpath(report) == os.path.realpath(path), "--report and -o name one file")
    for name in filter(None, (report, path)):
        refuse_existing(name, force=force)
    output = Output(inputs, "tree", "trajectory")
    if points and inputs.scale and output.style.format not in ("text", *SPELLED):
        raise ValueInvalid(f"{output.style.format} has no place for a scale; write json, yaml or csv")
    solve = solved_hand_eye if hand_eye else solved_points if points else solved_tree
    found = solve(inputs, files, robust=not inputs.no_robust)
    if summary := (write_left_out if inputs.quiet else write_solution)(found):
        write_lines(summary.rstrip("\n"))
    if report:  # one document, or a table of the rows
        into = Output(inputs.changed(output=report, format_name=None, notations=(), precision=None), "report")
        into.report(found.numbers["measurements"] if into.chosen == "csv" else [found.numbers])
    _write(output, found, on_hand=not (hand_eye and inputs.eye_to_hand))
    if count := len(found.left_out):
        warn(f"{count} outlier{'s' * (count > 1)} rejected; --no-robust uses all rows")


def _write(output: Output, found: Solution, *, on_hand: bool) -> None:
    """Write the result: a tree, entries as CSV or with a scale, or for handeye only the camera."""
    if output.style.format == "csv" or found.numbers["scale_sigma"] is not None:
        output.values([Result(each, uncertain(each.covariance)) for each in found.poses if each.parent])
    elif output.style.format == "handeye" and found.numbers["shape"] == "hand-eye":
        from frametool.formats.trees.calibrations import write_mount

        _, camera, _, target = found.poses
        warn(f"handeye: {shown(target.name)} in {shown(str(target.parent))} and covariances left out")
        output.text(write_mount(str(camera.parent), str(camera.name), camera.components, output.style, on_hand=on_hand))
    else:
        from frametool.frames.lookups import FrameTree

        tree = FrameTree("the result")
        for each in found.poses:
            if each.parent is None:
                tree.add_root(str(each.name))
            else:
                tree.add(each.parent, str(each.name), each.transform, each.covariance)
        output.tree(tree)
