"""The frames of a tree: `tree` draws or writes them, `static` writes static_transform_publisher, `view` plots them."""

from __future__ import annotations

import os
import re
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Any

import click

from frametool.cli import options
from frametool.cli.command import FILE, Inputs, argument, command_named, misuse, option, refuse, together
from frametool.cli.output import Output
from frametool.cli.sink import refuse_existing, say, writing
from frametool.cli.trees import FRAME, frame_name, load_tree, lookup_time_ns, opened, tree_file
from frametool.documents.source import Source
from frametool.errors import FormatError, ValueInvalid, listing, shown, warn
from frametool.frames.lookups import FrameTree
from frametool.frames.stamps import format_stamp
from frametool.grammar.readers import Reading
from frametool.ros.publisher import FLAGS, moving_frames, read_flags, read_positional

if TYPE_CHECKING:
    from frametool.formats.robots.model import Solid
    from frametool.frames.lookups import Frames
    from frametool.view.frame_scene import FrameScene

    Eye = tuple[float, float]


@command_named("tree", own=("notations", "joints"))
@argument("tree", FILE)
@option("--at TIME", "seconds, nanoseconds with ns  [default: latest of each edge]", options.read_time)
@options.color_option
@options.moving_options
@options.pose_result_options("tree", "trajectory")
def tree_command(inputs: Inputs) -> None:
    """Draw the frames of TREE with their poses in their parents; moving frames with rate and interval.

    \b
      frametool tree robot.yaml
      frametool tree robot.yaml --format dot -o robot.dot
      frametool tree robot.yaml --format csv --to rpy_deg
      frametool tree robot.yaml --with '{name: tip, parent: tool, xyz: [0, 0, 1]}'
      frametool tree drive.yaml --at 2.5

    TREE is a file, - for standard input, or . for the file that FRAMETOOL_TREE names. yaml and json can be read back
    and hold all samples of moving frames; csv has one row per edge. dot draws moving frames like ROS's view_frames, tf2
    is the listing of tf2's all_frames_as_yaml. --at draws the tree at one time. Files of these two have no poses: only
    names and rates are shown.
    """
    output = Output(inputs, "tree", "trajectory")
    place, drawn = output.style.place, output.style.format in ("yaml", "json", "text", "dot", "mermaid")
    is_wrong = place is not None and (not drawn or place.origin is not None)
    refuse(is_wrong, f"--to {place and place.name}: trees say places by lla or utm, in yaml, json, text and drawings")
    frames = load_tree(inputs, inputs.tree, inputs.more, drawings=True)
    stamp = lookup_time_ns(inputs.at)
    output.tree(frames if stamp is None else frames.tree_at(stamp), inputs.color)


ABOUT = "as static_transform_publisher has it"


@command_named("static")
@argument("arguments", FILE, nargs=-1, metavar="[TREE | X Y Z .. PARENT CHILD]")
@together(*(option(f"--{name} {'FRAME' if name.endswith('id') else 'N'}", ABOUT) for name in FLAGS))
@options.reading_options
@options.pose_result_options("tree")
def static_command(inputs: Inputs) -> None:
    """Write the static_transform_publisher arguments of a TREE, or read such arguments into a tree.

    \b
      frametool static robot.yaml
      frametool static robot.yaml --format static1 --to rpy
      frametool static --x 0.1 --yaw 1.5 --frame-id base --child-frame-id camera
      frametool static 0.1 0 0.2 1.5 0 0 base camera --format json

    A tree is written one line per edge, static2 (flags) unless --format says static1 (x y z qx qy qz qw PARENT CHILD)
    or another. With --to rpy angles are written: --roll --pitch --yaw, and yaw pitch roll in static1, in radians.
    Arguments that are read, in either spelling, become a tree entry: the pose of the child in its parent. Their angles
    are in radians, like the tool's; --deg applies to the result.
    """
    flags = {name: value for name in FLAGS if (value := getattr(inputs, name.replace("-", "_"))) is not None}
    arguments = inputs.arguments
    if len(arguments) == 1 and re.match(r"\s*[-+.\d]+\s", arguments[0]) and not os.path.exists(arguments[0]):
        arguments = re.sub(r"\\\s", " ", arguments[0]).split()  # in quotes
    if not flags and len(arguments) == 1:
        output = Output(inputs, "tree", otherwise="static2")
        tree = load_tree(inputs, arguments[0])
        if tree.moves:
            raise ValueInvalid(moving_frames(track.child for track in tree.tracks() if not track.is_static))
        output.tree(tree)
        return
    output = Output(inputs, "tree")
    tree = FrameTree("arguments")
    refuse(flags and arguments, f"extra arguments {shown(' '.join(arguments))} beside the flags")
    reading = Reading(Source("arguments", ""), normalize=inputs.normalize)
    with misuse():
        pose = read_flags(flags, reading) if flags else read_positional(arguments, reading)
    tree.add_components(reading.bare(pose.parent or ""), reading.bare(pose.name or ""), pose.components)
    for note in reading.notes:  # the flags are in radians
        warn(note.message.partition("; degrees?")[0])
    output.tree(tree)


