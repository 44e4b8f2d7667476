"""Forms with mutated lines, clouds whose headers lie, any form into any other, and what a ring of forms gives back."""

from __future__ import annotations

import json
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING

import pytest
from clouds import cloud, pcd, ply
from oracles_of_use import HOSTILE, cases

if TYPE_CHECKING:
    from random import Random

    from oracles_of_use import Ending, Tool

pytestmark = pytest.mark.fuzz
ROW_FORMS = {"tum": [], "euroc": [], "colmap": ["--camera-axes", "optical"], "nerf": ["--camera-axes", "opengl"], "kitti": [], "g2o": []}
STREAMS = ("json", "yaml", "csv")
BINARY = ("npy", "parquet", "arrow")
STAMPED = {"json", "yaml", "csv", "tum", "euroc", "parquet", "arrow"}
MOVED = "{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"
LIES = ["0", "-1", "1", "2", "3", "7", "41", "1000000", "4294967295", "99999999999999999999", "1e3", "x", "", "F", "U", "float", "list uchar int", "ascii", "binary"]


def rows_of(random: Random, count: int) -> list[dict[str, object]]:
    """Make stamped poses with names and a column that belongs to nobody."""
    return [
        {
            "stamp_ns": 10**18 + 10**8 * at + random.randrange(10**6),
            "frame": "map",
            "name": "base",
            "xyz": [round(random.uniform(-9, 9), 6) for _ in range(3)],
            "rpy_deg": random.choice([[0, 0, 90], [10, -20, 30], [0, 0, 0], [180, 0, 0]]),
        }
        for at in range(count)
    ]


def name_of(form: str) -> str:
    """Name a file of a form."""
    return f"rows.{'jsonl' if form == 'json' else form}"


def turned_into(tool: Tool, source: str, before: str, form: str) -> Ending:
    """Convert a file of one form into one of another."""
    options = [*(ROW_FORMS.get(before) or []), *(ROW_FORMS.get(form) or []), "--to", "quaternion"]
    inward = ["--in", before] if before not in BINARY else []
    return tool("convert", "-i", source, *inward, f"--format={form}", "-o", name_of(form), "--force", *dict.fromkeys(options))


def read(tool: Tool, source: str, form: str) -> list[dict[str, object]] | None:
    """Read a file of a form as records with quaternions; None where it is refused."""
    done = tool("convert", "-i", source, *(["--in", form] if form not in BINARY else []), *(ROW_FORMS.get(form) or []), "-f", "json", "--to", "quaternion")
    return [json.loads(line) for line in done.out.splitlines()] if done.status == 0 else None


