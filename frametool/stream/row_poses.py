"""The rows of a table as blocks of poses: for trees, and for results in another format than the table's.

Also turns single results into such blocks and back, and columns of texts into spans and back.
"""

from __future__ import annotations

import re
from importlib import import_module
from math import isnan
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from frametool.documents.json import JSON_NUMBER, dump
from frametool.documents.source import Verbatim
from frametool.errors import ValueInvalid
from frametool.grammar.pose import SCALE, Pose
from frametool.grammar.result import NoResult, Result, with_entries
from frametool.stream.row_layout import AS_READ, NOWHERE, PARTS, POSE
from frametool.text.spans import Floats, Ints, Spans, without_quotes
from frametool.text.write import rounded_to_single, shortest_spans

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from frametool.geometry.place import Place, Spot
    from frametool.geometry.types import Components
    Cells: TypeAlias = Spans | NDArray[Any]

NO_STAMP = np.iinfo(np.int64).min  # of a bad row that is kept


class RowPoses(NamedTuple):
    """What became of the rows of a block: the good ones, in their order.

    numbers: (n, k) the results, position first; nan in a row without one that is kept
    stamps_ns: (n,) or None where rows have none; NO_STAMP in a row without a stamp
    lines: (n,) from 0
    parents, names: one a row, one for all, or none
    extras: columns that are not ours, by name: cells of text, numbers as they are, or objects (see `objects`)
    read: (n, 3) lat lon alt of positions on the Earth that nothing has moved, as they were read
    """

    numbers: Floats
    stamps_ns: Ints | None
    lines: Ints
    parents: Sequence[str | None]
    names: Sequence[str | None]
    extras: Mapping[str, Cells]
    read: Floats | None = None

    def for_each(self, names: Sequence[str | None]) -> Sequence[str | None]:
        """Return parents or names, one a row."""
        return names if len(names) == len(self.numbers) else [*names] * len(self.numbers)

    def spot(self, row: int) -> Spot | None:
        """Return the place that a row was read as."""
        return None if self.read is None else _place().spot_of(self.read[row].tolist())

    def unmoved(self, parts: Components) -> Components:
        """Return the components of the rows with what they were read as, if it is known."""
        if self.read is None:
            return parts
        return _place().Unmoved(parts, _place().spot_of(np.ascontiguousarray(self.read.T)))  # type: ignore[no-any-return]


def _place() -> Any:
    return import_module("frametool.geometry.place")  # few rows are on the Earth


def kept(block: RowPoses, rows: slice | Ints) -> RowPoses:
    """Return some poses of a block."""
    at = np.arange(len(block.numbers))[rows]
    parents, names = (
        [each[row] for row in at.tolist()] if len(each) == len(block.numbers) else each
        for each in (block.parents, block.names)
    )
    return block._replace(
        numbers=block.numbers[rows],
        stamps_ns=None if block.stamps_ns is None else block.stamps_ns[rows],
        lines=block.lines[rows],
        read=None if block.read is None else block.read[rows],
        parents=parents,
        names=names,
        extras={name: taken(each, at) for name, each in block.extras.items()},
    )


def taken(cells: Any, rows: Ints) -> Cells:
    """Return some cells of a column; what is no number, truth value or time of numpy as plain values."""
    if isinstance(cells, Spans):
        return Spans(cells.data, cells.starts[rows], cells.ends[rows])
    if is_typed(cells):
        return cells[rows]  # type: ignore[no-any-return]
    from frametool.formats.rows.column_file import plain_value

    is_array = isinstance(cells, np.ndarray)
    return objects(map(plain_value, cells[rows].tolist() if is_array else [cells[row] for row in rows.tolist()]))


def is_typed(cells: Any) -> bool:
    """Return True if cells are numbers, truth values or times of numpy, one a row."""
    return isinstance(cells, np.ndarray) and cells.ndim == 1 and cells.dtype.kind in "fiubM"


