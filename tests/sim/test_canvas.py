"""Pictures in the terminal: dots, frames, and the terminal left as it was."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from frametool.sim.scene import tutorial
from frametool.sim.simulate import simulate
from frametool.view.exports import run_picture
from frametool.view.pictures import ticks, write_svg
from frametool.view.terminal import Canvas, Screen


def test_dots_of_a_cell_add_up() -> None:
    canvas = Canvas(5, 10)
    for step in range(20):
        canvas.mark(step, step, "red")
    drawn = ["".join(text for text, _ in canvas.runs(line, {})) for line in range(5)]
    assert drawn == ["⠑⢄        ", "  ⠑⢄      ", "    ⠑⢄    ", "      ⠑⢄  ", "        ⠑⢄"]


def test_a_screen_draws_turtles_and_what_they_say() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=60, height=24, color_system=None)
    scene = tutorial(leader="circle", duration=0.5)
    screen = Screen(scene, console=console)
    with screen.live:
        for step in simulate(scene):
            screen.watch(step)
    drawn = console.file.getvalue()  # type: ignore[attr-defined]
    assert "turtle2: 3." in drawn
    assert set("→↗↑") & set(drawn)
    assert drawn.count("\x1b[?25l") == drawn.count("\x1b[?25h") == 1


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.0, 0.0), (-3.1, 7.7), (0.0, 1e-5), (-1e6, 2e7), (5.0, 5.0)])
def test_ticks_enclose_the_values_and_are_few(low: float, high: float) -> None:
    found = ticks(low, high)
    assert found[0] <= low + 1e-9 * abs(low)
    assert found[-1] >= high - 1e-9 * abs(high)
    assert 2 <= len(found) <= 10


def test_a_drawing_of_nobody_is_a_picture() -> None:
    scene = tutorial(followers=0, duration=0.0)
    watch, picture = run_picture(scene)
    for step in simulate(scene):
        watch(step)
    assert write_svg(picture()).count("<svg") == 1
