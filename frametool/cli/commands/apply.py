"""`frametool apply`: points, vectors and poses moved into another frame."""

from __future__ import annotations

import os
import re
from contextlib import ExitStack
from functools import cache
from itertools import chain, groupby
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options, streaming
from frametool.cli.command import Inputs, argument, command_named, option, refuse, together
from frametool.cli.poses import inline_misuse, is_inline, is_pasted, one_pose, pose_source, values_of
from frametool.cli.sink import say_warning, writing
from frametool.cli.trees import FRAME, frame_name, load_tree, lookup_time_ns, lookups_in
from frametool.documents.source import InputFile, Source
from frametool.errors import FormatError, FrametoolError, ValueInvalid, heard_by, shown, warn
from frametool.formats.table import FORMATS, holds, writers
from frametool.frames.stamps import format_stamp
from frametool.geometry.rigid import EXACT, UNCERTAIN
from frametool.geometry.uncertainty import warn_if_wide
from frametool.grammar.edges import Diagnostics
from frametool.grammar.readers import EARTH_FRAMES
from frametool.rows.faults import Fault, run
from frametool.rows.request import COMBINED, Operation, Request, RowOptions, Timed
from frametool.text.numbers import NotFinite, parse_length

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.cli.output import Output
    from frametool.explain.derive import WrittenPose
    from frametool.geometry import Components
    from frametool.grammar.result import Style
    from frametool.recordings.contents import PointCloud
    from frametool.rows.derivations import ByTree
    from frametool.rows.request import Formula


PLACEHOLDERS: dict[str, Callable[[PointCloud], str]] = {
    "stamp_ns": lambda cloud: str(cloud.stamp_ns),
    "stamp": lambda cloud: format_stamp(cloud.stamp_ns),
    "number": lambda cloud: f"{cloud.number:06d}",
    "topic": lambda cloud: cloud.topic.strip("/"),
    "frame": lambda cloud: cloud.frame,
}  # {NAME} in -o -> its replacement
_WRITTEN = f"formats: {', '.join(writers('arrays'))}"


def _write_cloud(cloud: PointCloud, pose: Components, output: Output, path: str, names: dict[str, int]) -> None:
    """Write a moved cloud of a bag to its file.

    names: file written before -> the number of its message
    """
    from frametool.rows.sources.column_files import moved_cloud

    texts = {place: re.sub(r"[/\0]|^\.+", "_", text(cloud)) for place, text in PLACEHOLDERS.items()}  # no path
    name = re.sub(r"\{(\w+)\}", lambda found: texts.get(found[1], found[0]), str(output.path))
    if name in names:
        both = f"messages {names[name]} and {cloud.number} would both become {shown(name)}"
        raise FormatError(f"{both}; put {{stamp_ns}} or {{number}} into its name", source=path)
    style = output.style.changed(format=output.chosen or "")
    with writing(name, force=output.force) as write:
        for outcome in moved_cloud(cloud, pose, style, path):
            for fault in outcome.faults:
                raise FormatError(f"message {cloud.number}: point {fault.line + 1}: {fault.reason}", source=path)
            write(outcome.text)
    names[name] = cloud.number


