"""Covariances of poses, points, twists and wrenches, to first order: how they move, compose and invert.

Of a pose: over (x, y, z, turns about X, Y, Z), metres and radians, along the fixed axes of its parent, as ROS has it:
t + d[:3], Exp(d[3:]) R.  Entries are row-major, 36 of a pose and 9 of a point, floats or arrays; None is exact.
Results are symmetric to the bit: what is below the diagonal is written from above it.
Source: Barfoot 2017, section 7.3; in the parent's axes both Jacobians are a lever arm and a turn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from frametool.errors import ValueInvalid, warn
from frametool.geometry import quaternion

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from frametool.geometry.types import Components, Number, Rigid

    Entries: TypeAlias = Sequence[Any]
    Rows: TypeAlias = list[list[Any]]

POSE, POINT = 36, 9  # entries
INFINITE = float("inf")
ORDER = {POSE: "x y z, turns about X Y Z", POINT: "x y z"}
UNKNOWN = -1.0  # as a covariance begins in ROS, where nothing is known
ASYMMETRY = 1e-6  # of the root of the product of the two variances
NEGATIVE = 1e-9  # of the largest eigenvalue
WIDE = 0.2  # radians
WIDE_RULE = "wide"
FIRST_ORDER = "sigma of a turn is {:.2g} rad: the first order is a few per cent off above 0.2"


def composed(a: Rigid, of_a: Entries | None, b: Rigid, of_b: Entries | None) -> Components | None:
    """Return the covariance of a_from_c of those of a_from_b and b_from_c: [I, -[R t_b]x; 0, I] A [..]' + R B R'."""
    arm = quaternion.rotate(*a[3:], *b[:3])
    return added(of_a and levered(of_a, *arm), of_b and turned(of_b, *a[3:]))


def inverted(pose: Rigid, entries: Entries) -> Components:
    """Return the covariance of b_from_a of that of a_from_b: R' [I, [t]x; 0, I] A [..]' R."""
    x, y, z, *rotation = pose
    return turned(levered(entries, -x, -y, -z), *quaternion.conjugate(*rotation))


def of_point(pose: Rigid, entries: Entries | None, point: Components, of_point: Entries | None) -> Components | None:
    """Return the 3 x 3 covariance of a moved point: [I, -[R p]x] A [..]' + R C R'."""
    arm = quaternion.rotate(*pose[3:], *point)
    moved = entries and blocks(levered(entries, *arm))[0]
    return added(moved and symmetric(moved), of_point and turned(of_point, *pose[3:]))


def of_vector(pose: Rigid, entries: Entries | None, vector: Components, of_vector: Entries | None) -> Components | None:
    """Return the 3 x 3 covariance of a turned vector: [R v]x A_rr [R v]x' + R C R'."""
    crossed = skew(*quaternion.rotate(*pose[3:], *vector))
    moved = entries and symmetric(product(product(crossed, blocks(entries)[2]), transposed(crossed)))
    return added(moved, of_vector and turned(of_vector, *pose[3:]))


def levered(entries: Entries, x: Number, y: Number, z: Number) -> Components:
    """Return J A J' with J = [I, -[v]x; 0, I]: that of a point fixed to the frame, at v from its origin."""
    placed, mixed, turning = blocks(entries)
    arm = transposed(skew(x, y, z))  # -[v]x
    across = plus(mixed, product(arm, turning))
    whole = plus(plus(placed, product(arm, transposed(mixed))), product(across, transposed(arm)))
    return of_blocks(whole, across, turning)


def turned(entries: Entries, x: Number, y: Number, z: Number, w: Number) -> Components:
    """Return each 3 x 3 block C as R C R'."""
    rows = _rows(quaternion.to_matrix(x, y, z, w))
    back = transposed(rows)
    if len(entries) == POINT:
        return symmetric(product(product(rows, _rows(entries)), back))
    placed, mixed, turning = (product(product(rows, block), back) for block in blocks(entries))
    return of_blocks(placed, mixed, turning)


def moved(move: Callable[..., Components], pose: Rigid, entries: Entries) -> Components:
    """Return that of a twist or wrench: A C A', where A is what `move` does by an exact pose."""
    columns = [list(move(*pose, *[float(i == j) for j in range(6)])) for i in range(6)]
    rows = [list(entries[6 * i : 6 * i + 6]) for i in range(6)]
    return symmetric(product(product(transposed(columns), rows), columns))


