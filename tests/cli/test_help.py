"""`help`: each subject fits a screen, its examples run, and it says all that the tables hold."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import pytest

from frametool.cli.commands import COMMANDS
from frametool.cli.commands.help import topic, topics
from frametool.cli.commands.sim import SUBCOMMANDS
from frametool.cli.options import EXIT_CODES
from frametool.geometry.conventions import AXES
from frametool.geometry.representations import REPRESENTATIONS

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parent.parent.parent
TOPICS = topics()
EXAMPLES = [found[0] for name in TOPICS for found in re.finditer(r"(?m)^  (?=frametool|printf|echo)(?:.*\|\n)?.*", topic(name))]


@pytest.mark.parametrize("name", TOPICS)
def test_a_subject_fits_a_screen_and_has_examples(name: str) -> None:
    lines = topic(name).splitlines()
    assert len(lines) <= 48
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("  ") and "frametool " in line for line in lines)


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_a_subject_runs(example: str, tmp_path: Path) -> None:
    for file in (ROOT / "examples").iterdir():
        if file.is_file():
            shutil.copy(file, tmp_path)
    script = tmp_path / "frametool"
    script.write_text(f'#!/bin/sh\nexec {sys.executable} -m frametool "$@"\n')
    script.chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", example], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    leaves_out = "frametool solve" in example or "--robust" in example
    assert done.returncode in ((0, 3) if leaves_out else (0,)), done.stderr
    assert done.stdout or "|| true" in example or "check" in example


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
        assert [line.split()[0] for line in lines] == ["frametool", "Python", "numpy", "click", "rich", "pyyaml", "rosbags", "pyarrow", "matplotlib"]


def test_help_of_a_command_is_its_own(run: Callable[..., Any]) -> None:
    assert run("help", "lookup").out == run("lookup", "--help").out


def test_a_word_that_is_no_subject_names_the_nearest(run: Callable[..., Any]) -> None:
    done = run("help", "rotation")
    assert done.status == 2
    assert "no topic 'rotation'; did you mean 'rotations'?" in done.err


WORDS = [(name,) for name in COMMANDS] + [("sim", name) for name in SUBCOMMANDS]


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_the_help_of_a_command_has_at_most_45_lines_of_80_and_no_group_that_is_empty(words: tuple[str, ...], run: Callable[..., Any]) -> None:
    lines = run(*words, "--help").out.splitlines()
    assert len(lines) <= 45
    assert max(map(len, lines)) <= 80
    assert not [line for line, after in pairwise(lines) if line.endswith("):") and not after.startswith("  ")]


def options_of(words: tuple[str, ...]) -> list[click.Option]:
    command = import_module(COMMANDS[words[0]][0]).command
    command = command.commands[words[1]] if words[1:] else command
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
