"""LAS and LAZ, laser scans, with the libraries laspy and lazrs, the extra `frametool[las]`.

x y z are 32-bit integers, times a scale, plus an offset.  The scale is preserved; a new offset is chosen, whole metres
near the first points that are written; points that do not fit are an error.  All other dimensions, VLRs and EVLRs are
preserved, including a coordinate system, with a warning.
"""

from __future__ import annotations

from copy import deepcopy
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FileProblem, FormatError, ValueInvalid, warn
from frametool.formats.rows import column_file

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Made, OutColumn
    from frametool.geometry import Components
    from frametool.grammar.result import Style
    from frametool.text.spans import Ints

XYZ, WHOLE = column_file.XYZ, column_file.WHOLE
STORED = ("X", "Y", "Z")
LIMITS = np.iinfo(np.int32)
NEW_SCALE = 0.001  # metres, of a new file
COLOURS = {"red", "green", "blue"}
LAZ = "laz"
EXTRA = {f"{letter}{size}" for letter in "iu" for size in (1, 2, 4, 8)} | {"f4", "f8"}  # types of other dimensions
LONGEST_NAME = 32
RECORDS = (("VLRs", 100, 54), ("EVLRs", 243, 60))  # position of their count in the header, and minimum size of each
MINOR_AT, LEAST_HEAD = 25, 375  # position of the minor version (from 1.4 there are EVLRs); size of the header of 1.4
PACKED_AT, PACKED = 104, b"\x80"  # position of the byte that marks compression; its least value in compressed files


def _laspy(name: str, *, packed: bool = False) -> Any:
    """Import laspy and silence its log; raises FileProblem if it is missing, or lazrs if `packed`."""
    try:
        laspy = import_module("laspy")  # it ships no types
        if packed:
            import_module("lazrs")
    except ImportError:
        problem = "LAS is read and written with an extra; install it: pip install 'frametool[las]'"
        raise FileProblem(f"{name}: {problem}") from None
    import logging

    logger = logging.getLogger("laspy")
    if not logger.handlers:
        logger.addHandler(logging.NullHandler())
    return laspy


REFUSED = "it cannot be written as las: {}"


class _Clipped:
    """A file wrapper that reads no more than the file has: laspy allocates what a header states before it reads."""

    def __init__(self, stream: Any, size: int) -> None:
        """Store a seekable stream and its size."""
        self._stream, self._size = stream, size

    def __getattr__(self, name: str) -> Any:
        """Delegate everything else to the file."""
        return getattr(self._stream, name)

    def read(self, size: int = -1) -> bytes:
        """Read this many bytes, or all that are left."""
        left = max(self._size - self._stream.tell(), 0)
        data: bytes = self._stream.read(left if size < 0 else min(size, left))
        return data


class LasBatch(column_file.StructuredBatch):
    """A batch of points."""

    def __init__(self, points: Any, names: Sequence[str]) -> None:
        """Store a record of the library and the names of the columns."""
        super().__init__(points.array)
        self.points, self.names = points, names

    def column(self, place: int) -> NDArray[Any]:
        """Return a column unchanged."""
        return np.array(self.points[self.names[place]])


