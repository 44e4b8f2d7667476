"""Make examples/run.mcap: 30 s of the drive of `make_trajectories`, as a robot records it.

    python tests/make_recording.py             # writes examples/run.mcap

/tf_static  base_link -> imu, as it was before calibration.yaml
/tf         map -> odom at 1 Hz, odom -> base_link at 5 Hz
/odom       at 1 Hz, in odom;  /pose the same as PoseStamped;  /fix positions of the antenna at 1 Hz
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "support"))
from make_trajectories import FOLDER, SECONDS, truth
from recorded import SECOND, START, Maker, Sent, write

from frametool import Rotation, Transform
from frametool.geometry.earth import earth_pose, lla_from_ecef

ODOM = Transform(Rotation.from_rpy([0.0, 0.0, 0.5]), [12.0, -3.0, 0.0])  # map<-odom
IMU = (0.1, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0)
ECEF = earth_pose(48.1, 11.5, 520.0)  # ecef<-map
ODOMETRY, FIX = "nav_msgs/msg/Odometry", "sensor_msgs/msg/NavSatFix"


def messages() -> list[Sent]:
    """Return the messages in the order of their times."""
    made = Maker("mcap")
    sent = [Sent("/tf_static", *made.transforms(("base_link", "imu", IMU, START)), START)]
    seconds = np.arange(0.0, SECONDS, 0.2)
    path = truth(seconds)
    path = path[0].inverse() @ path
    for at, pose in zip(seconds.tolist(), path, strict=True):
        stamp_ns, numbers = START + round(at * SECOND), (*pose.xyz.tolist(), *pose.xyzw.tolist())
        sent.append(Sent("/tf", *made.transforms(("odom", "base_link", numbers, stamp_ns)), stamp_ns))
        if not at.is_integer():
            continue
        sent.append(Sent("/tf", *made.transforms(("map", "odom", (*ODOM.xyz.tolist(), *ODOM.xyzw.tolist()), stamp_ns)), stamp_ns))
        sent.append(Sent("/pose", *made.pose("odom", stamp_ns, numbers), stamp_ns))
        zero = made.part("Vector3", 0.0, 0.0, 0.0)
        posed = made.part("PoseWithCovariance", made.posed(numbers), np.zeros(36))
        twist = made.part("TwistWithCovariance", made.part("Twist", zero, zero), np.zeros(36))
        sent.append(Sent("/odom", ODOMETRY, made.part(ODOMETRY, made.header("odom", stamp_ns), "base_link", posed, twist), stamp_ns))
        status = made.part("sensor_msgs/msg/NavSatStatus", 0, 1)
        place = lla_from_ecef((ECEF @ ODOM @ pose).xyz)
        fix = made.part(FIX, made.header("antenna", stamp_ns), status, *map(float, place), np.eye(3).ravel() * 0.02**2, 2)
        sent.append(Sent("/fix", FIX, fix, stamp_ns))
    return sent


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        write(Path(folder) / "run", "mcap", messages()).replace(FOLDER / "run.mcap")
