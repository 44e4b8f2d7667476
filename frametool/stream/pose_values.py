"""Blocks of poses to single results and back, and columns of texts to spans and back."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.documents.json_reader import JSON_NUMBER
from frametool.documents.json_writer import Verbatim
from frametool.errors import ValueInvalid
from frametool.formats.pose_rows import IMAGE
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result
from frametool.stream.table_poses import RowPoses
from frametool.text.cells import without_quotes
from frametool.text.shortest import shortest_spans
from frametool.text.shortest_single import rounded_to_single
from frametool.text.spans import MARGIN, Spans, framed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from frametool.stream.table_poses import Cells
    from frametool.text.array_types import Ints


def first_of(block: RowPoses) -> RowPoses:
    """Return the first pose of a block."""
    return kept(block, slice(0, 1))


def kept(block: RowPoses, rows: slice) -> RowPoses:
    """Return some poses of a block that follow one another."""
    size = len(block.numbers)
    return _with_cells(
        block, rows, *(each[rows] if len(each) == size else each for each in (block.parents, block.names))
    )


def chosen_poses(block: RowPoses, rows: Ints) -> RowPoses:
    """Return some poses of a block."""
    size = len(block.numbers)
    if len(rows) == size:
        return block
    names = [
        [each[row] for row in rows.tolist()] if len(each) == size else each for each in (block.parents, block.names)
    ]
    return _with_cells(block, rows, *names)


def _with_cells(
    block: RowPoses, rows: slice | Ints, parents: Sequence[str | None], names: Sequence[str | None]
) -> RowPoses:
    """Return some poses of a block with these names."""
    return block._replace(
        numbers=block.numbers[rows],
        stamps_ns=None if block.stamps_ns is None else block.stamps_ns[rows],
        lines=block.lines[rows],
        parents=parents,
        names=names,
        extras={name: cells_at(each, rows) for name, each in block.extras.items()},
    )


def cells_at(cells: Cells, rows: slice | Ints) -> Cells:
    """Return some cells of a column."""
    return Spans(cells.data, cells.starts[rows], cells.ends[rows]) if isinstance(cells, Spans) else cells[rows]


def block_of(results: Sequence[Result]) -> RowPoses:
    """Return results as a block of poses; raises ValueInvalid for one without a rotation."""
    if any(result.pose.rotation is None for result in results):
        raise ValueInvalid("a trajectory holds poses; a point has no rotation")
    stamps = [result.extras.get("stamp_ns") for result in results]
    others = {name for result in results for name in result.extras} - {"stamp_ns"}
    images = [str(result.extras.get(IMAGE, "")).encode() for result in results]
    blank = [b""] * len(results)
    names = {(result.pose.parent, result.pose.name) for result in results}
    parent, name = next(iter(names))
    return RowPoses(
        np.array([result.pose.components for result in results]),
        None if None in stamps else np.array(stamps, np.int64),
        np.arange(len(results)),
        [parent],
        [name],
        {each: spans_of(images if each == IMAGE else blank) for each in sorted(others)},
    )


def block_of_points(records: Sequence[dict[str, Any]]) -> RowPoses:
    """Return mappings of points or vectors as a block; raises ValueInvalid for what is neither."""
    kind = next((kind for kind in ("point", "vector") if records and kind in records[0]), "point")
    rows = [_coordinates(record, kind) for record in records]
    others = list(dict.fromkeys(key for record in records for key in record if key not in (kind, "frame", *"xyz")))
    return RowPoses(
        np.array(rows, np.float64).reshape(-1, 3),
        None,
        np.arange(len(rows)),
        [record.get("frame") for record in records],
        [None],
        {each: spans_of([_cell(record.get(each)) for record in records]) for each in others},
    )


def _coordinates(record: dict[str, Any], kind: str) -> list[float]:
    """Return the three numbers of a point, as a list, as a mapping, or under x, y, z."""
    given = record.get(kind, record)
    numbers = given if isinstance(given, list) else [given.get(name) for name in "xyz"] if given else []
    if len(numbers) != 3 or not all(isinstance(number, float) for number in numbers):
        raise ValueInvalid(f"columns hold points or poses, found {', '.join(record)}")
    return numbers


def _cell(value: Any) -> bytes:
    return b"" if value is None else str(value).encode()


def results_of(block: RowPoses, extras: Sequence[str], *, placed: bool = True) -> list[Result]:
    """Return a block as results, one a pose."""
    size = len(block.numbers)
    names, parents = (each if len(each) == size else list(each) * size for each in (block.names, block.parents))
    others = {name: [plain_cell(text) for text in texts_of(spans)] for name, spans in block.extras.items()}
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    made = []
    for at, numbers in enumerate(block.numbers.tolist()):
        own = 7 if placed else 4
        pose = Pose.of(tuple(numbers[:7]) if placed else (0.0, 0.0, 0.0, *numbers[:4]), names[at], parents[at])
        said: dict[str, Any] = dict(zip(extras, numbers[own:], strict=True))
        if stamps is not None:
            said["stamp_ns"] = stamps[at]
        said |= {name: texts[at] for name, texts in others.items()}
        made.append(Result(pose if placed else pose._replace(position=None), said))
    return made


def spans_of(texts: list[bytes]) -> Spans:
    """Return texts, one a row, as spans."""
    lengths = np.fromiter(map(len, texts), np.int64, len(texts))
    ends = np.cumsum(lengths) + MARGIN
    return Spans(framed(b"".join(texts)), ends - lengths, ends)


def texts_of(cells: Cells) -> list[str]:
    """Return the text of each cell, without its quotes; of numbers the shortest that reads back."""
    if not isinstance(cells, Spans) and cells.dtype.kind != "f":
        texts: list[str] = cells.astype(np.str_).tolist()
        return [text.lower() for text in texts] if cells.dtype.kind == "b" else texts
    if not isinstance(cells, Spans):
        cells = float_spans(cells)
    bare = without_quotes(cells)
    data = bare.data.tobytes()
    places = zip(bare.starts.tolist(), bare.ends.tolist(), strict=True)
    return [data[start:end].decode("utf-8", "replace").strip().replace('""', '"') for start, end in places]


def float_spans(values: NDArray[Any]) -> Spans:
    """Write floats as the shortest text that reads back to the same float of their type."""
    doubles = values.astype(np.float64) if values.dtype.itemsize > 4 else rounded_to_single(values.astype(np.float64))
    spans = shortest_spans(doubles.reshape(-1, 1), b",")
    return Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)


def plain_cell(text: str) -> str | Verbatim | None:
    """Return a cell as a plain value: numbers and truth values as they are written."""
    if not text:
        return None
    return Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
