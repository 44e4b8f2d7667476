"""Columns of numbers go through the same plan and the same kernels as tables of text, and come out to the same bits."""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from frametool import cli
from frametool.geometry.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome
    from numpy.typing import NDArray

    Array = NDArray[Any]
    Use = Callable[..., "Used"]

POSE = "{xyz: [1, -2, 0.5], rpy_deg: [10, 20, 30]}"
RNG = np.random.default_rng(7)
POINTS = RNG.normal(size=(50, 3)) * 10
POSES = np.hstack([POINTS, RNG.normal(size=(50, 4))])
POSES[:, 3:] /= np.linalg.norm(POSES[:, 3:], axis=1, keepdims=True)
NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw")


class Used(NamedTuple):
    """What a run of the command line left behind: also the array it wrote, if it wrote one."""

    status: int
    out: str
    err: str
    array: Any


@pytest.fixture
def use(run: Callable[..., Outcome]) -> Use:
    """Run the command line with an array, or text, as its input; results of `-f npy` are an array."""

    def call(*arguments: object, data: bytes = b"") -> Used:
        given = [str(each) for each in arguments]
        writes = given[-2:] == ["-f", "npy"]
        done = run(*given, *(["-o", "made.npy", "--force"] if writes else []), stdin=data)
        array = np.load("made.npy") if writes and Path("made.npy").exists() else None
        return Used(done.status, done.out, done.err, array)

    return call


def npy(array: Array) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def loaded(used: Used) -> Array:
    assert used.status == 0, used.err
    array: Array = used.array
    return array


def with_fields(array: Array, names: tuple[str, ...] = NAMES, **others: Array) -> Array:
    names = names[: array.shape[1]]
    fields = [*((name, "f8") for name in names), *((name, value.dtype) for name, value in others.items())]
    records = np.zeros(len(array), fields)
    for at, name in enumerate(names):
        records[name] = array[:, at]
    for name, value in others.items():
        records[name] = value
    return records


def csv(array: Array, names: tuple[str, ...] = NAMES) -> bytes:
    rows = [",".join(map(repr, row)) for row in array.tolist()]
    return "\n".join([",".join(names[: array.shape[1]]), *rows, ""]).encode()


def numbers_of(used: Used) -> tuple[list[str], Array]:
    assert used.status == 0, used.err
    header, *rows = used.out.splitlines()
    return header.split(","), np.array([[float(cell) for cell in row.split(",")] for row in rows])


@pytest.mark.parametrize(
    ("arguments", "array"),
    [
        (("apply", "--transform", POSE), POINTS),
        (("apply", "--transform", POSE, "--as", "vector"), POINTS),
        (("apply", "--transform", POSE), POSES),
        (("invert",), POSES),
        (("compose", POSE, "-"), POSES),
        (("relative", POSE, "-"), POSES),
        (("relative", "--consecutive"), POSES),
        (("convert", "--to", "rpy_deg"), POSES),
        (("convert", "--to", "matrix"), POSES),
        (("calc", "inv(row) * row * row"), POSES),
    ],
)
def test_fields_give_the_bits_of_the_same_columns_as_csv(use: Use, arguments: tuple[str, ...], array: Array) -> None:
    records = loaded(use(*arguments, "--in", "npy", "-f", "npy", data=npy(with_fields(array))))
    header, wanted = numbers_of(use(*arguments, "--in", "csv", "-f", "csv", data=csv(array)))
    assert list(records.dtype.names or ()) == header
    found = np.array([records[name] for name in header]).T
    assert found.tobytes() == wanted.tobytes()


def test_points_without_names_keep_their_shape_and_give_the_bits_of_the_value(use: Use) -> None:
    moved = loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(POINTS)))
    pose = Transform.from_matrix(np.array(json.loads(use("convert", POSE, "--to", "matrix", "-f", "json").out)["matrix"]))
    assert moved.shape == POINTS.shape
    assert np.allclose(moved, pose.apply(POINTS), rtol=0, atol=1e-14)


