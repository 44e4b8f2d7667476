"""Kernels of the modified Rodrigues parameters: the axis times tan(angle/4)."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.geometry.types import Four, Functions, N, Three


def to_quaternion(px: N, py: N, pz: N) -> Four[N]:
    """Return the quaternion x, y, z, w of modified Rodrigues parameters (Schaub & Junkins 1996)."""
    squared = px * px + py * py + pz * pz
    scale = 1.0 / (1.0 + squared)
    return 2.0 * px * scale, 2.0 * py * scale, 2.0 * pz * scale, (1.0 - squared) * scale


def from_quaternion(x: N, y: N, z: N, w: N, xp: Functions[N]) -> Three[N]:
    """Return modified Rodrigues parameters of length 0 to 1: those of the shorter turn."""
    divisor = xp.copysign(1.0 + abs(w), xp.first_nonzero(w, x, y, z))
    return x / divisor, y / divisor, z / divisor
