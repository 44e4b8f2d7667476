"""Pictures in the terminal: dots, frames, and the terminal left as it was."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from frametool.sim.scene import tutorial
from frametool.sim.simulate import simulate
from frametool.view.pictures import ticks, write_svg
from frametool.view.run_plot import Drawing, run_picture
from frametool.view.terminal import Canvas, Screen


@pytest.mark.parametrize(
    ("place", "line", "column", "character"),
    [((0.0, 1.0), 0, 0, "⠁"), ((0.0, 0.0), 4, 0, "⡀"), ((0.999, 0.999), 0, 9, "⠈"), ((2.0, -1.0), 4, 9, "⢀")],
)
def test_a_dot_stands_where_it_belongs(place: tuple[float, float], line: int, column: int, character: str) -> None:
    canvas = Canvas(5)
    canvas.dot(*place, "red")
    assert list(canvas.row(line))[column] == (character, "red")


def test_dots_of_a_cell_add_up_and_can_be_cleared() -> None:
    canvas = Canvas(5)
    for step in range(100):
        canvas.dot(step / 100, step / 100, "red")
    assert sum(character != " " for line in range(5) for character, _ in canvas.row(line)) in range(10, 15)
    canvas.clear()
    assert {character for line in range(5) for character, _ in canvas.row(line)} == {" "}


def test_a_screen_draws_turtles_and_what_they_say() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=60, height=24, color_system=None)
    scene = tutorial(leader="circle", duration=0.5)
    with Screen(scene, console=console) as screen:
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
    drawing = Drawing(scene)
    for step in simulate(scene):
        drawing.watch(step)
    assert write_svg(run_picture(drawing)).count("<svg") == 1