def block_of(results: Sequence[Result], *, placed: bool = True) -> RowPoses:
    """Return results as a block of poses; raises ValueInvalid for one without a rotation.

    placed: they have positions
    """
    if any(result.pose.rotation is None for result in results):
        raise ValueInvalid("a trajectory holds poses; a point has no rotation")
    stamped = ["stamp_ns" in result.extras for result in results]
    if any(stamped) and not all(stamped):
        raise ValueInvalid("some poses have a stamp and some have none; add it, or leave it out of all")
    poses = [result.pose for result in results]
    numbers = np.array([pose.components[0 if placed else 3 :] for pose in poses]) + 0.0  # none is -0.0
    parents, names = [pose.parent for pose in poses], [pose.name for pose in poses]
    scales: list[dict[str, Any]] = [{} if pose.scale == 1.0 else {SCALE: pose.scale} for pose in poses]
    others = [scale | result.extras for scale, result in zip(scales, results, strict=True)]
    return _block(numbers, parents, names, others)


def block_of_points(records: Sequence[Mapping[str, Any]]) -> tuple[str, RowPoses]:
    """Return mappings of points, vectors, twists or wrenches as a block, and what they are.

    Raises ValueInvalid for no such column, or several of them.
    """
    choices = (("point",), ("vector",), ("xyz",), *PARTS.values())
    kinds, found, rest = set[str](), list[list[Any]](), list[dict[str, Any]]()
    for record in records:  # its numbers are in lists, mappings, or under x, y, z
        keys = next((keys for keys in choices if set(keys) <= record.keys()), tuple("xyz"))
        kind = next((kind for kind, parts in PARTS.items() if parts == keys), "vector" if "vector" in keys else "point")
        numbers: list[Any] = []
        for value in map(record.get, keys):
            numbers += value.values() if isinstance(value, dict) else value if isinstance(value, list) else [value]
        if len(numbers) != (6 if kind in PARTS else 3) or not all(isinstance(number, float) for number in numbers):
            raise ValueInvalid(f"columns hold points or poses, found {', '.join(record)}")
        kinds.add(kind)
        found.append(numbers)
        rest.append({key: value for key, value in record.items() if key not in (*keys, "frame")})
    if len(kinds) > 1:
        raise ValueInvalid(f"columns hold things of one kind, found {' and '.join(sorted(kinds))}")
    frames = [record.get("frame") for record in records]
    return min(kinds), _block(np.array(found, np.float64), frames, [None], rest)


def _block(
    numbers: Floats, parents: list[str | None], names: list[str | None], others: Sequence[Mapping[str, Any]]
) -> RowPoses:
    """Return results as a block, with what else each of them says."""
    stamps = [other.get("stamp_ns") for other in others]
    is_stamped = bool(stamps) and all(type(stamp) is int for stamp in stamps)
    read = [other[AS_READ] for other in others if AS_READ in other]
    used = (AS_READ, "stamp_ns" if is_stamped else AS_READ)
    keys = dict.fromkeys(key for other in others for key in other if key not in used)
    parents, names = (each[:1] if len(set(each)) == 1 else each for each in (parents, names))
    return RowPoses(
        numbers, np.array(stamps, np.int64) if is_stamped else None, np.arange(len(numbers)), parents, names,
        {key: objects([other.get(key) for other in others]) for key in keys},
        read=np.array(read, np.float64) if read and len(read) == len(others) else None,
    )  # fmt: skip


def objects(values: Iterable[Any]) -> NDArray[Any]:
    """Return plain values as a column (n,): texts, None, mappings and lists; numbers and truth values as written."""
    found = list(values)
    column = np.empty(len(found), object)
    for at, value in enumerate(found):
        is_number = isinstance(value, (int, float))
        text = str(value).lower() if isinstance(value, bool) else repr(value)
        column[at] = Verbatim(text) if is_number else value
    return column


