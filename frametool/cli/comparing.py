"""What `compare` and `align` share: trajectories from the command line, the options that say how they are compared."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, option, refuse, refuse_two_readers, together
from frametool.cli.command import inputs as running
from frametool.cli.options import for_each
from frametool.cli.stderr import say_error
from frametool.cli.trees import answers
from frametool.errors import ValueInvalid, shown, warn
from frametool.frames.stamps import parse_stamp, parse_time
from frametool.stream.faults import MOST, STOP, BadRows
from frametool.text.numbers import parse_lengths, parse_share

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.cli.output import Output
    from frametool.fit.comparison import Comparison, Delta, Settings
    from frametool.frames.trajectory import Trajectory

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def read_span(text: str) -> int:
    """Read a time that is not negative."""
    found = parse_time(text)
    if found < 0:
        raise ValueInvalid(f"{shown(text)} is less than 0")
    return found


def _read_offset(text: str) -> tuple[int | str, float | None]:
    word, colon, limit = text.partition(":")
    if word != "auto":
        return parse_time(text), None
    seconds = parse_time(limit) / 1e9 if colon else None
    if seconds is not None and seconds <= 0:
        raise ValueInvalid(f"{shown(text)}: how far is looked behind auto: is more than 0 s")
    return "auto", seconds


def _read_limit(text: str) -> tuple[bool, int]:
    """Read `12.5` on the reference's clock, or `+5s` after the first pair."""
    if text.startswith("+"):
        return True, read_span(text[1:])
    return False, parse_stamp(text)


def _read_up(text: str) -> tuple[float, float, float]:
    sign, name = (-1.0, text[1:]) if text.startswith("-") else (1.0, text.removeprefix("+"))
    if name not in AXES:
        raise ValueInvalid(f"{shown(text)} is no axis; write x, y, z, -x, -y or -z")
    x, y, z = (sign * part + 0.0 for part in AXES[name])
    return x, y, z


def read_delta(text: str, *units: str) -> Delta:
    """Read a step in one of some units, all without any; a number of frames needs no unit."""
    from frametool.fit.comparison import parse_delta

    return parse_delta(f"{text}frames" if text.isdigit() and "frames" in units else text, *[units] * bool(units))


ALIGN = ("se3", "sim3", "yaw", "origin", "origin+scale", "none")
pairing_options = together(
    option("--match HOW", "interpolate or nearest  [default: interpolate]", ("interpolate", "nearest")),
    option("--max-gap TIME", "longest gap to interpolate  [default: 3 medians]", read_span, name="max_gap_ns"),
    option("--max-diff TIME", "largest difference of stamps  [default: 10ms]", read_span, name="max_diff_ns"),
    option("--min-match SHARE", "fewer pairs are an error  [default: 10%]", parse_share),
    option("--start TIME", "ignore pairs before, a stamp of REF; +5s: after the first", _read_limit, under="Time"),
    option("--stop TIME", "ignore pairs after", _read_limit, under="Time"),
    option("--offset TIME|auto", "seconds by which EST's clock lags; auto:LIMIT", _read_offset),
    option("--mount POSE|auto", "pose of REF's sensor in EST's body; FILE:BODY:POINT"),
    option("--align FIT", ", ".join(ALIGN).replace("se3", "se3 (default)", 1), ALIGN),
    option("--align-first N|10s|5m", "fit to the first pairs only", lambda text: read_delta(text, "frames", "s", "m")),
    option("--tie-first", "with se3, sim3, yaw: first positions coincide"),
    option("--up AXIS", "up axis of REF's world: z, -y ..  [default: z]", _read_up),
)  # fmt: skip
error_options = together(
    option("--delta 1m,5deg,..", "of rpe, also s, deg, frames  [default: 1m,10m,100m]",
           lambda text: tuple(map(read_delta, text.split(","))), name="deltas"),
    option("--all-pairs", "rpe from every pose, not from end to end"),
    option("--tolerance SHARE", "of --delta with --all-pairs  [default: 10%]", parse_share, requires=("all_pairs",)),
    option("--pairs-from WHICH", "reference or estimate  [default: reference]", ("reference", "estimate")),
    option("--segments 100,200,..", "lengths of kitti, metres  [default: 100,..,800]", parse_lengths),
    option("--segment-step N", "one for every N-th pair  [default: 10]", click.IntRange(1)),
    option("--as", "defaults of evo", ("evo",), name="like"),
)  # fmt: skip
trajectory_options = option("--on-error", "bad rows", (STOP, "skip"), default=STOP, under="Rows")


