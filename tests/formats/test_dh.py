"""Denavit-Hartenberg tables: both conventions against products of matrices, every way to write them, what is refused."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from frametool.errors import BadAnswer, FormatError, Unanswered
from frametool.formats.load import load
from frametool.formats.robots.dh import Amount, column_of

if TYPE_CHECKING:
    from pathlib import Path

    from frametool.geometry import Array

# theta, d, a, alpha of three joints
ROWS = ((0.3, 0.1, 0.05, pi / 2), (-0.7, 0.0, -0.4, 0.0), (1.1, 0.2, 0.03, -pi / 2))


def turn(axis: str, angle: float) -> Array:
    made = np.eye(4)
    one, two = {"x": (1, 2), "z": (0, 1)}[axis]
    made[one, one] = made[two, two] = cos(angle)
    made[two, one] = sin(angle)
    made[one, two] = -sin(angle)
    return made


def shift(axis: str, by: float) -> Array:
    made = np.eye(4)
    made["xyz".index(axis), 3] = by
    return made


def product(kind: str, rows: Any) -> Array:
    """Multiply elementary matrices as the two conventions are defined."""
    whole = np.eye(4)
    for theta, d, a, alpha in rows:
        along_z, along_x = turn("z", theta) @ shift("z", d), shift("x", a) @ turn("x", alpha)
        whole = whole @ (along_z @ along_x if kind == "standard" else along_x @ along_z)
    return whole


CSV = "joint,theta,d,a,alpha\n" + "".join(f"{n},{t!r},{d!r},{a!r},{p!r}\n" for n, (t, d, a, p) in enumerate(ROWS, 1))
WAYS = {
    "a.csv": CSV,
    "b.tsv": CSV.replace(",", "\t"),
    "c.csv": CSV.replace(",", ";"),
    "d.txt": "# i  alpha_i-1  a_(i-1)  theta_i  d_i\n" + "".join(f"{n} {p!r} {a!r} {t!r} {d!r}\n" for n, (t, d, a, p) in enumerate(ROWS, 1)),
    "e.csv": "θ_deg,d (mm),a [cm],alpha [deg]\n" + "".join(f"{np.degrees(t)!r},{d * 1000!r},{a * 100!r},{np.degrees(p)!r}\n" for t, d, a, p in ROWS).replace("np.float64(", "").replace(")", ""),
    "f.yaml": "dh_parameters:\n" + "".join(f"  - {{theta: {t!r}, d: {d!r}, a: {a!r}, alpha: {p!r}}}\n" for t, d, a, p in ROWS),
    "g.yaml": "robot:\n  joints:\n" + "".join(f"    j{n}: {{d: {d!r}, a: {a!r}, alpha: {p!r}, offset: {t!r}}}\n" for n, (t, d, a, p) in enumerate(ROWS)),
    "h.json": "[" + ", ".join(f'{{"theta": {t!r}, "d": {d!r}, "a": {a!r}, "alpha": {p!r}}}' for t, d, a, p in ROWS) + "]",
    "i.csv": "theta,d,a,alpha,offset\n0.3,0.1,0.05,pi/2,0\n0,0,-0.4,0,-0.7rad\n1,20cm,30mm,-90deg,0.1\n",
}


def read(folder: Path, text: str, name: str = "a.csv", **options: Any) -> Any:
    (folder / name).write_text(text)
    return load(folder / name, **options)


@pytest.mark.parametrize("kind", ["standard", "modified"])
@pytest.mark.parametrize("name", WAYS)
def test_a_table_is_the_product_of_its_rows_however_it_is_written(tmp_path: Path, name: str, kind: str) -> None:
    tree = read(tmp_path, WAYS[name], name, dh=kind)
    assert tree.frames == ("link0", "link1", "link2", "link3")
    assert tree.lookup("link0", "link3").as_matrix() == pytest.approx(product(kind, ROWS), abs=2e-15)


def test_the_two_conventions_differ() -> None:
    assert product("standard", ROWS) != pytest.approx(product("modified", ROWS), abs=0.01)


@pytest.mark.parametrize("name", WAYS)
def test_which_convention_is_always_asked(tmp_path: Path, name: str) -> None:
    with pytest.raises(Unanswered, match=r"give --dh standard \(.*\) or --dh modified"):
        read(tmp_path, WAYS[name], name)


SCARA = "theta,d,a,alpha_deg,type\nq1,0.4,0.25,0,R\nq2 - pi/2,0,0.2,180,R\n0,d3,0,0,P\n0.5,0.1,0,0,fixed\n"


@pytest.mark.parametrize("kind", ["standard", "modified"])
def test_joints_take_values_on_top_of_what_the_table_says(tmp_path: Path, kind: str) -> None:
    tree = read(tmp_path, SCARA, dh=kind, joints={"q1": "30deg", "q2": 0.2, "d3": "5cm"}, frames=("base", "one", "two"))
    rows = ((pi / 6, 0.4, 0.25, 0), (0.2 - pi / 2, 0, 0.2, pi), (0, 0.05, 0, 0), (0.5, 0.1, 0, 0))
    assert tree.frames == ("base", "one", "two", "link3", "link4")
    assert tree.lookup("base", "link4").as_matrix() == pytest.approx(product(kind, rows), abs=1e-15)


def test_quarter_turns_are_exact(tmp_path: Path) -> None:
    tree = read(tmp_path, "theta,d,a,alpha_deg\nq1,0,0,90\n", dh="standard", joints={"q1": "90deg"})
    assert np.array_equal(tree.lookup("link0", "link1").as_matrix()[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("written", "column"),
    [
        ("theta", ("theta", "")), ("theta_i", ("theta", "")), ("\u03b8 [deg]", ("theta", "deg")), ("alpha_{i-1}", ("alpha", "")),
        ("alpha_(i-1)_deg", ("alpha", "deg")), ("Alpha (rad)", ("alpha", "rad")), ("a_i-1", ("a", "")), ("a(m)", ("a", "m")),
        ("d_i [mm]", ("d", "mm")), ("r", ("a", "")), ("twist", ("alpha", "")), ("offset", ("offset", "")), ("i", ("name", "")),
        ("ai", ("a", "")), ("di", ("d", "")), ("mass", None), ("qmax", None),
    ],
)  # fmt: skip
def test_headers_have_many_names(written: str, column: tuple[str, str] | None) -> None:
    assert column_of(written) == column


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("theta,d,a,alpha\n0,x1y!,0,0\n", "a.csv:2:3: 'x1y!' is not a length"),
        ("theta,d,a,alpha\n0,0.1,nan,0\n", "a.csv:2:7: 'nan' is not finite"),
        ("theta,d,a,alpha\n0,0.1,0,b1\n", "a.csv:2:9: 'b1' is not a number; only theta or d vary"),
        ("theta,d,a,alpha\n0,0.1,0\n", "a.csv:2:1: expected 4 cells, found 3"),
        ("theta,a,alpha\n0,0.1,0\n", "a.csv:2:1: missing d; a row has theta, d, a, alpha"),
        ("theta,d,d,a,alpha\n0,0,0.1,0,1\n", "a.csv:2:5: two columns for d; keep one"),
        ("theta,d,a,alpha\n", "a.csv: a table without rows"),
        ("theta,d,a,alpha,type\n0,0,0,0,X\n", "a.csv:2:9: unknown type 'X'; known: revolute (R, 0), prismatic (P, 1), fixed"),
        ("theta,d,a,alpha,type\nq1,0,0,0,P\n", "a.csv:2:1: a prismatic joint with a variable theta"),
        ("theta,d,a,alpha\nq1,d1,0,0\n", "a.csv:2:1: a prismatic joint with a variable theta"),
        ("theta,d,a,alpha\nq1,0,0,0\nq1,0,0,0\n", "a.csv:3:1: two joints are called 'q1': rows 1 and 2"),
        ("- {theta: 0, d: 0, a: 1, alpha: 0}\n- {theta: 0, d: [1], a: 1, alpha: 0}\n", "a.csv:2:17: expected a number, found a list"),
        ("- {theta: 0, d: 0, a: 1, alpha: 0}\n- {theta: 0, d: O, a: 1, alpha: 0x}\n", "a.csv:2:33: '0x'"),
        ("frames: []\n", "no table in it"),
        ("- {theta: 0.1, theta_deg: 50, d: 1, a: 2, alpha: 0}\n", "a.csv:1:27: two columns for theta; keep one"),
        ("- {theta: 0.1, d: 1,5, a: 2, alpha: 0}\n", ": unknown column '5'; a row has theta, d, a, alpha, offset, type, name"),
        ("- {thta: 0.1, d: 1, a: 2, alpha: 0}\n", "a.csv:1:10: unknown column 'thta'; did you mean 'theta'?"),
        ("- {theta: , d: 1, a: 2, alpha: 0}\n", "a.csv:1:11: expected a number, found nothing"),
        ("- {d: 1, aa: 2, alpha: 0}\n- {d: 1, a: 2, alpha: 0}\n", "a.csv:1:3: missing a; a row has"),
        ("- {d: 1, a: 2, alpha: 0}\n- 5\n", "a.csv:2:3: expected a row {theta, d, a, alpha}, found '5'"),
        ("one: [{d: 1, a: 2, alpha: 0}]\ntwo: [{d: 1, a: 2, alpha: 0}]\n", "a.csv:1:1: 2 tables in it; keep one"),
        ("d: [1, 2]\na: [1, 2]\nalpha: [0, 0]\n", "no table in it: expected a list of {theta, d, a, alpha}, or a map of them"),
        ("- {theta: 0, d: 90deg, a: 2, alpha: 0}\n", "a.csv:1:17: '90deg' is not a length"),
        ("- {theta: 0, d: 1, a: 2, alpha: 2cm}\n", "a.csv:1:33: '2cm' is not an angle"),
        ("thta,d,a,alpha\n0,1,2,3\n", "a.csv:2:1: unknown column 'thta'; did you mean 'theta'?"),
        ("theta,d,a,alpha\n0,null,1,0\n", "a.csv:2:3: 'null' is empty where a number is expected"),
        ("- {theta: true, d: 0, a: 1, alpha: 0}\n", "a.csv:1:11: 'true' is a truth value where a number is expected"),
        ("theta,d,a,alpha\n,1,2,3\n", "a.csv:2:1: '' is empty where a number is expected"),
    ],
)
def test_what_is_wrong_is_one_placed_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, dh="standard", format="dh")
    assert said in str(caught.value)


def test_bare_angles_beyond_a_turn_are_told(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"a.csv:2: alpha 90 is more than a full turn in radians; degrees\? write alpha_deg"):
        read(tmp_path, "theta,d,a,alpha\n0,0,0,90\n", dh="standard")


@pytest.mark.parametrize("text", ["theta,d,a,alpha,qmin\n0,1,2,3,-3\n", "- {theta: 0, d: 1, a: 2, alpha: 3, qmin: -3}\n"])
def test_what_is_about_something_else_is_told_by_its_name(tmp_path: Path, text: str) -> None:
    with pytest.warns(UserWarning, match=r"a.csv:1: left out, about something else: qmin"):
        read(tmp_path, text, dh="standard")


def test_a_joint_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadAnswer, match="'q9'"):
        read(tmp_path, SCARA, dh="standard", joints={"q9": 1.0})


def test_degrees_and_radians_of_one_angle_are_added() -> None:
    total = Amount(90.0, degrees=True).plus(Amount(0.25))
    assert (total.degrees, total.number) == (False, pi / 2 + 0.25)
    assert Amount(0.25).plus(Amount(90.0, degrees=True)).number == pi / 2 + 0.25
