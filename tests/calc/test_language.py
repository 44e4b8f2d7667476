"""Expressions: what they are worth, by SciPy; which frames they have; what is refused, in which words."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import independent as by
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import frametool
from frametool.calc.evaluate import Scope, evaluate_line, read_line
from frametool.calc.functions import FUNCTIONS, TREE, Term, Type
from frametool.errors import FrametoolError

if TYPE_CHECKING:
    from collections.abc import Callable

ROBOT, DRIVE = frametool.load(by.EXAMPLES / "robot.yaml"), frametool.load(by.EXAMPLES / "drive.yaml")
EDGES = by.robot()
PI = np.pi


def scope() -> Scope:
    return Scope(tree=ROBOT, names={"d": Term(Type(TREE), (), tree=DRIVE, text="d")})


def look(target: str, source: str) -> Any:
    return by.looked_up(EDGES, target, source)


def moved(matrix: Any, *point: float) -> Any:
    return (matrix @ [*point, 1.0])[:3]


def numbers(term: Term) -> Any:
    if term.type.kind == "pose":
        return frametool.Transform.of(*term.at(None)).as_matrix()
    return np.array(term.at(None))


GOAL = "goal = (map<-base_link) * {xyz: [1, 0, 0]} as base_link<-goal"

# expression, numbers by SciPy (a matrix for a pose), what it is with its frames
WORTH: list[tuple[str, Any, str]] = [
    ("inv(map<-base_link) * (map<-tool)", look("base_link", "tool"), "the pose base_link<-tool"),
    ("base_link<-tool", look("base_link", "tool"), "the pose base_link<-tool"),
    ("(map<-camera_optical) * [0, 0, 1.5]", moved(look("map", "camera_optical"), 0, 0, 1.5), "a point in 'map'"),
    ("(map<-camera_optical) * ([0, 0, 1.5] in camera_optical)", moved(look("map", "camera_optical"), 0, 0, 1.5), "a point in 'map'"),
    ("(map<-lidar) * vector([1, 0, 0])", look("map", "lidar")[:3, 0], "a vector in 'map'"),
    ("dist(map<-tool, map<-lidar)", np.linalg.norm(look("map", "tool")[:3, 3] - look("map", "lidar")[:3, 3]), "a number in m"),
    ("angle(map<-tool, map<-lidar)", by.angle(look("tool", "lidar")), "a number in rad"),
    ("angle(base_link<-camera_optical)", by.angle(look("base_link", "camera_optical")), "a number in rad"),
    ("norm(trans(base_link<-tool))", np.linalg.norm(look("base_link", "tool")[:3, 3]), "a number in m"),
    ("trans(map<-tool) - trans(map<-base_link)", look("map", "tool")[:3, 3] - look("map", "base_link")[:3, 3], "a vector in 'map'"),
    ("(base_link<-tool) * {xyz: [0, 0, 0.12], rpy_deg: [0, 90, 0]} as tool<-grasp",
     look("base_link", "tool") @ by.pose([0, 0, 0.12], rpy_deg=[0, 90, 0]), "the pose base_link<-grasp"),
    ("interp({xyz: [0, 0, 0]}, {xyz: [2, 0, 0], rpy_deg: [0, 0, 90]}, 0.25)", by.pose([0.5, 0, 0], rpy_deg=[0, 0, 22.5]), "the pose ?<-?"),
    ("{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}^0.5",
     by.exponential(0.5 * by.logarithm(by.pose([1, 2, 3], rpy_deg=[0, 0, 90]))), "the pose ?<-?"),
    ("log({xyz: [1, 2, 3], rpy_deg: [10, 20, 30]})", by.logarithm(by.pose([1, 2, 3], rpy_deg=[10, 20, 30])), "a twist"),
    ("exp([0.1, 0, 0, 0, 0, pi/2])", by.exponential([0.1, 0, 0, 0, 0, PI / 2]), "the pose ?<-?"),
    ("exp(log(map<-tool)) as map<-tool", look("map", "tool"), "the pose map<-tool"),
    ("rpy(rot(map<-lidar))", Rotation.from_matrix(look("map", "lidar")[:3, :3]).as_euler("xyz"), "angles in 'map'"),
    ("mean({rpy_deg: [0, 0, 10]}, {rpy_deg: [0, 0, 30]}, {xyz: [3, 0, 0], rpy_deg: [0, 0, 20]})",
     by.pose([1, 0, 0], rpy_deg=[0, 0, 20]), "the pose ?<-?"),
    ("2 * (atan(1) - 30deg)", PI / 6, "a number in rad"),
    ("cross([1, 0, 0], [0, 1, 0])", [0, 0, 1], "a vector"),
    ("norm([3, 4, 0]) + 250mm", 5.25, "a number in m"),
    (GOAL, look("map", "base_link") @ by.pose([1, 0, 0]), "the pose map<-goal"),
    (f"{GOAL};inv(goal) * (map<-tool)", by.inverse(look("map", "base_link") @ by.pose([1, 0, 0])) @ look("map", "tool"), "the pose goal<-tool"),
    ("d[map<-lidar @ 0.5s]", by.drive_lidar(0.5), "the pose map<-lidar"),
    # beyond the design's own
    ("d[map<-lidar @ 3250ms]", by.drive_lidar(3.25), "the pose map<-lidar"),
    ("inv(d[map<-lidar @ 0.5s]) * d[map<-lidar @ 1500000000ns]", by.inverse(by.drive_lidar(0.5)) @ by.drive_lidar(1.5), "the pose lidar<-lidar"),
    ("(map<-tool)^-1", by.inverse(look("map", "tool")), "the pose tool<-map"),
    ("(map<-tool)^(2-1)", look("map", "tool"), "the pose map<-tool"),
    ("(map<-tool)^0.3", by.exponential(0.3 * by.logarithm(look("map", "tool"))), "the pose map<-?"),
    ("interp(map<-tool, map<-lidar * lidar<-tool, 0.75)", look("map", "tool"), "the pose map<-tool"),
    ("interp({rpy: [0.1, 0.2, 0.3]}, {xyz: [1, 2, 3], rpy: [1, -0.4, 2]}, 1.5)",
     by.interpolated(by.pose(rpy=[0.1, 0.2, 0.3]), by.pose([1, 2, 3], rpy=[1, -0.4, 2]), 1.5), "the pose ?<-?"),
    ("mean(map<-tool, {xyz: [1, 2, 3], rotvec: [0.1, 0.2, 2]} as map<-tool)",
     by.mean(look("map", "tool"), by.pose([1, 2, 3], rotvec=[0.1, 0.2, 2])), "the pose map<-tool"),
    ("mean([{xyz: [1, 0, 0]}, {xyz: [0, 1, 0]}, {xyz: [0, 0, 1], rpy: [0, 0, 0.3]}])",
     by.mean(by.pose([1, 0, 0]), by.pose([0, 1, 0]), by.pose([0, 0, 1], rpy=[0, 0, 0.3])), "the pose ?<-?"),
    ("mean([1, 2, 3], [3, 2, 1])", [2, 2, 2], "a point"),
    ("mean(1m, 3m)", 2.0, "a number in m"),
    ("angle(vector([1, 0, 0]), vector([1, 1e-9, 0]))", np.arctan2(1e-9, 1), "a number in rad"),
    ("angle((map<-tool) * vector([0, 0, 1]), [0, 0, 1] in map)", np.arccos(look("map", "tool")[2, 2]), "a number in rad"),
    ("dot((map<-tool) * vector([0, 0, 1]), vector([0, 0, 1]))", look("map", "tool")[2, 2], "a number"),
    ("dist(trans(map<-tool), [14, -2, 1] in map)", np.linalg.norm(look("map", "tool")[:3, 3] - [14, -2, 1]), "a number in m"),
    ("([1, 2, 3] in map) + vector([1, 0, 0])", [2, 2, 3], "a point in 'map'"),
    ("2 * vector([1, 2, 3]) / 4 - vector([0, 0, 1])", [0.5, 1, 0.5], "a vector"),
    ("-2^2 + 2^3^2/2 - --1", 251.0, "a number"),
    ("1km - 2 * 3cm + 4mm", 999.944, "a number in m"),
    ("1.5s + 20ms - 3us + 4ns", 1.519997004, "a number in s"),
    ("sqrt((3m / 1m) ^ 2 + 4 ^ 2) * 1m", 5.0, "a number in m"),
    ("sin(30deg) + cos(pi/3) + tan(45deg)", 2.0, "a number"),
    ("asin(0.5) + acos(0.5)", PI / 2, "a number in rad"),
    ("atan(-1e300)", -PI / 2, "a number in rad"),
    ("exp([0.1m, 0, 0, 0, 0, 90deg])", by.exponential([0.1, 0, 0, 0, 0, PI / 2]), "the pose ?<-?"),
    ("log(map<-lidar)", by.logarithm(look("map", "lidar")), "a twist in 'map'"),
    ("{name: tool, parent: wrist, xyz: [1, 2, 3], inverse: true}", by.pose([-1, -2, -3]), "the pose wrist<-tool"),
    ('{"frame": "lidar", "point": [1, 2, 3]} in lidar', [1, 2, 3], "a point in 'lidar'"),
    ('{xyz: [1, 2, 3]} as "my base"<-cam-0:x/y.z', by.pose([1, 2, 3]), 'the pose "my base"<-cam-0:x/y.z'),
    ("{xyz: [1, 2, 3], quaternion: {x: 0, y: 0, z: 0.6, w: 0.8}}", by.pose([1, 2, 3], quaternion=[0, 0, 0.6, 0.8]), "the pose ?<-?"),
    ("map<-tool @ latest", look("map", "tool"), "the pose map<-tool"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected", "what"), WORTH, ids=[row[0] for row in WORTH])
def test_an_expression_is_worth_what_scipy_says_and_knows_its_frames(text: str, expected: Any, what: str) -> None:
    here = scope()
    terms = [evaluate_line(read_line(line), here) for line in text.split(";")]
    found, expected = numbers(terms[-1]), np.asarray(expected, float).reshape(np.shape(numbers(terms[-1])))
    assert np.abs(found - expected).max() <= 1e-12 * max(1.0, np.abs(expected).max())
    assert terms[-1].type.named == what


@pytest.mark.parametrize(("text", "expected"), [
    ("sin(90deg)", 1.0), ("cos(90deg)", 0.0), ("sin(180deg)", 0.0), ("cos(60deg + 30deg)", 0.0), ("sin(2 * 45deg)", 1.0), ("cos(-450deg)", 0.0),
    ("angle({rpy_deg: [0, 0, 90]}) / 90deg", 1.0), ("100mm / 1m", 0.1),
])  # fmt: skip
def test_right_angles_in_degrees_and_decimal_lengths_are_exact(text: str, expected: float) -> None:
    assert frametool.calc(text) == expected


# the whole text: the sentence, the expression, the caret
REFUSED = """
frametool: map<-base_link * map<-tool: 'base_link' and 'map' do not touch
  (map<-base_link) * (map<-tool)
                   ^
