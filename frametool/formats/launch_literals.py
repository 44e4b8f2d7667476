"""Which expressions of a Python text are literal: texts, numbers, lists of them, and names bound to such once."""

from __future__ import annotations

import ast

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TypeAlias

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
        pending += [(each, scope) for each in _below(node)]
    return scopes


def _below(node: ast.AST) -> Iterable[ast.AST]:
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
