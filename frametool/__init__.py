"""Rigid-body frames: trees, lookups and every rotation notation, on the command line and in Python.

    import frametool
    tree = frametool.load("robot.yaml")
    map_from_camera = tree.lookup("map", "camera_optical")      # the pose of camera_optical in map
    point_in_map = map_from_camera.apply([0.0, 0.0, 1.0])

Arguments are always in the order (target, source). Metres, radians, quaternions x, y, z, w, stamps in integer
nanoseconds. Names are loaded when first used: `import frametool` alone loads neither numpy nor yaml.
"""

from __future__ import annotations

__version__ = "0.1.0"
