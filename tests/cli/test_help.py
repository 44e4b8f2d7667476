"""`help`: each subject fits a screen, its examples run, and it says all that the tables hold."""

from __future__ import annotations

import json
import re
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import pytest
from in_process import run_line

from frametool.cli.command import EXIT_CODES, HEADINGS
from frametool.cli.commands import COMMANDS, group
from frametool.cli.commands import help as examples
from frametool.cli.commands.help import questions, topic, topics
from frametool.cli.commands.sim import SUBCOMMANDS
from frametool.errors import FileProblem
from frametool.geometry.conventions import AXES
from frametool.geometry.representations import REPRESENTATIONS

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parent.parent.parent
TOPICS = topics()
WORDS = [(name,) for name in COMMANDS] + [("sim", name) for name in SUBCOMMANDS]
EXAMPLES = [found[0] for name in TOPICS for found in re.finditer(r"(?m)^  (?=frametool|printf|echo)(?:.*\|\n)?.*", topic(name))]


@pytest.mark.parametrize("name", TOPICS)
def test_a_subject_fits_a_screen_and_has_examples(name: str) -> None:
    lines = topic(name).splitlines()
    assert len(lines) <= 48
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("  ") and "frametool " in line for line in lines)


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_a_subject_runs(example: str, examples_folder: Path) -> None:
    done = run_line(example, examples_folder, pipefail=True)
    assert done.status == 0, done.err
    assert done.out or "|| true" in example or "check" in example


def test_every_representation_convention_and_exit_code_is_explained() -> None:
    assert all(f" {name}" in topic("rotations") for name in REPRESENTATIONS)
    assert all(f"  {name} " in topic("axes") for name in AXES)
    codes = [code.split()[0] for code in EXIT_CODES.removeprefix("Exit codes: ").split(", ")]
    assert all(f"\n  {code} " in topic("errors") for code in (*codes, "130"))


def test_help_lists_subjects_and_commands(run: Callable[..., Any]) -> None:
    done = run("help")
    assert all(f"  {name} " in done.out and about in done.out for name, about in TOPICS.items())
    assert all(name in done.out for name in COMMANDS)
    assert run("help", "axes").out == topic("axes")


def test_the_version_can_tell_what_it_runs_on(run: Callable[..., Any]) -> None:
    for order in (("--version", "-v"), ("-v", "--version")):
        lines = run(*order).out.splitlines()
        assert lines[0] == run("--version").out.strip()
        assert [line.split()[0] for line in lines] == ["frametool", "Python", "numpy", "click", "rich", "pyyaml", "rosbags", "pyarrow", "laspy", "matplotlib"]


def test_help_of_a_command_is_its_own(run: Callable[..., Any]) -> None:
    assert run("help", "lookup").out == run("lookup", "--help").out


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("extrinsics", "solve"), ("extrinsic calibration", "formats"), ("align", "trajectories"), ("hand-eye", "solve"), ("Hand Eye", "solve"),
        ("GPS", "trajectories"), ("quaternion order", "rotations"), ("umeyama", "trajectories"), ("ATE", "trajectories"), ("uncertainty", "covariance"),
        ("bags", "recordings"), ("URDF", "rotations"), ("unity", "axes"), ("gimbal", "euler"), ("wxyz", "rotations"), ("tf2_echo", "recordings"),
        ("plot", "trajectories"), ("drift", "trajectories"),
        ("KUKA", "robots"), ("KUKA ABC", "robots"), ("fanuc wpr", "robots"), ("kinova", "robots"), ("universal robots", "robots"), ("isaac", "robots"),
        ("DJI", "robots"), ("carla", "robots"), ("airsim", "robots"), ("PX4", "robots"), ("y-up", "robots"), ("z-up", "robots"), ("ik", "robots"), ("inverse kinematics", "robots"),
        ("plot", "robots"), ("drift", "robots"), ("ned", "axes"), ("ENU", "axes"), ("ned", "robots"),
    ],
)  # fmt: skip
def test_a_word_people_search_for_finds_its_topic(words: str, found: str, run: Callable[..., Any]) -> None:
    done = run("help", *words.split())
    assert (done.status, done.err) == (0, "")
    assert f"  {found} " in done.out or f"help {found}" in " ".join(done.out.split()) or done.out == topic(found)


