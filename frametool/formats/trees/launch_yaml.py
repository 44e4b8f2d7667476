"""Launch files in YAML: a list of actions below `launch:`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import format_error, locate_many, parse_documents
from frametool.formats.trees.launch_actions import (
    COMPOSABLE,
    IN_PARAMETERS,
    PACKAGES,
    Action,
    call,
    condition,
    not_followed,
    not_read,
    runs_publisher,
)
from frametool.grammar.readers import Misfit, kind
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import Source
    from frametool.grammar.readers import Path


def actions(source: Source) -> Iterator[Action]:
    """Yield the calls and what is included, in order, with their places."""
    found: list[tuple[Path, Action]] = []
    for document in parse_documents(source.text, source.name):
        top = (document.index, "launch")
        try:
            if type(document.value) is not dict or "launch" not in document.value:
                raise Misfit(f"expected launch: and a list of actions, found {kind(document.value)}", top)
            found += _walk(document.value["launch"], top, [])
        except Misfit as misfit:
            raise format_error(source, misfit.path, str(misfit)) from None
    places = locate_many(source.text, [path for path, _ in found])
    for (_, action), (line, column) in zip(found, places, strict=True):
        yield action._replace(line=line, column=column)


def _walk(entries: Any, path: Path, conditions: list[str]) -> Iterator[tuple[Path, Action]]:
    """Walk a list of actions; groups hold further ones."""
    if entries is None:
        return
    if type(entries) is not list:
        raise Misfit(f"expected a list of actions, found {kind(entries)}", path)
    for index, entry in enumerate(entries):
        if type(entry) is not dict:
            raise Misfit(f"expected an action as - node: .., found {kind(entry)}", (*path, index))
        for key, held in entry.items():
            yield from _action(key, held, (*path, index, key), conditions)


def _action(key: str, held: Any, path: Path, conditions: list[str]) -> Iterator[tuple[Path, Action]]:
    """Read one action; those that start no publisher and hold none are passed over."""
    if key == "group" and type(held) is list:
        yield from _walk(held, path, conditions)
        return
    if type(held) is not dict:
        return
    texts = {name: value for name, value in held.items() if type(value) is str}
    under = conditions + condition(texts)
    if key == "group":
        yield from _walk(held.get("children"), (*path, "children"), under)
    elif key == "include":
        yield path, not_followed("include", texts.get("file", ""), 0)
    elif key == "node" and texts.get("pkg") in PACKAGES and texts.get("exec") == CALL:
        yield _call(held, "args", path, under)
    elif key == "node_container" and type(held.get("composable_node")) is list:
        for index, node in enumerate(held["composable_node"]):
            if type(node) is dict and node.get("plugin") == COMPOSABLE:
                yield (*path, "composable_node", index), not_read(IN_PARAMETERS, 0)
    elif key == "executable" and runs_publisher(texts.get("cmd", "").split()):
        yield _call(held, "cmd", path, under)


def _call(held: dict[str, Any], name: str, path: Path, conditions: list[str]) -> tuple[Path, Action]:
    value = held.get(name)
    if type(value) is not str:
        said = f"its {name} must be text, found {kind(value)}" if name in held else f"it has no {name}"
        return path, not_read(said, 0)
    return (*path, name), call(value, 0, 0, conditions)
