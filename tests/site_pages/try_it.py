"""The lines of the cookbook that the calculator page can run; `python tests/site_pages/try_it.py` prints them as JSON.

A page has no numpy, nothing of the extras and no shell: packages are taken away here, in a process of its own, and what
only shortens an answer (`| head -5`) is left off.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from urllib.parse import quote

MISSING = ("numpy", "rosbags", "mcap", "pyarrow", "laspy", "matplotlib")
NO_FILE = 5  # exit code of what needs a file, or a package, that is not there
TESTS = Path(__file__).resolve().parents[1]


SHORTENED = re.compile(r"( 2> ?/dev/null| 2>&1)?( \| (head|tail|sed|cut|wc)\b.*)?$")


@cache
def lines() -> dict[str, str]:
    """Return the lines of the cookbook that run there, each with how it is typed there."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS.parent), str(TESTS)]), "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run([sys.executable, __file__], env=environment, capture_output=True, check=True)
    found: dict[str, str] = json.loads(done.stdout)
    return found


def link(line: str) -> str:
    """Return what stands behind the address of the calculator to open it with a line."""
    return f"#l={quote(line.removeprefix('frametool '))}"


def main() -> None:
    """Print the lines that end no worse without the packages that are missing in a browser."""
    sys.modules |= dict.fromkeys(MISSING)  # type: ignore[arg-type]  # None: an import of it fails
    from console import ROOT, WIDTH

    import frametool
    from frametool.text.shell_words import pipeline
    from site_pages.cookbook import questions

    files = {f"examples/{path.name}": path.read_bytes() for path in (ROOT / "examples").iterdir()}
    found = {}
    for line in (command for each in questions() for command, _ in each.shell):
        typed = SHORTENED.sub("", line)
        if all(stage.split()[:1] == ["frametool"] for stage in pipeline(typed)):
            ran = frametool.run(typed, files=files, columns=WIDTH)
            if ran.status != NO_FILE and not re.search(r"a library cannot be loaded|is for a shell", ran.err):
                found[line] = typed
    print(json.dumps(found))


if __name__ == "__main__":
    main()
