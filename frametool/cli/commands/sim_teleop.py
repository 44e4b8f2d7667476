"""`frametool sim teleop`: drive turtle1 with the keys of turtle_teleop_key."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.commands.sim_follow import output_and_scene
from frametool.cli.options import Command
from frametool.cli.sim_output import follow_options, output_options
from frametool.sim.drivers import HEADINGS, KEYS, Heading, Mailbox

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.sim.turtle import Twist

# what terminals send for the arrow keys, in both of their modes
ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
QUIT = b"qQ\x04"


@click.command(cls=Command, name="teleop")
@follow_options("inf")
@output_options
def command(**options: Any) -> None:
    """Drive turtle1 with the arrow keys, as turtle_teleop_key does; turtle2 follows. Drawn in the terminal; q ends it.

    \b
      frametool sim teleop
      frametool sim teleop --followers 3 --plot mine.svg
      frametool sim teleop --turtlesim ros2 --format csv > commands.csv

    Each key moves for a second: 2 m/s ahead or back, 2 rad/s to the left or right. With --turtlesim ros2 the keys
    g t r e d c v b around f turn to a heading. When stdout is no terminal, every command goes there.
    """
    if not sys.stdin.isatty():
        raise click.UsageError("standard input is no terminal; pipe key names into frametool sim follow --leader -")
    mailbox = Mailbox()
    output, scene = output_and_scene({**options, "live": True}, lambda: mailbox, leaders=True)
    with keyboard(mailbox, headings=scene.variant == "ros2"):
        output.run(scene)


@contextmanager
def keyboard(mailbox: Mailbox, *, headings: bool) -> Iterator[None]:
    """Read single keys from the terminal into a mailbox; the terminal is as before afterwards."""
    import termios
    import tty
    from threading import Thread

    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        Thread(target=_listen, args=(mailbox, headings), daemon=True).start()
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _listen(mailbox: Mailbox, headings: bool) -> None:
    """Post what keys mean until the key that ends it."""
    import os

    while data := os.read(sys.stdin.fileno(), 64):
        for key in keys_in(data):
            if key in QUIT:
                mailbox.close()
                return
            command = meaning(key, headings=headings)
            if command is not None:
                mailbox.post(command)


def keys_in(data: bytes) -> Iterator[bytes]:
    """Split what a terminal sent into keys: escape sequences of arrows, and single letters."""
    at = 0
    while at < len(data):
        width = 3 if data[at : at + 2] in (b"\x1b[", b"\x1bO") else 1
        yield data[at : at + width]
        at += width


def meaning(key: bytes, *, headings: bool) -> Twist | Heading | None:
    """Return what a key commands; None for a key that means nothing."""
    if len(key) == 3:
        return KEYS.get(ARROWS.get(key[2:], ""))
    return HEADINGS.get(key.decode("latin-1").lower()) if headings else None
