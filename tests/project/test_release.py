"""What is published: the sources of a release, and what wheel and sdist hold."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from make_calculator import own_files

from frametool import __version__

ROOT = Path(__file__).resolve().parents[2]
ADDRESS = "https://example.org/frametool"
CHANGES = "# Changelog\n\n## {}\n\n- All new.\n\n## 0.1.0 (2025-01-01)\n"


def _script() -> Any:
    spec = spec_from_file_location("release", ROOT / ".ci" / "release.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


release = _script()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[the cookbook](examples/COOKBOOK.md)", "[the cookbook](https://example.org/frametool/blob/v1/examples/COOKBOOK.md)"),
        ("[`here`](./CHANGELOG.md#top), [there](LICENSE)", "[`here`](https://example.org/frametool/blob/v1/CHANGELOG.md#top), [there](https://example.org/frametool/blob/v1/LICENSE)"),
        ("![a robot](examples/robot.svg)", "![a robot](https://example.org/frametool/raw/v1/examples/robot.svg)"),
        ("[a](https://example.org) [b](#files) [c](mailto:a@example.org)", "[a](https://example.org) [b](#files) [c](mailto:a@example.org)"),
        ("`[x](y)` and\n```python\nfunctions[0](name)\n```\n", "`[x](y)` and\n```python\nfunctions[0](name)\n```\n"),
    ],
)
def test_relative_links_lead_to_the_repository(text: str, expected: str) -> None:
    assert release.with_whole_links(text, ADDRESS, "v1") == expected


def test_the_set_up_of_the_description_is_that_without_a_clone() -> None:
    text = release.with_setup((ROOT / "README.md").read_text())
    assert re.findall(r"(?m)^## (.*)", text)[:2] == ["Set-up", "Ten questions"]
    assert [line in text for line in ("uvx frametool", "pipx install frametool", "pip install 'frametool[bag]'", "pip install -q .")] == [True, True, True, False]
    assert release.with_setup("# a\n\n## Set-up\n\nold\n\n## B\n").startswith("# a\n\n## Set-up\n\n```sh\nuvx")
    with pytest.raises(release.Refused, match=r"README\.md has 0 sections '## Set-up'; write one"):
        release.with_setup("# a\n")


def test_the_recipe_gets_the_version() -> None:
    assert release.with_version('context:\n  version: "0.1.0"\n\nother: ""\n', "1.2.0") == 'context:\n  version: "1.2.0"\n\nother: ""\n'


def test_no_relative_link_is_left_in_the_readme() -> None:
    text = release.with_whole_links((ROOT / "README.md").read_text(), ADDRESS, "HEAD")
    assert {link.partition("://")[0] for link in re.findall(r"\]\(([^)]+)\)", text)} == {"https"}


def test_the_project_gets_its_addresses() -> None:
    text = release.with_addresses('[project]\nname = "frametool"\n\n[tool.other]\nx = 1\n', ADDRESS, "v1")
    assert tomllib.loads(text) == {
        "project": {
            "name": "frametool",
            "urls": {
                "Homepage": "https://example.org/frametool",
                "Documentation": "https://example.org/frametool/blob/v1/README.md",
                "Changelog": "https://example.org/frametool/blob/v1/CHANGELOG.md",
                "Issues": "https://example.org/frametool/issues",
            },
        },
        "tool": {"other": {"x": 1}},
    }


def test_addresses_that_are_there_are_not_written_twice() -> None:
    with pytest.raises(release.Refused, match=r"has \[project.urls\] already"):
        release.with_addresses("[project.urls]\n", ADDRESS, "v1")


@pytest.mark.parametrize(("heading", "tag"), [("1.2.0 (2026-02-28)", "v1.2.0"), ("1.2.0 (2026-02-28)", ""), ("1.2.0 (unreleased)", "")])
def test_a_dated_version_is_released_and_another_only_tried(heading: str, tag: str) -> None:
    release.check_version("1.2.0", CHANGES.format(heading), tag)


@pytest.mark.parametrize(
    ("heading", "tag", "message"),
    [
        ("1.2.0 (2026-02-28)", "1.2.0", "TAG '1.2.0' is not the version of frametool/__init__.py, 1.2.0; its tag is v1.2.0"),
        ("1.2.0 (2026-02-28)", "v1.3.0", "TAG 'v1.3.0' is not the version of frametool/__init__.py, 1.2.0; its tag is v1.2.0"),
        ("1.2.0 (unreleased)", "v1.2.0", "CHANGELOG.md begins with '## 1.2.0 (unreleased)'; write ## 1.2.0 (YYYY-MM-DD), the day of the release"),
        ("1.2.0 (2026-02-30)", "v1.2.0", "CHANGELOG.md begins with '## 1.2.0 (2026-02-30)'; write ## 1.2.0 (YYYY-MM-DD), the day of the release"),
        ("1.1.0 (2026-02-28)", "", "CHANGELOG.md begins with '## 1.1.0 (2026-02-28)'; write ## 1.2.0 (YYYY-MM-DD), the day of the release"),
        ("1.2.0", "", "CHANGELOG.md begins with '## 1.2.0'; write ## 1.2.0 (YYYY-MM-DD), the day of the release"),
    ],
)
def test_what_does_not_fit_together_is_refused(heading: str, tag: str, message: str) -> None:
    with pytest.raises(release.Refused) as refused:
        release.check_version("1.2.0", CHANGES.format(heading), tag)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "usage: .ci/release https://HOST/OWNER/NAME [vVERSION] [--no-tests]"),
        (["example.org/frametool"], "ADDRESS 'example.org/frametool' is not that of a repository; usage: .ci/release https://HOST/OWNER/NAME [vVERSION] [--no-tests]"),
        ([ADDRESS], "the last commit has no pyproject.toml here; run this in a clone of the repository"),
    ],
)
def test_a_wrong_call_is_one_line(words: list[str], message: str, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, ROOT / ".ci" / "release.py", tmp_path, *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"release: {message}\n")


def built(sources: Path, target: Path) -> tuple[Path, Path]:
    """Build an sdist and a wheel as the release does, and return them."""
    pytest.importorskip("hatchling")
    environment = os.environ | {"SOURCE_DATE_EPOCH": "1767225600"}
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", target], cwd=sources, env=environment, check=True, capture_output=True)
    (sdist,), (wheel,) = target.glob("*.tar.gz"), target.glob("*.whl")
    return sdist, wheel


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Build from these sources."""
    return built(ROOT, tmp_path_factory.mktemp("first"))


