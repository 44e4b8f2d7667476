"""`frametool project`: points into the picture of a camera. What it shares with `unproject` is here too."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING

import click

from frametool.cli import options
from frametool.cli.command import Inputs, Text, argument, command_named, option, together
from frametool.cli.commands import apply
from frametool.cli.commands.apply import begins_number, is_record
from frametool.cli.output import Output
from frametool.cli.poses import is_inline, values_of
from frametool.cli.sink import refuse_existing, say, writing
from frametool.cli.streaming import Stream, is_bag, stream_options
from frametool.cli.trees import FRAME
from frametool.errors import ValueInvalid, shown
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from contextlib import AbstractContextManager

    from frametool.cli.sink import Write
    from frametool.documents.source import Source
    from frametool.geometry.camera import Camera
    from frametool.stream.pixels import Seen
    from frametool.stream.request import Formula, Request, Shown

AXES = ("optical", "opengl", "flu")


class CameraFile(Text):
    """A file, and behind a colon which of its cameras is meant; or a camera written inline."""

    def offers(self, ctx: click.Context, incomplete: str) -> Mapping[str, str] | None:  # noqa: ARG002
        """Offer the names of the cameras in a file that is there."""
        path, colon, _ = incomplete.rpartition(":")
        if not colon:
            return None
        from frametool.documents.source import InputFile
        from frametool.formats.cameras import cameras_of

        return {f"{path}:{name}": "" for name in cameras_of(InputFile(path)) if name}


def parse_size(text: str) -> tuple[int, int]:
    """Read W,H; raises ValueInvalid."""
    width, _, height = (each.strip() for each in text.partition(","))
    if not (width.isdecimal() and height.isdecimal()):
        raise ValueInvalid(f"a size is W,H in pixels, found {shown(text)}")
    return int(width), int(height)


camera_options = together(
    option("--camera FILE[:NAME]", "intrinsics from this file, or inline, not from TREE", CameraFile()),
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
def command(inputs: Inputs) -> int:
    """Add to points the pixels at which a camera sees them.

    \b
      frametool project cameras.yaml cam_front lidar -i yard.csv
      frametool project --camera camchain.yaml:cam0 0.5 0.2 4

    Rows get columns u, v, depth (z in optical axes) and in_image; u and v are empty if there is no pixel. Without
    SOURCE each row names its frame; without TREE points are in the camera's frame. With --image FILE -o FILE.svg they
    are drawn over the image. `frametool help cameras` says more.
    """
    from frametool.stream.pixels import PixelsOfPoints

    overlay, image, path = None, inputs.image, inputs.output
    output = Output(inputs, "points", otherwise="yaml") if image is None else Undrawn(inputs.but(output=None), "points")
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
    take = None if overlay is None else overlay.take
    seen = PixelsOfPoints(task.camera, inputs.first_pixel, ranged=bool(inputs.ranged), take=take)
    request = task.request(inputs.frame_column if task.is_stream else None, seen, seen.shown(task.camera_name))
    status = task.answer(request, () if task.is_stream else [*apply.sources_of(task.rest, None)], seen)
    if overlay is not None:
        with writing(overlay.path, force=inputs.force) as write:
            write(overlay.drawn())
        say(overlay.summary())
    return status


class Undrawn(Output):
    """The rows of an overlay, which are not written."""

    def opened(self) -> AbstractContextManager[Write]:
        """Open no place."""
        return nullcontext(lambda _: None)


class CameraTask(Stream):
    """What the arguments and options of both commands say: the camera, how rows move, which records there are."""

    def __init__(self, inputs: Inputs, output: Output, named: str) -> None:
        """Read tree and camera; named: the arguments that lead to the camera, if there is a tree."""
        super().__init__(inputs, output)
        if self.messages() is None and self.path and is_bag(self.path):  # of a bag, --topic is what is streamed
            raise click.UsageError(f"write the clouds of {self.path} as files first: apply -o '{{stamp_ns}}.pcd'")
        self.way: apply.Way | None = None
        self.rest: tuple[str, ...] = inputs.arguments
        _, colon, name = (inputs.camera or "").rpartition(":")
        self.camera_name = name if colon and not is_inline(inputs.camera) else ""
        if inputs.camera is None or _names_tree(self.rest):
            *before, _ = names = named.split()
            if len(self.rest) < len(names) or begins_number(self.rest[0]):
                raise click.UsageError(f"name {', '.join(before)} and CAMERA, or give --camera FILE[:NAME]")
            self.camera_name = self.rest[len(before)]
            self.way, self.rest = apply.way_by_tree(inputs, numbers=True)
        self.is_stream = self.rest in ((), ("-",))
        self.camera = self._camera()

    def _camera(self) -> Camera:
        """Return the camera in the axes of its frame, as its pixels are wanted."""
        inputs, tree = self.inputs, None if self.way is None else self.way.tree
        from frametool.formats.cameras import load_camera, resized

        if tree is not None and inputs.camera is None:
            camera = resized(tree.camera(self.camera_name, inputs.size), inputs.size, inputs.arguments[0])
        else:
            camera = load_camera(inputs.camera, model=inputs.model, size=inputs.size)
            if not (is_inline(inputs.camera) and "axes" in inputs.camera):  # those of a file are of its own frame
                own = None if tree is None else tree.cameras.get(self.camera_name)
                axes = "optical" if own is None else own.axes
                axes = axes if tree is None else tree.camera_axes.get(self.camera_name, axes)
                camera = camera.changed(axes=axes)
        return camera.changed(axes=inputs.camera_axes) if inputs.camera_axes else camera

    def rectified(self) -> Camera:
        """Return the camera of the rectified picture, if that is wanted."""
        inputs = self.inputs
        return self.camera.rectified(from_first=bool(inputs.from_first)) if inputs.rectified else self.camera

    def request(self, frame_column: str | None, formula: Formula, shown: Shown) -> Request:
        """Return what is done with rows."""
        from frametool.stream.request import Operation, Request

        inputs = self.inputs
        asked = Request(Operation(moves=True))
        if self.way is not None:
            asked = self.way.request(frame_column, inputs.time_column if self.is_stream else None)
        operation = asked.operation._replace(formula=formula, shown=shown)
        inputs.ask("keep")
        return asked._replace(operation=operation, rename=None, normalize=bool(inputs.normalize))

    def answer(self, request: Request, records: Sequence[Source | str], seen: Seen) -> int:
        """Write the rows of the stream, or the results of records; then say what became of them."""
        status, output = 0, self.output
        if self.is_stream:
            self.read_clouds_as_rows()
            status = self.run(request)
        else:
            if output.style.format == "text":
                output.style = output.style.changed(format="yaml")
            request = request._replace(prefix=self.inputs.prefix, precision=output.style.precision)
            output.values(values_of(records, request, output))
        if (self.is_stream or seen.lost) and (summary := seen.summary()):
            is_wrong = seen.is_mostly_behind and not self.inputs.camera_axes
            self.inputs.note(f"{summary}{'; most are behind: --camera-axes flu or opengl?' * is_wrong}")
        return status


def _names_tree(arguments: Sequence[str]) -> bool:
    """Return True where the first argument is no number and no record, or is a tree that is written inline."""
    inner = [each for each in arguments[:2] if not (is_record(each) or begins_number(each))]
    return bool(arguments) and (inner[:1] == [arguments[0]] or (len(arguments) > 1 and inner == [arguments[1]]))
