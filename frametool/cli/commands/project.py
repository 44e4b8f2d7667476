"""Cameras: `project` points into an image, and `unproject` pixels to rays, points or other pixels."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options
from frametool.cli.command import Inputs, Text, argument, command_named, option, refuse, together
from frametool.cli.commands import apply
from frametool.cli.commands.apply import begins_number, is_record
from frametool.cli.output import Output
from frametool.cli.poses import is_inline, values_of
from frametool.cli.sink import refuse_existing, say, writing
from frametool.cli.streaming import Task, is_bag, stream_options
from frametool.cli.trees import FRAME, frame_name, lookup_time_ns
from frametool.documents.source import InputFile, Source
from frametool.errors import FormatError, ValueInvalid, listing, shown
from frametool.geometry.rigid import EXACT
from frametool.rows.request import Formula, Operation, Request
from frametool.text.numbers import parse_length, parse_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frametool.geometry import Components
    from frametool.geometry.camera import Camera
    from frametool.rows.formulas import Seen

AXES = ("optical", "opengl", "flu")


def _offer_cameras(_ctx: click.Context, incomplete: str) -> Mapping[str, str] | None:
    """Offer the names of the cameras in a file, after its colon."""
    path, colon, _ = incomplete.rpartition(":")
    if not colon:
        return None
    from frametool.formats.cameras import cameras_of

    return {f"{path}:{name}": "" for name in cameras_of(InputFile(path)) if name}


def parse_size(text: str) -> tuple[int, int]:
    """Parse W,H; raises ValueInvalid."""
    width, _, height = (each.strip() for each in text.partition(","))
    if not (width.isdecimal() and height.isdecimal()):
        raise ValueInvalid(f"a size is W,H in pixels, found {shown(text)}")
    return int(width), int(height)


camera_options = together(
    option("--camera FILE[:NAME]", "intrinsics from this file, or inline, not from TREE", Text(offers=_offer_cameras)),
    option("--model NAME", "distortion model of --camera", requires=("camera",)),
    option("--size W,H", "image size, to which K is scaled", parse_size),
    option("--rectified", "use the rectified image: R, then P, no distortion"),
    option("--from-first", "points are in the rectified frame of the first camera", requires=("rectified",)),
    option("--first-pixel C", "centre of the first pixel; 0.5: COLMAP", parse_number, default=0.0),
    stream_options,
    options.pose_options,
    options.result_options("points"),
    apply.moving_row_options,
    option("--camera-axes AXES", "of CAMERA: optical, opengl or flu  [default: as TREE says]", AXES),
    options.reading_options,
)


@command_named("project", own=("input_path", "output"))
@argument("arguments", FRAME, nargs=-1, metavar="[TREE CAMERA [SOURCE]] [X Y Z | RECORD]..")
@option("--range", "add range, the distance from the camera", name="ranged")
@option("--image FILE", "draw over this image: -o FILE.svg, .html, .png", requires=("output",))
@apply.frame_column_option
@camera_options
def project_command(inputs: Inputs) -> int:
    """Add to points the pixels at which a camera sees them.

    \b
      frametool project cameras.yaml cam_front lidar -i yard.csv
      frametool project --camera camchain.yaml:cam0 0.5 0.2 4

    Rows get columns u, v, depth (z in optical axes) and in_image; u and v are empty if there is no pixel. Without
    SOURCE each row names its frame; without TREE points are in the camera's frame. With --image FILE -o FILE.svg they
    are drawn over the image. `frametool help cameras` says more.
    """
    from frametool.rows.formulas import PixelsOfPoints

    overlay, image, path = None, inputs.image, inputs.output
    own = inputs if image is None else inputs.changed(output=os.devnull)  # the rows of an overlay are not written
    output = Output(own, "points", otherwise="yaml")
    task = CameraTask(inputs, output, "TREE CAMERA")
    if image is not None:
        from frametool.formats.cameras import resized
        from frametool.view.pictures import Overlay

        refuse_existing(path, force=inputs.force)
        overlay = Overlay(image, path)
        task.camera = resized(task.camera, overlay.size, image)
    task.camera = task.rectified()
    no_size = "note: the camera has no size, in_image is empty; --size W,H gives it one"
    inputs.note(no_size if task.camera.size is None else None)
    take, ranged = None if overlay is None else overlay.take, bool(inputs.ranged)
    seen = PixelsOfPoints(task.camera, inputs.first_pixel, name=task.camera_name, ranged=ranged, take=take)
    records = () if task.is_stream else [*apply.sources_of(inputs, task.rest)]
    status = task.finish(task.adding_request(seen), records, seen)
    if overlay is not None:
        with writing(overlay.path, force=inputs.force) as write:
            write(overlay.drawn())
        say(overlay.summary())
    return status


class CameraTask(Task):
    """The task of `project` or `unproject`: the camera, the transform of rows, the records."""

    def __init__(self, inputs: Inputs, output: Output, named: str) -> None:
        """Read tree and camera; named: the arguments up to the camera, for messages, if there is a tree."""
        super().__init__(inputs, output=output)
        holds_clouds = self.messages() is None and self.path and is_bag(self.path)  # of a bag, --topic is for records
        refuse(holds_clouds, f"write the clouds of {self.path} as files first: apply -o '{{stamp_ns}}.pcd'")
        self.mover: apply.TreeMover | None = None
        self.rest: tuple[str, ...] = inputs.arguments
        _, colon, name = (inputs.camera or "").rpartition(":")
        self.camera_name = name if colon and not is_inline(inputs.camera) else ""
        # two numbers or records are not a tree; a single one may be an inline tree
        if inputs.camera is None or not all(is_record(each) or begins_number(each) for each in self.rest[:2]):
            *before, _ = names = named.split()
            if len(self.rest) < len(names) or begins_number(self.rest[0]):
                raise click.UsageError(f"name {', '.join(before)} and CAMERA, or give --camera FILE[:NAME]")
            self.camera_name = self.rest[len(before)]
            self.mover = apply.TreeMover(self, numbers=True)
            self.rest = self.mover.rest
        self.is_stream, tree = self.rest in ((), ("-",)), None if self.mover is None else self.mover.tree
        from frametool.formats.cameras import load_camera, resized

        if tree is not None and inputs.camera is None:
            camera = resized(tree.camera(self.camera_name, inputs.size), inputs.size, inputs.arguments[0])
        else:
            camera = load_camera(inputs.camera, model=inputs.model, size=inputs.size)
            if not (is_inline(inputs.camera) and "axes" in inputs.camera):  # axes in a file apply to its own frame
                own = None if tree is None else tree.cameras.get(self.camera_name)
                axes = "optical" if own is None else own.axes
                axes = axes if tree is None else tree.camera_axes.get(self.camera_name, axes)
                camera = camera.changed(axes=axes)
        self.camera: Camera = camera.changed(axes=inputs.camera_axes) if inputs.camera_axes else camera

    def rectified(self) -> Camera:
        """Return the camera, or with --rectified that of the rectified image."""
        inputs = self.inputs
        return self.camera.rectified(from_first=bool(inputs.from_first)) if inputs.rectified else self.camera

    def adding_request(self, formula: Formula, **fields: Any) -> Request:
        """Return the request that adds the results of a formula to rows."""
        self.inputs.use("keep")
        if self.mover is not None:
            return self.mover.request(formula, **fields)
        return self.request(operation=Operation(moves=True, formula=formula), **fields)

    def finish(self, request: Request, records: Sequence[Source | str], seen: Seen) -> int:
        """Write the rows of the stream, or the results of records; then report a summary."""
        status, output = 0, self.output
        if self.is_stream:
            self.read_clouds_as_rows()
            status = self.run(request)
        else:
            if output.style.format == "text":
                output.style = output.style.changed(format="yaml")
            request = request.with_results(prefix=self.inputs.prefix or "")
            output.values(values_of(records, request, output))
        if (self.is_stream or seen.lost) and (summary := seen.summary()):
            is_wrong = seen.is_mostly_behind and not self.inputs.camera_axes
            self.inputs.note(f"{summary}{'; most are behind: --camera-axes flu or opengl?' * is_wrong}")
        return status


FAR = ("depth", "range")
WANTED = "a key pixel, or u and v"
DEPTH = '"depth"'


@command_named("unproject", own=("input_path",))
@argument("arguments", FRAME, nargs=-1, metavar="[TREE TARGET CAMERA] [U V [DEPTH] | RECORD]..")
@option("--depth D", "points at this depth in optical axes", parse_number, excludes=("range", "ground", "undistort"))
@option("--range R", "points at this distance from the camera", parse_number, excludes=("ground", "undistort"))
@option("--ground FRAME", "points where rays meet z = 0 of this frame", FRAME, excludes=("undistort",))
@option("--height H", "z = H of that frame instead", parse_number, requires=("ground",), default=0.0)
@option("--undistort", "pixels without distortion, or --rectified")
@camera_options
def unproject_command(inputs: Inputs) -> int:
    """Add to pixels their rays, or points on the rays.

    \b
      frametool unproject cameras.yaml map cam_front 160 120
      frametool unproject cameras.yaml map cam_front 160 200 --ground map
      frametool unproject --camera camchain.yaml:cam0 --undistort 12 30

    Rows with columns u, v, or a key pixel, get origin_x .. ray_z in TARGET; with a depth or range, in a column or an
    option, x, y, z. They are empty outside the model and above the horizon (help cameras).
    """
    from frametool.rows.formulas import PointsOfPixels

    task = CameraTask(inputs, Output(inputs, "points", otherwise="yaml"), "TREE TARGET CAMERA")
    raw, rectified = task.camera, task.rectified()
    task.camera = raw if inputs.undistort else rectified
    into = None if not inputs.undistort else rectified if inputs.rectified else raw.flat()
    records: list[Source] = []
    if not task.is_stream:  # mappings, and the numbers of one pixel
        numbers = [each for each in task.rest if not is_record(each)]
        records = [Source("argument", each) for each in task.rest if is_record(each)]
        wrong = f"a pixel is U V or U V DEPTH, found {len(numbers)}; more pixels are rows"
        refuse(len(numbers) not in (0, 2, 3), wrong)
        if numbers:
            u, v, *depth = map(parse_length, numbers)
            behind = "".join(f", {DEPTH}: {each!r}" for each in depth)
            records.append(Source("argument", f'{{"pixel": [{u!r}, {v!r}]{behind}}}'))
    columns = _columns(task, records)
    far = next(((name, value) for name in FAR if (value := getattr(inputs, name)) is not None), ("", None))
    if far[0] or inputs.ground or into:
        columns = columns[:2]
    elif columns[2:]:
        far = ("range" if columns[2] == "range" else "depth"), None
    height = inputs.height if inputs.ground else None
    if into is None and inputs.ground:
        if task.mover is None:
            raise click.UsageError("--ground needs TREE, TARGET and CAMERA: the tree says where the ground is")
        task.mover = GroundMover(task.mover, inputs.ground, task.camera_name)
    target = "" if task.mover is None else task.mover.target
    seen = PointsOfPixels(task.camera, inputs.first_pixel, columns, far=far, height=height, into=into, target=target)
    return task.finish(task.adding_request(seen, poses=0), records, seen)


class GroundMover(apply.TreeMover):
    """Looks up two poses at one time: of the ground in TARGET, and of the camera in the ground's frame."""

    def __init__(self, mover: apply.TreeMover, ground: str, camera: str) -> None:
        """Copy the tree and the times of a mover."""
        vars(self).update(vars(mover))
        ground = frame_name(ground, self.tree)
        self.pairs = ((self.target, ground), (ground, frame_name(camera, self.tree)))
        if self.timed is not None:
            self.timed = self.timed._replace(many=self.at_times, one=self.from_frame, width=2 * EXACT)

    def from_frame(self, _own: str | None, own_ns: int | None = None) -> Components:
        """Return both poses at a time, or at the latest common one."""
        stamp_ns, tree = own_ns if self.at is None else lookup_time_ns(self.at), self.tree
        if stamp_ns is None:
            stamp_ns = min((each for pair in self.pairs if (each := tree.latest(*pair)) is not None), default=None)
        return tuple(part for pair in self.pairs for part in tree.lookup(*pair, stamp_ns).components)

    def at_times(self, _own: str | None, times_ns: Any) -> Components:
        """Return columns of both poses; nan where one has no data."""
        first, second = (self.tree.lookup_many(*pair, times_ns, missing="nan").components for pair in self.pairs)
        return *first[:6], first[6] + 0.0 * second[6], *second


def _columns(task: CameraTask, records: Sequence[Source]) -> Sequence[str]:
    """Return the columns or keys of u, v and, if present, depth or range; raises FormatError without u and v.

    They are looked up in the first record, or else in the stream.
    """
    from frametool.rows.formulas import names_in

    inputs = task.inputs
    if records:
        names = names_in(records[0].text.encode(), "yaml", records[0].name, WANTED)
    else:
        task.read_clouds_as_rows()
        begin = task.opened().peek()
        fmt = task.format_of(begin, is_table=True)
        names = names_in(begin, fmt, task.name, WANTED, header=not inputs.no_header)
    if inputs.peek("columns"):
        columns: Sequence[str] = [each.strip() for each in inputs.columns[0].split(",")]
        refuse(len(columns) not in (2, 3), "--columns names those of u and v, and of a depth if there is one")
        return columns
    if names[:2] == ("1", "2"):  # no header
        return names[:3]
    if not ({"u", "v"} <= {*names} or "pixel" in names):
        message = f"no columns u and v among: {listing(names)}; name them with --columns"
        raise FormatError(message, source=task.name, line=1)
    far = [each for each in FAR if each in names]
    return *(("u", "v") if "u" in names else ("pixel.0", "pixel.1")), *far[:1]
