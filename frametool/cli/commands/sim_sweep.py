"""`frametool sim sweep`: one run for each pair of gains, all at once."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.options import Command, Text
from frametool.cli.output import drawn
from frametool.cli.sim_output import (
    LAW,
    LEADER,
    MAX_ANGULAR,
    MAX_LINEAR,
    RATE,
    REACH,
    SEED,
    SPAWN,
    Duration,
    check_files,
    format_options,
    leader_of,
    style_of,
    suffix_of,
)
from frametool.cli.sink import writing
from frametool.errors import ValueInvalid, shown
from frametool.sim.step_writer import table
from frametool.text.numbers import parse_number

MOST = 10_000  # values of one gain


class Range(Text):
    """Evenly spaced numbers, START:STOP:COUNT with both ends, or numbers separated by commas."""

    name = "start:stop:count"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read them."""
        text = str(super().convert(value, param, ctx))
        try:
            if ":" not in text:
                return [parse_number(each.strip()) for each in text.split(",")]
            start, stop, count = text.split(":")
            return _spaced(parse_number(start), parse_number(stop), int(count))
        except ValueInvalid as error:
            self.fail(str(error), param, ctx)
        except ValueError:
            self.fail(f"expected START:STOP:COUNT (0.1:2:20), or numbers (0.5,1); found {shown(text)}", param, ctx)


def _spaced(start: float, stop: float, count: int) -> list[float]:
    """Return numbers from start to stop, both included."""
    if not 1 <= count <= MOST:
        raise ValueInvalid(f"COUNT must be 1 .. {MOST}, found {count}")
    values = (start + (stop - start) * index / max(count - 1, 1) for index in range(count))
    return [float(f"{value:.12g}") for value in values]  # 0.8 rather than 0.7999999999999999


@click.command(cls=Command, name="sweep")
@click.option("--gain-linear", type=Range(), default="0.1:2:20", show_default=True, metavar="START:STOP:COUNT",
              help="speeds for each metre of distance")
@click.option("--gain-angular", type=Range(), default="1:8:20", show_default=True, metavar="START:STOP:COUNT",
              help="turn rates for each radian of bearing")
@LEADER
@LAW
@RATE
@MAX_LINEAR
@MAX_ANGULAR
@SPAWN
@click.option("--duration", type=Duration(), default="20", show_default=True, metavar="S", help="simulated seconds")
@REACH
@SEED
@format_options
def command(
    gain_linear: list[float], gain_angular: list[float], leader: str, seed: int, format_name: str | None,
    precision: int | None, output: str | None, plot: str | None, force: bool, **options: Any,
) -> None:  # fmt: skip
    """Try every pair of gains: how soon the follower is within reach, and how far it was off again afterwards.

    \b
      frametool sim sweep --gain-linear 0.1:2:20 --gain-angular 1:8:20
      frametool sim sweep --leader circle --format csv --plot gains.svg

    time_to_reach is in seconds; overshoot, in metres, is how much further off than its nearest the follower was again
    after that. Both are missing (-, null or empty) where it never comes within reach.
    """
    check_files(plot, output, force=force)
    from frametool.sim.sweep import grid, rows

    style = style_of(format_name, output, precision)
    try:
        drive = leader_of(leader, seed, paced=False)
        result = grid(gain_linear, gain_angular, drive, **options)
    except ValueInvalid as error:
        raise click.UsageError(str(error)) from None
    text = table(list(rows(gain_linear, gain_angular, result)), style)
    with writing(output, force=force) as write:
        write(text)
    if plot:
        from frametool.view.run_plot import sweep_picture

        with writing(plot, force=force) as write:
            write(drawn(sweep_picture(gain_linear, gain_angular, result), suffix_of(plot)))
