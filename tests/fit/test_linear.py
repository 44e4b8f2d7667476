"""Sums and matrices of our own order: right, and the same bits whatever the processor and the version of numpy."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from fractions import Fraction
from itertools import pairwise
from operator import mul
from typing import TYPE_CHECKING

import numpy as np
import pytest
import samples
from machine_output import ROOT

from frametool.fit import linear
from frametool.geometry.rotation import Rotation

if TYPE_CHECKING:
    from frametool.geometry.types import Array

DRAWN = np.random.default_rng(4)
EPS = 2.0**-52
SIZES = [1, 2, 3, 6, 12, 24, 25, 26, 60, 131]
FITS = [
    "solve|examples/measurements.yaml|-f|json",
    "solve|--hand-eye|examples/gripper.csv|examples/target.csv|-f|json",
    "solve|--points|examples/points_a.csv|examples/points_b.csv|--scale|-f|json",
    "mean|examples/truth.tum|--robust|-f|json",
    "align|examples/truth.tum|examples/mono.tum|--offset|auto|--align|sim3|-f|tum",
    *(f"compare|examples/truth.tum|examples/odometry.tum|--mount|auto|--align|{kind}|-f|json" for kind in ("none", "yaw", "se3")),
    "compare|examples/truth.tum|examples/mono.tum|--as|evo|--max-diff|1|--align|sim3|-f|json",
]


def positive(size: int) -> Array:
    """Draw a symmetric positive definite matrix whose rows differ in size by up to 1e12."""
    drawn = DRAWN.normal(size=(size, size + 3))
    units = 10.0 ** DRAWN.uniform(-6, 6, size)
    return drawn @ drawn.T * np.outer(units, units)


@pytest.mark.parametrize("size", SIZES)
def test_an_inverse_undoes_its_matrix_however_its_units_differ(size: int) -> None:
    matrix = positive(size)
    inverse = linear.inverse(matrix)
    units = np.sqrt(np.diagonal(matrix))
    assert np.allclose((matrix @ inverse) * units / units[:, None], np.eye(size), rtol=0, atol=1e-6)
    assert np.allclose(inverse, inverse.T, rtol=1e-6, atol=0)


@pytest.mark.parametrize("size", SIZES[:-4])
def test_what_is_solved_for_is_a_solution(size: int) -> None:
    matrix, right = positive(size), DRAWN.normal(size=(size, 3))
    found = linear.solved(matrix, right)
    assert np.all(abs(matrix @ found - right) <= 20 * size * EPS * (abs(matrix) @ abs(found) + abs(right)))


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]], [[np.nan]]])
def test_what_has_no_inverse_is_an_error(matrix: list[list[float]]) -> None:
    with pytest.raises(linear.NotSettled):
        linear.inverse(np.array(matrix))


@pytest.mark.parametrize(("n", "k", "m"), [(3, 3, 3), (6, 60, 1), (1, 1, 7), (5, 0, 2), (25, 26, 27), (3, 300, 2)])
def test_a_product_is_right_to_the_last_digits(n: int, k: int, m: int) -> None:
    a, b = DRAWN.normal(size=(n, k)) * 10.0 ** DRAWN.uniform(-8, 8, (n, k)), DRAWN.normal(size=(k, m))
    columns = b.T.tolist()
    exact = np.array([[float(sum(map(mul, map(Fraction, row), map(Fraction, column)))) for column in columns] for row in a.tolist()])
    largest = np.outer(abs(a).max(1, initial=0.0), abs(b).max(0, initial=0.0))
    assert np.all(abs(linear.product(a, b) - exact) <= k * EPS * (abs(a) @ abs(b)))
    assert k == 0 or np.all(abs(linear.large_product(a, b) - exact) <= 2 * EPS * (abs(exact) + largest))


def test_a_large_product_does_not_ask_in_which_order_it_is_added() -> None:
    a, b = DRAWN.normal(size=(40, 300)), DRAWN.normal(size=(300, 40))
    order = DRAWN.permutation(300)
    assert np.array_equal(linear.large_product(a, b), linear.large_product(a[:, order], b[order]))
    assert not np.array_equal(a @ b, a[:, order] @ b[order])


def test_stacks_of_matrices_and_vectors_are_multiplied_one_by_one() -> None:
    a, b = DRAWN.normal(size=(2, 4, 3, 3)), DRAWN.normal(size=(4, 3, 3))
    assert np.allclose(linear.product(a, b), a @ b)
    assert np.allclose(linear.applied(a, b[..., 0]), (a @ b)[..., 0])
    rows = DRAWN.normal(size=(1001, 3))
    assert np.allclose(linear.crossed(rows, rows), rows.T @ rows)
    assert linear.total(rows[:, 0]) == pytest.approx(rows[:, 0].sum())
    assert linear.total(rows[:0, 0]) == 0.0
    assert linear.summed(rows[:0]).tolist() == [0.0] * 3


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.ones((3, 3)), np.diag([3.0, 1e-300, 2.0]), positive(3), positive(5)])
def test_eigenvalues_ascend_and_rebuild_their_matrix(matrix: Array) -> None:
    values, vectors = linear.eigen(matrix)
    assert all(a <= b for a, b in pairwise(values.tolist()))
    assert np.allclose(vectors.T @ vectors, np.eye(len(matrix)), rtol=0, atol=1e-14)
    assert np.allclose(vectors * values @ vectors.T, matrix, rtol=0, atol=1e-13 * abs(matrix).max())


@pytest.mark.parametrize("xyzw", samples.quaternions(20))
def test_a_turn_between_vectors_is_found(xyzw: list[float]) -> None:
    turn, source = Rotation.of(*xyzw), DRAWN.normal(size=(9, 3))
    assert linear.turn_between(source, turn.apply(source)).is_close(turn, angle=1e-14)
    assert linear.turn_between(source, -turn.apply(source)).as_matrix().shape == (3, 3)  # a mirror image: a turn all the same


def test_vectors_that_say_nothing_of_a_turn_have_one() -> None:
    assert np.isfinite(linear.turn_between(np.zeros((3, 3)), np.ones((3, 3))).as_quaternion()).all()


ELSEWHERE_OTHERWISE = re.compile(
    r"np\.(?:linalg\.(?:inv|solve|lstsq|qr|eigh?|det)\b|linalg\.svd\((?!.*compute_uv=False)|(?:einsum|average|inner|dot|vdot|tensordot)\b"
    r"|(?:sin|cos|tan|arcsin|arccos|arctan2?|exp|expm1|log|log1p|power|cbrt|sinh|cosh|tanh)\b)"
)


def test_no_number_comes_from_what_differs_between_processors() -> None:
    texts = {str(path): path.read_text(encoding="utf-8") for path in (ROOT / "frametool").rglob("*.py")}
    assert {path: found for path, text in texts.items() if (found := ELSEWHERE_OTHERWISE.findall(text))} == {}  # eigenvalues decide, and are not printed


def printed(**processor: str) -> bytes:
    """Return what the fits print in a process of their own."""
    code = "import sys; from frametool.cli import run; print([run(line.split('|')) for line in sys.argv[1:]])"
    environment = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "PATH": os.environ["PATH"], **processor}
    return subprocess.run([sys.executable, "-c", code, *FITS], cwd=ROOT, env=environment, capture_output=True, check=True).stdout


def test_a_processor_that_knows_less_prints_the_same_bytes() -> None:
    compiled = sys.modules.get("numpy._core._multiarray_umath") or sys.modules["numpy.core._multiarray_umath"]
    known = [name for name in compiled.__cpu_dispatch__ if compiled.__cpu_features__.get(name)]
    here = printed()
    assert here.rsplit(b"\n", 2)[1] == str([3, 3, 3, *[0] * (len(FITS) - 3)]).encode()
    assert printed(NPY_DISABLE_CPU_FEATURES=" ".join(known), OPENBLAS_CORETYPE="Prescott") == here
