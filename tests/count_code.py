"""Count the package: `python tests/count_code.py` prints a row a room, its files and its lines of code, and the total.

A line of code holds a token that is part of the program: blanks, comments and docstrings do not count.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from pathlib import Path

# what came after the size was settled: its files are counted apart, and no other may grow for it
LATER = (
    "fit", "frames/trajectory.py", "stream/trajectories.py", "view/comparison_text.py", "view/comparison_page.py",
    "geometry/placed.py", "geometry/uncertainty.py", "grammar/covariance.py", "covariance.py",
    "cli/completion.py",
    "stream/beside.py", "stream/carried.py", "geometry/earth.py", "geometry/transverse_mercator.py", "earth.py",
    "cli/commands/solve.py", "cli/solving.py", "stream/measurements.py", "stream/samples.py", "view/solution_text.py",
    "formats/trees/named.py", "formats/trees/kalibr.py", "formats/rows/bin_cloud.py", "cli/commands/examples.py",
    "geometry/place.py", "grammar/place.py", "stream/earth_columns.py", "stream/earth_records.py", "cli/earth.py",
    "cli/comparing.py", "cli/commands/compare.py", "cli/commands/align.py",
    "cli/commands/resample.py", "stream/recording_writer.py", "stream/block_writer.py",
    "cli/recording.py", "cli/folder_sink.py", "cli/commands/record.py", "stream/record_run.py",



)  # fmt: skip
PACKAGE = Path(__file__).resolve().parent.parent / "frametool"
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
NO_CODE = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING, tokenize.ENDMARKER,
}  # fmt: skip


def code_lines(text: str) -> int:
    """Return how many lines of a module hold code."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    lines = {line for each in tokens if each.type not in NO_CODE for line in range(each.start[0], each.end[0] + 1)}
    return len(lines - docstring_lines(ast.parse(text)))


def docstring_lines(tree: ast.Module) -> set[int]:
    """Return the lines of the docstrings of a module, its classes and its functions."""
    found: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node) is not None:
            found |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return found


def rooms() -> tuple[Counter[str], Counter[str]]:
    """Return the files and the lines of code of each folder of the package, those of `LATER` under `later`.

    A module outside of them is its own room.
    """
    files: Counter[str] = Counter()
    lines: Counter[str] = Counter()
    for path in PACKAGE.rglob("*.py"):
        inside = path.relative_to(PACKAGE)
        room = "later" if inside.as_posix() in LATER or inside.parts[0] in LATER else inside.parts[0]
        files[room] += 1
        lines[room] += code_lines(path.read_text(encoding="utf-8"))
    return files, lines


if __name__ == "__main__":
    files_of, lines_of = rooms()
    for name, count in lines_of.most_common():
        print(f"{name:12} {files_of[name]:4} files {count:6} lines")
    settled = (files_of.total() - files_of["later"], lines_of.total() - lines_of["later"])
    print(f"{'settled':12} {settled[0]:4} files {settled[1]:6} lines, without what came later")
    print(f"{'total':12} {files_of.total():4} files {lines_of.total():6} lines")
