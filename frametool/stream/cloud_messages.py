"""Clouds of messages as files of columns: each moved by one pose, and written as a file of its own."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.formats import FORMATS
from frametool.formats.declared import rows_of_batch
from frametool.formats.pcd import NORMALS, PcdWriter, viewpoint_words
from frametool.formats.structured import StructuredBatch, is_number
from frametool.stream.column_stream import run_columns
from frametool.stream.operation import Operation
from frametool.stream.request import Request

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.column_file import ColumnWriter, Kind, OutColumn
    from frametool.geometry.types import Rigid
    from frametool.grammar.result import Style
    from frametool.ros.point_clouds import PointCloud
    from frametool.stream.run import Outcome


class MessageColumns:
    """The points of a message as a file of columns."""

    vectors = NORMALS
    gaps = True

    def __init__(self, cloud: PointCloud) -> None:
        """Take the cloud."""
        self.cloud = cloud
        self.names: tuple[str, ...] | None = cloud.names
        self.width = len(cloud.names)

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers."""
        kind = self.cloud.rows.dtype[place]
        return kind if is_number(kind) else None

    def batches(self) -> Iterator[StructuredBatch]:
        """Yield the points."""
        rows, fields = self.cloud.rows, self.cloud.rows.dtype.names or ()
        step = rows_of_batch(rows.dtype.itemsize)
        for first in range(0, len(rows), step):
            yield StructuredBatch(rows[first : first + step], fields)

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Refuse: messages are written in other forms."""
        raise NotImplementedError


class _GridOfForm:
    """A form in which the grid of a cloud is kept, and the pose of its sensor, where it has room for them."""

    def __init__(self, form: str, cloud: PointCloud, pose: Rigid) -> None:
        """Take the cloud and the pose that moves it."""
        self.module: Any = import_module(FORMATS[form].writer)
        self.cloud = cloud
        self.pose = pose
        self.HOLDS_TEXTS = getattr(self.module, "HOLDS_TEXTS", False)

    def create(self, columns: Sequence[OutColumn], count: int | None, style: Style) -> ColumnWriter:
        """Return what writes the points."""
        del count
        writer: ColumnWriter = self.module.create(columns, len(self.cloud.rows), style)
        if isinstance(writer, PcdWriter):
            writer.words |= {"WIDTH": str(self.cloud.width), "HEIGHT": str(self.cloud.height)}
            writer.words["VIEWPOINT"] = viewpoint_words(self.pose)
        return writer


def moved_cloud(cloud: PointCloud, pose: Rigid, style: Style, source: str) -> Iterator[Outcome]:
    """Yield what a cloud becomes when a pose moves it, in the form of a style."""
    request = Request(Operation(left=pose, moves=True))
    into = _GridOfForm(style.form, cloud, pose)
    yield from run_columns(MessageColumns(cloud), request, style, source=source, into=into)
