"""The house: which folder may import which, what stays unloaded, what the package gives out."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import frametool

ROOT = Path(frametool.__file__).parent
LAYERS = [
    "errors", "geometry", "frames", "text", "documents", "grammar", "ros", "formats", "lint", "stream", "explain", "calc",
    "sim", "view", "cli",
]  # fmt: skip
HOMES = {"click": "cli", "rich": "view", "yaml": "documents"}
MODULES = sorted(path for path in ROOT.rglob("*.py") if path.parent != ROOT or path.stem == "errors")
TREE = "{name: camera, parent: base, xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}"


def imports(path: Path) -> set[str]:
    """Name the modules that a file imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def layer(path: Path) -> str:
    """Name the folder of a module below the package."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(ROOT)) for path in MODULES])
def test_a_module_imports_only_from_layers_before_its_own(path: Path) -> None:
    allowed = LAYERS[: LAYERS.index(layer(path)) + 1]
    used = {name.split(".")[1] for name in imports(path) if name.startswith("frametool.")} - {"__version__"}
    assert used <= set(allowed)


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(ROOT)) for path in MODULES])
def test_click_rich_and_yaml_stay_in_their_rooms(path: Path) -> None:
    used = {name.split(".")[0] for name in imports(path)}
    assert {HOMES[name] for name in used & set(HOMES)} <= {layer(path)}


def loaded_by(*arguments: str, stdin: str = "") -> set[str]:
    """Name the top-level modules that a command loads in a fresh interpreter."""
    code = (
        f"import sys; from frametool.cli import run; status = run({list(arguments)!r}); "
        "print(status, *{name.split('.')[0] for name in sys.modules}, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], input=stdin, capture_output=True, text=True, check=True, cwd=ROOT.parent
    )
    status, *names = done.stderr.splitlines()[-1].split()
    assert status == "0", done.stderr
    return set(names)


@pytest.mark.parametrize(
    ("arguments", "stdin", "unloaded"),
    [
        (["--help"], "", {"numpy", "rich", "yaml", "json", "dataclasses", "decimal"}),
        (["--version"], "", {"numpy", "rich", "yaml", "json", "dataclasses", "decimal"}),
        (["convert", "--from", "rpy_deg", "0", "0", "90", "--to", "matrix"], "", {"numpy", "rich", "yaml"}),
        (["compose", '{"xyz": [1, 2, 3]}', '{"rpy_deg": [0, 0, 90]}'], "", {"numpy", "rich", "yaml"}),
        (["invert", TREE], "", {"numpy", "rich"}),
        (["relative", TREE, TREE], "", {"numpy", "rich"}),
        (["interpolate", TREE, TREE, "0.5"], "", {"numpy", "rich"}),
        (["lookup", "-", "base", "camera"], TREE, {"numpy", "rich"}),
        (["lookup", "-", "base", "camera", "--format", "text"], TREE, {"numpy", "rich"}),
        (["apply", "-", "base", "camera", "1", "2", "3"], TREE, {"numpy", "rich"}),
        (["tree", "-"], TREE, {"numpy", "rich"}),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_command_on_single_items_loads_nothing_heavy(arguments: list[str], stdin: str, unloaded: set[str]) -> None:
    assert loaded_by(*arguments, stdin=stdin) & unloaded == set()


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, frametool; frametool.__version__; print(*sys.modules)"
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"click", "rich", "yaml", "numpy"} & set(names)


@pytest.mark.parametrize("name", frametool.__all__)
def test_every_public_name_is_there_and_says_what_it_is_for(name: str) -> None:
    value = getattr(frametool, name)
    if name.isupper():  # a plain dict says nothing of itself
        assert f"`{name}` is" in str(frametool.__doc__)
    else:
        assert name == "__version__" or value.__doc__.strip().splitlines()[0].endswith((".", ";", ":"))


def test_an_unknown_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nope'"):
        _ = frametool.nope
