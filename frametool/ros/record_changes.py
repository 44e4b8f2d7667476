"""Which messages of a recording are copied and how they are changed, and what is in it."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from frametool.ros.bags import TYPES
from frametool.ros.message_chunks import Chunk

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.ros.message_chunks import Channel, Entry
    from frametool.ros.record_copy import Advance, CopiedRecording

    Change = Callable[[bytes, int], bytes | None]  # of a message and its log time; None leaves it out


class RecordChanges:
    """The changes to the messages of a recording.

    window: the first and the last log time that is copied; always: channels that are copied whole
    change: makes the new messages of a channel
    """

    def __init__(self, window: tuple[int, int] | None = None) -> None:
        """Begin with a window alone."""
        self.window = window
        self.always: set[int] = set()
        self.change: dict[int, Change] = {}

    def apply(self, chunk: Chunk) -> list[tuple[Entry, bytes | None]] | None:
        """Return the messages of a chunk that are copied, with their data where it is new; None if nothing changes."""
        if self.window is None and not any(entry[0] in self.change for entry in chunk.entries):
            return None
        entries = [entry for entry in chunk.entries if self.keeps(entry)]
        copied: list[tuple[Entry, bytes | None]] = []
        is_other = len(entries) < len(chunk.entries)
        for entry in entries:
            change = self.change.get(entry[0])
            if change is None:
                copied.append((entry, None))
                continue
            data = chunk.raw[entry[3] : entry[4]]
            new = change(data, entry[1])
            is_other |= new is not data
            if new is not None:
                copied.append((entry, None if new is data else new))
        return copied if is_other else None

    def keeps(self, entry: Entry) -> bool:
        """Tell whether a message is copied, by its log time."""
        return self.window is None or self.window[0] <= entry[1] <= self.window[1] or entry[0] in self.always


class RecordContents:
    """What is in a recording: how many messages, and when.

    counts: of messages by channel; span: the first and the last log time
    inside, outside: how many are copied in the window and outside of it; first_ns: the first log time that is copied
    """

    def __init__(self, recording: CopiedRecording, changes: RecordChanges) -> None:
        """Begin before the first chunk."""
        self.recording, self.changes = recording, changes
        self.counts: Counter[int] = Counter()
        self.span: tuple[int, int] | None = None
        self.inside = self.outside = 0
        self.first_ns: int | None = None

    def read(self, advance: Advance, see: Callable[[Channel, bytes], None] | None = None) -> None:
        """Read it all; raises FormatError for a recording that is not whole.

        see: is called with every message of transforms and its channel
        """
        channels: dict[int, Channel] = {}
        for piece in self.recording.pieces():
            if not isinstance(piece, Chunk) or not piece.entries:
                continue
            counted = Counter(entry[0] for entry in piece.entries)
            if not counted.keys() <= channels.keys():
                channels = self.recording.channels
                self.changes.always = {number for number, each in channels.items() if each.is_static}
            self.counts += counted
            self._time(piece)
            if see is not None and any(channels[number].type in TYPES for number in counted):
                for number, _, _, start, end in piece.entries:
                    if channels[number].type in TYPES:
                        see(channels[number], piece.raw[start:end])
            advance(len(piece.entries), len(piece.stored or piece.raw))

    def _time(self, chunk: Chunk) -> None:
        """Look at the log times of a chunk."""
        times = [entry[1] for entry in chunk.entries]
        first, last = self.span or (times[0], times[0])
        self.span = min(first, *times), max(last, *times)
        window = self.changes.window
        if window is not None:
            inside = sum(window[0] <= each <= window[1] for each in times)
            times = [entry[1] for entry in chunk.entries if self.changes.keeps(entry)]
            self.inside += inside
            self.outside += len(times) - inside
        if times:
            self.first_ns = min(times) if self.first_ns is None else min(self.first_ns, *times)