PICTURES = ("text", "html", "svg", "glb", "png")
SUFFIXES = {".html": "html", ".htm": "html", ".svg": "svg", ".glb": "glb", ".png": "png", ".txt": "text"}
EYE = options.parser("frametool.view.frame_scene", "parse_eye")


@command_named("view", own=("output",))
@argument("tree", FILE)
@argument("target", FRAME, required=False)
@argument("source", FRAME, required=False)
@option("--frame FIXED", "reference frame  [default: TARGET, or the root of most frames]", FRAME, name="fixed")
@option("--at TIME", "seconds, nanoseconds with ns  [default: first time at which all edges have data]",
        options.read_time)  # fmt: skip
@option("--below FRAME", "only this frame and its descendants", FRAME)
@option("--only REGEX", "only frames whose name matches")
@option("--path", "only the frames between TARGET and SOURCE", name="path_only")
@option("--from EYE", "slanted, front, side, top, or AZ,EL in degrees", EYE, name="eye", default="slanted")
@options.moving_options
@option("-f --format", "format of the picture  [default: by the suffix of --output, else text]", PICTURES, name="fmt")
@options.place_options
@option("--overlay", "compare TREE with a second tree, TARGET: what has moved?")
@option("--no-sliders", "leave out the sliders for the joints of a robot", name="no_sliders")
@option("--open", "show the page in the browser", name="opens")
@options.color_option
def view_command(inputs: Inputs) -> None:
    """Plot the frames of TREE: in the terminal, as an interactive HTML page, as SVG, PNG, or GLB for 3-D programs.

    \b
      frametool view robot.yaml
      frametool view robot.yaml --below base_link --from side
      frametool view robot.yaml map tool -o robot.html
      frametool view drive.yaml --at 2.5 -o drive.svg
      sed s/0.28/0.3/ robot.yaml | frametool view robot.yaml - --overlay -o b.html

    The page is self-contained and makes no network requests: rotate it, search, click a frame to see its transform from
    TARGET in every representation, play moving frames. Robots have a slider for each joint, and their boxes, cylinders,
    spheres and capsules are drawn. TREE is a file, a recording, - for standard input, or . for the file that
    FRAMETOOL_TREE names.
    """
    tree, target, source, output = inputs.tree, inputs.target, inputs.source, inputs.output
    chosen = _format(inputs.fmt, output, opens=inputs.opens)
    refuse_existing(output, force=inputs.force)
    if chosen == "png":
        from frametool.view.pictures import require_matplotlib

        require_matplotlib()
    overlay, eye = inputs.overlay, inputs.peek("eye") if chosen == "glb" else inputs.eye  # a glb has no view point
    refuse(overlay and (source or not target), "--overlay takes two trees: frametool view AFTER BEFORE --overlay")
    refuse(inputs.path_only and not (target and source), "--path draws the way between TARGET and SOURCE; name both")
    frames = load_tree(inputs, tree, inputs.more)
    scene, before = _scenes(inputs, frames, overlay=overlay)
    gone = [name for name, track in scene.tracks.items() if not track.covers(scene.at_ns or 0)]
    if gone and chosen != "html":  # a page shows their nearest time
        say(f"note: no data of {listing(gone, 5)} at {format_stamp(scene.at_ns or 0)}: not drawn, nor what hangs there")
    if chosen == "text" and output is None:
        color = inputs.color
        if sys.stdout.isatty():
            from frametool.view.terminal import print_terminal

            print_terminal(scene, eye, color)
            return
    sliders = chosen == "html" and not overlay and not inputs.no_sliders
    inputs.refuse_unused()
    content = _content(inputs, scene, chosen, eye, before, sliders=sliders)
    path = output
    if inputs.opens and path is None:
        from tempfile import NamedTemporaryFile

        with NamedTemporaryFile(prefix="frametool_", suffix=".html", delete=False) as page:
            path = page.name
    with writing(path, force=inputs.force or output is None) as write:
        write(content)
    if inputs.opens and path:
        import webbrowser
        from pathlib import Path

        say(f"the page is {path}")
        webbrowser.open(Path(path).absolute().as_uri())


