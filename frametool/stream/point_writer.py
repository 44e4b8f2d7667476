"""Points and vectors in blocks to the text of a form that is not their table's."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid
from frametool.formats import FORMATS
from frametool.stream.pose_values import plain_cell, texts_of

if TYPE_CHECKING:
    from frametool.grammar.result import Style
    from frametool.stream.table_poses import RowPoses


class PointWriter:
    """Write blocks of points or vectors one after the other, as the form writes single ones."""

    def __init__(self, style: Style, kind: str) -> None:
        """Choose the form; kind: `point` or `vector`.  Raises ValueInvalid for a form that holds poses only."""
        if "points" not in FORMATS[style.form].writes:
            raise ValueInvalid(f"{style.form} holds poses; a {kind} has no rotation")
        self.style = style
        self.kind = kind
        self.module: Any = import_module(FORMATS[style.form].writer)
        self.first: dict[str, Any] | None = None

    def of_block(self, block: RowPoses) -> bytes:
        """Return the text of a block; numbers are metres."""
        records = self._records(block)
        if not records:
            return b""
        text: str
        if self.first is None:
            self.first = records[0]
            text = self.module.write_points(records, self.style)
            return text.encode()
        known = self.module.write_points([self.first], self.style)
        text = self.module.write_points([self.first, *records], self.style)
        return text[len(known) :].encode()

    def end(self) -> bytes:
        """Return what comes behind the last: nothing."""
        return b""

    def _records(self, block: RowPoses) -> list[dict[str, Any]]:
        size = len(block.numbers)
        frames = block.parents if len(block.parents) == size else list(block.parents) * size
        others = {name: [plain_cell(text) for text in texts_of(cells)] for name, cells in block.extras.items()}
        stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
        records = []
        for at, numbers in enumerate(block.numbers.tolist()):
            record: dict[str, Any] = {"frame": frames[at]} if frames[at] else {}
            record[self.kind] = numbers
            if stamps is not None:
                record["stamp_ns"] = stamps[at]
            records.append(record | {name: texts[at] for name, texts in others.items()})
        return records
