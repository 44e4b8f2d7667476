"""The manual pages are those that the commands' help makes."""

from __future__ import annotations

import shutil
import subprocess

import man_pages

PAGES = man_pages.pages()


def test_the_pages_are_up_to_date() -> None:
    """Write them with `python tests/man_pages.py`."""
    assert {path.name: path.read_text() for path in man_pages.FOLDER.glob("*.1")} == PAGES


def test_a_page_has_a_name_and_what_it_does() -> None:
    for file, text in PAGES.items():
        name, lines = file.removesuffix(".1"), text.split("\n")
        assert lines[0].startswith(f".TH {name.upper()} 1 ")
        assert lines[1] == ".SH NAME"
        assert lines[2].startswith(f"{name} \\- ")


def test_the_formatter_has_nothing_to_complain_of() -> None:
    tool = shutil.which("groff")
    if tool is None:  # the rule that always holds: no line begins with a request that is not ours
        known = (".TH", ".SH", ".PP", ".TP", ".B ", ".BR", ".nf", ".fi")
        assert not [line for text in PAGES.values() for line in text.split("\n") if line[:1] in (".", "'") and not line.startswith(known)]
        return
    done = subprocess.run([tool, "-man", "-Tutf8", "-ww", *sorted(man_pages.FOLDER.glob("*.1"))], capture_output=True, text=True, check=True)
    assert not done.stderr
