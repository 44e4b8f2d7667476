"""What went says what to use instead, on one line, as misuse."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from frametool.cli.command import OPTIONAL
from frametool.cli.options import REPLACED, replacement

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Outcome

    Run = Callable[..., Outcome]

TYPED = {
    "--jobs": "invert --jobs 2 -i rows.csv",
    "sim sweep": "sim sweep --gain-linear 1,2",
    "view --live": "view drive.yaml --at 1 --live",
    "--explain=latex": "convert --from rpy 0 0 1 --explain=latex",
    "--tf2": "lookup robot.yaml map base_link --tf2 ros1",
    "--explain-full": "convert --explain-full --from rpy 0 0 1",
    "compare --end": "compare --end 5 a.tum b.tum",
    "align --end": "align --end=5 a.tum b.tum",
    "view --sliders": "view arm.urdf --sliders -o a.html",
    "--array": "convert -i poses.npz --array xyz",
    "--explain text": "lookup robot.yaml map base_link --explain text",
    "--explain markdown": "convert --explain markdown --from rpy 0 0 1",
    "--rows ate": "compare --rows ate a.tum b.tum",
    "--rows rpe": "compare a.tum b.tum --rows rpe",
    "--rows kitti": "compare a.tum b.tum --rows kitti -f csv",
}

# a value after a blank
APART = {f"{name} {value}": f"{name}={value}" for name, values in OPTIONAL.items() for value in values}


def test_each_has_a_case() -> None:
    assert set(TYPED) == set(REPLACED) | set(APART)


@pytest.mark.parametrize(("name", "typed"), TYPED.items())
def test_what_went_names_what_to_use_instead(name: str, typed: str, run: Run) -> None:
    done = run(*typed.split())
    assert (done.status, done.out, done.err.count("\n")) == (2, "", 1)
    assert f"{name} is gone: {(REPLACED | APART)[name]}" in done.err
    assert name not in APART or done.err.startswith(f"frametool: {typed.split(maxsplit=1)[0]}: ")


def test_an_option_that_never_was_is_not_told_to_be_gone() -> None:
    assert replacement(["convert", "--jbos", "sweep", "--explain=text"]) is None
