"""Parquet and Arrow through the command line: the numbers of the same rows as text, and all else as it was."""

from __future__ import annotations

import io
import json
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import console
import numpy as np
import pytest

import frametool
from frametool.formats.rows.arrow import CODECS

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")
ipc = pytest.importorskip("pyarrow.ipc")

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome, Sizes
    from numpy.typing import NDArray

    Use = Callable[..., "Made"]

XYZ = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
POSE = "{xyz: [1, -2, 0.5], rpy_deg: [10, 20, 30]}"
MOVER = frametool.Transform(frametool.Rotation.from_rpy(np.radians([10, 20, 30])), [1, -2, 0.5])
ROWS = 40
EXAMPLES = console.ROOT / "examples"
FORMS = ("parquet", "arrow")


def encoded(table: Any, form: str = "parquet", rows: int | None = 16, codec: str | None = None, **options: Any) -> bytes:
    """Write a table in a form, in groups of some rows."""
    sink = io.BytesIO()
    if form == "parquet":
        pq.write_table(table, sink, row_group_size=rows, **({"compression": codec} if codec else {}), **options)
        return sink.getvalue()
    with ipc.new_file(sink, table.schema, options=ipc.IpcWriteOptions(compression=codec)) as writer:
        writer.write_table(table, max_chunksize=rows)
    return sink.getvalue()


def decoded(data: bytes, form: str = "parquet") -> Any:
    """Read a table in a form."""
    if form == "parquet":
        return pq.ParquetFile(io.BytesIO(data)).read()
    return ipc.open_file(io.BytesIO(data)).read_all()


class Made(NamedTuple):
    """What a run left behind, and the file it wrote, if it wrote one."""

    status: int
    out: str
    err: str
    data: bytes

    def table(self, form: str = "parquet") -> Any:
        """Return the table that was written."""
        assert self.status == 0, self.err
        return decoded(self.data, form)


@pytest.fixture
def use(run: Callable[..., Outcome], tmp_path: Path) -> Use:
    """Run the command line with bytes as its input, or as a file; what it writes is read back."""

    def call(*arguments: str, data: bytes | str = b"", form: str = "parquet", files: Any = None) -> Made:
        made = tmp_path / "made"
        made.unlink(missing_ok=True)
        done = run(*arguments, "-f", form, "-o", "made", stdin=data, files=files)
        return Made(*done, made.read_bytes() if made.exists() else b"")

    return call