@pytest.mark.parametrize(("word", "found"), [("rotation", "rotations"), ("trajectory", "trajectories"), ("poses", "pose"), ("Covariances", "covariance"), ("error", "errors"), ("frame", "frames")])
def test_a_subject_is_found_in_any_number_and_case(word: str, found: str, run: Callable[..., Any]) -> None:
    assert run("help", word).out == topic(found)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("rotatoins",), "no topic, command or text has 'rotatoins'; did you mean 'rotations'?"),
        (("quaternoin",), "no topic, command or text has 'quaternoin'; did you mean 'quaternion'?"),
        (("eular",), "no topic, command or text has 'eular'; did you mean 'euler'?"),
        (("recrods",), "no topic, command or text has 'recrods'; did you mean 'records' or 'record' or 'recordings'?"),
        (("xyzzyx",), "no topic, command or text has 'xyzzyx'; `frametool help` lists all topics"),
        (("(",), "no topic, command or text has '('; `frametool help` lists all topics"),
        (("cookbook", "xyzzyx"), "no question has 'xyzzyx'; `frametool help cookbook` lists all"),
        (("-f", "json", "lokup"), "-f json is about commands, and 'lokup' is not one; did you mean 'lookup'?"),
        (("-f", "json", "pose"), "-f json is about commands, and 'pose' is not one; did you mean 'compose'?"),
    ],
)
def test_a_word_that_is_nowhere_names_all_that_are_near(words: tuple[str, ...], message: str, run: Callable[..., Any]) -> None:
    done = run("help", *words)
    assert (done.status, done.out) == (2, "")
    assert f"help: {message}" in done.err
    assert done.err.count("\n") == 1
    assert "json" in words or len(done.err) <= 200


@pytest.mark.parametrize("question", questions())
def test_a_question_of_the_cookbook_is_shown_by_its_own_words(question: str, run: Callable[..., Any]) -> None:
    done = run("help", "cookbook", *question.split())
    assert f"{question}\n\n{questions()[question]}\n" in done.out
    assert "frametool " in questions()[question]
    assert "```" not in done.out


def test_the_cookbook_lists_its_questions_and_shows_those_with_a_word(run: Callable[..., Any]) -> None:
    everything = run("help", "cookbook").out
    assert all(f"  {each}\n" in everything for each in questions())
    done = run("help", "cookbook", "gimbal")
    assert "$ frametool convert --from rpy_deg 10 90 20 --to rpy_deg -f json" in done.out
    assert run("help", "cookbook", "kdl").status == 2


def test_the_subject_of_streams_names_the_commands_that_read_rows(run: Callable[..., Any]) -> None:
    named = re.split(r", | and ", " ".join(topic("streams").split("\n\n")[1].split()).partition(" read rows")[0])
    assert sorted(named) == sorted(name for name in COMMANDS if "  -i, --input FILE" in run(name, "--help-all").out)


def test_common_options_are_explained_in_one_place(run: Callable[..., Any]) -> None:
    text = run("help", "common").out
    shown = {option.name: option for words in WORDS for option in options_of(words)}
    assert all(f"\n{title}:\n" in text for title in HEADINGS[1:])
    common = [option for option in shown.values() if getattr(option, "under", HEADINGS[0]) != HEADINGS[0]]
    assert all(re.search(rf"(?m)^  (?:-\w, )?{option.opts[-1]}\b", text) for option in common)


def test_programs_are_told_all_commands_options_values_and_exit_codes(run: Callable[..., Any]) -> None:
    done = run("help", "-f", "json")
    assert done.out.count("\n") == 1
    whole = json.loads(done.out)
    assert {each["name"] for each in whole["commands"]} == {" ".join(words) for words in WORDS}
    assert set(TOPICS) < set(whole["topics"])
    for entry in whole["commands"]:
        words = tuple(entry["name"].split())
        assert json.loads(run("help", "-f", "json", *words).out) == entry
        assert {name for each in entry["options"] for name in each["names"]} == {name for each in options_of(words) for name in each.opts}
        assert all(each["help"] and each["metavar"] != "" for each in entry["options"])
        assert entry["exit_codes"]["0"]
        assert entry["exit_codes"]["130"] == "interrupted"
        assert entry["examples"]
    lookup = next(each for each in whole["commands"] if each["name"] == "lookup")
    assert [each["name"] for each in lookup["arguments"]] == ["TREE", "TARGET", "SOURCE"]
    assert next(each for each in lookup["options"] if "--to" in each["names"])["choices"][:2] == ["quaternion", "xyzw"]
    assert next(each for each in lookup["options"] if "--at" in each["names"])["default"] == "latest"
    assert whole["formats"] == [json.loads(line) for line in run("formats", "-f", "json").out.splitlines()]
    assert whole["exit_codes"] == lookup["exit_codes"] == {"0": "done", "1": "bad data", "2": "usage", "3": "rows skipped", "4": "lookup", "5": "file", "130": "interrupted"}


