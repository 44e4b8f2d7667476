"""What the names of columns say: units, poses in the plane, halves of rotations, and headers behind a `#`."""

from __future__ import annotations

import pytest
from flow import INVERT, MOVE, Asked, asked, calls, convert, flow

from frametool.geometry.representations import ROTATIONS

STEP = asked(left=(1.0, 0.0, 0.0, 0.0, 0.0, 0.7071067811865476, 0.7071067811865476))
UP = asked(left=(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))
SHIFT = asked(left=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


def numbers(row: bytes, delimiter: bytes = b",") -> list[float]:
    return [float(each) for each in row.split(delimiter)]


@pytest.mark.parametrize(
    ("header", "row", "wanted"),
    [
        ("x,y,z,roll_deg,pitch_deg,yaw_deg", "1,0,0,0,0,90", [0, 1, 0, 0, 0, -90]),
        ("x [mm],y [mm],z [mm],roll [deg],pitch [deg],yaw [deg]", "1000,0,0,0,0,90", [0, 1000, 0, 0, 0, -90]),
        ("x(mm),y(mm),z(mm),roll(deg),pitch(deg),yaw(deg)", "1000,0,0,0,0,90", [0, 1000, 0, 0, 0, -90]),
        ("x_mm,y (m),z [cm],roll[rad],pitch_rad,yaw (deg)", "1000,2,50,0,0,90", [-2000, 1, -50, 0, 0, -90]),
        ("X_mm,Y_mm,Z_mm,yaw", "1000,0,0,0", [-1000, 0, 0, 0]),
        ("p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []", "1,2,3,1,0,0,0", [-1, -2, -3, 1, 0, 0, 0]),
        ("a.x_mm,a.y_mm,a.z_mm", "1,2,3", [-1, -2, -3]),
    ],
)
def test_each_column_counts_in_the_unit_its_name_says(header: str, row: str, wanted: list[float]) -> None:
    result = flow(f"{header}\n{row}\n".encode(), INVERT).text.splitlines()
    assert result[0] == header.encode()
    assert numbers(result[1]) == wanted


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ("x [inch],y [inch],z [inch],yaw", "column 'x [inch]': unknown unit 'inch' of a length; known are m, cm, mm, um"),
        ("x_ft,y_ft,z_ft,yaw", "column 'x_ft': unknown unit 'ft' of a length"),
        ("x,y,z,yaw [grad]", "column 'yaw [grad]': unknown unit 'grad' of an angle; known are deg, rad"),
        ("x,y,z,roll,pitch (turns),yaw", "column 'pitch (turns)': unknown unit 'turns'"),
        ("x,y,z,qx [deg],qy,qz,qw", "column 'qx [deg]': unknown unit 'deg' of a number that has none"),
    ],
)
def test_an_unknown_unit_is_refused_where_the_column_is_used(header: str, told: str) -> None:
    result = flow(f"{header}\n{','.join('0' * (header.count(',') + 1))}\n".encode(), INVERT)
    assert (result.status, result.text) == (1, b"")
    assert result.told[0].startswith(f"in:1: {told}")


def test_units_of_columns_that_are_not_ours_are_nobody_s_business() -> None:
    text = b"temperature [K],x,y,z,yaw_rate [deg/s]\n3,1,2,3,4\n"
    assert flow(text, MOVE).text == b"temperature [K],x,y,z,yaw_rate [deg/s]\n3,-1.0,3.0,6.0,4\n"


@pytest.mark.parametrize("name", ["yaw", "theta", "yaw_deg", "Theta [deg]"])
def test_a_turn_about_z_alone_makes_a_pose_in_the_plane(name: str) -> None:
    turn = "90" if "deg" in name else "1.5707963267948966"
    text = f"id,x,y,{name}\na,1,2,0\nb,0,0,{turn}\n".encode()
    moved = flow(text, STEP).text.splitlines()
    assert moved[0] == text.splitlines()[0]
    assert numbers(moved[1][2:]) == [-1.0, 1.0, float(turn)]
    assert flow(flow(text, INVERT).text, INVERT).text.splitlines()[1] == b"a,1.0,2.0,0.0"


def test_a_result_that_leaves_the_plane_is_a_bad_row_that_says_what_to_do() -> None:
    text = b"x,y,yaw\n1,2,0\n"
    result = flow(text, UP._replace(on_error="skip"))
    assert result.told[0] == "in:2: the result leaves the plane: z is 1 and has no column; give --to rpy (row skipped)"
    assert flow(text, UP.with_results(notations=convert("rpy").results.notations)).text == (
        b"x,y,z,roll,pitch,yaw\n1.0,2.0,1.0,0.0,0.0,0.0\n"
    )
    assert flow(b"x,y,z,yaw\n1,2,0,0\n", UP).text == b"x,y,z,yaw\n1.0,2.0,1.0,0.0\n"
    assert flow(b"x,y,z,yaw\n1,2,0,0\n", asked(right=((0, 0, 0, 0.6, 0, 0, 0.8),))).status == 1


