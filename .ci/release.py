"""What a release changes in its sources: `release.py FOLDER ADDRESS [TAG]`, called by `.ci/release` on a copy of them.

The package gets the addresses that nobody knew before, README the set-up without a clone and links to ADDRESS, the
recipe of conda the version.
"""

from __future__ import annotations

import re
import sys
import tomllib
from datetime import date
from pathlib import Path

USAGE = ".ci/release https://HOST/OWNER/NAME [vVERSION] [--no-tests]"
PAGES = {
    "Homepage": "",
    "Documentation": "/blob/{}/README.md",
    "Changelog": "/blob/{}/CHANGELOG.md",
    "Issues": "/issues",
}
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
RELATIVE = re.compile(r"(!\[[^\]]*)?\]\((?![a-z][a-z0-9+.-]*:|#)([^)\s]+)\)")


class Refused(Exception):
    """A reason why there is no release: what is wrong, what to do."""


def main(words: list[str]) -> None:
    """Check and change the sources, or raise Refused."""
    if len(words) not in (2, 3):
        raise Refused(f"usage: {USAGE}")
    folder, address, tag = Path(words[0]), words[1].rstrip("/").removesuffix(".git"), "".join(words[2:])
    if not re.fullmatch(r"https://[^/\s]+/\S+", address):
        raise Refused(f"ADDRESS {words[1]!r} is not that of a repository; usage: {USAGE}")
    project, readme = folder / "pyproject.toml", folder / "README.md"
    if not project.is_file():
        raise Refused("the last commit has no pyproject.toml here; run this in a clone of the repository")
    version = version_of((folder / "frametool" / "__init__.py").read_text("utf-8"))
    check_version(version, (folder / "CHANGELOG.md").read_text("utf-8"), tag)
    recipe = folder / ".ci" / "conda" / "recipe.yaml"
    recipe.write_text(with_version(recipe.read_text("utf-8"), version), "utf-8")
    project.write_text(with_addresses(project.read_text("utf-8"), address, tag or "HEAD"), "utf-8")
    readme.write_text(with_whole_links(with_setup(readme.read_text("utf-8")), address, tag or "HEAD"), "utf-8")


def version_of(text: str) -> str:
    """Return the version that a module states."""
    found = re.search(r'(?m)^__version__ = "(.+)"$', text)
    if not found:
        raise Refused('frametool/__init__.py has no line __version__ = ".."; write one')
    return found[1]


def check_version(version: str, changelog: str, tag: str) -> None:
    """Refuse a tag that is not the version's, and a changelog whose first heading is of another, or has no date.

    tag: "" for a trial, of a version that is not dated yet
    """
    if tag and tag != f"v{version}":
        raise Refused(f"TAG {tag!r} is not the version of frametool/__init__.py, {version}; its tag is v{version}")
    heading = next((line for line in changelog.splitlines() if line.startswith("## ")), "")
    found = re.fullmatch(r"## (\S+) \((\S+)\)", heading)
    if not found or found[1] != version or not (is_date(found[2]) or (found[2] == "unreleased" and not tag)):
        raise Refused(f"CHANGELOG.md begins with {heading!r}; write ## {version} (YYYY-MM-DD), the day of the release")


def is_date(text: str) -> bool:
    """Tell a day of the calendar, written YYYY-MM-DD."""
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def with_version(recipe: str, version: str) -> str:
    """Return a recipe of conda for a version."""
    return re.sub(r'(?m)^  version: ".*"$', f'  version: "{version}"', recipe)


def with_addresses(project: str, address: str, ref: str) -> str:
    """Return a pyproject.toml with the table of addresses."""
    if "urls" in tomllib.loads(project)["project"]:
        raise Refused("pyproject.toml has [project.urls] already; remove it, the release writes it")
    rows = "".join(f'{name} = "{address}{page.format(ref)}"\n' for name, page in PAGES.items())
    return f"{project}\n[project.urls]\n{rows}"


def with_setup(readme: str) -> str:
    """Return README for those who have no clone: their set-up stands first."""
    rest, count = re.subn(r"(?s)## Set-up\n.*?\n(?=## )", "", readme)
    if count != 1:
        raise Refused(f"README.md has {count} sections '## Set-up'; write one")
    begin, heading, end = rest.partition("## ")
    return f"{begin}{(Path(__file__).parent / 'setup.md').read_text('utf-8')}\n{heading}{end}"


def with_whole_links(text: str, address: str, ref: str) -> str:
    """Return Markdown whose relative links lead to the repository: PyPI has none of its files."""

    def whole(link: re.Match[str]) -> str:
        image = link[1] or ""
        return f"{image}]({address}/{'raw' if image else 'blob'}/{ref}/{link[2].removeprefix('./')})"

    pieces = CODE.split(text)
    pieces[::2] = [RELATIVE.sub(whole, piece) for piece in pieces[::2]]
    return "".join(pieces)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except Refused as error:
        sys.exit(f"release: {error}")
