"""Every example that the README and the helps give runs, and prints what they say."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import TYPE_CHECKING

import click
import console
import make_picture
import pytest
from in_process import printed, run_line, understands

from frametool.cli.commands import COMMANDS, group
from frametool.geometry.representations import REPRESENTATIONS

if TYPE_CHECKING:
    from pathlib import Path

README = (console.ROOT / "README.md").read_text()
COOKBOOK = (console.ROOT / "examples" / "COOKBOOK.md").read_text()
SKILL = (console.ROOT / "examples" / "SKILL.md").read_text()
QUESTIONS, ANSWERS = ([pair for block in console.BLOCK.findall(text) for pair in console.commands(block)] for text in (README, COOKBOOK))
EXAMPLES = QUESTIONS + ANSWERS
HELPS = [
    (name, each.help)
    for name in COMMANDS
    for command in [group.get_command(click.Context(group), name)]
    for each in (command, *getattr(command, "commands", {}).values())
]
HELP_EXAMPLES = [
    (name, line.strip())
    for name, text in HELPS
    for block in re.findall(r"(?s)\x08\n(.*?)\n\n", f"{text}\n\n")
    for line in block.splitlines()
    if "frametool " in line and "teleop" not in line  # which wants keys
]


STATED = re.compile(r"frametool: \S+: .*\(--")  # what was assumed of a file


@pytest.fixture(scope="module")
def bin_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder that holds the command."""
    return tmp_path_factory.mktemp("bin")


def shown(command: str, bin_folder: Path) -> str:
    """Return what a terminal shows; README's own questions are asked by processes too, as a person asks them."""
    text = printed(command, console.ROOT, console.WIDTH) if understands(command) else console.printed(command, bin_folder)
    assert command not in dict(QUESTIONS) or text == console.printed(command, bin_folder)
    return text


@pytest.mark.parametrize(("command", "output"), EXAMPLES, ids=[command for command, _ in EXAMPLES])
def test_a_readme_example_prints_what_the_readme_shows(command: str, output: str, bin_folder: Path) -> None:
    words, numbers = console.split(shown(command, bin_folder))
    assert words == console.split(output)[0]
    assert numbers == pytest.approx(console.split(output)[1], rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(("name", "command"), HELP_EXAMPLES, ids=[command for _, command in HELP_EXAMPLES])
def test_an_example_in_a_help_runs(name: str, command: str, examples_folder: Path) -> None:
    done = run_line(command, examples_folder, pipefail=True)
    differs = {1} if command.startswith("sed") and name == "diff" else set()
    assert done.status in {0} | differs, done.err
    assert name in ("sim", "project", "monitor", "check", "diff", "relative", "solve", "record") or "--robust" in command or not [line for line in done.err.splitlines() if not STATED.match(line)]  # these sum up what they did or found


def test_every_command_has_an_example_in_its_help_and_in_the_readme() -> None:
    assert {name for name, _ in HELP_EXAMPLES} == set(COMMANDS)
    assert {name for name in COMMANDS if any(f"frametool {name}" in command for command, _ in EXAMPLES)} == set(COMMANDS)


def test_the_readme_mentions_every_command_and_representation() -> None:
    assert [name for name in (*COMMANDS, *REPRESENTATIONS) if f"`{name}" not in README] == []


def test_the_readme_is_short_and_the_cookbook_is_not() -> None:
    assert README.count("\n") <= 140
    assert SKILL.count("\n") <= 80
    assert COOKBOOK.count("\n### ") >= 90


def test_the_picture_shows_what_the_commands_print() -> None:
    words, numbers = console.split(make_picture.picture())
    assert words == console.split(make_picture.PICTURE.read_text())[0]
    assert numbers == pytest.approx(console.split(make_picture.PICTURE.read_text())[1], abs=0.11)  # the drawing, to a tenth


def test_links_lead_to_files() -> None:
    links = {re.sub(r"https://.*?/blob/[^/]+/", "", link) for link in re.findall(r"\]\(([^)]+)\)", README + COOKBOOK)}  # as a release has them
    assert links
    assert [each for each in links if not any((folder / each).is_file() for folder in (console.ROOT, console.ROOT / "examples"))] == []


@pytest.mark.parametrize("command", re.findall(r"(?m)^frametool .*", SKILL))
def test_a_command_of_the_skill_runs(command: str) -> None:
    assert run_line(command, console.ROOT).status in (0, 3)


@pytest.mark.parametrize("text", [README, SKILL], ids=["README", "SKILL"])
def test_the_python_example_runs(text: str) -> None:
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    done = subprocess.run([sys.executable, "-c", code], cwd=console.ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_trees_shown_in_the_readme_are_read(tmp_path: Path) -> None:
    from frametool import load

    for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)):
        path = tmp_path / f"{number}.yaml"
        path.write_text(text)
        assert len(load(path).frames) > 1
