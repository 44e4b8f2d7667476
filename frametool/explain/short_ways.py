"""Ways between two representations that pass the quaternion by: those that textbooks show."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.explain.from_quaternion import COLUMNS, DET
from frametool.explain.sheet import RADIANS
from frametool.explain.steps import angle, direction, nearest_rotation, rows, sine_and_cosine, to_degrees
from frametool.explain.to_quaternion import ENTRIES, introduce, unit_axis

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.explain.sheet import Matrix, Sheet, Values

    Way = Callable[..., "Sequence[float] | None"]  # (sheet, numbers, axes, degrees given, degrees wanted)

NEAR_HALF_TURN = 1e-3  # of s: below, beside half a turn, the axis loses more digits than the derivation may be off
RODRIGUES = (
    "c + vx**2*k", "vx*vy*k - vz*s", "vx*vz*k + vy*s",
    "vy*vx*k + vz*s", "c + vy**2*k", "vy*vz*k - vx*s",
    "vz*vx*k - vy*s", "vz*vy*k + vx*s", "c + vz**2*k",
)  # fmt: skip
NOT_ACOS = "atan2(s, tr - 1), not acos((tr - 1)/2): acos loses half the digits near 0 and 180 deg."


def euler_to_matrix(
    sheet: Sheet, numbers: Sequence[float], axes: str, degrees: bool, _wanted: bool  # noqa: FBT001
) -> Sequence[float]:
    """Multiply three elementary matrices."""
    values: Values = {}
    order = axes[1:]
    sheet.heading(f"Euler angles {axes} to matrix")
    outermost = introduce(sheet, values, numbers, axes, degrees=degrees)
    return _product(sheet, values, [(order[at], f"a{at + 1}", f"{at + 1}") for at in outermost])


def rpy_to_matrix(
    sheet: Sheet, numbers: Sequence[float], _axes: str, degrees: bool, _wanted: bool  # noqa: FBT001
) -> Sequence[float]:
    """Multiply the elementary matrices about z, y, x."""
    values: Values = {}
    sheet.heading("Roll, pitch, yaw to matrix")
    sheet.say("About the fixed axes x, then y, then z: what is done first stands rightmost.")
    for name, given in zip(("roll", "pitch", "yaw"), numbers, strict=True):
        angle(sheet, values, name, given, degrees=degrees)
    return _product(sheet, values, [("z", "yaw", "y"), ("y", "pitch", "p"), ("x", "roll", "r")])


def _product(sheet: Sheet, values: Values, factors: list[tuple[str, str, str]]) -> Sequence[float]:
    """Add the product of turns about axes (axis, name of the angle, its letter), outermost first."""
    for _, name, letter in reversed(factors):
        sine_and_cosine(sheet, values, name, f"s{letter}", f"c{letter}", half=False)
    matrices = [_elementary(axis, values[f"s{letter}"], values[f"c{letter}"]) for axis, _, letter in factors]
    texts = [f"R{axis}({name})" for axis, name, _ in factors]
    latex = [rf"R_{axis}(\mathrm{{{name}}})" for axis, name, _ in factors]
    inner = sheet.product(matrices[1], matrices[2])
    sheet.grid("P", " ".join(texts[1:]), r"\,".join(latex[1:]), [matrices[1], matrices[2], "=", inner])
    found = sheet.product(matrices[0], inner)
    sheet.grid("R", f"{texts[0]} P", rf"{latex[0]}\,P", [matrices[0], inner, "=", found])
    sheet.caveat(COLUMNS)
    return _checked(sheet, [entry for row in found for entry in row])


def _elementary(axis: str, s: float, c: float) -> Matrix:
    minus = 0.0 - s
    if axis == "x":
        return [[1.0, 0.0, 0.0], [0.0, c, minus], [0.0, s, c]]
    if axis == "y":
        return [[c, 0.0, s], [0.0, 1.0, 0.0], [minus, 0.0, c]]
    return [[c, minus, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]


def _checked(sheet: Sheet, found: Sequence[float]) -> Sequence[float]:
    """Add the determinant, which is 1 for a rotation."""
    sheet.step(dict(zip(ENTRIES, found, strict=True)), "det", DET)
    return found


def axis_angle_to_matrix(
    sheet: Sheet, numbers: Sequence[float], _axes: str, degrees: bool, _wanted: bool  # noqa: FBT001
) -> Sequence[float]:
    """Apply Rodrigues' formula."""
    values = dict(zip(("ax", "ay", "az"), numbers, strict=False))
    sheet.heading("Axis and angle to matrix (Rodrigues)")
    sheet.say("R = c 1 + k v v^T + s (v x ..), v a unit axis, k = 1 - c.")
    unit_axis(sheet, values)
    angle(sheet, values, "angle", numbers[3], degrees=degrees)
    sine_and_cosine(sheet, values, "angle", "s", "c", half=False)
    sheet.step(values, "k", "1 - c")
    found = [sheet.step(values, name, formula) for name, formula in zip(ENTRIES, RODRIGUES, strict=True)]
    sheet.grid("R", "", "", [rows(found)])
    sheet.caveat(COLUMNS)
    return _checked(sheet, found)


def matrix_to_axis_angle(
    sheet: Sheet, numbers: Sequence[float], _axes: str, _degrees: bool, wanted: bool  # noqa: FBT001
) -> Sequence[float] | None:
    """Read the angle off the trace and the axis off the differences; None beside half a turn, where both vanish."""
    if _near_half_turn(rows(numbers)):
        return None
    values = dict(zip(ENTRIES, nearest_rotation(sheet, numbers), strict=True))
    sheet.heading("Matrix to axis and angle, by the trace")
    sheet.say("tr = 1 + 2 cos(angle); the differences across the diagonal are 2 v sin(angle).")
    sheet.step(values, "tr", "r11 + r22 + r33")
    for name, formula in (("dx", "r32 - r23"), ("dy", "r13 - r31"), ("dz", "r21 - r12")):
        sheet.step(values, name, formula)
    if not (values["dx"] or values["dy"] or values["dz"]):
        sheet.say("No rotation: the angle is 0, any axis will do, and x is taken.")
        return 1.0, 0.0, 0.0, 0.0
    direction(sheet, values, ("dx", "dy", "dz"), ("vx", "vy", "vz"), "s")
    sheet.step(values, "angle", "atan2(s, tr - 1)", RADIANS)
    sheet.caveat(NOT_ACOS)
    found = to_degrees(sheet, values, "angle")[0] if wanted else values["angle"]
    return values["vx"], values["vy"], values["vz"], found


def _near_half_turn(matrix: Matrix) -> bool:
    (r11, r12, r13), (r21, r22, r23), (r31, r32, r33) = matrix
    return r11 + r22 + r33 < 1.0 and max(abs(r32 - r23), abs(r13 - r31), abs(r21 - r12)) < NEAR_HALF_TURN


SHORT: dict[tuple[str, str], Way] = {
    ("rpy", "matrix"): rpy_to_matrix,
    ("euler", "matrix"): euler_to_matrix,
    ("axis_angle", "matrix"): axis_angle_to_matrix,
    ("matrix", "axis_angle"): matrix_to_axis_angle,
}
