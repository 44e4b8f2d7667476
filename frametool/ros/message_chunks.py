"""What a recording comes down to where it is copied: chunks of messages as bytes, each message on a channel.

MCAP files and ROS 1 bags are both made so.  A chunk in which nothing changes is copied as it stands in its file.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from frametool.errors import FileProblem
from frametool.ros.recordings import NO_EXTRA

if TYPE_CHECKING:
    from collections.abc import Sequence

FULL = 1 << 20  # bytes of messages that make a chunk where nobody else has made one

# number of its channel, log time, and places in its chunk: where its record begins, where its data begin and end
Entry: TypeAlias = tuple[int, int, int, int, int]


class Channel(NamedTuple):
    """What messages of one publisher have in common.

    topic, type: as ROS 2 writes them, `/pose` and `geometry_msgs/msg/PoseStamped`
    encoding: of its messages: `cdr`, `ros1`, or what else there is
    """

    topic: str
    type: str
    encoding: str

    @property
    def is_static(self) -> bool:
        """Tell whether it is a topic of transforms for good."""
        return self.topic.rpartition("/")[2] == "tf_static"


class Chunk(NamedTuple):
    """Messages that lie together.

    raw: their records, not compressed, with those of channels among them
    compression: of the chunk in its file; "" is none
    stored: what stands in the file of it; is_same: the numbers of channels in it are those of the copy
    """

    raw: bytes
    entries: Sequence[Entry]
    compression: str = ""
    stored: bytes | None = None
    is_same: bool = True


class OtherRecord(NamedTuple):
    """What is in a file beside messages, as an attachment: its kind, and all behind that."""

    kind: int
    body: bytes


def zstd() -> Any:
    """Return the library that rosbags uses, by whichever name it has."""
    for name in ("compression.zstd", "backports.zstd", "zstandard"):
        try:
            return import_module(name)
        except ImportError:
            continue
    raise FileProblem(NO_EXTRA)


def unpacked(data: bytes, compression: str, size: int) -> bytes:
    """Return what was compressed, of so many bytes; raises ValueError if it is of another size or unknown kind."""
    if compression in ("", "none"):
        found = data
    elif compression == "zstd":
        library = zstd()
        limit = {"max_output_size": size} if library.__name__ == "zstandard" else {}
        found = library.decompress(data, **limit)
    elif compression in _MODULES:
        found = import_module(_MODULES[compression]).decompress(data)
    else:
        raise ValueError(f"compression {compression!r} is not known")
    if len(found) != size:
        raise ValueError(f"a chunk has {len(found)} bytes and not {size}")
    return found


def packed(raw: bytes, compression: str) -> bytes:
    """Compress a chunk as it was before."""
    if compression in ("", "none"):
        return raw
    made: bytes = (zstd() if compression == "zstd" else import_module(_MODULES[compression])).compress(raw)
    return made


_MODULES = {"lz4": "lz4.frame", "bz2": "bz2"}
