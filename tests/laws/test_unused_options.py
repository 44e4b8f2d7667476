"""An option or an input that would not be used is a usage error, in every command: one line that names it, status 2."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import click
import pytest
from console import ROOT

from frametool.cli.commands import COMMANDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ways import Run

EXAMPLES = ROOT / "examples"
FILES = ("robot.yaml", "drive.yaml", "walk.tum", "arm.urdf", "joints.csv")
A, B = "{xyz: [1, 2, 3]}", "{rpy: [0, 0, 1]}"
POINT = '{"point": [1, 2, 3], "a": 4, "b": 5, "c": 6}\n'
ROWS = (
    "--columns=a,b,c", "--keep", "--prefix=q", "--no-header", "--on-error=skip", "--max-errors=3", "-i=walk.tum",
)  # fmt: skip
OF_POSES = (*ROWS, "--edges", "--array=x", "--camera-axes=opengl", "--stamps=walk.tum", "--in=csv")
OF_FILES = ("--frames=a,b", "--topic=/tf", "--dh=modified", "--direction=parent-from-child")
BINARY = ("-f", "npy", "-o", "x.npy")
# arguments that say all, and the options that have no use beside them
MODES: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("convert", A), (*OF_POSES, "--unwrap")),
    (("convert", "--from", "rpy", "0", "0", "1"), (*OF_POSES, "--unwrap", "--tolerance=1e-3")),
    (("convert", "--axes", "optical", A), OF_POSES),
    (("convert", "-i", "walk.tum"), ("--find=1,2,3", "--edges", "--array=x", "--stamps=walk.tum")),
    (("convert", "-i", "walk.tum", *BINARY), ("--precision=3",)),
    (("compose", A, B), OF_POSES),
    (("invert", A), OF_POSES),
    (("relative", A, B), (*OF_POSES, "--velocity", "--time-column=t")),
    (("relative", "--first", "-i", "walk.tum"), ("--time-column=t",)),
    (("mean", A, B), ROWS),
    (("mean", "walk.tum"), ("-i=walk.tum",)),
    (("lookup", "robot.yaml", "map", "tool"), (*ROWS, "--from=rpy", "--source-at=1", "--fixed=map", *OF_FILES)),
    (("lookup", "robot.yaml", "map", "tool", *BINARY), ("--precision=3",)),
    (("lookup", "drive.yaml", "map", "base_link", "--times", "1,2"), (*(each for each in ROWS if "on-error" not in each),)),
    (("lookup", "robot.yaml", "map", "--source-column", "a", "-i", "names.csv"), ("--times=1", "--from=rpy", "--columns=a")),
    (("apply", "robot.yaml", "map", "tool", "1", "2", "3"), (*ROWS, "--frame-column=f", "--time-column=t", "--array=x", *OF_FILES)),
    (("apply", "--transform", A, "1", "2", "3"), (*ROWS, "--at=1", "--time-column=t", "--stamps=walk.tum")),
    (("apply", "--transform", A), ("--columns=a,b,c", "--no-header", "--keep", "--prefix=q", "--array=x")),
    (("convert", "--explain", A), (*ROWS, "--array=x", "--edges")),
    (("tree", "robot.yaml"), OF_FILES),
    (("check", "robot.yaml"), OF_FILES),
    (("diff", "robot.yaml", "robot.yaml"), OF_FILES),
    (("monitor", "drive.yaml"), OF_FILES),
    (("view", "robot.yaml"), (*OF_FILES, "--path", "--sliders", "--overlay")),
    (("view", "robot.yaml", "-o", "x.svg"), ("--color=always",)),
    (("view", "robot.yaml", "-o", "x.glb"), ("--color=always", "--from=top")),
)  # fmt: skip
CASES = [(command, option) for command, options in MODES for option in options]


@pytest.mark.parametrize(("command", "option"), CASES, ids=lambda each: each if isinstance(each, str) else " ".join(each))
def test_an_option_without_use(run: Run, command: tuple[str, ...], option: str) -> None:
    files: dict[str, str | bytes] = {name: (EXAMPLES / name).read_bytes() for name in FILES}
    files["names.csv"] = "a\ntool\n"
    name, equals, value = option.partition("=")
    given = [name, value] if equals else [name]
    stdin = POINT if command == ("apply", "--transform", A) else ""
    done = run(*command, *given, files=files, stdin=stdin)
    assert (done.status, done.out) == (2, ""), done.err
    (line,) = (each for each in done.err.splitlines() if "warning:" not in each)
    assert {"-i": "-i" if "-i " in line else "--input"}.get(name, name.lstrip("-")) in line


def commands() -> Iterator[tuple[str, click.Option]]:
    for name, (module, _) in COMMANDS.items():
        command: click.Command = import_module(module).command
        for option in command.params:
            if isinstance(option, click.Option) and not (option.multiple or option.is_flag):
                yield name, option


@pytest.mark.parametrize(("command", "option"), [*commands()], ids=lambda each: each if isinstance(each, str) else each.opts[-1])
def test_an_option_of_one_value_given_twice(run: Run, command: str, option: click.Option) -> None:
    for names in ((option.opts[0],) * 2, (option.opts[0], option.opts[-1])):
        done = run(command, names[0], "1", names[1], "1")
        assert (done.status, done.out) == (2, "")
        assert f"{option.opts[-1]} is given twice; only one can be used" in done.err


@pytest.mark.parametrize("command", ["convert", "lookup", "tree", "compose", "view", "sim"])
def test_to_replace_a_file_there_must_be_one(run: Run, command: str) -> None:
    arguments = {"compose": (A, B), "convert": (A,), "sim": ("follow", "--duration", "1")}.get(command, ("robot.yaml", "map", "tool"))
    arguments = arguments[:1] if command == "tree" else arguments
    done = run(command, *arguments, "--force", files={"robot.yaml": (EXAMPLES / "robot.yaml").read_bytes()})
    assert done.status == 2
    assert "--force needs --output" in done.err
