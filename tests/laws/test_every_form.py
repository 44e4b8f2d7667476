"""A result says the same in every form it is written in: what a form has no place for is told, or refused whole."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from kinds import KINDS, NOTATIONS, VECTORS, without
from ways import Reading, given, inline, readings, ways

if TYPE_CHECKING:
    from ways import Run, Way

MAP_FROM_BASE = "{name: base, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
COMMANDS = {
    "convert": (("convert", "--to", "quaternion"), without(KINDS, *NOTATIONS, *VECTORS, "point", "PointStamped")),
    "move": (("apply", "--transform", MAP_FROM_BASE, "--to", "quaternion"), without(KINDS, *NOTATIONS)),
}
FORMS = ("yaml", "csv", "tum", "ros2", "text")
WAYS = ("argument", "lines", "row")


def one_way(kind: str, way: str) -> Way | None:
    """Give a record as an argument, as twenty lines or as a row."""
    record = KINDS[kind]
    if way == "argument":
        return next(ways("argument", record.record))
    if way == "row":
        return next(ways("table", record.record, record.cells), None)
    return list(ways("lines", record.record))[1]


def written(text: str, form: str) -> list[Reading]:
    """Read what is written in a form."""
    if form == "tum":
        rows = [line.split() for line in text.splitlines()]
        return [Reading("pose", tuple(map(repr, map(float, row[1:]))), stamp_ns=_nanoseconds(row[0])) for row in rows]
    return readings(text, "yaml" if form.startswith("ros") else form)


def _nanoseconds(seconds: str) -> int:
    return int(seconds.replace(".", ""))


RECORDS = "argument, lines"
SEAMS = [
    ("writing: a vector becomes a point", "move", "vector, Vector3Stamped", "csv", RECORDS),
]


def cases() -> list[Any]:
    """Pair commands, kinds and forms; the ways in which a result does not survive today are cases of their own."""
    found = []
    for command, (_, kinds) in COMMANDS.items():
        for kind, record in kinds.items():
            for form in FORMS:
                by_reason: dict[str, list[str]] = {}
                for way in WAYS:
                    if way != "row" or record.cells:
                        by_reason.setdefault(seam(command, kind, form, way), []).append(way)
                for reason, some in by_reason.items():
                    marks = [pytest.mark.xfail(strict=True, reason=reason)] if reason else []
                    found.append(pytest.param(command, kind, form, some, marks=marks, id=f"{command}-{kind}-{form}-{'+'.join(some)}"))
    return found


def seam(*names: str) -> str:
    """Say why a result does not survive a form today; "" where it does."""
    for reason, *some in SEAMS:
        if all(name in several.split(", ") for name, several in zip(names, some, strict=True)):
            return f"seam: {reason}"
    return ""


WANTED: dict[tuple[str, str], list[Reading]] = {}


@pytest.mark.parametrize(("command", "kind", "form", "some"), cases())
def test_a_result_survives_every_form_or_is_told_of(run: Run, command: str, kind: str, form: str, some: list[str]) -> None:
    arguments, record = COMMANDS[command][0], KINDS[kind]
    if (command, kind) not in WANTED:
        WANTED[command, kind] = readings(run(*arguments, "-f", "json", inline(record.record)).out)
    wanted = WANTED[command, kind]
    parent = "map" if command == "move" and record.parent else record.parent
    for way in filter(None, (one_way(kind, each) for each in some)):
        done = given(run, (*arguments, "-f", form), way)
        if done.status in (1, 2):
            assert (done.out, done.err.count("\n")) == ("", 1), way
            continue
        assert done.status == 0, way
        if form == "text":
            numbers = [number for each in wanted for number in each.numbers]
            assert all(number in done.out for number in numbers), way
            assert parent is None or parent in done.out, way
            continue
        found = written(done.out, form)
        if not all(each.kind in done.err for each in wanted):
            assert [each[:2] for each in found] == [_whole(each, form) for each in wanted] * way.rows, way
        for each in found:
            assert parent in (each.parent, None) or "name" in done.err, way
            assert record.name in (each.name, None) or "name" in done.err, way
            assert record.stamp_ns in (each.stamp_ns, None) or "stamp" in done.err, way


def _whole(reading: Reading, form: str) -> tuple[str, tuple[str, ...]]:
    """Say what a form makes of a result: messages and trajectories have no rotation without a position."""
    if reading.kind == "rotation" and form in ("tum", "ros2"):
        return "pose", ("0.0", "0.0", "0.0", *reading.numbers)
    return reading[:2]
