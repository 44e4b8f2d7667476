"""Rows of Arrow tables: moved to the bit as `Transform.apply` moves them, everything else as it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import frametool
from frametool.frames.buffer import TransformBuffer

pa = pytest.importorskip("pyarrow")

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROWS = 1000
XYZ = ("x", "y", "z")
POSE = (*XYZ, "qx", "qy", "qz", "qw")
MOVER = frametool.Transform.random(seed=1)


def points(rows: int = ROWS, seed: int = 2) -> NDArray[np.float64]:
    """Draw points of many sizes."""
    generator = np.random.default_rng(seed)
    return np.asarray(generator.normal(size=(rows, 3)) * 10.0 ** generator.integers(-9, 9, size=(rows, 3)))


def table(xyz: Any, kind: Any = None, **more: Any) -> Any:
    """Make a table of points between other columns."""
    xyz = np.asarray(xyz)
    columns = {name: pa.array(xyz[:, at], kind or pa.float64()) for at, name in enumerate(XYZ)}
    names = pa.array([f"p{row}" for row in range(len(xyz))], pa.string())
    tags = pa.array([["a", None]] * len(xyz), pa.list_(pa.string()))
    return pa.table({"id": names, **columns, "tags": tags, **more})


def numbers(data: Any, names: tuple[str, ...] = XYZ) -> NDArray[np.float64]:
    """Return columns as rows of numbers."""
    return np.stack([np.asarray(data.column(name)) for name in names], axis=1)


def test_points_are_moved_to_the_bit_as_transform_apply_moves_them() -> None:
    xyz = points()
    assert numbers(frametool.apply_arrow(table(xyz), MOVER)).tobytes() == MOVER.apply(xyz).tobytes()


def test_vectors_are_only_turned() -> None:
    xyz = points()
    moved = frametool.apply_arrow(table(xyz), MOVER, as_="vector")
    assert numbers(moved).tobytes() == MOVER.apply_vector(xyz).tobytes()


def test_poses_are_composed() -> None:
    poses = frametool.Transform.random(ROWS, seed=3)
    data = pa.table(dict(zip(POSE, np.concatenate([poses.xyz, poses.xyzw], axis=1).T, strict=True)))
    moved, wanted = frametool.apply_arrow(data, MOVER, as_="pose"), MOVER @ poses
    assert numbers(moved, POSE).tobytes() == np.concatenate([wanted.xyz, wanted.xyzw], axis=1).tobytes()


def test_each_row_may_have_its_own_transform() -> None:
    movers, xyz = frametool.Transform.random(ROWS, seed=4), points()
    assert numbers(frametool.apply_arrow(table(xyz), movers)).tobytes() == movers.apply(xyz).tobytes()


def test_the_same_type_comes_back_with_the_same_schema_and_all_other_columns() -> None:
    data = table(points()).replace_schema_metadata({"made by": "a test"})
    for given in (data, data.to_batches()[0]):
        moved = frametool.apply_arrow(given, MOVER)
        assert type(moved) is type(given)
        assert moved.schema.equals(given.schema, check_metadata=True)
        assert moved.select(["id", "tags"]).equals(given.select(["id", "tags"]))


def test_other_columns_are_named() -> None:
    xyz = points()
    data = table(xyz).rename_columns(["id", "px", "py", "pz", "tags"])
    names = ("px", "py", "pz")
    assert numbers(frametool.apply_arrow(data, MOVER, names), names).tobytes() == MOVER.apply(xyz).tobytes()


@pytest.mark.parametrize("kind", ["float", "halffloat"])
def test_narrow_floats_are_computed_in_float64_and_rounded_once(kind: str) -> None:
    narrow: Any = np.float32 if kind == "float" else np.float16
    xyz: Any = np.random.default_rng(5).normal(size=(ROWS, 3)).astype(narrow)
    moved = frametool.apply_arrow(table(xyz, pa.type_for_alias(kind)), MOVER)
    wanted = MOVER.apply(xyz.astype(np.float64)).astype(narrow)
    assert str(moved.schema.field("x").type) == kind
    assert numbers(moved).tobytes() == wanted.tobytes()


def test_a_row_with_a_null_is_null_in_all_its_columns_and_no_other_row_is() -> None:
    rows: list[Any] = [[1.0, 2.0, 3.0], [None, 2.0, 3.0], [1.0, None, 3.0], [1.0, 2.0, None], [4.0, 5.0, 6.0]]
    data = pa.table({name: pa.array([row[at] for row in rows], pa.float64()) for at, name in enumerate(XYZ)})
    moved = frametool.apply_arrow(data, MOVER)
    assert all(moved[name].is_null().to_pylist() == [False, True, True, True, False] for name in XYZ)
    assert numbers(moved.take([0, 4])).tobytes() == MOVER.apply([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).tobytes()


def test_null_poses_are_not_taken_for_rotations() -> None:
    data = pa.table({name: pa.array([None, 1.0 if name == "qw" else 0.0], pa.float64()) for name in POSE})
    moved = frametool.apply_arrow(data, MOVER, as_="pose").to_pylist()
    assert set(moved[0].values()) == {None}
    wanted = MOVER @ frametool.Transform.identity()
    assert tuple(moved[1].values()) == (*wanted.xyz, *wanted.xyzw)


@pytest.mark.parametrize("cut", [(0, 0), (7, 100), (ROWS, 5)], ids=str)
def test_slices_chunks_and_no_rows_at_all_are_moved_alike(cut: tuple[int, int]) -> None:
    xyz, wanted = points(), slice(cut[0], cut[0] + cut[1])
    chunked = pa.concat_tables([table(xyz[:300]), table(xyz[300:300]), table(xyz[300:])])
    assert numbers(frametool.apply_arrow(chunked.slice(*cut), MOVER)).tobytes() == MOVER.apply(xyz[wanted]).tobytes()
    batch = table(xyz).to_batches()[0].slice(*cut)
    assert numbers(frametool.apply_arrow(batch, MOVER)).tobytes() == MOVER.apply(xyz[wanted]).tobytes()


def test_a_schema_without_rows_stays_one() -> None:
    empty = table(points()).schema.empty_table()
    assert frametool.apply_arrow(empty, MOVER).equals(empty)


def test_what_was_given_is_not_written_to() -> None:
    xyz = points()
    data = table(xyz)
    frametool.apply_arrow(data, MOVER)
    assert numbers(data).tobytes() == xyz.tobytes()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"x": [1], "y": [2.0], "z": [3.0]}, "column 'x' is int64, not floating point; cast it to float64 first"),
        ({"x": ["1"], "y": [2.0], "z": [3.0]}, "column 'x' is string, not floating point; cast it to float64 first"),
        ({"px": [1.0], "y": [2.0], "z": [3.0]}, "no column 'x'; did you mean 'px'? columns: px, y, z"),
        ({"x": [1.0, 2.0], "y": [1.0, float("nan")], "z": [1.0, 2.0]}, "y[1]: nan is not finite; make it null, or leave the row out"),
        ({"x": [1.7e308], "y": [1.7e308], "z": [1.7e308]}, "y[0]: the result is too large for double"),
    ],
    ids=lambda value: value.split(";")[0] if isinstance(value, str) else "",
)  # fmt: skip
def test_what_cannot_be_moved_is_refused_by_name(data: dict[str, Any], message: str) -> None:
    with pytest.raises(frametool.FrametoolError) as caught:
        frametool.apply_arrow(pa.table(data), MOVER)
    assert str(caught.value) == message


def test_a_nan_in_a_null_row_is_no_error() -> None:
    data = pa.table({"x": [float("nan")], "y": pa.array([None], pa.float64()), "z": [1.0]})
    assert frametool.apply_arrow(data, MOVER).to_pylist() == [{"x": None, "y": None, "z": None}]


def test_a_column_that_may_hold_no_null_gets_none() -> None:
    fields = [pa.field("x", pa.float64(), nullable=False), pa.field("y", pa.float64()), pa.field("z", pa.float64())]
    data = pa.table([[1.0, 2.0], [1.0, None], [1.0, 2.0]], schema=pa.schema(fields))
    with pytest.raises(frametool.FrametoolError, match=r"x\[1\] becomes null, and the schema allows none"):
        frametool.apply_arrow(data, MOVER)


def test_a_column_that_stands_twice_is_refused() -> None:
    data = pa.Table.from_arrays([pa.array([1.0])] * 4, names=["x", "y", "z", "x"])
    with pytest.raises(frametool.FrametoolError, match="column 'x' appears twice"):
        frametool.apply_arrow(data, MOVER)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "expected a Transform, or tree, target and source; got NoneType"),
        ({"transform": MOVER, "as_": "twist"}, "as_ is one of point, vector, pose; found 'twist'"),
        ({"transform": MOVER, "columns": ("x", "y")}, "columns: a point has 3, like x, y, z; found x, y"),
        ({"transform": frametool.Transform.random(2, seed=1)}, r"transforms of shape (2,) for 5 rows; expected one, or one a row"),
        ({"target": "map", "source": "lidar"}, "expected a Transform, or tree, target and source; got no tree"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_what_does_not_say_how_to_move_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(frametool.FrametoolError) as caught:
        frametool.apply_arrow(table(points(5)), **options)
    assert str(caught.value) == message


def test_what_is_no_arrow_data_is_refused() -> None:
    with pytest.raises(frametool.FrametoolError, match=r"expected a pyarrow RecordBatch or Table, got builtins\.dict"):
        frametool.apply_arrow({"x": [1.0]}, MOVER)


# --- frames that move ---


def moving() -> TransformBuffer:
    """Make a buffer in which `lidar` is seen from `map` through a frame that moves for ten seconds."""
    buffer = TransformBuffer(keep_ns=None)
    for second in range(11):
        buffer.insert("map", "base", frametool.Transform.random(seed=second), second * 10**9)
    buffer.insert("base", "lidar", frametool.Transform.random(seed=99))
    return buffer


STAMPS = np.sort(np.random.default_rng(6).integers(0, 10**10, ROWS)) // 1000 * 1000


@pytest.mark.parametrize(
    "times",
    [
        pa.array(STAMPS), pa.array(STAMPS.astype(np.uint64)), pa.array(STAMPS, pa.timestamp("ns")),
        pa.array(STAMPS // 1000, pa.timestamp("us", "Europe/Berlin")), pa.array(STAMPS / 1e9),
    ],
    ids=lambda times: str(times.type),
)  # fmt: skip
def test_each_row_is_moved_at_its_own_time(times: Any) -> None:
    buffer, xyz = moving(), points()
    moved = frametool.apply_arrow(table(xyz, when=times), tree=buffer, target="map", source="lidar", time_column="when")
    assert numbers(moved).tobytes() == buffer.lookup_many("map", "lidar", STAMPS).apply(xyz).tobytes()


@pytest.mark.parametrize(("unit", "step"), [("s", 10**9), ("ms", 10**6)])
def test_coarse_timestamps_are_times_of_whole_units(unit: str, step: int) -> None:
    buffer, xyz = moving(), points(10)
    when = pa.array(np.arange(10), pa.timestamp(unit))
    moved = frametool.apply_arrow(table(xyz, t=when), tree=buffer, target="map", source="lidar", time_column="t")
    assert numbers(moved).tobytes() == buffer.lookup_many("map", "lidar", np.arange(10) * step).apply(xyz).tobytes()


def test_float_seconds_are_the_decimal_that_they_print_as() -> None:
    buffer, xyz = moving(), points(4)
    seconds = [1.1, 2.7, 0.1 + 0.2, 9.123456789]
    stamps = [1_100_000_000, 2_700_000_000, 300_000_000, 9_123_456_789]
    data = table(xyz, t=pa.array(seconds))
    moved = frametool.apply_arrow(data, tree=buffer, target="map", source="lidar", time_column="t")
    assert numbers(moved).tobytes() == buffer.lookup_many("map", "lidar", stamps).apply(xyz).tobytes()


def test_without_a_time_column_the_latest_pose_moves_all() -> None:
    buffer, xyz = moving(), points()
    moved = frametool.apply_arrow(table(xyz), tree=buffer, target="map", source="lidar")
    assert numbers(moved).tobytes() == buffer.lookup("map", "lidar").apply(xyz).tobytes()


def test_a_null_row_needs_no_time() -> None:
    buffer = moving()
    data = pa.table({name: pa.array([None, 1.0], pa.float64()) for name in XYZ} | {"stamp_ns": pa.array([None, 10**9])})
    moved = frametool.apply_arrow(data, tree=buffer, target="map", source="lidar", time_column="stamp_ns")
    assert moved["x"].is_null().to_pylist() == [True, False]


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([1, None], r"t\[1\] is null: no time"),
        (["1", "2"], "column 't' is string; stamps are a timestamp, integer nanoseconds, or float seconds"),
        ([1.0, float("nan")], r"t\[1\]: nan is not a time in seconds"),
        ([0, 10**12], "no data for map -> base at 1000.000000000"),
        ([1.0, 1e18], r"t\[1\]: 1e\+18 is not a time in seconds; integers are nanoseconds"),
        (pa.array([0, 10**12], pa.timestamp("s")), "column 't': a stamp is beyond 64 bits of nanoseconds"),
    ],
    ids=str,
)
def test_times_that_are_none_are_refused(times: Any, message: str) -> None:
    with pytest.raises(frametool.FrametoolError, match=message):
        frametool.apply_arrow(
            table(points(2), t=times), tree=moving(), target="map", source="lidar", time_column="t"
        )
