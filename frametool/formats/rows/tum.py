"""TUM trajectories: `t x y z qx qy qz qw` between blanks, seconds, metres; the pose of the body in the world.

1305031102.175800000 1.3405 0.6266 1.6575 0.6574 0.6126 -0.2949 -0.3248
"""

from __future__ import annotations

from frametool.formats.rows.pose_rows import Numbers, RowForm

ROWS = RowForm(("seconds", b" ", Numbers(7), b"\n"))
