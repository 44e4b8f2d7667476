"""Tables of Denavit-Hartenberg parameters: one row per joint, in CSV, TSV or between blanks, in YAML or JSON.

    joint,theta,d,a,alpha_deg
    1,q1,0.089159,0,90

standard: rotate by theta about z and translate by d along it, then translate by a along x and rotate by alpha about it.
modified (Craig): alpha and a first, of the previous joint, then theta and d.  Tables do not state which: `--dh` does.
Metres and radians; a column that ends in deg or mm has that unit, a cell may have its own.  Joints are at 0, which is
added to theta, or to d of a prismatic joint.  link0 is the parent of link1 and so on: parent<-child.
"""

from __future__ import annotations

import re
from functools import partial
from math import radians
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.documents.document import format_error, locate_many, looks_like_json, parse_documents
from frametool.errors import FormatError, Unanswered, ValueInvalid, did_you_mean, listing, shown
from frametool.formats.robots.joints import JointState
from frametool.formats.robots.model import Joint, Link
from frametool.formats.rows.csv import LineCell, split_line
from frametool.geometry import euler, floats, rigid
from frametool.grammar.readers import Path, kind
from frametool.text.numbers import LENGTHS, NotFinite, parse_angle, parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from frametool.documents.source import InputFile
    from frametool.grammar.edges import Diagnostics, Edge, Options

    Fail = Callable[[str], FormatError]
    # the name of a column or key as written, the value, and the error for its place
    Item = tuple[str, Any, Fail]

# names of columns in use, without unit and joint number
COLUMNS = {
    "theta": ("theta", "\u03b8", "th", "joint_angle", "q"),
    "d": ("d", "link_offset"),
    "a": ("a", "r", "link_length"),
    "alpha": ("alpha", "\u03b1", "twist", "link_twist"),
    "offset": ("offset", "theta_offset", "joint_offset"),
    "type": ("type", "joint_type", "kind", "sigma"),
    "name": ("name", "joint", "joint_name", "link", "i", "j", "id", "#", "no", "frame", "index"),
}
UNITS = {
    "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radians": "rad",
    "m": "m", "cm": "cm", "mm": "mm",
}  # fmt: skip
KINDS = {
    "r": "revolute", "revolute": "revolute", "rotational": "revolute", "rotary": "revolute", "0": "revolute",
    "continuous": "revolute", "p": "prismatic", "prismatic": "prismatic", "linear": "prismatic", "1": "prismatic",
    "fixed": "fixed", "f": "fixed",
}  # fmt: skip
_BRACKETED = r"(.+?)[ _]*[\[(] *([\w°]+) *[\])]"
_SUFFIXED = r"(.+)_([a-z]+)"
_INDEX = r"[ _]*[({\[]*(?:i|n|j|k)(?: *[-_] *1)?[)}\]]*$"  # theta_i, a_(i-1), alpha_{i-1}
_VARIABLE = r"(?!(?i:null|none|true|false)\b)([^\W\d]\w*)(?: *([-+]) *(.+))?"  # q1, q2 - pi/2


class Cell(NamedTuple):
    """One number as text, the unit of its column, and a function that returns the error for its place."""

    text: str
    unit: str
    fail: Fail


class Amount(NamedTuple):
    """An angle in radians or degrees, or a length in metres, plus the joint value named by `variable`, if any."""

    number: float = 0.0
    degrees: bool = False
    variable: str = ""

    def plus(self, other: Amount) -> Amount:
        """Return the sum with another amount."""
        if self.degrees == other.degrees or not other.number:
            return self._replace(number=self.number + other.number)
        one, two = (radians(each.number) if each.degrees else each.number for each in (self, other))
        return Amount(one + two, variable=self.variable)


class DhRow(NamedTuple):
    """One joint: its parameters, of which theta and d include their offsets, and its line."""

    name: str
    kind: str
    theta: Amount
    d: Amount
    a: float
    alpha: Amount
    line: int = 0


def rows_of(file: InputFile, tally: Diagnostics) -> list[DhRow]:
    """Return the rows of a table, with a warning for columns that are not read; raises FormatError with the place."""
    text = file.text
    is_document = looks_like_json(text) or re.search(r"(?m)^ *(?:- *)?[{\[]|^ *(?:- +)?[\w.-]+:(?:\s|$)", text)
    rows: dict[str, DhRow] = {}
    others: dict[str, None] = {}
    for number, (items, fail, line) in enumerate((_of_documents if is_document else _of_lines)(file), 1):
        row = _row(number, _cells(items, others), fail, line)
        if row.name in rows:
            raise fail(f"two joints are called {shown(row.name)}: rows {[*rows].index(row.name) + 1} and {number}")
        rows[row.name] = row
    if not rows:
        raise file.error("a table without rows")
    if others:
        first = next(iter(rows.values())).line - (not is_document)
        tally.note_each(f"left out, about something else: {listing(others)}", first)
    return [*rows.values()]


