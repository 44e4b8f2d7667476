"""How much a document may hold: room for a million frames, none for a short text that asks for gigabytes.

Plain size is no fault: it costs what it is long.  What is held back is depth, which takes stack; lists and maps, which
take thirty times the room that they are written in; and what aliases repeat, which grows without bound.
"""

from __future__ import annotations

DEEPEST = 1000
"""Most levels of lists and maps; a tree of 60 frames in a row has 120."""

MOST_CHARACTERS = 1 << 30
"""Longest text read as one file of documents, also in bytes; a million frames take 100 to 600 million."""

MOST_CONTAINERS = 10_000_000
"""Most lists and maps in one text: each takes 64 bytes or more, and 3 characters to write; a million messages: 6e6."""

MOST_VALUES = 50_000_000
"""Most commas and line ends in one text: a value beside each takes 60 bytes; a million messages in lines have 4e7."""


def size_problem(text: str) -> str:
    """Say what of a text is too long; "" if nothing is."""
    if len(text) > MOST_CHARACTERS:
        return f"longer than {MOST_CHARACTERS} characters, the most in one file; split it"
    if len(text) > MOST_VALUES and text.count(",") + text.count("\n") > MOST_VALUES:
        return f"more than {MOST_VALUES} commas and line ends, the most in one file; split it"
    return ""


def too_much(depth: int) -> str:
    """Say which of the two limits is passed at a depth."""
    if depth >= DEEPEST:
        return f"nested deeper than {DEEPEST} levels"
    return f"more than {MOST_CONTAINERS} lists and maps in one file; split it"