frametool: base_link<-tool * map<-tool: 'tool' and 'map' do not touch
  (base_link<-tool) * (map<-tool)
                    ^
frametool: lidar<-imu_link * tool<-base_link: 'imu_link' and 'tool' do not touch
  (lidar<-imu_link) * (tool<-base_link)
                    ^
frametool: mean(map<-base_link, map<-tool): 'base_link' and 'tool' must be one frame
  mean(map<-base_link, map<-tool)
  ^
frametool: dist(map<-tool, tool<-base_link): 'map' and 'tool' must be one frame
  dist(map<-tool, tool<-base_link)
  ^
frametool: dist(map<-tool, base_link<-lidar): 'map' and 'base_link' must be one frame
  dist(map<-tool, base_link<-lidar)
  ^
frametool: map<-lidar * a point in 'camera_optical': 'lidar' and 'camera_optical' do not touch
  (map<-lidar) * ([1, 2, 3] in camera_optical)
               ^
frametool: map<-lidar * a point in 'map': 'lidar' and 'map' do not touch
  (map<-lidar) * trans(map<-tool)
               ^
frametool: cannot multiply a point by the pose map<-lidar
  [1, 2, 3] * (map<-lidar)
            ^
frametool: cannot subtract the pose map<-tool and the pose map<-lidar
  (map<-tool) - (map<-lidar)
              ^
