"""Clouds of KITTI and nuScenes: consecutive points, four or five float32 (little-endian) each, no header.

    x y z intensity            KITTI, velodyne/000000.bin
    x y z intensity ring       nuScenes, LIDAR_TOP/*.pcd.bin

Metres, in the frame of the lidar.  The file does not state which of the two it is: `--in` does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frametool.errors import FormatError, ValueInvalid, listing, warn
from frametool.formats.rows.column_file import RecordFile, bytes_left, record_of, seekable
from frametool.formats.table import FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import Batch, Made, OutColumn
    from frametool.grammar.result import Style
    from frametool.text.spans import Ints

SINGLE = np.dtype("<f4")
RING = "ring"


class BinCloud(RecordFile):
    """The points of a file without a header."""

    def __init__(self, file: InputFile) -> None:
        """Count the points; raises FormatError if the last one is incomplete."""
        names = FORMATS[file.format].columns
        record = record_of([SINGLE] * len(names))
        file.stream = seekable(file, self)
        size = bytes_left(file.stream) or 0
        if size % record.itemsize:
            others = [name for name, row in FORMATS.items() if row.reader == __name__ and name != file.format]
            fits = [name for name in others if size % (SINGLE.itemsize * len(FORMATS[name].columns)) == 0]
            hint = f"; --in {fits[0]} fits" if fits else "; is it whole?"
            points = f"points of {record.itemsize} bytes (float32 {' '.join(names)})"
            raise FormatError(f"{size} bytes are no whole number of {points}{hint}", source=file.name)
        super().__init__(file, names, record, size // record.itemsize)

    def batches(self) -> Iterator[Batch]:
        """Yield the points; raises FormatError for invalid rings."""
        done = 0
        for batch in super().batches():
            rings = batch.column(self.width - 1) if RING in FORMATS[self.file.format].columns else np.zeros(0)
            bad = np.flatnonzero((rings != np.rint(rings)) | (rings < 0))
            if len(bad):
                found = f"ring: {rings[bad[0]]:g} is not a ring number; is it --in kitti-bin?"
                raise FormatError(found, source=self.file.name, line=done + int(bad[0]) + 1)
            done += batch.size
            yield batch

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> PointsWriter:
        """Return a writer for a cloud of either format."""
        del drops
        return PointsWriter(columns, style.format)


class PointsWriter:
    """Writes points without a header; `off` is the largest rounding error of float32."""

    def __init__(self, columns: Sequence[OutColumn], fmt: str) -> None:
        """Find the columns; raises ValueInvalid if one is missing, and warns about those that are omitted."""
        self.columns, self.format = columns, fmt
        self.names = FORMATS[fmt].columns
        self.off = 0.0
        at_input = [column.name for column in columns if column.kind is not None]
        if missing := [name for name in self.names if name not in at_input]:
            raise ValueInvalid(f"{fmt} holds {' '.join(self.names)}; there is no {listing(missing)}")
        if others := [column.name for column in columns if column.name not in self.names]:
            warn(f"{fmt}: {listing(others)} left out: it holds {' '.join(self.names)} alone")

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Return the bytes of some points."""
        new, found = iter(made), {}
        for column in self.columns:
            if column.passed is None or batch is None:
                found[column.name] = next(new).values
            else:
                passed = batch.column(column.passed)
                found[column.name] = passed if rows is None else passed[rows]
        points = np.empty((len(found[self.names[0]]), len(self.names)), SINGLE)
        for at, name in enumerate(self.names):
            with np.errstate(over="ignore", invalid="ignore"):
                points[:, at] = found[name]
                far = abs(points[:, at] - found[name])
            if np.isinf(far).any():
                raise ValueInvalid(f"column {name}: {found[name][np.isinf(far)][0]:g} is too large for float32")
            self.off = max(self.off, float(np.nanmax(far, initial=0.0)))
        return points.tobytes()

    def end(self) -> Iterator[bytes]:
        """Warn about rounding."""
        if self.off:
            warn(f"{self.format}: numbers are float32; they were rounded by up to {self.off:.1g}")
        return iter(())


def create(columns: Sequence[OutColumn], _count: int | None, style: Style) -> PointsWriter:
    """Return a writer for new points."""
    return PointsWriter(columns, style.format)


open_columns = BinCloud
