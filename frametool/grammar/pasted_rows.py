"""Rows of numbers as tools print them, taken out of what stands around them.

    array([[ 0., -1.], ..          numpy, PyTorch, JAX, SymPy: brackets, names with parentheses, dtype=..
    [0 -1; 1 0]                    MATLAB; also its factor `1.0e+03 *` and its `Columns 1 through 3`
    2x2 Matrix{Float64}:           Julia's heading; the indices of R and pandas
    <Matrix 3x3 (..)               Blender; ` << 0, -1, ..;` is Eigen's comma initializer

Knows nothing of poses.  Each number stays the text it was.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias

from frametool.errors import ValueInvalid, shown

Rows: TypeAlias = "list[list[str]]"

if TYPE_CHECKING:
    from collections.abc import Sequence

DECIMAL = r"(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?"
NUMBER = rf"[-+]?{DECIMAL}"
LABEL = r"\s*[A-Za-z_]\w*+\s*=(?!=)\s*"  # MATLAB's and Python's `T =`
_NAMED = r"(?<![\w.)\]}])[A-Za-z_][\w.]*+\((?=\s*[-+.\d\[({A-Za-z])"  # array(, np.array(, tensor(
_ARGUMENTS = r"(?:,\s*[A-Za-z]\w*\s*=\s*[\w.'\":<>]+)+\s*(?=\))"  # dtype=float32
_SCALE = rf"\s*({NUMBER})\s*\*\s*\n"  # MATLAB's `1.0e+03 *` above a matrix
_SCALAR = r"(?:np|numpy)\.\w+\(([^()]*)\)"  # numpy 2 in lists: np.float64(0.5)
_OPEN, _CLOSE = "[({", "])}"
_BY_COLUMNS = r"(?:[dft]|high|med|low)?p?_?mat[34](?:x[34])?\(|(?:structure\(|matrix\()?\bc\((?:[^,()]*,){8}"
_COLUMNS = r"(?m)^[ \t]*Columns? \d+(?: (?:through|and|to) \d+)?:?[ \t]*$"
_DECORATIONS: Sequence[tuple[str, str]] = (
    (r"\x1b\[[\d;]*m", ""),  # colours of a terminal
    (r"\A\s*Out\[\d+\](?://\w+)?\s*[:=]\s*", ""),  # Mathematica, IPython
    (r"\A\s*Parameter containing:\s*", ""),  # PyTorch
    (r"\A\s*(?:[A-Za-z_][\w.()]*\s*)?<<", ""),  # Eigen's comma initializer
    (rf"\A({LABEL})?\s*\d+[\xd7x]\d+\b[^\n]*\n", ""),  # heading of Julia and MATLAB's live scripts
    (rf"\A({LABEL})\s*(?:se3|so3)[ \t]*\n", ""),  # MATLAB's classes
    (r"(?s)<Matrix \d+x\d+\s*(.*)>", r"[\1]"),  # Blender
    (r"(?m)^[ \t]*(?:\[,\d+\][ \t]*)+\n|^\[\d+,\]", ""),  # R
    (r"\\(?:left|right)\s*\\?[][().{}|]|\\(?:begin|end)\{\w+\}(?:\{[lcr]+\})?|[$]", " "),  # LaTeX
    (r"\s*\\\\\s*", "\n"),
    (r"\s*&\s*", " "),
    (r"[⎡⎢⎣⎤⎥⎦⎛⎜⎝⎞⎟⎠│┃┌┐└┘]", " "),  # brackets that SymPy and nalgebra draw
    (r"\b(?:Float|Integer)\('?([-+.\deE]+)'?(?:, precision=\d+)?\)", r"\1"),  # SymPy's srepr
    (r"(?<=[\d.])`+[\d.]*", ""),  # Mathematica's precision
    (r"(?<=[\d.])\*\^", "e"),  # and its power of ten
    (_SCALAR, r"\1"),
)
_DECORATED = r"""[\x1b\\⎡⎢⎣⎤⎥⎦⎛⎜⎝⎞⎟⎠│┃┌┐└┘`^\xd7]|<|\[\d*,?\d*\]|[A-Za-z]\w*[(: ]|(?m:^\s*se3|so3)"""


def number_rows(text: str, *, any_text: bool = False) -> Rows | None:
    """Take a print of numbers apart into its rows; None for what is none.

    any_text: words beside numbers are kept as they are, for a reader who knows what to say about them.
    Raises ValueInvalid for a print that was cut, for one by columns, and for commas that may be decimal ones.
    """
    body = _undecorated(text).strip().rstrip(";")
    body = re.sub(LABEL, "", body, count=1) if re.match(LABEL, body) else body
    scale = re.match(_SCALE, body)
    body = _side_by_side(body[scale.end() :] if scale else body)
    if "..." in body and re.search(rf"{NUMBER}[\s,]*\.\.\.", body):
        raise ValueInvalid("the print was cut at '...'; print all numbers")
    pieces = _bracketed(body) if body[:1] and body[0] in _OPEN else re.split(r";|\n", body)
    if pieces is None:
        return None
    rows = _without_indices([_cells(piece) for piece in pieces if piece.strip()])
    cells = [cell for row in rows for cell in row]
    fits = any if any_text and not re.search("[:=\"']", body) else all
    if not cells or not fits(map(_is_number, cells)):
        return None
    return [[_times(cell, scale[1]) for cell in row] for row in rows] if scale else rows


def _undecorated(text: str) -> str:
    """Take away the names, headings and brackets that tools put around numbers.

    Raises ValueInvalid for what holds a matrix column by column.
    """
    if not re.search(_DECORATED, text):
        return text
    if by_columns := re.match(rf"(?:{LABEL})?\s*(?:{_BY_COLUMNS})", text):
        name = shown(by_columns[0].split("(")[0].strip())
        raise ValueInvalid(f"{name} holds a matrix column by column; write its rows, [[..], [..], [..]]")
    for pattern, plain in _DECORATIONS:
        text = re.sub(pattern, plain, text)
    text = re.sub(_ARGUMENTS, "", text)
    return re.sub(_NAMED, "(", text)


def _side_by_side(body: str) -> str:
    """Put the blocks of columns into which a wide matrix was parted beside each other again."""
    before, *blocks = re.split(_COLUMNS, body)
    if not blocks:
        return body
    lines = [[line for line in block.splitlines() if line.strip()] for block in blocks]
    if before.strip() or len({*map(len, lines)}) > 1:
        return body
    return "\n".join(map(" ".join, zip(*lines, strict=True)))


def _without_indices(rows: Rows) -> Rows:
    """Take away the counting row above and the counting column that pandas prints."""
    if len(rows) < 2 or rows[0] != [str(at) for at in range(len(rows[0]))]:
        return rows
    if any(row[0] != str(at) or len(row) != len(rows[0]) + 1 for at, row in enumerate(rows[1:])):
        return rows
    return [row[1:] for row in rows[1:]]


def _bracketed(body: str) -> list[str] | None:
    """Return what stands in the innermost brackets; None if there is more than brackets around them."""
    plain = body.translate(str.maketrans("({)}", "[[]]"))
    inner = re.findall(r"\[([^\[\]]*)\]", plain)
    around = re.sub(r"\[[^\[\]]*\]", "", plain)
    if plain.count("[") != plain.count("]") or re.sub(r"[\[\],;\s]", "", around):
        return None
    return inner[0].split(";") if len(inner) == 1 else inner


def _cells(row: str) -> list[str]:
    """Part a row at its blanks or at its commas; raise ValueInvalid where both part it."""
    row = row.strip().removesuffix(",").strip()
    gaps = re.findall(r"\s*,\s*|\s+", row)
    commas = sum("," in gap for gap in gaps)
    if 0 < commas < len(gaps):
        raise ValueInvalid(f"{shown(row)} is parted by blanks and by commas; are these decimal commas? write points")
    return re.split(r"\s*,\s*|\s+", row)


def _is_number(cell: str) -> bool:
    return re.fullmatch(rf"{NUMBER}|[-+]?(?:nan|inf)", cell, re.IGNORECASE) is not None


def _times(cell: str, scale: str) -> str:
    """Multiply a text by the power of ten that stands above a matrix, exactly."""
    power = re.fullmatch(r"1(?:\.0*)?[eE]([-+]?\d+)", scale)
    if not power or "e" in cell.lower():
        raise ValueInvalid(f"a factor {shown(scale)} above numbers is not a power of ten; use format long")
    return f"{cell}e{power[1]}"