class LasFile(column_file.ColumnFile):
    """A scan whose points are read in batches."""

    vectors = (("x_t", "y_t", "z_t"),)  # directions of waveforms
    gaps = False

    def __init__(self, file: InputFile) -> None:
        """Read the header; raises FormatError for a broken one, FileProblem if the extra is missing."""
        laspy = _laspy(file.name, packed=file.head()[PACKED_AT : PACKED_AT + 1] >= PACKED)
        self.file = file
        file.stream = column_file.seekable(file, self)
        whole = column_file.bytes_left(file.stream) or 0
        head = file.stream.read(LEAST_HEAD)
        file.stream.seek(0)
        for what, at, size in RECORDS[: 1 + (head[MINOR_AT : MINOR_AT + 1] >= b"\x04")]:
            if (count := int.from_bytes(head[at : at + 4], "little")) * size > whole:
                raise file.error(f"the header says {count} {what}, in {whole} bytes")
        with column_file.translated(file.name):
            self.reader = laspy.open(_Clipped(file.stream, whole), closefd=False)
            header = self.header = self.reader.header
            if not header.are_points_compressed:
                file.stream.seek(header.offset_to_point_data)
                last = not (header.number_of_evlrs or header.start_of_waveform_data_packet_record)
                column_file.check_declared(file, header.point_count, header.point_format.size, "points", last=last)
            elif header.point_count > whole * MOST_PACKED:
                raise file.error(f"the header says {header.point_count} points, in {whole} bytes")
            self.names = (*XYZ, *(name for name in header.point_format.dimension_names if name not in STORED))
            probe = laspy.ScaleAwarePointRecord.zeros(1, header=header)
            kinds = [np.array(probe[name]) for name in self.names]
        self.width = len(self.names)
        self.kinds = [each.dtype if each.ndim == 1 else None for each in kinds]  # None: several values

    def moved_by(self, pose: Components | None) -> None:
        """Warn if the file states a coordinate system, which is preserved."""
        del pose
        if any(type(vlr).__name__.startswith(("Wkt", "Geo")) for vlr in self.header.vlrs):
            warn(f"{self.file.name}: its coordinate system (CRS) is kept as it is; is it still that of the points?")

    def batches(self) -> Iterator[LasBatch]:
        """Yield the points; raises FormatError if the file ends too early."""
        count, done = self.header.point_count, 0
        while done < count:
            wanted = min(column_file.MOST_ROWS, count - done)
            with column_file.translated(self.file.name):
                points = self.reader.read_points(wanted)
            done += len(points)
            if len(points) < wanted:
                raise self.file.error(f"the file ends after {done} of {count} points")
            yield LasBatch(points, self.names)

    def rewriter(self, columns: Sequence[OutColumn], _count: int | None, style: Style) -> LasWriter:
        """Return a writer for a file of the same kind."""
        if [column.name for column in columns] != list(self.names):
            raise ValueInvalid("the dimensions of las stay as they are; -f npy or csv writes others")
        packed = self.header.are_points_compressed if style.format not in ("las", LAZ) else style.format == LAZ
        return LasWriter(deepcopy(self.header), columns, packed=packed, name=self.file.name)


MOST_PACKED = 1 << 16  # points per compressed byte: far more than any encoder reaches


