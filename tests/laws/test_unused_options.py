"""An option or an input that would not be used is a usage error, in every command: one line that names it, status 2."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import click
import pytest
from console import ROOT

from frametool.cli.commands import COMMANDS, group

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
    (("view", "robot.yaml"), (*OF_FILES, "--path", "--no-sliders", "--overlay")),
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


CSV = "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n2,2,3,0,0,0.6,0.8\n"
RECORDS = '{"xyz": [1, 2, 3], "rpy": [0.1, 0, 0]}\n{"xyz": [1, 2, 4], "rpy": [0.2, 0, 0]}\n'
WAYS = (
    *(((name, A, *more), "") for name, more in (("convert", ()), ("compose", (B,)), ("invert", ()), ("relative", (B,)), ("mean", (B,)))),
    *(((name, *more), text) for name, more in (("convert", ()), ("compose", ("-", B)), ("mean", ())) for text in (CSV, RECORDS)),
    (("interpolate", A, B, "0.5"), ""), (("between", "1,0,0", "0,1,0"), ""), (("lookup", "robot.yaml", "map", "tool"), ""),
    (("apply", "--transform", A, "1", "2", "3"), ""), (("apply", "robot.yaml", "map", "tool"), CSV), (("tree", "robot.yaml"), ""),
    (("check", "robot.yaml"), ""), (("view", "robot.yaml"), ""), (("static", "robot.yaml"), ""), (("calc", "1+1"), ""),
    (("fk", "arm.urdf", "arm_base", "tool", "-i", "joints.csv"), ""), (("resample", "walk.tum", "--rate", "2"), ""),
)  # fmt: skip
# parameter -> a value that is not its default
VALUES = {
    "input_formats": "csv", "joints": "a=1", "joint_files": "joints.csv", "named_frames": "a,b", "stamps": "walk.tum", "notations": "matrix",
    "from_rep": "rpy", "columns": "x", "time_column": "t", "origin": "{lat: 48, lon: 11, alt: 5}", "zone": "32N", "recorded_frames": "a,b",
    "topics": "/tf", "messages": "pose", "more": "drive.yaml", "on_error": "skip", "output": "out.json", "find": "1,2,3", "axes": "optical",
    "world": "ned_from_enu", "all_axes": "unity_from_ros", "fixed": "map", "format_name": "json", "input_path": "walk.tum", "fmt": "json",
    "stop": "0.2",
}  # fmt: skip
# these hold whether or not there is something that they are about: what is said, what is tolerated, how a number is spelt, when it is
FREE = {
    "quiet", "verbose", "color", "normalize", "on_error", "max_errors", "deg", "keep_sign", "notations", "precision", "scale", "camera_axes",
    "at", "moving", "cache", "kinds", "unwrap", "format_name", "fmt", "input_formats", "strict", "each", "fixed", "max_gap_ns",
}  # fmt: skip
# of rows that the form says nothing of; of stamps, which a mean leaves out with a warning
LEFT_OPEN = {("mean", "stamps"), ("convert", "from_rep"), ("compose", "from_rep"), ("mean", "from_rep"), ("convert", "time_offset")}


@pytest.mark.parametrize(("command", "stdin"), WAYS, ids=lambda each: " ".join(each) if isinstance(each, tuple) else each[:5])
def test_each_option_has_an_effect_or_is_refused(run: Run, command: tuple[str, ...], stdin: str) -> None:
    files: dict[str, str | bytes] = {name: (EXAMPLES / name).read_bytes() for name in FILES}
    plain = run(*command, files=files, stdin=stdin)
    assert plain.status == 0, plain.err
    ignored = set()
    for option in command_named(command[0]).params:
        if not isinstance(option, click.Option) or option.name in FREE or {*option.opts} & {*command}:
            continue
        first = [each for each in getattr(option.type, "choices", ()) if each != option.default][:1]
        value = "" if option.is_flag else VALUES.get(option.name or "", *first or ["1"])
        done = run(*command, option.opts[-1], *[value] * (not option.is_flag), files=files, stdin=stdin)
        if done.status == 0 and done.out == plain.out and option.name != "output":
            ignored.add((command[0], option.name))
    assert ignored <= LEFT_OPEN


def test_what_is_read_of_inputs_is_a_parameter_of_a_command() -> None:
    known = {each.name for command in every_command() for each in command.params}
    asks = r"\binputs\.(?:peek\(\"(\w+)|(\w+)\b(?!\())"
    texts = [path.read_text() for path in (ROOT / "frametool" / "cli").rglob("*.py")]
    asked = {name for text in texts for found in re.findall(asks, text) for name in found if name}
    methods = {"reads_trees", "earth", "peek", "refuse_unused", "unused"}
    assert {name for name in asked if not name.startswith("_")} - known - methods == set()


def command_named(name: str) -> click.Command:
    return group.get_command(click.Context(group), name)


def every_command() -> Iterator[click.Command]:
    for command in map(command_named, COMMANDS):
        yield from getattr(command, "commands", {"": command}).values()


def commands() -> Iterator[tuple[str, click.Option]]:
    for name, command in zip(COMMANDS, map(command_named, COMMANDS), strict=True):
        for option in command.params:
            if isinstance(option, click.Option) and not (option.multiple or option.is_flag):
                yield name, option


@pytest.mark.parametrize(("command", "option"), [*commands()], ids=lambda each: each if isinstance(each, str) else each.opts[-1])
def test_an_option_of_one_value_given_twice(run: Run, command: str, option: click.Option) -> None:
    for names in ((option.opts[0],) * 2, (option.opts[0], option.opts[-1])):
        done = run(command, names[0], "1", names[1], "1")
        assert (done.status, done.out) == (2, "")
        assert f": {option.opts[-1]} appears twice; only one can be used; `frametool" in done.err


@pytest.mark.parametrize("command", ["convert", "lookup", "tree", "compose", "view", "sim"])
def test_to_replace_a_file_there_must_be_one(run: Run, command: str) -> None:
    arguments = {"compose": (A, B), "convert": (A,), "sim": ("follow", "--duration", "1")}.get(command, ("robot.yaml", "map", "tool"))
    arguments = arguments[:1] if command == "tree" else arguments
    done = run(command, *arguments, "--force", files={"robot.yaml": (EXAMPLES / "robot.yaml").read_bytes()})
    assert done.status == 2
    assert "--force needs --output" in done.err
