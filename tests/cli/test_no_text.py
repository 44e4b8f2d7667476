"""Bytes that are no text: one line that says what they are and what to do, none of the bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

NOISE = np.random.default_rng(3).bytes(4000)
LISTED = "`frametool formats` lists what is read"
FRAMES = "frames, not a pose; look one up: frametool lookup {} TARGET SOURCE"
PDF = "not text but a PDF (view_frames writes frames.gv next to it)"
FILES: dict[str, tuple[bytes, str]] = {
    "a.bag": (b"#ROSBAG V2.0\nE\0\0\0" + NOISE, f"ROS 1 bag: {FRAMES.format('a.bag')}"),
    "a.mcap": (b"\x89MCAP0\r\n" + NOISE, f"MCAP file: {FRAMES.format('a.mcap')}"),
    "a.db3": (b"SQLite format 3\0" + NOISE, f"ROS 2 bag: sqlite3, or a folder: {FRAMES.format('a.db3')}"),
    "frames.pdf": (b"%PDF-1.4\n" + NOISE, f"{PDF}; {LISTED}"),
    "a.png": (b"\x89PNG\r\n\x1a\n" + NOISE, f"not text but a PNG picture; {LISTED}"),
    "a.gz": (b"\x1f\x8b" + NOISE, f"not text but gzip data; unpack it first; {LISTED}"),
    "a.csv": (NOISE, f"not text but binary data; {LISTED}"),
    "a.yaml": (NOISE, f"not text but binary data; {LISTED}"),
    "noise": (NOISE, f"not text but binary data; {LISTED}"),
    "short.txt": (b"\x08n\xff\x80,}_\x02[\xe2\n;\x00q\x14\xfe", f"not text but binary data; {LISTED}"),
}
POSE = "{xyz: [1, 2, 3]}"


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "arguments",
    [
        ("convert", "FILE"),
        ("convert", "FILE", "--from", "rpy"),
        ("convert", "-i", "FILE"),
        ("invert", "FILE"),
        ("compose", "FILE", POSE),
        ("relative", POSE, "FILE"),
        ("interpolate", "FILE", POSE, "0.5"),
        ("apply", "--transform", "FILE", "1", "2", "3"),
        ("mean", "FILE"),
    ],
)
def test_what_is_no_text_is_named_wherever_a_pose_is_read(
    run: Callable[..., Any], name: str, arguments: tuple[str, ...]
) -> None:
    data, message = FILES[name]
    done = run(*(name if each == "FILE" else each for each in arguments), files={name: data})
    if message.endswith("TARGET SOURCE") and arguments[0] not in ("interpolate", "apply"):  # bags are streams of records
        assert (done.status, done.out) == (1, "")
        assert done.err.startswith(f"frametool: {name}: the bag cannot be read; is it whole, and its suffix right? (")
        assert done.err.count("\n") == 1
        return
    assert (done.status, done.out, done.err) == (1, "", f"frametool: {name}: {message}\n")


@pytest.mark.parametrize("name", [name for name, (_, message) in FILES.items() if LISTED in message])
@pytest.mark.parametrize(
    "arguments", [("tree", "FILE"), ("lookup", "FILE", "a", "b"), ("diff", "FILE", "FILE"), ("compare", "FILE", "FILE")]
)
def test_it_is_named_where_a_tree_is_read(run: Callable[..., Any], name: str, arguments: tuple[str, ...]) -> None:
    data, message = FILES[name]
    done = run(*(name if each == "FILE" else each for each in arguments), files={name: data})
    assert (done.out, done.err) == ("", f"frametool: {name}: {message}\n")


def test_text_in_latin_1_is_told_where_its_first_byte_stands(run: Callable[..., Any]) -> None:
    done = run("convert", "a.yaml", files={"a.yaml": "# größe\nxyz: [1, 2, 3]\n".encode("latin-1")})
    assert done.err.startswith("frametool: a.yaml:1:5: ")