def _cells(items: Iterable[Item], others: dict[str, None]) -> dict[str, Cell]:
    """Return the cells of a row by column; `others` receives the names of columns that are not read."""
    cells: dict[str, Cell] = {}
    known = [each for names in COLUMNS.values() for each in names if len(each) > 1]
    for written, value, fail in items:
        name, unit = column_of(written) or ("", "")
        if not name:
            near = did_you_mean(written.strip().lower(), known, cutoff=0.75)
            if near or value is None:  # in YAML, a decimal comma leaves a key without a value
                raise fail(f"unknown column {shown(written)}{near}; a row has {', '.join(COLUMNS)}")
            others[written] = None
        elif name in cells:
            raise fail(f"two columns for {name}; keep one")
        elif type(value) is not str:
            raise fail(f"expected a number, found {kind(value)}")
        else:
            cells[name] = Cell(value, unit, fail)
    return cells


def column_of(written: str) -> tuple[str, str] | None:
    """Return the column of COLUMNS that a header names, and its unit; None for other names."""
    base, unit = written.strip().lower(), ""
    for pattern in (_BRACKETED, _SUFFIXED):
        if (match := re.fullmatch(pattern, base)) and match[2] in UNITS:
            base, unit = match[1], UNITS[match[2]]
            break
    for name in (base, re.sub(_INDEX, "", base)):
        if found := next((column for column, names in COLUMNS.items() if name in names), None):
            return found, unit
    return None


def _row(number: int, cells: dict[str, Cell], fail: Fail, line: int) -> DhRow:
    """Read one row."""
    if missing := [name for name in ("d", "a", "alpha") if name not in cells]:
        raise fail(f"missing {', '.join(missing)}; a row has theta, d, a, alpha, maybe offset, type and joint")
    zero = Cell("0", "", fail)
    theta, d = _read(cells.get("theta", zero), _angle), _read(cells["d"], _length)
    kind = "prismatic" if d.variable else "revolute"
    if "type" in cells and (written := cells["type"].text):
        if written.lower() not in KINDS:
            raise cells["type"].fail(f"unknown type {shown(written)}; known: revolute (R, 0), prismatic (P, 1), fixed")
        kind = KINDS[written.lower()]
    for name, amount, varies in (("theta", theta, "revolute"), ("d", d, "prismatic")):
        if amount.variable and kind != varies:
            raise fail(f"a {kind} joint with a variable {name}")
    offset = _read(cells.get("offset", zero), _length if kind == "prismatic" else _angle)
    theta, d = (theta, d.plus(offset)) if kind == "prismatic" else (theta.plus(offset), d)
    written = cells["name"].text if "name" in cells else ""
    name = theta.variable or d.variable or (f"joint{number}" if not written or written.isdecimal() else written)
    a, alpha = _read(cells["a"], _length), _read(cells["alpha"], _angle)
    for column, amount in (("a", a), ("alpha", alpha)):
        if amount.variable:
            raise cells[column].fail(f"{shown(cells[column].text)} is not a number; only theta or d vary")
    return DhRow(name, kind, theta, d, a.number, alpha, line)


def _read(cell: Cell, read: Callable[[str, str], Amount]) -> Amount:
    """Read a number, or the name of a joint value with an offset; raises the error of the cell."""
    try:
        return read(cell.text, cell.unit)
    except ValueInvalid as error:
        match = re.fullmatch(_VARIABLE, cell.text) if not isinstance(error, NotFinite) else None
        try:
            constant = read(match[3] or "0", cell.unit) if match else None
        except ValueInvalid:
            constant = None
        if match is None or constant is None:
            raise cell.fail(str(error)) from None
    signed = -constant.number if match[2] == "-" else constant.number
    return constant._replace(number=signed, variable=match[1])


def _angle(text: str, unit: str) -> Amount:
    if unit not in ("", "deg", "rad"):
        raise ValueInvalid(f"an angle in {unit}")
    number, own = parse_angle(text)
    return Amount(number, degrees=(own or unit) == "deg")


def _length(text: str, unit: str) -> Amount:
    if unit not in LENGTHS:
        raise ValueInvalid(f"a length in {unit}")
    is_bare = not re.search(r"[a-z]", text.lower().replace("e", ""))
    return Amount(parse_number(text) / LENGTHS[unit] if is_bare else parse_length(text))


def _of_lines(file: InputFile) -> Iterator[tuple[list[Item], Fail, int]]:
    """Yield the rows of a text with one row per line, below a header."""
    lines = [(number, line) for number, line in enumerate(file.text.split("\n"), 1) if line.strip()]
    begin = next((at for at, (_, line) in enumerate(lines) if _is_row({word.text for word in _split(line)})), None)
    if begin is None:
        raise file.error("no header with d, a and alpha above the rows; write theta,d,a,alpha", 1)
    header = [word.text for word in _split(lines[begin][1])]
    for number, line in lines[begin + 1 :]:
        if line.lstrip().startswith("#"):
            continue
        words = _split(line)
        fail = partial(file.error, line=number, column=1)
        if len(words) != len(header):
            raise fail(f"expected {len(header)} cells, found {len(words)}")
        places = (partial(file.error, line=number, column=word.column) for word in words)
        yield [(name, word.text, place) for name, word, place in zip(header, words, places, strict=True)], fail, number