def test_matrices_are_rows_of_sixteen(use: Use) -> None:
    matrices = Transform.from_arrays(POSES[:, :3], POSES[:, 3:]).as_matrix()
    there = loaded(use("invert", "--from", "matrix", "-f", "npy", data=npy(matrices)))
    assert there.shape == (50, 4, 4)
    assert np.allclose(there @ matrices, np.eye(4), rtol=0, atol=1e-13)


def test_seven_columns_without_names_need_their_meaning(use: Use) -> None:
    result = use("invert", "-f", "npy", data=npy(POSES))
    assert (result.status, result.err) == (
        1, "frametool: stdin: 7 columns without names do not say what they are; give --from REP, or --columns\n"
    )  # fmt: skip
    assert loaded(use("invert", "--from", "xyzw", "-f", "npy", data=npy(POSES))).shape == (50, 7)


def test_other_fields_pass_byte_for_byte(use: Use) -> None:
    records = with_fields(POINTS, ring=np.arange(50, dtype="u2"), tag=np.array(["a", "b"] * 25, "S3"))
    moved = loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(records)))
    assert moved.dtype == records.dtype
    assert all(moved[name].tobytes() == records[name].tobytes() for name in ("ring", "tag"))


def test_floats_of_32_bits_are_computed_as_doubles_and_rounded_once(use: Use) -> None:
    records = with_fields(POINTS).astype([(name, "f4") for name in "xyz"])
    result = use("apply", "--transform", POSE, "-f", "npy", data=npy(records))
    doubles = with_fields(np.array([records[name].astype("f8") for name in "xyz"]).T)
    exact = loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(doubles)))
    assert loaded(result).tobytes() == exact.astype(records.dtype).tobytes()


def test_a_result_that_no_float32_holds_is_a_bad_row(use: Use) -> None:
    records = with_fields(np.array([[1.0, 2, 3], [3e38, 3e38, 0]])).astype([(name, "f4") for name in "xyz"])
    result = use("apply", "--transform", "{rpy_deg: [0, 0, -45]}", "--on-error", "skip", "-f", "npy", data=npy(records))
    assert result.status == 3
    assert "stdin: row 2: the result is too large for float32 (row skipped)" in result.err
    assert result.array.shape == (1,)


def test_points_without_return_stay_without_and_the_others_move(use: Use) -> None:
    points = POINTS.copy()
    points[3], points[5, 1], points[7, 2] = np.nan, np.inf, np.nan
    moved = loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(points)))
    whole = loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(POINTS)))
    gone = [3, 5, 7]
    assert np.isnan(moved[gone]).all()
    assert np.delete(moved, gone, 0).tobytes() == np.delete(whole, gone, 0).tobytes()


def test_points_without_return_are_left_out_of_text_and_counted(use: Use) -> None:
    points = POINTS[:3].copy()
    points[1] = np.nan
    result = use("apply", "--transform", POSE, "-f", "csv", data=npy(points))
    assert len(result.out.splitlines()) == 3
    assert "stdin: 1 row without numbers left out: csv has no place for them" in result.err


def test_integers_are_not_rounded_in_silence(use: Use) -> None:
    records = with_fields(POINTS).astype([(name, "i4") for name in "xyz"])
    result = use("apply", "--transform", POSE, "-f", "npy", data=npy(records))
    assert (result.status, result.err) == (
        2,
        "frametool: stdin: column x holds int32, where the result would be rounded; --keep puts it beside, -f csv writes text\n",
    )


