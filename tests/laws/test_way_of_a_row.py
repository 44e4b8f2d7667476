"""How much code a row meets on its way: functions run, files touched and their code lines, counted in a real run.

The bounds of MOST may only be lowered.  `python tests/laws/test_way_of_a_row.py` prints today's numbers beside them.
"""

from __future__ import annotations

import io
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = f"{ROOT / 'frametool'}{os.sep}"
RECORDS = "".join(f'{{"id": {at}, "frame": "lidar", "point": [{at}.0, 0.0, 0.5]}}\n' for at in range(40))
FILES = {
    "point.csv": "x,y,z\n1,2,3\n",
    "records.jsonl": RECORDS,
    "walk.tum": "".join(f"{at}.0 {at}.0 0 0 0 0 0.6 0.8\n" for at in range(40)),
    "robot.yaml": (ROOT / "examples" / "robot.yaml").read_text(encoding="utf-8"),
}
WAYS = {
    "one CSV point": "apply robot.yaml map lidar -i point.csv",
    "40 JSON records": "apply robot.yaml map lidar -i records.jsonl",
    "40 JSON records to CSV": "apply robot.yaml map lidar -i records.jsonl -f csv",
    "TUM to KITTI": "convert -i walk.tum -f kitti",
    "YAML lookup": "lookup robot.yaml map lidar",
    "convert of numbers": "convert --from rpy_deg 0 0 90",
}


class Cost(NamedTuple):
    """What a run touches of the package: functions (with lambdas and comprehensions), files, lines of the functions."""

    functions: int
    files: int
    lines: int


MOST = {
    "one CSV point": Cost(functions=409, files=43, lines=3403),  # the aim: 320 functions, 30 files
    "40 JSON records": Cost(functions=364, files=42, lines=3201),  # 340, 32
    "40 JSON records to CSV": Cost(functions=375, files=42, lines=3222),  # 340, 32
    "TUM to KITTI": Cost(functions=352, files=38, lines=2675),  # 320, 30
    "YAML lookup": Cost(functions=218, files=29, lines=1779),  # 220, 28
    "convert of numbers": Cost(functions=103, files=20, lines=767),  # 120, 20
}


def cost(run: Callable[[], Any]) -> Cost:
    """Count what a run calls; what is run while a module is imported counts too, so that a first run comes before."""
    codes: set[CodeType] = set()

    def note(frame: Any, event: str, _argument: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(PACKAGE):
            codes.add(frame.f_code)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(before)
    lines = {(code.co_filename, line) for code in codes for *_, line in code.co_lines() if line}
    return Cost(len(codes), len({code.co_filename for code in codes}), len(lines))


@pytest.mark.parametrize("way", WAYS)
def test_a_row_meets_no_more_code_than_before(run: Callable[..., Any], way: str) -> None:
    arguments = shlex.split(WAYS[way])
    assert run(*arguments, files=FILES).status == 0
    found = cost_in_silence(arguments)
    if sys.version_info >= (3, 12):  # a comprehension is part of its function there, also one that did not run
        found = found._replace(lines=0)
    assert all(each <= most for each, most in zip(found, MOST[way], strict=True)), f"{found} > {MOST[way]}"


def cost_in_silence(arguments: list[str]) -> Cost:
    """Count what the command line calls with nothing on its input; what it writes is dropped."""
    from frametool import cli
    from frametool.cli.commands.batch import reader, streams, writer

    with streams(reader(io.BytesIO()), writer(io.BytesIO())):
        return cost(lambda: cli.run(arguments))


def main(ways: list[str]) -> None:
    """Print what each way costs, each in a process of its own: what one has cached spares another some calls."""
    if not ways:
        for way in WAYS:
            subprocess.run([sys.executable, __file__, way], check=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
        return
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, text in FILES.items():
            Path(name).write_text(text, encoding="utf-8")
        for way in ways:
            arguments = shlex.split(WAYS[way])
            cost_in_silence(arguments)
            print(f'    "{way}": {cost_in_silence(arguments)},  # bound: {MOST.get(way)}')
        os.chdir(ROOT)


if __name__ == "__main__":
    main(sys.argv[1:])
