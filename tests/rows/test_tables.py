from __future__ import annotations

import random
from itertools import pairwise
from typing import Any

import pytest
from flow import INVERT, MOVE, asked, calls, convert, flow

HOSTILE = ["007", "1.50", "1e3", '"a,b"', '"q""q"', '""', "", "é 🐢", "\0", "x" * 1_000_000, '" "', "-0.0", "nan", "5'"]


def moved(x: float, y: float, z: float) -> str:
    return f"{1.0 - y!r},{2.0 + x!r},{3.0 + z!r}"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("last", [True, False])
def test_columns_that_are_not_ours_pass_byte_for_byte(end: str, mark: str, last: bool) -> None:  # noqa: FBT001
    rows = [(cell, index, index + 0.5, -index) for index, cell in enumerate(HOSTILE)]
    given = [f"id,x,y,z,{'tag'}", *(f"{cell},{x},{y},{z},{cell}" for cell, x, y, z in rows)]
    wanted = [given[0], *(f"{cell},{moved(x, y, z)},{cell}" for cell, x, y, z in rows)]
    text = mark + end.join(given) + end * last
    assert flow(text.encode(), MOVE).text == (mark + end.join(wanted) + end * last).encode()


@pytest.mark.parametrize("size", [1, 7, 100, 4096])
@pytest.mark.parametrize("on_error", ["skip", "null"])
def test_the_size_of_blocks_does_not_show(size: int, on_error: str) -> None:
    rng = random.Random(5)  # noqa: S311 - numbers to move, nothing to hide
    rows = [f'{i},{rng.uniform(-9, 9)},{rng.choice(["1", "foo", "2e-3"])},0,"t\n{i}"' for i in range(200)]
    text = ("id,x,y,z,tag\n" + "\n".join(rows)).encode()
    request = MOVE._replace(on_error=on_error)
    assert flow(text, request, size=size) == flow(text, request)


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("x,y,z", "0,1,2"), ("a.x,a.y,a.z", "0,1,2"), ("x_left,y_left,z_left", "0,1,2"), ("z,y,x", "2,1,0"),
        ("field.point.x,field.point.y,field.point.z", "0,1,2"), ("tx,ty,tz", "0,1,2"), ("X,Y,Z", "0,1,2"),
    ],
)  # fmt: skip
def test_positions_are_found_by_name(header: str, columns: str) -> None:
    order = [int(place) for place in columns.split(",")]
    point = [1.0 - 20.0, 2.0 + 10.0, 3.0 + 30.0]
    given = [[10, 20, 30][place] for place in order]
    wanted = [point[place] for place in order]
    row = ",".join(map(str, given))
    result = flow(f"{header}\n{row}\n".encode(), MOVE)
    assert result.text == f"{header}\n{','.join(map(repr, wanted))}\n".encode()


def test_rostopic_names_are_understood() -> None:
    header = "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z," + ",".join(
        f"field.pose.orientation.{name}" for name in "xyzw"
    )
    result = flow(f"{header}\n5,1,2,3,0,0,0,1\n".encode(), convert("rpy_deg"))
    assert result.text.splitlines()[0].endswith(
        b"field.pose.orientation.roll_deg,field.pose.orientation.pitch_deg,field.pose.orientation.yaw_deg"
    )
    assert result.text.splitlines()[1] == b"5,1,2,3,0.0,0.0,0.0"


def test_more_than_one_candidate_is_an_error_that_lists_them() -> None:
    result = flow(b"a.x,a.y,a.z,b.x,b.y,b.z\n1,2,3,4,5,6\n", MOVE)
    assert (result.status, result.text) == (1, b"")
    assert "a.x a.y a.z; b.x b.y b.z" in result.told[0]
    assert flow(b"a.x,a.y,a.z,b.x,b.y,b.z\n1,2,3,4,5,6\n", MOVE.with_rows(columns=("b.x,b.y,b.z",))).status == 0


def test_results_beside_their_source_need_other_names() -> None:
    text = b"qx,qy,qz,qw,t\n0,0,0,1,a\n"
    assert (
        flow(text, convert("rpy").with_results(keep=True)).text == b"qx,qy,qz,qw,t,roll,pitch,yaw\n0,0,0,1,a,0.0,0.0,0.0\n"
    )
    assert "--prefix" in flow(text, INVERT.with_results(keep=True)).told[0]
    kept = flow(text, INVERT.with_results(keep=True, prefix="inv_"))
    assert kept.text.splitlines()[0] == b"qx,qy,qz,qw,t,inv_qx,inv_qy,inv_qz,inv_qw"


