"""The bytes of the ways of rows through the tool: `python tests/make_ways.py` writes them down, a test holds them.

It also tells which ways have changed, in what; with `--check` it writes nothing. A change is one of what scripts read
or of what people are told: it needs a reason in the design and a line in the changelog.

A way is a line as a shell has it, and a number of rows for the files that it names. What is long is kept as its SHA-256
with its first and last lines, and so is what is no text.
"""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = ROOT / "tests" / "golden" / "ways" / "ways.json"
sys.path.insert(0, str(ROOT / "tests" / "support"))

from way_inputs import FILES  # noqa: E402 - a script finds what the tests share only now

A = "'{name: lidar, parent: map, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'"
B = "'{xyz: [0.5, 0, -1], xyzw: [0.5, -0.5, 0.5, 0.5]}'"
MOVE = "apply robot.yaml map lidar"
ORIGIN = "'{lat: 48.1, lon: 11.5, alt: 520}'"
LINES: dict[int, tuple[str, ...]] = {
    1: (
        f"{MOVE} -i points.csv",
        f"{MOVE} -i points.csv -f json",
        "apply robot.yaml map -i points.jsonl",
        "apply robot.yaml map -i points.jsonl -f csv",
        "convert -i poses.yaml --to rpy_deg",
        "convert -i walk.tum -f kitti",
        "convert -i pretty.json -f yaml",
        f"apply --transform {A} -i pose_stamped.yaml",
        "invert < stamped.csv",
        f"compose {A} - < poses.jsonl",
        "relative --consecutive -i walk.tum",
        "apply --transform '{xyz: [1, 2, 3]}' -i points.npy -o moved.npy",
        "mean poses.csv",
        f"{MOVE} -i point_stamped.jsonl -f ros2",
    ),
    7: (
        # tables
        f"{MOVE} -i points.csv",
        f"{MOVE} < points.csv",
        f"{MOVE} -i crlf.csv",
        f"{MOVE} -i points.csv --precision 3",
        f"{MOVE} -i points.csv --keep --prefix map_",
        f"{MOVE} -i points.csv --as vector",
        f"{MOVE} -i points.csv -f yaml",
        f"{MOVE} -i points.csv -f tum",
        f"{MOVE} -i points.csv -o points.pcd",
        f"{MOVE} -i points.csv -o points.npy",
        f"{MOVE} -i points.txt",
        f"{MOVE} -i plane.csv",
        "apply --transform '{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}' -i plane.csv",
        f"{MOVE} -i poses.csv",
        f"{MOVE} -i poses.csv --to rpy_deg,rotvec",
        f"{MOVE} -i poses.tsv -f csv",
        f"{MOVE} -i semicolon.csv",
        f"{MOVE} -i stamped.csv -f ros2",
        f"{MOVE} -i stamped.csv -f json",
        "apply robot.yaml map -i framed.csv",
        "apply robot.yaml map -i framed.csv -f json",
        f"{MOVE} -i framed.csv --on-error skip",
        "apply robot.yaml map --frame-column frame -i framed.csv --precision 1",
        "apply drive.yaml map lidar -i moving.csv --time-column t",
        "apply drive.yaml map lidar -i moving.csv --at 2.5",
        "apply drive.yaml map lidar -i moving.csv",
        f"apply --transform {A} -i lonely.csv --columns px,py,pz",
        f"apply --transform {A} -i bare.csv --from xyzw --no-header",
        "convert -i bare.csv --no-header",
        "convert -i poses.txt --from xyzw --to rpy_deg --precision 6",
        "convert -i angles.csv --from rpy_deg --to matrix",
        "convert -i angles.csv --to quaternion,rotvec -f json",
        "convert -i poses.csv --to rpy --deg --keep",
        "convert -i poses.csv --to wxyz -f yaml",
        "convert -i stamped.csv -f tum",
        "convert -i stamped.csv -f kitti",
        "convert -i poses.csv -f npy -o poses.npy",
        "convert -i poses.csv --axes optical",
        "invert -i stamped.csv",
        "invert -i semicolon.csv -f json",
        f"compose - {B} < poses.tsv",
        f"compose {A} - -i stamped.csv",
        "relative --first -i poses.csv",
        "relative --consecutive --velocity -i stamped.csv",
        "mean poses.csv -f json",
        "lookup drive.yaml map base_link --times 0:3:0.5 -f csv",
        "lookup drive.yaml map base_link --times 0:3:0.5 -f tum",
        "lookup drive.yaml map box --times 1,2,3 --to rpy_deg",
        "lookup drive.yaml map base_link -i moving.csv --time-column t --keep --prefix base_",
        f"interpolate {A} {B} 0:1:0.25 -f csv",
        "resample walk.tum --rate 20",
        "resample walk.tum --every 30m -f json",
        "fk arm.urdf arm_base tool -i joints.csv",
        "fk arm.urdf arm_base tool -i joints.csv --to rpy_deg -f json",
        "fk arm.urdf arm_base tool -i joints.jsonl",
        "fk arm.urdf arm_base tool -i postures.yaml --precision 6",
        # records
        f"{MOVE} -i poses.jsonl",
        f"{MOVE} < poses.json",
        f"{MOVE} -i pretty.json",
        f"{MOVE} -i poses.yaml",
        f"{MOVE} -i poses.jsonl -f csv",
        f"{MOVE} -i poses.jsonl -f yaml --precision 4",
        f"{MOVE} -i pretty.json -f ros2",
        f"{MOVE} -i poses.yaml -f json",
        f"{MOVE} -i poses.jsonl -f tum",
        "apply robot.yaml map -i points.json -f csv",
        "apply robot.yaml map < points.yaml",
        "convert -i poses.jsonl --to rpy_deg,matrix",
        "convert -i poses.json --to rotvec -f csv",
        "convert -i flat.jsonl --to rpy",
        "convert -i flat.jsonl -f tum",
        "convert -i degrees.jsonl --to rpy",
        "invert -i poses.jsonl",
        "invert -i pretty.json -f csv",
        f"compose {A} - < poses.yaml",
        f"compose - {B} < flat.jsonl",
        "relative --first -i flat.jsonl",
        "relative --consecutive -i poses.json -f csv",
        # messages
        *(f"{MOVE} -i {name}.{form}" for name in ("pose_stamped", "point_stamped", "pose_array", "odometry") for form in ("yaml", "jsonl")),
        "apply --transform '{name: odom, parent: map, xyz: [1, 2, 3]}' -i transform_stamped.yaml",
        "apply --transform '{name: odom, parent: map, xyz: [1, 2, 3]}' -i tf.jsonl",
        "convert -i transform_stamped.jsonl -f tum",
        "convert -i tf.yaml -f csv",
        "convert -i odometry.jsonl --to rpy -f csv",
        "convert -i pose_array.yaml -f csv",
        "invert -i pose_stamped.yaml -f ros2",
        "invert -i tf.yaml",
        # trajectories, clouds, arrays
        "convert -i walk.tum",
        "convert -i walk.tum --to rpy_deg",
        "convert -i walk.tum -f csv",
        "convert -i walk.tum -f json",
        "convert -i walk.tum -f ros2",
        "convert -i walk.kitti",
        "convert -i walk.kitti -f tum",
        "convert -i euroc.csv -f tum",
        "convert -i euroc.csv -f euroc",
        "convert -i graph.g2o -f csv",
        "invert -i walk.tum",
        f"compose {A} - < walk.tum",
        f"apply --transform {A} -i walk.kitti",
        f"apply --transform {A} -i graph.g2o",
        f"{MOVE} -i ascii.pcd",
        f"{MOVE} -i binary.pcd -o moved.pcd",
        f"{MOVE} -i binary.pcd -f csv",
        f"{MOVE} -i points.npy -f csv",
        f"{MOVE} -i poses.npy -f csv --from xyzw",
        # the Earth and covariances
        "convert -i gps.csv --to utm --precision 6",
        "convert -i gps.csv --to ecef -f json --precision 3",
        "convert -i gps.csv --to enu --origin first --precision 6",
        f"convert -i fixes.jsonl --to ned --origin {ORIGIN} --precision 6",
        "convert -i fixes.jsonl --to utm -f csv --precision 4",
        "apply site.yaml map -i gps.csv --precision 6",
        "apply site.yaml ecef antenna -i points.csv --to lla --precision 9",
        "invert -i sigmas.csv",
        f"compose {A} - -i sigmas.csv -f json",
        f"{MOVE} -i uncertain.jsonl",
        "apply --transform '{sigma: {xyz_mm: 3}}' --covariance -i uncertain.jsonl -f csv",
        "convert -i odometry.yaml -f csv --to rpy_deg --precision 6",
        # bad rows
        *(f"{MOVE} -i bad.{form} --on-error {policy}" for form in ("csv", "jsonl", "json", "tum") for policy in ("stop", "skip", "null")),
        f"{MOVE} -i bad.jsonl --on-error skip -f csv",
        f"{MOVE} -i bad.jsonl --on-error null -f csv",
        f"{MOVE} -i bad.csv --on-error null -f json",
        "convert -i bad.csv --on-error skip --max-errors 1 -f tum",
        "convert -i bad.yaml --on-error skip --to rpy_deg",
        "convert -i bad.yaml --on-error null -f csv",
        "invert -i bad.csv --on-error skip -f json",
        # refused as a whole
        "convert -i points.csv --to rpy",
        f"{MOVE} -i points.csv -f npy --precision 2 -o points.npy",
        f"{MOVE} -i lonely.csv --columns px,py,pw",
        "apply robot.yaml nowhere lidar -i points.csv",
        "convert -i walk.tum --keep --to rpy",
        "convert -i poses.txt",
    ),
    5000: (
        f"{MOVE} -i points.csv",
        f"{MOVE} -i points.csv -f json",
        f"{MOVE} -i points.csv -o points.npy",
        f"{MOVE} -i poses.csv --to rpy_deg --precision 4",
        "apply robot.yaml map -i framed.csv",
        "apply robot.yaml map -i points.jsonl",
        "apply drive.yaml map lidar -i moving.csv --time-column t",
        "convert -i poses.jsonl --to rpy_deg",
        "convert -i poses.json",
        "convert -i walk.tum -f kitti",
        "convert -i walk.kitti -f csv",
        "invert -i stamped.csv",
        "relative --consecutive -i walk.tum",
        "fk arm.urdf arm_base tool -i joints.csv",
        f"{MOVE} -i binary.pcd -o moved.pcd",
        f"{MOVE} -i bad.csv --on-error skip",
    ),
    400: (  # of what takes longer
        f"{MOVE} -i poses.jsonl -f csv",
        f"{MOVE} -i poses.csv -f json",
        f"{MOVE} -i poses.yaml",
        f"{MOVE} -i pose_stamped.yaml",
        f"{MOVE} -i pretty.json",
        "convert -i walk.tum -f ros2",
        "convert -i gps.csv --to utm --precision 6",
    ),
}  # fmt: skip
FOLDED_FROM = 1800  # characters; what is longer is kept as a hash
ENDS = 2  # lines that are kept of its beginning and of its end
WIDEST = 160  # characters that are kept of such a line


