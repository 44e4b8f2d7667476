"""Covariances of poses, points, twists and wrenches, to first order: transformation, composition and inversion.

Of a pose: over (x, y, z, rotation about X, Y, Z), metres and radians, along the fixed axes of its parent, as in ROS:
t + d[:3], Exp(d[3:]) R.  Entries are row-major, 36 of a pose and 9 of a point, floats or arrays; None is exact.
Results are exactly symmetric: entries below the diagonal are copies of those above it.
Source: Barfoot 2017, section 7.3; in the parent's axes both Jacobians are a lever arm and a rotation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import ValueInvalid, warn
from frametool.geometry import quaternion

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.geometry import Array, Components, Number, Rigid

    Entries: TypeAlias = Sequence[Any]
    Rows: TypeAlias = list[list[Any]]

POSE, POINT = 36, 9  # entries
INFINITE = float("inf")
ORDER = {POSE: "x y z, turns about X Y Z", POINT: "x y z"}
UNKNOWN = -1.0  # the first entry of an unknown covariance in ROS
ASYMMETRY = 1e-6  # of the root of the product of the two variances
NEGATIVE = 1e-9  # of the largest eigenvalue
WIDE = 0.2  # radians
WIDE_RULE = "wide"
FIRST_ORDER = "sigma of a turn is {:.2g} rad: the first order is a few per cent off above 0.2"


def propagate(jacobian: Rows, entries: Entries) -> Components:
    """Return J A J'; one item gives the same bits as a row of an array."""
    import numpy as np

    flat = [number for row in jacobian for number in row]
    whole = np.stack(np.broadcast_arrays(*flat, *entries), axis=-1)
    side = len(jacobian[0])
    j, a = (
        part.reshape(*whole.shape[:-1], part.shape[-1] // side, side)
        for part in np.split(whole, [len(flat)], axis=-1)
    )
    with np.errstate(all="ignore"):  # values that are not finite are refused when they are written
        found = _product(_product(j, a), np.swapaxes(j, -1, -2))
    rows = found.tolist() if found.ndim == 2 else np.moveaxis(found, (-2, -1), (0, 1))
    return symmetric([number for row in rows for number in row])


def _product(a: Array, b: Array) -> Array:
    """Multiply matrices, adding in a fixed order: that of BLAS depends on the processor."""
    return sum(a[..., :, at, None] * b[..., None, at, :] for at in range(a.shape[-1]))  # type: ignore[return-value]


def propagate_compose(a: Rigid, of_a: Entries | None, b: Rigid, of_b: Entries | None) -> Components | None:
    """Return the covariance of a_from_c from those of a_from_b and b_from_c: J A J' + R B R', J = adjoint(R t_b)."""
    arm = quaternion.rotate(*a[3:], *b[:3])
    return total(of_a and propagate(adjoint(*arm), of_a), of_b and rotate_covariance(of_b, *a[3:]))


def propagate_inverse(pose: Rigid, entries: Entries) -> Components:
    """Return the covariance of b_from_a from that of a_from_b: J A J', J = [R', R'[t]x; 0, R']."""
    x, y, z, *rotation = pose
    back = quaternion.conjugate(*rotation)
    crossed = [quaternion.rotate(*back, *each) for each in ((x - x, z, -y), (-z, x - x, x), (y, -x, x - x))]
    rows = _rows(*back)
    upper = [row + list(block) for row, block in zip(rows, zip(*crossed, strict=True), strict=True)]
    return propagate(upper + [[0.0] * 3 + row for row in rows], entries)


def of_three(
    pose: Rigid, entries: Entries | None, three: Components, own: Entries | None, *, is_vector: bool = False
) -> Components | None:
    """Return the 3 x 3 covariance of a transformed point, [I, -[R p]x] A [..]' + R C R'; of a vector 0 instead of I."""
    jacobian = adjoint(*quaternion.rotate(*pose[3:], *three))[:3]
    jacobian = [[0.0] * 3 + row[3:] for row in jacobian] if is_vector else jacobian
    return total(entries and propagate(jacobian, entries), own and rotate_covariance(own, *pose[3:]))


def adjoint(x: Number, y: Number, z: Number) -> Rows:
    """Return [I, -[v]x; 0, I]: the effect of a pose's d on a point fixed to the frame, at v from its origin."""
    identity = [[float(i == j) for j in range(6)] for i in range(6)]
    identity[0][4:], identity[1][3:], identity[2][3:5] = [z, -y], [-z, 0.0, x], [y, -x]
    return identity


def rotate_covariance(entries: Entries, x: Number, y: Number, z: Number, w: Number) -> Components:
    """Return each 3 x 3 block C as R C R'."""
    rows, zeros = _rows(x, y, z, w), [0.0] * 3
    whole = rows if len(entries) == POINT else [row + zeros for row in rows] + [zeros + row for row in rows]
    return propagate(whole, entries)


def _rows(x: Number, y: Number, z: Number, w: Number) -> Rows:
    nine = quaternion.to_matrix(x, y, z, w)
    return [list(nine[at : at + 3]) for at in (0, 3, 6)]


def of_moved(move: Callable[..., Components], pose: Rigid, entries: Entries) -> Components:
    """Return the covariance of a twist or wrench that `move` transforms by an exact pose."""
    columns = [move(*pose, *[float(i == j) for j in range(6)]) for i in range(6)]
    return propagate([list(row) for row in zip(*columns, strict=True)], entries)


def total(a: Entries | None, b: Entries | None) -> Components | None:
    """Return the covariance of a sum of independent quantities."""
    if a is None or b is None:
        only = b if a is None else a
        return None if only is None else tuple(only)
    return tuple(x + y for x, y in zip(a, b, strict=True))


def symmetric(entries: Entries) -> Components:
    """Return the entries with those below the diagonal copied from above it."""
    side = round(len(entries) ** 0.5)
    return tuple(entries[side * min(i, j) + max(i, j)] for i in range(side) for j in range(side))


# --- checks: is it a covariance, and is it small enough for the first order? ---


def taken(numbers: Any, size: int = POSE, *, many: bool = False) -> Components:
    """Check a covariance passed from Python, numbers or rows of them, and return its entries; () for None.

    many: arrays (.., side, side) are allowed too, and give columns
    """
    if numbers is None:
        return ()
    import numpy as np

    side = round(size**0.5)
    try:
        array = np.asarray(numbers, np.float64)
    except (TypeError, ValueError):
        array = np.empty(())
    many = many and array.ndim > 2
    if many and array.shape[-2:] != (side, side):
        raise ValueInvalid(f"covariances: expected shape (..., {side}, {side}), got {array.shape}")
    if array.ndim == 0 or not (many or array.shape[1:] in ((), (1,), (side,))):
        raise ValueInvalid(f"covariance must be {size} numbers or {side} rows of {side}")
    if not many and array.size != size:
        raise ValueInvalid(wrong_count(array.size, (size,)))
    rows = array.reshape(-1, size)
    wrong = problems(rows)
    for row, column in np.argwhere(~np.isfinite(rows)).tolist()[::-1]:
        wrong[row] = f"covariance has {rows[row, column]} in it; every number must be finite"
    for row in sorted(wrong)[:1]:
        raise ValueInvalid(f"row {row}: {wrong[row]}" if many else wrong[row])
    columns = rows.T.reshape(size, *array.shape[:-2]) if many else rows[0].tolist()
    return tuple(columns)


def wrong_count(count: int, sizes: Sequence[int]) -> str:
    """Return a message with the number of entries and the numbers accepted."""
    each = [f"{size} are needed ({size**0.5:g}x{size**0.5:g}, row-major: {ORDER[size]})" for size in sizes]
    return f"covariance has {count} number{'s' * (count != 1)}; {' or '.join(each)}"


def check(entries: Sequence[float]) -> None:
    """Raise ValueInvalid unless these 36 or 9 numbers are a covariance: known, symmetric, not negative."""
    import numpy as np

    if reason := problems(np.array([entries])).get(0):
        raise ValueInvalid(reason)


def problems(rows: Array) -> dict[int, str]:
    """Return what is wrong with covariances (n, 36) or (n, 9), by row; values must be finite."""
    import numpy as np

    side = round(rows.shape[1] ** 0.5)
    whole = np.where(np.isfinite(rows).all(axis=1, keepdims=True), rows, 0.0).reshape(-1, side, side)
    roots = np.sqrt(abs(np.diagonal(whole, axis1=1, axis2=2)))
    skewed: Any = abs(whole - whole.swapaxes(1, 2)) > ASYMMETRY * roots[:, :, None] * roots[:, None, :]
    wrong: Any = skewed.any((1, 2)) | (whole[:, 0, 0] == UNKNOWN)
    values = np.zeros((len(whole), side))
    doubtful = ~wrong & (abs(whole).sum(2) > 2.0 * np.diagonal(whole, axis1=1, axis2=2)).any(1)  # Gershgorin's circles
    values[doubtful] = np.linalg.eigvalsh(whole[doubtful])
    found = {}
    for row in np.flatnonzero(wrong | (values[:, 0] < -NEGATIVE * abs(values[:, -1]))).tolist():
        if whole[row, 0, 0] == UNKNOWN:
            found[row] = "covariance[0] is -1: 'unknown' in ROS; leave the covariance out"
        elif wrong[row]:
            i, j = next((i, j) for i, j in np.argwhere(skewed[row]).tolist() if j < i)
            said = f"[{j}][{i}] is {short(whole[row, j, i])}, [{i}][{j}] is {short(whole[row, i, j])}"
            found[row] = f"covariance is not symmetric: {said}"
        else:
            found[row] = f"covariance is not positive: its smallest eigenvalue is {short(values[row, 0])}"
    return found


def short(value: float) -> str:
    """Format a number for a message: six digits, and 1e-4 rather than 0.0001 or 1e-04."""
    if 1e-3 <= abs(value) < 1e6 or not value:
        return f"{value:g}"
    digits, _, exponent = f"{value:.5e}".partition("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"


def widest_turn(entries: Sequence[float]) -> float:
    """Return the largest sigma of a rotation about any axis, radians; 0 if it is certainly below `WIDE`."""
    if len(entries) != 36 or entries[21] + entries[28] + entries[35] <= WIDE * WIDE:
        return 0.0
    import numpy as np

    whole = np.reshape(entries, (6, 6))
    return float(np.sqrt(max(np.linalg.eigvalsh(whole[3:, 3:])[-1], 0.0)))


def doubt(entries: Sequence[float]) -> str:
    """Return a warning if a rotation is too uncertain for the first order, else ""."""
    width = widest_turn(entries)
    return FIRST_ORDER.format(width) if width > WIDE else ""


def warn_if_wide(found: Iterable[Sequence[float]]) -> None:
    """Warn once if a rotation is so uncertain that the first order is off by a few per cent."""
    if message := doubt(max(found, key=widest_turn, default=())):
        warn(message, rule=WIDE_RULE)
