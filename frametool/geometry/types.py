"""Name the kinds of numbers the kernels take; nothing here exists at run time.

A kernel's components are either all Python floats or float64 arrays of one shape (a float among arrays stands for
every element). `xp` is `frametool.geometry.floats` for the one and `frametool.geometry.arrays` for the other.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType
    from typing import Any, TypeAlias

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Number: TypeAlias = Any  # float or float64 array: operators between the two have no type mypy can follow
    Namespace: TypeAlias = ModuleType
    Pair: TypeAlias = tuple[Number, Number]
    Vector: TypeAlias = tuple[Number, Number, Number]
    Quaternion: TypeAlias = tuple[Number, Number, Number, Number]
    Matrix: TypeAlias = tuple[Number, Number, Number, Number, Number, Number, Number, Number, Number]
    Rigid: TypeAlias = tuple[Number, Number, Number, Number, Number, Number, Number]
    Components: TypeAlias = tuple[Number, ...]
    Kernel: TypeAlias = Callable[..., Components]
    Array: TypeAlias = NDArray[np.float64]
    Numbers: TypeAlias = ArrayLike