def bag_of_clouds(task: streaming.Task) -> Callable[[Mover], int]:
    """Return a function that moves the clouds of the bag of -i, writes each to its file and returns the exit status.

    Topics of --topic that are not clouds remain for the tree.
    """
    from frametool.recordings.contents import cloud_topics, read_clouds
    from frametool.recordings.read import opened_recording

    inputs, output, path, chosen = task.inputs, task.output, task.name, task.inputs.topics
    inputs.use("input_path")
    is_one = output.path in (None, "-") or not holds(output.chosen, "arrays")
    refuse(is_one, f"each cloud of a bag is a file: -o 'scan_{{stamp_ns}}.pcd'; {_WRITTEN}")
    tally, names = Diagnostics(), dict[str, int]()
    with ExitStack() as opening:
        reader = opening.enter_context(opened_recording(path, tally))
        topics = cloud_topics(reader, chosen)
        opened = opening.pop_all()
    clouds = {topic.strip("/") for topic in topics}
    inputs.update(topics=tuple(topic for topic in chosen if topic.strip("/") not in clouds))

    def move_all(mover: Mover) -> int:
        bad = task.policy(path, "message")
        inputs.refuse_unused()
        count = points = 0
        once: Any = cache(say_warning)
        with opened, heard_by(once):
            for cloud in read_clouds(reader, topics, tally):
                count += 1
                if isinstance(cloud, FormatError):
                    bad.take([Fault(cloud.line, "", cloud.message)])
                    continue
                try:
                    pose = mover.from_frame(cloud.frame or None, cloud.stamp_ns)
                except FrametoolError as error:
                    bad.take([Fault(cloud.number, "", error)])
                else:
                    _write_cloud(cloud, pose, output, path, names)
                    points += len(cloud.rows)
            for finding in tally.findings():
                once(f"{path}: {finding.message}", finding.rule)
        if not count:
            raise FormatError(f"no messages on {', '.join(topics)}", source=path)
        files = f"{len(names)} file{'s' * (len(names) != 1)} ({', '.join(topics)})"
        inputs.note(f"{path}: {points} points{mover.into}, metres, in {files}")
        return bad.finish(count)

    return move_all


def several_clouds(task: streaming.Task) -> Callable[[Mover], int]:
    """Return a function that merges the clouds of several -i into one, each in its own frame or all in SOURCE.

    --frames and the --in of clouds are then not available to the tree.
    """
    from frametool.formats.detect import detect
    from frametool.rows.sources.column_files import OtherColumns

    inputs, output, paths = task.inputs, task.output, task.inputs.input_path
    others = [path for path in paths if path == "-" or streaming.is_bag(path)]
    refuse(others, f"-i {''.join(others[:1])}: several -i are files of one cloud each")
    refuse(not holds(output.chosen, "arrays"), f"several clouds become one: -o all.ply, or -f; {_WRITTEN}")
    passed, count = inputs.input_formats, len(paths)
    named = [fmt for fmt in passed if "arrays" in FORMATS[fmt].reads]
    formats, frames = options.for_each(named, count), [*chain.from_iterable(inputs.named_frames)]
    inputs.update(input_formats=[fmt for fmt in passed if fmt not in named], named_frames=())

    def move_all(mover: Mover) -> int:
        is_open, on_error = mover.has_source == bool(frames) or len(frames) not in (0, count), inputs.on_error
        refuse(is_open, f"name SOURCE, the frame of all clouds, or --frames A,B with one for each of the {count}")
        with ExitStack() as opened:
            planned = []
            for path, chosen, frame in zip(paths, formats, frames or [""] * count, strict=True):
                file = InputFile(path)
                opened.callback(file.close)
                fmt = chosen or detect(file.head(), "records", "rows", "arrays", name=path)
                if "arrays" not in FORMATS[fmt].reads:
                    hint = f"make one of it: frametool convert -i {path} -o NEW.pcd"
                    raise FormatError(f"{FORMATS[fmt].summary}, no cloud; {hint}", source=path)
                operation = Operation(left=mover.from_frame(frame or None, None), moves=True)
                planned.append((streaming.open_columns(file, fmt), Request(operation, on_error=on_error), path))
            merged, status = OtherColumns(planned, output.style), 0
            with writing(output.path, force=output.force) as write:
                for at, path in enumerate(paths):
                    status = max(status, run(merged.outcomes(at), write, task.policy(path, "row"), lambda *_: None))
        froms = f", from {', '.join(frames)}" if frames else ""
        inputs.note(f"{count} clouds{mover.into} as one{froms}; metres")
        return status

    return move_all


CHOICES = ("point", "vector", "pose", "twist", "wrench")
# options on rows that are moved by a tree
frame_column_option = option("--frame-column NAME", "column with the frame of each row, without SOURCE", options.COLUMN)
moving_row_options = together(
    option("--time-column NAME", "column or key with the time of each row", options.COLUMN, excludes=("at",),
           under="Time"),
    option("--at TIME", "one time for all  [default: latest]", options.read_time, under="Time"),
    options.rules_options,
    options.offset_option,
)  # fmt: skip


