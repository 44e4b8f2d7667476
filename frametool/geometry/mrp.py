"""Kernels of the modified Rodrigues parameters: the axis times tan(angle/4)."""

from __future__ import annotations

from frametool.errors import ValueInvalid

LIMIT = 1e150  # beyond, the square of the length overflows (and no digit of a turn is left)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Namespace, Number, Quaternion, Vector


def to_quaternion(px: Number, py: Number, pz: Number) -> Quaternion:
    """Return the quaternion x, y, z, w of modified Rodrigues parameters (Schaub & Junkins 1996)."""
    squared = px * px + py * py + pz * pz
    scale = 1.0 / (1.0 + squared)
    return 2.0 * px * scale, 2.0 * py * scale, 2.0 * pz * scale, (1.0 - squared) * scale


def from_quaternion(x: Number, y: Number, z: Number, w: Number, xp: Namespace) -> Vector:
    """Return modified Rodrigues parameters of length 0 to 1: those of the shorter turn."""
    divisor = xp.copysign(1.0 + abs(w), xp.first_nonzero(w, x, y, z))
    return x / divisor, y / divisor, z / divisor


def check(
    px: float,
    py: float,
    pz: float,
    *,
    normalize: bool = False,  # noqa: ARG001 - every length is one
) -> tuple[float, float, float]:
    """Check one at the door.

    Raises:
        ValueInvalid: not finite, or so long that its square overflows.
    """
    if not all(abs(value) <= LIMIT for value in (px, py, pz)):
        shown = f"mrp {px:g} {py:g} {pz:g}"
        raise ValueInvalid(f"{shown} is not finite or too long; give numbers below {LIMIT:g}", rule="not-finite")
    return px, py, pz
