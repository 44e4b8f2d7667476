"""`frametool sim sweep`: one run for each pair of gains, all at once."""

from __future__ import annotations

from typing import Any

import click

from frametool.cli.options import Command, Parsed
from frametool.cli.output import drawn
from frametool.cli.sim_output import check_files, leader_of, style_of, suffix_of, sweep_options
from frametool.cli.sink import writing
from frametool.errors import ValueInvalid
from frametool.sim.readers import parse_gains
from frametool.sim.step_writer import table

GAINS = Parsed("start:stop:count", parse_gains)


@click.command(cls=Command, name="sweep")
@click.option("--gain-linear", type=GAINS, default="0.1:2:20", show_default=True, metavar="START:STOP:COUNT",
              help="speeds for each metre of distance")
@click.option("--gain-angular", type=GAINS, default="1:8:20", show_default=True, metavar="START:STOP:COUNT",
              help="turn rates for each radian of bearing")
@sweep_options
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