def trajectory(
    argument: str, on_error: str, fmt: str = "", *, normalize: bool = False
) -> tuple[Trajectory, str, bool]:
    """Read a trajectory of the command line; return it with what it is called, and whether rows were skipped."""
    from os.path import basename

    from frametool.stream.trajectories import read_trajectory, split_name

    made: list[BadRows] = []

    def policy(name: str) -> BadRows:
        made.append(BadRows(name, on_error, most=MOST, tell=partial(say_error, in_json=False)))
        return made[-1]

    known = answers()
    found = read_trajectory(
        argument, fmt=fmt, topics=running().topics, answers=known._replace(time_offset=0), policy=policy,
        normalize=normalize,
    )  # fmt: skip
    if found.stamps_ns is not None:
        running().ask("time_offset")
        found = found._replace(stamps_ns=found.stamps_ns + known.time_offset)
    file, inside = split_name(argument)
    name = ":".join(["stdin" if file == "-" else basename(file), *inside])
    return found, name, any(bad.count for bad in made)


def comparisons(ref: str, ests: Sequence[str], inputs: Inputs) -> tuple[list[Comparison], bool]:
    """Compare estimates with a reference as the options say, with warnings. Also: whether rows were skipped."""
    from frametool.fit.comparison import compare

    refuse_two_readers([ref, *ests])
    on_error, chosen = inputs.on_error, _settings(inputs)
    formats = for_each(inputs.input_formats, 1 + len(ests))
    reference, ref_name, skipped = trajectory(ref, on_error, formats[0])
    found = []
    for argument, fmt in zip(ests, formats[1:], strict=True):
        estimate, name, some = trajectory(argument, on_error, fmt)
        skipped |= some
        if (reference.stamps_ns is None) != (estimate.stamps_ns is None):
            lacking = ref_name if reference.stamps_ns is None else name
            raise click.UsageError(f"{lacking} has no stamps, the other has; give them with --stamps FILE")
        found.append(compare(reference, estimate, chosen, (ref_name, name)))
        for hint in found[-1].hints:
            warn(hint)
    return found, skipped


def _settings(inputs: Inputs) -> Settings:
    """Take what the options say; those not passed are as evo has them, or as we do."""
    from frametool.fit.comparison import EVO, Settings

    passed = {name: value for name in Settings._fields if (value := getattr(inputs, name)) is not None}
    if "offset" in passed:
        passed["offset"], limit = passed["offset"]
        passed |= {} if limit is None else {"offset_limit_s": limit}
    if "mount" in passed:
        passed["mount"] = _mount(passed["mount"])
    base = EVO if inputs.like else Settings()
    chosen = base._replace(**passed)
    if "max_diff_ns" in passed and chosen.match != "nearest":
        raise click.UsageError("--max-diff is of --match nearest; --max-gap is of interpolation")
    if "max_gap_ns" in passed and chosen.match == "nearest":
        raise click.UsageError("--max-gap is of --match interpolate; --max-diff is of nearest")
    return chosen


def _mount(text: str) -> Any:
    """Read the mount: auto, a pose, or FILE:BODY:POINT, the pose of a point on a body of a tree."""
    if text == "auto":
        return text
    from frametool.cli.poses import is_pasted, one_pose
    from frametool.geometry.transform import Transform
    from frametool.stream.request import Request

    if is_pasted(text):
        return Transform.of(*one_pose(text, Request()).components)
    from frametool.cli.trees import load_tree
    from frametool.stream.trajectories import split_name

    file, names = split_name(text)
    refuse(len(names) != 2, f"--mount {shown(text)}: a pose, auto, or FILE:BODY:POINT")
    return load_tree(file).lookup(names[0], names[1])


def write_trajectory(output: Output, found: Trajectory) -> None:
    """Write poses, or positions, in any format that holds them; frames are named if somebody called them something."""
    from frametool.frames.trajectory import BODY, WORLD

    world, body = (found.world, found.body) if (found.world, found.body) != (WORLD, BODY) else (None, None)
    stamps = [None] * found.size if found.stamps_ns is None else found.stamps_ns.tolist()
    if found.xyzw is not None:
        from frametool.grammar.pose_algebra import result_at

        columns = zip(*(part.tolist() for part in found.poses.components), strict=True)
        rows = zip(columns, stamps, strict=True)
        output.poses_as_they_come(result_at(row, world, body, at) for row, at in rows)
        return
    points = zip(found.xyz.tolist(), stamps, strict=True)
    output.points(
        ({} if at is None else {"stamp_ns": at}) | ({} if world is None else {"frame": world}) | {"point": xyz}
        for xyz, at in points
    )
