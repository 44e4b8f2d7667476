"""Whatever travels to workers survives it: values, trees, buffers, errors."""

from __future__ import annotations

import pickle
from typing import Any

import console
import numpy as np
import pytest

import frametool
from frametool import errors
from frametool.errors import FormatError, FrametoolError, UnknownFrame


def again(value: Any) -> Any:
    """Send a value through a pickle."""
    return pickle.loads(pickle.dumps(value))  # noqa: S301 - our own bytes


def every(kind: type[FrametoolError]) -> list[type[FrametoolError]]:
    """Return an error and all that derive from it."""
    return [kind, *(each for child in kind.__subclasses__() for each in every(child))]


@pytest.mark.parametrize(
    "value",
    [frametool.Rotation.random(seed=1), frametool.Rotation.random(4, seed=1), frametool.Transform.random(seed=1),
     frametool.Transform.random(4, seed=1)],
    ids=repr,
)  # fmt: skip
def test_a_value_keeps_its_bits(value: Any) -> None:
    assert [np.asarray(part).tobytes() for part in again(value).components] == [
        np.asarray(part).tobytes() for part in value.components
    ]


@pytest.mark.parametrize("name", ["robot.yaml", "drive.yaml", "arm.urdf"])
def test_a_tree_answers_as_before_also_after_it_was_asked(name: str) -> None:
    tree = frametool.load(console.ROOT / "examples" / name)
    for asked in (tree, again(tree)):
        root, leaf = asked.frames[0], asked.frames[-1]
        assert again(asked).lookup(root, leaf).components == asked.lookup(root, leaf).components
        assert again(asked).frames == asked.frames


def test_a_buffer_answers_as_before_and_goes_on() -> None:
    buffer = frametool.TransformBuffer(keep_ns=None)
    for stamp in range(10):
        buffer.insert("map", "base", frametool.Transform.random(seed=stamp), stamp)
    buffer.lookup_many("map", "base", [1, 2])
    copy = again(buffer)
    assert copy.lookup_many("map", "base", [3, 5]).xyz.tobytes() == buffer.lookup_many("map", "base", [3, 5]).xyz.tobytes()
    copy.insert("map", "base", frametool.Transform.identity(), 20)
    assert copy.latest("map", "base") == 20
    assert buffer.latest("map", "base") == 9


MADE: dict[str, FrametoolError] = {
    "UnknownFrame": UnknownFrame("cam", known=["camera", "map"], where="robot.yaml"),
    "FormatError": FormatError("bad", source="s.yaml", line=3, column=5, snippet="x", rule="r"),
}


@pytest.mark.parametrize("kind", every(FrametoolError), ids=lambda kind: kind.__name__)
def test_an_error_says_the_same_and_has_the_same_fields(kind: Any) -> None:
    made = MADE.get(kind.__name__) or kind.__new__(kind, "what happened")
    copy = again(made)
    assert (type(copy), copy.args, vars(copy)) == (type(made), made.args, vars(made))


def test_an_error_that_was_raised_passes() -> None:
    tree = frametool.load(console.ROOT / "examples" / "robot.yaml")
    for call in (lambda: tree.lookup("map", "camera"), lambda: frametool.load("no such file.yaml"), lambda: frametool.Rotation.from_quaternion([0, 0, 0, 0])):
        with pytest.raises(errors.FrametoolError) as caught:
            call()
        assert (str(again(caught.value)), again(caught.value).exit_code) == (str(caught.value), caught.value.exit_code)