class LasWriter:
    """Writes points to a temporary file, because the header needs random access, and yields its bytes at the end."""

    def __init__(self, header: Any, columns: Sequence[OutColumn], *, packed: bool, name: str = "las") -> None:
        """Store a header; its offsets are chosen when the first points are written."""
        self.header, self.columns, self.packed, self.name = header, columns, packed, name
        self.kept = column_file.temporary_file(self)
        self.writer: Any = None
        self.count = 0
        self.left_out = 0  # number of points without coordinates

    def of_rows(self, batch: Any, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Write the points of a batch that have coordinates; the bytes are returned by `end`."""
        columns = [each for each in self.columns if each.passed is None]
        new = {column.name: np.asarray(each.values) for column, each in zip(columns, made, strict=True)}
        new |= {name: new[name].astype(np.float64) for name in XYZ if name in new}
        moved = [np.isfinite(new[name]) for name in XYZ if name in new]  # empty if all are unchanged
        there = np.all(moved or [np.ones(batch.size if rows is None else len(rows), np.bool_)], axis=0)
        if not there.all():
            self.left_out += int(np.count_nonzero(~there))
            new = {name: values[there] for name, values in new.items()}
            rows = np.flatnonzero(there) if rows is None else rows[there]
        if not there.any():
            return b""
        self._begin(new)
        with column_file.translated(self.name, REFUSED):
            self.writer.write_points(self._points(batch, rows, new))
        self.count += len(there)
        return b""

    def _begin(self, new: dict[str, Any]) -> None:
        """Choose the offsets near the first points, and write the header."""
        if self.writer is not None:
            return
        if set(XYZ) <= new.keys():
            self.header.offsets = np.rint([np.median(new[name]) for name in XYZ])
        with column_file.translated(self.name, REFUSED):
            writer = _laspy(self.name, packed=self.packed).LasWriter
            self.writer = writer(self.kept, self.header, do_compress=self.packed, closefd=False)

    def _points(self, batch: LasBatch | None, rows: Ints | None, new: dict[str, Any]) -> Any:
        """Return points as a record of laspy; raises FormatError for numbers that do not fit."""
        kind = _laspy(self.name).ScaleAwarePointRecord
        if batch is None:
            points = kind.zeros(len(new["x"]), header=self.header)
        else:
            array = batch.points.array.copy() if rows is None else batch.points.array[rows]
            points = kind(array, batch.points.point_format, self.header.scales, self.header.offsets)
        for name, values in new.items():
            if name not in XYZ:
                points[name] = values
                stored = np.asarray(points[name])
                same = stored == values
                if stored.dtype.kind in WHOLE and not same.all():
                    value = values[int(np.argmin(same))]
                    raise FormatError(f"{name} {value:g}: las holds small whole numbers there", source=self.name)
                continue
            axis = XYZ.index(name)
            scale, offset = float(self.header.scales[axis]), float(self.header.offsets[axis])
            with np.errstate(all="ignore"):
                stored = np.rint((values - offset) / scale)
            bad = ~((stored >= LIMITS.min) & (stored <= LIMITS.max))
            if bad.any():
                row = int(np.argmax(bad))
                found = f"point {self.count + row + 1}: {name} = {values[row]:g}"
                problem = f"{found} does not fit 32 bits of {scale:g} m around {offset:g}"
                raise FormatError(f"{problem}; give the file a coarser scale, or write -f npy", source=self.name)
            points.array[name.upper()] = stored.astype(np.int32)
        return points

    def end(self) -> Iterator[bytes]:
        """Yield the bytes of the file."""
        self._begin({})
        with column_file.translated(self.name, REFUSED):
            if evlrs := getattr(self.header, "evlrs", None):
                self.writer.write_evlrs(evlrs)
            self.writer.close()
        scales = ", ".join(f"{scale:g}" for scale in dict.fromkeys(map(float, self.header.scales)))
        warn(f"{self.name}: x y z are rounded to the scale of las, {scales} m")
        if self.left_out:
            rows = "1 point" if self.left_out == 1 else f"{self.left_out} points"
            warn(f"{self.name}: {rows} without numbers left out: las has no place for them")
        self.kept.seek(0)
        yield from column_file.pieces(self.kept)


def misfit(column: OutColumn) -> str:
    """Return the reason why LAS cannot hold a column, "" if it can."""
    if column.name in STORED or len(column.name.encode()) > LONGEST_NAME:
        return f"its names have at most {LONGEST_NAME} bytes, and {', '.join(STORED)} have a meaning"
    kind = None if column.kind is None else column.kind.str[1:]
    return "" if kind in EXTRA or column.name in XYZ else f"it has no type for {column.kind}"


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> LasWriter:
    """Return a writer for new points: LAS 1.4, with extra bytes for columns that are not dimensions of it."""
    laspy = _laspy(style.format)
    names = {column.name for column in columns}
    if not names >= set(XYZ):
        raise ValueInvalid("las holds points; there are no x, y, z")
    header = laspy.LasHeader(version="1.4", point_format=7 if names >= COLOURS else 6)
    header.scales = np.full(3, NEW_SCALE)
    known = set(header.point_format.dimension_names)
    for column in columns:
        if column.kind is not None and column.name not in known and column.name not in XYZ:
            with column_file.translated(style.format, REFUSED):
                header.add_extra_dim(laspy.ExtraBytesParams(name=column.name, type=column.kind.newbyteorder("<")))
    return LasWriter(header, columns, packed=style.format == LAZ)


open_columns = LasFile
