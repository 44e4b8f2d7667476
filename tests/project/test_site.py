"""The site: a page for each row of the tables, links that hold, nothing from elsewhere, and a search that finds."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlsplit

import make_site
import pytest
from chromium import serving
from console import ROOT
from site_pages import calls, markup, texts, try_it
from site_pages.cookbook import questions

import frametool
from frametool.cli.commands.help import names, topics
from frametool.cli.commands.help import questions as answers
from frametool.formats.table import FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

ADDRESS = "https://example.org/frametool"
KINDS = ("cookbook", "commands", "topics", "formats", "examples", "python")
LOADED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "object": "data", "embed": "src"}
# their words in another order, some left out, as somebody would type them
TYPED = {
    "yaw from quaternion": "Quaternion to yaw, or to roll, pitch, yaw?",
    "xyzw or wxyz": "Is it xyzw or wxyz?",
    "gimbal lock": "What happens at gimbal lock?",
    "opencv rvec matrix": "OpenCV's rvec to a matrix?",
    "how to chain transforms": "How do I chain transforms?",
    "urdf link joint values": "The pose between two links of a URDF, at joint values?",
    "colmap camera centres": "Camera centres of a COLMAP model?",
    "convert gps to utm": "GPS to ECEF, or to UTM?",
    "where is the camera in the hand": "Where is the camera in the hand (eye-in-hand)?",
    "translation error percent kitti": "Translation error in percent, as KITTI ranks?",
}  # fmt: skip


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    """Make the site's Markdown."""
    return make_site.files()


