"""Settings of Sphinx for the site: a copy of this file, with the version and the address behind it, is its conf.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

project = "frametool"
author = project_copyright = "the frametool authors"
extensions = ["myst_parser"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
exclude_patterns = ["html", "extra"]  # where the pages are made, and what is copied there
smartquotes = False  # -- is an option, and what is quoted can be pasted
html_theme = "furo"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1a5fd0", "color-brand-content": "#1a5fd0"},
    "dark_css_variables": {"color-brand-primary": "#7ab0ff", "color-brand-content": "#7ab0ff"},
}
html_logo = html_favicon = "static/mark.svg"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = ["llms.txt", "robots.txt"]
html_sourcelink_suffix = ""  # `_sources` has each page as Markdown: llms.txt leads there
html_search_scorer = str(Path(__file__).with_name("scorer.js"))
html_use_index = False
LONGEST_DESCRIPTION = 160


def setup(app: Any) -> None:
    """Shorten the side bar before the theme makes it, and tell search engines what there is."""
    app.connect("html-page-context", show_one_branch, priority=400)
    app.connect("html-page-context", describe)
    app.connect("build-finished", write_sitemap)


def describe(app: Any, name: str, _template: str, context: dict[str, Any], doctree: Any) -> None:
    """Give a page the description that a search engine shows: its title and how it begins."""
    if doctree is None:
        return
    from docutils import nodes

    paragraphs = sorted(doctree.findall(nodes.paragraph), key=lambda each: isinstance(each.parent, nodes.list_item))
    title = next(doctree.findall(nodes.title)).astext()
    words = f"{title}: {' '.join(each.astext() for each in paragraphs)}".split()
    while len(" ".join(words)) > LONGEST_DESCRIPTION:
        words.pop()
    context["metatags"] += f'<meta name="description" content="{escape(" ".join(words), {chr(34): "&quot;"})}">'
    if name == "404" and app.config.html_baseurl:  # it is shown at any address that does not exist
        context["metatags"] += f'<base href="{app.config.html_baseurl}">'


def write_sitemap(app: Any, error: Exception | None) -> None:
    """List the pages by their addresses, where the address of the site is known."""
    if error is None and app.config.html_baseurl:
        names = sorted(app.env.found_docs - {"404"})
        rows = "".join(f"<url><loc>{app.config.html_baseurl}{escape(name)}.html</loc></url>\n" for name in names)
        text = f'<?xml version="1.0" encoding="UTF-8"?>\n<urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">\n{rows}</urlset>\n'
        (Path(app.outdir) / "sitemap.xml").write_text(text, "utf-8")


def show_one_branch(_app: Any, _name: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
    """Let the side bar show pages of one kind; all of them on every page would be most of the site, and of its time."""
    whole = context["toctree"]
    context["toctree"] = lambda **options: whole(**options | {"collapse": True})