def test_what_is_built_of_an_sdist_is_the_same_to_the_byte(first: tuple[Path, Path], tmp_path: Path) -> None:
    with tarfile.open(first[0]) as archive:
        archive.extractall(tmp_path, filter="data")
    again = built(tmp_path / f"frametool-{__version__}", tmp_path / "again")
    assert [path.name for path in again] == [path.name for path in first]
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in first]


def test_the_sdist_has_all_that_its_tests_read(first: tuple[Path, Path]) -> None:
    with tarfile.open(first[0]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    folders = ("frametool", "tests", "examples", ".ci", ".github")
    files = {path.relative_to(ROOT).as_posix() for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()}
    own = {name for name in files if "__pycache__" not in name and not name.endswith((".pyc", "~", ".orig"))}
    assert own <= names
    assert {"LICENSE", "README.md", "CHANGELOG.md", "pyproject.toml", ".pre-commit-hooks.yaml", "PKG-INFO"} <= names


def test_the_wheel_has_the_package_and_what_shells_and_man_look_for(first: tuple[Path, Path]) -> None:
    with ZipFile(first[1]) as wheel:
        texts = {name: wheel.read(name) for name in wheel.namelist()}
    share = f"frametool-{__version__}.data/data/share"
    scripts = {f"{share}/bash-completion/completions/frametool": "bash", f"{share}/zsh/site-functions/_frametool": "zsh", f"{share}/fish/vendor_completions.d/frametool.fish": "fish"}
    assert all(texts[name] == (ROOT / "frametool" / "cli" / "completions" / shell).read_bytes() for name, shell in scripts.items())
    pages = {path.name: path.read_bytes() for path in (ROOT / "frametool" / "data" / "share" / "man" / "man1").iterdir()}
    assert {name.rpartition("/")[2]: text for name, text in texts.items() if name.startswith(f"{share}/man/man1/")} == pages
    assert {name.partition("/")[0] for name in texts} == {"frametool", f"frametool-{__version__}.data", f"frametool-{__version__}.dist-info"}
    assert dict(own_files()) == {name: text for name, text in texts.items() if name.startswith("frametool/")}  # the calculator page has them too
    assert texts["frametool/examples/robot.yaml"] == (ROOT / "examples" / "robot.yaml").read_bytes()