class Read(HTMLParser):
    """What a page has: the names of its places, where it leads, what it loads."""

    def __init__(self, path: Path) -> None:
        """Read a page."""
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text())

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Take down what an element has."""
        found = {name: value or "" for name, value in attributes}
        self.places |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in LOADED and LOADED[tag] in found and found.get("rel") not in ("canonical", "next", "prev"):
            self.loaded.append(found[LOADED[tag]])


def expected() -> Iterator[str]:
    """Yield the pages there must be."""
    yield from (f"commands/{name.replace(' ', '-')}.md" for name in calls.commands())
    yield from (f"topics/{name}.md" for name in topics())
    yield from (f"formats/{name}.md" for name in FORMATS)
    yield from (f"python/{name}.md" for name in frametool.__all__ if name != "__version__")
    yield from (f"examples/{name.replace('.', '-')}.md" for name in names() if not name.endswith(".md"))
    yield from (each.path for each in questions())
    yield from {f"cookbook/{markup.slug(each.chapter)}.md" for each in questions()}
    yield from (f"formats/{name}.md" for name in ("read", "only-written"))
    yield from (f"{kind}/index.md" for kind in KINDS)
    yield from (page for file, (page, *_) in texts.TEXTS.items() if (ROOT / file).is_file())
    yield from ("index.md", "404.md", "llms.txt", "robots.txt", "conf.py", "static/site.css", "static/mark.svg", "scorer.js")


def test_there_is_a_page_for_each_row_of_the_tables_and_no_other(files: dict[str, str]) -> None:
    assert sorted(files) == sorted(expected())


@pytest.mark.parametrize("folder", KINDS)
def test_an_index_lists_all_pages_of_its_kind_by_group(files: dict[str, str], folder: str) -> None:
    (kind,) = (each for each in make_site.sections() if each.folder == folder)
    listed = re.findall(r"(?m)^(?:## (.+)|- \[.*?\]\((.+?)\))", files[f"{folder}/index.md"])
    wanted = [each for heading, pages in kind.groups.items() for each in [(heading, ""), *(("", page.path.removeprefix(f"{folder}/")) for page in pages)]]
    assert listed == [each for each in wanted if any(each)]


def test_every_question_has_a_page_with_its_commands_and_what_they_print(files: dict[str, str]) -> None:
    assert [each.title for each in questions()] == list(answers())
    for each in questions():
        page = files[each.path]
        block = "".join(f"$ {command}\n{output}" for command, output in each.shell)
        assert page.startswith(f"# {markup.inline(each.title)}\n\n```console\n{block.rstrip()}\n```"), each.title
        assert each.commands, each.title


@pytest.mark.parametrize(("text", "markdown"), [
    ("--from and a_from_b, {x: 1} or [a, b]; * is times", r"`--from` and `a_from_b`, `{x: 1}` or `[a, b]`; \* is times"),
    ("see `frametool help pose` (help time)", "see [`help pose`](/topics/pose.md) ([`help time`](/topics/time.md))"),
    ("a<-b, x -> y; #1", r"`a<-b`, x -\> y; \#1"),
])  # fmt: skip
def test_plain_text_is_shown_as_it_is(text: str, markdown: str) -> None:
    assert markup.inline(text) == markdown


def test_a_command_line_is_taken_apart() -> None:
    found = calls.calls("frametool lookup a.yaml x y --at 2 -f json | frametool sim follow --seed 1; frametool --version")
    assert [(call.name, [option.name for option in call.options]) for call in found] == [("lookup", ["at", "format_name"]), ("sim follow", ["seed"])]


@pytest.mark.parametrize(("title", "kind", "expected"), [
    ("GPS to ECEF, or to UTM?", "topics", ["earth", "rotations"]),
    ("Camera centres of a COLMAP model?", "forms", ["colmap"]),
    ("Where is the camera in the hand (eye-in-hand)?", "files", ["gripper.csv", "target.csv"]),
    ("Where does turtle2 see turtle1 after two seconds?", "commands", ["sim follow", "lookup", "apply"]),
])  # fmt: skip
def test_a_question_leads_to_what_it_uses(title: str, kind: str, expected: list[str]) -> None:
    (question,) = (each for each in questions() if each.title == title)
    assert getattr(question, kind) == expected


@pytest.mark.parametrize(("file", "link", "page"), [
    ("README.md", "examples/COOKBOOK.md", "/cookbook/index.md"),
    ("README.md", "CHANGELOG.md", "/changelog.md"),
    ("examples/BEYOND.md", "../README.md", "/index.md"),
    ("examples/SKILL.md", "robot.yaml", "/examples/robot-yaml.md"),
])  # fmt: skip
def test_a_link_to_a_file_leads_to_its_page(file: str, link: str, page: str) -> None:
    assert texts.page_of(file, link) == page


def test_a_link_to_a_file_without_a_page_ends_the_script() -> None:
    with pytest.raises(SystemExit, match=r"README\.md: LICENSE has no page; give it a row in TEXTS of .*texts\.py, or link to its address"):
        texts.page_of("README.md", "LICENSE")


def test_no_address_is_made_up_and_the_one_that_is_given_is_used(files: dict[str, str]) -> None:
    written = (ROOT / "README.md").read_text()  # a release makes its links whole
    assert [link for text in files.values() for link in re.findall(r"https?://[^\s)\"'`]+", text) if link not in written] == ["http://www.sitemaps.org/schemas/sitemap/0.9", "http://www.w3.org/2000/svg"]  # names of what is written
    given = make_site.files("https://example.org/frametool")
    assert "(https://example.org/frametool/_sources/topics/pose.md)" in given["llms.txt"]
    assert "html_baseurl = 'https://example.org/frametool/'\n" in given["conf.py"]


def test_a_command_that_runs_in_the_browser_leads_there() -> None:
    made = make_site.files(calculator=True)
    links = re.findall(r'<a href="\.\./calculator/index\.html#l=([^"]+)">Try (?:it|command \d)</a>', "".join(made.values()))
    assert sorted(f"frametool {unquote(each)}" for each in links) == sorted(try_it.lines()[command] for each in questions() for command, _ in each.shell if command in try_it.lines())
    assert len(links) > 60
    assert '<a href="calculator/index.html">Try it in the browser</a>' in made["index.md"]
    assert "'extra'" in made["conf.py"]


def test_the_home_page_installs_what_is_published(files: dict[str, str]) -> None:
    assert files["index.md"].index("pipx install frametool") < files["index.md"].index("## Ten questions")
    assert "pip install -q ." not in files["index.md"]


def test_every_command_shows_its_output_and_says_what_its_arguments_are(files: dict[str, str]) -> None:
    for name in calls.commands():
        page = files[f"commands/{name.replace(' ', '-')}.md"]
        assert "```console\n$ " in page or name in ("view", "record") or name.startswith("sim"), name  # they draw, or write files
        assert all(": " in line for line in re.findall(r"(?ms)^## Arguments\n\n(.*?)\n\n", page)), name


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the site as the script says it is made; any warning is an error."""
    for package in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(package, reason=f"no {package} to make the site with")
    folder = tmp_path_factory.mktemp("site")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "1"}
    for command in ([str(ROOT / "tests" / "make_site.py"), ".", "--address", ADDRESS], ["-m", "sphinx", "-q", "-W", "-b", "html", ".", "html"]):
        done = subprocess.run([sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Read]:
    """Read all pages."""
    return {path: Read(path) for path in site.rglob("*.html")}


def test_two_runs_write_the_same(site: Path) -> None:
    files = make_site.files(ADDRESS)
    assert {name: (site.parent / name).read_text() for name in files} == {name: f"{text.rstrip()}\n" for name, text in files.items()}


def test_every_link_holds_with_its_fragment(pages: dict[Path, Read], site: Path) -> None:
    broken = []
    for path, page in pages.items():
        for link in page.links + page.loaded:
            parts = urlsplit(link)
            if parts.scheme:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            known = pages[target].places if target in pages else {""}
            if not target.is_file() or unquote(parts.fragment) not in known | {""}:
                broken.append(f"{path.relative_to(site)}: {link}")
    assert broken == []


def test_every_link_of_the_markdown_and_of_llms_holds(files: dict[str, str], site: Path) -> None:
    sources = site / "_sources"
    texts = [site / "llms.txt", *sources.rglob("*.md")]
    broken = [
        (path.name, link) for path in texts for link in re.findall(r"\]\(([^)#\s]+\.md)\)", path.read_text())
        if not (path.parent / link.removeprefix(f"{ADDRESS}/")).is_file()
    ]  # fmt: skip
    assert broken == []
    assert {path.relative_to(sources).as_posix() for path in sources.rglob("*.md")} == {name for name in files if name.endswith(".md")}


def test_nothing_is_loaded_from_elsewhere(pages: dict[Path, Read], site: Path) -> None:
    assert {link for page in pages.values() for link in page.loaded if urlsplit(link).netloc} == set()
    styles = "".join(path.read_text() for path in [*site.rglob("*.css"), *pages])
    assert re.findall(r"url\(\s*[\"']?(?:https?:)?//[^)]*|@import[^;]*", styles) == []


def test_ordinary_links_lead_only_where_the_texts_do_and_to_those_who_made_the_tools(files: dict[str, str], pages: dict[Path, Read]) -> None:
    written = "".join(files.values())
    found = {link for page in pages.values() for link in page.links if urlsplit(link).netloc and link not in written}
    assert found == {"https://www.sphinx-doc.org/", "https://pradyunsg.me", "https://github.com/pradyunsg/furo"}


def test_search_engines_find_each_page_with_what_it_is_about(pages: dict[Path, Read], site: Path) -> None:
    own = {path.relative_to(site).as_posix() for path in pages} - {"404.html", "search.html"}
    assert set(re.findall(rf"<loc>{ADDRESS}/(.*?)</loc>", (site / "sitemap.xml").read_text())) == own
    assert (site / "robots.txt").read_text() == f"User-agent: *\nAllow: /\nSitemap: {ADDRESS}/sitemap.xml\n"
    described = {name: re.findall(r'<meta name="description" content="([^"]*)">', (site / name).read_text()) for name in own}
    assert [name for name, found in described.items() if len(found) != 1 or not 10 < len(found[0]) <= 200] == []
    assert f'<base href="{ADDRESS}/">' in (site / "404.html").read_text()


def test_the_words_of_a_question_are_in_the_index_with_its_page(site: Path) -> None:
    language = pytest.importorskip("sphinx.search.en").SearchEnglish({})
    index = json.loads((site / "searchindex.js").read_text().removeprefix("Search.setIndex(").removesuffix(")"))

    def has(stem: str, page: int) -> bool:
        found = index["titleterms"].get(stem, [])
        return page in (found if isinstance(found, list) else [found])

    for each in questions():
        page = index["docnames"].index(each.path.removesuffix(".md"))
        stems = {language.stem(word.lower()) for word in language.split(each.title) if language.word_filter(word.lower())}
        assert [stem for stem in stems if not has(stem, page)] == [], each.title


@pytest.mark.parametrize(("typed", "title"), TYPED.items())
def test_a_search_by_words_finds_the_question_first(browser: Any, site: Path, typed: str, title: str) -> None:
    asked: list[str] = []
    complaints: list[str] = []
    tab = browser.new_page()
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.goto(f"file://{site}/index.html")
    tab.fill("input[name=q]", typed)
    tab.press("input[name=q]", "Enter")
    tab.wait_for_selector("ul.search li a")
    assert tab.inner_text("ul.search li a >> nth=0") == title
    tab.click("ul.search li a >> nth=0")
    tab.wait_for_selector(f"h1:has-text('{title.partition(chr(39))[0]}')")
    tab.close()
    assert complaints == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def test_a_search_on_a_server_shows_what_stands_around_the_words(browser: Any, site: Path) -> None:
    with serving(site) as address:
        tab = browser.new_page()
        tab.goto(f"{address}/search.html?q=rvec")
        tab.wait_for_selector("ul.search li p.context")
        assert "rvec" in tab.inner_text("ul.search li p.context >> nth=0").lower()
        tab.close()


@pytest.mark.parametrize("width", [390, 1400])
@pytest.mark.parametrize("path", ["index", "commands/convert", "cookbook/is-it-xyzw-or-wxyz", "formats/tum", "topics/pose", "python/Rotation"])
def test_no_page_is_wider_than_the_screen(browser: Any, site: Path, path: str, width: int) -> None:
    tab = browser.new_page(viewport={"width": width, "height": 800})
    tab.goto(f"file://{site}/{path}.html")
    assert tab.evaluate("document.documentElement.scrollWidth") == width
    tab.close()
