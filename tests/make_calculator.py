"""The calculator page, static files in one folder: `python tests/make_calculator.py OUT`.

It fetches the packages that `site_pages/calculator` pins, with npm and pip, and copies this frametool with its examples.
`python -m http.server -d OUT` then serves the page; so does any web server, under any path.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from html import escape
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from console import ROOT

import frametool

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

SOURCES = Path(__file__).parent / "site_pages" / "calculator"
COPIED = ("page.js", "worker.js", "answer.py", "frame.html", "calculator.css")
PYODIDE = ("pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm", "python_stdlib.zip")
INSTALL = "pipx install frametool"
WIDTH = 72
COLOR = re.compile(r"\x1b\[[0-9;]*m")


class Asked(NamedTuple):
    """A question with a line that answers it, and a file that the line needs beside the examples."""

    title: str
    line: str
    files: Mapping[str, str] = {}


DH = "joint,theta,d,a,alpha_deg\n1,q1,0.089159,0,90\n2,q2,0,-0.425,0\n3,q3,0,-0.39225,0\n4,q4,0.10915,0,90\n5,q5,0.09465,0,-90\n6,q6,0.0823,0,0\n"
QUESTIONS = (
    Asked("Quaternion to degrees", "convert --from quaternion 0 0 0.3826834 0.9238795 --to rpy_deg"),
    Asked("wxyz or xyzw?", "convert '{wxyz: [0.7071068, 0, 0, 0.7071068]}' --to xyzw,rpy_deg"),
    Asked("Invert a transform", "invert '{xyz: [1, 2, 0], rpy_deg: [0, 0, 90]}' --to rpy_deg"),
    Asked("Chain transforms", "compose '{xyz: [1, 0, 0], rpy_deg: [0, 0, 90]}' 'inv({xyz: [0, 0, 0.5]})' '{xyz: [1, 2, 0]}' --to rpy_deg"),
    Asked("NED to ENU", "compose '{axes: enu_from_ned}' '{xyz: [1, 2, 3]}' '{axes: frd_from_flu}' --to rpy_deg"),
    Asked("URDF at joint values", "lookup examples/arm.urdf arm_base tool -j elbow=70deg"),
    Asked("Camera seen from the map", "lookup examples/robot.yaml map camera_optical"),
    Asked("OpenCV rvec to matrix", "convert --from rotvec 0.1 -0.2 0.3 --to matrix,rpy_deg"),
    Asked("Kalibr: which direction?", "lookup examples/camchain.yaml cam1 cam0 --to matrix,rpy_deg"),
    Asked("Denavit-Hartenberg", "lookup ur5.csv link0 link6 --in dh --dh standard -j q2=-90deg -j q3=90deg --to rpy_deg", {"ur5.csv": DH}),
    Asked("GPS to UTM", "convert --from lla 48.137 11.576 519 --to utm -f yaml"),
    Asked("Show the derivation", "convert --from quaternion 0 0 0.6 0.8 --to axis_angle_deg --explain"),
)


def write(folder: Path) -> None:
    """Write the page into a folder."""
    with TemporaryDirectory() as fetched:
        npm, wheels = Path(fetched) / "npm", Path(fetched) / "wheels"
        fetch(npm, wheels)
        (folder / "pyodide").mkdir(parents=True, exist_ok=True)
        for name in PYODIDE:
            shutil.copy(npm / "node_modules" / "pyodide" / name, folder / "pyodide" / name)
        lock = json.loads((npm / "node_modules" / "pyodide" / "pyodide-lock.json").read_text("utf-8"))
        (folder / "python.zip").write_bytes(bundle(wheels))
    (folder / "pyodide" / "pyodide-lock.json").write_text(json.dumps(lock | {"packages": {}}), "utf-8")
    for name in COPIED:
        shutil.copy(SOURCES / name, folder / name)
    shutil.copy(SOURCES.parent / "mark.svg", folder / "mark.svg")
    size = sum(path.stat().st_size for path in [folder / "python.zip", *(folder / "pyodide" / name for name in PYODIDE[2:])])
    (folder / "index.html").write_text(page(size, lock["info"]["python"]), "utf-8")


def fetch(npm: Path, wheels: Path) -> None:
    """Fetch the packages that are pinned, by their hashes."""
    npm.mkdir()
    for name in ("package.json", "package-lock.json"):
        shutil.copy(SOURCES / name, npm / name)
    program = shutil.which("npm")
    if program is None:
        raise SystemExit("npm is missing; the page needs it once, when it is made: install Node.js")
    options = ["--ignore-scripts", "--no-audit", "--no-fund", "--silent"]
    subprocess.run([program, "ci", *options], cwd=npm, check=True)
    python = ["--python-version", "3.14", "--implementation", "cp", "--abi", "cp314", "--abi", "none", "--platform", "any"]
    platforms = ["--platform", "manylinux2014_x86_64"]
    asked = ["--no-deps", "--only-binary=:all:", "--require-hashes", "-r", str(SOURCES / "requirements.txt"), "-d", str(wheels)]
    subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", *python, *platforms, *asked], check=True)


def bundle(wheels: Path) -> bytes:
    """Return a zip with the Python code of frametool and of what it needs; the same bytes of the same sources."""
    held = BytesIO()
    with ZipFile(held, "w") as made:
        for name, content in sorted(members(wheels)):
            made.writestr(ZipInfo(name), content, ZIP_DEFLATED, 9)
    return held.getvalue()


def members(wheels: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of each file that Python needs in the page."""
    for wheel in wheels.glob("*.whl"):
        with ZipFile(wheel) as archive:
            yield from ((name, archive.read(name)) for name in archive.namelist() if name.endswith((".py", "/METADATA")))
    yield from own_files()


