"""NPZ, several arrays of numpy in one zip file: the one that holds points or poses moves, the others pass as they are.

Which one is said by `--array NAME` where several fit: n x 3, n x 7, or records with the fields x, y, z.
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
from frametool.formats.rows.structured import PIECE, bytes_left, kept_in_file

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.formats.rows.column_file import Batch, ColumnWriter, Kind, Made, OutColumn
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style
    from frametool.text.spans import Ints

SUFFIX = ".npy"
WIDTHS = (3, 7)
XYZ = {"x", "y", "z"}
NAME = "points"  # of the array in a new file
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


class NpzFile:
    """The array of a zip file whose rows are read one batch after the other."""

    vectors: tuple[tuple[str, ...], ...] = ()
    gaps = True

    def __init__(self, file: InputFile, wanted: str) -> None:
        """Find the array; raises FormatError, Unanswered where several fit, BadAnswer for one that is not there."""
        self.file = file
        is_file = bytes_left(file.stream) is not None
        with _whole(file.name):
            self.zip = ZipFile(file.stream if is_file else kept_in_file(file.stream, self))
            self.members = self.zip.infolist()
            self.member = self._chosen(wanted)
            self.array = self._opened(self.member)
        self.names = self.array.names
        self.width = self.array.width

    def _chosen(self, wanted: str) -> ZipInfo:
        """Return the array that was named, or the only one that fits."""
        arrays = {member.filename.removesuffix(SUFFIX): member for member in self.members if _is_array(member)}
        if wanted and wanted not in arrays:
            message = f"--array {shown(wanted)}: there is none{alternatives(wanted, arrays, 'arrays')}"
            raise BadAnswer(message, source=self.file.name)
        if wanted:
            return arrays[wanted]
        fitting = [name for name, member in arrays.items() if self._fits(member)]
        if len(fitting) > 1:
            raise Unanswered(f"several arrays fit; give --array {'|'.join(fitting)}", source=self.file.name)
        if not fitting:
            raise FormatError(
                f"no array is n x 3, n x 7 or has fields x, y, z; give --array NAME; arrays: {listing(arrays)}",
                source=self.file.name,
            )
        return arrays[fitting[0]]

    def _fits(self, member: ZipInfo) -> bool:
        """Tell whether an array looks like points or poses."""
        try:
            array = self._opened(member)
        except FormatError:
            return False
        return bool(array.names and set(array.names) >= XYZ) or (len(array.shape) == 2 and array.width in WIDTHS)

    def _opened(self, member: ZipInfo) -> npy.NpyFile:
        stream: Any = self.zip.open(member)
        name = f"{self.file.name}/{member.filename.removesuffix(SUFFIX)}"
        return npy.NpyFile(InputFile(name, stream))

    def kind(self, place: int) -> Kind | None:
        """Return the type of a column's numbers."""
        return self.array.kind(place)

    def batches(self) -> Iterator[Batch]:
        """Yield the rows of the array; raises FormatError where it ends too early."""
        with _whole(self.file.name):
            yield from self.array.batches()

    def rewriter(self, columns: Sequence[OutColumn], style: Style, *, drops: bool) -> ColumnWriter:
        """Return what writes a file with the same arrays."""
        inner = self.array.rewriter(columns, style, drops=drops)
        at = self.members.index(self.member)
        return NpzWriter(inner, self.member, self, before=self.members[:at], behind=self.members[at + 1 :])


class NpzWriter:
    """Write an array into a zip file, between others that pass."""

    def __init__(
        self, inner: ColumnWriter, member: ZipInfo, given: NpzFile | None = None, *,
        before: Sequence[ZipInfo] = (), behind: Sequence[ZipInfo] = (),
    ) -> None:  # fmt: skip
        """Take what writes the array, and the file with the others."""
        self.inner = inner
        self.given = given
        self.before = before
        self.behind = behind
        self.out = _Taken()
        self.zip = ZipFile(self.out, "w")  # type: ignore[call-overload]
        self.member = _like(member)
        self.stream: Any = None

    def of_rows(self, batch: Batch | None, rows: Ints | None, made: Sequence[Made]) -> bytes:
        """Return what is written of a batch."""
        self._begin()
        self.stream.write(self.inner.of_rows(batch, rows, made))
        return self.out.taken()

    def _begin(self) -> None:
        """Copy what stands before the array, and open it."""
        if self.stream is None:
            self._copy(self.before)
            self.stream = self.zip.open(self.member, "w", force_zip64=True)

    def _copy(self, members: Sequence[ZipInfo]) -> None:
        given = self.given
        if given is None:
            return
        for member in members:
            with (
                _whole(given.file.name),
                given.zip.open(member) as source,
                self.zip.open(_like(member), "w", force_zip64=True) as target,
            ):
                copyfileobj(source, target, PIECE)

    def end(self) -> Iterator[bytes]:
        """Yield what comes behind the last batch."""
        self._begin()
        ended = self.inner.end()
        for piece in (ended,) if isinstance(ended, bytes) else ended:
            self.stream.write(piece)
            yield self.out.taken()
        self.stream.close()
        for member in self.behind:
            self._copy([member])
            yield self.out.taken()
        self.zip.close()
        yield self.out.taken()


class _Taken:
    """A stream that is only written: what was written is taken away piece by piece."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.pieces: list[bytes] = []

    def write(self, data: bytes) -> int:
        """Take some bytes."""
        self.pieces.append(bytes(data))
        return len(data)

    def flush(self) -> None:
        """Do nothing: what is written is there."""

    def taken(self) -> bytes:
        """Return all that was written since the last time."""
        data = b"".join(self.pieces)
        self.pieces.clear()
        return data


def _is_array(member: ZipInfo) -> bool:
    return member.filename.endswith(SUFFIX)


def _like(member: ZipInfo) -> ZipInfo:
    """Return a member of the same name, time and compression."""
    made = ZipInfo(member.filename, member.date_time)
    made.compress_type = member.compress_type
    made.external_attr = member.external_attr
    return made


def open_columns(file: InputFile, options: Options) -> NpzFile:
    """Open an array of a zip file; raises FormatError."""
    return NpzFile(file, options.answers.array)


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> NpzWriter:
    """Return what writes rows made elsewhere, as one array."""
    return NpzWriter(npy.create(columns, count, style), ZipInfo(NAME + SUFFIX, _EARLIEST))
