"""Rows and records of which some are hostile: every row is moved or told of, and no row is touched by its neighbours."""

from __future__ import annotations

import csv
import io
import json
import re
from typing import TYPE_CHECKING

import pytest
from oracles_of_use import HOSTILE, cases

if TYPE_CHECKING:
    from random import Random

    from oracles_of_use import Ending, Tool

pytestmark = pytest.mark.fuzz
POSE = "{xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]}"
COMMANDS = [
    ["invert"], ["apply", "--transform", POSE], ["convert", "--to", "rpy_deg"], ["convert", "--to", "matrix"],
    ["compose", "-", POSE], ["relative", POSE, "-"], ["convert", "--to", "euler:rzyx", "--precision", "9"],
    ["apply", "--transform", POSE, "--as", "vector"], ["convert", "--to", "rotvec,axis_angle"],
]  # fmt: skip
COLUMNS = [
    ["x", "y", "z", "qx", "qy", "qz", "qw"], ["x", "y", "z", "roll", "pitch", "yaw"], ["x", "y", "z"],
    ["x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg"], ["rotvec_x", "rotvec_y", "rotvec_z"], ["qw", "qx", "qy", "qz"],
]  # fmt: skip
SUMMARY = re.compile(r": (\d+) of (\d+) rows (?:skipped|without result)")
ONE_CELL = [text for text in HOSTILE if not set(text) & set(',"\n\r')]


def numbers(random: Random, columns: list[str]) -> list[str]:
    """Return the cells of a good row."""
    values = {name: random.uniform(-3, 3) for name in columns}
    if "qw" in values:
        norm = sum(values[name] ** 2 for name in ("qx", "qy", "qz", "qw")) ** 0.5
        values |= {name: values[name] / norm for name in ("qx", "qy", "qz", "qw")}
    return [repr(value) for value in values.values()]


def told(ending: Ending) -> tuple[int, int]:
    """Return how many rows were bad, and of how many."""
    found = SUMMARY.search(ending.err)
    return (int(found[1]), int(found[2])) if found else (0, 0)


def test_rows_of_a_table_stand_alone(tool: Tool) -> None:
    for random in cases():
        command, columns = random.choice(COMMANDS), random.choice(COLUMNS)
        count = random.choice([1, 2, 3, 10, 40, 200])
        good = [[str(row), *numbers(random, columns)] for row in range(count)]
        bad = [list(row) for row in good]
        hurt = set()
        for _ in range(random.randint(1, 4)):
            row = random.randrange(count)
            bad[row][random.randrange(1, len(columns) + 1)] = random.choice(ONE_CELL)
            hurt.add(str(row))
        before, after = (
            tool(*command, "--in", "csv", "--on-error", "skip", stdin=written(["id", *columns], rows)) for rows in (good, bad)
        )
        if before.status:
            continue  # these columns are not for this command
        assert after.status in (0, 3)
        clean, found = by_name(before.out), by_name(after.out)
        skipped, rows = told(after)
        assert len(found) + skipped == count
        assert rows in (0, count)
        assert {name: row for name, row in clean.items() if name not in hurt} == {
            name: row for name, row in found.items() if name not in hurt
        }


def written(header: list[str], rows: list[list[str]]) -> bytes:
    """Return a table's text, the hostile cells as they are."""
    return "\n".join([",".join(header), *map(",".join, rows), ""]).encode()


def by_name(out: bytes) -> dict[str, str]:
    """Return the rows of a table by their first cell."""
    return {line.partition(",")[0]: line for line in out.decode().split("\n")[1:] if line}


def test_records_stand_alone(tool: Tool) -> None:
    for random in cases():
        command = random.choice(COMMANDS)
        count = random.choice([1, 2, 3, 10, 20, 40, 200])
        good = [record(random, row) for row in range(count)]
        bad, hurt = list(good), set()
        for _ in range(random.randint(1, 4)):
            row = random.randrange(count)
            bad[row] = mutated(random, good[row])
            hurt.add(row)
        before, after = (
            tool(*command, "--in", "json", "--on-error", "skip", stdin="".join(f"{each}\n" for each in lines).encode())
            for lines in (good, bad)
        )
        if before.status:
            continue
        assert after.status in (0, 3)
        assert rest(before.out, hurt) == rest(after.out, hurt)
        skipped, rows = told(after)
        assert skipped <= rows


def record(random: Random, row: int) -> str:
    """Return a good record on one line."""
    rotation = random.choice(['"rpy": [0.1, 0.2, 0.3]', '"quaternion": {"x": 0, "y": 0, "z": 0.6, "w": 0.8}', '"rotvec_deg": [0, 0, 90]'])
    return f'{{"id": {row}, "xyz": [{random.uniform(-9, 9)!r}, 2, 3], {rotation}}}'


def mutated(random: Random, line: str) -> str:
    """Return a line with a hostile value or a hostile character somewhere behind its id, or cut."""
    begin = line.index("xyz") - 1
    at = random.randrange(begin, len(line))
    kind = random.randrange(4)
    if kind == 0:
        values = re.findall(r"-?\d[\d.e-]*", line[begin:])
        hostile = random.choice([json.dumps(random.choice(HOSTILE)), "null", "[]", "{}", "1e400", "NaN", "-0.0", "1e308"])
        return line[:begin] + line[begin:].replace(random.choice(values), hostile, 1)
    if kind == 1:
        return line[:at] + random.choice(['"', "{", "}", "[", "]", ",", ":", "\\", "x", "\x1b", " "]) + line[at:]
    return line[:at] + line[at + 1 :] if kind == 2 else line[:at]


def rest(out: bytes, hurt: set[int]) -> list[str]:
    """Return the lines of records that nobody touched."""
    lines = [(re.match(r'\{"id": (\d+)', line), line) for line in out.decode().splitlines()]
    return [line for name, line in lines if name and int(name[1]) not in hurt]


def test_any_bytes_are_a_stream_or_an_error(tool: Tool) -> None:
    for random in cases():
        form = random.choice(["csv", "tsv", "columns", "tum", "json", "yaml", None])
        out = io.StringIO()
        table = csv.writer(out)
        table.writerow(random.choice(COLUMNS))
        table.writerows([random.choice(HOSTILE) for _ in range(random.randint(0, 8))] for _ in range(random.randint(0, 5)))
        text = random.choice([out.getvalue(), "".join(random.choices([*HOSTILE, "\n", ",", " ", "1", "x,y,z\n", "---\n"], k=12))])
        data = bytearray(text.encode())
        for _ in range(random.choice([0, 0, 1, 3])):
            if data:
                data[random.randrange(len(data))] = random.randrange(256)
        on_error = random.choice(["stop", "skip", "null"])
        tool(*random.choice(COMMANDS), *(["--in", form] if form else []), "--on-error", on_error, stdin=bytes(data))
