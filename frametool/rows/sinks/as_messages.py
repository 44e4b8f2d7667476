"""Write blocks of poses and points as messages of a recording, and warn about what these cannot hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid, first_of, listing, warn
from frametool.formats.rows.pose_rows import MOST_NAMED
from frametool.geometry import arrays, earth, quaternion
from frametool.grammar.readers import EARTH_FRAMES
from frametool.recordings.write import KINDS, RecordingFile, check_stamps, filled, serialised
from frametool.rows.batch import RowPoses, plain_cells
from frametool.rows.shapes import POINT, POSE
from frametool.rows.sinks.as_rows import SingleWriter, refuse_infinite, refuse_scale_in

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.grammar.result import Style
    from frametool.text.spans import Floats, Ints

KINDS_OF = {POSE: ("pose", "tf", "path", "fix"), POINT: ("point", "fix")}  # the messages for each kind of row
FRAMES = "world", "body"  # if neither rows nor options name them
NAME = "name"
ANTENNA = "gps"  # the frame of a fix is that of its antenna
LLA = "lla"
NO_STAMPS = "{}: the rows have no stamps, and messages need them; `convert --stamps FILE` says them, one a line"


class RecordingWriter(SingleWriter):
    """Write blocks of poses or points as messages, on one topic, or on several at the same time."""

    def __init__(self, style: Style, first: RowPoses) -> None:
        """Choose the messages for the kind of rows in the first block.

        Raises ValueInvalid for rows and notations that no message can hold, FileProblem if the extra is not installed.
        """
        super().__init__(style, first)
        asked, kind = style.recording, self.kind
        if kind not in KINDS_OF:
            raise ValueInvalid(f"{style.format} is not written of rows of a {kind}; write csv, json or yaml")
        for name in asked.kinds:
            if name not in KINDS_OF[kind]:
                raise ValueInvalid(f"--messages {name} is not made of {kind}s; these are {', '.join(KINDS_OF[kind])}")
        if style.place is not None and (style.place.name != LLA or style.place.more):
            raise ValueInvalid(f"{style.format} holds places by lat lon alt only; leave --to {style.place.name} out")
        if any(each.spec != "quaternion" for each in style.notations):
            raise ValueInvalid(f"{style.format} writes rotations in its own way; leave --to out")
        usual: tuple[str, ...] = () if kind == POINT else ("pose",)  # for points decided by the frame
        if style.place is not None or (kind == POSE and asked.frames and not asked.topic):
            usual = ("pose", "tf") if style.place is None else ("fix",)
        self.kinds = asked.kinds or usual
        if "fix" in self.kinds and len(self.kinds) > 1:
            raise ValueInvalid("--messages fix stands alone: its numbers are lat, lon, alt")
        if asked.topic and len(self.kinds) > 1:
            raise ValueInvalid(f"there are {len(self.kinds)} topics ({', '.join(self.kinds)}); {asked.topic} names one")
        self.file = RecordingFile(style.format, asked.folder)
        self.dropped |= dict.fromkeys(self.extras)
        self.path: list[tuple[str, Ints, Floats]] = []
        self.lost: dict[str, None] = {}  # names of child frames that no message holds
        self.is_named = True  # True if all rows name their parent

    def of_block(self, block: RowPoses) -> bytes:
        """Add the messages of a block; their bytes are written by `end`."""
        if not (size := len(block.numbers)):
            return b""
        stamps, fmt = block.stamps_ns, self.style.format
        if stamps is None:
            raise ValueInvalid(NO_STAMPS.format(fmt))
        check_stamps(stamps, fmt)
        if not self.kinds:
            self.kinds = ("fix" if {*block.parents} <= {*EARTH_FRAMES} else "point",)
        used = (NAME,) if "fix" in self.kinds else ()
        self.dropped |= dict.fromkeys(name for name in block.extras if name not in used)
        refuse_scale_in(fmt, self.dropped)
        frames = self._frames(block)
        numbers = self._numbers(block)
        channels = {name: self.file.channel(name, self.style.recording.topic) for name in self.kinds}
        if channels.pop("path", None):
            self.path += [(frames[0][0], stamps, numbers)]
        rows_of: dict[tuple[str, str], Any] = {frames[0]: np.arange(size)} if len(frames) == 1 else {}
        for row, each in enumerate(frames if len(frames) > 1 else ()):
            rows_of.setdefault(each, []).append(row)
        messages = {name: [b""] * size for name in channels}
        for each, at in rows_of.items():
            for name, made in messages.items():
                for row, data in zip(at, filled(KINDS[name], fmt, each, stamps[at], numbers[at]), strict=True):
                    made[row] = data
        rows, topics = zip(stamps.tolist(), *messages.values(), strict=True), channels.values()
        self.file.write((topic, stamp, each) for stamp, *row in rows for topic, each in zip(topics, row, strict=True))
        return b""

    def end(self) -> Iterator[bytes]:
        """Yield the recording, and warn about what was left out or assumed."""
        fmt = self.style.format
        if self.path:  # all poses in one message, at the last stamp
            parents = {parent for parent, _, _ in self.path}
            if len(parents) > 1:
                raise ValueInvalid(f"a path is seen from one frame, the poses from {listing(parents)}")
            rows = (zip(stamps.tolist(), poses.tolist(), strict=True) for _, stamps, poses in self.path)
            samples = [(stamp, (min(parents), ""), pose) for each in rows for stamp, pose in each]
            data = serialised(KINDS["path"], fmt, samples)
            self.file.write([(self.file.channel("path", self.style.recording.topic), samples[-1][0], data)])
        if not self.is_named:
            warn(f"{fmt}: nothing names the frame that the rows are seen from; {FRAMES[0]!r} is written")
        if self.lost:
            kinds = f"; --messages {self.kinds[0]},tf keeps them" if self.kind == POSE else ""
            warn(f"{fmt}: names of frames left out: {first_of([*self.lost], MOST_NAMED)}{kinds}")
        yield from super().end()
        yield from self.file.pieces()

    def _frames(self, block: RowPoses) -> list[tuple[str, str]]:
        """Return (parent, child) of each row, or one for all."""
        said = self.style.recording.frames
        if self.kinds == ("fix",):
            names = plain_cells(block.extras[NAME]) if NAME in block.extras else block.names
            return [(name or ANTENNA, "") for name in (names if len({*names}) > 1 else names[:1])]
        parent, child = said or FRAMES
        there = {each for each in (*block.parents, *block.names) if each and each not in said}
        if said and there:
            raise ValueInvalid(f"the rows name other frames than --frames: {listing(there)}; leave --frames out")
        if not all(block.parents) and not said:
            self.is_named = False
        if "tf" in self.kinds and not all(block.names) and not said:
            raise ValueInvalid("--messages tf needs the names of both frames; `convert --frames A,B` says them")
        if "tf" not in self.kinds:
            self.lost |= dict.fromkeys(filter(None, block.names))
        size = max(len(block.parents), len(block.names))
        parents, names = (list(each) * (size if len(each) == 1 else 1) for each in (block.parents, block.names))
        return [(parents[at] or parent, names[at] or child) for at in range(size)]

    def _numbers(self, block: RowPoses) -> Floats:
        """Return the numbers of each row in a message: a position and quaternion, a point, or lat, lon, alt.

        Geodetic positions that nothing moved are returned as they were read.
        """
        if "fix" in self.kinds:
            if not {*block.parents} <= {*EARTH_FRAMES}:
                others = listing(each or "no frame" for each in block.parents if each not in EARTH_FRAMES)
                raise ValueInvalid(f"a fix is a place on the Earth: of rows in ecef, found {others}")
            self.dropped |= dict.fromkeys(["rotation"] * (self.kind == POSE))
            if block.read is not None:
                return block.read + 0.0
            x, y, z = (np.ascontiguousarray(column) for column in block.numbers.T[:3])
            return np.column_stack(earth.lla(x, y, z, arrays)) + 0.0
        numbers = np.column_stack(self.columns(block)[: 7 if self.kind == POSE else 3])
        refuse_infinite(numbers)
        if self.kind == POSE and not self.style.keep_sign:
            x, y, z, w = quaternion.unit(*numbers[:, 3:].T, arrays)  # type: ignore[call-arg]
            numbers[:, 3:] = np.column_stack(quaternion.from_quaternion(x, y, z, w, arrays))
        return numbers + 0.0  # no -0.0