@command_named("apply", own=("input_path", "output", "time_column", "at"))
@argument("arguments", FRAME, nargs=-1, metavar="[TREE TARGET [SOURCE]] [X Y Z | RECORD]..")
@option("--transform POSE", "move by this pose, not by a lookup", name="pose", excludes=("at", "time_column"))
@option("--as KIND", "point, vector, pose, twist, wrench; once per --columns", CHOICES, name="kinds", multiple=True)
@streaming.several_stream_options
@options.pose_result_options("points", "trajectory")
@option("--covariance", "include that of the tree's edges, or of --transform", excludes=("explain",))
@options.scale_option
@streaming.EXPLAIN
@frame_column_option
@moving_row_options
@options.reading_options
def apply_command(inputs: Inputs) -> int:
    """Move points, vectors and poses from SOURCE into TARGET.

    \b
      frametool apply robot.yaml map camera_optical 0 0 1
      frametool apply --transform '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}' 1 0 0
      frametool apply robot.yaml map '{frame: lidar, point: [1, 0, 0]}'
      frametool apply robot.yaml base_link lidar -i cloud.csv

    A RECORD is a pose, {vector: [x, y, z]} or a point, also X Y Z (help records). Without SOURCE it names its frame. -i
    FILE or stdin holds several: rows, JSON lines, clouds, what `ros2 topic echo` prints.
    """
    task = streaming.Task(inputs, "points", "trajectory")
    output, plan = task.output, task.plan
    move_clouds: Callable[[Mover], int] | None = None
    if len(task.paths) > 1:
        move_clouds = several_clouds(task)
    elif task.path and streaming.is_bag(task.path) and (holds(output.chosen, "arrays") or task.messages() is None):
        move_clouds = bag_of_clouds(task)  # their messages are not records
    mover = Mover(task) if inputs.pose is not None else TreeMover(task, numbers=bool(task.place))
    rest, is_stream = mover.rest, mover.is_stream
    if move_clouds is not None:
        is_more = mover.uncertain or not is_stream or plan is not None
        refuse(is_more, "clouds are moved whole, without records, --covariance or --explain")
        return move_clouds(mover)
    kinds, count = inputs.kinds, len(inputs.peek("columns"))
    counts = f"--as appears {len(kinds)} times, --columns {count} times; each --columns has its own"
    refuse(len(kinds) not in (0, 1, count), counts)
    kind = kinds[0] if len(kinds) == 1 else ""
    if plan is not None:
        records = list(sources_of(inputs, rest, kind))
        refuse(is_stream or len(records) != 1, f"a stream, or several records; {streaming.ONE_RECORD}")
        return _derived(task, plan, mover, records[0], kind)
    request, status = mover.request(kind=kind), 0
    if is_stream:
        if count > 1:
            request = request.with_rows(poses=count, kinds=kinds if len(kinds) == count else (kind,) * count)
        status = task.run(request)
    else:
        task.only_arguments(rest)
        if task.place:
            inputs.use("from_rep")
        output.values(values_of(list(sources_of(inputs, rest, kind, task.place)), request, output))
    if isinstance(mover, TreeMover):  # report what was assumed
        inputs.note(mover.lookups.assumptions())
    else:
        warn_if_wide([mover.pose.covariance or ()] * mover.uncertain)
    return status


def _derived(task: streaming.Task, plan: Style, mover: Mover, record: str | Source, kind: str) -> int:
    """Write the derivation of one record."""
    from frametool.rows.derivations import ByTree, derive_record

    request, timeless = task.request(operation=Operation(moves=True)), task.inputs.at is not None
    if isinstance(mover, TreeMover):
        derived_by: ByTree | WrittenPose = ByTree(mover.tree, mover.target, mover.source, lookup_time_ns(mover.at))
    else:
        derived_by = task.read_written(mover.read, warned=True)
    with inline_misuse():
        rows = RowOptions(
            kind=kind, degrees=request.rows.degrees, normalize=task.normalize, frame_is_counter=mover.counters
        )
        made = derive_record(plan, derived_by, pose_source(record, request), rows, timeless=timeless)
    task.output.text(made.render(task.inputs.explain))
    return 0


