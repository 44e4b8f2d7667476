"""`apply` on the clouds of a bag: each message moved at its stamp, and written into a file of its own."""

from __future__ import annotations

import os
import re
from contextlib import ExitStack
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.cli.command import refuse
from frametool.cli.options import for_each
from frametool.cli.sink import writing
from frametool.cli.stderr import say, say_warning
from frametool.errors import FormatError, FrametoolError, FrametoolWarning, heard_by, shown
from frametool.formats.detect import of_folder
from frametool.formats.table import BAG, FORMATS, by_suffix, holds_arrays, writers
from frametool.frames.stamps import format_stamp
from frametool.stream.faults import BadRows, Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.cli.commands.apply import Way
    from frametool.cli.output import Output
    from frametool.cli.streaming import Stream
    from frametool.recordings.messages import PointCloud

PLACES: dict[str, Callable[[PointCloud], str]] = {
    "stamp_ns": lambda cloud: str(cloud.stamp_ns),
    "stamp": lambda cloud: format_stamp(cloud.stamp_ns),
    "number": lambda cloud: f"{cloud.number:06d}",
    "topic": lambda cloud: cloud.topic.strip("/"),
    "frame": lambda cloud: cloud.frame,
}  # {NAME} in -o -> what replaces it
_HEAD = 64
_WRITTEN = f"formats: {', '.join(writers('arrays'))}"
BAGS = tuple(name for name, row in FORMATS.items() if row.reader == BAG)
_MAGICS: list[Any] = [what for name in BAGS for kind, what in FORMATS[name].magic if kind == "magic"]


class BagOfClouds:
    """The clouds of a bag that -i names, and the files that they become."""

    def __init__(self, path: str, output: Output, stream: Stream) -> None:
        """Open the bag and choose its topics; of --topic, what names no clouds is left to the tree."""
        from frametool.grammar.edges import Diagnostics
        from frametool.recordings.messages import cloud_topics
        from frametool.recordings.read import opened_recording

        self.path, self.output, self.stream, inputs = path, output, stream, stream.inputs
        inputs.ask("input_path")
        is_one = output.path in (None, "-") or not holds_arrays(output.chosen or "")
        refuse(is_one, f"each cloud of a bag is a file: -o 'scan_{{stamp_ns}}.pcd'; {_WRITTEN}")
        self.tally, self.names = Diagnostics(), dict[str, int]()
        chosen = inputs.topics
        with ExitStack() as opened:
            self.reader = opened.enter_context(opened_recording(path, self.tally))
            self.topics = cloud_topics(self.reader, chosen)
            self.opened = opened.pop_all()
        clouds = {topic.strip("/") for topic in self.topics}
        inputs.leave(topics=tuple(topic for topic in chosen if topic.strip("/") not in clouds))

    def run(self, way: Way, *, alone: bool) -> int:
        """Move and write cloud after cloud; return the exit status.  alone: there is nothing else to do."""
        from frametool.recordings.messages import read_clouds

        refuse(way.uncertain or not alone, "the clouds of a bag are moved whole, each at its own stamp; no records")
        bad = self.stream.policy(self.path, "message")
        self.stream.inputs.refuse_idle()
        count = points = 0
        once: Any = cache(say_warning)
        with self.opened, heard_by(once):
            for cloud in read_clouds(self.reader, self.topics, self.tally):
                count += 1
                if isinstance(cloud, FormatError):
                    bad.take([Fault(cloud.line, "", cloud.message)])
                else:
                    points += self._write(cloud, way, bad)
            for finding in self.tally.findings():
                once(f"{self.path}: {finding.message}", finding.rule, FrametoolWarning)
        if not count:
            raise FormatError(f"no messages on {', '.join(self.topics)}", source=self.path)
        if not self.stream.inputs.quiet:
            files = f"{len(self.names)} {'file' if len(self.names) == 1 else 'files'}"
            say(f"{self.path}: {points} points{_where(way)}, metres, in {files} ({', '.join(self.topics)})")
        return bad.finish(count)

    def _write(self, cloud: PointCloud, way: Way, bad: BadRows) -> int:
        """Write one cloud; return how many points it has, 0 where the message is bad."""
        from frametool.stream.column_stream import moved_cloud

        try:
            pose = way.from_frame(cloud.frame or None, cloud.stamp_ns)
        except FrametoolError as error:
            bad.take([Fault.of(cloud.number, "", error)])
            return 0
        name = self._name(cloud)
        style = self.output.style.with_format(self.output.chosen or "")
        with writing(name, force=self.output.force) as write:
            for outcome in moved_cloud(cloud, pose, style, self.path):
                for fault in outcome.faults:
                    reason = f"point {fault.line + 1}: {fault.reason}"
                    raise FormatError(f"message {cloud.number}: {reason}", source=self.path)
                write(outcome.text)
        self.names[name] = cloud.number
        return len(cloud.rows)

    def _name(self, cloud: PointCloud) -> str:
        """Return the name of a cloud's file; raises FormatError for one that another has."""
        texts = {place: re.sub(r"[/\0]|^\.+", "_", text(cloud)) for place, text in PLACES.items()}  # no other folder
        name = re.sub(r"\{(\w+)\}", lambda found: texts.get(found[1], found[0]), str(self.output.path))
        if name in self.names:
            both = f"messages {self.names[name]} and {cloud.number} would both become {shown(name)}"
            raise FormatError(f"{both}; put {{stamp_ns}} or {{number}} into its name", source=self.path)
        return name


