"""The transforms that launch files publish: calls of static_transform_publisher, of ROS 1 and ROS 2.

    <node pkg="tf" type="static_transform_publisher" name="a" args="0.1 0 0.2 1.57 0 0 base cam 100"/>
    <node pkg="tf2_ros" exec="static_transform_publisher" args="--x 1 --frame-id base --child-frame-id cam"/>

XML of either ROS, YAML below `launch:`, and Python with `generate_launch_description`, which is parsed and never run:

    Node(package="tf2_ros", executable="static_transform_publisher", arguments=["0.1", "0", ..])
    ExecuteProcess(cmd=["ros2", "run", "tf2_ros", "static_transform_publisher", ..])

anywhere and under another name; `arguments` may be `"..".split()`.  The pose of the child in its parent, metres,
radians; the arguments are those of `frametool.ros.publisher`.  Only literal values are read, and in XML `$(arg x)` or
`$(var x)` whose one value, its default, is in the file: a call with `$(env X)`, `LaunchConfiguration("x")`, names or
arithmetic is listed as not read, included files are named, and calls that start under a condition are read and listed.
"""

from __future__ import annotations

import ast
import re
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import format_error, locate_many, parse_documents
from frametool.documents.xml import Element, read_xml
from frametool.errors import FormatError, ValueInvalid, shown
from frametool.formats.detect import Beginning
from frametool.grammar.readers import Misfit, Path, kind
from frametool.grammar.result import Style, refuse_motion
from frametool.ros import publisher

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.documents.source import InputFile, Source
    from frametool.frames.lookups import Frames
    from frametool.grammar.edges import Edge, Options

_PYTHON = re.compile(r"(?m)^ *(?:def |import |from \w[\w.]* import )")
_SUBSTITUTION, _ARGUMENT = re.compile(r"\$\([^()]*\)?"), re.compile(r"\$\((?:arg|var)\s+([^\s()]+)\s*\)")
_NO, _YES = ("0", "false"), ("1", "true")
# argument of a call in Python -> field as in XML; field -> kind of action
FIELDS = {
    "package": "pkg", "executable": "exec", "node_executable": "exec", "arguments": "args", "cmd": "cmd",
    "plugin": "plugin",
}  # fmt: skip
KINDS = {"cmd": "executable", "plugin": "composable_node", "pkg": "node"}


