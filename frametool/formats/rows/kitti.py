"""KITTI odometry poses: the first three rows of a 4x4, row by row, twelve numbers a line and no time.

1.0 0.0 0.0 0.5 0.0 1.0 0.0 -0.25 0.0 0.0 1.0 12.0

The pose of the left camera (optical axes) in the world, which is that of the first picture; metres.
"""

from __future__ import annotations

from frametool.formats.rows.pose_rows import Numbers, RowForm, rows_of_matrix

ROWS = RowForm((Numbers(12), b"\n"), rows_of_matrix, holds=())
