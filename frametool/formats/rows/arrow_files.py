"""Parquet and Arrow IPC (Feather), by pyarrow, the extra `frametool[arrow]`: one way in, one way out, any to any.

Parquet is known by PAR1, a file of Arrow by ARROW1, a stream of Arrow by its first message.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, shown
from frametool.formats.rows.arrow import require_pyarrow

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.documents.source import InputFile
    from frametool.formats.rows.column_file import ColumnFile, ColumnWriter, OutColumn
    from frametool.grammar.edges import Options
    from frametool.grammar.result import Style

HOLDS_TEXTS = True
BEGINNINGS = {b"PAR1": "parquet", b"ARROW1": "arrow", b"\xff\xff\xff\xff": "arrows"}
MODULES = {
    "parquet": "frametool.formats.rows.parquet",
    "arrow": "frametool.formats.rows.arrow_ipc",
    "arrows": "frametool.formats.rows.arrow_ipc",
}  # form -> what reads and writes it


def open_columns(file: InputFile, options: Options) -> ColumnFile:
    """Open a file of any of these forms; raises FileProblem without pyarrow, FormatError for a broken file."""
    del options
    require_pyarrow(file.name)
    head = file.head()
    form = next((form for begin, form in BEGINNINGS.items() if head.startswith(begin)), "")
    if not form:
        found = f"it begins with {shown(head[:8])}" if head else "it is empty"
        raise FormatError(f"neither Parquet (PAR1) nor Arrow (ARROW1): {found}", source=file.name)
    opened: ColumnFile = import_module(MODULES[form]).open_columns(file)
    return opened


def create(columns: Sequence[OutColumn], count: int | None, style: Style) -> ColumnWriter:
    """Return what writes rows made elsewhere."""
    del count
    return writer_of(style.form, style.form, columns, None, {})


def writer_of(
    told: str, own: str, columns: Sequence[OutColumn], given: Any | None, how: dict[str, Any]
) -> ColumnWriter:
    """Return what writes rows in the form that is told, if it is one of these, else in the input's own.

    given: the schema of the input, if it has one; how: how the input was compressed, for the same form only
    """
    form = told if told in MODULES else own
    same = MODULES[form] == MODULES[own]
    made: ColumnWriter = import_module(MODULES[form]).WRITER(form, columns, given, how if same else {})
    return made