def own_files() -> Iterator[tuple[str, bytes]]:
    """Yield the files of the package as the wheel has them."""
    package = Path(frametool.__file__).parent
    for path in package.rglob("*"):
        name = path.relative_to(package)
        if path.is_file() and "__pycache__" not in name.parts and name.parts[0] not in ("data", "examples"):
            yield f"frametool/{name.as_posix()}", path.read_bytes()
    for path in (ROOT / "examples").iterdir():
        yield f"frametool/examples/{path.name}", path.read_bytes()


def versions(python: str) -> str:
    """Name what the page is made of."""
    pins = dict(re.findall(r"(?m)^(\w+)==(\S+)", (SOURCES / "requirements.txt").read_text("utf-8")))
    pyodide = json.loads((SOURCES / "package.json").read_text("utf-8"))["dependencies"]["pyodide"]
    return f"frametool {frametool.__version__}, Pyodide {pyodide} (Python {python}), " + ", ".join(map(" ".join, pins.items()))


def page(size: int, python: str) -> str:
    """Return the page, with its questions and their answers as text."""
    chips, answers = [], []
    for number, (title, line, files) in enumerate(QUESTIONS, 1):
        ran = frametool.run(line, files=example_files() | {name: text.encode() for name, text in files.items()}, columns=WIDTH)
        if ran.status:
            raise SystemExit(f"{line}: {ran.err}")
        data = f'data-line="{escape(line)}" data-answer="question-{number}" data-files="{escape(json.dumps(files))}"'
        chips.append(f'<li><button type="button" {data}>{escape(title)}</button></li>')
        answers.append(
            f'<article id="question-{number}"><h3>{escape(title)}</h3>\n<pre><b>$ frametool {escape(line)}</b>\n'
            f"{escape(COLOR.sub('', ran.out.decode()))}</pre></article>"
        )
    about = {"bytes": size, "install": INSTALL}
    filled = {"CHIPS": "\n".join(chips), "ANSWERS": "\n".join(answers), "ABOUT": json.dumps(about), "VERSIONS": versions(python), "INSTALL": INSTALL}
    text = (SOURCES / "index.html").read_text("utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda found: filled[found[1]], text)


def example_files() -> dict[str, bytes]:
    """Return the examples by the names that the questions use."""
    return {f"examples/{path.name}": path.read_bytes() for path in (ROOT / "examples").iterdir()}


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python tests/make_calculator.py OUT")
    write(Path(sys.argv[1]))
