"""EuRoC ground truth: CSV with nanoseconds, metres and the quaternion w first; the pose of the body in the world.

#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []
1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152
"""

from __future__ import annotations

from frametool.formats.rows.pose_rows import Numbers, RowForm
from frametool.formats.table import FORMATS

ROWS = RowForm(
    ("nanoseconds", b",", Numbers(7, b","), b"\n"),
    lambda tx, ty, tz, x, y, z, w: (tx, ty, tz, w, x, y, z),
    head=",".join(FORMATS["euroc"].columns[:8]).encode() + b"\n",
)
