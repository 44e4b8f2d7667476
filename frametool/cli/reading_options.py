"""The options about files of frames, which `frametool.cli.trees` heeds; adding them to a command reads nothing yet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from frametool.cli.command import FILE, READING, TEXT, decorated, in_option
from frametool.formats import CAMERA_AXES, DH, DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, TypeVar

    Function = TypeVar("Function", bound=Callable[..., Any])


def _keep(context: click.Context, option: click.Parameter, chosen: Any) -> None:
    context.meta.setdefault(READING, {})[option.name] = chosen


def reading_options(*, streams: bool = False) -> Callable[[Function], Function]:
    """Add to a command the options that say how files of frames are read; `opened` heeds them.

    streams: the command has those of streams too, `--in` and `--quiet` among them
    """
    own = () if streams else (in_option, _quiet_option)
    return lambda function: decorated(function, (*own, *_READING_OPTIONS))


def _option(*names: str, **rest: Any) -> Callable[[Any], Any]:
    return click.option(*names, expose_value=False, callback=_keep, **rest)


_quiet_option = _option("--quiet", "quiet", is_flag=True, help="no word on what files were taken for")
_CAMERA_AXES = _option(
    "--camera-axes", "camera_axes", type=click.Choice(CAMERA_AXES),
    help="turn cameras to these axes  [default: those that the form of the file has]",
)  # fmt: skip
_STAMPS = _option(
    "--stamps", "stamps", type=FILE, metavar="FILE", help="times of the poses of a form without, one a line"
)
array_option = _option("--array", "array", type=TEXT, metavar="NAME", help="which array of an NPZ file is streamed")
_EDGES = _option("--edges", "edges", is_flag=True, help="read the edges of a g2o graph instead of its vertices")
_READING_OPTIONS = (
    _option("--topic", "topics", type=TEXT, multiple=True, metavar="NAME",
            help="read only this topic; may be repeated"),
    _option("-j", "--joint", "joints", type=TEXT, multiple=True, metavar="NAME=VALUE",
            help="value of a joint of a robot: radians or metres, 30deg, 2cm, a POSE; may be repeated"),
    _option("--joints", "joint_files", type=FILE, multiple=True, metavar="FILE",
            help="values of joints: a map, JointState messages, CSV, robot.srdf:STATE"),
    _option("--frames", "named_frames", type=TEXT, multiple=True, metavar="WORLD,BODY",
            help="names of frames that a form does not name; may be repeated, in the order of the files"),
    _option("--direction", "direction", type=click.Choice(DIRECTIONS),
            help="of matrices whose key does not say which frame they are seen from"),
    _CAMERA_AXES,
    _option("--dh", "dh", type=click.Choice(DH), help="which Denavit-Hartenberg parameters a table holds"),
    _STAMPS,
)  # fmt: skip


def pose_reading_options(function: Function) -> Function:
    """Add to a command of streams the options about trajectories: the times of their poses, the axes of cameras."""
    return decorated(function, [_CAMERA_AXES, _STAMPS, _EDGES, array_option])
