"""The comparison of two trees, against products of 4x4 matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Scipy

from frametool import Camera, FrameTree, Rotation, Transform, TransformBuffer, diff
from frametool.errors import UnknownFrame, ValueInvalid
from frametool.lint.tree_diff import KINDS

if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any

    from frametool.lint.tree_diff import Difference

SECOND = 10**9


def turned(degrees: float, axis: str = "z", xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Transform:
    return Transform(Rotation.from_rotvec(np.radians(degrees) * np.eye(3)["xyz".index(axis)]), xyz)


def tree_of(*edges: tuple[str, str, Transform]) -> FrameTree:
    tree = FrameTree()
    for edge in edges:
        tree.add(*edge)
    return tree


def found(a: Any, b: Any, **options: Any) -> dict[str, Difference]:
    """Return the one difference told of each frame."""
    differences = diff(a, b, **options).differences
    assert len({each.frame for each in differences}) == len(differences)
    return {each.frame: each for each in differences}


def random_pair(seed: int) -> tuple[list[tuple[str, str]], list[list[Transform]]]:
    """Return the edges of a tree of twelve frames and two sets of poses for them."""
    generator = np.random.default_rng(seed)
    edges = [(f"f{generator.integers(number)}", f"f{number}") for number in range(1, 12)]
    poses = [[Transform.random(seed=generator) for _ in edges] for _ in range(2)]
    return edges, poses


@pytest.mark.parametrize("seed", range(5))
def test_moves_agree_with_products_of_matrices(seed: int) -> None:
    edges, poses = random_pair(seed)
    trees = [tree_of(*((*edge, pose) for edge, pose in zip(edges, side, strict=True))) for side in poses]
    seen = [{"f0": np.eye(4)}, {"f0": np.eye(4)}]
    for (parent, child), *pair in zip(edges, *poses, strict=True):
        for at, pose in zip(seen, pair, strict=True):
            at[child] = at[parent] @ pose.as_matrix()
    told = found(*trees, seen_from="f3")
    assert set(told) == {child for _, child in edges} | {"f0"}
    own = dict(zip((child for _, child in edges), zip(*poses, strict=True), strict=True))
    for frame, each in told.items():
        from_f3 = [np.linalg.inv(at["f3"]) @ at[frame] for at in seen]
        cases = [(each.seen, from_f3)] if frame != "f3" else []
        cases += [(each.own, [pose.as_matrix() for pose in own[frame]])] if frame != "f0" else []
        for apart, (a, b) in cases:
            assert apart is not None
            assert apart.metres == pytest.approx(np.linalg.norm(a[:3, 3] - b[:3, 3]), rel=1e-12)
            angle = (Scipy.from_matrix(a[:3, :3]).inv() * Scipy.from_matrix(b[:3, :3])).magnitude()
            assert apart.radians == pytest.approx(angle, rel=1e-9)


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-8, 2e-9])
def test_a_small_turn_is_told_with_its_digits(angle: float) -> None:
    start = turned(57.0, "x")
    a, b = tree_of(("a", "b", start)), tree_of(("a", "b", start @ turned(np.degrees(angle), "y")))
    own = found(a, b)["b"].own
    assert own is not None
    assert own.radians == pytest.approx(angle, abs=4e-16)


def test_signs_of_quaternions_and_the_order_of_names_do_not_count() -> None:
    pose = turned(50.0, "y", (1, 2, 3))
    other = Transform.of(*pose.components[:3], *(-part for part in pose.components[3:]))
    found = diff(tree_of(("a", "b", pose), ("a", "c", pose)), tree_of(("a", "c", other), ("a", "b", other)))
    assert found.differences == []
    assert {each.frame for each in found.unmoved} == {"a", "b", "c"}


def test_frames_of_one_tree_only_are_told_with_their_parents() -> None:
    told = found(tree_of(("a", "b", turned(1)), ("a", "old", turned(2))), tree_of(("a", "b", turned(1)), ("b", "new", turned(3))))
    assert (told["old"].kind, told["old"].parent_a, told["old"].parent_b) == ("only-in-a", "a", None)
    assert (told["new"].kind, told["new"].parent_a, told["new"].parent_b) == ("only-in-b", None, "b")
    assert told["old"].note == told["new"].note == ""


def test_files_are_compared_by_their_paths(tmp_path: Path) -> None:
    for name, x in (("a.yaml", 1), ("b.yaml", 2)):
        (tmp_path / name).write_text(f"frames: {{base: {{lidar: {{xyz: [{x}, 0, 0]}}}}}}\n")
    assert [each.frame for each in diff(tmp_path / "a.yaml", str(tmp_path / "b.yaml")).differences] == ["lidar"]


def test_one_robot_built_in_two_ways_is_compared_from_its_root() -> None:
    base_mast, mast_camera = turned(10, "z", (0, 0, 1)), turned(-20, "y", (0.1, 0, 0.2))
    a = tree_of(("base", "mast", base_mast), ("mast", "camera", mast_camera))
    b = tree_of(("base", "mast", base_mast), ("base", "camera", base_mast @ mast_camera))
    told = found(a, b)
    assert list(told) == ["camera"]
    each = told["camera"]
    assert (each.kind, each.parent_a, each.parent_b, each.own, each.seen_from) == ("parent", "mast", "base", None, "base")
    assert each.seen is not None
    assert each.seen.metres < 1e-15


def test_an_edge_turned_round_is_no_move() -> None:
    pose = turned(40, "x", (1, 2, 3))
    told = found(tree_of(("base", "camera", pose)), tree_of(("camera", "base", pose.inverse())))
    assert {frame: each.kind for frame, each in told.items()} == {"base": "parent", "camera": "parent"}
    seen = told["camera"].seen
    assert seen is not None
    assert seen.metres < 1e-14


def test_a_root_that_only_one_has_makes_place_for_what_is_below_it() -> None:
    arm = ("base", "arm", turned(10, "z", (1, 0, 0)))
    comparison = diff(tree_of(("map", "base", turned(90)), arm), tree_of(arm))
    assert comparison.notes == []
    assert [(each.kind, each.frame) for each in comparison.differences] == [("only-in-a", "map"), ("parent", "base")]
    assert next(each for each in comparison.unmoved if each.frame == "arm").seen_from == "base"


def test_parts_that_are_not_connected_are_each_seen_from_their_own_root() -> None:
    edges = [("a", "b", turned(1)), ("c", "d", turned(2)), ("d", "e", turned(3))]
    told = diff(tree_of(*edges), tree_of(*edges))
    assert {each.frame: each.seen_from for each in told.unmoved} == {"a": None, "b": "a", "c": None, "d": "c", "e": "c"}
    assert {each.note for each in diff(tree_of(*edges), tree_of(*edges), seen_from="a").unmoved} == {
        "", "not connected to 'a' in both",
    }  # fmt: skip


def test_a_frame_that_hangs_in_another_part_in_b_is_seen_from_nowhere() -> None:
    told = found(tree_of(("a", "b", turned(1)), ("b", "c", turned(1))), tree_of(("a", "b", turned(1)), ("x", "c", turned(1))))
    assert (told["c"].kind, told["c"].parent_b, told["c"].seen) == ("parent", "x", None)


def test_trees_without_a_frame_in_common_say_so() -> None:
    assert diff(tree_of(("a", "b", turned(1))), tree_of(("c", "d", turned(1)))).notes == ["no frame is in both A and B"]


def test_the_farthest_comes_first_and_what_went_along_comes_behind() -> None:
    a = tree_of(*(("base", name, turned(0)) for name in "xyz"), ("y", "tip", turned(0, "z", (1, 0, 0))))
    b = tree_of(
        ("base", "x", turned(0, "z", (0.001, 0, 0))), ("base", "y", turned(5)), ("base", "z", turned(0, "z", (0.02, 0, 0))),
        ("y", "tip", turned(0, "z", (1, 0, 0))),
    )  # fmt: skip
    assert [each.frame for each in diff(a, b).differences] == ["y", "z", "x", "tip"]
    assert [each.frame for each in diff(a, b, tolerance=(1e-4, 1.0)).differences] == ["z", "x", "tip"]


@pytest.mark.parametrize(("size", "is_told"), [(0.9e-3, False), (1.1e-3, True)])
def test_what_is_within_the_tolerance_does_not_count(size: float, is_told: bool) -> None:  # noqa: FBT001 - a parameter of the test
    moved = tree_of(("a", "b", turned(0, "z", (size, 0, 0))))
    turn = tree_of(("a", "b", turned(np.degrees(size))))
    for other in (moved, turn):
        assert bool(diff(tree_of(("a", "b", turned(0))), other, tolerance=(1e-3, 1e-3)).differences) is is_told


def test_the_least_move_counts_unless_told() -> None:
    for size, count in ((0.9e-9, 0), (1.1e-9, 1)):
        assert len(diff(tree_of(("a", "b", turned(0))), tree_of(("a", "b", turned(0, "z", (size, 0, 0))))).differences) == count


def test_the_rounding_of_products_far_from_the_origin_is_no_move() -> None:
    generator = np.random.default_rng(1)
    for _ in range(20):
        first, second = Transform.random(seed=generator, radius=6.4e6), Transform.random(seed=generator)
        a = tree_of(("earth", "car", first), ("car", "lidar", second))
        b = tree_of(("earth", "car", first), ("earth", "lidar", first @ second))
        seen = diff(a, b, seen_from="lidar")
        assert [(each.kind, each.frame) for each in seen.differences] == [("parent", "lidar")]


def test_a_frame_to_see_from_must_be_in_both() -> None:
    a, b = tree_of(("base", "gripper", turned(1))), tree_of(("base", "hand", turned(1)))
    with pytest.raises(UnknownFrame, match="unknown frame 'gripper'"):
        diff(a, b, seen_from="gripper")


def drive(speed: float, *, until: int = 3, stamps_from: int = 0) -> TransformBuffer:
    buffer = TransformBuffer()
    for second in range(until):
        buffer.insert("odom", "base", turned(0, "z", (speed * second, 0, 0)), stamps_from + second * SECOND)
    buffer.insert("base", "lidar", turned(90))
    return buffer


def test_recordings_are_compared_at_a_time() -> None:
    a, b = drive(1.0), drive(1.5)
    comparison = diff(a, b, at_ns=SECOND // 2)
    told = {each.frame: each for each in comparison.differences}
    assert set(told) == {"base", "lidar"}
    assert told["base"].own is not None
    assert told["base"].own.metres == pytest.approx(0.25)
    assert told["lidar"].seen is not None
    assert told["lidar"].seen.metres == pytest.approx(0.25)
    assert comparison.notes == []
    assert diff(a, b, at_ns=0).differences == []
    with pytest.raises(ValueInvalid, match=r"a stamp is integer nanoseconds, found 0\.5"):
        diff(a, b, at_ns=0.5)  # type: ignore[arg-type]


def test_without_a_time_recordings_are_compared_at_their_latest_and_sample_by_sample() -> None:
    a, b = drive(1.0), drive(1.5)
    told = [(each.kind, each.frame) for each in diff(a, b).differences]
    assert told == [("samples", "base"), ("moved", "base"), ("moved", "lidar")]
    assert diff(a, b).differences[0].note == "farthest at 2.000000000"
    assert diff(a, drive(1.0)).differences == []
    assert diff(a, b).notes == [
        "what moves is compared at its latest (A 2.000000000 and B 2.000000000), and sample by sample; --at TIME compares at one time"
    ]


def test_a_recording_that_only_differs_before_its_latest_differs() -> None:
    a, b = drive(1.0), drive(1.0)
    b.track("base").replace(SECOND, "odom", turned(0, "z", (1.25, 0, 0)).components)  # type: ignore[union-attr]
    (only,) = diff(a, b).differences
    assert (only.kind, only.note) == ("samples", "farthest at 1.000000000")
    assert only.own is not None
    assert only.own.metres == 0.25


@pytest.mark.parametrize(
    ("other", "note"),
    [
        (drive(1.0, until=4), "3 at 1 Hz, 0 .. 2 s in A, 4 at 1 Hz, 0 .. 3 s in B"),
        (drive(1.0, stamps_from=1), "3 at 1 Hz, 0 .. 2 s in A, 3 at 1 Hz, 0.000000001 .. 2.000000001 s in B"),
    ],
)
def test_other_stamps_are_told(other: TransformBuffer, note: str) -> None:
    assert diff(drive(1.0), other).differences[0].note == note


def test_a_frame_that_stands_in_one_and_moves_in_the_other_is_told() -> None:
    standing = tree_of(("odom", "base", turned(0, "z", (2, 0, 0))), ("base", "lidar", turned(90)))
    (only,) = diff(standing, drive(1.0)).differences
    assert (only.kind, only.frame, only.note) == ("motion", "base", "static in A, moves in B")
    assert diff(drive(1.0), standing).differences[0].note == "moves in A, static in B"
    assert diff(drive(1.0), standing).notes == ["what moves is compared at its latest (A 2.000000000); --at TIME compares at one time"]


def test_frames_without_data_at_a_time_are_told_and_not_taken_for_roots() -> None:
    comparison = diff(drive(1.0), drive(1.0, until=4), at_ns=5 * SECOND // 2)
    assert [(each.kind, each.frame, each.note) for each in comparison.differences] == [
        ("no-data", "base", "no data in A at 2.500000000")
    ]
    assert comparison.uncompared == []
    assert diff(drive(1.0), drive(1.0), at_ns=9 * SECOND).uncompared == ["base"]


def test_a_deep_tree_and_a_wide_one_are_compared_frame_by_frame() -> None:
    for parents in ([number - 1 for number in range(3000)], [number // 100 for number in range(3000)]):
        a, b = (tree_of(*((f"f{parents[n]}", f"f{n}", turned(0, "z", (x * (n == 7), 0, 0))) for n in range(1, 3000))) for x in (1, 2))
        told = diff(a, b).differences
        assert told[0].frame == "f7"
        assert all(each.seen is not None and each.seen.metres == 1.0 for each in told)


def test_every_kind_is_told_in_a_sentence_on_one_line() -> None:
    a, b = drive(1.0), drive(1.5, until=2)
    for tree, name in ((a, "old\nname"), (b, "new")):
        tree.insert("base", name, turned(1))
    a.insert("x", "y", turned(1))
    b.insert("z", "y", turned(1))
    a.insert("base", "s", turned(1))
    b.insert("base", "s", turned(1), 0)
    a.cameras, b.cameras = ({"y": Camera("pinhole", [fx, 5.0, 2.0, 2.0])} for fx in (5.0, 6.0))
    told = [*diff(a, b).differences, *diff(a, b, at_ns=5 * SECOND).differences]
    assert {each.kind for each in told} == set(KINDS)
    assert all(each.sentence.isprintable() and repr(each.frame)[1:-1] in each.sentence for each in told)
