"""`apply` on the clouds of a bag: each message moved at its stamp, and written into a file of its own."""

from __future__ import annotations

import os
import re
from contextlib import ExitStack
from functools import cache
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.group import settings
from frametool.cli.sink import writing
from frametool.cli.stderr import say, say_warning
from frametool.errors import FormatError, FrametoolError, FrametoolWarning, heard_by, shown
from frametool.formats.detect import of_folder
from frametool.formats.table import BAG, FORMATS, by_suffix, holds_arrays, writers
from frametool.frames.stamps import format_stamp
from frametool.stream.faults import Fault

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.cli.output import Output
    from frametool.cli.streaming import Stream
    from frametool.geometry.types import Rigid
    from frametool.ros.point_clouds import PointCloud
    from frametool.stream.faults import BadRows

PLACES: dict[str, Callable[[PointCloud], str]] = {
    "stamp_ns": lambda cloud: str(cloud.stamp_ns),
    "stamp": lambda cloud: format_stamp(cloud.stamp_ns),
    "number": lambda cloud: f"{cloud.number:06d}",
    "topic": lambda cloud: cloud.topic.strip("/"),
    "frame": lambda cloud: cloud.frame,
}  # {NAME} in -o -> what stands there
_HEAD = 64
_UNUSED = {"columns": "--columns", "keep": "--keep", "prefix": "--prefix", "given": "--from"}


class BagOfClouds:
    """The clouds of a bag that -i names, and the files that they become."""

    def __init__(self, path: str, output: Output, stream: Stream) -> None:
        """Open the bag and choose its topics; of --topic, what names no clouds is left to the tree."""
        from frametool.grammar.edges import Tally
        from frametool.ros.bags import opened_bag
        from frametool.ros.point_clouds import cloud_topics

        self.path = path
        self.output = output
        self.stream = stream
        if unused := [option for name, option in _UNUSED.items() if stream.options.get(name)]:
            raise click.UsageError(f"{', '.join(unused)}: clouds say themselves what their columns are")
        if output.path in (None, "-") or not holds_arrays(output.told or ""):
            forms = ", ".join(writers("arrays"))
            raise click.UsageError(f"each cloud of a bag is a file: -o 'scan_{{stamp_ns}}.pcd'; forms: {forms}")
        self.pattern = str(output.path)
        for place in re.findall(r"\{(\w*)\}", self.pattern):
            if place not in PLACES:
                known = ", ".join(f"{{{each}}}" for each in PLACES)
                raise click.UsageError(f"-o {self.pattern}: {{{place}}} has no meaning; there are {known}")
        self.tally = Tally()
        chosen = settings().topics
        with ExitStack() as opened:
            self.reader = opened.enter_context(opened_bag(path, self.tally))
            self.topics = cloud_topics(self.reader, chosen, path)
            self.opened = opened.pop_all()
        clouds = {topic.strip("/") for topic in self.topics}
        settings().topics = tuple(topic for topic in chosen if topic.strip("/") not in clouds)
        self.names: dict[str, int] = {}

    def run(self, pose_of: Callable[[str | None, int | None], Rigid], target: str | None) -> int:
        """Move and write cloud after cloud; return the exit status.

        pose_of: the pose that moves what is given in a frame at a time
        """
        from frametool.ros.point_clouds import read_clouds

        bad = self.stream.policy(self.path, "message")
        count = points = 0
        once: Any = cache(say_warning)
        with self.opened, heard_by(once):
            for cloud in read_clouds(self.reader, self.topics, self.path, self.tally):
                count += 1
                if isinstance(cloud, FormatError):
                    bad.take([Fault(cloud.line, "", cloud.message)])
                    continue
                points += self._write(cloud, pose_of, bad)
            for told in self.tally.told():
                once(f"{self.path}: {told.message}", told.rule, FrametoolWarning)
        if not count:
            raise FormatError(f"no messages on {', '.join(self.topics)}", source=self.path)
        if not self.stream.options["quiet"]:
            files = f"{len(self.names)} {'file' if len(self.names) == 1 else 'files'}"
            where = f" in {target}" if target else ""
            say(f"{self.path}: {points} points{where}, metres, in {files} ({', '.join(self.topics)})")
        return bad.finish(count)

    def _write(self, cloud: PointCloud, pose_of: Callable[[str | None, int | None], Rigid], bad: BadRows) -> int:
        """Write one cloud; return how many points it has, 0 where the message is bad."""
        from frametool.stream.column_stream import moved_cloud

        try:
            pose = pose_of(cloud.frame or None, cloud.stamp_ns)
        except FrametoolError as error:
            bad.take([Fault.of(cloud.number, "", error)])
            return 0
        name = self._name(cloud)
        style = self.output.style.in_form(self.output.told or "")
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
        name = re.sub(r"\{(\w+)\}", lambda found: texts[found[1]], self.pattern)
        if name in self.names:
            both = f"messages {self.names[name]} and {cloud.number} would both become {shown(name)}"
            remedy = "{number}" if "{" in self.pattern else "{stamp_ns}"
            raise FormatError(f"{both}; put {remedy} into its name", source=self.path)
        return name


def clouds_of(stream: Stream, output: Output) -> BagOfClouds | None:
    """Return the clouds of a bag if -i names one whose messages are no records."""
    if not stream.path or not is_bag(stream.path):
        return None
    if not holds_arrays(output.told or "") and stream.messages() is not None:
        return None
    return BagOfClouds(stream.path, output, stream)


def is_bag(path: str) -> bool:
    """Tell a bag by its first bytes, or as a folder."""
    bags = tuple(name for name, row in FORMATS.items() if row.reader == BAG)
    if not os.path.isfile(path):
        return of_folder(path) in bags
    with open(path, "rb") as file:
        head = file.read(_HEAD)
    if not head:
        return by_suffix(path, bags) is not None
    magics: list[Any] = [what for name in bags for kind, what in FORMATS[name].signs if kind == "magic"]
    return any(re.match(magic, head, re.DOTALL) for magic in magics)
