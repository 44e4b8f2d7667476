"""What every command prints for machines: `python tests/machine_output.py` writes it down, a test holds them to it.

The file was compared with the version before text for people was touched: a slerp's last digit is all that differs.
A change in it is a change of what scripts read: it needs a reason in the design, and a line in the changelog.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = ROOT / "tests" / "golden" / "machine_output.jsonl"

FITS = {"solve", "compare", "align", "mean"}  # by LAPACK, whose last digits are the processor's
HALF = "0.7071067811865476"
STREAMS = {
    "": "",
    "poses.csv": f'id,x,y,z,qx,qy,qz,qw,tag\n007,1,2,3,0,0,{HALF},{HALF},"a,b"\n008,0.25,-2,1e-1,0.5,0.5,-0.5,0.5,c\n',
    "angles.csv": "roll_deg,pitch_deg,yaw_deg\n0,0,90\n10,-20,170\n0,90,5\n",
    "points.csv": "x,y,z\n1,0,0.5\n-2,1e-3,7\n",
    "bare.txt": "1 2 3\n4 5 6\n",
    "poses.jsonl": '{"id": 1, "xyz": [1, 2, 3], "rpy_deg": [0, 0, 90]}\n{"id": 2, "quaternion": {"x": 1, "y": 0, "z": 0, "w": 0}}\n',
    "points.jsonl": '{"id": 1, "point": [1.0, 0.0, 0.5]}\n{"id": 2, "x": 1, "y": 2, "z": 3}\n',
    "commands.txt": "convert --from rpy_deg 0 0 90 -f json\nq = compose '{xyz: [1, 2, 3]}' '{xyz: [1, 0, 0]}'\ninvert $q\n",
    "near.csv": "x,y,z,yaw_deg,weight\n0,0,0,0,1\n4,0,0,10,3\n",
    "times.txt": "0.5\n2.5\n",
    "pose.yaml": "xyz: [1, 2, 3]\nrpy_deg: [10, 20, 30]\n",
    "bad.csv": "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,foo,0,0,0,1\n4,5,6,0,0,0,1\n",
    "robot.yaml": "frames: {map: {odom: {xyz: [12.4, -3.75, 0], rpy_deg: [0, 0, 32]}, pole: {xyz: [1, 2, 3]}}}\n",
    "tf.yaml": (
        "transforms:\n- header: {stamp: {sec: 3, nanosec: 5}, frame_id: map}\n  child_frame_id: base\n  transform:\n"
        "    translation: {x: 1.0, y: 2.0, z: 0.0}\n    rotation: {x: 0.0, y: 0.0, z: 0.6, w: 0.8}\n---\n"
    ),
}
A = "'{xyz: [1, 2, 3], rpy_deg: [10, 20, 30]}'"
B = "'{xyz: [0.5, 0, -1], xyzw: [0.5, -0.5, 0.5, 0.5]}'"
REPRESENTATIONS = (
    "quaternion", "xyzw", "wxyz", "rpy", "rpy_deg", "euler:rzyx", "euler_deg:sxyz", "axis_angle", "rotvec", "matrix", "mrp",
    "six_d",
)  # fmt: skip
# a command, and what stands on its standard input; every line runs in the folder that holds `examples`
COMMANDS: tuple[tuple[str, str], ...] = (
    *((f"convert {A} --to {name} -f {form}", "") for name in REPRESENTATIONS for form in ("json", "yaml")),
    ("convert --from rpy_deg 0 0 90", ""),
    ("compare examples/truth.tum examples/truth.tum --align none -f csv", ""),
    ("align examples/truth.tum examples/mono.tum --align none -f json", ""),
    ("resample examples/walk.tum --rate 4 -f csv", ""),
    ("resample examples/antenna.csv --every 40m --precision 3 -f json", ""),
    ("solve --points examples/points_a.csv examples/points_b.csv --scale --precision 6 -f json", ""),
    ("solve examples/measurements.yaml -f json", ""),
    ("solve --hand-eye examples/gripper.csv examples/target.csv -f json", ""),
    ("compare examples/truth.tum examples/mono.tum --align sim3 --offset auto -f json", ""),
    ("align examples/truth.tum examples/mono.tum -f json", ""),
    ("convert --from wxyz 1 0 0 0 --to matrix,rpy -f json", ""),
    ("convert --from rpy 0.1 -0.2 3 --keep-sign -f json --precision 4", ""),
    (f"convert {A} -f csv", ""),
    *((f"convert {A} -f {form}", "") for form in ("tum", "kitti", "euroc", "colmap")),
    *((f"convert '{{name: b, parent: a, xyz: [1, 2, 3]}}' -f {form}", "") for form in ("ros1", "ros2", "static1", "static2", "foxglove")),
    ("convert --to rpy_deg", "poses.csv"),
    ("convert --to rpy_deg --keep --prefix new_", "poses.csv"),
    ("convert --to matrix --precision 3", "angles.csv"),
    ("convert --to rpy_deg --unwrap", "angles.csv"),
    ("convert -f json", "poses.csv"),
    ("convert --to rotvec", "poses.jsonl"),
    ("convert --on-error skip", "bad.csv"),
    ("convert --on-error null", "bad.csv"),
    ("convert -i examples/walk.tum --to rpy_deg -f csv", ""),
    ("convert -i examples/walk.tum", ""),
    ("convert - --to matrix", "pose.yaml"),
    ("convert --axes optical --to rpy_deg -f json", ""),
    (f"compose {A} {B} -f json", ""),
    (f"compose {A} {B} --to rpy_deg -f yaml", ""),
    (f"compose - {B}", "poses.csv"),
    (f"compose {A} -", "poses.jsonl"),
    (f"invert {A} -f json", ""),
    ("invert", "poses.csv"),
    ("invert -f json", "poses.jsonl"),
    (f"relative {A} {B} -f json", ""),
    ("relative --first", "poses.csv"),
    (f"interpolate {A} {B} 0 0.25 1 -f csv", ""),
    (f"interpolate {A} {B} 0.5 -f json --to rotvec", ""),
    (f"mean {A} {B} -f json", ""),
    ("mean -f yaml --weights weight", "near.csv"),
    ("between 1,0,0 0,1,0 -f json", ""),
    ("lookup examples/robot.yaml map tool -f json", ""),
    ("lookup examples/robot.yaml map camera_optical -f yaml --to matrix", ""),
    ("lookup examples/robot.yaml base_link lidar -f ros2", ""),
    ("lookup examples/drive.yaml map base_link --at 2.5 -f json", ""),
    ("lookup examples/drive.yaml map base_link --at latest -f yaml", ""),
    ("lookup examples/drive.yaml map base_link --times -", "times.txt"),
    ("lookup examples/arm.urdf arm_base tool -j elbow=0.5 -f json --quiet", ""),
    ("apply examples/robot.yaml map lidar 1 2 3 -f json", ""),
    ("apply examples/robot.yaml map lidar 1 2 3 --as vector -f yaml", ""),
    ("apply examples/robot.yaml map lidar", "points.csv"),
    ("apply examples/robot.yaml map lidar", "points.jsonl"),
    ("apply examples/robot.yaml map -i examples/hits.jsonl", ""),
    ("apply examples/robot.yaml base_link lidar -i examples/cloud.csv --precision 3", ""),
    ("apply examples/robot.yaml map lidar --as pose", "poses.csv"),
    (f"apply --transform {A}", "bare.txt"),
    (f"apply --transform {A} 1 0 0 -f json", ""),
    ("project examples/cameras.yaml cam_front lidar 5 1 -0.5 -f json", ""),
    ("project examples/cameras.yaml cam_front lidar --range", "points.csv"),
    ("project examples/cameras.yaml cam_front lidar --precision 3", "points.jsonl"),
    ("unproject examples/cameras.yaml map cam_front 160 200 --ground map -f yaml", ""),
    ("unproject examples/cameras.yaml map cam_front --columns x,y --prefix p_", "points.csv"),
    ("unproject --camera examples/camchain.yaml:cam0 --undistort 12 30 -f json", ""),
    ("fk examples/arm.urdf arm_base tool -i examples/joints.csv --quiet", ""),
    ("tree examples/robot.yaml -f json", ""),
    ("tree examples/robot.yaml -f yaml --to rpy_deg", ""),
    ("tree examples/robot.yaml -f dot", ""),
    ("tree examples/robot.yaml -f mermaid", ""),
    ("tree examples/drive.yaml --at 2.5 -f json", ""),
    ("tree - -f json", "tf.yaml"),
    ("tree examples/lift.sdf -f yaml --quiet", ""),
    ("calc '1 + 2 * 3' -f json", ""),
    ("calc --tree examples/robot.yaml 'inv(map<-base_link) * (map<-tool)' --to rpy_deg -f json", ""),
    ("echo examples/drive.yaml map base_link --rate 1 -f csv", ""),
    ("echo examples/drive.yaml map box --limit 2 -f json", ""),
    ("monitor examples/drive.yaml -f json", ""),
    ("monitor examples/drive.yaml map box -f yaml", ""),
    ("static examples/robot.yaml -f static1", ""),
    ("static examples/robot.yaml -f static2 --to rpy", ""),
    ("static 0.1 0 0.2 1.5 0 0 base camera -f json", ""),
    ("check - -f json", "pose.yaml"),
    ("check - -f github", "tf.yaml"),
    ("diff examples/robot.yaml - -f json", "robot.yaml"),
    ("formats -f json tum", ""),
    ("batch", "commands.txt"),
    ("examples cloud.csv", ""),
    ("sim follow --duration 0.1", ""),
    ("sim follow --duration 0.1 --emit poses -f csv", ""),
    ("sim follow --duration 0.05 --emit tf", ""),
    ("sim follow --duration 0.05 --law ros2 -f json", ""),
)


def main() -> None:
    """Run every command in a process of its own and write what came out; a folder with another version may be given."""
    code = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    lines = []
    for line, name in COMMANDS:
        done = subprocess.run(
            ["bash", "-c", f'python=$1; shift; "$python" -m frametool {line}', "bash", sys.executable],
            input=STREAMS[name].encode(),
            capture_output=True,
            check=False,
            cwd=ROOT,
            env={"PYTHONPATH": str(code), "PATH": "/usr/bin:/bin"},
        )
        found = {"run": line, "in": name, "status": done.returncode, "out": done.stdout.decode()}
        lines.append(json.dumps(found, ensure_ascii=False) + "\n")
    GOLDEN.write_text("".join(lines))


if __name__ == "__main__":
    main()
