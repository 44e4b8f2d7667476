"""Files of columns of numbers, read without any text: what a form has to offer, and what writes its rows.

The module of a form that is read as `arrays` has `open_columns(file, options) -> ColumnFile`; of one that is written
so, `create(columns, count, style) -> ColumnWriter`.  Rows are counted from 1, batches follow one another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.geometry.types import Rigid
    from frametool.grammar.result import Style
    from frametool.text.spans import Flags, Floats, Ints

    Kind: TypeAlias = np.dtype[Any]

FLOATS, WHOLE = "f", "iu"  # kinds of numpy's types
STAMP_NS = np.dtype(np.int64)


class ColumnNumbers(NamedTuple):
    """Numbers of a column: (n,) in float64, and which of them are nulls (None: there are none)."""

    values: Floats
    nulls: Flags | None = None


class OutColumn(NamedTuple):
    """A column of the output.

    name: "" where columns have no names
    kind: the type of its numbers; None for texts
    passed: the place of the column of the input that passes as it is; None for what is made
    """

    name: str
    kind: Kind | None
    passed: int | None = None


class Made(NamedTuple):
    """What stands in a column that is made: (n,) of its kind, or texts; and the rows that have none (None: all have).

    Numbers of rows that have none are nan.
    """

    values: Any
    absent: Flags | None = None


class Batch(Protocol):
    """Some rows of a file; places are those of its columns."""

    @property
    def size(self) -> int:
        """Count the rows."""

    @property
    def bytes_read(self) -> int:
        """Count the bytes of the file that they take."""

    def numbers(self, place: int) -> ColumnNumbers:
        """Return a column as floats; a null may be any number."""

    def stamps(self, place: int, *, in_ns: bool) -> tuple[Ints, dict[int, str]]:
        """Return a column as nanoseconds, and why rows have none; numbers are seconds unless their name says ns."""

    def texts(self, place: int) -> Sequence[str]:
        """Return a column as texts, "" for none."""

    def column(self, place: int) -> Any:
        """Return a column as it is: an array whose kind the file tells, or texts."""


class ColumnWriter(Protocol):
    """Write the rows of one batch after the other."""

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes | memoryview:
        """Return what is written of a batch: of these of its rows (None: all), with what is made for each of them.

        batch: None where no column passes.
        """

    def end(self) -> bytes | Iterator[bytes]:
        """Return what comes behind the last batch."""


class ColumnFile(Protocol):
    """A file that was opened: its columns are known, its rows are not read yet.

    names: of the columns; None where they have none; width: how many there are
    vectors: columns of vectors that turn when points move, as normals do
    gaps: numbers that are not finite stand for none: a point without return; else their rows are bad
    """

    names: tuple[str, ...] | None
    width: int
    vectors: tuple[tuple[str, ...], ...]
    gaps: bool

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers; None for texts and for what else is no number."""

    def batches(self) -> Iterator[Batch]:
        """Yield the rows; raises FormatError where the file ends too early."""

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a file of the same form, with what the columns do not hold as it was.

        drops: rows may be left out, so that their number is not known before the end.
        """


@runtime_checkable
class MovesAlong(Protocol):
    """A file in which more than its points has a place among them: the pose of the sensor, rotations of splats."""

    def moved_by(self, pose: Rigid | None) -> None:
        """Move that by the pose that moves all points, before any is read; None: there is no such one."""