def test_a_pose_in_the_plane_stays_one_under_a_prefix() -> None:
    assert flow(b"x,y,yaw,id\n1,2,0,a\n", STEP.with_results(prefix="n_")).text == (
        b"n_x,n_y,n_yaw,id\n-1.0,1.0,1.5707963267948966,a\n"
    )


def test_a_turn_in_two_units_is_no_one_turn() -> None:
    assert "found yaw_rad; yaw_deg; choose with --columns" in flow(b"x,y,yaw_rad,yaw_deg\n1,2,0,0\n", INVERT).told[0]


def test_letters_of_a_wrench_are_no_wrench_unless_it_is_asked_for() -> None:
    pose = b"tx,ty,tz,qx,qy,qz,qw,fx,fy,fz\n1,2,3,0,0,0,1,4,5,6\n"
    assert flow(pose, SHIFT).text == pose.replace(b"\n1,2,3,0,0,0,1", b"\n2.0,2.0,3.0,0.0,0.0,0.0,1.0")


def test_converting_a_pose_in_the_plane_adds_its_height() -> None:
    assert flow(b"x,y,yaw,id\n1.50,2,0,a\n", convert("quaternion")).text == (
        b"x,y,z,qx,qy,qz,qw,id\n1.50,2,0.0,0.0,0.0,0.0,1.0,a\n"
    )


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ("x,y,z,qx,qy,qz", "half a rotation: qx qy qz without qw"),
        ("x,y,z,roll_deg,pitch_deg", "half a rotation: roll_deg pitch_deg without yaw"),
        ("x,y,z,roll", "half a rotation: roll without pitch, yaw"),
        ("x,y,z,a.roll,a.yaw", "half a rotation: a.roll a.yaw without a.pitch"),
        ("x,y,z,ox,oy,oz,ow", "no qx, qy, qz, qw: ox oy oz ow look like a quaternion under other names"),
        ("x,y,z,q0,q1,q2,q3", "no qx, qy, qz, qw: q0 q1 q2 q3 look like a quaternion under other names"),
        ("x,y,z,euler_1,euler_2,euler_3", "columns euler_1 euler_2 euler_3 may be euler; then add --from euler:AXES"),
        ("x,y,z,phi,theta,psi", "phi, theta, psi: name them roll, pitch, yaw"),
        ("x,y,z,Phi [deg],Theta [deg],Psi [deg]", "phi, theta, psi: name them roll, pitch, yaw"),
        ("x,y,qx,qy,qz,qw", "half a position: x y without z"),
    ],
)
@pytest.mark.parametrize("request_", [MOVE, SHIFT, INVERT])
def test_half_a_rotation_is_an_error_that_names_what_is_missing(header: str, told: str, request_: Asked) -> None:
    result = flow(f"{header}\n{','.join('0' * (header.count(',') + 1))}\n".encode(), request_)
    assert (result.status, result.text) == (1, b"")
    assert result.told[0].startswith(f"in:1: {told}")


def test_x_y_z_w_are_a_quaternion_alone_and_refused_beside_others() -> None:
    assert flow(b"x,y,z,w\n0,0,0.6,0.8\n", INVERT).text == b"x,y,z,w\n0.0,0.0,-0.6,0.8\n"
    beside = b"id,x,y,z,w\n1,0,0,0.6,0.8\n"
    assert "x y z w may be a quaternion or a point and a number" in flow(beside, MOVE).told[0]
    assert flow(beside, MOVE.with_rows(columns=("x,y,z",))).text == b"id,x,y,z,w\n1,1.0,2.0,3.6,0.8\n"
    assert flow(beside, INVERT.with_rows(given=convert("xyzw").results.notations[0])).text == b"id,x,y,z,w\n1,0.0,0.0,-0.6,0.8\n"


def test_halves_do_no_harm_beside_a_whole_rotation_or_a_choice() -> None:
    whole = b"x,y,z,qx,qy,qz,qw,roll,pitch\n1,2,3,0,0,0,1,9,9\n"
    assert flow(whole, SHIFT).text.splitlines()[1] == b"2.0,2.0,3.0,0.0,0.0,0.0,1.0,9,9"
    chosen = MOVE.with_rows(columns=("x,y,z",))
    assert flow(b"x,y,z,qx,qy,qz\n1,2,3,4,5,6\n", chosen).text.splitlines()[1] == b"-1.0,3.0,6.0,4,5,6"