def test_a_form_with_mutated_lines_is_read_or_refused(tool: Tool) -> None:
    for random in cases(0.5):
        form = random.choice([*ROW_FORMS, *STREAMS])
        Path("in.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows_of(random, random.choice([1, 3, 20]))))
        if turned_into(tool, "in.jsonl", "json", form).status:
            continue
        lines = Path(name_of(form)).read_text().split("\n")
        for _ in range(random.choice([1, 1, 3])):
            at = random.randrange(len(lines))
            words = lines[at].split(" ") or [""]
            words[random.randrange(len(words))] = random.choice([random.choice(HOSTILE), "", "1", "nan", "1 2", "x"])
            lines[at] = random.choice([" ".join(words), lines[at][: random.randrange(len(lines[at]) + 1)], "", lines[at] * 2])
        Path("mutated").write_text("\n".join(lines), "utf-8", "surrogatepass")
        command = random.choice([["convert", "--format=csv"], ["apply", "--transform", MOVED], ["invert", "--format=json"]])
        axes = ROW_FORMS.get(form) or []
        tool(*command, "-i", "mutated", "--in", form, *axes, "--on-error", random.choice(["stop", "skip", "null"]))
        tool("check", "mutated", "--in", form, "--frames", "map,base")


def test_any_form_goes_into_any_other_or_is_refused(tool: Tool) -> None:
    for random in cases(0.4):
        first, second = random.choices([*ROW_FORMS, *STREAMS, *BINARY], k=2)
        rows = rows_of(random, random.choice([1, 2, 20]))
        Path("in.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
        if turned_into(tool, "in.jsonl", "json", first).status or (given := read(tool, name_of(first), first)) is None:
            continue
        Path(name_of(first)).rename("given")
        done = turned_into(tool, "given", first, second) if first not in BINARY else tool("convert", "-i", "given", "-f", "json")
        if done.status == 0 and first not in BINARY and (found := read(tool, name_of(second), second)) is not None:
            assert len(found) == len(given), (first, second)


def test_a_ring_of_forms_gives_what_was_there_or_told_what_is_lost(tool: Tool) -> None:
    for random in cases(0.3):
        ring = [random.choice(STREAMS), *random.sample([*ROW_FORMS, *STREAMS, *BINARY], random.choice([1, 2]))]
        rows = rows_of(random, random.choice([1, 4, 20]))
        Path("start.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
        before, source, told, stamped = "json", "start.jsonl", "", True
        for form in [*ring, "json"]:
            done = turned_into(tool, source, before, form)
            if done.status:
                break
            told += done.err
            stamped = stamped and form in STAMPED
            source = Path(name_of(form)).rename(f"turned.{Path(name_of(form)).suffix[1:]}").name
            before = form
        else:
            found = [json.loads(line) for line in Path(source).read_text().splitlines()]
            assert len(found) == len(rows), ring
            for row, each in zip(rows, found, strict=True):
                assert each["xyz"] == pytest.approx(row["xyz"], abs=1e-9), ring
                assert stamp_of(each) == row["stamp_ns"] or "stamp" in told or not stamped, (ring, each, told)
                named = each.get("frame", each.get("parent")), each.get("name")
                assert named == ("map", "base") or "name" in told or "frame" in told, (ring, each, told)


def stamp_of(record: dict[str, object]) -> int:
    """Return the time of a record; 0 where it has none."""
    if "stamp_ns" in record:
        return int(str(record["stamp_ns"]))
    whole, _, below = str(record.get("stamp", "0")).partition(".")
    return int(whole) * 10**9 + int(below.ljust(9, "0") or 0)


@pytest.mark.parametrize("form", ["pcd", "ply"])
def test_a_cloud_whose_header_lies_is_moved_or_refused(form: str, tool: Tool) -> None:
    points = cloud(40, intensity="<f4", ring="<u2")
    made = {"pcd": [pcd(points), pcd(points, "ascii")], "ply": [ply(points), ply(points, "ascii"), ply(points, "binary_big_endian")]}
    for random in cases(0.4):
        data = random.choice(made[form])
        end = data.index(b"\nDATA" if form == "pcd" else b"end_header")
        lines = data[:end].split(b"\n")
        for _ in range(random.choice([1, 1, 2])):
            at = random.randrange(1, len(lines))
            words = lines[at].split(b" ")
            words[random.randrange(len(words))] = random.choice(LIES).encode()
            lines[at] = random.choice([b" ".join(words), b" ".join(words), b"", lines[at] + b"\n" + lines[at]])
        Path(f"in.{form}").write_bytes(b"\n".join(lines) + data[end : random.choice([len(data), len(data), end + 40])])
        into = random.choice([form, form, "csv"])
        done = tool("apply", "--transform", MOVED, "-i", f"in.{form}", *(["--format=csv"] if into == "csv" else ["-o", f"out.{form}", "--force"]))
        assert done.status or into == "csv" or Path(f"out.{form}").exists()


UNITS = [" ", "\n", "\t", "\r\n", "[", "]", "{", "}", '"', "'", ", ", "- ", "-", "---\n", "# a\n", "\\", "\ufeff", "1", "1 ", "1\n", "e+", "[1,", '{"a":', "},{", "a: ", "a:\n", "&", "\\\\ ", "<", "At time 1\n", "[a] x\n"]
BEFORE = ["", '{"x":1,"y":2,"z":3}', '[{"x":1,"y":2,"z":3}', "xyz: [1, 2, 3", "x,y,z\n1,2,3\n", "1 2 3", "T = ", "frames:\n  a: ", "- ", "t = 1, 2, 3"]
TEXTS = [["convert"], ["apply", "--transform", MOVED], ["compose", "-", MOVED], ["mean"], ["check", "-"], ["tree", "-"], ["calc", "row"], ["echo", "-", "a", "b"]]


def test_a_text_that_repeats_itself_takes_time_in_proportion(tool: Tool) -> None:
    def took(count: int) -> float:
        begin = process_time()
        tool(*command, stdin=f"{before}{unit * (count // len(unit))}{behind}".encode())
        return process_time() - begin

    for random in cases(0.15):
        command, before, unit, behind = random.choice(TEXTS), random.choice(BEFORE), random.choice(UNITS), random.choice(["", "x", "]\n", "1"])
        if (long := took(60_000)) > 1.0:
            assert long < 9 * took(15_000), (command, before, unit, behind)
