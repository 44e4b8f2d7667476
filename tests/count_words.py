"""Count words that a manual of the field does not use: `python tests/count_words.py` prints a row a room, and the total.

The text of modules, pages and documents is counted: identifiers part by part, docstrings, comments and messages.
"closed form" and its like are the field's own and do not count.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "frametool"
DOCUMENTS = [
    "README.md", "CHANGELOG.md", ".github/CONTRIBUTING.md", "tests/benchmarks/README.md",
    "examples/COOKBOOK.md", "examples/SKILL.md", "examples/BEYOND.md",
]  # fmt: skip
WORDS = {
    "told": r"[Tt]old",
    "beside": r"[Bb]eside",
    "given": r"[Gg]iven",
    "form": r"(?<!closed )(?<!closed_)(?<!normal )(?<!quadratic )(?:[Ff]orms?|FORMS?(?![A-Z]))(?! feed)",
    "tell/say": r'(?<=""")(?:Tell|Say)|tell(?:s|ing)? (?:whether|what|why|which|how)',
    "stands": r"[Ss]tand(?:s|ing)?",
    "is none": r"(?:is|are) none",
    "odd": r"[Oo]dd",
}
COUNTED = {word: re.compile(rf"(?<![A-Za-z])(?:{pattern})(?![a-z])") for word, pattern in WORDS.items()}


def words_of(text: str) -> Counter[str]:
    """Count each of WORDS in a text; a part of an identifier is a word."""
    return Counter({word: len(pattern.findall(text)) for word, pattern in COUNTED.items()})


def rooms() -> dict[str, Counter[str]]:
    """Count the words by room: a folder or a module of the package, the help topics, or a document."""
    found: dict[str, Counter[str]] = {}
    files = [path for kind in ("py", "txt", "js", "css", "html") for path in PACKAGE.rglob(f"*.{kind}")]
    for path in [*files, *(ROOT / name for name in DOCUMENTS)]:
        inside = path.relative_to(PACKAGE if path in files else ROOT)
        room = "topics" if path.parent.name == "topics" else inside.parts[0] if path in files else str(inside)
        found.setdefault(room, Counter()).update(words_of(path.read_text(encoding="utf-8")))
    return found


if __name__ == "__main__":
    counts = rooms()
    print(f"{'':28}" + "".join(f"{word:>9}" for word in WORDS))
    for name in sorted(counts):
        print(f"{name:28}" + "".join(f"{counts[name][word]:9}" for word in WORDS))
    print(f"{'total':28}" + "".join(f"{sum(each[word] for each in counts.values()):9}" for word in WORDS))