class Mover:
    """Transforms records by one pose; if the pose names its frames, records must be expressed in its source.

    target: the frame of the results, None without a name
    source: the frame of the records, None without a name or, with a tree, if each record names its own
    uncertain: use the covariance of the transform, which follows its seven components
    has_source: True if all records are expressed in one frame
    counters: True if no frame has a number for its name, so that a number in a frame column is a counter
    rest: the arguments that are records; is_stream: True if the records are a stream instead
    into: the frame of the results, for messages
    timed: transforms records at their own times; None if all use one time
    """

    timed: Timed | None = None
    has_source = counters = True

    def __init__(self, task: streaming.Task) -> None:
        """Read the pose of --transform."""
        inputs = task.inputs
        self.task, self.uncertain, self.rest = task, bool(inputs.covariance), inputs.arguments
        request = task.request(operation=COMBINED._replace(similar=True, multiples=inputs.scale))
        self.is_stream, self.read = self.rest in ((), ("-",)), pose_source(inputs.pose, request)
        pose = one_pose(self.read, request)
        refuse(self.uncertain and pose.covariance is None, "--covariance: POSE has neither sigma nor covariance")
        if pose.covariance is not None and not self.uncertain:
            warn(f"{self.read.name}: its covariance is not used (--covariance)")
        self.target, self.source = pose.parent, pose.name
        self.into = f" in {self.target}" if self.target else ""
        self.pose = pose if self.uncertain else pose._replace(covariance=None)

    def from_frame(self, own: str | None, own_ns: int | None = None) -> Components:  # noqa: ARG002 - of a tree
        """Return the transform of records expressed in a frame, at a time or the latest."""
        _agreed_frame(own, self.source)
        return self.pose.placed

    def request(self, formula: Formula | None = None, **fields: Any) -> Request:
        """Return the request to transform records from one frame, or each from its own.

        fields: further fields of the request
        """
        inputs = self.task.inputs
        frame_column, time_column = (inputs.frame_column, inputs.time_column) if self.is_stream else (None, None)
        has_source = self.has_source and frame_column is None
        left = self.from_frame(None) if has_source and not time_column else None
        return self.task.request(
            operation=Operation(left=left, moves=True, uncertain=self.uncertain, formula=formula),
            frames=() if has_source else (frame_column or "",), frame_is_counter=self.counters, timed=self.timed,
            pose_from_frame=self.from_frame, rename=None if formula else lambda _parent, name: (self.target, name),
            **fields,
        )  # fmt: skip


