"""Frames that move, in files: samples, stamps, what counts as standing, and disagreements with both places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from frametool import FrameTree, TransformBuffer, load
from frametool.errors import FormatError, FrametoolWarning, TooLate

if TYPE_CHECKING:
    from pathlib import Path
    from typing import Protocol

    from conftest import Outcome

    class Run(Protocol):
        def __call__(self, *arguments: str, stdin: str = ..., files: dict[str, str] | None = None) -> Outcome: ...

EPOCH = 1_700_000_000_123_456_789
MOVING = """\
frames:
  - name: base
    parent: map
    samples:
      - {stamp: 1700000000.123456789, xyz: [0, 0, 0]}
      - {stamp_ns: 1700000001123456789, xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}
  - {name: lidar, parent: base, xyz: [1, 0, 0]}
"""
NESTED = """\
angles: deg
frames:
  map:
    base:
      samples: [{stamp: 1700000000123456789ns}, {stamp: 1700000001123456789ns, xyz: [1, 0, 0], rpy: [0, 0, 90]}]
      children:
        lidar: {xyz: [1, 0, 0]}
"""
MESSAGE = """\
transforms:
- header: {{stamp: {{sec: {sec}, nanosec: {nanosec}}}, frame_id: {parent}}}
  child_frame_id: {child}
  transform: {{translation: {{x: {x}, y: 0, z: 0}}, rotation: {{x: 0, y: 0, z: 0, w: 1}}}}
