"""`frametool record`: copy a recording with changes; all other messages are unchanged."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.options import place_options, pose_options, reading_options, verbose_option
from frametool.cli.output import copy_target, folder_of
from frametool.cli.sink import say_error, writing
from frametool.cli.trees import FRAME, load_tree, tree_file, without_slash
from frametool.errors import BadAnswer, FileProblem, FormatError, ValueInvalid, listing, printable, shown, warn
from frametool.formats.load import FrameFile
from frametool.formats.table import FOLDERS, FORMATS, holds, writers
from frametool.frames.stamps import parse_time
from frametool.grammar.edges import Diagnostics
from frametool.rows.faults import ON_ERROR, STOP, BadRows
from frametool.view.text import progress_bar

if TYPE_CHECKING:
    from frametool.frames.lookups import Frames

EXIT_CODES = "Exit codes: 0 done, 1 bad data, 2 usage, 3 messages skipped, 4 lookup, 5 file."
TRANSFORMS = ("tf", "tf_static")  # the topics of transforms, in any namespace


def _between(text: str) -> tuple[int, int]:
    """Parse START,STOP: two times separated by a comma, in order."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != len(("START", "STOP")):
        raise ValueInvalid(f"{shown(text)} is not START,STOP: two times with a comma between them")
    start, stop = map(parse_time, parts)
    if start > stop:
        raise ValueInvalid(f"{parts[0]} is after {parts[1]}; START comes first")
    return start, stop


def _refuse_change(place: str, *read: str) -> None:
    """Raise FileProblem if the output is a file that is read, its folder, or inside a folder that is read."""
    new = Path(place).resolve()
    for each in filter(os.path.exists, read):
        old = Path(each).resolve()
        if old.is_relative_to(new) or new.is_relative_to(old):
            changes = f"would change {printable(each)}, which is read; give another name"
            raise FileProblem(f"{printable(place)}: {changes}")


def _added_edges(inputs: Inputs, copy: str) -> Frames:
    """Return the tree of --with, without covariances; raises BadAnswer for joints without a value."""
    edges = load_tree(inputs, inputs.more[0], inputs.more[1:])
    if resting := [name for *_, names in edges.robots for name in names]:
        raise BadAnswer(f"joints without a value would be static: {listing(resting)}; --joint NAME=VALUE gives it")
    if edges.covariances:
        warn(f"{copy}: covariances left out")
    return edges


@command_named("record", own=("topics", "output"), epilog=EXIT_CODES)
@argument("tree", FILE, metavar="RECORDING")
@place_options
@option("--with FILE", "add the missing edges of this tree; may be repeated", name="more", multiple=True)
@option("--replace", "let --with replace edges that have other values", requires=("more",))
@option("--into FRAME", "transform the messages of each --topic into this frame", FRAME)
@option("--topic NAME", "topic of messages to transform, or of transforms; may be repeated", name="moved_topics",
    multiple=True)  # fmt: skip
@option("--on-error", "for a message that cannot be transformed", ON_ERROR[:2], default=STOP)
@option("--between START,STOP", "drop messages before and after", _between)
@option("-f --format", "format of the copy  [default: by --output]", writers("recording"), name="format_name")
@reading_options
@verbose_option
@pose_options
def record_command(inputs: Inputs) -> int:
    """Copy RECORDING with changes; all other messages are unchanged.

    \b
      frametool record run.mcap --with camchain.yaml -o fixed.mcap
      frametool record run.mcap --with calibration.yaml --replace -o new.mcap
      frametool record run.mcap --into map --topic /pose --topic /odom -o map.mcap
      frametool record run.mcap --between 1700000010,1700000020 -o part.mcap

    --with adds the missing edges of a tree, in any format, in one message on /tf_static at the start. An edge with
    other values is an error; --replace writes the new values into every message that has it. --into transforms
    PoseStamped, PoseWithCovarianceStamped, PoseArray, Path, PointStamped and Odometry (its twist is unchanged) at their
    stamps, by the transforms of the recording and of --with; covariances are rotated too. --between keeps what was
    logged from START to STOP, and all of /tf_static.

    An MCAP file or ROS 2 bag becomes MCAP (-o NEW.mcap) or a folder (-f bag2 -o FOLDER), a ROS 1 bag one (-o NEW.bag).
    """
    from frametool.recordings.read import opened_recording
    from frametool.rows.recording_copy import RecordRun

    more, into, normalize = inputs.more, inputs.into, inputs.peek("normalize")
    are_transforms = all(topic.rpartition("/")[2] in TRANSFORMS for topic in inputs.peek("moved_topics"))
    topics = inputs.moved_topics if into or (more and are_transforms) else ()
    path = tree_file(inputs.tree)
    if path == "-":
        raise FileProblem("stdin: a recording cannot be read from a pipe; name its file")
    source = FrameFile(path)
    source.close()
    if not holds(source.format, "recording"):
        hint = "frametool tree, convert and lookup write one: -o NEW.mcap"
        raise FormatError(f"{FORMATS[source.format].summary}: no recording of messages; {hint}", source=path)
    copy, place = copy_target(source.format, path, inputs.output, inputs.format_name)
    _refuse_change(place, path, *map(tree_file, more))
    tally, edges = Diagnostics(), _added_edges(inputs, copy) if more else None
    inputs.use(*["normalize"] * bool(more or into))
    on_error = inputs.on_error if into else STOP
    bad = BadRows(path, on_error, tell=say_error, counted="message")
    request = (edges, inputs.replace, without_slash(into or ""), topics, inputs.between, normalize)
    quiet, force = inputs.quiet, inputs.force
    inputs.refuse_unused()
    with writing(place, force=force, folder=copy in FOLDERS) as write, opened_recording(path, tally) as opened:
        run = RecordRun(opened, bad, *request)
        with progress_bar(None, quiet=quiet, counted="messages") as advance:
            for piece in run.pieces(copy, folder_of(place), advance):
                write(piece)
    for remark in (*tally.findings(), *run.tally.findings()):
        warn(f"{path}: {remark.message}", rule=remark.rule)
    inputs.note(*(f"{path}: {sentence}" for sentence in run.summary()))
    return bad.finish(run.moved.total())
