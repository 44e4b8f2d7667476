"""What the worker of the page asks Python for: the answer to a line, and the words that may complete it."""

from __future__ import annotations

import os
import re
from typing import Any

from frametool import run
from frametool.cli.commands.help import example, names

EXAMPLES = {name: example(name) for name in names() if not name.endswith((".md", ".svg", ".png"))}
os.environ["TERM"] = "xterm-256color"


def examples_for(text: str, found: dict[str, bytes]) -> dict[str, bytes]:
    """Return the examples that a text names, and those that they name, as `robot.yaml` and `examples/robot.yaml`."""
    for name, content in EXAMPLES.items():
        if name not in found and re.search(rf"(?<!-o ){re.escape(name)}", text):  # not where a result is written
            found |= {name: content, f"examples/{name}": content}
            examples_for(content.decode(errors="replace"), found)
    return found


def answer(line: str, files: dict[str, Any], columns: int) -> dict[str, Any]:
    """Run a line, and return what the page shows of it.

    needs: the package that is missing in a browser, "" if none is
    """
    own = {name: bytes(content) for name, content in files.items()}
    ran = run(line, b"", examples_for(line, {}) | own, columns=columns)
    needs = next((name for name in ("numpy", "rosbags", "pyarrow") if f"named '{name}" in ran.err), "")
    return {"out": ran.out, "err": ran.err, "status": ran.status, "files": ran.files, "needs": needs}


def complete(line: str, files: dict[str, Any]) -> list[list[str]]:
    """Return what may end a line: each word, and what it means."""
    begun = line.rpartition(" ")[2]
    held = examples_for(line, {}) | {name: bytes(content) for name, content in files.items()}
    os.environ["_FRAMETOOL_COMPLETE"] = "words"
    try:
        ran = run([f"frametool {line}"], files=held)
    finally:
        del os.environ["_FRAMETOOL_COMPLETE"]
    rows = [row.split("\t") for row in ran.out.decode().splitlines()]
    found = [row[1:] for row in rows if row[0] == "plain"]
    if any(row[0] == "file" for row in rows):
        known = [*files, *(f"examples/{name}" for name in EXAMPLES)]
        found += [[name, ""] for name in known if name.startswith(begun)]
    return found
