"""What a shell offers when Tab is pressed, and that the scripts of the shells carry it over."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
from typing import TYPE_CHECKING, Any

import console
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SCRIPTS = console.ROOT / "frametool" / "cli" / "completions"
READY = "ready>"
FILES = {
    "a.csv": "id,x,y,z\n1,2,3,4\n", "a.tum": "# t x y z qx qy qz qw\n0 1 2 3 0 0 0 1\n", "a.jsonl": '{"t": 1, "point": {"x": 1}}\n', "a.bin": "\x00\x01",
    "arm.urdf": '<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>' + "".join(
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>{limit}</joint>'
        for name, kind, parent, child, limit in (
            ("shoulder", "revolute", "a", "b", '<limit lower="-2" upper="1.5" effort="1" velocity="1"/>'),
            ("slide", "prismatic", "b", "c", '<limit lower="0" upper="0.25" effort="1" velocity="1"/>'), ("wrist", "continuous", "c", "d", ""),
        )
    ) + "</robot>",
    "tree.yaml": "frames: {base: {my frame: {xyz: [1, 2, 3]}, 'arm:left': {xyz: [1, 2, 3]}, 'arm:right': {xyz: [1, 2, 3]}, tool=x: {xyz: [1, 2, 3]}, $c*: {xyz: [1, 2, 3]}, \"t\\tb\": {xyz: [1, 2, 3]}}}",
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a folder with files, a home of its own and the command on the path."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    console.printed("true", tmp_path)  # makes the command
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    return tmp_path


@pytest.fixture
def answered(run: Callable[..., Any], folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], list[list[str]]]:
    """Ask the tool as the scripts do."""
    del folder

    def ask(line: str) -> list[list[str]]:
        monkeypatch.setenv("_FRAMETOOL_COMPLETE", "words")
        done = run(line)
        assert (done.status, done.err) == (0, "")
        return [row.split("\t") for row in done.out.splitlines()]

    return ask


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("loo", ["lookup"]),
        ("sim f", ["follow"]),
        ("convert --fro", ["--from"]),
        ("convert --axes fl", ["flu"]),
        ("convert --axes unity_from_f", ["unity_from_flu", "unity_from_frd"]),
        ("convert --world-axes enu_from_n", ["enu_from_ned"]),
        ("convert --to euler:rzy", ["euler:rzyx", "euler:rzyz"]),
        ("convert --to=rpy,euler:rzy", ["--to=rpy,euler:rzyx", "--to=rpy,euler:rzyz"]),
        ("convert -i a.csv --columns x,y,", ["x,y,id", "x,y,x", "x,y,y", "x,y,z"]),
        ("convert -i a.tum --columns q", ["qx", "qy", "qz", "qw"]),
        ("apply -i a.jsonl --time-column p", ["point", "point.x"]),
        ("calc -i a.csv --time-column i", ["id"]),
        ("mean -i a.csv --weights z", ["z"]),
        ("lookup tree.yaml ", ["base", "my frame", "arm:left", "arm:right", "tool=x", "$c*"]),
        ("lookup tree.yaml base arm:l", ["arm:left"]),
        ("monitor tree.yaml base arm:l", ["arm:left"]),
        ("lookup ~/tree.yaml 'my f", ["my frame"]),
        ("lookup tree.yaml my\\ f", ["my frame"]),
        ("compose '{xyz: [1, 2, 3]}' --outp", ["--output"]),
        ("lookup arm.urdf a b -j ", ["shoulder=", "slide=", "wrist="]),
        ("lookup arm.urdf -j s", ["shoulder=", "slide="]),
        ("fk arm.urdf a b --joint=sl", ["--joint=slide="]),
        ("lookup arm.urdf a b -j slide=", ["slide=0.0", "slide=0.25"]),
        ("lookup arm.urdf a b -j wrist=", []),
        ("lookup tree.yaml a b -j ", []),
        ("lookup a b -j ", []),
        ("convert -i none.csv --columns x", []),
        ("convert -i a.bin --columns x", []),
        ("convert --columns x", []),
        ("lookup none.yaml ", []),
    ],
)
def test_words_are_offered_from_what_there_is(words: str, offered: list[str], answered: Callable[[str], list[list[str]]]) -> None:
    assert [row[:2] for row in answered(f"frametool {words}")] == [["plain", each] for each in offered]


def test_a_name_of_a_file_is_left_to_the_shell(answered: Callable[[str], list[list[str]]]) -> None:
    assert [answered(f"frametool {words}") for words in ("lookup tr", "convert -o ", "convert --output=x")] == [[["file", "tr", ""]], [["file", "", ""]], [["file", "--output=x", ""]]]


@pytest.mark.parametrize(
    "words",
    ["monitor", "compare", "compare a", "align a", "resample", "static", "mean", "compose a", "convert",
     "invert", "relative a", "solve", "record", "sim follow --leader", "solve a --fix", "sim run", "sim follow --plot",
     "compare a b --report", "solve a --report"],
)  # fmt: skip
def test_files_are_completed_wherever_one_may_be(words: str, answered: Callable[[str], list[list[str]]]) -> None:
    assert answered(f"frametool {words} tr") == [["file", "tr", ""]]


def test_a_command_is_offered_with_what_it_does(answered: Callable[[str], list[list[str]]]) -> None:
    assert answered("frametool inv") == [["plain", "invert", "the inverse of a pose: a_from_b -> b_from_a"]]


def test_a_shell_that_is_not_known_is_told_which_are(run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", "tcsh_source")
    assert run() == (2, "", "frametool: _FRAMETOOL_COMPLETE is 'tcsh_source'; it prints the completions of a shell as bash_source, fish_source, zsh_source\n")


@pytest.mark.parametrize("shell", ["bash", "fish", "zsh"])
def test_the_script_that_is_installed_is_the_one_that_is_printed(shell: str, run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", f"{shell}_source")
    assert run() == (0, (SCRIPTS / shell).read_text(), "")


# how each shell is told, at its start, what to say when it is ready and how frametool is completed
STARTS = {
    "bash": ("rc", f"PS1='{READY}'; source {SCRIPTS}/bash", ["bash", "--rcfile", "rc", "-i"]),
    "fish": ("rc", f"function fish_prompt; echo -n '{READY}'; end; source {SCRIPTS}/fish", ["fish", "--no-config", "-C", "source rc"]),
    "zsh": (".zshrc", f"PS1='{READY}'; autoload -Uz compinit; compinit -u; source {SCRIPTS}/zsh", ["zsh", "-i"]),
}
TYPED = {
    "frametool loo": ["lookup"],
    "frametool lookup tree.yaml arm:l": ["lookup", "tree.yaml", "arm:left"],
    "frametool lookup tree.yaml my\\ f": ["lookup", "tree.yaml", "my frame"],
    "frametool lookup tree.yaml 'my f": ["lookup", "tree.yaml", "my frame"],
    "frametool lookup tree.yaml base too": ["lookup", "tree.yaml", "base", "tool=x"],
    "frametool lookup tree.yaml \\$": ["lookup", "tree.yaml", "$c*"],
    "frametool convert --to euler_deg:sxyz,mat": ["convert", "--to", "euler_deg:sxyz,matrix"],
    "frametool convert --to=euler:sxyz,qua": ["convert", "--to=euler:sxyz,quaternion"],
    "frametool convert -i a.t": ["convert", "-i", "a.tum"],
    "frametool lookup arm.urdf a b -j wri": ["lookup", "arm.urdf", "a", "b", "-j", "wrist="],
    "frametool lookup arm.urdf a b -j slide=0.2": ["lookup", "arm.urdf", "a", "b", "-j", "slide=0.25"],
    "frametool convert -i tree.yaml --output=a.t": ["convert", "-i", "tree.yaml", "--output=a.tum"],
}


@pytest.mark.parametrize("shell", [pytest.param(name, marks=pytest.mark.skipif(not shutil.which(name), reason=f"{name} is not installed")) for name in STARTS])
def test_a_tab_completes_the_line(shell: str, folder: Path) -> None:
    assert entered(shell, folder, [*TYPED]) == [["frametool", *words] for words in TYPED.values()]


def entered(shell: str, folder: Path, lines: list[str]) -> list[list[str]]:
    """Type each line in a terminal, then Tab; return the words that the shell makes of it."""
    name, setup, program = STARTS[shell]
    (folder / name).write_text(f"{setup}\n")
    show = folder / "show"
    show.write_text("#!/bin/sh\n{ printf '%s\\n' \"$@\"; echo; } >> words\n")
    show.chmod(0o755)
    environment = {"PATH": os.environ["PATH"], "HOME": str(folder), "TERM": "dumb", "LC_ALL": "C.UTF-8"}
    own, theirs = pty.openpty()
    opened = 'terminal=$1; shift; exec "$@" < "$terminal" > "$terminal" 2>&1'  # a shell wants to be master of its terminal
    command = ["sh", "-c", opened, "sh", os.ttyname(theirs), *program]
    with subprocess.Popen(command, cwd=folder, env=environment, start_new_session=True) as process:
        seen = ""
        while READY not in seen:
            seen += os.read(own, 4096).decode()
        found: list[list[str]] = []
        for number, line in enumerate(lines, 1):
            os.write(own, f"{line}\t\x01show \r".encode())
            while len(found) < number:
                assert select.select([own], [], [], 60)[0], seen
                seen += os.read(own, 4096).decode()
                text = (folder / "words").read_text() if (folder / "words").exists() else ""
                found = [each.split("\n") for each in text.split("\n\n")[:-1]]
        process.kill()
    os.close(theirs)
    os.close(own)
    return found
