"""How much a document may hold: far beyond any robot, well within a small machine."""

from __future__ import annotations

DEEPEST = 1000
"""Most levels of lists and maps; a tree of 60 frames in a row has 120."""

MOST_CONTAINERS = 4_000_000
"""Most lists and maps in one text: each takes 64 bytes or more, and 3 characters to write."""


def too_much(depth: int) -> str:
    """Say which of the two limits is passed at a depth."""
    if depth >= DEEPEST:
        return f"nested deeper than {DEEPEST} levels"
    return f"more than {MOST_CONTAINERS} lists and maps in one file; split it"
