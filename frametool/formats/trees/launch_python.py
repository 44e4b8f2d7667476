"""Launch files in Python: the text is parsed into a syntax tree and never run.

A call is read anywhere: `Node(package="tf2_ros", executable="static_transform_publisher", arguments=[..])`,
or under another name, and `ExecuteProcess(cmd=[.., "static_transform_publisher", ..])`.

Literals are strings, numbers, lists of them, and names bound to such once.
"""

from __future__ import annotations

import ast
import warnings

from frametool.errors import FormatError, shown
from frametool.formats.trees.launch_actions import COMPOSABLE, COMPOSED, PACKAGES, Action, runs_publisher
from frametool.ros.publisher import CALL

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import TypeAlias

    from frametool.documents.source import Source

    Scalar: TypeAlias = str | int | float
    Literal: TypeAlias = Scalar | list[Scalar]

LONGEST = 10_000  # characters or words: doubling a text thirty times is a short program
_SCOPES = (ast.Module, ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
_CHANGING = frozenset(("append", "extend", "insert", "pop", "remove", "reverse", "sort", "clear"))
_EXECUTABLE = ("executable", "node_executable")  # the second until Foxy


class NotLiteral(ValueError):
    """An expression whose value is not literal."""

    def __init__(self, node: ast.expr) -> None:
        """Store the expression."""
        super().__init__()
        self.node = node


class Bindings:
    """The names bound in a module, a function or a class: each to an expression, or to None if more than once."""

    def __init__(self, outer: Bindings | None) -> None:
        """Create an empty scope inside another."""
        self.outer = outer
        self.bound: dict[str, ast.expr | None] = {}
        self._values: dict[str, Literal | NotLiteral] = {}

    def bind(self, name: str, value: ast.expr | None = None) -> None:
        """Add one binding."""
        self.bound[name] = None if name in self.bound else value

    def spoil(self, name: str) -> None:
        """Mark a name, in this scope and the enclosing ones, as one whose value changes."""
        scope: Bindings | None = self
        while scope is not None:
            scope.bound[name] = None
            scope = scope.outer

    def find(self, node: ast.Name) -> Literal:
        """Return the literal that a name is bound to; raises NotLiteral."""
        if node.id not in self.bound and self.outer is not None:
            return self.outer.find(node)
        if node.id not in self._values:
            self._values[node.id] = NotLiteral(node)  # during the evaluation: a name in its own value
            if (value := self.bound.get(node.id)) is not None:
                try:
                    self._values[node.id] = evaluate(value, self)
                except NotLiteral as error:
                    self._values[node.id] = error
        found = self._values[node.id]
        if isinstance(found, NotLiteral):
            raise found
        return found


def evaluate(node: ast.expr, scope: Bindings) -> Literal:
    """Return the value of a literal expression.

    Strings, numbers with a sign, lists and tuples of them, their concatenation, `str(0.5)`, `"0 0 1".split()`, and
    names bound once to one of these. Raises NotLiteral, with the smallest expression that is not one.
    """
    value: Literal | None = None
    match node:
        case ast.Constant(value=str() | int() | float() as constant) if not isinstance(constant, bool):
            value = constant
        case ast.Name():
            value = scope.find(node)
        case ast.List(elts=items) | ast.Tuple(elts=items):
            value = [word for each in items for word in _items(each, scope)]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            number = evaluate(operand, scope)
            if not isinstance(number, str | list):
                value = -number if isinstance(sign, ast.USub) else number
        case ast.BinOp(op=ast.Add(), left=left, right=right):  # of strings or lists; sums are arithmetic
            match evaluate(left, scope), evaluate(right, scope):
                case str() as one, str() as other:
                    value = one + other
                case list() as first, list() as second:
                    value = first + second
        case ast.Call(func=ast.Name(id="str"), args=[argument], keywords=[]):
            value = _text_of(evaluate(argument, scope))
        case ast.Call(func=ast.Attribute(attr="split", value=text), args=arguments, keywords=[]):
            separator = [evaluate(each, scope) for each in arguments]
            words = evaluate(text, scope)
            if isinstance(words, str) and separator in ([], [" "]):
                value = [*words.split(" " if separator else None)]
    if value is None or (isinstance(value, str | list) and len(value) > LONGEST):
        raise NotLiteral(node)
    return value


def _items(node: ast.expr, scope: Bindings) -> list[Scalar]:
    """Return the values of an item of a list: itself, or the items of `*another`."""
    value = evaluate(node.value if isinstance(node, ast.Starred) else node, scope)
    if isinstance(value, list) is not isinstance(node, ast.Starred):
        raise NotLiteral(node)
    return value if isinstance(value, list) else [value]


def _text_of(value: Literal) -> str | None:
    try:
        return None if isinstance(value, list) else str(value)
    except ValueError:  # an integer of more than 4300 digits
        return None


def scopes_of(tree: ast.Module) -> dict[ast.AST, Bindings]:
    """Return the scope of the module and of each function in it."""
    top = Bindings(None)
    scopes: dict[ast.AST, Bindings] = {tree: top}
    pending: list[tuple[ast.AST, Bindings]] = [(each, top) for each in tree.body]
    while pending:
        node, scope = pending.pop()
        if isinstance(node, _SCOPES):
            if name := getattr(node, "name", ""):
                scope.bind(name)
            scope = scopes[node] = Bindings(scope)
        bound = _take(node, scope)
        pending += [(each, scope) for each in ast.iter_child_nodes(node) if each not in bound]
    return scopes


def _take(node: ast.AST, scope: Bindings) -> list[ast.Name]:
    """Record what one node binds or changes; return the names in it that are bound to a value."""
    match node:
        case ast.Assign(targets=targets):
            names = [each for each in targets if isinstance(each, ast.Name)]
            for each in names:
                scope.bind(each.id, node.value)
            return names
        case ast.AnnAssign(target=ast.Name() as target, value=ast.expr() as value):
            scope.bind(target.id, value)
            return [target]
        case ast.Name(id=name, ctx=ast.Store() | ast.Del()) | ast.arg(arg=name) | ast.ExceptHandler(name=str(name)):
            scope.bind(name)
        case ast.alias():
            scope.bind((node.asname or node.name).split(".")[0])
        case ast.Global(names=names) | ast.Nonlocal(names=names):
            for name in names:
                scope.spoil(name)
        case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store() | ast.Del()):
            scope.spoil(name)
        case ast.Attribute(value=ast.Name(id=name), attr=attribute) if attribute in _CHANGING:
            scope.spoil(name)
    return []


