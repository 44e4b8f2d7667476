"""Cells of a table of text as columns of Arrow: whole numbers, numbers, or the text itself, so that nothing is lost.

A column is of a type only if each cell is written as a number of that type is: 007 and +5 stay text. Empty is null.
"""

from __future__ import annotations

from typing import Any

from frametool.errors import ValueInvalid, shown
from frametool.formats.arrow_columns import in_one, require_pyarrow

WHOLE = r"^-?(0|[1-9][0-9]{0,18})$"
NUMBER = r"^-?(0|[1-9][0-9]{0,14})(\.[0-9]+)?([eE][-+]?[0-9]+)?$"  # longer whole numbers would lose digits
PATTERNS = {"int64": WHOLE, "double": NUMBER}


def type_of(texts: Any) -> Any:
    """Return the type of a column's cells; of none at all, string."""
    pa = require_pyarrow("Arrow")
    fits = (name for name in PATTERNS if texts.null_count < len(texts) and _misfit(texts, name) is None)
    return pa.type_for_alias(next(fits, "string"))


def typed(texts: Any, kind: Any, name: str) -> Any:
    """Return cells in a type; raises ValueInvalid for one that is not written so."""
    if str(kind) not in PATTERNS:
        return texts
    if (text := _misfit(texts, str(kind))) is not None:
        found = f"column {shown(name)}: {shown(text)} is no {kind}, as all cells of the first million rows are"
        raise ValueInvalid(f"{found}; -f csv keeps it as it is")
    return texts.cast(kind)


def _misfit(texts: Any, kind: str) -> str | None:
    """Return the first cell that is not written as a number of a type is; None if all are."""
    pa, compute = require_pyarrow("Arrow"), require_pyarrow("Arrow", "compute")
    wrong = texts.filter(compute.invert(compute.match_substring_regex(texts, PATTERNS[kind])))
    if len(wrong):
        return str(in_one(wrong)[0].as_py())
    try:
        texts.cast(kind)
    except pa.ArrowInvalid:  # beyond 64 bits
        return max((text or "" for text in in_one(texts).to_pylist()), key=len)
    return None
