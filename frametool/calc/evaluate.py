"""From an expression to its value: each part is understood once, in order; what depends on a row is computed later.

scope = Scope(tree=frametool.load("robot.yaml"))
evaluate("inv(map<-base_link) * (map<-tool)", scope).type      # base_link<-tool
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.calc import rules
from frametool.calc.functions import FUNCTIONS
from frametool.calc.parser import RESERVED, column_name, parse_line
from frametool.calc.rules import wanted
from frametool.calc.scope import Scope, pointed
from frametool.calc.tokens import CalcError, NoTree
from frametool.calc.values import LIST, NUMBER, PLAIN_NUMBER, POSE, UNITS, Term, Type
from frametool.errors import FrametoolError, did_you_mean, shown, warn
from frametool.geometry import floats

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.calc.parser import Branch, Line
    from frametool.calc.values import RowValues
    from frametool.frames.lookups import Frames
    from frametool.geometry.types import Components

TAKEN = frozenset(FUNCTIONS)
PI = 3.141592653589793


def evaluate(text: str, scope: Scope) -> Term:
    """Return the value of a line, bind its name if it has one, and `ans`; errors point into the line."""
    return evaluate_line(read_line(text), scope)


def read_line(text: str) -> Line:
    """Read a line; errors point into it."""
    try:
        return parse_line(text, TAKEN)
    except CalcError as error:
        raise pointed(error, text) from None


def evaluate_line(line: Line, scope: Scope) -> Term:
    """Return the value of a line that was read; otherwise as `evaluate`."""
    try:
        term = _Walk(line.text, scope).term(line.tree)
    except FrametoolError as error:
        raise pointed(error, line.text) from None
    if line.name:
        scope.names[line.name] = term.written(line.name, atomic=True)
    scope.names["ans"] = term.written("ans", atomic=True)
    return term


class _Walk:
    """Understands the parts of one expression."""

    def __init__(self, text: str, scope: Scope) -> None:
        self.text = text
        self.scope = scope

    def term(self, branch: Branch) -> Term:
        """Return the value of a part, written as it was typed; an error says where."""
        try:
            found: Term = getattr(self, f"_{branch.kind}")(branch)
        except FrametoolError as error:
            if getattr(error, "at", None) is None:
                error.at = branch.at  # type: ignore[attr-defined]
            raise
        self.scope.seen.update((found.type.target, found.type.source))
        return found.written(self.text[branch.start : branch.end], atomic=branch.is_atom)

    def _value(self, branch: Branch) -> Term:
        """Return what is one value, neither a tree nor a list."""
        term = self.term(branch)
        try:
            return wanted(term)
        except CalcError as error:
            error.at = branch.at
            raise

    def _number(self, branch: Branch) -> Term:
        text, unit = branch.value
        if unit and unit not in UNITS:
            if unit in ("pi", *self.scope.names):
                raise CalcError(f"{shown(unit)} is no unit; write {text} * {unit}")
            raise CalcError(f"unknown unit {shown(unit)}{did_you_mean(unit, UNITS) or ';'} units: {' '.join(UNITS)}")
        value = float(text)
        if value == float("inf"):
            raise CalcError(f"{shown(text)} is not finite")
        if not unit:
            return Term(PLAIN_NUMBER, (value,))
        times, below, dimension = UNITS[unit]
        if value * times == float("inf"):
            raise CalcError(f"{shown(text + unit)} is not finite")
        return Term(Type(NUMBER, unit=dimension, degrees=unit == "deg"), (value * times / below,))

    def _name(self, branch: Branch) -> Term:
        name, scope = branch.value, self.scope
        if name == "row":
            if scope.row is None:
                raise CalcError("row is known in streams only: -i FILE, or standard input")
            return Term(scope.row, None, lambda row: row.parts)
        if name == "pi":
            return Term(PLAIN_NUMBER, (PI,))
        if name in scope.names:
            return scope.names[name]
        if name == "ans":
            raise CalcError("there is no last value yet")
        if name in UNITS:
            raise CalcError(f"unknown name {shown(name)}; a unit stands close to its number: 1{name}")
        known = [*(each for each in scope.names if each != "ans"), *FUNCTIONS, *RESERVED]
        hint = did_you_mean(name, known)
        frames = [frame for _, tree in scope.trees for frame in tree.frames]
        if name in frames:
            hint = "; a frame is asked for as TARGET<-SOURCE"
        elif name in FUNCTIONS:
            raise CalcError(f"{name} is a function: {name}({FUNCTIONS[name].takes})")
        raise CalcError(f"unknown name {shown(name)}{hint}")

    def _column(self, branch: Branch) -> Term:
        if self.scope.row is None:
            raise CalcError("row is known in streams only: -i FILE, or standard input")
        name = column_name(branch.value)
        return Term(PLAIN_NUMBER, None, lambda row: (row.cells[name],))

    def _pose(self, branch: Branch) -> Term:
        return self.scope.literals.read(branch.value)

    def _list(self, branch: Branch) -> Term:
        items = tuple(map(self._value, branch.parts))
        if all(item.type.kind == NUMBER for item in items):
            return rules.list_of_numbers(items)
        kinds = {item.type.kind for item in items}
        if len(kinds) > 1:
            other = next(item for item in items if item.type.kind != items[0].type.kind)
            raise CalcError(f"a list holds values of one kind, found {items[0].type.named} and {other.type.named}")
        return Term(Type(LIST), (), items=items)

    def _call(self, branch: Branch) -> Term:
        name = branch.value
        if name not in FUNCTIONS:
            raise CalcError(f"unknown function {shown(name)}{self._near_function(name)}")
        row = FUNCTIONS[name]
        if not row.least <= len(branch.parts) <= row.most:
            count = f"{len(branch.parts)} value{'s' * (len(branch.parts) != 1)}"
            raise CalcError(f"{name}() takes {row.takes}; found {count}")
        read = self.term if name == "mean" and len(branch.parts) == 1 else self._value
        return row.rule(name, [read(part) for part in branch.parts], self.scope.trees)

    def _near_function(self, name: str) -> str:
        if name in self.scope.names:
            return f"; {name} is a value, poses are joined by *"
        return did_you_mean(name, FUNCTIONS) or f"; functions: {' '.join(FUNCTIONS)}"

    def _chain(self, branch: Branch) -> Term:
        left = self._value(branch.parts[0])
        for (operator, at), part in zip(branch.value, branch.parts[1:], strict=True):
            right = self._value(part)
            try:
                found = self._joined(operator, left, right)
            except FrametoolError as error:
                if getattr(error, "at", None) is None:
                    error.at = at  # type: ignore[attr-defined]
                raise
            left = found.written(self.text[branch.left : part.right], atomic=False)
        return left

    def _joined(self, operator: str, left: Term, right: Term) -> Term:
        if operator == "/":
            return rules.over(left, right)
        rule = {"*": rules.times, "+": rules.add, "-": rules.subtract}[operator]
        return rule(left, right, self.scope.trees)

    def _sign(self, branch: Branch) -> Term:
        below = self._value(branch.parts[0])
        return rules.negated(below) if branch.value == "-" else rules.unsigned(below)

    def _power(self, branch: Branch) -> Term:
        base, exponent = map(self._value, branch.parts)
        return rules.power(base, exponent)

    def _as(self, branch: Branch) -> Term:
        target, source = map(self._bare, branch.value)
        return rules.as_frames(self._value(branch.parts[0]), target, source)

    def _in(self, branch: Branch) -> Term:
        return rules.in_frame(self._value(branch.parts[0]), self._bare(branch.value.strip('"')))

    def _bare(self, name: str, tree: Frames | None = None) -> str:
        """Take a leading `/` off a frame's name, which tf2 has given up, unless a frame is called so."""
        trees = [tree] if tree is not None else [each for _, each in self.scope.trees]
        if len(name) < 2 or not name.startswith("/") or any(name in each.frames for each in trees):
            return name
        from frametool.grammar.readers import slash_note

        warn(slash_note(name))
        return name[1:]

    def _lookup(self, branch: Branch) -> Term:
        frames, named, when = branch.value
        tree = self._tree(named)
        target, source = (self._bare(each, tree) for each in frames)
        type_ = Type(POSE, target, source)
        if when == "row":
            if self.scope.row is None:
                raise CalcError("@ row is known in streams only: -i FILE, or standard input")
            tree.latest(target, source)  # raises what is wrong at all times
            return Term(type_, None, _at_row(tree, target, source))
        return Term(type_, tree.lookup_components(target, source, None if when == "latest" else when))

    def _tree(self, name: str) -> Frames:
        """Find the tree of a look-up."""
        scope = self.scope
        if not name:
            if scope.tree is None:
                named = next((each for each, _ in scope.trees), "")
                hint = f", or ask {named}[TARGET<-SOURCE]" if named else ", or name one: d=FILE and d[TARGET<-SOURCE]"
                raise NoTree(f"no tree to look up in: give --tree FILE{hint}")
            return scope.tree
        if name not in scope.names:
            trees = [each for each, _ in scope.trees if each]
            raise CalcError(f"unknown name {shown(name)}{did_you_mean(name, trees)}")
        tree = scope.names[name].tree
        if tree is None:
            raise CalcError(f"{name} is no tree but {scope.names[name].type.named}")
        return tree


def _at_row(tree: Frames, target: str, source: str) -> Callable[[RowValues], Components]:
    """Return what looks up at the times of rows; rows without data then are nan."""

    def compute(row: RowValues) -> Components:
        if row.xp is not floats:
            return tree.lookup_many(target, source, row.times_ns, missing="nan").components
        found = tree.lookup_many(target, source, [row.times_ns], missing="nan").components  # to the bit as of many
        single = tuple(float(column[0]) for column in found)
        return single if single[6] == single[6] else tree.lookup_components(target, source, row.times_ns)

    return compute


def kept(term: Term) -> Term:
    """Return the same value, computed once for each block however often it is named."""
    if term.parts is not None or term.compute is None:
        return term
    compute = term.compute

    def once(row: RowValues) -> Components:
        if id(compute) not in row.kept:
            row.kept[id(compute)] = compute(row)
        return row.kept[id(compute)]

    return Term(term.type, None, once, items=term.items, text=term.text, atomic=term.atomic)

