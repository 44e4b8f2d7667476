"""Machine forms are a promise: each command prints the bytes of golden/machine_output.jsonl (see machine_output.py)."""

from __future__ import annotations

import json
import shlex
from typing import TYPE_CHECKING, Any

import pytest
from console import split
from machine_output import COMMANDS, FITS, GOLDEN, ROOT, STREAMS

from frametool.cli.commands import COMMANDS as NAMES

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

STORED = [json.loads(line) for line in GOLDEN.read_text().splitlines()]
SILENT = {"help", "view", "record"}  # nothing for machines; pictures and recordings have tests of their own


@pytest.mark.parametrize("each", STORED, ids=[f"{each['run']} < {each['in']}".rstrip("< ") for each in STORED])
def test_what_machines_read_keeps_every_byte(run: Run, tmp_path: Path, each: dict[str, Any]) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    outcome = run(*shlex.split(each["run"]), stdin=STREAMS[each["in"]])
    assert outcome.status == each["status"], outcome.err
    if each["run"].split()[0] in FITS:
        assert split(outcome.out)[0] == split(each["out"])[0]
        assert split(outcome.out)[1] == pytest.approx(split(each["out"])[1], rel=1e-9, abs=1e-12)
    else:
        assert outcome.out == each["out"]


def test_the_golden_file_has_every_line_of_its_table() -> None:
    assert [(each["run"], each["in"]) for each in STORED] == list(COMMANDS)


def test_every_command_that_prints_for_machines_is_held() -> None:
    assert {each["run"].split()[0] for each in STORED} == set(NAMES) - SILENT