def added(a: Entries | None, b: Entries | None) -> Components | None:
    """Return the covariance of independent things together."""
    if a is None or b is None:
        only = b if a is None else a
        return None if only is None else tuple(only)
    return tuple(x + y for x, y in zip(a, b, strict=True))


def blocks(entries: Entries) -> tuple[Rows, Rows, Rows]:
    """Return that of the position, of position and turn, and of the turn."""
    rows = [list(entries[6 * i : 6 * i + 6]) for i in range(6)]
    return [row[:3] for row in rows[:3]], [row[3:] for row in rows[:3]], [row[3:] for row in rows[3:]]


def of_blocks(placed: Rows, mixed: Rows, turning: Rows) -> Components:
    """Join three blocks; the fourth is the second one's transpose."""
    upper = [[*a, *b] for a, b in zip(placed, mixed, strict=True)]
    lower = [[*a, *b] for a, b in zip(transposed(mixed), turning, strict=True)]
    return symmetric(upper + lower)


def symmetric(rows: Sequence[Sequence[Any]]) -> Components:
    """Return the entries of rows, those below the diagonal written from above it."""
    size = range(len(rows))
    return tuple(rows[min(i, j)][max(i, j)] for i in size for j in size)


def skew(x: Number, y: Number, z: Number) -> Rows:
    """Return [v]x: [v]x a = v x a."""
    zero = x - x
    return [[zero, -z, y], [z, zero, -x], [-y, x, zero]]


def product(a: Rows, b: Rows) -> Rows:
    """Multiply matrices, each sum in its order: `sum` compensates its rounding from Python 3.12 on."""
    columns = transposed(b)
    return [[_inner(row, column) for column in columns] for row in a]


def _inner(row: Sequence[Any], column: Sequence[Any]) -> Any:
    total = row[0] * column[0]
    for x, y in zip(row[1:], column[1:], strict=True):
        total = total + x * y
    return total


def plus(a: Rows, b: Rows) -> Rows:
    """Add matrices."""
    return [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(a, b, strict=True)]


def transposed(a: Rows) -> Rows:
    """Swap rows and columns."""
    return [list(column) for column in zip(*a, strict=True)]


def _rows(nine: Entries) -> Rows:
    return [list(nine[at : at + 3]) for at in (0, 3, 6)]


# --- what is a covariance, and which is too wide for the first order ---


def taken(given: Any, size: int = POSE) -> Components:
    """Return the entries of a covariance that Python gives, checked: numbers or rows of them, of numpy or not."""
    rows, side = given.tolist() if hasattr(given, "tolist") else given, round(size**0.5)
    try:
        listed = [row if hasattr(row, "__iter__") else (row,) for row in rows]
        entries = tuple(float(entry) for row in listed for entry in row)
    except (TypeError, ValueError):
        entries, listed = (), [()]
    if not {len(row) for row in listed} <= {1, side}:
        raise ValueInvalid(f"covariance must be {size} numbers or {side} rows of {side}")
    if len(entries) != size:
        raise ValueInvalid(wrong_count(len(entries), (size,)))
    if bad := [entry for entry in entries if not -INFINITE < entry < INFINITE]:
        raise ValueInvalid(f"covariance has {bad[0]} in it; every number must be finite")
    check(entries)
    return entries


def wrong_count(count: int, sizes: Sequence[int]) -> str:
    """Say how many numbers there are and how many it takes."""
    each = [f"{size} are needed ({size**0.5:g}x{size**0.5:g}, row-major: {ORDER[size]})" for size in sizes]
    return f"covariance has {count} number{'s' * (count != 1)}; {' or '.join(each)}"


