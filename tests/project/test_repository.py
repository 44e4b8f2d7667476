"""What stands beside the package says what pyproject.toml says: workflows, recipe, image, hook, templates, how to cite."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from frametool import __version__

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
README = (ROOT / "README.md").read_text()
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def read(name: str) -> Any:
    """Read a YAML file of the repository; `on` is a key of workflows and no truth value."""
    return yaml.load((ROOT / name).read_text(), yaml.BaseLoader)  # noqa: S506 - all scalars are texts


TEST, RELEASE = read(".github/workflows/test.yml"), read(".github/workflows/release.yml")


def minors(texts: list[str]) -> list[int]:
    """Return the 11 of each 3.11."""
    return sorted(int(text.removeprefix("3.")) for text in texts)


def test_each_python_that_is_classified_is_tested_from_the_lowest_on() -> None:
    pythons = minors(TEST["jobs"]["tests"]["strategy"]["matrix"]["python"])
    classified = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    assert pythons == minors(classified) == [*range(pythons[0], pythons[-1] + 1)]
    assert PROJECT["project"]["requires-python"] == f">=3.{pythons[0]}"
    assert PROJECT["tool"]["ruff"]["target-version"] == f"py3{pythons[0]}"


def test_the_tests_run_on_three_systems_and_with_the_oldest_versions() -> None:
    assert TEST["jobs"]["tests"]["strategy"]["matrix"]["os"] == ["ubuntu-latest", "macos-latest", "windows-latest"]
    last = {job: TEST["jobs"][job]["steps"][-1]["run"] for job in TEST["jobs"]}
    assert last == {"tests": "python -m pytest -n auto --dist loadfile", "oldest": ".ci/run oldest", "checks": ".ci/run"}


def test_a_tag_is_tested_built_and_only_then_published() -> None:
    jobs = RELEASE["jobs"]
    assert RELEASE["on"] == {"push": {"tags": ["v*"]}}
    assert jobs["test"] == {"uses": "./.github/workflows/test.yml"}
    assert "workflow_call" in TEST["on"]
    assert [jobs["build"]["needs"], jobs["publish"]["needs"]] == ["test", "build"]
    assert '.ci/release "$ADDRESS" "$TAG"' in [step.get("run") for step in jobs["build"]["steps"]]
    assert [step["uses"].partition("@")[0] for step in jobs["publish"]["steps"]] == ["actions/download-artifact", "pypa/gh-action-pypi-publish"]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_only_publishing_has_a_right_and_nothing_has_a_secret(path: Path) -> None:
    workflow = read(str(path))
    assert "secrets" not in path.read_text()
    assert workflow["permissions"] == {"contents": "read"}
    rights = {name: (job.get("permissions"), job.get("environment")) for name, job in workflow["jobs"].items()}
    needed = {"publish": ({"id-token": "write"}, "pypi"), "deploy": ({"id-token": "write", "pages": "write"}, "github-pages")}
    assert rights == {name: needed.get(name, (None, None)) for name in rights}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_an_action_is_pinned_by_its_hash_and_leaves_no_credentials(path: Path) -> None:
    used = re.findall(r"(?m)^ *- uses: (.*)", path.read_text())
    assert used
    assert all(re.fullmatch(r"(actions/[\w-]+|pypa/gh-action-pypi-publish)@[0-9a-f]{40} # v\d+\.\d+\.\d+", each) for each in used)
    steps = [step for job in read(str(path))["jobs"].values() for step in job.get("steps", ())]
    assert all(step["with"] == {"persist-credentials": "false"} for step in steps if step.get("uses", "").startswith("actions/checkout@"))
    assert "concurrency" in read(str(path))


def test_a_bot_moves_what_is_pinned() -> None:
    updates = read(".github/dependabot.yml")["updates"]
    assert {(each["package-ecosystem"], each["directory"]) for each in updates} == {
        ("github-actions", "/"), ("npm", "/tests/site_pages/calculator"), ("pip", "/tests/site_pages/calculator"),
    }  # fmt: skip


def test_systems_that_nobody_tried_do_not_fail_the_run() -> None:
    assert TEST["jobs"]["tests"]["continue-on-error"] == "${{ matrix.os != 'ubuntu-latest' }}"


def test_the_pages_are_made_as_the_scripts_say() -> None:
    runs = [step["run"] for step in read(".github/workflows/pages.yml")["jobs"]["build"]["steps"] if "run" in step]
    assert runs[1:] == ['python tests/make_site.py site --address "$ADDRESS" --calculator', "python -m sphinx -W -b html site site/html"]


def test_extras_are_what_users_want_and_groups_what_developers_want() -> None:
    extras = PROJECT["project"]["optional-dependencies"]
    assert [*extras] == ["bag", "arrow", "las", "test", "plot", "all", "docs", "dev"]  # README's and CI's commands name test, docs, dev
    assert extras["all"] == ["frametool[bag,arrow,las,plot]"]
    assert [*PROJECT["dependency-groups"]] == ["engines", "oracles", "browser"]


def test_the_recipe_of_conda_says_what_the_project_says() -> None:
    recipe = read(".ci/conda/recipe.yaml")
    project = PROJECT["project"]
    python = f"python {project['requires-python']}"
    spaced = [re.sub(r"(?=[<>=])", " ", each, count=1) for each in (*project["dependencies"], *PROJECT["build-system"]["requires"])]
    assert recipe["context"] == {"version": __version__}
    assert recipe["package"] == {"name": project["name"], "version": "${{ version }}"}
    assert recipe["requirements"] == {"host": [python, "pip", spaced[-1]], "run": [python, *spaced[:-1]]}
    assert recipe["build"]["python"]["entry_points"] == [f"{name} = {where}" for name, where in project["scripts"].items()]
    assert recipe["about"] == {"summary": project["description"], "license": project["license"], "license_file": project["license-files"][0]}
    assert (ROOT / ".ci" / "conda" / recipe["source"]["path"]).resolve() == ROOT


def test_the_image_is_small_and_runs_the_tool_as_a_user() -> None:
    lines = [line.partition(" ") for line in (ROOT / ".ci" / "Dockerfile").read_text().splitlines()]
    steps = {step: what for step, _, what in lines if step.isupper()}
    assert (steps["FROM"], steps["ENTRYPOINT"]) == ("python:3-slim", '["frametool"]')
    assert int(steps["USER"]) > 0
    assert "[bag,arrow]" in steps["RUN"]
    assert list(steps)[-3:] == ["USER", "WORKDIR", "ENTRYPOINT"]


def test_the_hook_checks_each_file_that_may_hold_frames() -> None:
    (hook,) = read(".pre-commit-hooks.yaml")
    assert {key: hook[key] for key in ("id", "entry", "language", "types_or")} == {
        "id": "frametool-check", "entry": "frametool check --each --quiet", "language": "python", "types_or": ["yaml", "json", "xml"],
    }  # fmt: skip
    assert f"    rev: v{__version__}\n    hooks: [{{id: {hook['id']}, " in (ROOT / "examples" / "COOKBOOK.md").read_text()


def test_a_report_of_a_fault_asks_for_file_command_and_versions() -> None:
    body = read(".github/ISSUE_TEMPLATE/bug.yml")["body"]
    assert [each["id"] for each in body if each["validations"]["required"] == "true"] == ["command", "file", "expected", "versions"]
    assert "`frametool -v --version`" in body[-1]["attributes"]["description"]


def test_who_cites_it_says_this_version() -> None:
    (cited,) = re.findall(r"```bibtex\n(.*)\n```", README)
    year = re.search(r"Copyright \(c\) (\d+) (.*)", (ROOT / "LICENSE").read_text())
    assert year is not None
    assert f"author = {{{{{year[2]}}}}}, year = {{{year[1]}}}, version = {{{__version__}}}}}" in cited
    assert PROJECT["project"]["authors"] == [{"name": year[2]}]


@pytest.mark.parametrize("path", re.findall(r"`([\w./]+\.(?:py|toml|md)|frametool/[\w/]+/)`", (ROOT / ".github" / "CONTRIBUTING.md").read_text()))
def test_what_contributors_are_sent_to_is_there(path: str) -> None:
    assert (ROOT / path).exists()


def test_what_contributors_are_told_to_look_at_is_defined() -> None:
    steps = re.findall(r"(?m)^\d+\. .*", (ROOT / ".github" / "CONTRIBUTING.md").read_text())
    named = {name.rpartition(".")[2] for step in steps for name in re.findall(r"`([A-Za-z_]+(?:\.[a-z_]+)?)`", step)}
    sources = "\n".join(path.read_text() for path in (ROOT / "frametool").rglob("*.py"))
    assert len(named) > 15
    assert [name for name in sorted(named) if not re.search(rf"\b(?:def|class) {name}\b", sources)] == []
