"""Settings of Sphinx for the site: a copy of this file, with the version and the address behind it, is its conf.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

project = "frametool"
author = project_copyright = "the frametool authors"
extensions = ["myst_parser"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
exclude_patterns = ["html"]  # where the pages are made
smartquotes = False  # -- is an option, and what is quoted can be pasted
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = ["llms.txt"]
html_sourcelink_suffix = ""  # `_sources` has each page as Markdown: llms.txt leads there
html_search_scorer = str(Path(__file__).with_name("scorer.js"))
html_use_index = False
html_show_search_summary = False  # it would read every page that is found, which no browser allows in a folder


def setup(app: Any) -> None:
    """Shorten the side bar before the theme makes it."""
    app.connect("html-page-context", show_one_branch, priority=400)


def show_one_branch(_app: Any, _name: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
    """Let the side bar show pages of one kind; all of them on every page would be most of the site, and of its time."""
    whole = context["toctree"]
    context["toctree"] = lambda **options: whole(**options | {"collapse": True})
