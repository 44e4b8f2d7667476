"""What a file is, from its first bytes: the one place that guesses, and only between forms no other reader takes."""

from __future__ import annotations

import re

from frametool.ros.noise import NOISE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Final

HEAD: Final = 1 << 16
"""How many bytes are looked at."""

FORMS = {
    "bag1": "ROS 1 bag",
    "bag2": "ROS 2 bag (sqlite3)",
    "mcap": "MCAP file",
    "echo": "messages as `ros2 topic echo` or `rostopic echo` print them",
    "csv1": "CSV of `rostopic echo -p`",
    "csv2": "CSV of `ros2 topic echo --csv`",
    "jsonl": "messages as JSON, one a line (rosbridge, Foxglove)",
    "calls": "static_transform_publisher calls",
    "tree": "a tree or poses in YAML or JSON",
}
BAGS = ("bag1", "bag2", "mcap")
_MAGIC = ((b"#ROSBAG V2.0", "bag1"), (b"SQLite format 3\0", "bag2"), (b"\x89MCAP0\r\n", "mcap"))
_ECHO = re.compile(
    r"(?:transforms|static_transforms|header|child_frame_id|- header|linear|wrench|twist|pose|point|vector|force): *$"
)
_FLOW_ECHO = re.compile(r"(?:transforms|header): *[\[{]")
_CSV2 = re.compile(r"-?\d+,\d+,[^,]*,[^,]+,|[-+0-9.e]+(?:,[-+0-9.e]+){5}$")
# the command's name, flags, or numbers and two names: poses of a trajectory are numbers only
_CALL = re.compile(
    r".*\bstatic_transform_publisher\s+[-\d.]|--[\w-]+[ =]|[-+]?[\d.]+\s(?:\S+\s+){5,6}(?!-?[\d.])\S+\s+\S+\s*\d*\s*&?$"
)
_MESSAGE_KEY = re.compile(r'"(?:child_frame_id|transforms|frame_id|op)"')


def detect(head: bytes) -> str:
    """Name the form of a file by its first bytes, up to HEAD of them."""
    for magic, form in _MAGIC:
        if head.startswith(magic):
            return form
    encoding = "utf-16" if head.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    lines = head.decode(encoding, "replace").splitlines()
    first = next((line for line in lines if _counts(line)), "")
    if first.startswith("%time,"):
        return "csv1"
    if first.startswith("{"):
        return "jsonl" if _is_json_line(first) else "tree"
    if _CSV2.match(first):
        return "csv2"
    if _CALL.match(first):
        return "calls"
    return "echo" if _ECHO.match(first) or _FLOW_ECHO.match(first) else "tree"


def _counts(line: str) -> bool:
    """Tell a line of data from blank ones, comments, separators and noise."""
    return bool(line.strip()) and not line.startswith(("#", "---")) and NOISE(line) is None


def _is_json_line(line: str) -> bool:
    """Tell one message on a line from the first line of a longer object."""
    return line.rstrip().endswith("}") and _MESSAGE_KEY.search(line) is not None