def actions(source: Source) -> Iterator[Action]:
    """Yield the calls and the included files, in the order of the text."""
    try:
        tree = _parsed(source)
        yield from sorted(_walk(tree, scopes_of(tree)), key=lambda action: (action.line, action.column))
    except RecursionError:
        raise FormatError("its expressions are nested too deeply", source=source.name) from None


def _parsed(source: Source) -> ast.Module:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about unknown escapes in the user's code
            return ast.parse(source.text)
    except SyntaxError as error:
        line, column = error.lineno or 1, error.offset or 1
        raise FormatError(f"not Python 3: {error.msg}", source=source.name, line=line, column=column) from None
    except (ValueError, MemoryError) as error:
        raise FormatError(f"not Python 3: {error or 'nested too deeply'}", source=source.name) from None


def _walk(tree: ast.Module, scopes: dict[ast.AST, Bindings]) -> Iterator[Action]:
    """Visit all calls, with the enclosing conditions of each."""
    pending: list[tuple[ast.AST, Bindings, tuple[str, ...]]] = [(tree, scopes[tree], ())]
    while pending:
        node, scope, conditions = pending.pop()
        scope = scopes.get(node, scope)
        if isinstance(node, ast.Call):
            conditions += tuple(_written(each.value) for each in node.keywords if each.arg == "condition")
            if action := _action(node, scope, conditions):
                yield action._replace(line=node.lineno, column=node.col_offset + 1)
        pending += [(each, scope, conditions + under) for each, under in _below(node)]


def _below(node: ast.AST) -> Iterator[tuple[ast.AST, tuple[str, ...]]]:
    """Yield the children of a node, each with the condition of an `if`, as written."""
    for name, held in ast.iter_fields(node):
        under: tuple[str, ...] = ()
        if isinstance(node, ast.If | ast.IfExp) and name != "test":
            test = _written(node.test)
            under = (f"if {test}" if name == "body" else f"if not ({test})",)
        for each in held if isinstance(held, list) else [held]:
            if isinstance(each, ast.AST):
                yield each, under


def _action(node: ast.Call, scope: Bindings, conditions: tuple[str, ...]) -> Action | None:
    """Return the action of one call; None if it starts no publisher."""
    by_name = {each.arg: each.value for each in node.keywords if each.arg}
    if getattr(node.func, "attr", getattr(node.func, "id", "")) == "IncludeLaunchDescription":
        named = node.args[0] if node.args else by_name.get("launch_description_source", node.func)
        return Action.not_followed("IncludeLaunchDescription", _written(named))
    if _text(by_name.get("plugin"), scope) == COMPOSABLE:
        return COMPOSED
    name = "cmd" if "cmd" in by_name else "arguments"
    if name == "cmd":  # other words of the command line need not be literal
        parts = getattr(by_name["cmd"], "elts", ())
        is_call = runs_publisher([_text(part, scope) for part in parts])
    else:
        is_call = _text(by_name.get("package"), scope) in PACKAGES
        is_call = is_call and CALL in (_text(by_name.get(key), scope) for key in _EXECUTABLE)
    if not is_call:
        return None
    if name not in by_name:
        return Action.not_read(f"it has no {name}")
    try:
        value = evaluate(by_name[name], scope)
    except NotLiteral as error:
        return Action.not_read(f"{shown(_written(error.node))} is not a literal")
    if not isinstance(value, list):
        return Action.not_read(f"{name} is not a list")
    return Action([str(word) for word in value], conditions=conditions)


def _text(value: ast.expr | None, scope: Bindings) -> str:
    """Return a literal text; "" for anything else."""
    try:
        found = evaluate(value, scope) if value is not None else ""
    except NotLiteral:
        return ""
    return found if isinstance(found, str) else ""


def _written(node: ast.expr) -> str:
    """Return an expression as Python writes it, on one line."""
    return " ".join(ast.unparse(node).split())
