"""`frametool sim sweep`: one run for each pair of gains, all at once."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.command import TEXT, Command, Text
from frametool.cli.commands.sim_follow import NUMBER, Duration, Spawn
from frametool.cli.leader import leader_of
from frametool.cli.sim_output import check_files, form_of, number_writer, suffix_of
from frametool.cli.sink import writing
from frametool.errors import ValueInvalid
from frametool.sim.controllers import LAWS
from frametool.sim.step_writer import FORMS, table
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
            self.fail(f"expected START:STOP:COUNT, e.g. 0.1:2:20, or numbers like 0.5,1; found {value!r}", param, ctx)


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
@click.option("--leader", type=TEXT, default="still", show_default=True, metavar="NAME|FILE|-",
              help="still, circle, square, figure8, random, a file of commands, or - for standard input")
@click.option("--law", type=click.Choice(tuple(LAWS)), default="ros1", show_default=True, help="gives the rate")
@click.option("--rate", type=NUMBER, metavar="HZ", help="control steps a second")
@click.option("--max-linear", type=NUMBER, metavar="V", help="fastest speed in m/s  [default: none]")
@click.option("--max-angular", type=NUMBER, metavar="W", help="fastest turn in rad/s  [default: none]")
@click.option("--spawn", type=Spawn(), default="4,2,0", show_default=True, metavar="X,Y,THETA",
              help="where the followers begin")
@click.option("--duration", type=Duration(), default="20", show_default=True, metavar="S", help="simulated seconds")
@click.option("--reach", type=NUMBER, default=0.5, show_default=True, metavar="D", help="metres that count as arrival")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="of the random leader")
@click.option("-f", "--format", "format_name", type=click.Choice(FORMS),
              help="form of the table  [default: text on a terminal, yaml otherwise]")
@click.option("--precision", type=click.IntRange(0, 30), metavar="N", help="digits after the point")
@click.option("-o", "--output", type=TEXT, metavar="FILE", help="write there instead of stdout, whole or not at all")
@click.option("--plot", type=TEXT, metavar="FILE", help="draw heat maps into a .svg, .html or .png")
@click.option("--force", is_flag=True, help="let --output and --plot replace existing files")
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

    try:
        drive = leader_of(leader, seed, paced=False)
        many = grid(gain_linear, gain_angular, drive, **options)
    except ValueInvalid as error:
        raise click.UsageError(str(error)) from None
    records = list(rows(gain_linear, gain_angular, many))
    text = table(records, form_of(format_name, output), number_writer(precision))
    with writing(output, force=force) as write:
        write(text)
    if plot:
        from frametool.view import heat_map

        with writing(plot, force=force) as write:
            write(heat_map.plot(gain_linear, gain_angular, many, suffix_of(plot)))