@pytest.mark.parametrize("cell", ["nan", "inf", "-inf", "1e400", "foo", "", "0x10", "1_0", "1,5"])
def test_what_is_no_finite_number_is_refused_and_named(cell: str) -> None:
    text = f'id;x\tx\ty\tz\nok\t1\t2\t3\nbad\t"{cell}"\t2\t3\nok\t1\t2\t3\n'.encode()
    stopped = flow(text, MOVE, "tsv")
    assert stopped.text.count(b"\n") == 2
    assert stopped.status == 1
    assert stopped.told[0].startswith("in:3:x: ")
    skipped = flow(text, MOVE._replace(on_error="skip"), "tsv")
    assert (skipped.text.count(b"\n"), skipped.status) == (3, 3)
    assert skipped.told[-1] == "in: 1 of 3 rows skipped"
    assert b"\nbad\t\t\t\n" in flow(text, MOVE._replace(on_error="null"), "tsv").text


@pytest.mark.parametrize("cell", ["-0.0", "5e-324", "1e308", "1e-308", "0.1", "123456789012345678"])
def test_extreme_numbers_keep_their_bits(cell: str) -> None:
    still = asked(left=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), moves=True)
    result = flow(f"x,y,z\n{cell},{cell},{cell}\n".encode(), still)
    assert [float(each) for each in result.text.splitlines()[1].split(b",")] == [float(cell)] * 3


def test_results_that_overflow_are_refused() -> None:
    result = flow(
        b"x,y,z\n1e308,1e308,0\n",
        asked(left=(1e308, 0.0, 0.0, 0.0, 0.0, -0.7071067811865476, 0.7071067811865476), moves=True),
    )
    assert (result.status, result.text) == (1, b"x,y,z\n")


def test_ragged_rows_are_told_with_their_counts() -> None:
    result = flow(b"id,x,y,z\na,1,2\nb,1,2,3,4\nc,1,2,3\n\n", MOVE._replace(on_error="null"))
    assert result.told[0] == "in:2: expected 4 cells (id x y z), found 3 (row skipped)"
    assert result.told[1] == "in:3: expected 4 cells (id x y z), found 5 (row skipped)"
    assert result.text == b"id,x,y,z\nc,-1.0,3.0,6.0\n\n"


def test_a_fault_after_a_quoted_line_end_has_the_right_line() -> None:
    assert flow(b'id,x,y,z\n"a\nb",1,2,3\nc,1,2,?\n', MOVE).told[0].startswith("in:4:z: ")


def test_trajectories_keep_comments_and_blank_lines() -> None:
    text = b"# t x y z qx qy qz qw\n1.50 1 2 3 0 0 0 1\n\n# more\n2 1 2 3 0 0 0 1\n"
    wanted = text.replace(b"0 0 0 1", b"0.0 0.0 0.0").replace(b"qx qy qz qw", b"roll pitch yaw")
    assert flow(text, convert("rpy"), "columns").text == wanted


def test_rows_with_too_few_numbers_are_told_in_their_words() -> None:
    told = flow(b"1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0\n", INVERT, "tum").told[0]
    assert told == "in:2: expected 8 cells (t x y z qx qy qz qw), found 7"


def test_rotations_that_are_none_are_refused_and_nearly_ones_are_told() -> None:
    assert "norm" in flow(b"qx,qy,qz,qw\n0,0,1,1\n", INVERT).told[0]
    with pytest.warns(match="in:2:qx: quaternion 0 0 0.0005 1.0005 has norm 1.0005"):
        assert flow(b"qx,qy,qz,qw\n0,0,0.0005,1.0005\n", INVERT).status == 0


def test_second_poses_come_from_the_same_row() -> None:
    header = ",".join(f"{side}.{name}" for side in "ab" for name in ("x", "y", "z", "qx", "qy", "qz", "qw"))
    result = flow(f"n,{header}\n7,0,0,0,0,0,0,1,3,4,0,0,0,0,1\n".encode(), asked(of="pair", poses=2))
    assert result.text == b"n,x,y,z,qx,qy,qz,qw,distance,angle,angle_deg\n7,3.0,4.0,0.0,0.0,0.0,0.0,1.0,5.0,0.0,0.0\n"