---
"""


def message(x: float, stamp_ns: int, parent: str = "map", child: str = "base") -> str:
    """Write a TFMessage."""
    return MESSAGE.format(x=x, sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9, parent=parent, child=child)


def loaded(tmp_path: Path, *texts: str, moving: bool = False) -> FrameTree | TransformBuffer:
    """Load texts as files 0.yaml, 1.yaml, .."""
    paths = [tmp_path / f"{number}.yaml" for number in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)
    return load(*paths, moving=moving)


def x_of(frames: FrameTree | TransformBuffer, target: str, source: str, at_ns: int | None = None) -> float:
    """Look up the x of a translation."""
    return float(frames.lookup(target, source, at_ns).components[0])


@pytest.mark.parametrize("text", [MOVING, NESTED])
def test_samples_are_read_to_the_nanosecond(text: str, tmp_path: Path) -> None:
    buffer = loaded(tmp_path, text)
    assert isinstance(buffer, TransformBuffer)
    assert buffer.span("map", "lidar") == (EPOCH, EPOCH + 10**9)
    assert [x_of(buffer, "map", "base", EPOCH + after) for after in (0, 1, 10**9)] == [0.0, 1e-9, 1.0]


def test_messages_of_different_stamps_move(tmp_path: Path) -> None:
    buffer = loaded(tmp_path, message(1, EPOCH), message(3, EPOCH + 2))
    assert x_of(buffer, "map", "base", EPOCH + 1) == 2.0


def test_an_edge_with_one_stamp_stands_still(tmp_path: Path) -> None:
    tree = loaded(tmp_path, message(1, EPOCH) * 2)
    assert isinstance(tree, FrameTree)
    assert x_of(tree, "map", "base", 5) == 1.0


def test_an_edge_with_one_stamp_answers_only_that_instant_if_so_asked(tmp_path: Path) -> None:
    buffer = loaded(tmp_path, message(1, EPOCH), moving=True)
    assert x_of(buffer, "map", "base", EPOCH) == 1.0
    with pytest.raises(TooLate, match=r"its only sample is at 1700000000\.123456789 \(0\.000000001 s too late\)"):
        buffer.lookup("map", "base", EPOCH + 1)


def test_standing_and_moving_edges_of_several_files_answer_one_question(tmp_path: Path) -> None:
    static = "{name: lidar, parent: base, xyz: [10, 0, 0]}"
    buffer = loaded(tmp_path, static, message(1, EPOCH), message(2, EPOCH + 1), message(10, EPOCH - 5, "base", "lidar"))
    assert x_of(buffer, "map", "lidar", EPOCH + 1) == 12.0


@pytest.mark.parametrize("turn", [1, -1])
def test_an_edge_said_once_with_and_once_without_a_stamp_stands_still(turn: int, tmp_path: Path) -> None:
    texts = [message(1, EPOCH), "{name: base, parent: map, xyz: [1, 0, 0]}"][::turn]
    assert isinstance(loaded(tmp_path, *texts), FrameTree)


def test_two_poses_at_one_stamp_take_the_last_and_name_its_line(tmp_path: Path) -> None:
    text = message(1, EPOCH) + message(2, EPOCH + 1) + message(5, EPOCH + 1)
    with pytest.warns(FrametoolWarning, match=r"0\.yaml:12: frame 'base' has two poses at 1700000000\.123456790; the last one holds"):
        buffer = loaded(tmp_path, text)
    assert x_of(buffer, "map", "base", EPOCH + 1) == 5.0


def test_of_two_files_that_disagree_the_later_is_named(tmp_path: Path) -> None:
    first = message(1, EPOCH) + message(2, EPOCH + 1)
    with pytest.warns(FrametoolWarning, match=r"1\.yaml:2: frame 'base' has two poses"):
        loaded(tmp_path, first, message(5, EPOCH + 1))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (message(1, EPOCH) + message(2, EPOCH), "frame 'base' has two different poses in 'map': line 2 and line 7"),
        (message(1, EPOCH) + message(1, EPOCH, "odom"), r"two parents: 'map' \(line 2\) and 'odom' \(line 7\)"),
        (MOVING + "  - {name: base, parent: map, xyz: [9, 0, 0]}\n", "is both static and moving: line 5 and line 8"),
        ("- {name: b, parent: a, samples: [{xyz: [0, 0, 0]}]}", "missing stamp; a sample is"),
        ("- {name: b, parent: a, samples: [{stamp: x}]}", "'x' is not a time"),
        ("- {name: b, parent: a, samples: []}", "expected samples as a list"),
        ("- {name: b, parent: a, samples: {stamp: 1}}", "expected samples as a list"),
        ("- {name: b, parent: a, xyz: [0, 0, 0], samples: [{stamp: 1}]}", "samples and also a pose or a stamp"),
        ("- {name: b, samples: [{stamp: 1}]}", "moves but has no parent"),
        ("- {name: b, parent: a, samples: [{stamp: 1, name: c}]}", "name is defined by the entry"),
        ("- {name: b, parent: a, samples: [{stamp: 1, stamp_ns: 1}]}", "keep one"),
        ("- {name: b, parent: a, samples: [{stamp: 1, xzy: [0, 0, 0]}]}", "did you mean 'xyz'"),
        (
            "- {name: b, parent: a, samples: [{stamp: 1}]}\n- {name: a, parent: b, samples: [{stamp: 1}]}",
            "frames form a cycle",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(text: str, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=complaint) as caught:
        loaded(tmp_path, text)
    assert caught.value.line


def test_a_sample_may_name_another_parent(tmp_path: Path) -> None:
    text = """\
- {name: shelf, parent: w, xyz: [100, 0, 0]}
- {name: ball, parent: w, samples: [{stamp: 0, parent: shelf, xyz: [1, 0, 0]}, {stamp: 1, xyz: [2, 0, 0]}]}
"""
    buffer = loaded(tmp_path, text)
    assert [x_of(buffer, "w", "ball", at) for at in (0, 5, 10**9)] == [101.0, 101.0, 2.0]


def test_a_row_of_a_table_without_a_stamp_is_static_beside_those_that_move(run: Run, tmp_path: Path) -> None:
    text = run("tree", "m.yaml", "-f", "csv", files={"m.yaml": MOVING}).out
    assert "lidar,base,1.0,0.0,0.0,0.0,0.0,0.0,1.0,\n" in text
    assert run("diff", "m.yaml", "m.csv", files={"m.yaml": MOVING, "m.csv": text}).status == 0
    table = tmp_path / "t.csv"
    table.write_text("parent,name,t,x,y,z,yaw\nmap,base,1,0,0,0,0\nmap,base,,1,0,0,0\n")
    with pytest.raises(FormatError, match=r"t\.csv:2: frame 'base' is both static and moving"):
        load(table)
    table.write_text("t,x,y,z,yaw\n1,0,0,0,0\n,0,0,0,0\n")
    with pytest.raises(FormatError, match=r"t\.csv:3:t: no stamp"):
        load(table)
