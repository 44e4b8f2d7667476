"""Standard output as a terminal in which pictures and trees are drawn in colour."""

from __future__ import annotations

import sys

from rich.console import Console


def coloured_console(color: str = "auto") -> Console:
    """Return standard output, in colour where the terminal has any, or as `color` says: always or never."""
    return Console(
        file=sys.stdout, highlight=False, soft_wrap=True, no_color=True if color == "never" else None,
        force_terminal=True if color == "always" else None, color_system="auto" if color == "auto" else "standard",
    )  # fmt: skip
