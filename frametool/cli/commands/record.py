"""`frametool record`: a recording with something changed, and every other message as it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from frametool.cli.group import refuse_unused, settings
from frametool.cli.options import FILE, Command, Parsed, file_options, read_window, recording_options
from frametool.cli.recording import copied_as, folder_of, opened_place, refuse_input
from frametool.cli.sink import refuse_existing
from frametool.cli.stderr import say, say_error
from frametool.cli.trees import FRAME, load_tree, tree_file
from frametool.errors import FileProblem, FormatError, warn
from frametool.formats.load import Recording, Rules
from frametool.formats.table import FORMATS, is_recording
from frametool.grammar.edges import Tally
from frametool.stream.faults import ON_ERROR, STOP
from frametool.view.progress import ProgressBar

if TYPE_CHECKING:
    from collections.abc import Sequence

BETWEEN = Parsed("times", read_window)
OF_FILES = ("input_forms", "joints", "joint_files", "named_frames", "direction", "camera_axes", "dh", "stamps", "order")
TRANSFORMS = ("tf", "tf_static")  # how topics of transforms are called, in any namespace


@click.command(cls=Command, name="record")
@click.argument("tree", type=FILE, metavar="RECORDING")
@click.option("--with", "more", multiple=True, type=FILE, metavar="FILE",
              help="add the edges of this tree that are missing; may be repeated")  # fmt: skip
@click.option("--replace", is_flag=True, help="let --with replace edges that are there with other values")
@click.option("--into", type=FRAME, metavar="FRAME", help="move the messages of each --topic into this frame")
@click.option("--on-error", type=click.Choice(ON_ERROR[:2]), default=STOP, show_default=True,
              help="at a message that cannot be moved")  # fmt: skip
@click.option("--between", type=BETWEEN, metavar="START,STOP", help="leave out what was logged before and after")
@file_options
@recording_options
def command(
    tree: str, more: Sequence[str], replace: bool, into: str | None, on_error: str, between: tuple[int, int] | None,
    normalize: bool, format_name: str | None, output: str | None, force: bool,
) -> int:  # fmt: skip
    """Copy RECORDING with something changed; every other message stays as it is, whatever its type.

    \b
      frametool record run.mcap --with extrinsics.yaml -o fixed.mcap
      frametool record run.bag --with new_calibration.yaml --replace -o recalibrated.bag
      frametool record run.mcap --into map --topic /pose --topic /odom -o in_map.mcap --between 1700000010,1700000020

    --with adds the edges of a tree in any form that are missing, in a message on /tf_static that comes first. An edge
    that is there with other values is an error, or with --replace gets the new ones in every message that has it.
    --into moves PoseStamped, PoseWithCovarianceStamped, PoseArray, Path, PointStamped and Odometry (its twist stays),
    each at its stamp, by the transforms of the recording and of --with; covariances turn along. --between keeps what
    was logged from START to STOP, and all of /tf_static.

    RECORDING is an MCAP file, a ROS 2 bag or a ROS 1 bag. The first two become MCAP (-o NEW.mcap) or a folder (-f bag2
    -o FOLDER), a ROS 1 bag becomes one (-o NEW.bag). It is never written over.
    """
    from frametool.ros.record_copy import opened_recording
    from frametool.stream.record_run import RecordRequest, RecordRun

    chosen = settings()
    topics, chosen.topics = tuple(chosen.topics), ()
    _refuse_idle(more, into, topics)
    path = tree_file(tree)
    if path == "-":
        raise FileProblem("stdin: a recording cannot be read from a pipe; name its file")
    form = _form_of(path)
    copy, place = copied_as(form, path, output, format_name)
    refuse_input(place, (path, *more))
    refuse_existing(place, force=force)
    tally, edges = Tally(), load_tree(more[0], more[1:], Rules(normalize=normalize)) if more else None
    asked = RecordRequest(
        edges, replace=replace, into=into or "", topics=topics, window=between, on_error=on_error,
        tell=lambda error: say_error(error, in_json=False), normalize=normalize,
    )  # fmt: skip
    with opened_recording(path, form, tally) as opened:
        run = RecordRun(opened, asked)
        with ProgressBar(2 * opened.size, quiet=chosen.quiet, counted="messages") as progress:
            run.look(progress.advance)
            with opened_place(copy, place, force=force) as write:
                for piece in run.pieces(copy, folder_of(place), progress.advance):
                    write(piece)
    for remark in (*tally.told(), *run.remarks()):
        warn(f"{path}: {remark.message}", rule=remark.rule)
    for sentence in () if chosen.quiet else run.told():
        say(f"{path}: {sentence}")
    return run.finish()


def _refuse_idle(more: Sequence[str], into: str | None, topics: Sequence[str]) -> None:
    """Refuse options that would not be used."""
    if not more:
        refuse_unused("is for --with FILE", "replace", *OF_FILES)
    if not into:
        refuse_unused("is for --into FRAME", "on_error", *(["normalize"] if not more else []))
    of_poses = [topic for topic in topics if topic.rpartition("/")[2] not in TRANSFORMS]
    if topics and not into and (of_poses or not more):
        raise click.UsageError(f"--topic {(of_poses or topics)[0]} is for --into FRAME, which moves its messages")


def _form_of(path: str) -> str:
    """Return the form of a recording; raises FormatError for what is none."""
    source = Recording(path)
    source.close()
    if not is_recording(source.form):
        hint = "frametool tree, convert and lookup write one: -o NEW.mcap"
        raise FormatError(f"{FORMATS[source.form].summary}: no recording of messages; {hint}", source=path)
    return source.form
