"""Points moved inside of engines: a function for their Arrow batches; knows no file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import ValueInvalid, alternatives, shown
from frametool.formats.rows.arrow import in_one, is_floating, kind_of, nulls_of, require_pyarrow, stamps_of
from frametool.geometry import arrays, quaternion, rigid
from frametool.geometry.transform import Transform
from frametool.stream.row_layout import NOWHERE, POINT, POSE, VECTOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components
    from frametool.text.spans import Flags

XYZ = ("x", "y", "z")
COLUMNS = {POINT: XYZ, VECTOR: XYZ, POSE: (*XYZ, "qx", "qy", "qz", "qw")}  # as_ -> the columns where none are named


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
    if as_ not in COLUMNS:
        raise ValueInvalid(f"as_ is one of {', '.join(COLUMNS)}; found {shown(as_)}")
    names = COLUMNS[as_] if columns is None else tuple(columns)
    if len(names) != len(COLUMNS[as_]) or len(set(names)) != len(names):
        usual = f"a {as_} has {len(COLUMNS[as_])}, like {', '.join(COLUMNS[as_])}"
        raise ValueInvalid(f"columns: {usual}; found {', '.join(names)}")
    places = [_place_of(name, data.schema.names) for name in names]
    fields = [data.schema.field(place) for place in places]
    for field in fields:
        if not is_floating(field.type):
            message = f"column {shown(field.name)} is {field.type}, not floating point; cast it to float64 first"
            raise ValueInvalid(message)
    inputs = [in_one(data.column(place)) for place in places]
    masks = [mask for mask in map(nulls_of, inputs) if mask is not None]
    nulls = np.logical_or.reduce(masks) if masks else None
    if tree is None:
        mover, rows, lacks_tree = transform, data.num_rows, target or source or time_column
        if lacks_tree or not isinstance(mover, Transform):
            found = "no tree" if lacks_tree else type(mover).__name__
            raise ValueInvalid(f"expected a Transform, or tree, target and source; got {found}")
        if mover.shape not in ((), (rows,)):
            raise ValueInvalid(f"transforms of shape {mover.shape} for {rows} rows; expected one, or one a row")
    elif transform is None and target and source:
        mover = _looked_up(tree, target, source, data, time_column, nulls)
    else:
        raise ValueInvalid("give a transform, or tree, target and source")
    numbers = [column.to_numpy(zero_copy_only=False) for column in inputs]
    moved = _moved(mover.components, numbers, as_, nulls)
    with np.errstate(over="ignore"):  # what is too large becomes infinite
        made = [np.asarray(each, kind_of(field.type)) for each, field in zip(moved, fields, strict=True)]
    _check(numbers, made, fields, nulls)
    new = list(data.columns)
    for place, each, field in zip(places, made, fields, strict=True):
        new[place] = pa.array(each, type=field.type, mask=nulls)
    return type(data).from_arrays(new, schema=data.schema)


def _place_of(name: str, names: Sequence[str]) -> int:
    """Return the place of a column; raises ValueInvalid for one that is not there, or twice."""
    if name not in names:
        raise ValueInvalid(f"no column {shown(name)}{alternatives(name, names, 'columns')}")
    if names.count(name) > 1:
        raise ValueInvalid(f"column {shown(name)} appears twice")
    return names.index(name)


def _looked_up(
    tree: Frames, target: str, source: str, data: Any, time_column: str | None, nulls: Flags | None
) -> Transform:
    """Look the frames up, at the latest time or at that of each row; those of null rows are not looked at."""
    if time_column is None:
        return tree.lookup(target, source)
    column = data.column(_place_of(time_column, data.schema.names))
    stamps, missing, bad = stamps_of(column, time_column)
    if len(bad):
        seconds = column[int(bad[0])].as_py()
        raise ValueInvalid(f"{time_column}[{bad[0]}]: {seconds} is not a time in seconds; integers are nanoseconds")
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


def _moved(mover: Components, numbers: Sequence[Any], as_: str, nulls: Flags | None) -> Components:
    """Return the moved numbers, one array a column; what null rows hold has no meaning."""
    if as_ == POINT:
        return arrays.run(rigid.apply, 3, (*mover, *numbers))
    if as_ == VECTOR:
        return arrays.run(quaternion.rotate, 3, (*mover[3:], *numbers))
    rows = np.stack(numbers, axis=-1, dtype=np.float64)
    if nulls is not None:
        rows[nulls] = NOWHERE
    poses = Transform.of(*mover) @ Transform.from_arrays(rows[:, :3], rows[:, 3:])
    return (*poses.components[:3], *poses.xyzw.T)


def _check(inputs: Sequence[Any], made: Sequence[Any], fields: Sequence[Any], nulls: Flags | None) -> None:
    """Raise ValueInvalid for the first row that is not finite, or null where a column may hold no null."""
    for values, field in zip(made, fields, strict=True):
        if nulls is not None and not field.nullable:
            row = int(np.argmax(nulls))
            raise ValueInvalid(f"{field.name}[{row}] becomes null, and the schema allows none there; make it nullable")
        finite = np.isfinite(values) if nulls is None else np.isfinite(values) | nulls
        if not finite.all():
            row = int(np.argmin(finite))
            for numbers, each in zip(inputs, fields, strict=True):
                if not np.isfinite(numbers[row]):
                    found = f"{each.name}[{row}]: {numbers[row]} is not finite"
                    raise ValueInvalid(f"{found}; make it null, or leave the row out")
            raise ValueInvalid(f"{field.name}[{row}]: the result is too large for {field.type}")