frametool: cannot multiply a number by the pose map<-tool
  2 * (map<-tool)
    ^
frametool: cannot negate the pose map<-tool
  -(map<-tool)
  ^
frametool: unknown name 'map'; a frame is asked for as TARGET<-SOURCE
  map
  ^
frametool: cannot make a point (3 lengths) or twist (lengths, angles) of 4 numbers; rotations: {rpy_deg: [..]}
  [0, 0, 0, 1]
  ^
frametool: cannot add a number in m and a number in rad
  1m + 90deg
     ^
frametool: unexpected 'm'; write a unit directly after its number: 1m
  1 m
    ^
frametool: expected ')' here
  (map<-tool
            ^
frametool: inv() takes a pose, found the pose map<-tool, a number
  inv(map<-tool, 1)
  ^
frametool: unknown function 'iv'; did you mean 'inv'?
  iv(map<-tool)
  ^
frametool: expected 3 numbers (roll pitch yaw), found 2
  {rpy: [1, 2]}
  ^
frametool: unexpected '('
  (map<-tool) (tool<-lidar)
              ^
frametool: d is a tree; ask it: d[TARGET<-SOURCE]
  d * 2
  ^
frametool: interp(map<-tool, map<-lidar, a number): 'tool' and 'lidar' must be one frame
  interp(map<-tool, map<-lidar, 0.5)
  ^
frametool: this is map<-tool already
  (map<-tool) as map<-cam
              ^
frametool: no data for map -> base_link at 99.000000000; samples cover 0.000000000 .. 4.000000000 (95 s too late), on the path map <- base_link <- lidar
  d[map<-lidar @ 99s]
    ^
frametool: 'inv' has a meaning of its own and cannot be bound; take another name
  inv = 3
  ^
frametool: '1e999' is not finite
  1 + 1e999
      ^
frametool: division by zero
  1 / (2 - 2)
    ^
frametool: vector 0 0 0 has no direction; the angle to it is not defined
  angle([0, 0, 0], [1, 0, 0])
  ^
frametool: quaternion 0 0 0 0 has no direction; give a non-zero one
  inv({xyzw: [0, 0, 0, 0]})
      ^
frametool: unknown unit 'foo'; units: m mm cm km rad deg s ms us ns
  12foo
  ^
frametool: unknown unit 'pi'; units: m mm cm km rad deg s ms us ns
  2pi
  ^
frametool: something is missing here
  1 +
     ^
frametool: sin() takes an angle, found a number in m
  sin(1m)
  ^
frametool: cannot add a point in 'map' and a point in 'map'
  trans(map<-tool) + trans(map<-lidar)
                   ^
frametool: cannot multiply a number in m by a number in m
  3m * 3m
     ^
frametool: cannot divide a number in m by a number in s
  10m / 4s
      ^
frametool: cannot raise a number in m to a number: a power is that of a pose or a plain number, an exponent a plain number
  3m ^ 2
     ^
frametool: sqrt() takes a plain number, found a number in m
  sqrt(4m)
  ^
frametool: cannot raise a number to a number in m: a power is that of a pose or a plain number, an exponent a plain number
  2 ^ 1m
    ^
frametool: expected a time with its unit, 2.5s or 2500000000ns, or latest or row, found '3'
  map<-tool @ 3
              ^
frametool: row is known in streams only: -i FILE, or standard input
  dist(row, map<-tool)
       ^
frametool: .. in FRAME names the frame of a point or vector, .. as TARGET<-SOURCE the two of a pose; found the pose map<-lidar
  (map<-lidar) in map
               ^
frametool: .. in FRAME names the frame of a point or vector, .. as TARGET<-SOURCE the two of a pose; found a point
  [1, 2, 3] as a<-b
            ^
frametool: a { is not closed
  inv({xyz: [1, 2, 3]
      ^
""".strip().split("\n")  # fmt: skip
TEXTS = [REFUSED[at : at + 3] for at in range(0, len(REFUSED), 3)]


@pytest.mark.parametrize(("sentence", "text", "caret"), TEXTS, ids=[row[1].strip() for row in TEXTS])
def test_what_does_not_fit_is_refused_with_its_place(sentence: str, text: str, caret: str) -> None:
    with pytest.raises(FrametoolError) as caught:
        evaluate_line(read_line(text[2:]), scope())
    assert f"frametool: {caught.value}" == sentence
    assert getattr(caught.value, "snippet", "") == f"{text}\n{caret}"


@pytest.mark.parametrize(("text", "hint"), [
    ("base_link<-lidr", "unknown frame 'lidr' in ROBOT; did you mean 'lidar'? frames: lidar, arm_base_link"),
    ("dst(map<-tool, map<-lidar)", "did you mean 'dist'?"),
    ("x = 2;gaol = 3;goal * 2", "unknown name 'goal'; did you mean 'gaol'?"),
    ("e[map<-tool]", "unknown name 'e'"),
    ("d[map<-lidr]", "did you mean 'lidar'?"),
    ("map tool", "unexpected 'tool'"),
    ("3 * deg", "unknown name 'deg'; write a unit directly after its number: 1deg"),
    ("inv", "inv is a function: inv(..) takes a pose"),
])  # fmt: skip
def test_a_mistake_names_what_was_meant(text: str, hint: str) -> None:
    here = scope()
    *lines, wrong = text.split(";")
    for line in lines:
        evaluate_line(read_line(line), here)
    with pytest.raises(FrametoolError) as caught:
        evaluate_line(read_line(wrong), here)
    assert hint.replace("ROBOT", str(by.EXAMPLES / "robot.yaml")) in str(caught.value)


@pytest.mark.parametrize("text", [
    "map<-tool", "inv(map<-tool) * (map<-lidar)", "(map<-lidar) * [1, 2, 3]", "(map<-lidar) * vector([1, 2, 3])", "log(map<-tool)", "exp([1, 2, 3, 0.1, 0.2, 0.3])",
])  # fmt: skip
@pytest.mark.parametrize("form", ["json", "yaml"])
def test_a_result_reads_back_to_the_same_bits(text: str, form: str, run: Callable[..., Any], tmp_path: Any) -> None:
    tree = str(by.EXAMPLES / "robot.yaml")
    first = run("calc", "--tree", tree, text, "-f", form)
    assert first.status == 0, first.err
    (tmp_path / f"x.{form}").write_text(first.out)
    assert run("calc", f"x=x.{form}", "x", "-f", form).out == first.out
    if form == "json":
        assert run("calc", first.out.strip(), "-f", form).out == first.out


def test_json_has_numbers_bare_and_text_has_their_units(run: Callable[..., Any]) -> None:
    assert json.loads(run("calc", "2 * 3mm", "-f", "json").out) == 0.006
    assert run("calc", "2 * 3mm", "-f", "text").out == "0.006 m\n"
    assert run("calc", "90deg", "-f", "text").out == "1.5707963267948966 rad  (90.0 deg)\n"
    assert run("calc", "90deg", "--deg", "-f", "json").out == "90.0\n"
    assert json.loads(run("calc", "rpy({rpy_deg: [0, 0, 90]})", "-f", "json", "--deg").out) == {"rpy_deg": [0.0, 0.0, 90.0]}


def test_a_leading_slash_is_dropped_as_trees_do(run: Callable[..., Any]) -> None:
    done = run("calc", "--tree", str(by.EXAMPLES / "robot.yaml"), "dist(/map<-tool, map<-/tool)")
    assert done.out == "0.0\n"
    assert "the leading / is no part of a name" in done.err


def test_python_gets_values_that_carry_their_frames() -> None:
    pose = frametool.calc("inv(map<-base_link) * (map<-tool)", tree=ROBOT)
    assert (pose.target, pose.source) == ("base_link", "tool")
    assert np.abs(np.asarray(pose) - look("base_link", "tool")).max() < 1e-12
    far = frametool.calc("norm(p) + 1mm", p=[3, 4, 0])
    assert (far, far.unit) == (5.001, "m")
    assert frametool.calc("far / 2", far=far).unit == "m"
    many = frametool.Transform.random(7, seed=1)
    turned = frametool.calc("(a * many) ^ -1", a=pose, many=many)
    assert turned.transform.is_close((pose.transform @ many).inverse()).all()
    with pytest.raises(FrametoolError, match="do not touch"):
        frametool.calc("pose * pose", pose=pose)
    with pytest.raises(FrametoolError, match=r"division by zero \(element 1\)"):
        frametool.calc("1 / a", a=np.array([1.0, 0.0]))
    for value in (None, True, "x"):
        with pytest.raises(FrametoolError, match=f"a: an expression knows nothing of '{type(value).__name__}'"):
            frametool.calc("a", a=value)
    with pytest.raises(FrametoolError, match=r"expected a tree as frametool\.load returns it, found 'robot\.yaml'"):
        frametool.calc("map<-tool", tree="robot.yaml")  # type: ignore[arg-type]


def test_every_function_is_on_the_screen_of_help(run: Callable[..., Any]) -> None:
    assert all(name in run("help", "calc").out for name in FUNCTIONS)
