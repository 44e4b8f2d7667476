"""Launch files in Python: the text is parsed into a syntax tree and never run.

A call is read anywhere: `Node(package="tf2_ros", executable="static_transform_publisher", arguments=[..])`,
or under another name, and `ExecuteProcess(cmd=[.., "static_transform_publisher", ..])`.

Literals are strings, numbers, lists of them, `str(0.5)`, `"0 0 1".split()`, and names bound to such once in the file.
"""

from __future__ import annotations

import ast
import warnings
from collections import Counter
from typing import TYPE_CHECKING, Any

from frametool.errors import FormatError, shown
from frametool.grammar.readers import Misfit
from frametool.ros.publisher import CALL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.documents.source import Source

    Names = dict[str, ast.expr]
    Action = tuple[str, dict[str, Any], tuple[str, ...], int, int]

# arguments of a call -> the fields of XML
FIELDS = {
    "package": "pkg", "executable": "exec", "node_executable": "exec", "arguments": "args", "cmd": "cmd",
    "plugin": "plugin",
}  # fmt: skip
KINDS = {"cmd": "executable", "plugin": "composable_node", "pkg": "node"}


def actions(source: Source) -> Iterator[Action]:
    """Yield kind, fields, conditions, line and column of all calls, in the order of the text."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about unknown escapes in the user's code
            tree = ast.parse(source.text)
        yield from sorted(_calls(tree, _bound_once(tree)), key=lambda action: action[-2:])
    except SyntaxError as error:
        line, column = error.lineno or 1, error.offset or 1
        raise FormatError(f"not Python 3: {error.msg}", source=source.name, line=line, column=column) from None
    except (ValueError, MemoryError, RecursionError) as error:
        raise FormatError(f"not Python 3: {error or 'nested too deeply'}", source=source.name) from None


def _bound_once(tree: ast.Module) -> Names:
    """Return the values of the names that are assigned once in the file, and not changed or bound in another way."""
    values: Names = {}
    bound: Counter[str] = Counter()
    for node in ast.walk(tree):
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                values[name] = value
            case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
                values[name] = value
            case ast.Name(id=name, ctx=ast.Store() | ast.Del()) | ast.arg(arg=name):
                bound[name] += 1
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                bound.update(names * 2)
            case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store() | ast.Del()):
                bound[name] += 2
            case ast.Call(func=ast.Attribute(value=ast.Name(id=name), attr=method)) if method != "split":
                bound[name] += 2  # may be changed, as by append
            case _ if name := str(getattr(node, "asname", None) or getattr(node, "name", None) or ""):  # def, ..
                bound[name.partition(".")[0]] += 2
    return {name: value for name, value in values.items() if bound[name] == 1}


def _calls(tree: ast.Module, names: Names) -> Iterator[Action]:
    """Yield the actions, each with the conditions around it."""
    pending: list[tuple[ast.AST, tuple[str, ...]]] = [(tree, ())]
    while pending:
        node, conditions = pending.pop()
        if isinstance(node, ast.Call):
            conditions += tuple(_written(each.value) for each in node.keywords if each.arg == "condition")
            fields = {FIELDS[each.arg]: _value(each.value, names) for each in node.keywords if each.arg in FIELDS}
            kind = next((kind for field, kind in KINDS.items() if field in fields), "")
            if getattr(node.func, "attr", getattr(node.func, "id", "")) == "IncludeLaunchDescription":
                named = [*node.args, *(each.value for each in node.keywords), node.func]
                kind, fields["file"] = "include", _written(named[0])
            if kind and (kind != "executable" or CALL in _written(node)):
                yield kind, fields, conditions, node.lineno, node.col_offset + 1
        for name, held in ast.iter_fields(node):
            under = conditions
            if isinstance(node, ast.If | ast.IfExp) and name != "test":
                test = _written(node.test)
                under += (f"if {test}" if name == "body" else f"if not ({test})",)
            children = held if isinstance(held, list) else [held]
            pending += [(each, under) for each in children if isinstance(each, ast.AST)]


def _value(node: ast.expr, names: Names) -> Any:
    """Return the literal value of an argument; else a Misfit with the smallest expression that is not literal."""
    try:
        return _literal(node, names)
    except Misfit as misfit:
        return misfit


def _literal(node: ast.expr, names: Names) -> Any:
    match node:
        case ast.Constant(value=str() | int() | float() as constant) if not isinstance(constant, bool):
            return constant
        case ast.Name(id=name) if name in names:
            inner = {other: value for other, value in names.items() if other != name}  # a name in its own value
            return _literal(names[name], inner)
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return [_scalar(each, names) for each in items]
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
            return -number
        case ast.Call(func=ast.Name(id="str"), args=[argument], keywords=[]):
            return str(_scalar(argument, names))
        case ast.Call(func=ast.Attribute(attr="split", value=text), args=[] | [ast.Constant(value=" ")], keywords=[]):
            return str(_scalar(text, names)).split()
    raise Misfit(f"{shown(_written(node))} is not a literal")


def _scalar(node: ast.expr, names: Names) -> str | float:
    """Return a literal that is no list; raises Misfit."""
    value: str | float | list[str | float] = _literal(node, names)
    if isinstance(value, list):
        raise Misfit(f"{shown(_written(node))} is not a literal")
    return value


def _written(node: ast.expr) -> str:
    """Return an expression as Python writes it, on one line."""
    return " ".join(ast.unparse(node).split())