def _scenes(inputs: Inputs, frames: Frames, *, overlay: bool) -> tuple[FrameScene, FrameScene | None]:
    """Return the scene of a tree and, for --overlay, that of the second tree in the same frame and at the same time."""
    from frametool.view.frame_scene import FrameScene

    ends = {} if overlay else {"target": inputs.target, "source": inputs.source}
    names = ends | {"fixed": inputs.fixed, "below": inputs.below}
    named: Any = {key: name and frame_name(name, frames) for key, name in names.items()}
    scene = FrameScene(frames, at_ns=lookup_time_ns(inputs.at), only=inputs.only, path_only=inputs.path_only, **named)
    if not overlay:
        return scene, None
    before = load_tree(inputs, str(inputs.target))
    return scene, FrameScene(before, at_ns=scene.at_ns, fixed=scene.fixed, ground=scene.ground)


def _format(fmt: str | None, output: str | None, *, opens: bool) -> str:
    """Choose the format: that of --format, else by the file's suffix, else text; with --open html."""
    suffix = os.path.splitext(output or "")[1].lower()
    chosen = fmt or SUFFIXES.get(suffix) or ("html" if opens else None)
    if chosen is None and suffix and output != "-":
        raise click.UsageError(f"no format has the suffix {shown(suffix)}; give --format {'|'.join(PICTURES)}")
    refuse(opens and (chosen != "html" or output == "-"), "--open shows a page: give -o FILE.html, or no -o")
    return chosen or "text"


def _content(
    inputs: Inputs, scene: FrameScene, fmt: str, eye: Eye, before: FrameScene | None, *, sliders: bool
) -> str | bytes:
    """Return the picture in a format, and report what a still picture does not show."""
    tree: str = inputs.tree
    title, other = (os.path.basename(each) if len(each) < 200 else "tree" for each in (tree, str(inputs.target)))
    if fmt == "html":
        from frametool.view.exports import write_page

        return write_page(
            scene, title=title, file=tree, eye=eye, other=before, other_title=other, sliders=sliders,
            solids=_solids(inputs, tree) if scene.tree.robots and not before else (),
        )  # fmt: skip
    if fmt == "glb":
        from frametool.view.exports import write_glb

        return write_glb(scene)
    if fmt == "text":
        from shutil import get_terminal_size

        from frametool.view.terminal import terminal_text

        return terminal_text(scene, *get_terminal_size((100, 30)), eye)
    from frametool.view.exports import still_picture
    from frametool.view.pictures import write_picture

    still = still_picture(scene, eye, title, before)
    for note in still.notes:
        say(f"note: {note}")
    return write_picture(still, f".{fmt}")


def _solids(inputs: Inputs, tree: str) -> list[Solid]:
    """Return the solids in a robot's file; report solids that are not drawn, and meshes, which are drawn as boxes."""
    from frametool.formats.robots.model import read_solids

    if not os.path.isfile(tree_file(tree)):
        return []
    (file,) = opened(inputs, [tree])
    with closing(file):
        try:
            solids = read_solids(file, file.format)
        except FormatError as error:
            say(f"note: solids not drawn: {str(error).partition(chr(10))[0]}")
            return []
    if meshes := sum(each.kind == "mesh" for each in solids):
        say(f"note: {meshes} mesh{'es' * (meshes > 1)} drawn as boxes; mesh files are not read")
    return solids
