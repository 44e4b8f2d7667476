"""A recording copied with something changed: messages are bytes, and all that nobody asked to change stays as it is.

It is read twice: first to see what there is and whether it is whole, then to be written.  No messages are kept.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from frametool.recordings.made import KINDS, serialised, typestore
from frametool.recordings.read import ITSELF, SERIALIZED, Message, broken, read_metadata
from frametool.recordings.write import RecordingFile, new_channel

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from frametool.recordings.edges import AddedEdge
    from frametool.recordings.read import Channel, RecordingReader

    Advance = Callable[[int, int], None]  # takes how many messages and bytes were read
    Change = Callable[[bytes], bytes | None]  # of a message; None leaves it out

STATIC = KINDS["tf_static"]
STEP = 1 << 10  # messages between two reports


class RecordCopy:
    """What is in a recording, and how its copy differs.

    window: the first and the last log time that is copied, but all of what is static
    change: makes the new messages of a channel
    counts: of messages by channel; span: the first and the last log time
    inside, outside: how many are copied in the window and outside of it; first_ns: the first log time that is copied
    undefined: types that the recording does not define, and whether ROS 2 Humble does
    """

    def __init__(self, reader: RecordingReader, window: tuple[int, int] | None = None) -> None:
        """Begin before it is read."""
        self.reader, self.window = reader, window
        self.change: dict[Channel, Change] = {}
        self.counts: Counter[Channel] = Counter()
        self.span: tuple[int, int] | None = None
        self.inside = self.outside = 0
        self.first_ns: int | None = None
        self.undefined: dict[str, bool] = {}

    def look(self, advance: Advance, see: Callable[[Channel, bytes], None]) -> None:
        """Read it all, and let every message be seen; raises FormatError for a recording that is not whole."""
        for message in self._messages(advance):
            channel, log_ns, data, *_ = message
            self.counts[channel] += 1
            first, last = self.span or (log_ns, log_ns)
            self.span = min(first, log_ns), max(last, log_ns)
            if self._keeps(message):
                self.first_ns = log_ns if self.first_ns is None else min(self.first_ns, log_ns)
                self.inside += self._is_inside(log_ns)
                self.outside += not self._is_inside(log_ns)
            see(channel, data)

    def _messages(self, advance: Advance) -> Iterator[Message]:
        """Yield all messages."""
        size = 0
        with broken(self.reader.path):
            for number, message in enumerate(self.reader.messages(), 1):
                size += len(message.data)
                if number % STEP == 0:
                    advance(STEP, size)
                    size = 0
                yield message

    def _is_inside(self, log_ns: int) -> bool:
        return self.window is None or self.window[0] <= log_ns <= self.window[1]

    def _keeps(self, message: Message) -> bool:
        return self._is_inside(message.log_ns) or message.channel.is_static

    def pieces(
        self, form: str, folder: str, added: Mapping[str, Sequence[AddedEdge]], stamp_ns: int, advance: Advance
    ) -> Iterator[bytes]:
        """Yield the bytes of the copy in a form, with edges of some topics first; stamp_ns: of these.

        folder: where there is room for it while it is written
        """
        files = self.reader.files
        for each in self.reader.all:
            if each.schema is None and each.type:
                self._define(each)
        file = RecordingFile(form, folder, files[0].compression, head=files[0].head)
        for topic, edges in added.items():
            channel = self._latched(topic)
            file.begin([channel])
            frames = [(edge.parent, edge.child) for edge in edges]
            data = serialised(STATIC, form, frames, [stamp_ns] * len(edges), [edge.numbers for edge in edges])
            file.add(Message(channel, self.first_ns or 0, data, self.first_ns or 0))
        file.begin(self.reader.all)
        for message in self._messages(advance):
            if self._keeps(message):
                self._copy(message, file)
        with broken(self.reader.path):
            said = self._others(file)
            yield from file.pieces(said or self.reader.metadata, itself=said is not None)

    def _copy(self, message: Message, file: RecordingFile) -> None:
        """Copy a message as it is, or changed, or not at all."""
        change = self.change.get(message.channel)
        data = message.data if change is None else change(message.data)
        if data is not None:
            file.add(message if data is message.data else message._replace(data=data))

    def _others(self, file: RecordingFile) -> dict[str, Any] | None:
        """Copy attachments and metadata of MCAP; return what rosbag2 says of it there, or None."""
        said = None
        for source in self.reader.files:
            for other in source.others() if hasattr(source, "others") else ():
                if getattr(other, "metadata", None) is not None and other.name == ITSELF:
                    said = read_metadata(other.metadata.get(SERIALIZED, ""), self.reader.path)
                else:
                    file.add_other(other)
        return said

    def _define(self, channel: Channel) -> None:
        """Define a type that the recording does not define as ROS 2 Humble does, if it does."""
        store = typestore(ros1=False)
        is_known = channel.type in store.types
        self.undefined[channel.type] = is_known
        text = store.generate_msgdef(channel.type, ros_version=2)[0] if is_known else ""
        channel.schema = channel.type, "ros2msg" if is_known else "", text.encode()

    def _latched(self, topic: str) -> Channel:
        """Return a channel of transforms for good: that of the recording, or a new one.

        In a ROS 1 bag it is always new, for whoever plays it keeps the last message of each.
        """
        ros1 = self.reader.is_ros1
        same = [each for each in self.reader.channels if (each.topic, each.type) == (topic, STATIC.type)]
        return same[0] if same and not ros1 else new_channel(STATIC, topic, ros1=ros1, like=self.reader.all)
