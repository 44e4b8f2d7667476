"""Rigid-body frames: trees, lookups and every rotation notation, on the command line and in Python.

    import frametool
    tree = frametool.load("robot.yaml")
    map_from_camera = tree.lookup("map", "camera_optical")      # the pose of camera_optical in map
    point_in_map = map_from_camera.apply([0.0, 0.0, 1.0])

Arguments are always in the order (target, source). Metres, radians, quaternions x, y, z, w, stamps in integer
nanoseconds. Names are loaded when first used: `import frametool` alone loads neither numpy nor yaml.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool.errors import FrametoolError as FrametoolError
    from frametool.formats.load import load as load
    from frametool.frames.tree import FrameTree as FrameTree
    from frametool.geometry.rotation import Rotation as Rotation
    from frametool.geometry.transform import Transform as Transform

__version__ = "0.1.0"

_HOMES = {
    "FrameTree": "frametool.frames.tree",
    "FrametoolError": "frametool.errors",
    "Rotation": "frametool.geometry.rotation",
    "Transform": "frametool.geometry.transform",
    "load": "frametool.formats.load",
}
__all__ = ["FrameTree", "FrametoolError", "Rotation", "Transform", "__version__", "load"]  # noqa: F822 - loaded below


def __getattr__(name: str) -> object:
    """Load a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'frametool' has no attribute {name!r}")
    from importlib import import_module

    value: object = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted(__all__)