@pytest.mark.parametrize("size", [0, 30])
def test_consecutive_rows_are_compared_across_blocks_and_bad_rows(size: int) -> None:
    rows = b"".join(b"%d,0,0,0,0,0,1\n" % x if x != 4 else b"?,0,0,0,0,0,1\n" for x in (1, 2, 4, 7, 11))
    request = asked(of="previous", on_error="skip", precision=0)
    result = flow(b"x,y,z,qx,qy,qz,qw\n" + rows, request, size=size)
    assert [line.split(b",")[0] for line in result.text.splitlines()[1:]] == [b"0", b"1", b"5", b"4"]


@pytest.mark.parametrize("size", [0, 40])
def test_unwrapped_angles_never_jump(size: int) -> None:
    text = b"roll_deg,pitch_deg,yaw_deg\n" + b"".join(b"0,0,%d\n" % (turn * 100) for turn in range(-9, 20))
    result = flow(text, convert("rpy_deg").with_results(unwrap=True, precision=3), size=size)
    yaws = [float(line.split(b",")[2]) for line in result.text.splitlines()[1:]]
    assert {round(after - before) for before, after in pairwise(yaws)} == {100}


def test_each_row_may_name_its_frame() -> None:
    edges = {"a": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "b": (2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)}
    request = asked(moves=True, frames=("",), pose_from_frame=edges.__getitem__, rename=lambda _, name: ("map", name))
    result = flow(b"frame,x,y,z\na,0,0,0\nb,0,0,0\n", request)
    assert result.text == b"frame,x,y,z\nmap,1.0,0.0,0.0\nmap,2.0,0.0,0.0\n"


@pytest.mark.parametrize(
    "spec", ["rpy", "rpy_deg", "euler:rzyx", "axis_angle", "rotvec", "matrix", "wxyz", "mrp", "quaternion"]
)
def test_every_representation_goes_there_and_back(spec: str) -> None:
    text = b"qx,qy,qz,qw\n0.1,-0.2,0.3,0.9273618495495703\n0.5,0.5,-0.5,0.5\n"
    there = flow(text, convert(spec))
    back = flow(there.text, convert("quaternion").with_rows(given=convert(spec).results.notations[0]))
    for line, start in zip(back.text.splitlines()[1:], text.splitlines()[1:], strict=True):
        assert [float(cell) for cell in line.split(b",")] == pytest.approx(
            [float(cell) for cell in start.split(b",")], abs=1e-15
        )


def test_poses_as_whole_matrices_go_there_and_back() -> None:
    text = b"id,x,y,z,qx,qy,qz,qw\na,1.0,2.0,3.0,0.0,0.0,0.0,1.0\n"
    there = flow(text, convert("matrix"))
    assert there.text.splitlines()[0].startswith(b"id,m11,m12,")
    assert flow(there.text, convert("quaternion")).text == text


def test_fixed_decimals_are_those_of_percent_f() -> None:
    result = flow(b"x,y,z\n1.0000005,2.5,1e15\n", MOVE.with_results(precision=6))
    assert result.text.splitlines()[1] == b"%.6f,%.6f,%.6f" % (1.0 - 2.5, 2.0 + 1.0000005, 3.0 + 1e15)


def test_tables_without_header_are_read_by_position() -> None:
    request = MOVE.with_rows(columns=("2-4",))
    assert flow(b"a,0,0,0\nb,1,1,1\n", request, header=False).text == b"a,1.0,2.0,3.0\nb,0.0,3.0,4.0\n"
    assert "--no-header" in flow(b"1,2,3\n", MOVE).told[0]


@pytest.mark.parametrize("spec", ["rotvec", "rotvec_deg", "axis_angle_deg", "mrp"])
def test_columns_of_a_rotation_are_no_position(spec: str) -> None:
    text = b"id,x,y,z,qx,qy,qz,qw\n1,1,2,3,0.0,0.0,0.0,1.0\n"
    assert flow(flow(text, convert(spec)).text, convert("quaternion")).text == text
    alone = flow(b"qx,qy,qz,qw\n0,0,0.6,0.8\n", convert(spec)).text
    assert flow(alone, INVERT).text.splitlines()[0] == alone.splitlines()[0]