def _where(way: Way) -> str:
    return f" in {way.target}" if way.target else ""


class SeveralClouds:
    """Clouds of several -i that become one: each is expressed in a frame of its own, or all in SOURCE."""

    def __init__(self, output: Output, stream: Stream) -> None:
        """Take --frames and the --in of clouds; the tree may not have them too.  Raises click.UsageError."""
        self.output, self.stream, inputs = output, stream, stream.inputs
        self.paths: Sequence[str] = inputs.input_path
        others = [path for path in self.paths if path == "-" or is_bag(path)]
        refuse(others, f"-i {''.join(others[:1])}: several -i are files of one cloud each")
        refuse(not holds_arrays(output.chosen or ""), f"several clouds become one: -o all.ply, or -f; {_WRITTEN}")
        formats = inputs.input_formats
        named = [fmt for fmt in formats if "arrays" in FORMATS[fmt].reads]
        self.formats = for_each(named, len(self.paths))
        self.frames = [name.strip() for text in inputs.named_frames for name in text.split(",")]
        inputs.leave(input_formats=[fmt for fmt in formats if fmt not in named], named_frames=())

    def run(self, way: Way, *, alone: bool) -> int:
        """Move all and write them as one; return the exit status.  alone: there is nothing else to do."""
        from frametool.cli.trees import answers
        from frametool.documents.source import InputFile
        from frametool.formats.detect import detect
        from frametool.grammar.edges import Diagnostics, Options, Topics
        from frametool.stream.column_stream import MergedClouds
        from frametool.stream.faults import run
        from frametool.stream.request import Operation, Request

        count, frames, inputs = len(self.paths), self.frames, self.stream.inputs
        is_more = way.uncertain or not alone
        refuse(is_more, "several clouds are moved whole, without records, --covariance or --explain")
        is_open = way.has_source == bool(frames) or len(frames) not in (0, count)
        refuse(is_open, f"name SOURCE, the frame of all clouds, or --frames A,B with one for each of the {count}")
        with ExitStack() as opened:
            planned = []
            for path, named, frame in zip(self.paths, self.formats, frames or [""] * count, strict=True):
                file = InputFile(path)
                opened.callback(file.close)
                file.format = fmt = named or detect(file.head(), "records", "rows", "arrays", name=path)[0]
                if "arrays" not in FORMATS[fmt].reads:
                    hint = f"make one of it: frametool convert -i {path} -o NEW.pcd"
                    raise FormatError(f"{FORMATS[fmt].summary}, no cloud; {hint}", source=path)
                reading = Options(Diagnostics(), Topics(), answers=answers())
                columns = import_module(FORMATS[fmt].reader).open_columns(file, reading)
                operation = Operation(left=way.from_frame(frame or None, None), moves=True)
                planned.append((columns, Request(operation, on_error=inputs.on_error), path))
            merged = MergedClouds(planned, self.output.style)
            status = 0
            with writing(self.output.path, force=self.output.force) as write:
                for at, path in enumerate(self.paths):
                    policy = self.stream.policy(path, "row")
                    status = max(status, run(merged.outcomes(at), write, policy, lambda _rows, _size: None))
                for piece in merged.writer.end():
                    write(piece)
        if not inputs.quiet:
            froms = f", from {', '.join(frames)}" if frames else ""
            say(f"{count} clouds{_where(way)} as one{froms}; metres")
        return status


def clouds_of(stream: Stream, output: Output) -> BagOfClouds | SeveralClouds | None:
    """Return several clouds, or those of a bag if -i names one whose messages are no records."""
    if len(stream.paths) > 1:
        return SeveralClouds(output, stream)
    if not stream.path or not is_bag(stream.path):
        return None
    if not holds_arrays(output.chosen or "") and stream.messages() is not None:
        return None
    return BagOfClouds(stream.path, output, stream)


def is_bag(path: str) -> bool:
    """Recognize a bag by its first bytes, or as a folder."""
    if not os.path.isfile(path):
        return of_folder(path) in BAGS
    with open(path, "rb") as file:
        head = file.read(_HEAD)
    return re.match(b"|".join(_MAGICS), head, re.DOTALL) is not None if head else by_suffix(path, BAGS) is not None
