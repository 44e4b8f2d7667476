"""`check --each`: every file on its own, those of something else among them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

TREE = "frames: {base: {lidar: {xyz: [1, 2, 3]}}}\n"
OTHER_PLACE = "frames: {base: {lidar: {xyz: [3, 2, 1]}}}\n"
OTHERS = {
    "package.json": '{"name": "site", "version": "1.0"}\n',
    "test.yml": "on: push\njobs: {test: {runs-on: any}}\n",
    "compose.yaml": "services: [{name: web}]\n",
    "list.json": "[1, 2]\n",
    "values.yaml": "{{ value }}: 3\n",
    "half.yaml": "a: [1,\n",
    "nothing.yaml": "",
    "package.xml": "<package><name>arm</name></package>\n",
    "arm.urdf.xacro": '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="a"/></robot>\n',
}


def test_two_trees_of_the_same_names_are_no_trouble(run: Callable[..., Any]) -> None:
    files = {"a.yaml": TREE, "b.yaml": OTHER_PLACE}
    assert run("check", "--each", "a.yaml", "b.yaml", files=files) == (0, "", "")
    assert run("check", "a.yaml", "b.yaml", files=files).status == 1


def test_what_is_wrong_in_one_is_said_with_its_name(run: Callable[..., Any]) -> None:
    files = {"a.yaml": TREE, "b.yaml": TREE.replace("1, 2, 3", "1, 2"), "c.yaml": "- {name: a, parent: b, xyz: [1, 2, 3]}\n- {name: c, parent: b, xyz: 1}\n"}
    done = run("check", "--each", *files, files=files)
    assert (done.status, done.err) == (1, "frametool: 2 errors\n")
    assert [line.partition(" error: ")[0] for line in done.out.splitlines()] == ["b.yaml:1:30:", "c.yaml:2:29:"]


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_of_something_else_is_a_warning(name: str, run: Callable[..., Any]) -> None:
    done = run("check", "--each", name, files=OTHERS)
    assert (done.status, done.err) == (0, "frametool: 1 warning\n")
    assert done.out.startswith(f"{name}:1:1: warning: ")
    assert done.out.endswith(" [no-frames]\n")
    assert run("check", "--each", "--strict", name, files=OTHERS).status == 1


def test_one_file_that_is_not_there_ends_it(run: Callable[..., Any]) -> None:
    assert run("check", "--each", "a.yaml", "none.yaml", files={"a.yaml": TREE}) == (5, "", "frametool: none.yaml: no such file or directory\n")


def test_measurements_are_of_one_tree(run: Callable[..., Any]) -> None:
    done = run("check", "--each", "a.yaml", "--measured", "a.yaml", files={"a.yaml": TREE})
    assert done == (2, "", "frametool: check: --measured and --each exclude each other; `frametool check --help` shows the options\n")


def test_a_tree_on_the_command_line_is_checked(run: Callable[..., Any]) -> None:
    assert run("check", "{frames: {a: {b: {xyz: [1, 2, 3]}}}}") == (0, "", "")
    assert run("check", "{frames: {a: {b: {rpy: [0, 0, 90]}}}}", "--strict").status == 1