def test_each_row_moves_from_its_own_frame_at_its_own_time(use: Use, tmp_path: Path) -> None:
    tree = tmp_path / "tree.yaml"
    tree.write_text("frames:\n- {name: b, parent: a, samples: [{stamp: 0, xyz: [0, 0, 0]}, {stamp: 10, xyz: [10, 0, 0]}]}\n")
    records = with_fields(np.zeros((4, 3)), stamp_ns=np.array([0, 5, 20, 10]) * 10**9, frame=np.array(["b", "b", "b", "a"]))
    given = ("apply", tree, "a", "--time-column", "stamp_ns")
    assert use(*given, "-f", "npy", data=npy(records)).status == 1
    skipped = use(*given, "--on-error", "skip", "-f", "npy", data=npy(records))
    rows = skipped.array
    assert (skipped.status, rows["x"].tolist(), rows["frame"].tolist()) == (3, [0.0, 5.0, 0.0], ["a", "a", "a"])
    nulled = use(*given, "--on-error", "null", "-f", "npy", data=npy(records))
    rows = nulled.array
    assert (nulled.status, len(rows), np.isnan(rows["x"]).tolist()) == (3, 4, [False, False, True, False])
    assert "stdin: row 3, column stamp_ns: " in nulled.err


def test_a_place_in_json_names_the_row(use: Use) -> None:
    records = with_fields(np.zeros((2, 7)))
    result = use("invert", "-f", "json", "--in", "npy", data=npy(records))
    said = json.loads(result.err.splitlines()[0])
    assert (said["source"], said["row"], said["column"]) == ("stdin", 1, "qx")


def test_velocities_leave_the_first_row_out(use: Use) -> None:
    records = with_fields(POSES, stamp_ns=np.arange(50) * 10**8)
    moved = loaded(use("relative", "--consecutive", "--velocity", "-f", "npy", data=npy(records)))
    assert len(moved) == 49
    assert {"linear_x", "angular_z", "distance"} <= set(moved.dtype.names or ())


def test_weights_stand_in_a_column(use: Use) -> None:
    records = with_fields(np.array([[0.0, 0, 0], [4, 0, 0]]), w=np.array([1.0, 3.0]))
    said = json.loads(use("mean", "--weights", "w", "-f", "json", data=npy(records)).out)
    assert said["xyz"] == [3.0, 0.0, 0.0]


@pytest.mark.parametrize("form", ["csv", "json"])
def test_rows_of_text_become_an_array(use: Use, form: str) -> None:
    text = b"x,y,z,ring,tag\n1,2,3,4,a\n5,6,7,,b\n"
    if form == "json":
        text = b'{"point": [1, 2, 3], "ring": 4, "tag": "a"}\n{"point": [5, 6, 7], "ring": null, "tag": "b"}\n'
    result = use("apply", "--transform", "{xyz: [0, 0, 0]}", "--in", form, "-f", "npy", data=text)
    rows = loaded(result)
    assert rows.dtype.names == ("x", "y", "z", "ring", "tag")
    assert rows["tag"].tolist() == ["a", "b"]
    assert np.array([rows[name] for name in "xyz"]).T.tolist() == [[1, 2, 3], [5, 6, 7]]
    assert rows["ring"][0] == 4
    assert np.isnan(rows["ring"][1])


def test_single_results_are_an_array_too(use: Use) -> None:
    assert loaded(use("apply", "--transform", "{xyz: [1, 1, 1]}", "1", "2", "3", "-f", "npy")).tolist() == [[2, 3, 4]]
    assert loaded(use("convert", POSE, "--to", "rpy", "-f", "npy")).dtype.names == ("x", "y", "z", "roll", "pitch", "yaw")


def test_no_array_is_written_to_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    shown, terminal = pytest.importorskip("pty").openpty()
    with os.fdopen(terminal, "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        assert cli.run(["convert", POSE, "-f", "npy"]) == 1
    os.close(shown)
    assert capsys.readouterr().err == "frametool: npy is no text for a terminal; give -o FILE, or pipe it\n"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x93NUMPY", "the header cannot be read: EOF"),
        (npy(POINTS)[:60], "the header cannot be read: EOF"),
        (npy(POINTS)[:-1], "the file ends after 49 of 50 rows"),
        (npy(np.array(1.0)), "it holds float64 in the shape (); wanted are rows of plain numbers, n x 3, or a row of records"),
        (npy(POINTS + 1j), "it holds complex128 in the shape (50, 3); wanted are rows of plain numbers"),
        (npy(np.asfortranarray(POINTS))[:-1], "the file ends within its columns, 1 bytes are missing"),
        (npy(POINTS).replace(b"(50, 3)", b"(-5, 3)"), "it holds float64 in the shape (-5, 3)"),
        (npy(POINTS).replace(b"'<f8'", b"'|O' "), "it holds object in the shape (50, 3); wanted are rows of plain numbers, n x 3, or a row of records; objects are never unpickled"),
    ],
)  # fmt: skip
def test_a_damaged_array_is_one_line(use: Use, data: bytes, said: str) -> None:
    result = use("apply", "--transform", POSE, "-f", "csv", data=data)
    assert result.status == 1
    assert result.err.startswith(f"frametool: stdin: {said}")
    assert result.err.count("\n") == 1