class TreeMover(Mover):
    """Transforms records by lookups in a tree."""

    def __init__(self, task: streaming.Task, *, numbers: bool) -> None:
        """Read tree, target and, if present, source from the arguments.

        numbers: an argument that looks like a number is not a frame's name
        """
        inputs, arguments = task.inputs, task.inputs.arguments
        self.task, self.at, self.uncertain = task, inputs.at, bool(inputs.covariance)
        refuse(len(arguments) < 2, "name TREE and TARGET, or give --transform")
        is_named = len(arguments) > 2 and not is_record(arguments[2]) and not (numbers and begins_number(arguments[2]))
        self.rest = arguments[2 + is_named :]
        self.is_stream, self.has_source = self.rest in ((), ("-",)), is_named
        self.tree = tree = load_tree(inputs, arguments[0], inputs.more, streams=self.is_stream)
        self.lookups = lookups_in(inputs, tree, carried=self.uncertain)
        self.target: str = frame_name(arguments[1], tree)
        self.into, self.source = f" in {self.target}", frame_name(arguments[2], tree) if is_named else None
        if not {self.target, self.source or self.target} <= set(tree.frames):
            tree.lookup(self.target, self.source or self.target)  # raises, and names the nearest frames
        self.counters = not any(map(str.isdecimal, tree.frames))
        self._resolved: dict[str, str] = {}  # name in records -> in the tree, so that a leading / is reported once
        if self.at is None:
            self.timed = Timed(
                (self.is_stream and inputs.peek("time_column")) or "", self.at_times, self.from_frame,
                width=UNCERTAIN if self.uncertain else EXACT,
                moves=lambda own: tree.latest(self.target, self.start(own)) is not None,
            )  # fmt: skip
            late = "stamps" in inputs.unused and (self.timed.moves(None) if is_named else tree.moves)
            refuse(late, "rows move at the latest time; make --stamps a column first, by convert -f tum, or give --at")

    def start(self, own: str | None) -> str:
        """Return the frame in which a record is expressed: SOURCE, or its own; raises ValueInvalid if it is unknown."""
        if own and own not in self._resolved:
            self._resolved[own] = frame_name(own, self.tree)
        if (frame := _agreed_frame(own and self._resolved[own], self.source)) is None:
            raise ValueInvalid("a record does not say its frame; name SOURCE, or write {frame: .., point: [..]}")
        return frame

    def from_frame(self, own: str | None, own_ns: int | None = None) -> Components:
        """Return the transform of records expressed in a frame: at --at, at their own time, or the latest."""
        return self.lookups.one(self.target, self.start(own), own_ns if self.at is None else lookup_time_ns(self.at))

    def at_times(self, own: str | None, times_ns: Any) -> Components:
        """Return the transforms of records expressed in a frame at many times, as columns; nan for missing data."""
        return self.lookups.many(self.target, self.start(own), times_ns)


def _agreed_frame(own: str | None, source: str | None) -> str | None:
    """Return the frame in which a record is expressed; raise ValueInvalid if record and command name different ones."""
    if own and source is not None and own != source and not {own, source} <= {*EARTH_FRAMES}:
        remedy = "leave SOURCE out to use each record's own frame"
        raise ValueInvalid(f"a record is expressed in {shown(own)}, not in {shown(source)}; {remedy}")
    return source or own


def is_record(argument: str) -> bool:
    """Return True for a record, False for a frame's name."""
    return argument == "-" or is_inline(argument) or "\n" in argument


def begins_number(argument: str) -> bool:
    """Return True for an argument that begins like one of the three numbers of a point."""
    return argument.lstrip("-+.")[:1].isdigit() and "," not in argument


def _is_apart(argument: str) -> bool:
    """Return True for an argument that is a whole record, pasted text, or empty, not one number of a point."""
    return not argument or is_record(argument) or (not begins_number(argument) and is_pasted(argument))


def sources_of(inputs: Inputs, arguments: Sequence[str], kind: str = "", place: str = "") -> Iterator[str | Source]:
    """Yield the texts of records: three bare numbers become a point, other arguments are unchanged."""
    if place and not any(map(is_record, arguments)):
        from frametool.cli.earth_options import mapping_of

        yield mapping_of(inputs, arguments, place)
        return
    for are_apart, group in groupby(arguments, _is_apart):
        texts = list(group)
        if are_apart:
            yield from filter(None, texts)
            continue
        if kind not in ("", "point", "vector"):
            raise click.UsageError(f"a {kind} is a mapping, e.g. '{{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}}'")
        try:
            numbers = [parse_length(text) for text in texts]
        except NotFinite:
            raise
        except ValueInvalid as error:
            file = next(filter(os.path.isfile, texts), "")
            refuse(file, f"pass a file of records with -i {file}")
            raise click.UsageError(f"{error}; a point is three numbers or a mapping") from None
        refuse(len(numbers) % 3, f"points are three numbers each, found {len(numbers)}")
        for at in range(0, len(numbers), 3):
            yield Source("argument", f'{{"{kind or "point"}": {numbers[at : at + 3]}}}')
