"""Math on numbers: rotations, poses, Euler angles, cameras, covariances, positions on the Earth; no names, no files.

The kinds of numbers that kernels take are here, for type checking; nothing of them exists at run time.  A kernel is
written once, for floats and for float64 arrays of one shape: `N` is either of them, and mypy checks a kernel's body
for each.  `Functions[N]` is what it finds in `xp`: the module `floats` or the module `arrays`.  A float among arrays is
constant for every element.
"""

# ruff: noqa: D102 - the functions of a namespace are those of `math`; the others have docstrings where they are defined

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, Protocol, TypeAlias, TypeVar

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Array: TypeAlias = NDArray[np.float64]
    Indices: TypeAlias = NDArray[np.int64]
    Numbers: TypeAlias = ArrayLike
    N = TypeVar("N", float, Array)
    Condition: TypeAlias = bool | NDArray[np.bool_]

    Two: TypeAlias = tuple[N, N]
    Three: TypeAlias = tuple[N, N, N]
    Four: TypeAlias = tuple[N, N, N, N]
    Six: TypeAlias = tuple[N, N, N, N, N, N]
    Seven: TypeAlias = tuple[N, N, N, N, N, N, N]
    Nine: TypeAlias = tuple[N, N, N, N, N, N, N, N, N]

    class Functions(Protocol[N]):
        """The functions that a kernel needs beyond arithmetic; all are exact or correctly rounded on every machine."""

        def sqrt(self, x: N, /) -> N: ...
        def copysign(self, size: N | float, sign: N, /) -> N: ...
        def maximum(self, x: N, y: N | float, /) -> N: ...
        def minimum(self, x: N, y: N | float, /) -> N: ...
        def fmod(self, x: N, y: float, /) -> N: ...
        def frexp(self, x: N, /) -> tuple[N, Any]: ...  # exponents: an int, or an array of them
        def ldexp(self, x: N | float, exponent: Any, /) -> N: ...
        def mask(self, condition: Condition, /) -> Condition: ...
        def where(self, condition: Condition, yes: N | float, no: N | float, /) -> N: ...
        def some(self, condition: Condition, /) -> bool | np.bool_: ...
        def least(self, x: N, /) -> float: ...
        def furthest(self, x: N, centre: float = 0.0, /) -> float: ...
        def canonical_sign(self, x: N, y: N, z: N, w: N, /) -> Four[N]: ...
        def doubled_sincos(self, y: N, /) -> Two[N]: ...
        def doubled_arctan(self, tangent: N, /) -> N: ...
        def reduced_exactly(self, x: N, /) -> Two[N]: ...

    # outside the kernels a value holds floats or arrays; the type does not state which
    Number: TypeAlias = Any
    Namespace: TypeAlias = Functions[Any]
    Vector: TypeAlias = tuple[Number, Number, Number]
    Quaternion: TypeAlias = tuple[Number, Number, Number, Number]
    Rigid: TypeAlias = tuple[Number, Number, Number, Number, Number, Number, Number]
    Components: TypeAlias = tuple[Number, ...]
    Kernel: TypeAlias = Callable[..., Components]
