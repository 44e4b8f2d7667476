"""Lines are taken apart as bash takes them apart; what only a shell can do is refused."""

from __future__ import annotations

import os
import re
import subprocess
from random import Random

import pytest

from frametool.errors import Misused
from frametool.text.shell_words import goes_on, split

VALUES = {"x": '{"xyz": [1, 2]}', "y_1": "it's"}
PIECES = [
    "a", "convert", " ", "  ", "\t", "'", "'", '"', '"', "\\", "#", " # ", "$x", "${y_1}", "$", "{xyz: [1, 2]}", "-1e-3", "=", "\\$", "\\\\", "\u00e9",
    "'a b'", '"a b"', '"$x"', "\u00a0", "*", "?", "[", "/", "]",
]  # fmt: skip
BASH = r"""
set -f +B; IFS=
while read -r -d '' line; do
    if eval "set -- $line" 2>/dev/null; then for word; do printf '%s\x01' "$word"; done; else printf '\x02'; fi
    printf '\0'
done
"""


def taken_apart_by_bash(lines: list[str]) -> list[list[str] | None]:
    """Return the words of each line; None for a line that bash refuses."""
    text = "".join(f"{line}\0" for line in lines).encode()
    done = subprocess.run(["bash", "-c", BASH], input=text, capture_output=True, check=True, env=os.environ | VALUES)
    results = done.stdout.decode().split("\0")[:-1]
    return [None if result == "\2" else result.split("\1")[:-1] for result in results]


def test_words_are_those_of_bash() -> None:
    random = Random(1)  # noqa: S311 - a test's
    lines = ["".join(random.choices(PIECES, k=random.randrange(1, 12))) for _ in range(3000)]
    compared = refused = 0
    asked: list[str] = []

    def value_of(name: str) -> str:
        asked.append(name)
        return VALUES.get(name, "")

    for line, expected in zip(lines, taken_apart_by_bash(lines), strict=True):
        if goes_on(line) or re.search(r"\$(['\"$*?#[-]|\{(?!y_1\}))", line):  # quotes and parameters that only a shell has
            continue
        asked.clear()
        try:
            words = split(line, value_of)
        except Misused:
            assert expected is None, line
            refused += 1
        else:
            assert expected is not None, line
            if set(asked) <= set(VALUES):
                assert words == expected, line
                compared += 1
    assert min(compared, refused) > 200


@pytest.mark.parametrize(
    ("line", "words"),
    [("$$x ${x} $x", ["$x", "1", "1"]), ("'$x' \"$x\" \\$x", ["$x", "1", "$x"]), ("inv($x) ~$x a$", ["inv(1)", "~1", "a$"])],
)
def test_names_stand_for_values_but_in_single_quotes(line: str, words: list[str]) -> None:
    assert split(line, {"x": "1"}.__getitem__) == words


def test_a_folder_of_ones_own_is_found() -> None:
    assert split("~/a b~/c '~/d'", str) == [os.path.expanduser("~/a"), "b~/c", "~/d"]


@pytest.mark.parametrize("line", ["a | b", "a > b", "a < b", "a; b", "a & b", "a `b`", "a $(b)", "a $1", "a ${b-c}", "a $'b'", 'a "`b`"'])
def test_what_only_a_shell_can_do_is_refused(line: str) -> None:
    with pytest.raises(Misused):
        split(line, str)


@pytest.mark.parametrize("line", ["a \\", '"a \\', "\\", "a \\\\\\"])
def test_a_backslash_at_the_end_joins_lines(line: str) -> None:
    assert goes_on(line)


@pytest.mark.parametrize("line", ["a \\\\", "# \\", "a # \\", "a"])
def test_a_backslash_that_is_taken_or_in_a_comment_joins_nothing(line: str) -> None:
    assert not goes_on(line)