@pytest.mark.parametrize("on_error", ["stop", "skip", "null"])
@pytest.mark.parametrize(("lines", "size"), [(3, 0), (3, 9), (11_000, 20_000), (60_000, 20_000)])
def test_a_quote_that_is_never_closed_ends_the_run(on_error: str, lines: int, size: int) -> None:
    text = b'id,x,y,z,tag\n1,1,2,3,"a\nb"\n2,1,2,3,"a\n' + b"3,1,2,3,b\n" * lines
    result = flow(text, MOVE._replace(on_error=on_error), size=size)
    assert result.text == b'id,x,y,z,tag\n1,-1.0,3.0,6.0,"a\nb"\n'
    assert (result.status, result.told) == (1, ["in:4: a quote is opened here and not closed"])


def test_a_quote_that_opens_nothing_is_text() -> None:
    assert flow(b'id,x,y,z\n5",1,2,3\n6,1,2,3', MOVE).text == b'id,x,y,z\n5",-1.0,3.0,6.0\n6,-1.0,3.0,6.0'
    assert flow(b'"id,x,y,z\n5,1,2,3\n', MOVE).told == ["in:1: a quote is opened here and not closed"]


@pytest.mark.parametrize("first", [b"", b"7 "])
def test_sixteen_columns_are_a_matrix(first: bytes) -> None:
    given = convert("quaternion").with_rows(given=convert("matrix").results.notations[0])
    row = first + b"1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n"
    assert flow(row, given, "columns", header=False).text == first + b"1.0 2.0 3.0 0.0 0.0 0.0 1.0\n"


@pytest.mark.parametrize("size", [0, 20])
def test_semicolons_part_cells_as_commas_do(size: int) -> None:
    text = b'id;x;y;z;tag\n"a;\nb";1;2;3;x,y\nb;1,5;2;3;\n'
    result = flow(text, MOVE._replace(on_error="skip"), "semicolon", size=size)
    assert result.text == b'id;x;y;z;tag\n"a;\nb";-1.0;3.0;6.0;x,y\n'
    assert result.told[0].startswith("in:4:x: '1,5' has a decimal comma")


@pytest.mark.parametrize("row", [b"1,2", b"1,2,3,4", b"x,2,3"])
def test_no_consecutive_row_at_all_is_no_crash(row: bytes) -> None:
    result = flow(b"x,y,z\n" + row + b"\n", asked(of="previous", on_error="skip"))
    assert result.text == b"x,y,z,qx,qy,qz,qw,distance,angle,angle_deg\n"
    assert result.status == 3


def wide(columns: int, name: str) -> bytes:
    return f"{','.join(name.format(at) for at in range(columns))},x,y,z\n{'1,' * columns}1,2,3\n".encode()


@pytest.mark.parametrize(
    ("short", "long"),
    [
        pytest.param(wide(1000, "c{}"), wide(2000, "c{}"), id="columns"),
        pytest.param(wide(1000, "c"), wide(2000, "c"), id="repeated columns"),
        pytest.param(wide(1000, "p{}_x"), wide(2000, "p{}_x"), id="affixes"),
        *(
            pytest.param(b"x,y,z\n" + row * 500, b"x,y,z\n" + row * 1000, id=f"rows like {row.decode().strip()}")
            for row in (b"1,oops,3\n", b"1,2\n", b'1,2,"3\n4"\n', b"\n", b"1e308,1e308,1e308\n")
        ),
    ],
)
def test_the_work_grows_with_the_text_and_not_faster(short: bytes, long: bytes) -> None:
    request = MOVE._replace(on_error="skip")
    flow(short, request)
    assert calls(long, request) < 2.2 * calls(short, request)


@pytest.mark.parametrize("form", ["csv", "json", "yaml"])
def test_two_poses_a_row_keep_what_was_computed_beside_them_in_every_form(run: Any, form: str) -> None:
    rows = "a_x,a_y,a_z,a_qx,a_qy,a_qz,a_qw,b_x,b_y,b_z,b_qx,b_qy,b_qz,b_qw\n1,2,3,0,0,0,1,4,6,3,0,0,0,1\n"
    done = run("relative", "-f", form, stdin=rows)
    assert (done.status, "distance" in done.out, "5.0" in done.out) == (0, True, True), done.err
