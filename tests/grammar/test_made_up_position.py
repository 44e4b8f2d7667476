"""A way to write positions is one row of POSITIONS and one file: Web Mercator, made up here, serves the command line."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROW = """
import sys
from frametool.geometry.representations import POSITIONS, REPRESENTATIONS, Representation

POSITIONS["web"] = REPRESENTATIONS["web"] = Representation(
    ("web_x", "web_y"), (), "Web Mercator", short=("web_x", "web_y"), kernels="toy_web:WEB", name="web"
)
from frametool.cli import run
sys.exit(run(sys.argv[1:]))
"""
FILE = """
import math
import numpy as np
from frametool.geometry.place import Kernels

R = 6378137.0

def plain(*numbers):
    return tuple(each if np.ndim(each) else float(each) for each in numbers)

def read(place, given, xp):
    x, y = given["web_x"], given["web_y"]
    return plain(np.degrees(2.0 * np.arctan(np.exp(y / R)) - math.pi / 2), np.degrees(x / R), x * 0.0)

def write(place, lla, xp):
    lat, lon, _ = lla
    return plain(R * np.radians(lon), R * np.log(np.tan(math.pi / 4 + np.radians(lat) / 2)))

WEB = Kernels(read, write)
"""
LAT, LON = 48.1, 11.5
X, Y = 6378137.0 * math.radians(LON), 6378137.0 * math.log(math.tan(math.pi / 4 + math.radians(LAT) / 2))


def run(folder: Path, *arguments: str, stdin: str = "") -> str:
    """Run the command line with the row and the file; return what it printed."""
    (folder / "toy_web.py").write_text(FILE)
    done = subprocess.run(
        [sys.executable, "-c", ROW, *arguments], input=stdin, capture_output=True, text=True, check=False, cwd=folder,
        env={"PATH": "", "PYTHONPATH": f"{ROOT}:{folder}"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def cells(text: str) -> list[float]:
    return [float(cell) for cell in text.splitlines()[1].split(",")]


def test_it_is_read_as_numbers_as_keys_and_as_columns(tmp_path: Path) -> None:
    to = ("--to", "lla", "-f", "csv")
    numbers = run(tmp_path, "convert", "--from", "web", repr(X), repr(Y), *to)
    mapping = run(tmp_path, "convert", json.dumps({"web_x": X, "web_y": Y}), *to)
    table = run(tmp_path, "convert", "-i", "-", *to, stdin=f"id,web_x,web_y\n7,{X!r},{Y!r}\n")
    chosen = run(tmp_path, "convert", "--from", "web", "--columns", "a,b", *to, stdin=f"a,b\n{X!r},{Y!r}\n")
    for found in (cells(numbers), cells(mapping), cells(table)[1:], cells(chosen)):
        assert found == pytest.approx([LAT, LON, 0.0], abs=1e-9)


def test_it_is_written_and_comes_back_as_it_was_read(tmp_path: Path) -> None:
    found = json.loads(run(tmp_path, "convert", "--from", "lla", str(LAT), str(LON), "0", "--to", "web", "-f", "json"))
    assert found == {"web_x": pytest.approx(X), "web_y": pytest.approx(Y)}
    table = run(tmp_path, "convert", "--to", "web", stdin=f"lat,lon,alt\n{LAT},{LON},0\n")
    assert table.splitlines()[0] == "web_x,web_y"
    assert run(tmp_path, "convert", "--to", "web", stdin="web_x,web_y\n1.5,2.25\n") == "web_x,web_y\n1.5,2.25\n"
