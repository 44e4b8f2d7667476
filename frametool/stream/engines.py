"""Rows of Arrow tables moved into another frame: the function that engines call for each of their batches.

A transform written out for engines that compute by themselves: as SQL, and as expressions of Polars.

Both multiply and add in the order in which `Transform.apply` does, so that the same doubles come out of engines that
contract no products; the tests hold DuckDB and Polars to it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FileProblem, ValueInvalid, shown
from frametool.formats.rows.arrow import (
    ArrowFloats,
    column_of,
    floats_of,
    in_one,
    is_floating,
    nulls_of,
    place_of,
    require_pyarrow,
    rounded,
    stamps_of,
)
from frametool.geometry import arrays, quaternion, rigid
from frametool.geometry.transform import Transform
from frametool.stream.row_layout import POINT, POSE, VECTOR
from frametool.stream.stamp_columns import NOWHERE
from frametool.text.parse import nanoseconds_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components
    from frametool.text.spans import Flags, Ints

COLUMNS = {
    POINT: ("x", "y", "z"),
    VECTOR: ("x", "y", "z"),
    POSE: ("x", "y", "z", "qx", "qy", "qz", "qw"),
}  # as_ -> the columns where none are named


def apply_arrow(
    data: Any,
    transform: Transform | None = None,
    columns: Sequence[str] | None = None,
    as_: str = POINT,
    *,
    tree: Frames | None = None,
    target: str = "",
    source: str = "",
    time_column: str | None = None,
) -> Any:
    """Move the points of a pyarrow RecordBatch or Table; return the same type, all other columns as they are.

    transform: one, or one a row; or `tree`, `target`, `source`: looked up at the latest time, with `time_column` at
    each row's (timestamps, integer nanoseconds, float seconds).
    as_: "point" or "vector", columns x, y, z unless named, or "pose", columns x, y, z, qx, qy, qz, qw.
    A row with a null among its columns is null in all.  float32 is computed in float64 and rounded once.
    Raises ValueInvalid for columns that are no floating point and for the first row, from 0, that is not finite.
    """
    pa = require_pyarrow("apply_arrow")
    if not isinstance(data, (pa.RecordBatch, pa.Table)):
        kind = f"{type(data).__module__}.{type(data).__name__}"
        raise ValueInvalid(f"expected a pyarrow RecordBatch or Table, got {kind}")
    names = _named(columns, as_)
    places = [place_of(name, data.schema.names) for name in names]
    given = [floats_of(data.column(place), name) for place, name in zip(places, names, strict=True)]
    nulls = _either(each.nulls for each in given)
    if tree is None:
        mover = _one_or_each(transform, data.num_rows, tree=bool(target or source or time_column))
    elif transform is None and target and source:
        mover = _looked_up(tree, target, source, data, time_column, nulls)
    else:
        raise ValueInvalid("give a transform, or tree, target and source")
    moved = _moved(mover.components, given, as_, nulls)
    fields = [data.schema.field(place) for place in places]
    made = [rounded(numbers, field.type) for numbers, field in zip(moved, fields, strict=True)]
    _check(given, made, fields, nulls)
    new = list(data.columns)
    for place, numbers, field in zip(places, made, fields, strict=True):
        new[place] = column_of(numbers, nulls, field.type)
    return type(data).from_arrays(new, schema=data.schema)


def _named(columns: Sequence[str] | None, as_: str) -> tuple[str, ...]:
    """Return the columns of points or poses; raises ValueInvalid."""
    if as_ not in COLUMNS:
        raise ValueInvalid(f"as_ is one of {', '.join(COLUMNS)}; found {shown(as_)}")
    usual = COLUMNS[as_]
    named = usual if columns is None else tuple(columns)
    if len(named) != len(usual) or len(set(named)) != len(named):
        raise ValueInvalid(f"columns: a {as_} has {len(usual)}, like {', '.join(usual)}; found {', '.join(named)}")
    return named


def _one_or_each(transform: Any, rows: int, *, tree: bool) -> Transform:
    """Check that a transform moves all rows or that there is one a row."""
    if tree or not isinstance(transform, Transform):
        found = "no tree" if tree else type(transform).__name__
        raise ValueInvalid(f"expected a Transform, or tree, target and source; got {found}")
    if transform.shape not in ((), (rows,)):
        raise ValueInvalid(f"transforms of shape {transform.shape} for {rows} rows; expected one, or one a row")
    return transform


def _looked_up(
    tree: Frames, target: str, source: str, data: Any, time_column: str | None, nulls: Flags | None
) -> Transform:
    """Look the frames up, at the latest time or at that of each row; those of null rows are not looked at."""
    if time_column is None:
        return tree.lookup(target, source)
    stamps, missing = _stamps(data.column(place_of(time_column, data.schema.names)), time_column)
    needed = np.ones(len(stamps), np.bool_) if nulls is None else ~nulls
    if missing is not None and (missing & needed).any():
        row = int(np.argmax(missing & needed))
        raise ValueInvalid(f"{time_column}[{row}] is null: no time; leave the row out, or make it null in whole")
    if nulls is None:
        return tree.lookup_many(target, source, stamps)
    poses = np.zeros((7, len(stamps)))
    poses[6] = 1.0
    poses[:, needed] = tree.lookup_many(target, source, stamps[needed]).components
    return Transform.of(*poses)


def _stamps(column: Any, name: str) -> tuple[Ints, Flags | None]:
    """Read a column of times as nanoseconds, and which are null."""
    if not is_floating(column.type):
        return stamps_of(column, name)
    whole = in_one(column)
    missing = nulls_of(whole)
    seconds = whole.to_numpy(zero_copy_only=False).astype(np.float64)
    stamps, none = nanoseconds_of(seconds)
    if missing is not None:
        none &= ~missing
    if none.any():
        row = int(np.argmax(none))
        raise ValueInvalid(f"{name}[{row}]: {seconds[row]} is no time in seconds; integers are nanoseconds")
    return stamps, missing


def _moved(mover: Components, given: Sequence[ArrowFloats], as_: str, nulls: Flags | None) -> Components:
    """Return the moved numbers, one array a column; what null rows hold has no meaning."""
    numbers = tuple(each.values for each in given)
    if as_ == POINT:
        return arrays.run(rigid.apply, 3, (*mover, *numbers))
    if as_ == VECTOR:
        return arrays.run(quaternion.rotate, 3, (*mover[3:], *numbers))
    rows = np.stack(numbers, axis=-1, dtype=np.float64)
    if nulls is not None:
        rows[nulls] = NOWHERE
    poses = Transform.of(*mover) @ Transform.from_arrays(rows[:, :3], rows[:, 3:])
    return (*poses.components[:3], *poses.xyzw.T)


def _check(given: Sequence[ArrowFloats], made: Sequence[Any], fields: Sequence[Any], nulls: Flags | None) -> None:
    """Raise ValueInvalid for the first row that is not finite, or null where a column may hold no null."""
    kept = np.True_ if nulls is None else ~nulls
    for values, field in zip(made, fields, strict=True):
        if nulls is not None and not field.nullable:
            row = int(np.argmax(nulls))
            raise ValueInvalid(f"{field.name}[{row}] becomes null, and the schema allows none there; make it nullable")
        if not (finite := np.isfinite(values) | ~kept).all():
            _refuse(int(np.argmin(finite)), given, fields)
            raise ValueInvalid(f"{field.name}[{int(np.argmin(finite))}]: the result is too large for {field.type}")


def _refuse(row: int, given: Sequence[ArrowFloats], fields: Sequence[Any]) -> None:
    """Raise ValueInvalid for the first number of a row that is not finite, if there is one."""
    for (values, _), field in zip(given, fields, strict=True):
        if not np.isfinite(values[row]):
            remedy = "make it null, or leave the row out"
            raise ValueInvalid(f"{field.name}[{row}]: {values[row]} is not finite; {remedy}")


def _either(masks: Any) -> Flags | None:
    """Return where any of some masks is set."""
    found = [mask for mask in masks if mask is not None]
    return np.logical_or.reduce(found) if found else None


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
