"""What writes blocks of results, whatever their format: text, columns of numbers, or messages of a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from frametool.formats.table import FORMATS
from frametool.stream.row_layout import POSE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.grammar.result import Style
    from frametool.stream.row_poses import RowPoses


class BlockWriter(Protocol):
    """Write one block of results after the other."""

    def of_block(self, block: RowPoses) -> bytes:
        """Return what is written of a block, perhaps nothing yet."""

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last block, and warn of what was left out."""


def writer_for(style: Style, kind: str = POSE, extras: Sequence[str] = (), *, placed: bool = True) -> BlockWriter:
    """Return what writes blocks in the format of a style: text, columns of numbers, or messages of a recording.

    kind: pose, point, ..; extras: the numbers with each; placed: whether poses have a position
    """
    writes = FORMATS[style.format].writes
    if "arrays" in writes:
        from frametool.stream.array_writer import ArrayWriter

        return ArrayWriter(style, kind, extras, placed=placed)
    if "recording" in writes:
        from frametool.stream.recording_writer import RecordingWriter

        return RecordingWriter(style, kind, extras, placed=placed)
    from frametool.stream.writers import TextWriter

    return TextWriter(style, kind, extras, placed=placed)
