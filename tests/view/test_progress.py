"""What is shown of a long job on a terminal: late, and not once a row."""

from __future__ import annotations

import io
import sys

import pytest

from frametool.view import text


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_bar_is_drawn_ten_times_a_second_and_not_once_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    progress = pytest.importorskip("rich.progress")
    clock = iter(range(10**6))
    drawn: list[str] = []
    monkeypatch.setattr("time.monotonic", lambda: next(clock) / 1000)
    monkeypatch.setattr(progress.Progress, "start", lambda _: None)
    monkeypatch.setattr(progress.Progress, "update", lambda *_, description, **__: drawn.append(description))
    monkeypatch.setattr(sys, "stderr", Terminal())
    with text.progress_bar(None, counted="messages") as advance:
        for _ in range(3000):
            advance(1, 100)
    assert 5 <= len(drawn) <= 10
    assert drawn[0].startswith("2,000 messages ")
