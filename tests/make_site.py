"""The site out of the tables that the helps are made of: `python tests/make_site.py OUT [--address URL] [--calculator]`.

It writes Markdown and conf.py into the folder OUT; `python -m sphinx -W -b html OUT OUT/html` makes the pages, with the
extra `docs`. Nothing is loaded from elsewhere, when it is made or when it is read. With the address at which the site
will be, llms.txt, the pages and the list for search engines name it. With the calculator, whose packages are fetched,
each command that runs there leads to it.
"""

from __future__ import annotations

import argparse
import posixpath
import re
import shutil
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import make_calculator
from console import ROOT
from make_picture import PICTURE
from site_pages import commands, example_files, forms, python_names, questions, texts, topics
from site_pages.markup import Page, Section, bullets, inline, slug

import frametool

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
SETTINGS = Path(__file__).parent / "site_pages"


CALCULATOR = "calculator/index.html"
NOT_FOUND = "---\norphan: true\n---\n\n# There is no such page\n\nThe [home page](/index.md) leads to all there is; the search finds words in it.\n"


def sections(*, calculator: bool = False) -> list[Section]:
    """Return the kinds of pages, in the order of the side bar."""
    others = [each.section() for each in (commands, topics, forms, example_files, python_names)]
    return [questions.section(f"../{CALCULATOR}" if calculator else ""), *others]


def files(address: str = "", *, calculator: bool = False) -> dict[str, str]:
    """Return the text of each file of the site by its path; links lead from page to page."""
    address = f"{address.rstrip('/')}/" if address else ""
    kinds, single = sections(calculator=calculator), texts.pages()
    lists = [page for kind in kinds for page in _indexes(kind)]
    pages = {page.path: f"# {inline(page.title)}\n\n{page.text}" for page in [*single, *lists, *(each for kind in kinds for each in kind.pages)]}
    pages |= {"index.md": _home(kinds, single, calculator=calculator), "404.md": NOT_FOUND}
    made = {path: _relative(text, path, pages) for path, text in pages.items()}
    made["llms.txt"] = _llms(kinds, single, address)
    made["robots.txt"] = "User-agent: *\nAllow: /\n" + (f"Sitemap: {address}sitemap.xml\n" if address else "")
    about: dict[str, object] = {"release": frametool.__version__, "html_title": f"frametool {frametool.__version__}", "html_baseurl": address}
    about |= {"html_extra_path": ["llms.txt", "robots.txt", "extra"]} if calculator else {}
    settings = "".join(f"{name} = {value!r}\n" for name, value in about.items())
    made["conf.py"] = f"{(SETTINGS / 'conf.py').read_text('utf-8')}\n\n{settings}"
    made |= {path: (SETTINGS / Path(path).name).read_text("utf-8") for path in ("static/site.css", "static/mark.svg", "scorer.js")}
    return made


def _relative(text: str, path: str, pages: Mapping[str, str]) -> str:
    """Return the text of a page with links as they are from there, in the place of those that begin at the top."""

    def moved(found: re.Match[str]) -> str:
        if found[1][1:] not in pages and not found[1].endswith((".svg", ".png")):
            raise SystemExit(f"{path}: the link to {found[1]} leads to no page")
        return f"]({posixpath.relpath(found[1], f'/{posixpath.dirname(path)}')}"

    return re.sub(r"\]\((/[^)#\s]+)", moved, text)


def _indexes(kind: Section) -> Iterator[Page]:
    """Yield the page that lists all of one kind, and one for each group that has a name."""
    parts, below = [kind.about], []
    for heading, pages in kind.groups.items():
        listed = bullets(map(_line, pages))
        group = Page(f"{kind.folder}/{slug(heading)}.md", heading, heading, "", f"{listed}\n\n{_toctree(pages)}")
        if heading:
            yield group
        parts += [f"## {heading}"] * bool(heading) + [listed]
        below += [group] if heading else pages
    yield Page(f"{kind.folder}/index.md", kind.title, kind.title, kind.about, "\n\n".join([*parts, _toctree(below)]))


def _line(page: Page) -> str:
    about = inline(page.about, linked=False)
    return f"[{inline(page.label, linked=False)}](/{page.path})" + (f": {about}" if about else "")


def _home(kinds: list[Section], single: list[Page], *, calculator: bool) -> str:
    heads = [Page(f"{kind.folder}/index.md", kind.title, kind.title, "", "") for kind in kinds]
    tried = f'<p class="try"><a href="{CALCULATOR}">Try it in the browser</a> without an installation</p>\n\n' if calculator else ""
    title, _, text = texts.home().partition("\n\n")
    return f"{title}\n\n{tried}{text}\n\n{_toctree([*heads, *single])}"


def _toctree(pages: Iterable[Page]) -> str:
    """Return what makes the side bar."""
    return "\n".join(["```{toctree}", ":hidden:", "", *(f"{page.label} </{page.path}>" for page in pages), "```"])


def _llms(kinds: list[Section], single: list[Page], address: str) -> str:
    """Return llms.txt (llmstxt.org): what this is in a line, and the Markdown of every page."""
    brief = next(page.text for page in single if page.path == "skill.md").partition("\n## ")[0]
    parts = ["# frametool", f"> {PROJECT['description']}.", brief]
    for kind in kinds:
        parts += [f"## {kind.title}", bullets(map(_line, kind.pages))]
    parts += ["## Optional", bullets(map(_line, single))]
    return re.sub(r"\]\(/(?=\S+\.md\))", f"]({address}_sources/", "\n\n".join(parts)) + "\n"


def write(folder: Path, address: str = "", *, calculator: bool = False) -> None:
    """Write the site into a folder; what it has besides stays."""
    for name, text in files(address, calculator=calculator).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{text.rstrip()}\n", "utf-8")
    for picture in (ROOT / "examples").glob("*.[sp][vn]g"):
        shutil.copy(picture, folder / "examples")
    shutil.copy(PICTURE, folder / "static")
    if calculator:
        make_calculator.write(folder / "extra" / "calculator")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write the site as Markdown.")
    parser.add_argument("out", type=Path, metavar="OUT", help="the folder that it is written into")
    parser.add_argument("--address", default="", metavar="URL", help="where the site will be, for llms.txt and the pages")
    parser.add_argument("--calculator", action="store_true", help="with the page that runs commands in the browser")
    arguments = parser.parse_args()
    write(arguments.out, arguments.address, calculator=arguments.calculator)
