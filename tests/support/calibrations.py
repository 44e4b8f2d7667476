"""Files of calibrations for the tests: a text is written, read as a tree, and asked for the matrix of a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from frametool import load

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


def read(folder: Path, text: str, name: str = "a.yaml", **options: Any) -> Any:
    """Return the tree of a text that stands in a file."""
    (folder / name).write_text(text)
    return load(folder / name, **options)


def matrix(tree: Any, target: str, source: str) -> NDArray[np.float64]:
    """Return the pose of one frame in another as a 4x4 matrix."""
    return np.asarray(tree.lookup(target, source).as_matrix())