def _split(line: str) -> list[LineCell]:
    """Split a line at tabs, semicolons, commas or blanks; a # before them is ignored."""
    line = re.sub("^( *)#", r"\1 ", line.rstrip())
    mark = next((mark for mark in "\t;," if mark in line), "")
    if mark == ",":
        return split_line(line)
    pattern = rf"[^{mark}]*" if mark else r"[^\s\[(]+(?: ?[\[(]\S+[\])])?(?: [-+] \S+)?"
    found = [LineCell(match[0].strip(), match.start() + 1) for match in re.finditer(pattern, line)]
    return found[:: 2 if mark and line.count(mark) + 1 < len(found) else 1]


def _of_documents(file: InputFile) -> Iterator[tuple[list[Item], Fail, int]]:
    """Yield the rows of a table in YAML or JSON."""
    source = file.source
    for document in parse_documents(source.text, source.name):

        def fail(path: Path, message: str, index: int = document.index) -> FormatError:
            return format_error(source, (index, *path), message)

        tables = list(_tables(document.value, (), fail))
        if len(tables) != 1:
            expected = "expected a list of {theta, d, a, alpha}, or a map of them"
            raise fail((), f"{len(tables)} tables in it; keep one" if tables else f"no table in it: {expected}")
        (rows,) = tables
        lines = locate_many(source.text, [(document.index, *path) for path, _ in rows])
        for (path, items), (line, _) in zip(rows, lines, strict=True):
            found: list[Item] = [(key, value, partial(fail, (*path, *place))) for key, value, place in items]
            yield found, partial(fail, path), line


def _tables(value: Any, path: Path, fail: Callable[..., FormatError]) -> Iterator[list[tuple[Path, list[Any]]]]:
    """Yield each table as a list of rows: (path, cells); a cell is (key, value, path below the row)."""
    if len(path) > 4 or type(value) not in (dict, list) or not value:
        return
    items = list(value.items() if type(value) is dict else enumerate(value))
    if any(type(each) is dict and _is_row(each) for _, each in items):
        rows = []
        for name, row in items:
            if type(row) is dict:
                is_named = type(value) is list or any(column_of(key) == ("name", "") for key in row)
                own = [] if is_named else [("name", name, ())]
                rows.append(((*path, name), [*((key, cell, (key,)) for key, cell in row.items()), *own]))
            elif type(value) is list:
                raise fail((*path, name), f"expected a row {{theta, d, a, alpha}}, found {kind(row)}")
        yield rows
    else:
        for key, each in items:
            yield from _tables(each, (*path, key), fail)


def _is_row(keys: Collection[str]) -> bool:
    return {"a", "alpha"} <= {column[0] for key in keys if (column := column_of(key))}


TURN = 6.283185307179586


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield one edge per row, with joint values from options, default 0; joints rotate about z or move along it."""
    rows = rows_of(file, options.tally)
    if not options.answers.dh:
        choice = "--dh standard (a and alpha behind the joint) or --dh modified (Craig: before it)"
        message = f"nothing in a table of Denavit-Hartenberg parameters says which they are: give {choice}"
        raise Unanswered(message, source=file.name, line=rows[0].line, column=1)
    frames = options.answers.names(*(f"link{number}" for number in range(len(rows) + 1)))
    links = []
    for row, parent, child in zip(rows, frames, frames[1:], strict=False):
        for name, amount in (("theta", row.theta), ("alpha", row.alpha)):
            if not amount.degrees and abs(amount.number) > TURN:
                message = f"{name} {amount.number:g} is more than a full turn in radians; degrees? write {name}_deg"
                options.tally.note_each(message, row.line, "degrees")
        theta = euler.to_quaternion(0.0, 0.0, row.theta.number, "sxyz", floats, degrees=row.theta.degrees)
        alpha = euler.to_quaternion(row.alpha.number, 0.0, 0.0, "sxyz", floats, degrees=row.alpha.degrees)
        along_z, along_x = (0.0, 0.0, row.d.number, *theta), (row.a, 0.0, 0.0, *alpha)
        origin, after = rigid.IDENTITY, rigid.compose(*along_z, *along_x)
        if options.answers.dh == "modified":
            origin, after = rigid.compose(*along_x, *along_z), rigid.IDENTITY
        joints = () if row.kind == "fixed" else (Joint(row.name, row.kind, (0.0, 0.0, 1.0), line=row.line),)
        links.append(Link(parent, child, origin, joints, row.line, after, fixed="" if joints else row.name))
    yield from JointState.of(links, options, file.name).edges(links)
