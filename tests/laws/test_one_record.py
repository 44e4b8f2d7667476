"""One record means the same however it is given: as argument, file, line, array, document or row, alone or in twenties."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from kinds import AS_POSES, KINDS, LISTS, NOTATIONS, POINTS, VECTORS, WITH_COVARIANCE, Kind, without
from ways import ARGUMENTS, STREAMS, Reading, given, readings, ways

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ways import Run, Way

TREE = {"tree.yaml": "frames:\n  map:\n    base: {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}\n"}
MAP_FROM_BASE = "{name: base, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
BLOCKS = ("lines", "documents", "table")
BASE_FROM_OTHER = "{name: other, parent: base, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"


class Operation(NamedTuple):
    """A command before its record, the kinds and forms it takes, and the names of what it makes of `tool` in `base`."""

    arguments: tuple[str, ...]
    kinds: dict[str, Kind]
    parent: str
    name: str = "tool"
    forms: tuple[str, ...] = ("argument", *BLOCKS)


IN_QUATERNIONS = ("--to", "quaternion", "-f", "json")
POSES_AND_POINTS = without(AS_POSES | POINTS, *NOTATIONS)
FEW = ("quaternion", "with seconds", "PoseStamped", "PoseArray", "point", "TwistStamped")
OPERATIONS = {
    "convert": Operation(
        ("convert", *IN_QUATERNIONS), AS_POSES | WITH_COVARIANCE | POINTS | VECTORS, "base",
        forms=(*ARGUMENTS, *STREAMS),
    ),
    "invert": Operation(("invert", *IN_QUATERNIONS), POSES_AND_POINTS | WITH_COVARIANCE, "tool", "base"),
    "compose": Operation(
        ("compose", *IN_QUATERNIONS, MAP_FROM_BASE), POSES_AND_POINTS | WITH_COVARIANCE, "map",
        forms=(*ARGUMENTS, *BLOCKS),
    ),
    "relative": Operation(("relative", *IN_QUATERNIONS, BASE_FROM_OTHER), POSES_AND_POINTS, "other"),
    "move": Operation(
        ("apply", "--transform", MAP_FROM_BASE, *IN_QUATERNIONS), without(KINDS, *NOTATIONS), "map",
        forms=("argument", "array", *BLOCKS),
    ),
    "move by a tree": Operation(
        ("apply", "tree.yaml", "map", *IN_QUATERNIONS), {name: KINDS[name] for name in FEW}, "map",
        forms=("argument", *BLOCKS),
    ),
}  # fmt: skip


class Said(NamedTuple):
    """What came of a record: the status, how many results, what each different one says, and what was told."""

    status: int
    found: int
    results: tuple[Reading, ...]
    told: str


SEEN: dict[tuple[str, ...], Said] = {}


def said(run: Run, arguments: tuple[str, ...], way: Way) -> Said:
    """Run a command with a record given in a way, once."""
    key = (*arguments, way.argument, way.stdin, *way.files.values())
    if key not in SEEN:
        done = given(run, arguments, way._replace(files={**way.files, **TREE}))
        found = readings(done.out)
        SEEN[key] = Said(done.status, len(found), tuple(dict.fromkeys(found)), done.err)
    return SEEN[key]


def each_way(run: Run, operation: str, kind: str, forms: Iterable[str]) -> Iterator[tuple[Way, Said]]:
    how, record = OPERATIONS[operation], KINDS[kind]
    for form in forms:
        for way in ways(form, record.record, record.cells, by_name=operation == "convert"):
            yield way, said(run, how.arguments, way)


SAME, NAMED, TIMED = range(3)
INSIDE = "names: an inverse streamed as messages has its name inside the pose, where messages have none"
SEAMS: list[tuple[str, int, str, str, str]] = [
    ("writing: a table of points is refused as JSON", SAME, "convert", "point, PointStamped, position, flat point", "table"),
    (INSIDE, NAMED, "invert", "PoseStamped, PoseWithCovarianceStamped, PoseArray, Path", "lines"),
]


def seam(law: int, *names: str) -> str:
    """Say why a law does not hold yet for an operation, a kind and a form; "" where it does."""
    for reason, broken, *some in SEAMS:
        if law == broken and all(name in several.split(", ") for name, several in zip(names, some, strict=True)):
            return f"seam: {reason}"
    return ""


def cases(law: int) -> list[Any]:
    """Pair each operation with its kinds; the forms in which they break a law today are cases of their own."""
    found = []
    for operation, how in OPERATIONS.items():
        for kind, record in how.kinds.items():
            by_reason: dict[str, list[str]] = {}
            for form in how.forms:
                if form != "table" or record.cells:
                    by_reason.setdefault(seam(law, operation, kind, form), []).append(form)
            for reason, forms in by_reason.items():
                marks = [pytest.mark.xfail(strict=True, reason=reason)] if reason else []
                found.append(pytest.param(operation, kind, forms, marks=marks, id=f"{operation}-{kind}-{'+'.join(forms)}"))
    return found


@pytest.mark.parametrize(("operation", "kind", "forms"), cases(SAME))
def test_a_record_becomes_the_same_kind_of_thing_with_the_same_bits(run: Run, operation: str, kind: str, forms: list[str]) -> None:
    first = "argument" if kind in LISTS else "lines"
    _, wanted = next(each_way(run, operation, kind, [first]))
    for way, found in each_way(run, operation, kind, forms):
        assert (found.status == 0) == (wanted.status == 0), way
        assert [each[:2] for each in found.results] == [each[:2] for each in wanted.results], way
        assert found.found == (way.rows * KINDS[kind].poses if wanted.status == 0 else 0), way


@pytest.mark.parametrize(("operation", "kind", "forms"), cases(NAMED))
def test_frames_keep_their_names_or_are_told_of(run: Run, operation: str, kind: str, forms: list[str]) -> None:
    how, record = OPERATIONS[operation], KINDS[kind]
    parent: str | None = how.parent
    name = record.name and how.name
    if operation == "convert":
        parent, name = record.parent, record.name
    if operation == "invert":
        parent, name = record.name, record.parent
    for way, found in each_way(run, operation, kind, forms):
        for each in found.results:
            assert each.parent == parent, way
            assert each.name == name or (each.name is None and repr(name) in found.told), way


@pytest.mark.parametrize(("operation", "kind", "forms"), cases(TIMED))
def test_a_stamp_stays_with_its_record(run: Run, operation: str, kind: str, forms: list[str]) -> None:
    for way, found in each_way(run, operation, kind, forms):
        assert [each.stamp_ns for each in found.results] == [KINDS[kind].stamp_ns] * len(found.results), way