def check(entries: Sequence[float]) -> None:
    """Raise ValueInvalid unless these 36 or 9 numbers are a covariance: known, symmetric, not negative."""
    size = 6 if len(entries) == 36 else 3
    if entries[0] == UNKNOWN:
        raise ValueInvalid("covariance[0] is -1: 'unknown' in ROS; leave the covariance out")
    for i in range(size):
        for j in range(i):
            upper, lower = entries[size * j + i], entries[size * i + j]
            both = entries[size * i + i] * entries[size * j + j]
            if upper != lower and abs(upper - lower) > ASYMMETRY * abs(both) ** 0.5:
                said = f"[{j}][{i}] is {short(upper)}, [{i}][{j}] is {short(lower)}"
                raise ValueInvalid(f"covariance is not symmetric: {said}")
    if not _is_positive(entries, size):
        import numpy as np

        least, *_, most = np.linalg.eigvalsh(np.reshape(entries, (size, size))).tolist()
        if least < -NEGATIVE * abs(most):
            raise ValueInvalid(f"covariance is not positive: its smallest eigenvalue is {short(least)}")


def _is_positive(entries: Sequence[float], size: int) -> bool:
    """Tell whether the factors of L D L' are all positive, or zero in a row of zeros; False says that one must look."""
    rows = [list(entries[size * i : size * i + size]) for i in range(size)]
    for k in range(size):
        if rows[k][k] == 0.0 and not any(rows[i][k] for i in range(k, size)):
            continue
        if not rows[k][k] > 0.0:
            return False
        for i in range(k + 1, size):
            factor = rows[i][k] / rows[k][k]
            for j in range(k + 1, size):
                rows[i][j] -= factor * rows[k][j]
    return True


def bad_rows(entries: Sequence[Any]) -> dict[int, str]:
    """Return what is wrong with the rows of columns of a covariance, by row."""
    import numpy as np

    size = 6 if len(entries) == 36 else 3
    rows = [[np.asarray(entries[size * i + j]) for j in range(size)] for i in range(size)]
    wrong = rows[0][0] == UNKNOWN
    for i in range(size):
        for j in range(i):
            both = np.sqrt(abs(rows[i][i] * rows[j][j]))
            wrong = wrong | (abs(rows[i][j] - rows[j][i]) > ASYMMETRY * both)
    suspect = wrong
    for k in range(size):  # as `_is_positive`, all rows at once
        below = [rows[i][k] for i in range(k + 1, size)]
        empty = (rows[k][k] == 0.0) & ~np.any([each != 0.0 for each in below], axis=0) if below else rows[k][k] == 0.0
        suspect = suspect | ~((rows[k][k] > 0.0) | empty)
        pivot = np.where(rows[k][k] > 0.0, rows[k][k], 1.0)
        for i in range(k + 1, size):
            factor = rows[i][k] / pivot
            rows[i] = [*rows[i][: k + 1], *(rows[i][j] - factor * rows[k][j] for j in range(k + 1, size))]
    doubtful = np.flatnonzero(suspect & ~wrong)
    whole = np.stack([np.asarray(entry)[doubtful] for entry in entries], -1).reshape(-1, size, size)
    values = np.linalg.eigvalsh(whole)
    negative = doubtful[values[:, 0] < -NEGATIVE * abs(values[:, -1])]
    found = {}
    for row in (*np.flatnonzero(wrong).tolist(), *negative.tolist()):
        try:
            check([float(entry[row]) for entry in entries])
        except ValueInvalid as error:
            found[row] = str(error)
    return found


def short(value: float) -> str:
    """Write a number for a message: six digits, and 1e-4 rather than 0.0001 or 1e-04."""
    if 1e-3 <= abs(value) < 1e6 or not value:
        return f"{value:g}"
    digits, _, exponent = f"{value:.5e}".partition("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"


def widest_turn(entries: Sequence[float]) -> float:
    """Return the largest sigma of a turn about any axis, radians; what is surely below `WIDE` counts as 0."""
    if len(entries) != 36 or entries[21] + entries[28] + entries[35] <= WIDE * WIDE:
        return 0.0
    import numpy as np

    whole = np.reshape(entries, (6, 6))
    return float(np.sqrt(max(np.linalg.eigvalsh(whole[3:, 3:])[-1], 0.0)))


def doubt(entries: Sequence[float]) -> str:
    """Say that a turn is too uncertain for the first order; "" where it is not."""
    width = widest_turn(entries)
    return FIRST_ORDER.format(width) if width > WIDE else ""


def warn_if_wide(found: Iterable[Sequence[float]]) -> None:
    """Warn once if a turn is so uncertain that the first order is off by some per cent."""
    if told := doubt(max(found, key=widest_turn, default=())):
        warn(told, rule=WIDE_RULE)
