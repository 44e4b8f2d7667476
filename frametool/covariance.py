"""Covariances of poses: composition, inversion and transformation of points, to first order.

    from frametool import Transform, covariance
    base_from_tool = Transform.from_arrays([0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0])
    turning = [[1e-4 * (i == j == 3) for j in range(6)] for i in range(6)]         # 0.01 rad about x of base
    covariance.point(base_from_tool, turning, [0.0, 1.0, 0.0])                     # 9 numbers: 1e-4 along z of base

A covariance is 36 numbers, row-major, or 6 rows, over (x, y, z, rotation about X, Y, Z), metres and radians, along the
fixed axes of the parent, as in ROS: t + d[:3], Exp(d[3:]) R.  None is exact.  All inputs are assumed independent.
For one transform results are lists, of 36 numbers or of the 9 of a point; for arrays of transforms or
of covariances (n, 6, 6) results are arrays (n, 6, 6) or (n, 3, 3).  Raises ValueInvalid for an invalid covariance.
`FrameTree.covariance` follows a tree; `frametool help covariance` explains how to convert other conventions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.geometry import rigid, uncertainty, validation

if TYPE_CHECKING:
    from collections.abc import Callable

    from frametool.geometry import Components, Numbers
    from frametool.geometry.transform import Transform

    Covariance = Numbers | list[list[float]] | None

__all__ = ["compose", "invert", "point"]


def compose(a: Transform, cov_a: Covariance, b: Transform, cov_b: Covariance) -> Any:
    """Return the covariance of a @ b; b is the lever arm of a's rotation uncertainty."""
    first, second = _placed(a, cov_a), _placed(b, cov_b)
    size, parts = len(first), (*first, *second)
    return _found(lambda *p: rigid.covariance_of(rigid.compose_full(p[:size], p[size:])), uncertainty.POSE, parts)


def invert(a: Transform, cov_a: Covariance) -> Any:
    """Return the covariance of a.inverse(), along the axes of the former child."""
    return _found(lambda *parts: rigid.covariance_of(rigid.inverse_full(parts)), uncertainty.POSE, _placed(a, cov_a))


def point(a: Transform, cov_a: Covariance, p: Numbers, cov_p: Covariance = None) -> Any:
    """Return the 3 x 3 covariance of a.apply(p), from those of a and of the point."""
    pose, at = _placed(a, cov_a), validation.columns(p, 3, "point")
    own = uncertainty.taken(cov_p, uncertainty.POINT, many=True)
    end = len(pose)

    def kernel(*parts: Any) -> Components | None:
        moved, numbers = parts[:end], parts[end : end + 3]
        of_pose = rigid.covariance_of(moved)
        return uncertainty.of_three(rigid.pose_of(moved), of_pose, numbers, parts[end + 3 :] or None)

    return _found(kernel, uncertainty.POINT, (*pose, *at, *own))


def _placed(a: Transform, covariance: Covariance) -> Components:
    """Return a transform followed by its covariance, if it has one."""
    return (*a.components, *uncertainty.taken(covariance, many=True))


def _found(kernel: Callable[..., Components | None], size: int, parts: Components) -> Any:
    """Run a kernel; None if it is exact.  Warn about rotations that are too uncertain for the first order."""
    if validation.single(parts):
        entries = [entry + 0.0 for entry in kernel(*parts) or [0.0] * size]
        uncertainty.warn_if_wide([entries])
        return entries
    import numpy as np

    from frametool.geometry import arrays

    side = round(size**0.5)
    found = arrays.rows(lambda *columns: kernel(*columns) or (0.0,) * size, (side, side), parts) + 0.0
    if size == uncertainty.POSE and found.size:
        widest = np.linalg.eigvalsh(found[..., 3:, 3:])[..., -1].argmax()
        uncertainty.warn_if_wide([found.reshape(-1, size)[widest].tolist()])
    return found
