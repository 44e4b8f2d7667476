"""What the shell offers for names that no list of choices holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

FILES = {"a.csv": "id,x,y,z\n1,2,3,4\n", "a.tum": "# t x y z qx qy qz qw\n0 1 2 3 0 0 0 1\n", "a.jsonl": '{"t": 1, "point": {"x": 1}}\n', "a.bin": "\x00\x01"}


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("convert --axes fl", ["flu"]),
        ("convert --axes unity_from_f", ["unity_from_flu", "unity_from_frd"]),
        ("convert --world-axes enu_from_n", ["enu_from_ned"]),
        ("convert -i a.csv --columns x,y,", ["x,y,id", "x,y,x", "x,y,y", "x,y,z"]),
        ("convert -i a.tum --columns q", ["qx", "qy", "qz", "qw"]),
        ("apply -i a.jsonl --time-column p", ["point", "point.x"]),
        ("calc -i a.csv --time-column i", ["id"]),
        ("mean -i a.csv --weights z", ["z"]),
        ("convert -i none.csv --columns x", []),
        ("convert -i a.bin --columns x", []),
        ("convert --columns x", []),
    ],
)
def test_names_are_completed_from_what_there_is(
    words: str, offered: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Callable[..., Any]
) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("_FRAMETOOL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", f"frametool {words}")
    monkeypatch.setenv("COMP_CWORD", str(len(words.split())))
    done = run()
    assert [line.removeprefix("plain,") for line in done.out.splitlines() if line] == offered
    assert not done.err