def cloud(kind: Any = None, seed: int = 1) -> Any:
    """Make points between columns of many types."""
    xyz = np.random.default_rng(seed).normal(size=(ROWS, 3)) * 20.0
    points = {name: pa.array(xyz[:, at], pa.float64()).cast(kind or pa.float64()) for at, name in enumerate(XYZ)}
    columns = {
        "id": pa.array(range(ROWS), pa.uint32()),
        **points,
        "when": pa.array(range(ROWS), pa.timestamp("us", "UTC")),
        "tag": pa.array([None if row % 3 else f'"a", {row}' for row in range(ROWS)]),
        "kind": pa.array(["car", "tree"] * (ROWS // 2)).dictionary_encode(),
        "ring": pa.array([[row, None] for row in range(ROWS)], pa.list_(pa.field("element", pa.int16()))),
        "box": pa.array([{"a": row, "b": None} for row in range(ROWS)], pa.struct([("a", pa.int8()), ("b", pa.string())])),
        "price": pa.array([None] * ROWS, pa.decimal128(10, 2)),
        "hit": pa.array([True, None] * (ROWS // 2)),
    }
    made = pa.table(columns).replace_schema_metadata({"made by": "a test"})
    field = made.schema.field("x").with_metadata({"unit": "m"})
    return made.cast(made.schema.set(made.schema.get_field_index("x"), field))


def points(table: Any, names: tuple[str, ...] = XYZ) -> NDArray[Any]:
    """Return columns as rows of numbers."""
    return np.stack([table[name].to_numpy() for name in names], axis=1)


def poses(seed: int = 2) -> Any:
    """Make a table of poses with stamps, from 0 to 4 s."""
    made = frametool.Transform.random(ROWS, seed=seed)
    numbers = np.concatenate([made.xyz, made.xyzw], axis=1)
    stamps = np.linspace(0, 4_000_000_000, ROWS).astype(np.int64)
    return pa.table({"stamp_ns": stamps, **dict(zip((*XYZ, *QUATERNION), numbers.T, strict=True))})


def csv(table: Any) -> str:
    """Write a table of numbers as text."""
    rows = zip(*(table[name].to_pylist() for name in table.column_names), strict=True)
    return "\n".join([",".join(table.column_names), *(",".join(map(repr, row)) for row in rows), ""])


# --- what comes out is what went in, moved ---


@pytest.mark.parametrize("form", FORMS)
def test_points_move_as_transform_apply_moves_them_and_nothing_else_changes(use: Use, form: str) -> None:
    given = cloud()
    made = use("apply", "--transform", POSE, data=encoded(given, form), form=form).table(form)
    assert points(made).tobytes() == MOVER.apply(points(given)).tobytes()
    assert made.schema.equals(given.schema, check_metadata=True)
    assert made.drop(XYZ).equals(given.drop(XYZ))


@pytest.mark.parametrize("target", FORMS)
@pytest.mark.parametrize("form", FORMS)
def test_any_of_the_forms_becomes_any_other_with_all_that_it_holds(use: Use, form: str, target: str) -> None:
    given = cloud().drop(["kind"])
    made = use("apply", "--transform", POSE, data=encoded(given, form), form=target).table(target)
    assert made.schema.equals(given.schema, check_metadata=True)
    assert made.drop(XYZ).equals(given.drop(XYZ))


def test_groups_of_rows_and_the_compression_of_each_column_stay(use: Use) -> None:
    codecs = {"id": "zstd", "x": "gzip", "y": "none", "z": "snappy", "tag": "zstd"}
    data = encoded(cloud().select(list(codecs)), codec=codecs)  # type: ignore[arg-type]
    given, made = (pq.ParquetFile(io.BytesIO(each)).metadata for each in (data, use("apply", "--transform", POSE, data=data).data))
    assert [made.row_group(at).num_rows for at in range(made.num_row_groups)] == [16, 16, 8]
    for at in range(given.num_columns):
        assert made.row_group(0).column(at).compression == given.row_group(0).column(at).compression


@pytest.mark.parametrize(
    "options",
    [{"use_compliant_nested_type": False}, {"store_schema": False}, {"use_deprecated_int96_timestamps": True}],
    ids=str,
)
def test_the_schema_that_parquet_itself_has_stays(use: Use, options: dict[str, Any]) -> None:
    given = cloud().drop(["kind"])
    given = given.append_column("parts", pa.array([[row] for row in range(ROWS)]))
    data = encoded(given, **options)
    before, after = (pq.ParquetFile(io.BytesIO(each)) for each in (data, use("apply", "--transform", POSE, data=data).data))
    assert before.schema.equals(after.schema)
    assert before.schema_arrow.equals(after.schema_arrow, check_metadata=True)
    assert set(before.metadata.metadata or {}) == set(after.metadata.metadata or {})


@pytest.mark.parametrize("codec", [None, "lz4", "zstd"])
def test_batches_and_their_compression_stay(use: Use, codec: str | None) -> None:
    data = encoded(cloud(), "arrow", codec=codec)
    made = use("apply", "--transform", POSE, data=data, form="arrow").data
    for each in (made, data):
        assert [name for magic, name in CODECS.items() if magic in each] == ([codec] if codec else [])
    reader = ipc.open_file(io.BytesIO(made))
    assert [reader.get_batch(at).num_rows for at in range(reader.num_record_batches)] == [16, 16, 8]


def test_a_column_keeps_its_place_when_results_stand_beside(use: Use) -> None:
    made = use("apply", "--transform", POSE, "--keep", "--prefix", "map_", data=encoded(cloud().select(["id", *XYZ, "tag"]))).table()
    assert made.column_names == ["id", "x", "y", "z", "tag", "map_x", "map_y", "map_z"]


def test_float32_is_computed_in_float64_and_rounded_once(use: Use) -> None:
    given = cloud(pa.float32())
    done = use("apply", "--transform", POSE, data=encoded(given))
    assert points(done.table()).tobytes() == MOVER.apply(points(given).astype(np.float64)).astype(np.float32).tobytes()


@pytest.mark.parametrize("form", FORMS)
def test_a_row_with_a_null_is_null_and_no_other_is(use: Use, form: str) -> None:
    columns = [[1.0, None, 1.0, 1.0, 4.0], [2.0, 2.0, None, 2.0, 5.0], [3.0, 3.0, 3.0, None, 6.0]]
    given = pa.table({name: pa.array(column, pa.float64()) for name, column in zip(XYZ, columns, strict=True)})
    made = use("apply", "--transform", POSE, data=encoded(given, form), form=form).table(form)
    assert all(made[name].is_null().to_pylist() == [False, True, True, True, False] for name in XYZ)
    assert points(made.take([0, 4])).tobytes() == MOVER.apply([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).tobytes()


@pytest.mark.parametrize(
    "arguments",
    [
        ("apply", "--transform", POSE), ("convert", "--to", "rpy_deg"), ("convert", "--to", "matrix"), ("compose", "-", POSE),
        ("invert",), ("relative", POSE, "-"), ("relative", "--consecutive", "--velocity"),
        ("apply", "drive.yaml", "map", "lidar", "--time-column", "stamp_ns"),
        ("calc", "inv(row) * row * row"),
    ],
    ids=" ".join,
)  # fmt: skip
@pytest.mark.parametrize("form", FORMS)
def test_every_command_gives_the_numbers_it_gives_for_the_same_rows_as_text(
    use: Use, run: Callable[..., Outcome], arguments: tuple[str, ...], form: str
) -> None:
    files = {"drive.yaml": (EXAMPLES / "drive.yaml").read_bytes()}
    text = run(*arguments, stdin=csv(poses()), files=files)
    made = use(*arguments, data=encoded(poses(), form), form=form, files=files).table(form)
    header, *rows = text.out.splitlines()
    assert made.column_names == header.split(",")
    assert csv(made).splitlines()[1:] == rows


def test_frames_are_looked_up_for_each_row(use: Use) -> None:
    data = encoded(pa.table({"id": [1, 2], "child": ["lidar", "tool"]}))
    made = use("lookup", str(EXAMPLES / "robot.yaml"), "map", "--source-column", "child", data=data).table()
    tree = frametool.load(EXAMPLES / "robot.yaml")
    assert made.column_names == ["id", "child", *XYZ, *QUATERNION]
    assert points(made).tolist() == [tree.lookup("map", name).xyz.tolist() for name in ("lidar", "tool")]


def test_rows_say_their_frames_and_are_told_the_new_one(use: Use) -> None:
    given = pa.table({"frame": pa.array(["lidar", "tool", "lidar"]).dictionary_encode(), **{name: [1.0, 2.0, 3.0] for name in XYZ}})
    made = use("apply", str(EXAMPLES / "robot.yaml"), "map", data=encoded(given)).table()
    assert made["frame"].to_pylist() == ["map"] * 3
    assert made.schema.equals(given.schema)


# --- times ---


@pytest.mark.parametrize(
    ("name", "times"),
    [
        ("stamp_ns", pa.array([500_000_000, 1_500_000_000, 2_250_000_000])),
        ("when", pa.array([500_000, 1_500_000, 2_250_000], pa.timestamp("us"))),
        ("when", pa.array([500, 1500, 2250], pa.timestamp("ms", "Asia/Tokyo"))),
        ("t", pa.array([0.5, 1.5, 2.25])),
        ("t", pa.array([0.5, 1.5, 2.25], pa.float32())),
    ],
    ids=lambda value: str(getattr(value, "type", value)),
)
@pytest.mark.parametrize("form", FORMS)
def test_each_row_moves_at_its_own_time(use: Use, form: str, name: str, times: Any) -> None:
    given = pa.table({name: times, **{each: [1.0, 2.0, 3.0] for each in XYZ}})
    arguments = ("apply", str(EXAMPLES / "drive.yaml"), "map", "lidar", "--time-column", name)
    made = use(*arguments, data=encoded(given, form), form=form).table(form)
    drive = frametool.load(EXAMPLES / "drive.yaml")
    stamps = [500_000_000, 1_500_000_000, 2_250_000_000]
    assert points(made).tobytes() == drive.lookup_many("map", "lidar", stamps).apply(points(given)).tobytes()
    assert made[name].equals(given[name])


def test_whole_seconds_are_seconds_and_nanoseconds_in_their_place_are_found_out(use: Use) -> None:
    arguments = ("apply", str(EXAMPLES / "drive.yaml"), "map", "lidar", "--time-column", "t")
    given = pa.table({"t": [1, 2], **{each: [1.0, 2.0] for each in XYZ}})
    drive = frametool.load(EXAMPLES / "drive.yaml")
    wanted = drive.lookup_many("map", "lidar", [10**9, 2 * 10**9]).apply(points(given))
    assert points(use(*arguments, data=encoded(given)).table()).tobytes() == wanted.tobytes()
    late = given.set_column(0, "t", pa.array([1, 1_700_000_000_000_000_000]))
    done = use(*arguments, data=encoded(late))
    assert (done.status, done.data) == (1, b"")
    assert "beyond 64 bits of nanoseconds; are these some? then call the column stamp_ns" in done.err


def test_rows_without_a_time_or_outside_of_the_samples_are_bad(use: Use) -> None:
    arguments = ("apply", str(EXAMPLES / "drive.yaml"), "map", "lidar", "--time-column", "stamp_ns", "--on-error", "skip")
    given = pa.table({"stamp_ns": [10**9, None, 10**12], **{each: [1.0, 2.0, 3.0] for each in XYZ}})
    done = use(*arguments, data=encoded(given))
    assert (done.status, decoded(done.data)["stamp_ns"].to_pylist()) == (3, [10**9])
    assert "row 2, column stamp_ns: no time: null" in done.err
    assert "row 3, column stamp_ns: no data for map -> base_link" in done.err


# --- bad rows ---


BAD = {"x": [1.0, 2.0, float("nan"), 4.0, 5.0], "y": [1.0, 2.0, 3.0, float("inf"), 5.0], "z": [1.0, 2.0, 3.0, 4.0, 5.0], "id": [1, 2, 3, 4, 5]}


@pytest.mark.parametrize("form", FORMS)
def test_the_first_bad_row_stops_the_run_and_leaves_no_file(use: Use, form: str) -> None:
    done = use("apply", "--transform", POSE, data=encoded(pa.table(BAD), form, rows=2), form=form)
    assert (done.status, done.data) == (1, b"")
    assert done.err == "frametool: stdin: row 3, column x: not finite; --on-error skip goes on\n"


@pytest.mark.parametrize(("rule", "ids"), [("skip", [1, 2, 5]), ("null", [1, 2, 3, 4, 5])])
@pytest.mark.parametrize("form", FORMS)
def test_bad_rows_are_left_out_or_null(use: Use, form: str, rule: str, ids: list[int]) -> None:
    done = use("apply", "--transform", POSE, "--on-error", rule, data=encoded(pa.table(BAD), form, rows=2), form=form)
    made = decoded(done.data, form)
    assert (done.status, made["id"].to_pylist()) == (3, ids)
    assert made["x"].null_count == len(ids) - 3
    assert points(made.filter(made["x"].is_valid())).tobytes() == MOVER.apply([[1.0] * 3, [2.0] * 3, [5.0] * 3]).tobytes()
    assert "stdin: row 4, column y: not finite" in done.err


def test_a_column_that_may_hold_no_null_gets_none(use: Use) -> None:
    schema = pa.schema([pa.field("x", pa.float64(), nullable=False), ("y", pa.float64()), ("z", pa.float64())])
    done = use("apply", "--transform", POSE, data=encoded(pa.table([[1.0], [None], [1.0]], schema=schema)))
    assert (done.status, done.data) == (1, b"")
    assert "column x is declared not to hold nulls" in done.err


# --- other forms ---


def test_the_same_rows_give_the_same_numbers_in_every_form(use: Use, run: Callable[..., Outcome]) -> None:
    given = cloud().select(XYZ)
    file = io.BytesIO()
    np.save(file, points(given))
    lines = "".join(json.dumps(row) + "\n" for row in given.to_pylist())
    found = [points(use("apply", "--transform", POSE, data=encoded(given, form), form=form).table(form)) for form in FORMS]
    others = (csv(given), lines, file.getvalue())
    found += [points(use("apply", "--transform", POSE, data=data).table()) for data in others]
    text = run("apply", "--transform", POSE, "-f", "csv", stdin=encoded(given)).out.splitlines()[1:]
    found.append(np.array([[float(cell) for cell in row.split(",")[-3:]] for row in text]))
    assert {each.tobytes() for each in found} == {MOVER.apply(points(given)).tobytes()}


def test_arrays_of_numpy_take_columns_of_numbers_and_are_taken(run: Callable[..., Outcome], use: Use, tmp_path: Path) -> None:
    given = cloud(pa.float32()).append_column("gain", pa.array([None, 2.5] * (ROWS // 2)))
    done = run("apply", "--transform", POSE, "-o", "made.npy", stdin=encoded(given))
    assert "left out" not in done.err
    records = np.load(tmp_path / "made.npy")
    kinds = {"id": "u4", "x": "f4", "y": "f4", "z": "f4", "gain": "f8"}
    assert {name: records.dtype[name] for name in kinds} == {name: np.dtype(kind) for name, kind in kinds.items()}
    assert records["price"].tolist() == given["price"].cast(pa.string()).fill_null("").to_pylist()
    assert np.isnan(records["gain"]).tolist() == [True, False] * (ROWS // 2)
    back = use("convert", "--to", "quaternion", data=(tmp_path / "made.npy").read_bytes())
    assert back.status == 1  # points are no poses
    again = use("apply", "--transform", "{xyz: [0, 0, 0]}", data=(tmp_path / "made.npy").read_bytes()).table()
    assert {name: str(again.schema.field(name).type) for name in kinds} == {"id": "uint32", "x": "float", "y": "float", "z": "float", "gain": "double"}
    assert points(again).tobytes() == np.stack([records[name] for name in XYZ], axis=1).tobytes()


@pytest.mark.parametrize(("number", "kind"), [(2, "f8"), (2**53 + 1, "U16")])
def test_whole_numbers_with_nulls_are_floats_in_an_array_or_text_where_these_lose_digits(
    run: Callable[..., Outcome], tmp_path: Path, number: int, kind: str
) -> None:
    given = cloud().select(XYZ).append_column("n", pa.array([None, number] * (ROWS // 2)))
    assert run("apply", "--transform", POSE, "-o", "made.npy", stdin=encoded(given)).status == 0
    records = np.load(tmp_path / "made.npy")
    assert (records.dtype["n"], str(records["n"][1])) == (np.dtype(kind), "2.0" if number == 2 else str(number))


def test_other_columns_go_into_a_table_of_text(run: Callable[..., Outcome]) -> None:
    given = cloud().slice(0, 2)
    header, first, second = run("apply", "--transform", POSE, "-f", "csv", stdin=encoded(given)).out.splitlines()
    assert header.split(",") == [*XYZ, "id", "when", "tag", "kind", "ring", "box", "price", "hit"]
    assert first.split(",", 3)[3] == '0,1970-01-01 00:00:00.000000Z,"""a"", 0",car,"[0, null]","{""a"": 0, ""b"": null}",,true'
    assert second.split(",", 3)[3] == '1,1970-01-01 00:00:00.000001Z,,tree,"[1, null]","{""a"": 1, ""b"": null}",,'


def test_cells_of_text_get_the_type_that_all_of_them_have(use: Use) -> None:
    text = "x,y,z,id,code,gain,tag,none\n1,2,3,1,007,1.5,a,\n1,2,3,-20,7,,5,\n"
    done = use("apply", "--transform", POSE, data=text)
    made = done.table()
    kinds = {field.name: str(field.type) for field in made.schema}
    assert kinds == dict.fromkeys(XYZ, "double") | {"id": "int64", "code": "string", "gain": "double", "tag": "string", "none": "string"}
    assert made.drop(XYZ).to_pylist()[1] == {"id": -20, "code": "7", "gain": None, "tag": "5", "none": None}
    assert "id int64, code string, gain double, tag string, none string" in done.err


@pytest.mark.parametrize(
    ("cells", "kind"),
    [
        (["1", "-2", ""], "int64"), (["9223372036854775807"], "int64"), (["9223372036854775808"], "string"), (["01"], "string"),
        (["1", "2.5"], "double"), (["1e5", "-0.0"], "double"), (["nan"], "string"), (["+1"], "string"), (["1234567890123456.5"], "string"),
        ([""], "string"), (["true", "false", ""], "bool"), (["True"], "string"),
    ],
    ids=str,
)  # fmt: skip
def test_a_type_is_one_in_which_no_cell_loses_anything(use: Use, cells: list[str], kind: str) -> None:
    column = use("apply", "--transform", POSE, data="x,y,z,a\n" + "".join(f"1,2,3,{cell}\n" for cell in cells)).table()["a"]
    assert (str(column.type), column.null_count) == (kind, cells.count(""))


@pytest.mark.parametrize(("form", "late"), [("parquet", "2.5"), ("npy", "2.5"), ("npy", "")])
def test_a_cell_of_another_type_than_those_before_is_refused_by_its_name(use: Use, sizes: Sizes, form: str, late: str) -> None:
    sizes(typed=1, block=20)
    rows = "".join(f"1,2,3,{cell}\n" for cell in ("7", "7", "7", late))
    done = use("apply", "--transform", POSE, data=f"x,y,z,a\n{rows}", form=form)
    assert (done.status, done.data) == (1, b"")
    assert f"column 'a': '{late}' is no int64, as all cells of the first rows are" in done.err


# --- files that are none ---


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rows", [0, 1])
def test_no_rows_are_no_error(use: Use, form: str, rows: int) -> None:
    given = cloud().slice(0, rows)
    made = use("apply", "--transform", POSE, data=encoded(given, form), form=form).table(form)
    assert (made.num_rows, made.schema.equals(given.schema, check_metadata=True)) == (rows, True)


@pytest.mark.parametrize("rows", [0, None])
def test_no_groups_and_empty_groups_stay(use: Use, rows: int | None) -> None:
    sink = io.BytesIO()
    with pq.ParquetWriter(sink, cloud().schema) as writer:
        if rows is not None:
            writer.write_table(cloud().slice(0, rows))
    made = use("apply", "--transform", POSE, data=sink.getvalue()).data
    assert pq.ParquetFile(io.BytesIO(made)).num_row_groups == pq.ParquetFile(io.BytesIO(sink.getvalue())).num_row_groups


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("part", [0.02, 0.5, 0.9])
def test_a_part_of_a_file_is_one_line_and_no_file(use: Use, form: str, part: float) -> None:
    data = encoded(cloud(), form)
    done = use("apply", "--transform", POSE, "--in", form, data=data[: int(len(data) * part)], form=form)
    assert (done.status, done.err.count("\n"), done.data) == (1, 1, b"")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "it is empty"),
        (b"hello world", "neither Parquet (PAR1) nor Arrow (ARROW1): it begins with b'hello wo'"),
        (b"PAR1" + b"\0" * 100, "it cannot be read"),
        (b"ARROW1\0\0" + b"\xff" * 100, "it cannot be read"),
    ],
    ids=str,
)
def test_what_is_no_such_file_is_said_in_one_line(use: Use, data: bytes, words: str) -> None:
    done = use("apply", "--transform", POSE, "--in", "parquet", data=data)
    assert (done.status, done.err.count("\n"), done.data) == (1, 1, b"")
    assert words in done.err


@pytest.mark.parametrize("form", FORMS)
def test_bytes_that_flipped_are_one_line_or_other_numbers(use: Use, form: str) -> None:
    data = encoded(cloud().select(["id", *XYZ, "tag"]), form, codec="zstd")
    generator = np.random.default_rng(3)
    for _ in range(30):
        broken = bytearray(data)
        for place in generator.integers(4, len(data), 3).tolist():
            broken[place] ^= 1 << int(generator.integers(8))
        done = use("apply", "--transform", POSE, data=bytes(broken), form=form)
        assert done.status in (0, 1, 2)
        assert (done.status == 0) == bool(done.data)
        assert len(done.err) < 2000
        assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"x": ["a"], "y": [1.0], "z": [1.0]}, "column x holds no numbers"),
        ({"x": [1], "y": [1.0], "z": [1.0]}, "column x holds int64, where the result would be rounded"),
        ({"y": [1.0], "z": [1.0]}, "no columns of a point or pose among: y, z"),
    ],
    ids=["text", "integers", "missing"],
)
def test_columns_that_cannot_be_moved_are_named(use: Use, columns: dict[str, Any], words: str) -> None:
    done = use("apply", "--transform", POSE, data=encoded(pa.table(columns)))
    assert (done.status, done.err.count("\n"), done.data) in ((1, 1, b""), (2, 1, b""))
    assert words in done.err


def test_a_group_too_large_to_be_held_is_written_in_parts(use: Use, sizes: Sizes) -> None:
    sizes(group=1 << 20)
    xyz = np.random.default_rng(4).normal(size=(200_000, 3))
    given = pa.table(dict(zip(XYZ, xyz.T, strict=True)))
    done = use("apply", "--transform", POSE, data=encoded(given, rows=None))
    assert points(done.table()).tobytes() == MOVER.apply(xyz).tobytes()
    assert done.err.count("\n") == done.err.count("are written in parts") == 1
    assert pq.ParquetFile(io.BytesIO(done.data)).num_row_groups == 4


def test_bytes_are_text_where_they_are_utf_8_and_escaped_elsewhere(run: Callable[..., Outcome]) -> None:
    given = pa.table({**{name: [1.0, 2.0] for name in XYZ}, "raw": pa.array([b"caf\xc3\xa9", b"\xff\x00"])})
    rows = run("apply", "--transform", POSE, "-f", "csv", stdin=encoded(given)).out.splitlines()
    assert [row.split(",")[-1] for row in rows[1:]] == ["caf\u00e9", "\\xff\x00"]


def test_without_pyarrow_the_extra_is_named(use: Use, monkeypatch: pytest.MonkeyPatch) -> None:
    data = encoded(cloud())
    for name in [name for name in sys.modules if name.partition(".")[0] == "pyarrow"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    done = use("apply", "--transform", POSE, data=data)
    assert (done.status, done.err) == (5, "frametool: stdin needs pyarrow; install it: pip install 'frametool[arrow]'\n")
    written = use("apply", "--transform", POSE, data="x,y,z\n1,2,3\n")
    assert (written.status, written.err.count("pip install 'frametool[arrow]'"), written.data) == (5, 1, b"")


def test_rows_of_joints_are_refused_by_their_form(use: Use) -> None:
    done = use("fk", str(EXAMPLES / "arm.urdf"), "arm_base", "tool", data=encoded(cloud()))
    assert (done.status, done.err.count("\n")) == (2, 1)
    assert "rows of joints are a table of text, records or messages, not parquet" in done.err