class Action(NamedTuple):
    """One action of a launch file in any language: node, executable, composable_node, include or another kind.

    fields: named as in XML; a Misfit for a value that is not literal
    conditions: under which it starts, as written
    """

    kind: str
    fields: Mapping[str, Any]
    conditions: Sequence[str]
    line: int = 0
    column: int = 0


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edge of each call, and record what could not be read."""
    begin = Beginning(file.head())
    of_text = _of_python if file.path.endswith(".py") or _PYTHON.search(begin.text) else _of_yaml
    actions: Iterable[Action] = _of_xml(file, options) if begin.xml else of_text(file.source)
    for action in filter(_is_reported, actions):
        try:
            arguments, conditions = _call(action)
        except Misfit as reason:
            options.tally.note_each(str(reason), action.line)
            continue
        if edge := publisher.read_edge(arguments, file, options, action.line, action.column):
            if conditions:
                message = f"frame {shown(edge.child)} is published under a condition: {' and '.join(conditions)}"
                options.tally.note_each(message, action.line)
            yield edge


def _key(action: Action) -> str:
    """Return the name of the field with the arguments of a call."""
    return "cmd" if action.kind == "executable" else "args"


def _is_reported(action: Action) -> bool:
    """Return True for a call of static_transform_publisher, which is read or reported, and for an included file."""
    fields = action.fields
    if action.kind == "executable":
        command = fields.get("cmd")
        words = command if isinstance(command, list) else str(command).split()
        return isinstance(command, Misfit) or any(str(word).rsplit("/", 1)[-1] == publisher.CALL for word in words)
    is_call = fields.get("pkg") in ("tf", "tf2_ros") and fields.get("exec", fields.get("type")) == publisher.CALL
    is_component = fields.get("plugin") == "tf2_ros::StaticTransformBroadcasterNode"
    return {"include": True, "node": is_call, "composable_node": is_component}.get(action.kind, False)


def _call(action: Action) -> tuple[str | Sequence[str], list[str]]:
    """Return the arguments of a call, as one text for a shell or as words, and its conditions that are not constant.

    Raises Misfit, also for a condition that is never met.
    """
    if action.kind == "include":
        raise Misfit(f"include {shown(action.fields.get('file', ''))} is not followed; read that file too: --with FILE")
    key = _key(action)
    arguments = action.fields.get(key)
    problem = ""
    if action.kind == "composable_node":
        problem = "it is a composable node, whose transform is in its parameters"
    elif isinstance(arguments, Misfit):
        problem = str(arguments)
    elif not isinstance(arguments, str | list):
        problem = f"its {key} must be text, found {kind(arguments)}"
    elif isinstance(arguments, str) and (substitution := _SUBSTITUTION.search(arguments)):
        problem = f"its arguments have {shown(substitution[0])}"
    if problem:
        raise Misfit(f"{publisher.CALL} not read: {problem}")
    found = []
    for condition in dict.fromkeys(action.conditions):
        word, _, value = condition[:-1].lower().partition('="')
        if word in ("if", "unless") and value in (_NO if word == "if" else _YES):
            raise Misfit(f"{publisher.CALL} not read: it never starts ({condition})")
        if value not in (*_NO, *_YES):
            found.append(condition)
    return arguments if isinstance(arguments, str) else [str(word) for word in arguments or ()], found


def _of_xml(file: InputFile, options: Options) -> Iterator[Action]:
    """Yield the actions of XML, each under the conditions of the groups around it, with the defaults of arguments."""
    pending: list[tuple[Element, list[str]]] = [(read_xml(file, "launch"), [])]
    values: dict[str, str | None] = {}  # of arguments and variables; None: not the same everywhere
    while pending:
        element, groups = pending.pop()
        written = element.attributes
        conditions = groups + _conditions(written)
        fields = {key: _ARGUMENT.sub(lambda at: values.get(at[1]) or at[0], text) for key, text in written.items()}
        if element.tag in ("arg", "let"):
            name = fields.get("name", "")
            values[name] = None if name in values or conditions else fields.get("default", fields.get("value"))
        action = Action(element.tag, fields, conditions)
        if _is_reported(action):
            line, column = element.place(key := _key(action))
            own = ", ".join(f"{name} {values.get(name)}" for name in _ARGUMENT.findall(written.get(key, "")))
            if own and "$(" not in fields[key]:
                options.tally.note_each(f"{publisher.CALL} read with the file's own arguments: {own}", line)
            yield action._replace(line=line, column=column)
        inner = conditions if element.tag == "group" else groups
        pending += [(child, inner) for child in reversed(element.children) if element.tag != "include"]


def _of_yaml(source: Source) -> Iterator[Action]:
    """Yield the actions below `launch:`."""
    found: dict[Path, Action] = {}
    for document in parse_documents(source.text, source.name):
        top = (document.index, "launch")
        try:
            if type(document.value) is not dict or "launch" not in document.value:
                raise Misfit(f"expected launch: and a list of actions, found {kind(document.value)}", top)
            for path, action in _entries(document.value["launch"] or [], top, []):
                if _is_reported(action):
                    found[*path, _key(action)] = action
        except Misfit as misfit:
            raise format_error(source, misfit.path, str(misfit)) from None
    for action, (line, column) in zip(found.values(), locate_many(source.text, [*found]), strict=True):
        yield action._replace(line=line, column=column)


def _entries(entries: Any, path: Path, conditions: list[str]) -> Iterator[tuple[Path, Action]]:
    """Yield the actions of a list and of the groups in it, with their paths."""
    if type(entries) is not list:
        raise Misfit(f"expected a list of actions, found {kind(entries)}", path)
    for index, entry in enumerate(entries):
        if type(entry) is not dict:
            raise Misfit(f"expected an action as - node: .., found {kind(entry)}", (*path, index))
        for tag, inner in entry.items():
            here = (*path, index, tag)
            fields = inner if type(inner) is dict else {}
            under = conditions + _conditions(fields)
            if tag == "group":
                children, where = (fields.get("children"), (*here, "children")) if fields else (inner, here)
                yield from _entries(children or [], where, under)
            elif tag == "node_container":
                nodes = [{"composable_node": node} for node in fields.get("composable_node") or ()]
                yield from _entries(nodes, (*here, "composable_node"), under)
            else:
                yield here, Action(tag, fields, under)


def _of_python(source: Source) -> list[Action]:
    """Return the launch actions in Python code, each with the conditions around it, in the order of the text."""
    found = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about unknown escapes in the user's code
            pending: list[tuple[ast.AST, tuple[str, ...]]] = [(ast.parse(source.text), ())]
        while pending:
            node, conditions = pending.pop()
            if isinstance(node, ast.Call):
                conditions += tuple(_written(each.value) for each in node.keywords if each.arg == "condition")
                fields = {FIELDS[each.arg]: _literal(each.value) for each in node.keywords if each.arg in FIELDS}
                tag = next((tag for field, tag in KINDS.items() if field in fields), "")
                if getattr(node.func, "attr", getattr(node.func, "id", "")) == "IncludeLaunchDescription":
                    named = [*node.args, *(each.value for each in node.keywords), node.func]
                    tag, fields["file"] = "include", _written(named[0])
                if tag and (tag != "executable" or publisher.CALL in _written(node)):
                    found.append(Action(tag, fields, conditions, node.lineno, node.col_offset + 1))
            for name, held in ast.iter_fields(node):
                under = conditions
                if isinstance(node, ast.If | ast.IfExp) and name != "test":
                    test = _written(node.test)
                    under += (f"if {test}" if name == "body" else f"if not ({test})",)
                children = held if isinstance(held, list) else [held]
                pending += [(each, under) for each in children if isinstance(each, ast.AST)]
    except SyntaxError as error:
        line, column = error.lineno or 1, error.offset or 1
        raise FormatError(f"not Python 3: {error.msg}", source=source.name, line=line, column=column) from None
    except (ValueError, MemoryError, RecursionError) as error:
        raise FormatError(f"not Python 3: {error or 'nested too deeply'}", source=source.name) from None
    return sorted(found, key=lambda action: (action.line, action.column))


def _literal(node: ast.expr) -> Any:
    """Return the literal value of an argument; for other expressions a Misfit that quotes them."""
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            found = [_literal(each) for each in items]
            return next((each for each in found if isinstance(each, Misfit)), found)
        case ast.Call(func=ast.Attribute(attr="split", value=ast.Constant(value=str() as text)), args=[], keywords=[]):
            return text.split()
    try:
        return ast.literal_eval(node)
    except (TypeError, ValueError):
        return Misfit(f"{shown(_written(node))} is not a literal")


def _written(node: ast.expr) -> str:
    """Return an expression as Python code on one line."""
    return " ".join(ast.unparse(node).split())


def _conditions(fields: Mapping[str, Any]) -> list[str]:
    """Return the fields `if` and `unless` as text, `if="..."`."""
    return [f'{key}="{fields[key]}"' for key in ("if", "unless") if type(fields.get(key)) is str]


def write_tree(tree: Frames, style: Style) -> str:
    """Return XML of ROS 2: one node per edge.

    Raises ValueInvalid for moving frames, and names that cannot be written.
    """
    from html import escape

    refuse_motion(tree, "a launch file")
    lines = publisher.write_tree(tree, style.changed(format="static2")).splitlines()
    if unsafe := next((line for line in lines if "$(" in line), None):
        names = unsafe[unsafe.index("--frame-id") :]
        raise ValueInvalid(f"a frame name with $( cannot be written in a launch file: {shown(names)}")
    node = f'  <node pkg="tf2_ros" exec="{publisher.CALL}" args="{{}}"/>\n'
    return f"<launch>\n{''.join(node.format(escape(line)) for line in lines)}</launch>\n"