def test_what_an_assistant_reads_is_printed(run: Callable[..., Any]) -> None:
    assert run("help", "skill").out == run("examples", "SKILL.md").out == (ROOT / "examples" / "SKILL.md").read_text()


def test_examples_are_listed_printed_and_copied_whole(run: Callable[..., Any], tmp_path: Path) -> None:
    kept = {path.name: path.read_bytes() for path in (ROOT / "examples").iterdir()}
    assert run("examples").out.split() == sorted(kept)
    assert run("examples", "robot.yaml").out.encode() == run("examples", "examples/robot.yaml", "-o", "-").out.encode() == kept["robot.yaml"]
    assert run("examples", "-o", "new/folder") == (0, "", "")
    assert {path.name: path.read_bytes() for path in (tmp_path / "new" / "folder").iterdir()} == kept
    assert run("examples", "walk.tum", "-o", "my.tum").status == run("examples", "walk.tum", "-o", "new").status == 0
    assert (tmp_path / "my.tum").read_bytes() == (tmp_path / "new" / "walk.tum").read_bytes() == kept["walk.tum"]


def test_examples_replace_nothing_without_being_told(run: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    mine = tmp_path / "there" / "walk.tum"
    mine.write_text("mine")
    for words in (("-o", "there"), ("walk.tum", "-o", "there"), ("walk.tum", "-o", "there/walk.tum")):
        done = run("examples", *words)
        assert (done.status, done.err) == (5, "frametool: there/walk.tum: exists; give --force to replace it\n")
        assert [path.name for path in (tmp_path / "there").iterdir()] == ["walk.tum"]
    assert run("examples", "-o", "there", "--force").status == 0
    assert mine.read_text() != "mine"


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (("robto.yaml",), 2, "no example 'robto.yaml'; did you mean 'robot.yaml'?"),
        (("xyzzy",), 2, "no example 'xyzzy'; `frametool examples` lists all"),
        (("-o", "-"), 2, "--output - prints one example; name it, or a folder for all"),
        (("--force",), 2, "--force needs --output"),
        (("-o", "file"), 5, "file: file exists"),
    ],
)
def test_what_is_no_example_is_refused(words: tuple[str, ...], status: int, message: str, run: Callable[..., Any]) -> None:
    done = run("examples", *words, files={"file": "mine"})
    assert (done.status, done.out) == (status, "")
    assert message in done.err


def test_a_plain_install_has_the_examples_where_they_are_looked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["force-include"] == {"examples": "frametool/examples"}
    assert examples.EXAMPLES in (f"{examples.PACKAGE}/examples", str(ROOT / "examples"))
    monkeypatch.setattr(examples, "EXAMPLES", str(tmp_path / "examples"))
    with pytest.raises(FileProblem, match="the example files are missing; install frametool anew"):
        examples.names()
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples" / "a.yaml").write_text("a: 1")
    assert examples.names() == ["a.yaml"]


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_the_help_of_a_command_has_at_most_45_lines_of_80_and_no_group_that_is_empty(words: tuple[str, ...], run: Callable[..., Any]) -> None:
    lines = run(*words, "--help").out.splitlines()
    assert len(lines) <= 45
    assert max(map(len, lines)) <= 80
    assert not [line for line, after in pairwise(lines) if line.endswith("):") and not after.startswith("  ")]


def options_of(words: tuple[str, ...]) -> list[click.Option]:
    command = group.get_command(click.Context(group), words[0])
    command = command.commands[words[1]] if isinstance(command, click.Group) and words[1:] else command
    return [each for each in command.get_params(click.Context(command)) if isinstance(each, click.Option) and not each.hidden]


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_every_option_stands_in_the_short_help_or_its_group_and_with_a_word_in_the_whole(words: tuple[str, ...], run: Callable[..., Any]) -> None:
    brief, whole = run(*words, "--help").out, run(*words, "--help-all").out
    own = brief[brief.index("\nOptions:") : brief.find("\nCommon options")]
    for option in options_of(words):
        assert option.help
        assert any(f"  {name}" in own for name in option.opts) or f" {option.opts[0]}" in brief or " ..\n" in brief  # a long line is cut
        assert re.search(rf"(?m)^  (?:-\w, )?{option.opts[-1]}\b.*\n?.*[a-z]", whole)
    assert own.count("\n  -") >= 1


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_only_the_help_on_formats_lists_them(words: tuple[str, ...], run: Callable[..., Any]) -> None:
    text = " ".join(run(*words, "--help-all").out.split())
    assert "tum, bag1, bag2" not in text
    assert "tum, euroc, colmap" not in text
