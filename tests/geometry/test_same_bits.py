"""One item alone, as floats, and among others, as an array of any length, give the same numbers to the bit."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import samples

from frametool.geometry import arrays, earth, euler, floats, matrix, quaternion, rigid
from frametool.geometry import earth as mercator
from frametool.geometry.representations import ROTATIONS, notation
from frametool.geometry.transform import Rotation, Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Row = Sequence[float]

DRAWN = np.random.default_rng(9)
QUATERNIONS = samples.quaternions(200)
OTHERS = [QUATERNIONS[place] for place in DRAWN.permutation(len(QUATERNIONS)).tolist()]
LENGTHS = (0.0, -0.0, 5e-324, 1e-310, 1e-170, 1e-3, 1.0, 1e9, 1e160, 1e300)
SHIFTS = [*DRAWN.normal(size=(300, 3)).tolist(), *itertools.product(LENGTHS, repeat=3)]
ANGLES = [
    *(sign * (k * math.pi / 4 + off) for k in range(9) for off in (0.0, 1e-16, -1e-8, 0.1) for sign in (1.0, -1.0)),
    *DRAWN.uniform(-7.0, 7.0, 300).tolist(), *(10.0 ** DRAWN.uniform(-320, 300, 200)).tolist(),
    0.0, -0.0, 5e-324, 1e6, 4.194304e6, 4.2e6, 1e8, -1e22, 1e308,
]  # fmt: skip
DEGREES = [
    *(45.0 * k for k in range(-20, 21)),
    *(90.0 * k + 1e-13 for k in range(9)),
    *ANGLES,
    *(57.0 * a for a in ANGLES[:300]),
]
MANY_FRACTIONS = [[fraction] for fraction in (0.0, 1.0, 0.5, 1e-9, 0.3, -0.5, 1.5, 0.9999999999999999)] * 200
MATRICES = [
    [float(part) for part in (Rotation.of(*row).as_matrix() * scale + noise * DRAWN.normal(size=(3, 3))).reshape(-1)]
    for row in QUATERNIONS[:60]
    for scale, noise in ((1.0, 0.0), (1.0, 1e-15), (1.0, 1e-7), (1.0, 0.05), (1e-3, 1e-5), (1e100, 0.0))
]


def bits(rows: Any) -> list[list[int]]:
    """Name the bits of rows of numbers; all NaN are one."""
    numbers = np.array(rows, np.float64).reshape(len(rows), -1)
    found: list[list[int]] = np.where(np.isnan(numbers), np.nan, numbers).view(np.int64).tolist()
    return found


def assert_same(kernel: Callable[..., Any], rows: Sequence[Row], *, xp: bool = True) -> None:
    """Compare a kernel on floats with itself on arrays: all rows, in another order, in blocks of every length."""
    alone = bits([np.atleast_1d(kernel(*row, *([floats] * xp))).tolist() for row in rows])
    for places in (range(len(rows)), DRAWN.permutation(len(rows)).tolist(), *cuts(len(rows))):
        columns = np.array([rows[place] for place in places]).T
        with np.errstate(all="ignore"):
            results = kernel(*columns, *([arrays] * xp))
        together = np.broadcast_arrays(columns[0], *(results if isinstance(results, tuple) else (results,)))[1:]
        assert bits(np.array(together).T) == [alone[place] for place in places]


def cuts(count: int) -> list[list[int]]:
    """Choose blocks of rows: each of the first alone, in twos and threes, and some longer ones."""
    return [
        list(range(start, min(start + size, count)))
        for size in (1, 2, 3, 17)
        for start in range(0, min(count, 60), size)
    ]


def joined(*parts: Sequence[Row]) -> list[list[float]]:
    """Put rows side by side, as long as the shortest list."""
    return [[number for row in rows for number in row] for rows in zip(*parts, strict=False)]


def poses(rotations: Sequence[Row]) -> list[list[float]]:
    """Join rotations with shifts of moderate length."""
    return joined(DRAWN.normal(size=(len(rotations), 3)).tolist(), rotations)


@pytest.mark.parametrize("half_sincos", [floats.half_sincos, floats.half_sincos_deg])
def test_sines_and_cosines(half_sincos: Callable[..., Any]) -> None:
    assert_same(half_sincos, [[angle] for angle in (ANGLES if half_sincos is floats.half_sincos else DEGREES)])


def test_arc_tangents() -> None:
    turned = [(math.sin(angle), math.cos(angle)) for angle in ANGLES]
    assert_same(floats.incline, [(rise, abs(run)) for rise, run in turned])
    assert_same(floats.bearing, [(rise + 0.0, run, math.sqrt(rise * rise + run * run)) for rise, run in turned])


@pytest.mark.parametrize("axes", sorted(euler.AXES))
@pytest.mark.parametrize("unit", ["_deg", "_rad"])
def test_all_24_conventions(axes: str, unit: str) -> None:
    form = notation(f"euler{unit}:{axes}")
    drawn = DRAWN.permutation(np.array(DEGREES if unit == "_deg" else ANGLES))
    angles = [*samples.euler_angles(axes), *(drawn[: len(drawn) // 3 * 3].reshape(-1, 3).tolist())]
    assert_same(lambda *given: form.to_quaternion(given[:-1], given[-1]), angles)
    rotations = [form.to_quaternion(tuple(row), floats) for row in angles]
    assert_same(form.from_quaternion, [*QUATERNIONS, *rotations])


@pytest.mark.parametrize("name", [name for name in ROTATIONS if name != "euler"])
@pytest.mark.parametrize("unit", ["_deg", "_rad"])
def test_all_representations(name: str, unit: str) -> None:
    form = notation(name + unit * bool(ROTATIONS[name].angles))
    assert_same(form.from_quaternion, QUATERNIONS)
    rows: list[Row] = [form.from_quaternion(*row, floats) for row in QUATERNIONS]
    if name in ("rotvec", "rpy", "mrp"):
        rows += [row for row in SHIFTS if sum(part * part for part in row) < math.inf]
    if name == "axis_angle":
        rows += [[*axis, angle] for axis, angle in zip(SHIFTS, DEGREES, strict=False) if any(axis)]
    if name == "matrix":
        rows += MATRICES
    assert_same(lambda *given: form.to_quaternion(given[:-1], given[-1]), rows)


PAIRS = joined(QUATERNIONS, OTHERS)
NEAR = [[*row, *(part + gap for part, gap in zip(row, (1e-9, -2e-9, 1e-10, 0.0), strict=True))] for row in QUATERNIONS]
POSES, WAYS = poses(QUATERNIONS), joined(poses(QUATERNIONS), poses(OTHERS))
TWISTS = joined(SHIFTS, samples.rotation_vectors())
PLACES = [
    *zip(DRAWN.uniform(-90, 90, 3000).tolist(), DRAWN.uniform(-180, 360, 3000).tolist(), DRAWN.uniform(-1e4, 1e7, 3000).tolist(), strict=True),
    *itertools.product((-95.0, -90.0, -0.0, 45.0, 84.0, 90.0), (-200.0, -180.0, -0.0, 1e-300, 180.0, 360.0), (-1e7, -0.0, 1e9)),
]  # fmt: skip
FAR_PLACES = [*SHIFTS, *([1e7 * part for part in row] for row in SHIFTS), *itertools.product((-7e6, -0.0, 1e-9, 6e5), repeat=3)]
ZONED = [
    [float(zone * side), lat, 6.0 * zone - 183.0 + aside]
    for zone, side, (lat, lon, _) in zip(DRAWN.integers(1, 61, 3000).tolist(), itertools.cycle((1, -1)), PLACES, strict=False)
    for aside in (lon % 60.0 - 29.0,)
]
POSITIONS = [
    [row[0], easting, northing]
    for row, easting, northing in zip(ZONED, DRAWN.uniform(-3e6, 4e6, 3000).tolist(), DRAWN.uniform(-1e6, 11e6, 3000).tolist(), strict=True)
]
KERNELS: dict[str, tuple[Callable[..., Any], Sequence[Row]]] = {
    "angle": (quaternion.angle, QUATERNIONS),
    "canonical": (quaternion.from_quaternion, [*QUATERNIONS, *(tuple(-part for part in row) for row in QUATERNIONS)]),
    "unit": (quaternion.unit, [row[4:] for row in NEAR]),
    "normalized": (quaternion.normalized, [[size * part for part in row] for row in OTHERS for size in LENGTHS[3:]]),
    "repaired": (quaternion.repaired, [[size * part for part in row] for row in OTHERS for size in (1.0, 1.0005, 2.0)]),
    "deviation": (
        quaternion.deviation,
        [[size * part for part in row] for row in OTHERS for size in (*LENGTHS, 1.0005)],
    ),
    "distance": (quaternion.distance, [*PAIRS, *NEAR]),
    "slerp": (quaternion.slerp, joined([*PAIRS, *NEAR], MANY_FRACTIONS)),
    "between": (quaternion.between, [[*a, *b] for a, b in zip(SHIFTS, SHIFTS[7:], strict=False) if any(a) and any(b)]),
    "direction": (quaternion.direction, SHIFTS),
    "magnitude": (quaternion.magnitude, SHIFTS),
    "matrix deviation": (matrix.deviation, [*MATRICES, [0.0] * 9, [1.0] * 9, [-1.0, 0, 0, 0, 1, 0, 0, 0, 1]]),
    "nearest": (matrix.nearest, MATRICES),
    "six_d deviation": (matrix.six_d_deviation, [[*row[0::3], *row[1::3]] for row in MATRICES]),
    "exp": (rigid.exp, TWISTS),
    "log": (rigid.log, POSES),
    "extent": (rigid.extent, POSES),
    "rigid distance": (rigid.distance, WAYS),
    "interpolate": (rigid.interpolate, joined(WAYS, MANY_FRACTIONS)),
    "prepare": (rigid.prepare, WAYS),
    "ecef": (earth.ecef, PLACES),
    "lla": (earth.lla, FAR_PLACES),
    "lla of places": (lambda *place: earth.lla(*earth.ecef(*place), place[-1]), PLACES),
    "enu": (lambda lat, lon, alt, xp: earth.pose(lat, lon, alt, "enu", xp), PLACES),
    "ned": (lambda lat, lon, alt, xp: earth.pose(lat, lon, alt, "ned", xp), PLACES),
    "grid": (lambda zone, lat, lon, xp: mercator.grid_pose(zone, lat, lon, 0.5 * lat, xp), ZONED),
    "zone": (lambda lat, lon, _, xp: mercator.standard_zone(lat, lon, xp), PLACES),
    "utm": (mercator.utm, ZONED),
    "utm back": (mercator.lat_lon, POSITIONS),
}


@pytest.mark.parametrize("name", KERNELS)
def test_every_kernel_with_functions(name: str) -> None:
    assert_same(*KERNELS[name])


ARITHMETIC: dict[str, tuple[Callable[..., Any], Sequence[Row]]] = {
    "compose": (quaternion.compose, PAIRS),
    "rotate": (quaternion.rotate, joined(QUATERNIONS, SHIFTS)),
    "rigid compose": (rigid.compose, WAYS),
    "inverse": (rigid.inverse, POSES),
    "relative": (rigid.relative, WAYS),
    "apply": (rigid.apply, joined(POSES, SHIFTS)),
}


@pytest.mark.parametrize("name", ARITHMETIC)
def test_every_kernel_of_arithmetic_alone(name: str) -> None:
    kernel, rows = ARITHMETIC[name]
    assert_same(kernel, rows, xp=False)


def test_a_way_walked_at_many_fractions() -> None:
    prepare: Callable[..., Any] = rigid.prepare
    ways = [[*way[:7], *prepare(*way, floats)] for way in WAYS]
    within = [fraction for fraction in MANY_FRACTIONS if 0.0 <= fraction[0] <= 1.0]
    assert_same(rigid.along, joined(ways, within * 2))


def test_a_way_prepared_once_is_the_slerp_of_its_ends() -> None:
    prepare: Callable[..., Any] = rigid.prepare
    unit: Callable[..., Any] = quaternion.unit
    slerp: Callable[..., Any] = quaternion.slerp
    along: Callable[..., Any] = rigid.along
    for way, (fraction,) in zip(WAYS, MANY_FRACTIONS * 2, strict=False):
        if 0.0 < fraction < 1.0:
            pose: Any = (*way[:7], *prepare(*way, floats))
            walked = along(*pose, fraction, floats)
            assert unit(*walked[3:], floats) == slerp(*way[3:7], *way[10:], fraction, floats)


SPECIAL: Any = np.array([0.0, -0.0, 1.5, -1.5, math.inf, -math.inf, math.nan, 5e-324, -1e308])


@pytest.mark.parametrize("yes", [SPECIAL, 2.0, -0.0])
@pytest.mark.parametrize("no", [SPECIAL[::-1], math.inf, 0.0])
def test_choices_by_bits_are_those_of_numpy(yes: Any, no: Any) -> None:
    conditions: list[Any] = [SPECIAL > 0.0, SPECIAL < 9.0, np.zeros(9, bool), np.ones(9, bool), np.True_, True]
    for condition in conditions:
        expected = np.broadcast_to(np.where(condition, yes, no), np.shape(arrays.where(condition, yes, no)))
        for found in (arrays.where(condition, yes, no), arrays.where(arrays.mask(condition), yes, no)):
            assert np.array_equal(np.array(found).view(np.int64), np.array(expected, np.float64).view(np.int64))


def test_signs_and_guards_by_bits_are_those_of_floats() -> None:
    for size in (0.0, 1.0, math.pi, math.inf):
        assert bits(np.array([arrays.copysign(size, SPECIAL)])) == bits([[math.copysign(size, x) for x in SPECIAL]])
        assert bits([arrays.copysign(np.full(9, size), SPECIAL)]) == bits([[math.copysign(size, x) for x in SPECIAL]])
    finite = SPECIAL[np.isfinite(SPECIAL)]
    for centre in (0.0, 1.0):
        assert arrays.furthest(finite, centre) == max(floats.furthest(x, centre) for x in finite.tolist())
        assert math.isnan(arrays.furthest(SPECIAL, centre))
        assert arrays.furthest(np.empty(0), centre) == 0.0
    assert arrays.least(finite) == -1e308
    assert math.isnan(arrays.least(SPECIAL))


def test_neighbours_that_are_no_angles_or_far_ones_change_nothing() -> None:
    alone = bits([floats.half_sincos(angle, floats) for angle in (0.3, -0.0)])
    for odd in (math.nan, math.inf, 1e30):
        with np.errstate(invalid="ignore"):
            among = np.array(floats.half_sincos(np.array([0.3, odd, -0.0]), arrays)).T
        assert bits(among)[::2] == alone


def test_angles_of_millions_of_turns_keep_their_digits() -> None:
    from mpmath import mp, mpf

    with mp.workdps(400):
        for angle in (1e8, 1e15, -1e22, 2.0**1000, 4e307, 6381956970095103.0 * 2.0**797):
            rest, odd = floats.reduced_exactly(angle)
            turns = mp.nint(mpf(angle) / (mp.pi / 2))
            assert rest == pytest.approx(float(mpf(angle) - turns * mp.pi / 2), rel=1e-15)
            assert odd == int(turns) % 2


WAYS_OF_VALUES: dict[str, Callable[[Any, Any], Any]] = {
    "rotation compose": lambda a, b: (a.rotation @ b.rotation).as_quaternion(),
    "as rotvec": lambda a, _: a.rotation.as_rotvec(),
    "as axis and angle": lambda a, _: a.rotation.as_axis_angle()[1],
    "as euler": lambda a, _: a.rotation.as_euler("rzxz"),
    "from rpy": lambda a, _: Rotation.from_rpy(a.xyz).as_quaternion(),
    "from rotvec": lambda a, _: Rotation.from_rotvec(a.xyz).as_quaternion(),
    "from matrix": lambda a, _: Rotation.from_matrix(a.rotation.as_matrix()).as_quaternion(),
    "slerp": lambda a, b: a.rotation.slerp(b.rotation, 0.3).as_quaternion(),
    "angle": lambda a, _: a.rotation.angle(),
    "distance": lambda a, b: a.distance(b)[1],
    "metres": lambda a, b: a.distance(b)[0],
    "log": lambda a, _: a.log(),
    "exp": lambda a, _: Transform.exp(a.log()).xyzw,
    "matrix": lambda a, b: (a @ b.inverse()).as_matrix(),
    "relative": lambda a, b: a.relative(b).xyz,
    "apply": lambda a, b: a.apply(b.xyz),
    "interpolate": lambda a, b: a.interpolate(b, 0.7).xyzw,
    "apply twist": lambda a, b: a.apply_twist(b.log()),
    "apply wrench": lambda a, b: a.apply_wrench(b.log()),
}


@pytest.mark.parametrize("name", WAYS_OF_VALUES)
def test_values_alone_and_in_arrays_longer_than_a_block(name: str) -> None:
    act = WAYS_OF_VALUES[name]
    many, others = Transform.random(arrays.BLOCK + 3, seed=1), Transform.random(arrays.BLOCK + 3, seed=2)
    together = act(many, others)
    places = [*range(40), *range(arrays.BLOCK - 20, arrays.BLOCK + 3)]
    assert bits([act(many[place], others[place]) for place in places]) == bits(together[places])


def test_one_transform_moves_many_points_as_it_moves_each() -> None:
    one, points = Transform.random(seed=3), Transform.random(200, seed=4).xyz
    assert bits([one.apply(point) for point in points]) == bits(one.apply(points))
    assert bits([one.apply_vector(point) for point in points]) == bits(one.apply_vector(points))
