"""How the names of formulas are written in LaTeX."""

from __future__ import annotations

import re

SYMBOLS = {
    "roll": r"\phi", "pitch": r"\theta", "yaw": r"\psi", "angle": r"\vartheta", "arc": r"\Omega", "pi": r"\pi",
    "bearing": r"\beta", "det": r"\det R", "norm": r"\lVert q \rVert", "tr": r"\operatorname{tr} R",
    "dot": r"a \cdot b", "ww": "4 w^2", "xx": "4 x^2", "yy": "4 y^2", "zz": "4 z^2", "pp": r"\lvert p \rvert^2",
    "a1": r"\alpha_1", "a2": r"\alpha_2", "a3": r"\alpha_3",
}  # fmt: skip
INDEXED = re.compile(r"([a-zA-Z])([0-9]{1,2}|[a-zA-Z][0-9]?)")


def symbol(name: str) -> str:
    """Return a name as LaTeX: Greek where that is the custom, an index where there is one, else upright."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    if name.endswith("_deg"):
        return rf"{symbol(name[:-4])}^{{\circ}}"
    if len(name) == 1:
        return name
    if found := INDEXED.fullmatch(name):
        return f"{found[1]}_{{{found[2]}}}"
    return rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"
