"""What Python users hold passes from one process to another, and copies, without losing a bit or a word."""

from __future__ import annotations

import copy
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from console import ROOT

import frametool
from frametool import FrameTree, Rotation, Transform, TransformBuffer, Turtle, Twist, errors
from frametool.sim.turtle import TurtlePose, TurtleState

if TYPE_CHECKING:
    from collections.abc import Callable

WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda each: pickle.loads(pickle.dumps(each)),  # noqa: S301 - our own bytes
    "pickle 2": lambda each: pickle.loads(pickle.dumps(each, 2)),  # noqa: S301
    "pickle 5": lambda each: pickle.loads(pickle.dumps(each, 5)),  # noqa: S301
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}
each_way = pytest.mark.parametrize("way", WAYS)
POSES = Transform.random(5, seed=1)
VALUES: dict[str, Any] = {
    "one rotation": POSES[0].rotation, "rotations": POSES.rotation, "one transform": POSES[1], "transforms": POSES,
    "a part": POSES[1:4], "none": POSES[:0], "a table": Transform.of(*(part.reshape(5, 1) for part in POSES.components)),
    "axes that are equal": Rotation.of(-0.0, 0.0, -0.0, 1.0),
}  # fmt: skip


def bits(value: Any) -> list[Any]:
    """Name the bits of a value's components, and their shape."""
    return [(np.shape(part), np.asarray(part).reshape(-1).view(np.int64).tolist()) for part in value.components]


@each_way
@pytest.mark.parametrize("name", VALUES)
def test_values_keep_their_bits(name: str, way: str) -> None:
    again = WAYS[way](VALUES[name])
    assert type(again) is type(VALUES[name])
    assert again.shape == VALUES[name].shape
    assert bits(again) == bits(VALUES[name])
    assert [type(part) for part in again.components] == [type(part) for part in VALUES[name].components]


def test_a_part_of_many_takes_only_its_own_bytes_along() -> None:
    assert len(pickle.dumps(Transform.random(100_000, seed=1)[:3])) < 2000


@each_way
@pytest.mark.parametrize(
    "value", [Twist(1.0, 0.5), TurtleState(1.0, 2.0, 0.3), TurtlePose(1.0, 2.0, 0.3, 0.1, 0.2)], ids=repr
)
def test_the_values_of_the_simulation_are_equal_to_themselves(value: Any, way: str) -> None:
    again = WAYS[way](value)
    assert type(again) is type(value)
    assert again == value


@each_way
def test_a_turtle_goes_on_where_it_was(way: str) -> None:
    turtle = Turtle()
    turtle.command(Twist(2.0, 0.5))
    turtle.update(16_000_000)
    again = WAYS[way](turtle)
    for each in (turtle, again):
        each.update(32_000_000)
    assert again.pose == turtle.pose


def moving(*, keep_ns: int | None = None) -> TransformBuffer:
    """Return a buffer with edges that stand and move, and one that changed its parent, looked up once."""
    buffer = TransformBuffer(keep_ns=keep_ns)
    for number, pose in enumerate(Transform.random(700, seed=2)):
        buffer.insert("map", "base", pose, 10 * number)
    buffer.insert("base", "lidar", POSES[0])
    buffer.lookup("map", "lidar", 55)
    buffer.lookup_many("map", "lidar", [1, 2, 3])
    return buffer


@each_way
@pytest.mark.parametrize("text", ["2m", "30deg", "1 + 2", "T", "T * [1, 2, 3]", "[1, 2, 3]", "inv(T)", "M", "M * P"])
def test_what_calc_finds_stays_what_it_is(text: str, way: str) -> None:
    found = frametool.calc(text, T=POSES[0], M=POSES, P=POSES.xyz)
    again = WAYS[way](found)
    assert type(again) is type(found)
    assert repr(again) == repr(found)
    assert getattr(again, "unit", None) == getattr(found, "unit", None)
    assert np.array_equal(np.asarray(again), np.asarray(found))


@each_way
def test_trees_answer_as_before(way: str) -> None:
    tree = frametool.load(ROOT / "examples" / "robot.yaml")
    assert isinstance(tree, FrameTree)
    again = WAYS[way](tree)
    assert again.frames == tree.frames
    assert again.roots == tree.roots
    root = tree.roots[0]
    for frame in tree.frames:
        assert bits(again.lookup(root, frame)) == bits(tree.lookup(root, frame))
    again.add(root, "one more", POSES[0])
    assert "one more" not in tree.frames or way == "copy"


@each_way
@pytest.mark.parametrize("keep_ns", [None, 10**6])
def test_buffers_answer_as_before_and_take_more(keep_ns: int | None, way: str) -> None:
    buffer = moving(keep_ns=keep_ns)
    again = WAYS[way](buffer)
    for at_ns in (None, 0, 55, 6990):
        assert bits(again.lookup("map", "lidar", at_ns)) == bits(buffer.lookup("map", "lidar", at_ns))
    times = list(range(0, 6990, 7))
    assert bits(again.lookup_many("map", "lidar", times)) == bits(buffer.lookup_many("map", "lidar", times))
    again.insert("map", "base", POSES[2], 7000)
    assert again.lookup("map", "base", 7000).is_close(POSES[2], angle=1e-15)


KINDS = [
    kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.FrametoolError)
]


def raised(kind: type[errors.FrametoolError]) -> errors.FrametoolError:
    """Make an error of a kind with all its fields."""
    if issubclass(kind, errors.UnknownFrame):
        return kind("gripperr", known=["gripper", "base"], where="arm.yaml")
    if issubclass(kind, errors.FormatError):
        return kind("no number", source="arm.yaml", line=9, column=17, snippet="x: [a]\n    ^", rule="bad-number")
    if issubclass(kind, errors.ValueInvalid):
        return kind("quaternion 0 0 0 0 has no direction", rule="denormalized")
    return kind("what went wrong", target="map", late_ns=5)


@each_way
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_errors_keep_their_words_and_places(kind: type[errors.FrametoolError], way: str) -> None:
    error = raised(kind)
    again = WAYS[way](error)
    assert type(again) is kind
    assert (str(again), again.args, vars(again)) == (str(error), error.args, vars(error))
    assert (again.kind, again.details(), again.exit_code) == (error.kind, error.details(), error.exit_code)


MISTAKES: dict[str, Callable[[], Any]] = {
    "a bad row": lambda: Rotation.from_quaternion([[0, 0, 0, 1], [0, 0, 0, 0]]),
    "an unknown frame": lambda: frametool.load(ROOT / "examples" / "robot.yaml").lookup("map", "nothing"),
    "too early": lambda: moving().lookup("map", "base", -5),
    "too late": lambda: moving().lookup("map", "base", 10**12),
    "text that is no tree": lambda: frametool.load(ROOT / "pyproject.toml", format="yaml"),
    "an expression": lambda: frametool.calc("1 + "),
    "no file": lambda: frametool.load(ROOT / "examples" / "nothing.yaml"),
    "out": lambda: POSES.as_matrix(out=np.zeros(3)),
}


@each_way
@pytest.mark.parametrize("name", MISTAKES)
def test_errors_that_are_met_keep_what_they_say(name: str, way: str) -> None:
    with pytest.raises(errors.FrametoolError) as caught:
        MISTAKES[name]()
    again = WAYS[way](caught.value)
    assert type(again) is type(caught.value)
    assert (str(again), vars(again)) == (str(caught.value), vars(caught.value))
    assert again.details() == caught.value.details()
