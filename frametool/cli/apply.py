"""`frametool apply`: points, vectors and poses moved into another frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import TEXT, Command, pose_options, result_options, rotation_options
from frametool.cli.output import Output
from frametool.cli.poses import is_inline, poses_from, source_of, usage_if_inline
from frametool.cli.trees import FRAME, frame_name, load_tree
from frametool.errors import FormatError, ValueInvalid
from frametool.formats.numbers import parse_number
from frametool.formats.pose import Pose
from frametool.formats.records import Point, read_moveables
from frametool.geometry import quaternion, rigid

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from frametool.frames.tree import FrameTree

CHOICES = ("point", "vector", "pose")


@click.command(cls=Command, name="apply")
@click.argument("arguments", nargs=-1, type=FRAME, metavar="[TREE TARGET [SOURCE]] [X Y Z | RECORD]..")
@click.option("--transform", "pose", type=TEXT, metavar="POSE", help="move by this pose instead of a lookup")
@click.option("--as", "kind", type=click.Choice(CHOICES), help="what the records are  [default: as they look]")
@click.option("--with", "more", multiple=True, type=TEXT, metavar="FILE", help="merge this tree too; may be repeated")
@rotation_options
@pose_options
@result_options("points")
def command(arguments: tuple[str, ...], pose: str | None, more: Sequence[str], deg: bool, normalize: bool, kind: str | None, **options: Any) -> None:  # noqa: E501, FBT001
    """Move points, vectors and poses from SOURCE into TARGET.

    \b
      frametool apply robot.yaml map camera_optical 0 0 1
      frametool apply --transform '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}' 1 0 0
      frametool apply robot.yaml map '{frame: lidar, point: [1, 0, 0]}'

    A RECORD with a rotation is a pose, {vector: [x, y, z]} is rotated only, three numbers are a point. Without SOURCE
    each record says its own frame; without records standard input is read.
    """
    output = Output("points", deg=deg, **options)
    if pose is None:
        frames, target, source, rest = _tree_and_frames(arguments, more)
    else:
        rest = arguments
        edge = _one_pose(pose, degrees=deg, normalize=normalize)
        frames, target, source = None, edge.parent, edge.name
    moved = []
    for record in _records(rest, kind, degrees=deg, normalize=normalize):
        start = _start(record, source)
        transform = edge.components if frames is None else _lookup(frames, target, start)
        moved.append(move(record, transform, target))
    output.moved(moved)


def move(record: Pose | Point, target_from_source: Sequence[float], target: str | None) -> Pose | Point:
    """Give a record as seen from the target: points shift and rotate, vectors rotate, poses compose."""
    if isinstance(record, Pose):
        return Pose.of(rigid.compose(*target_from_source, *record.components), record.name, target)
    if record.is_vector:
        x, y, z = quaternion.rotate(*target_from_source[3:], *record.position)
    else:
        x, y, z = rigid.apply(*target_from_source, *record.position)
    return record._replace(position=(x, y, z), frame=target)


def _tree_and_frames(
    arguments: Sequence[str], more: Sequence[str],
) -> tuple[FrameTree, str, str | None, Sequence[str]]:
    """Split the arguments: the tree, the target, the source if one is named, and the records."""
    if len(arguments) < 2:
        raise click.UsageError("name TREE and TARGET, or give --transform")
    tree = load_tree(arguments[0], more)
    target, rest = frame_name(arguments[1], tree), arguments[2:]
    if not rest or is_record(rest[0]):
        return tree, target, None, rest
    return tree, target, frame_name(rest[0], tree), rest[1:]


def is_record(argument: str) -> bool:
    """Tell a record from a frame's name."""
    return argument == "-" or is_inline(argument)


def _one_pose(argument: str, *, degrees: bool, normalize: bool) -> Pose:
    poses = poses_from(argument, degrees=degrees, normalize=normalize)
    if len(poses) != 1:
        raise click.UsageError(f"--transform takes one pose, {argument} holds {len(poses)}")
    return poses[0]


def _records(arguments: Sequence[str], kind: str | None, *, degrees: bool, normalize: bool) -> Iterator[Pose | Point]:
    """Read the records: bare numbers in threes, mappings, standard input."""
    pending: list[str] = []
    for argument in arguments or ("-",):
        if not is_record(argument):
            pending.append(argument)
            continue
        yield from _points(pending, kind)
        pending = []
        yield from _read(argument, kind, degrees=degrees, normalize=normalize)
    yield from _points(pending, kind)


def _points(texts: Sequence[str], kind: str | None) -> Iterator[Point]:
    """Take bare numbers three at a time."""
    if kind == "pose" and texts:
        raise click.UsageError("a pose is a mapping, e.g. '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}'")
    try:
        numbers = [parse_number(text) for text in texts]
    except ValueInvalid as error:
        raise click.UsageError(f"{error}; a point is three numbers or a mapping") from None
    if len(numbers) % 3:
        raise click.UsageError(f"points are three numbers each, found {len(numbers)}")
    for at in range(0, len(numbers), 3):
        x, y, z = numbers[at : at + 3]
        yield Point((x, y, z), kind or "point")


def _read(argument: str, kind: str | None, *, degrees: bool, normalize: bool) -> Iterator[Pose | Point]:
    """Read records from a mapping or from standard input, and take them for what --as says."""
    try:
        records = read_moveables(source_of(argument), degrees=degrees, normalize=normalize)
    except FormatError as error:
        raise usage_if_inline(error) from None
    for record in records:
        if kind == "pose" and isinstance(record, Point):
            yield Pose(record.position, None, record.name, record.frame)
        elif kind in ("point", "vector") and isinstance(record, Pose):
            raise ValueInvalid(f"a record has a rotation and cannot be taken for a {kind}")
        elif kind == "vector" and isinstance(record, Point):
            yield record._replace(key="vector")
        else:
            yield record


def _start(record: Pose | Point, source: str | None) -> str | None:
    """Settle the frame a record is given in: its own, which must be SOURCE where both are known."""
    own = record.parent if isinstance(record, Pose) else record.frame
    if own is not None and source is not None and own != source:
        raise ValueInvalid(f"a record is given in {own!r}, not in {source!r}; leave SOURCE out to use each record's own frame")
    return own or source


def _lookup(tree: FrameTree, target: str | None, source: str | None) -> Sequence[float]:
    if source is None or target is None:
        raise ValueInvalid("a record does not say its frame; name SOURCE, or write {frame: .., point: [..]}")
    return tree.lookup(target, source).components
