"""TUM trajectories: `t x y z qx qy qz qw` between blanks, seconds, metres; the pose of the body in the world.

1305031102.175800000 1.3405 0.6266 1.6575 0.6574 0.6126 -0.2949 -0.3248
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.formats.rows.pose_rows import Numbers, RowForm, write_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.grammar.result import Result, Style

ROWS = RowForm(("seconds", b" ", Numbers(7), b"\n"))


def write_poses(results: Iterable[Result], style: Style) -> str:
    """Return one row a pose."""
    return write_rows(ROWS, results, style)
