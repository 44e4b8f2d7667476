"""A transform written out for engines that compute by themselves: as SQL, and as expressions of Polars.

Both multiply and add in the order in which `Transform.apply` does, so that the same doubles come out of engines that
contract no products; the tests hold DuckDB and Polars to it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.errors import FileProblem, ValueInvalid, shown
from frametool.geometry import rigid
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Sequence

XYZ = ("x", "y", "z")
Row = tuple[float, ...]


def sql(transform: Transform, columns: Sequence[str] = XYZ, *, as_: str = "point", quote: str = '"') -> str:
    """Return the three expressions that move points, `.. AS "x", ..`, for a list of SELECT or `* REPLACE (..)`.

    as_: "point", or "vector", which does not shift.  quote: what names stand in; Spark and MySQL want "`".
    The columns become DOUBLE; a row with NULL among them is NULL in all three.
    """
    expressions = []
    for name, (a, b, c, *shift) in zip(columns, _rows(transform, columns, as_), strict=True):
        x, y, z = (_quoted(each, quote) for each in columns)
        terms = [f"{_double(a)} * {x}", f"{_double(b)} * {y}", f"{_double(c)} * {z}", *map(_double, shift)]
        expressions.append(f"{' + '.join(terms)} AS {_quoted(name, quote)}")
    return ", ".join(expressions)


def polars_exprs(transform: Transform, columns: Sequence[str] = XYZ, *, as_: str = "point") -> list[Any]:
    """Return the three expressions of Polars that move points, for `with_columns` or `select`.

    as_: "point", or "vector", which does not shift.
    The columns become Float64; a row with a null among them is null in all three.
    """
    try:
        pl = import_module("polars")
    except ImportError:
        raise FileProblem("polars_exprs needs polars; install it: pip install polars") from None
    x, y, z = (pl.col(each).cast(pl.Float64) for each in columns)
    made = []
    for name, (a, b, c, *shift) in zip(columns, _rows(transform, columns, as_), strict=True):
        turned: Any = x * a + y * b + z * c
        made.append((turned + shift[0] if shift else turned).alias(name))
    return made


def _rows(transform: Transform, columns: Sequence[str], as_: str) -> list[Row]:
    """Return what x, y and z are multiplied with, and the shift of a point; raises ValueInvalid."""
    if not isinstance(transform, Transform) or transform.shape:
        found = f"{transform!r}" if isinstance(transform, Transform) else type(transform).__name__
        raise ValueInvalid(f"expected one Transform, got {found}")
    if as_ not in ("point", "vector"):
        raise ValueInvalid(f"as_ is point or vector; found {shown(as_)}")
    if len(columns) != len(XYZ) or len(set(columns)) != len(XYZ):
        raise ValueInvalid(f"columns: expected three, like x, y, z; found {', '.join(columns)}")
    entries = [float(entry) for entry in rigid.to_matrix(*transform.components)]
    width = 4 if as_ == "point" else 3
    return [tuple(entries[at : at + width]) for at in (0, 4, 8)]


def _double(number: float) -> str:
    """Write a number so that SQL takes it for a DOUBLE, not a DECIMAL: with an exponent."""
    text = repr(number)
    return text if "e" in text else f"{text}e0"


def _quoted(name: str, quote: str) -> str:
    """Write a name as an identifier; raises ValueInvalid for one that SQL cannot name."""
    if not name or "\0" in name:
        raise ValueInvalid(f"{shown(name)} is no name of a column in SQL")
    return f"{quote}{name.replace(quote, quote + quote)}{quote}"
