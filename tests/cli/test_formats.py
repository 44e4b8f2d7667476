"""`formats`: the table of forms as people and programs read it."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING

import pytest
import yaml

import frametool
from frametool.formats.table import FORMATS, Format, option_of
from frametool.grammar.edges import Answers

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

LISTED = ("summary", "reads", "writes", "suffixes", "states", "asks")


def words(text: str) -> str:
    """Undo the folding of lines."""
    return " ".join(text.split())


def test_the_list_names_every_form_with_what_the_table_says_of_it(run: Run) -> None:
    found = run("formats")
    assert (found.status, found.err) == (0, "")
    for name, row in FORMATS.items():
        assert f"\n  {name} " in found.out
        assert all(words(said) in words(found.out) for said in (row.summary, row.conventions))
    assert max(map(len, found.out.splitlines())) <= 80


def test_the_list_is_parted_into_what_is_read_and_what_is_only_written(run: Run) -> None:
    parts = [part.splitlines()[0] for part in run("formats").out.split("\n\n")]
    assert parts == ["read:", "only written:"]


def test_json_has_one_object_a_line_with_all_the_table_says(run: Run) -> None:
    entries = [json.loads(line) for line in run("formats", "-f", "json").out.splitlines()]
    assert [entry["name"] for entry in entries] == list(FORMATS)
    for entry in entries:
        row = FORMATS[entry.pop("name")]._asdict()
        row |= {"states": row["conventions"], "asks": list(map(option_of, row["required_options"]))}
        assert entry == {key: (row[key] or None) if isinstance(row[key], str) else list(row[key]) for key in LISTED}


def test_yaml_and_csv_say_the_same_as_json(run: Run) -> None:
    entries = [json.loads(line) for line in run("formats", "-f", "json").out.splitlines()]
    assert list(yaml.safe_load_all(run("formats", "-f", "yaml").out)) == entries
    rows = list(csv.DictReader(io.StringIO(run("formats", "-f", "csv").out)))
    assert rows == [
        {key: " ".join(value) if isinstance(value, list) else value or "" for key, value in entry.items()}
        for entry in entries
    ]


@pytest.mark.parametrize("name", FORMATS)
def test_one_form_is_told_in_full_within_80_columns(run: Run, name: str) -> None:
    found = run("formats", name)
    assert (found.status, found.err) == (0, "")
    assert words(found.out).startswith(words(f"{name} {FORMATS[name].summary}"))
    assert max(map(len, found.out.splitlines())) <= 80
    assert all(suffix in found.out for suffix in FORMATS[name].suffixes)


@pytest.mark.parametrize(
    ("name", "example"),
    [("csv", "camera,map,1.0,2.0,3.0"), ("calls", "--x 0.1 --y 0.0"), ("yaml", "{name: lidar, parent: base")],
)
def test_an_example_stands_where_the_reader_or_the_writer_shows_one(run: Run, name: str, example: str) -> None:
    assert f"\n    {example}" in run("formats", name).out.partition("  example\n")[2].join(["\n", ""])


def test_a_row_with_all_there_can_be_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    row = Format("a toy", (".toy",), ("tree",), "frametool.formats.trees.tree_reader", conventions="toy<-child, feet",
                 required_options=("direction", "frames"), magic=(("xml", "toy"), ("line", r"toy \d")))  # fmt: skip
    monkeypatch.setitem(FORMATS, "a-toy-with-a-long-name", row)
    told = words(run("formats", "a-toy-with-a-long-name").out)
    assert "a toy (.toy) read as tree toy<-child, feet" in told
    assert "asks for --direction parent-from-child|child-from-parent asks for --frames" in told
    assert "known by xml toy, line" in told
    assert "a-toy-with-a-long-name a toy (.toy) read as tree toy<-child, feet asks for --direction" in words(run("formats").out)


@pytest.mark.parametrize("name", FORMATS)
def test_what_a_form_asks_for_is_an_answer_that_options_give(name: str) -> None:
    assert set(FORMATS[name].required_options) <= set(Answers._fields)


def test_a_misspelled_form_is_told_with_the_nearest(run: Run) -> None:
    found = run("formats", "jsno")
    assert (found.status, found.out) == (2, "")
    assert "no format 'jsno' is known (`frametool formats` lists all); did you mean 'json'?" in found.err


def test_the_suffix_of_the_output_chooses_the_form_of_the_list(run: Run, tmp_path: object) -> None:
    assert run("formats", "-o", "a.json").status == 0
    assert json.loads((tmp_path / "a.json").read_text().splitlines()[0])["name"] == "yaml"  # type: ignore[operator]


def test_python_users_have_the_same_table() -> None:
    assert frametool.FORMATS is FORMATS


@pytest.mark.parametrize("arguments", [("convert", "--from", "rpy", "0", "0", "1"), ("tree", "{frames: {a: {b: {xyz: [1, 2, 3]}}}}")])
def test_a_file_whose_suffix_is_no_form_says_what_it_holds(arguments: tuple[str, ...], run: Run, tmp_path: Path) -> None:
    note = "no format written here has the suffix '.foo'; it holds yaml, -f says another"
    assert run(*arguments, "-o", "out.foo").err == f"frametool: note: out.foo: {note}\n"
    assert (tmp_path / "out.foo").read_text() == run(*arguments, "-f", "yaml").out
    for quiet in (["-o", "out.yml"], ["-o", "plain"], ["-o", "other.foo", "-f", "yaml"], ["-o", "/dev/null"]):
        assert run(*arguments, *quiet).err == ""


@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("out.foo", "no format written here has the suffix '.foo'; it holds tum, -f says another"),
        *((name, "") for name in ("out.txt", "out.LOG", "out.dat", "out.tum", "out", "/dev/null")),
    ],
)
def test_a_stream_whose_suffix_is_no_form_says_what_it_holds(name: str, note: str, run: Run) -> None:
    arguments = ("convert", "-i", "a.tum", "-o", name)
    files = {"a.tum": "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"}
    done = run(*arguments, files=files)
    assert done == (0, "", f"frametool: note: {name}: {note}\n" if note else "")
    assert run(*arguments, *(() if name == "/dev/null" else ("--force",)), "--quiet", files=files).err == ""


@pytest.mark.parametrize(("name", "form"), [("out.kitti", "kitti"), ("out.EUROC", "euroc"), ("kitti.txt", "tum"), ("kitti", "tum")])
def test_the_name_of_a_form_is_a_suffix_of_it(name: str, form: str, run: Run, tmp_path: Path) -> None:
    arguments = ("convert", "-i", "a.tum", "--quiet")
    files = {"a.tum": "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"}
    assert run(*arguments, "-o", name, files=files).status == 0
    assert (tmp_path / name).read_text() == run(*arguments, "-f", form, files=files).out


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("autoware", "base_link: {sensor_kit"), ("handeye", "parameters: "), ("nuscenes", "calibrated_sensor.json "), ("named", "lidar: "),
        ("kitti-calib", "P0: "), ("kalibr", "baseline T_1_0:"), ("ros1", "header: "), ("foxglove", '{"timestamp": '), ("static2", "--x "),
    ],
)
def test_the_example_of_a_form_is_its_own_where_several_share_a_module(name: str, begin: str, run: Run) -> None:
    assert run("formats", name).out.partition("  example\n    ")[2].startswith(begin)
