"""A run as one HTML page that needs nothing else: the SVG, and the last line of each follower as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from frametool.view import plot_svg

if TYPE_CHECKING:
    from frametool.view.drawing import Drawing

TITLES = ("follower", "t (s)", "distance (m)", "linear.x (m/s)", "angular.z (rad/s)")
HEAD = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>turtles</title>
<style>
body {font-family: sans-serif; margin: 2em}
td, th {padding: .2em .8em; text-align: right}
</style>
</head>
<body>
"""


def plot(drawing: Drawing) -> str:
    """Return the drawing as an HTML document."""
    return f"{HEAD}{plot_svg.plot(drawing)}{_table(drawing)}</body>\n</html>\n"


def _table(drawing: Drawing) -> str:
    """Return what each follower saw and did last."""
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{curve.times[-1]:g}</td><td>{curve.distance[-1]:.4f}</td>"
        f"<td>{curve.linear[-1]:.4f}</td><td>{curve.angular[-1]:.4f}</td></tr>\n"
        for name, curve in drawing.curves.items()
        if curve.times
    )
    head = "".join(f"<th>{title}</th>" for title in TITLES)
    return f"<table>\n<tr>{head}</tr>\n{rows}</table>\n" if rows else ""
