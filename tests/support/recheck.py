"""Recompute every printed line of a derivation from the numbers printed in it, with Python's own arithmetic."""

from __future__ import annotations

import math
import re
from typing import Any

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[-+]\d+)?")
NAMES = {name: getattr(math, name) for name in ("sin", "cos", "sqrt", "atan2", "hypot", "pi")} | {
    "abs": abs, "min": min, "max": max, "__builtins__": {},
}  # fmt: skip


def recheck(text: str, digits: int | None) -> int:
    """Recompute the steps and the matrices of a sheet; return how many there were."""
    lines = re.sub(r"\n +(?=[=+·-] ?[^\[\n]*$)", " ", text.split("\nResult", maxsplit=1)[0], flags=re.MULTILINE).splitlines()
    steps = [match[1].split(" = ") for line in lines if (match := re.fullmatch(r"   \w+ += ([^\[]+)", line))]
    numeric = [parts for parts in steps if len(parts) > 1 and not re.search("[A-Za-z]", _without_functions(parts[-2]))]
    for *_, shown, value in numeric:
        _compare(shown, value.split(" ")[0] if value[0] != "(" else value, digits)
    return len(numeric) + _recheck_grids(text, digits)


def _without_functions(formula: str) -> str:
    return re.sub(r"\b(sqrt|sin|cos|atan2|hypot|abs|min|max|pi|slerp)\b|\de[-+]\d", "", formula)


def _compare(shown: str, value: str, digits: int | None) -> None:
    """Compare a formula with its value: exactly, or within what the rounding of the printed numbers explains."""
    formula = shown.replace("·", "*").replace("^", "**")
    if value[0] == "(":
        _compare_quaternions(formula, value, digits)
        return
    found, wanted = _run(formula), float(value)
    if digits is None:
        assert found == wanted, (shown, found, wanted)
        return
    slack = 3e-15 * max(1.0, abs(found)) + 1.05 * _ulp(value, digits)
    for each in NUMBER.finditer(formula):
        ulp = _ulp(each[0], digits)
        if ulp:
            moved = [_run(f"{formula[: each.start()]}{float(each[0]) + d!r}{formula[each.end() :]}") for d in (ulp, -ulp)]
            slack += 1.05 * max(abs(_turned(there - found)) if "atan2" in formula else abs(there - found) for there in moved)
    off = _turned(found - wanted) if "atan2" in formula else found - wanted  # a printed 0 does not show its sign
    assert abs(off) <= slack, (shown, found, wanted, slack)


def _turned(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def _run(formula: str) -> Any:
    return eval(formula, dict(NAMES))  # noqa: S307 - what the sheet printed


def _ulp(text: str, digits: int) -> float:
    """Return half a unit of the last digit of a number that was rounded to so many; 0 for an exact one."""
    mantissa = text.lstrip("-").split("e")[0]
    rounded = "." in mantissa and len(mantissa.replace(".", "").lstrip("0")) >= digits
    value = abs(float(text))
    return 0.5 * 10.0 ** (math.floor(math.log10(value)) - digits + 1) if rounded and value else 0.0


def _compare_quaternions(formula: str, value: str, digits: int | None) -> None:
    """Compare a product of quaternions or a slerp, written as tuples."""
    numbers = [[float(each) for each in group.split(",")] for group in re.findall(r"\(([^()s]+)\)", formula)]
    if formula.startswith("slerp"):
        a, b, (f,) = *([float(v) for v in g.split(",")] for g in re.findall(r"\(([-\de., +]+)\)", formula)), [
            float(formula.rsplit(",", 1)[1].rstrip(") "))
        ]
        dot = sum(x * y for x, y in zip(a, b, strict=True))
        b = [-y for y in b] if dot < 0.0 else b
        arc = math.acos(min(1.0, abs(dot)))
        k = (1 - f, f) if arc < 1e-4 else (math.sin((1 - f) * arc) / math.sin(arc), math.sin(f * arc) / math.sin(arc))
        found = [k[0] * x + k[1] * y for x, y in zip(a, b, strict=True)]
        slack = 1e-9 if digits is None else 50.0 * 10.0**-digits
    else:
        (ax, ay, az, aw), (bx, by, bz, bw) = numbers
        found = [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                 aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]  # fmt: skip
        slack = 0.0 if digits is None else 5.0 * 10.0**-digits
    for x, y in zip(found, value[1:-1].split(","), strict=True):
        assert abs(x - float(y)) <= slack, (formula, found, value)


def _recheck_grids(text: str, digits: int | None) -> int:
    """Recompute the products and sums of matrices."""
    count = 0
    for block in re.findall(r"(?:^ .*\[.*\n)+", text.split("\nResult", maxsplit=1)[0], re.MULTILINE):
        parts: list[Any] = []
        rows = block.splitlines()
        height = _height(rows)
        for top in range(0, len(rows), height):
            parts += _parts(rows[top : top + height])
        if "=" in parts:
            at = parts.index("=")
            _compare_matrices(_value(parts[:at]), parts[at + 1], digits, parts)
            count += 1
    return count


def _height(rows: list[str]) -> int:
    """Tell how many rows the matrices of a block have: the line with words is the middle one."""
    middle = next((at for at, row in enumerate(rows) if re.match(r" +(\w+'? )?= ", row)), len(rows) // 2)
    return {1: 3, 3: 6}.get(middle, 3)


def _parts(rows: list[str]) -> list[Any]:
    """Read matrices and the signs between them."""
    middle = re.sub(r"^ +(\w+'? )?= ", lambda match: " " * len(match[0]), rows[len(rows) // 2])
    parts: list[Any] = []
    for match in re.finditer(r"\[[^\]]*\]|[^\[\]\s][^\[\]]*", middle):
        if match[0][0] != "[":
            parts += match[0].split()
            continue
        cells = [row[match.start() + 1 : match.end() - 1].split() for row in rows]
        parts.append([[float(cell) for cell in row] for row in cells])
    return parts


def _value(parts: list[Any]) -> Any:
    """Multiply neighbours and add: matrices as lists of rows, numbers before them."""
    if "+" in parts:
        at = parts.index("+")
        pairs = zip(_value(parts[:at]), _value(parts[at + 1 :]), strict=True)
        return [[a + b for a, b in zip(*pair, strict=True)] for pair in pairs]
    factor = 1.0
    if isinstance(parts[0], str):
        factor, parts = -1.0 if parts[0] == "-" else float(parts[0].rstrip("·")), parts[1:]
    product = parts[0]
    for other in parts[1:]:
        product = [[_inner(row, column) for column in zip(*other, strict=True)] for row in product]
    return [[factor * entry for entry in row] for row in product]


def _inner(row: Any, column: Any) -> float:
    terms = [a * b for a, b in zip(row, column, strict=True)]
    total = terms[0]
    for term in terms[1:]:
        total += term
    return float(total)


def _compare_matrices(found: Any, wanted: Any, digits: int | None, parts: list[Any]) -> None:
    size = max([1.0, *(abs(entry) for part in parts if isinstance(part, list) for row in part for entry in row)])
    slack = (4e-16 if digits is None else 10.0**-digits) * size * (1.0 if digits is None else 8.0 * size)
    for a, b in zip(found, wanted, strict=True):
        assert all(abs(x - y) <= slack for x, y in zip(a, b, strict=True)), (found, wanted)

