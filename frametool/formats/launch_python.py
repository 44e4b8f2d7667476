"""Launch files in Python: their text is parsed into a syntax tree, nothing of it is run.

A call counts wherever it stands: `Node(package="tf2_ros", executable="static_transform_publisher", arguments=[..])`,
or any other name for it, and `ExecuteProcess(cmd=[.., "static_transform_publisher", ..])`.
"""

from __future__ import annotations

import ast
import warnings
from typing import TYPE_CHECKING

from frametool.errors import FormatError, shown
from frametool.formats.launch_actions import (
    COMPOSABLE,
    IN_PARAMETERS,
    PACKAGES,
    Action,
    not_followed,
    not_read,
    runs_publisher,
)
from frametool.formats.launch_literals import Bindings, NotLiteral, evaluate, scopes_of
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import Source

_EXECUTABLE = ("executable", "node_executable")  # the second until Foxy
_NO_CALL = Action(0)


def actions(source: Source) -> Iterator[Action]:
    """Yield the calls and what is included, in the order of the text."""
    try:
        tree = _parsed(source)
        yield from sorted(_walk(tree, scopes_of(tree)), key=lambda action: (action.line, action.column))
    except RecursionError:
        raise FormatError("its expressions are nested too deeply", source=source.name) from None


def _parsed(source: Source) -> ast.Module:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of odd escapes in what is not ours
            return ast.parse(source.text)
    except SyntaxError as error:
        line, column = error.lineno or 1, error.offset or 1
        raise FormatError(f"not Python 3: {error.msg}", source=source.name, line=line, column=column) from None
    except (ValueError, MemoryError) as error:
        raise FormatError(f"not Python 3: {error or 'nested too deeply'}", source=source.name) from None


def _walk(tree: ast.Module, scopes: dict[ast.AST, Bindings]) -> Iterator[Action]:
    """Visit all calls, with the conditions around each."""
    pending: list[tuple[ast.AST, Bindings, tuple[str, ...]]] = [(tree, scopes[tree], ())]
    while pending:
        node, scope, conditions = pending.pop()
        scope = scopes.get(node, scope)
        if isinstance(node, ast.Call):
            conditions += tuple(_written(each.value) for each in node.keywords if each.arg == "condition")
            if (action := _action(node, scope, conditions)) is not _NO_CALL:
                yield action
        pending += [(each, scope, conditions + under) for each, under in _below(node)]


def _below(node: ast.AST) -> Iterator[tuple[ast.AST, tuple[str, ...]]]:
    """Yield what a node holds, each with the condition that an `if` puts on it, as it is written."""
    for name, held in ast.iter_fields(node):
        under: tuple[str, ...] = ()
        if isinstance(node, ast.If | ast.IfExp) and name != "test":
            test = _written(node.test)
            under = (f"if {test}" if name == "body" else f"if not ({test})",)
        for each in held if isinstance(held, list) else [held]:
            if isinstance(each, ast.AST):
                yield each, under


def _action(node: ast.Call, scope: Bindings, conditions: tuple[str, ...]) -> Action:
    """Make of one call what there is to read or to tell of it."""
    given = {each.arg: each.value for each in node.keywords if each.arg}
    if _name_of(node.func) == "IncludeLaunchDescription":
        named = node.args[0] if node.args else given.get("launch_description_source", node.func)
        return not_followed("IncludeLaunchDescription", _written(named), node.lineno)
    if _text(given.get("plugin"), scope) == COMPOSABLE:
        return not_read(IN_PARAMETERS, node.lineno, node.col_offset + 1)
    name = "cmd" if "cmd" in given else "arguments"
    if not (_is_command(given["cmd"], scope) if name == "cmd" else _is_publisher(given, scope)):
        return _NO_CALL
    column = node.col_offset + 1
    if name not in given:
        return not_read(f"it has no {name}", node.lineno, column)
    try:
        value = evaluate(given[name], scope)
        if not isinstance(value, list):
            raise NotLiteral(given[name], f"{name} is no list")
        return Action(node.lineno, column, [str(word) for word in value], conditions=conditions)
    except NotLiteral as error:
        return not_read(error.why or f"{shown(_written(error.node))} is not a literal", node.lineno, column)


def _is_publisher(given: dict[str, ast.expr], scope: Bindings) -> bool:
    """Tell whether the keywords of a call start the publisher."""
    package = _text(given.get("package"), scope)
    return package in PACKAGES and CALL in (_text(given.get(name), scope) for name in _EXECUTABLE)


def _is_command(value: ast.expr, scope: Bindings) -> bool:
    """Tell whether a command line starts the publisher, also if other words of it are not literal."""
    parts = value.elts if isinstance(value, ast.List | ast.Tuple) else ()
    return runs_publisher([_text(part, scope) for part in parts])


def _text(value: ast.expr | None, scope: Bindings) -> str:
    """Return a literal text; "" for anything else."""
    try:
        found = evaluate(value, scope) if value is not None else ""
    except NotLiteral:
        return ""
    return found if isinstance(found, str) else ""


def _name_of(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def _written(node: ast.expr) -> str:
    """Return an expression as Python writes it, on one line."""
    return " ".join(ast.unparse(node).split())
