"""The words of a manual: what WORDS in tests/count_words.py counts becomes rarer, room by room."""

from __future__ import annotations

from collections import Counter

import pytest
from count_words import WORDS, rooms

UNREVISED = {
    "cli": dict(zip(WORDS, (102, 26, 173, 495, 34, 39, 6, 11), strict=True)),
    "stream": dict(zip(WORDS, (60, 197, 241, 389, 83, 129, 32, 61), strict=True)),
    "view": dict(zip(WORDS, (7, 10, 0, 20, 3, 41, 2, 3), strict=True)),
}
MOST = dict(zip(WORDS, (175, 150, 411, 465, 88, 354, 62, 83), strict=True))


def test_no_unrevised_room_uses_such_words_more_often_than_before() -> None:
    counts = rooms()
    assert {name: counts[name] - Counter(most) for name, most in UNREVISED.items() if counts[name] - Counter(most)} == {}


@pytest.mark.parametrize("word", WORDS)
def test_the_other_rooms_use_such_words_where_they_are_plain_english(word: str) -> None:
    assert sum(counts[word] for name, counts in rooms().items() if name not in UNREVISED) <= MOST[word]