class Way(NamedTuple):
    """A line for a shell, and how many rows the files have that it names."""

    rows: int
    line: str

    @property
    def name(self) -> str:
        """Call it by its line, and its rows."""
        return f"{self.rows}: {self.line}"

    @property
    def arguments(self) -> list[str]:
        """Return the line as words, without what stands on standard input."""
        return shlex.split(self.line.partition(" < ")[0])

    @property
    def stdin(self) -> bytes:
        """Return what stands on standard input."""
        name = self.line.partition(" < ")[2]
        return made(name, self.rows) if name else b""

    @property
    def files(self) -> dict[str, bytes]:
        """Return the files that the words name, but for the one that is written."""
        return {each: made(each, self.rows) for each in self.arguments if each in FILES and each != self.written}

    @property
    def written(self) -> str:
        """Return the name of the file that it writes, "" if it writes none."""
        words = self.arguments
        return words[words.index("-o") + 1] if "-o" in words else ""


WAYS = [Way(rows, line) for rows, some in LINES.items() for line in some]


def made(name: str, rows: int) -> bytes:
    """Make a file."""
    content = FILES[name](rows)
    return content.encode() if isinstance(content, str) else content


def kept(data: bytes) -> Any:
    """Return what is stored of an output: its lines, or of a long one its hash and its ends."""
    try:
        text = data.decode()
    except UnicodeDecodeError:
        return {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
    lines = text.splitlines(keepends=True) if "\r" not in text else text.replace("\n", "\n\0").rstrip("\0").split("\0")
    if len(text) < FOLDED_FROM:
        return lines
    digest = hashlib.sha256(data).hexdigest()
    return {"sha256": digest, "lines": len(lines), "first": _cut(lines[:ENDS]), "last": _cut(lines[-ENDS:])}


def _cut(lines: list[str]) -> list[str]:
    return [line if len(line) <= WIDEST else f"{line[:WIDEST]}.." for line in lines]


def outcome(status: int, out: bytes, err: bytes, written: bytes | None) -> dict[str, Any]:
    """Return what a way left behind as it is stored; what is empty is left out."""
    found = {"status": status, "out": kept(out), "err": kept(err), "file": None if written is None else kept(written)}
    return {key: value for key, value in found.items() if value not in (0, [], None)}


def left_behind(folder: Path, way: Way) -> bytes | None:
    """Return what is in the file that a way writes; None if it writes none."""
    file = folder / (way.written or "none")
    return file.read_bytes() if file.exists() else None


def run(way: Way) -> dict[str, Any]:
    """Run a way in a process of its own, in a folder that holds its files."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in way.files.items():
            (folder / file).write_bytes(content)
        done = subprocess.run(
            [sys.executable, "-c", "from frametool.cli import main; main()", *way.arguments],
            input=way.stdin,
            capture_output=True,
            check=False,
            cwd=folder,
            env={"PYTHONPATH": str(ROOT), "PATH": os.defpath, "NO_COLOR": "1", "COLUMNS": "100"},
        )
        return outcome(done.returncode, done.stdout, done.stderr, left_behind(folder, way))


def differences(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """Tell which ways have changed, and in what."""
    told = [f"gone: {name}" for name in before if name not in now]
    for name, found in now.items():
        if name not in before:
            told.append(f"new: {name}")
        elif found != before[name]:
            keys = [key for key in (*found, *before[name]) if found.get(key) != before[name].get(key)]
            told.append(f"changed: {name} ({', '.join(dict.fromkeys(keys))})")
    return told


def stored() -> dict[str, Any]:
    """Read what is stored, by the names of the ways."""
    found: dict[str, Any] = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return found


def main() -> int:
    """Run all ways, tell what has changed, and store them."""
    now = {way.name: run(way) for way in WAYS}
    told = differences(stored() if GOLDEN.exists() else {}, now)
    print("\n".join(told) or "nothing has changed")
    if "--check" in sys.argv:
        return bool(told)
    GOLDEN.parent.mkdir(exist_ok=True)
    GOLDEN.write_text(json.dumps(now, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
