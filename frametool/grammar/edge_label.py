"""The pose of an edge in a few words, for drawings: millimetres and hundredths of a degree are enough there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import rotation_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frametool.geometry.transform import Transform
    from frametool.grammar.result import Style

METRES = 3
DEGREES = 2
MOST_PLAIN = 1e9
NOISE = 1e-9  # what rounding leaves of a zero, metres or degrees


def edge_label(transform: Transform, style: Style) -> tuple[str, str]:
    """Return two lines: `xyz 0.1 0 1.2` and `rpy_deg 0 15 0`, or the first representation asked for."""
    pose = Pose.of(transform.components)
    chosen = style.notations[0] if style.notations else notation("rpy_deg")
    degrees = bool(chosen.representation.angles) and style.in_degrees(chosen)
    position = _short(pose.components[:3], style.precision if style.precision is not None else METRES)
    decimals = style.precision if style.precision is not None else DEGREES if degrees else METRES
    return f"xyz {position}", f"{chosen.spec} {_short(rotation_numbers(pose, chosen, style), decimals)}"


def graphviz(text: str) -> str:
    """Write a text as it stands between double quotes; & and a backslash would begin escapes of graphviz."""
    return text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _short(values: Iterable[float], decimals: int) -> str:
    """Round for reading; trailing zeros and minus zero say nothing."""
    return " ".join(_rounded(value, decimals) for value in values)


def _rounded(value: float, decimals: int) -> str:
    """Round a number for reading; what would vanish or grow endless gets an exponent."""
    if abs(value) < NOISE:
        value = 0.0
    if value and not 0.5 * 10.0**-decimals <= abs(value) < MOST_PLAIN:
        return f"{value:.1e}"
    text = f"{value + 0.0:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text