def values_of(
    block: RowPoses, kind: str, extras: Sequence[str] = (), place: Place | None = None, *, placed: bool = True
) -> list[Any]:
    """Return a block as single results of a kind: poses, placed or not, or points, vectors, .. as mappings.

    extras: the numbers that come with each; place: how positions on the Earth are written
    """
    names, parents = map(block.for_each, (block.names, block.parents))
    others = {name: plain_cells(cells) for name, cells in block.extras.items()}
    stamps = None if block.stamps_ns is None else block.stamps_ns.tolist()
    made: list[Any] = []
    for at, numbers in enumerate(block.numbers.tolist()):
        has_none, size = isnan(numbers[0]), len(numbers) - len(extras)
        own = None if has_none else numbers[:size]
        said = with_entries(dict(zip(extras, [None] * len(extras) if has_none else numbers[size:], strict=True)))
        if stamps is not None:
            said["stamp_ns"] = None if stamps[at] == NO_STAMP else stamps[at]
        said |= {name: cells[at] for name, cells in others.items()}
        named: dict[str, Any] = {"name": names[at]} if names[at] else {}
        if kind == POSE:
            components = NOWHERE if own is None else own if placed else (0.0, 0.0, 0.0, *own)
            pose = Pose.of(components, names[at], parents[at])._replace(read=block.spot(at))
            pose = pose if placed else pose._replace(position=None)
            made.append(NoResult(pose, said) if own is None else Result(pose, said))
        elif place is not None and own is not None:
            from frametool.grammar.place import point_entry

            made.append(named | point_entry(parents[at], own, place, block.spot(at)) | said)
        else:
            named |= {"frame": parents[at]} if parents[at] else {}
            made.append(named | spelled(kind, own) | said)
    return made


def spelled(kind: str, numbers: Sequence[float] | None) -> dict[str, Any]:
    """Return the numbers of a point, vector, twist or wrench under its keys; None in their place if there are none."""
    if kind not in PARTS:
        return {kind: numbers if numbers is None else list(numbers)}
    halves = (None, None) if numbers is None else (list(numbers[:3]), list(numbers[3:]))
    return {kind: dict(zip(PARTS[kind], halves, strict=True))}


def texts_of(cells: Cells) -> list[str]:
    """Return the text of each cell, without its quotes; of numbers the shortest that reads back, of lists JSON."""
    if not isinstance(cells, Spans) and cells.dtype == object:
        return [text_of(value) for value in cells.tolist()]
    if not isinstance(cells, Spans) and cells.dtype.kind != "f":
        texts: list[str] = cells.astype(np.str_).tolist()
        return [text.lower() for text in texts] if cells.dtype.kind == "b" else texts
    if not isinstance(cells, Spans):
        doubles = cells.astype(np.float64)
        doubles = doubles if cells.dtype.itemsize > 4 else rounded_to_single(doubles)
        spans = shortest_spans(doubles.reshape(-1, 1), b",")
        cells = Spans(spans.data, spans.starts[:, 0], spans.ends[:, 0] - 1)
    bare = without_quotes(cells)
    data = bare.data.tobytes()
    places = zip(bare.starts.tolist(), bare.ends.tolist(), strict=True)
    return [data[start:end].decode("utf-8", "replace").strip().replace('""', '"') for start, end in places]


def text_of(value: Any) -> str:
    """Return a plain value as a text, "" for none."""
    return "" if value is None else dump(value) if isinstance(value, (dict, list)) else str(value)


def plain_cells(cells: Cells) -> list[Any]:
    """Return cells as plain values."""
    if not isinstance(cells, Spans) and cells.dtype == object:
        return list(cells)
    texts = texts_of(cells)
    known: dict[str, str | Verbatim | None] = {"": None}
    for text in {*texts} - {""}:  # numbers and truth values as they are written
        known[text] = Verbatim(text) if text in ("true", "false") or re.fullmatch(JSON_NUMBER, text) else text
    return [known[text] for text in texts]
