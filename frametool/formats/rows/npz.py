"""NPZ, several arrays of numpy in one zip file: the one that holds points or poses moves, the others pass as they are.

Where several fit, n x 3, n x 7 or records with the fields x, y, z, `--array NAME` says which.
"""

from __future__ import annotations

import zlib
from contextlib import contextmanager
from shutil import copyfileobj
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile, ZipInfo

from frametool.documents.source import InputFile
from frametool.errors import BadAnswer, FormatError, Unanswered, alternatives, listing, shown
from frametool.formats.rows import npy
from frametool.formats.rows.column_file import PIECE, XYZ, Collected, seekable

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.rows.column_file import Batch, ColumnWriter, Made, OutColumn
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style
    from frametool.text.spans import Ints

SUFFIX = ".npy"
WIDTHS = (3, 7)
NEW_NAME = "points"  # of the array in a new file
_EARLIEST = (1980, 1, 1, 0, 0, 0)


@contextmanager
def _whole(name: str) -> Iterator[None]:
    """Turn what the library says of a broken file into one error."""
    try:
        yield
    except FormatError:
        raise
    except (BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError, ValueError) as error:
        said = " ".join(str(error).split())[:100]
        raise FormatError(f"the zip file cannot be read; is it whole? ({said})", source=name) from None


class NpzFile(npy.NpyFile):
    """The array of a zip file whose rows are read one batch after the other."""

    def __init__(self, file: InputFile, wanted: str) -> None:
        """Find the array; raises FormatError, Unanswered where several fit, BadAnswer for one that is not there."""
        self.name = file.name
        with _whole(self.name):
            self.zip = ZipFile(seekable(file, self))
            self.members = self.zip.infolist()
            self.member = self._chosen(wanted)
            super().__init__(self._opened(self.member))

    def _chosen(self, wanted: str) -> ZipInfo:
        """Return the array that was named, or the only one that fits."""
        arrays = {each.filename.removesuffix(SUFFIX): each for each in self.members if each.filename.endswith(SUFFIX)}
        if len({each.filename for each in self.members}) < len(self.members):
            raise FormatError("two arrays of one name; which is meant is not known", source=self.name)
        if wanted and wanted not in arrays:
            message = f"--array {shown(wanted)}: there is none{alternatives(wanted, arrays, 'arrays')}"
            raise BadAnswer(message, source=self.name)
        fitting = [wanted] if wanted else [name for name, member in arrays.items() if self._fits(member)]
        if not fitting and len(arrays) == 1 and npy.NpyFile(self._opened(*arrays.values())).names:
            fitting = [*arrays]  # fields alone: a matrix, or a rotation without a position
        if len(fitting) > 1:
            raise Unanswered(f"several arrays fit; give --array {'|'.join(fitting)}", source=self.name)
        if not fitting:
            message = "no array is n x 3, n x 7 or has fields x, y, z; give --array NAME"
            raise FormatError(f"{message}; arrays: {listing(arrays)}", source=self.name)
        return arrays[fitting[0]]

    def _fits(self, member: ZipInfo) -> bool:
        """Tell whether an array looks like points or poses."""
        try:
            array = npy.NpyFile(self._opened(member))
        except FormatError:
            return False
        return set(XYZ) <= set(array.names or ()) or (len(array.shape) == 2 and array.width in WIDTHS)

    def _opened(self, member: ZipInfo) -> InputFile:
        stream: Any = self.zip.open(member)
        return InputFile(f"{self.name}/{member.filename.removesuffix(SUFFIX)}", stream)

    def batches(self) -> Iterator[Batch]:
        """Yield the rows of the array; raises FormatError where it ends too early."""
        with _whole(self.name):
            yield from super().batches()

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a file with the same arrays."""
        return NpzWriter(super().rewriter(columns, style, drops=drops), self.member, self)


class NpzWriter:
    """Write an array into a zip file, between others that pass."""

    def __init__(self, inner: ColumnWriter, member: ZipInfo, given: NpzFile | None = None) -> None:
        """Take what writes the array, and the file with the others."""
        self.inner = inner
        self.given = given
        self.member = member
        members = given.members if given else [member]
        at = members.index(member)
        self.before, self.behind = members[:at], members[at + 1 :]
        self.out = Collected()
        self.zip = ZipFile(self.out, "w")
        self.stream: Any = None

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> memoryview:
        """Return what is written of a batch."""
        self._begin()
        self.stream.write(self.inner.of_rows(batch, rows, made))
        return self.out.taken()

    def _opened(self, member: ZipInfo) -> Any:
        """Open what writes a member of the same name, time and compression."""
        made = ZipInfo(member.filename, member.date_time)
        made.compress_type = member.compress_type
        made.external_attr = member.external_attr
        return self.zip.open(made, "w", force_zip64=True)

    def _begin(self) -> None:
        """Copy what stands before the array, and open it."""
        if self.stream is None:
            for member in self.before:
                self._copy(member)
            self.stream = self._opened(self.member)

    def _copy(self, member: ZipInfo) -> None:
        assert self.given is not None  # noqa: S101 - for the types; without it there are no others
        with _whole(self.given.name), self.given.zip.open(member) as source, self._opened(member) as target:
            copyfileobj(source, target, PIECE)

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch."""
        self._begin()
        for piece in self.inner.end():
            self.stream.write(piece)
            yield bytes(self.out.taken())
        self.stream.close()
        for member in self.behind:
            self._copy(member)
            yield bytes(self.out.taken())
        self.zip.close()
        yield bytes(self.out.taken())


def open_columns(file: InputFile, options: Options) -> NpzFile:
    """Open an array of a zip file; raises FormatError."""
    return NpzFile(file, options.answers.array)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> NpzWriter:
    """Return what writes rows made elsewhere, as one array."""
    return NpzWriter(npy.create(columns, count, style), ZipInfo(NEW_NAME + SUFFIX, _EARLIEST))
