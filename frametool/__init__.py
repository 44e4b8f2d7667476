"""Rigid-body frames: trees, lookups and every rotation notation, on the command line and in Python.

    import frametool
    tree = frametool.load("robot.yaml")
    map_from_camera = tree.lookup("map", "camera_optical")      # the pose of camera_optical in map
    point_in_map = map_from_camera.apply([0.0, 0.0, 1.0])

`FORMATS` is the table of file formats, name -> row: what is read from and written in a format, how it is
recognised, and its conventions; `frametool formats` prints it.

    [name for name, row in frametool.FORMATS.items() if "tree" in row.reads]    # formats that `load` accepts

Arguments are always in the order (target, source). Metres, radians, quaternions x, y, z, w, stamps in integer
nanoseconds. Names are loaded when first used: `import frametool` alone loads neither numpy nor yaml.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from frametool import covariance as covariance
    from frametool.calc.evaluate import calc as calc
    from frametool.cli.commands.batch import Ran as Ran
    from frametool.cli.commands.batch import run as run
    from frametool.errors import FrametoolError as FrametoolError
    from frametool.fit.hand_eye import solve_hand_eye as solve_hand_eye
    from frametool.fit.matched_points import solve_points as solve_points
    from frametool.fit.robust_mean import solve_mean as solve_mean
    from frametool.formats.cameras import load_camera as load_camera
    from frametool.formats.load import load as load
    from frametool.formats.robots.urdf import load_robot as load_robot
    from frametool.formats.rows.arrow import apply_arrow as apply_arrow
    from frametool.formats.table import FORMATS as FORMATS
    from frametool.frames.buffer import TransformBuffer as TransformBuffer
    from frametool.frames.lookups import FrameTree as FrameTree
    from frametool.frames.trajectory import Trajectory as Trajectory
    from frametool.geometry.camera import Camera as Camera
    from frametool.geometry.earth import earth_pose as earth_pose
    from frametool.geometry.earth import ecef_from_lla as ecef_from_lla
    from frametool.geometry.earth import lla_from_ecef as lla_from_ecef
    from frametool.geometry.earth import lla_from_utm as lla_from_utm
    from frametool.geometry.earth import utm_from_lla as utm_from_lla
    from frametool.geometry.transform import Rotation as Rotation
    from frametool.geometry.transform import Transform as Transform
    from frametool.lint.tree_diff import diff as diff
    from frametool.rows.measurements import solve as solve
    from frametool.rows.trajectories import align as align
    from frametool.rows.trajectories import compare as compare
    from frametool.rows.trajectories import load_trajectory as load_trajectory
    from frametool.rows.trajectories import resample as resample
    from frametool.sim.followed import explain as explain
    from frametool.sim.followed import follow_steps as follow_steps
    from frametool.sim.scene import tutorial as tutorial
    from frametool.sim.simulate import simulate as simulate
    from frametool.sim.turtle import FollowController as FollowController
    from frametool.sim.turtle import Turtle as Turtle
    from frametool.sim.turtle import Twist as Twist

__version__ = "0.2.0"

_HOMES = {
    name: module for module, names in {
        "frametool.calc.evaluate": "calc",
        "frametool.cli.commands.batch": "Ran run",
        "frametool.covariance": "covariance",
        "frametool.errors": "FrametoolError",
        "frametool.fit.hand_eye": "solve_hand_eye",
        "frametool.fit.matched_points": "solve_points",
        "frametool.fit.robust_mean": "solve_mean",
        "frametool.formats.cameras": "load_camera",
        "frametool.formats.load": "load",
        "frametool.formats.robots.urdf": "load_robot",
        "frametool.formats.rows.arrow": "apply_arrow",
        "frametool.formats.table": "FORMATS",
        "frametool.frames.buffer": "TransformBuffer",
        "frametool.frames.lookups": "FrameTree",
        "frametool.frames.trajectory": "Trajectory",
        "frametool.geometry.camera": "Camera",
        "frametool.geometry.earth": "earth_pose ecef_from_lla lla_from_ecef lla_from_utm utm_from_lla",
        "frametool.geometry.transform": "Rotation Transform",
        "frametool.lint.tree_diff": "diff",
        "frametool.sim.followed": "explain follow_steps",
        "frametool.sim.scene": "tutorial",
        "frametool.sim.simulate": "simulate",
        "frametool.sim.turtle": "FollowController Turtle Twist",
        "frametool.rows.measurements": "solve",
        "frametool.rows.trajectories": "align compare load_trajectory resample",
    }.items() for name in names.split()
}  # fmt: skip
__all__ = ["__version__", *_HOMES]  # noqa: PLE0604 - its keys are strings


def __getattr__(name: str) -> object:
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'frametool' has no attribute {name!r}")
    from importlib import import_module

    home = import_module(_HOMES[name])
    value: object = home if _HOMES[name] == f"frametool.{name}" else getattr(home, name)
    globals()[name] = value
    return value


def html_of(value: object) -> str | None:
    """Return what a notebook shows of a value; the rooms below call it, which do not know how."""
    from frametool.view import exports

    return exports.html_of(value)


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted(__all__)