@pytest.mark.parametrize(
    ("row", "spec", "wanted"),
    [
        (b"7 1 2 3 1 0 0 0", "wxyz", b"7 1 2 3 0.0 0.0 0.0"),
        (b"1 2 3 1 0 0 0", "wxyz", b"1 2 3 0.0 0.0 0.0"),
        (b"1 0 0 0", "wxyz", b"0.0 0.0 0.0"),
        (b"7 1 2 3 0 0 0 1", "xyzw", b"7 1 2 3 0.0 0.0 0.0"),
        (b"7 1 2 3 0 0 0", "rotvec", b"7 1 2 3 0.0 0.0 0.0"),
        (b"7 1 2 3 0 0 0 1", "", b"7 1 2 3 0.0 0.0 0.0"),
    ],
)
@pytest.mark.parametrize("form", ["columns", "csv"])
def test_numbers_without_names_are_what_from_says(row: bytes, spec: str, wanted: bytes, form: str) -> None:
    given = convert("rpy").with_rows(given=convert(spec).results.notations[0] if spec else None)
    between = b"," if form == "csv" else b" "
    result = flow(row.replace(b" ", between) + b"\n", given, form, header=form != "csv")
    assert result.text == wanted.replace(b" ", between) + b"\n", result.told


def test_columns_are_chosen_by_number_where_they_have_no_names() -> None:
    chosen = convert("rpy").with_rows(given=convert("wxyz").results.notations[0], columns=("5,6,7,8",))
    assert flow(b"7 1 2 3 1 0 0 0\n", chosen, "columns").text == b"7 1 2 3 0.0 0.0 0.0\n"


@pytest.mark.parametrize("request_", [INVERT, MOVE, convert("rpy")])
def test_seven_numbers_do_not_say_what_they_are(request_: Asked) -> None:
    result = flow(b"1 2 3 0 0 0 1\n", request_, "columns")
    assert result.told == ["in:1: 7 columns without names do not say what they are; give --from REP, or --columns"]


@pytest.mark.parametrize(
    ("header", "after"),
    [
        (b"# t tx ty tz qx qy qz qw", b"# t tx ty tz roll pitch yaw"),
        (b"#t x y z qw qx qy qz", b"#t x y z roll pitch yaw"),
        (b"# made elsewhere\n\n#  stamp   x y z q_x q_y q_z q_w", b"# made elsewhere\n\n#  stamp x y z q_roll q_pitch q_yaw"),
    ],
)
def test_a_comment_that_names_the_columns_is_the_header(header: bytes, after: bytes) -> None:
    order = b"1 0 0 0" if b"qw qx" in header else b"0 0 0 1"
    text = header + b"\n7 1 2 3 " + order + b"\n"
    assert flow(text, convert("rpy"), "columns").text == after + b"\n7 1 2 3 0.0 0.0 0.0\n"
    assert flow(text, INVERT, "columns").text.startswith(header + b"\n7 -1.0 -2.0 -3.0 ")


@pytest.mark.parametrize("comment", [b"# t x y z qx qy qz", b"# just some eight words that are no header", b"# t x y z"])
def test_other_comments_are_none(comment: bytes) -> None:
    text = comment + b"\n7 1 2 3 0 0 0 1\n"
    assert flow(text, convert("rpy"), "columns").text == comment + b"\n7 1 2 3 0.0 0.0 0.0\n"


def test_a_comment_names_the_columns_of_a_csv_too() -> None:
    assert flow(b"#x,y,z\n1,2,3\n", MOVE).text == b"#x,y,z\n-1.0,3.0,6.0\n"
    assert flow(b"# from the lab\nid,x,y,z\na,1,2,3\n", MOVE).text == b"# from the lab\nid,x,y,z\na,-1.0,3.0,6.0\n"


def test_a_quote_within_a_name_opens_nothing_and_loses_no_row() -> None:
    result = flow(b'id,size",x,y,z\na,5",1,2,3\nb,6,1,2,3\n', MOVE)
    assert result.text == b'id,size",x,y,z\na,5",-1.0,3.0,6.0\nb,6,-1.0,3.0,6.0\n'


@pytest.mark.parametrize("size", [0, 20])
def test_names_that_stand_twice_matter_only_where_they_are_used(size: int) -> None:
    assert flow(b"tag,x,y,z,tag\na,1,2,3,b\n", MOVE, size=size).text == b"tag,x,y,z,tag\na,-1.0,3.0,6.0,b\n"
    assert "column x appears twice" in flow(b"x,y,z,x\n1,2,3,4\n", MOVE, size=size).told[0]


def test_an_angle_that_stands_twice_is_the_one_beside_its_axis() -> None:
    text = b"axis_x,axis_y,axis_z,angle\n0,0,1,1\n0,0,1,2\n"
    result = flow(text, asked(of="previous"))
    assert result.text.splitlines()[0] == b"axis_x,axis_y,axis_z,angle,distance,angle_deg"
    assert flow(result.text, INVERT).status == 0


@pytest.mark.parametrize("name", [name for name, row in ROTATIONS.items() if row.searched])
def test_the_work_on_a_header_grows_with_its_width(name: str) -> None:
    columns = [f"a{at}.{column}" for at in range(200) for column in ROTATIONS[name].columns]
    short, long = ((",".join(f"{at}.{each}" for at, each in enumerate(names)) + "\n").encode() for names in (columns, columns * 2))
    flow(short, INVERT)
    assert calls(long, INVERT) < 2.2 * calls(short, INVERT)