def test_what_a_header_promises_is_not_allocated(use: Use) -> None:
    huge = npy(POINTS).replace(b"(50, 3), }    ", b"(10**9, 3), }").replace(b"10**9", b"999999999")
    result = use("apply", "--transform", POSE, "-f", "csv", data=huge)
    assert (result.status, result.err) == (1, "frametool: stdin: the file ends after 50 of 999999999 rows\n")


@pytest.mark.parametrize("array", [POINTS, Transform.from_arrays(POSES[:, :3], POSES[:, 3:]).as_matrix()])
def test_columns_that_stand_one_by_one_are_the_same_array(use: Use, array: Array) -> None:
    given = ("compose", POSE, "-", "--from", "matrix") if array.ndim == 3 else ("apply", "--transform", POSE)
    layouts = (array, np.asfortranarray(array))
    by_rows, by_columns = (loaded(use(*given, "-f", "npy", data=npy(layout))) for layout in layouts)
    assert by_columns.shape == array.shape
    assert by_columns.tobytes() == by_rows.tobytes()


def test_an_array_of_no_rows_stays_one(use: Use) -> None:
    assert loaded(use("apply", "--transform", POSE, "-f", "npy", data=npy(POINTS[:0]))).shape == (0, 3)


def test_points_without_numbers_do_not_count_in_a_mean(use: Use) -> None:
    points = POINTS.copy()
    points[3] = np.nan
    found = json.loads(use("mean", "-f", "json", data=npy(points)).out)
    assert found["count"] == 49
    assert np.allclose(found["xyz"], np.delete(POINTS, 3, axis=0).mean(axis=0))


@pytest.mark.parametrize("precision", [(), ("--precision", "3")])
def test_rows_of_csv_in_bulk_are_those_written_one_by_one(use: Use, precision: tuple[str, ...]) -> None:
    power = (RNG.normal(size=50) * 1e6).astype("f4")
    records = with_fields(POINTS, ring=np.arange(50, dtype="u2"), weight=RNG.normal(size=50), power=power)
    apply = ("apply", "--transform", POSE, *precision, "-f", "csv")
    rows = use(*apply, data=npy(records)).out.splitlines()
    singly = [use(*apply, data=npy(records[at : at + 1])).out.splitlines()[1] for at in range(50)]
    assert rows[1:] == singly
    assert [float(row.split(",")[-1]) for row in rows[1:]] == [float(str(value)) for value in power]


def test_whole_numbers_in_a_column_of_stamps_are_seconds(run: Any) -> None:
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    rows = np.array([(2, 1, 2, 3, 0, 0, 0, 1), (3, 1, 2, 3, 0, 0, 0, 1)], [("t", "<i8"), *((name, "<f8") for name in names)])
    file = io.BytesIO()
    np.save(file, rows)
    done = run("convert", "-i", "rows.npy", "-f", "tum", "--quiet", files={"rows.npy": file.getvalue()})
    assert [line.split()[0] for line in done.out.splitlines()] == ["2.000000000", "3.000000000"]


def test_names_that_are_not_ascii_are_written_and_read(use: Use) -> None:
    made = loaded(use("convert", "--in", "csv", "-f", "npy", data="x,y,z,höhe\n1,2,3,4\n".encode()))
    assert made.dtype.names == ("x", "y", "z", "höhe")
    assert use("convert", "-f", "csv", data=npy(made)).out.startswith("x,y,z,höhe\n")
