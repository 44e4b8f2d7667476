"""Count the package: `python tests/count_code.py` prints a row a room, its files and its lines of code, and the total.

A line of code holds a token that is part of the program: blanks, comments and docstrings do not count.  All files
count.  What pages hold of JavaScript and CSS is counted by itself, without blank lines and comments.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter
from pathlib import Path

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
    """Return the files and the lines of code of each folder of the package; a module outside of them is its own room."""
    files: Counter[str] = Counter()
    lines: Counter[str] = Counter()
    for path in PACKAGE.rglob("*.py"):
        room = path.relative_to(PACKAGE).parts[0]
        files[room] += 1
        lines[room] += code_lines(path.read_text(encoding="utf-8"))
    return files, lines


def page_lines() -> int:
    """Return how many lines of JavaScript and CSS the pages hold."""
    texts = [path.read_text(encoding="utf-8") for kind in ("js", "css") for path in PACKAGE.rglob(f"*.{kind}")]
    stripped = [line.strip() for text in texts for line in re.sub(r"(?s)/\*.*?\*/", "", text).splitlines()]
    return sum(bool(line) and not line.startswith("//") for line in stripped)


if __name__ == "__main__":
    files_of, lines_of = rooms()
    for name, count in lines_of.most_common():
        print(f"{name:12} {files_of[name]:4} files {count:6} lines")
    print(f"{'total':12} {files_of.total():4} files {lines_of.total():6} lines; of JavaScript and CSS {page_lines()}")
