"""`frametool unproject`: pixels of a camera as rays or points, or as pixels of another picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, argument, command_named, option, refuse
from frametool.cli.commands.apply import is_record
from frametool.cli.commands.project import CameraTask, camera_options
from frametool.cli.options import at_ns
from frametool.cli.output import Output
from frametool.cli.trees import FRAME, frame_name
from frametool.documents.source import Source
from frametool.errors import FormatError, listing
from frametool.geometry.rigid import EXACT
from frametool.stream.joint_rows import names_in
from frametool.text.numbers import parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.cli.commands.apply import Way
    from frametool.geometry.types import Components

FAR = ("depth", "range")
WANTED = "a key pixel, or u and v"
PIXEL = ("pixel.0", "pixel.1")
DEPTH = '"depth"'


@command_named("unproject", own=("input_path",))
@argument("arguments", FRAME, nargs=-1, metavar="[TREE TARGET CAMERA] [U V [DEPTH] | RECORD]..")
@option("--depth D", "points at this depth in optical axes", parse_number, excludes=("range", "ground", "undistort"))
@option("--range R", "points at this distance from the camera", parse_number, excludes=("ground", "undistort"))
@option("--ground FRAME", "points where rays meet z = 0 of this frame", FRAME, excludes=("undistort",))
@option("--height H", "z = H of that frame instead", parse_number, requires=("ground",), default=0.0)
@option("--undistort", "pixels without distortion, or --rectified")
@camera_options
def command(inputs: Inputs) -> int:
    """Add to pixels their rays, or points on the rays.

    \b
      frametool unproject cameras.yaml map cam_front 160 120
      frametool unproject cameras.yaml map cam_front 160 200 --ground map
      frametool unproject --camera camchain.yaml:cam0 --undistort 12 30

    Rows with columns u, v, or a key pixel, get origin_x .. ray_z in TARGET; with a depth or range, in a column or an
    option, x, y, z. They are empty outside the model and above the horizon (help cameras).
    """
    from frametool.stream.pixels import PointsOfPixels

    task = CameraTask(inputs, Output(inputs, "points", otherwise="yaml"), "TREE TARGET CAMERA")
    raw, rectified = task.camera, task.rectified()
    task.camera = raw if inputs.undistort else rectified
    into = None if not inputs.undistort else rectified if inputs.rectified else raw.flat()
    records = [] if task.is_stream else [*_records(task.rest)]
    columns = _columns(inputs, _names(task, records), task.name)
    far = next(((name, value) for name in FAR if (value := getattr(inputs, name)) is not None), ("", None))
    if far[0] or inputs.ground or into:
        columns = columns[:2]
    elif columns[2:]:
        far = ("range" if columns[2] == "range" else "depth"), None
    height = inputs.height if inputs.ground else None
    if into is None and inputs.ground:
        task.way = _through(task, inputs.ground)
    seen = PointsOfPixels(task.camera, inputs.first_pixel, columns, far=far, height=height, into=into)
    request = task.request(None, seen, seen.shown((task.way and task.way.target) or ""))
    if request.timed is not None and height is not None:
        request = request._replace(timed=request.timed._replace(width=2 * EXACT))
    return task.answer(request._replace(poses=0, frames=()), records, seen)


def _through(task: CameraTask, named: str) -> Way:
    """Return the way with two poses: of the ground in TARGET, of the camera over the ground, at one time."""
    way = task.way
    if way is None or way.tree is None or way.target is None:
        raise click.UsageError("--ground needs TREE, TARGET and CAMERA: the tree says where the ground is")
    tree, chosen, target, camera = way.tree, task.inputs.at, way.target, frame_name(task.camera_name, way.tree)
    ground = frame_name(named, tree)
    pairs = ((target, ground), (ground, camera))

    def from_frame(_own: str | None, own_ns: int | None) -> Components:
        stamp_ns = own_ns if chosen is None else at_ns(chosen)
        if stamp_ns is None:
            stamp_ns = min((each for pair in pairs if (each := tree.latest(*pair)) is not None), default=None)
        return tuple(part for pair in pairs for part in tree.lookup(*pair, stamp_ns).components)

    def at_times(_own: str | None, times_ns: Any) -> Components:
        first, second = (tree.lookup_many(*pair, times_ns, missing="nan").components for pair in pairs)
        return *first[:6], first[6] + 0.0 * second[6], *second

    return way._replace(from_frame=from_frame, at_times=None if chosen is not None else at_times)


def _records(arguments: Sequence[str]) -> Iterator[Source]:
    """Yield the records of arguments: mappings, or the numbers of one pixel."""
    numbers = [each for each in arguments if not is_record(each)]
    yield from (Source("argument", each) for each in arguments if is_record(each))
    refuse(len(numbers) not in (0, 2, 3), f"a pixel is U V or U V DEPTH, found {len(numbers)}; more pixels are rows")
    if numbers:
        u, v, *depth = map(parse_length, numbers)
        yield Source("argument", f'{{"pixel": [{u!r}, {v!r}]{"".join(f", {DEPTH}: {each!r}" for each in depth)}}}')


def _names(task: CameraTask, records: Sequence[Source]) -> Sequence[str]:
    """Return the names of the columns of the stream, or its keys; those of the first record where there are some."""
    if records:
        return names_in(records[0].text.encode(), "yaml", records[0].name, WANTED)
    task.read_clouds_as_rows()
    begin = task.opened().peek()
    fmt = task.within or task.chosen_format() or task.detected(begin, is_table=True)
    return names_in(begin, fmt, task.name, WANTED, header=task.inputs.header)


def _columns(inputs: Inputs, names: Sequence[str], source: str) -> Sequence[str]:
    """Return the columns of u and v, and of how far away it is where there is one; raises FormatError."""
    if inputs.peek("columns"):
        columns: Sequence[str] = [each.strip() for each in inputs.columns[0].split(",")]
        refuse(len(columns) not in (2, 3), "--columns names those of u and v, and of a depth if there is one")
        return columns
    if names[:2] == ("1", "2"):  # without names
        return names[:3]
    if not ({"u", "v"} <= {*names} or "pixel" in names):
        message = f"no columns u and v among: {listing(names)}; name them with --columns"
        raise FormatError(message, source=source, line=1)
    far = [each for each in FAR if each in names]
    return *(("u", "v") if "u" in names else PIXEL), *far[:1]
