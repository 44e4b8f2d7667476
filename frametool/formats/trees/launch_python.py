"""Launch files in Python: their text is parsed into a syntax tree, nothing of it is run.

A call counts wherever it stands: `Node(package="tf2_ros", executable="static_transform_publisher", arguments=[..])`,
or any other name for it, and `ExecuteProcess(cmd=[.., "static_transform_publisher", ..])`.

Which expressions of a Python text are literal: texts, numbers, lists of them, and names bound to such once.
"""

from __future__ import annotations

import ast
import warnings

from frametool.errors import FormatError, shown
from frametool.formats.trees.launch_actions import (
    COMPOSABLE,
    IN_PARAMETERS,
    PACKAGES,
    Action,
    not_followed,
    not_read,
    runs_publisher,
)
from frametool.ros.publisher import CALL

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import TypeAlias

    from frametool.documents.source import Source

    Scalar: TypeAlias = str | int | float
    Literal: TypeAlias = Scalar | list[Scalar]

LONGEST = 10_000  # characters or words: doubling a text thirty times is a short text, too
_SCOPES = (ast.Module, ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
_CHANGING = frozenset(("append", "extend", "insert", "pop", "remove", "reverse", "sort", "clear"))


class NotLiteral(ValueError):
    """An expression whose value the text does not say; `why` is "" where the expression says it best."""

    def __init__(self, node: ast.expr, why: str = "") -> None:
        """Keep the expression."""
        super().__init__(why)
        self.node = node
        self.why = why


class Bindings:
    """The names that a module, a function or a class binds: each to an expression, or to None if more than once."""

    def __init__(self, outer: Bindings | None) -> None:
        """Create an empty scope inside another."""
        self.outer = outer
        self.bound: dict[str, ast.expr | None] = {}
        self._values: dict[str, Literal | NotLiteral] = {}

    def bind(self, name: str, value: ast.expr | None) -> None:
        """Take in one binding."""
        self.bound[name] = None if name in self.bound else value

    def find(self, node: ast.Name) -> Literal:
        """Return the literal that a name stands for; raises NotLiteral."""
        if node.id not in self.bound:
            if self.outer is None:
                raise NotLiteral(node)
            return self.outer.find(node)
        if node.id not in self._values:
            self._values[node.id] = NotLiteral(node)  # while it is worked out: a name in its own value
            self._values[node.id] = self._evaluated(node)
        value = self._values[node.id]
        if isinstance(value, NotLiteral):
            raise value
        return value

    def _evaluated(self, node: ast.Name) -> Literal | NotLiteral:
        value = self.bound[node.id]
        if value is None:
            return NotLiteral(node)
        try:
            return evaluate(value, self)
        except NotLiteral as error:
            return error


def evaluate(node: ast.expr, scope: Bindings) -> Literal:
    """Return the value of a literal expression.

    Texts, numbers with a sign, lists and tuples of them, their concatenation, `str(0.5)`, `"0 0 1".split()`, and names
    bound once to one of these. Raises NotLiteral, with the smallest expression that is none.
    """
    value: Literal | None = None
    if isinstance(node, ast.Constant) and isinstance(node.value, str | int | float):
        value = None if isinstance(node.value, bool) else node.value
    elif isinstance(node, ast.Name):
        value = scope.find(node)
    elif isinstance(node, ast.List | ast.Tuple):
        value = [word for each in node.elts for word in _items(each, scope)]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        value = _signed(node, evaluate(node.operand, scope))
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        value = _joined(evaluate(node.left, scope), evaluate(node.right, scope))
    elif isinstance(node, ast.Call) and not node.keywords:
        value = _called(node, scope)
    if value is None or (isinstance(value, str | list) and len(value) > LONGEST):
        raise NotLiteral(node)
    return value


def _items(node: ast.expr, scope: Bindings) -> list[Scalar]:
    """Return what an item of a list puts into it: itself, or the items of `*another`."""
    value = evaluate(node.value if isinstance(node, ast.Starred) else node, scope)
    if isinstance(value, list) is not isinstance(node, ast.Starred):
        raise NotLiteral(node)
    return value if isinstance(value, list) else [value]


def _signed(node: ast.UnaryOp, value: Literal) -> Literal | None:
    if isinstance(value, str | list):
        return None
    return -value if isinstance(node.op, ast.USub) else value


def _joined(left: Literal, right: Literal) -> Literal | None:
    """Concatenate two texts or two lists; a sum of numbers is arithmetic, which is not ours."""
    if isinstance(left, str) and isinstance(right, str):
        return left + right
    return left + right if isinstance(left, list) and isinstance(right, list) else None


def _called(node: ast.Call, scope: Bindings) -> Literal | None:
    """Return `str(number)` or `text.split()`."""
    function, arguments = node.func, [evaluate(each, scope) for each in node.args] if _is_known(node.func) else []
    if isinstance(function, ast.Name) and len(arguments) == 1 and not isinstance(arguments[0], list):
        return _text_of(arguments[0])
    if isinstance(function, ast.Attribute):
        text = evaluate(function.value, scope)
        if isinstance(text, str) and arguments in ([], [" "]):
            return [*text.split(" " if arguments else None)]
    return None


def _is_known(function: ast.expr) -> bool:
    return (isinstance(function, ast.Name) and function.id == "str") or (
        isinstance(function, ast.Attribute) and function.attr == "split"
    )


def _text_of(value: Scalar) -> str | None:
    try:
        return str(value)
    except ValueError:  # a whole number of more than 4300 digits
        return None


def scopes_of(tree: ast.Module) -> dict[ast.AST, Bindings]:
    """Return the scope of the module and of each function in it."""
    scopes: dict[ast.AST, Bindings] = {}
    pending: list[tuple[ast.AST, Bindings | None]] = [(tree, None)]
    while pending:
        node, scope = pending.pop()
        if isinstance(node, _SCOPES):
            if scope is not None and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                scope.bind(node.name, None)
            scope = scopes[node] = Bindings(scope)
        if scope is not None:
            _take(node, scope)
        pending += [(each, scope) for each in _below_literal(node)]
    return scopes


def _below_literal(node: ast.AST) -> Iterable[ast.AST]:
    """Return what a node holds, without the names that `_take` binds to a value."""
    return (each for each in ast.iter_child_nodes(node) if each not in _targets(node))


def _targets(node: ast.AST) -> list[ast.Name]:
    """Return the names that an assignment binds to its value."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return []
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [each for each in targets if isinstance(each, ast.Name)]


def _take(node: ast.AST, scope: Bindings) -> None:
    """Take in what one node binds or changes."""
    if isinstance(node, ast.Assign | ast.AnnAssign):
        for target in _targets(node):
            scope.bind(target.id, node.value)
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store | ast.Del):
        scope.bind(node.id, None)
    elif isinstance(node, ast.arg):
        scope.bind(node.arg, None)
    elif isinstance(node, ast.alias):
        scope.bind((node.asname or node.name).split(".")[0], None)
    elif isinstance(node, ast.ExceptHandler) and node.name:
        scope.bind(node.name, None)
    elif isinstance(node, ast.Global | ast.Nonlocal):
        for name in node.names:
            _spoil(name, scope)
    elif isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.value, ast.Name) and _changes(node):
        _spoil(node.value.id, scope)


def _changes(node: ast.Attribute | ast.Subscript) -> bool:
    """Tell whether the list that a name stands for is changed in place."""
    if isinstance(node, ast.Attribute):
        return node.attr in _CHANGING
    return isinstance(node.ctx, ast.Store | ast.Del)


def _spoil(name: str, scope: Bindings | None) -> None:
    """Mark a name, in this scope and those around, as one whose value changes."""
    while scope is not None:
        scope.bound[name] = None
        scope = scope.outer


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
