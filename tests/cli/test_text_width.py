"""Text for people fits 80 columns; in fewer columns nothing breaks and nothing is lost, in more nothing is stretched."""

from __future__ import annotations

import os
import re
import shlex
from typing import TYPE_CHECKING

import pytest
from machine_output import COMMANDS, ROOT, STREAMS

from frametool.cli.commands import COMMANDS as NAMES
from frametool.cli.commands.help import topics

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Outcome

    Run = Callable[..., Outcome]

# what the golden lines print for machines, printed for people; findings are lines for compilers, `place: level: ..`
ROWS = re.compile(r"-i \S+\.(?:csv|tum)|^check|^batch|^examples")  # tables stay tables
TABLE = [
    (re.sub(r" -f \w+", "", line) + " -f text", name)
    for line, name in COMMANDS
    if not name.endswith(".csv") and name != "bare.txt" and not ROWS.search(line)
]
FURTHER = """
convert --from rpy_deg 10 20 30 --to euler:all -f text
convert --from rpy_deg 10 20 30 --find 30,20,10 --deg -f text
convert --from rpy_deg 10 20 30 --explain
compose '{xyz: [1, 2, 3]}' '{rpy: [1, 0, 0]}' --explain
relative '{xyz: [1, 2, 3]}' '{xyz: [1, 2, 4]}' -f text
interpolate '{rpy_deg: [0, 0, 0]}' '{rpy_deg: [0, 0, 90]}' 0.3 --explain
lookup examples/robot.yaml map tool --explain
lookup examples/drive.yaml map box --at 2.5 --explain
lookup examples/arm.urdf arm_base tool -j elbow=1 -f text
tree examples/arm.urdf -f text
tree examples/camchain.yaml -f text
tree examples/finger.xml -f text
view examples/robot.yaml
diff examples/robot.yaml examples/drive.yaml
static examples/lidar.launch -f text
solve examples/measurements.yaml -f text
solve --hand-eye examples/hand_eye_samples.json -f text
formats
formats urdf
sim follow --duration 3 -f text
sim follow --explain-step 0
sim run examples/turtles.yaml -f text
--help
--version -v
help
help common
help hand-eye
help extrinsics
help cookbook
sim follow --help
sim run --help
sim teleop --help
"""
LINES = [*dict.fromkeys([*TABLE, *((line, "") for line in FURTHER.split("\n") if line)])]
LINES += [(f"{name} {option}", "") for name in NAMES for option in ("--help", "--help-all")] + [(f"help {name}", "") for name in topics()]
DRAWN = ("view",)  # a picture has no words to lose


def _words(text: str) -> set[str]:
    """Return the words of a text without the marks that a fold puts between them, and the headings that it spells `<-`."""
    return set(text.replace(",", " ").replace(":", " ").split()) - {"│"}


@pytest.mark.parametrize(("line", "name"), LINES, ids=[f"{line} < {name}".rstrip("< ") for line, name in LINES])
def test_text_fits_eighty_columns_and_loses_nothing_in_fewer_or_more(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, name: str
) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    printed = {}
    for columns in (80, 40, 20, 200):
        monkeypatch.setitem(os.environ, "COLUMNS", str(columns))
        outcome = run(*shlex.split(line), stdin=STREAMS[name])
        assert outcome.status in (0, 1, 3 * line.startswith("solve")), outcome.err  # that leaves out a wrong row
        assert "Traceback" not in outcome.err
        printed[columns] = outcome.out
    assert [each for each in printed[80].split("\n") if len(each) > 80] == []
    for columns in (40, 20, 200):
        if "help" in line:
            assert "".join(printed[columns].split()) == "".join(printed[80].split())
        elif not line.startswith(DRAWN):
            assert _words(printed[columns]) == _words(printed[80])
