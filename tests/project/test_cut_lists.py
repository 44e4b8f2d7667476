"""Lists in messages: cut in one place, a last one is named, and the nearest to a misspelt name come first."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import frametool
from frametool.errors import UnknownFrame, alternatives, first_of, listing
from frametool.grammar.pose import unknown_key

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

PACKAGE = Path(frametool.__file__).parent
NAMES = [f"n{at:02}" for at in range(40)]


@pytest.mark.parametrize(("count", "said"), [
    (0, ""), (1, "n00"), (3, "n00, n01, n02"), (4, "n00, n01, n02, n03"), (5, "n00, n01, n02 and 2 more"),
    (40, "n00, n01, n02 and 37 more"),
])  # fmt: skip
def test_a_list_that_is_cut_counts_two_or_more(count: int, said: str) -> None:
    assert first_of(NAMES[:count], 3) == said
    assert first_of(NAMES[:4], 3, count=count) == said or count < 4
    assert listing(reversed(NAMES[:count]), 3) == said


def test_parts_may_be_quoted_and_joined_otherwise() -> None:
    assert first_of(["b", "a", "c"], 1, quote=repr) == "'b' and 2 more"
    assert first_of(["b", "a"], 2, gap="|") == "b|a"


def test_no_other_place_counts_what_it_leaves_out() -> None:
    pattern = re.compile(r"""and \{[^}]*\} more["']""")
    found = {str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py") if pattern.search(path.read_text())}
    assert found <= {"errors.py", "cli/commands/help.py", "grammar/pose.py"}  # questions a line each; keys with hints, as many as fit


def test_the_nearest_are_never_cut_off() -> None:
    known = [*NAMES, "zebra_link", "zebra_left"]
    assert listing(known, 3) == "n00, n01, n02 and 39 more"
    assert listing(known, 3, near="zebra") == "zebra_link, zebra_left, n00 and 39 more"
    assert alternatives("zebra_lnik", known, "frames").startswith("; did you mean 'zebra_link'? frames: zebra_link, zebra_left, n00, n01,")
    assert " frames: zebra_left, zebra_link, n00," in str(UnknownFrame("zebra_let", known=known))
    assert listing(["b", "a", "zebra"], near="zebra") == "a, b, zebra"


@pytest.mark.parametrize(("arguments", "stdin", "said"), [
    (["lookup", "-", "a", "zebra"], "frames: {a: {" + ", ".join([*NAMES, "zebra_link"]) + "}}", "frames: zebra_link, a, n00, n01"),
    (["convert", "--columns", "zebra,y,z"], ",".join([*NAMES, "zebra_x"]) + "\n" + "1," * 40 + "1\n", "columns: zebra_x, n00, n01"),
    (["calc", "-e", "d=row.zebra"], ",".join(["x,y,z", *NAMES, "zebra_x"]) + "\n" + "1," * 43 + "1\n", "columns: zebra_x, n00, n01"),
])  # fmt: skip
def test_the_nearest_names_come_first_where_a_list_is_cut(run: Run, arguments: list[str], stdin: str, said: str) -> None:
    assert said in run(*arguments, stdin=stdin).err


def test_the_nearest_topic_is_shown_of_many(run: Run) -> None:
    lines = "".join(f'{{"op": "publish", "topic": "/{name}/tf", "msg": {{"transforms": []}}}}\n' for name in [*NAMES, "zebra"])
    said = run("tree", "-", "--topic", "/zebr/tf", stdin=lines).err
    assert said.startswith("frametool: stdin: no transforms on zebr/tf; topics: /zebra/tf, /n00/tf, /n01/tf, ")


def test_unknown_keys_name_a_last_one() -> None:
    long = [f"quite_a_long_unknown_key_{at}_of_some_more_characters" for at in range(4)]
    first = f"unknown key '{long[0]}', did you mean 'xyz'?"
    assert str(unknown_key(long[:2], "; did you mean 'xyz'?")).startswith(f"{first}; and '{long[1]}'; a pose has ")
    assert str(unknown_key(long[:3], "; did you mean 'xyz'?")).startswith(f"{first}; and 2 more; a pose has ")


@pytest.mark.parametrize("name", ["conver", "lokup", "mnitor"])
def test_a_misspelt_command_is_told_the_nearest(run: Run, name: str) -> None:
    meant = {"conver": "convert", "lokup": "lookup", "mnitor": "monitor"}[name]
    assert run(name).err == f"frametool: no command {name!r}; did you mean {meant!r}?\n"
