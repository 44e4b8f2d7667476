"""`frametool convert`: one rotation or pose in other representations."""

from __future__ import annotations

from contextlib import suppress
from math import radians
from typing import TYPE_CHECKING, Any

from frametool.cli import options, poses
from frametool.cli.command import FILE, Inputs, argument, command_named, misuse, option, refuse
from frametool.cli.output import QUATERNION, Output
from frametool.cli.sink import say
from frametool.cli.streaming import EXPLAIN, ONE_RECORD, Task, one_argument, pose_stream_options
from frametool.documents.source import Source
from frametool.errors import ValueInvalid
from frametool.geometry import floats
from frametool.geometry.representations import REPRESENTATIONS, Notation, notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import Result, Style, is_locked
from frametool.rows.request import Operation
from frametool.text.numbers import parse_angle, parse_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.explain.derive import OtherAxes


_REPRESENTATIONS = f"Representations: {', '.join(row.spelling for row in REPRESENTATIONS.values())}."


@command_named("convert", own=("from_rep", "notations"),
    lists=lambda formatter, _everything: formatter.write_text(_REPRESENTATIONS))  # fmt: skip
@argument("values", FILE, nargs=-1, metavar="[VALUES.. | POSE]")
@option("--axes NAME", "the pose at the same place in these axes (help axes)", options.AXIS)
@option("--world-axes A_from_B", "axes of the reference frame (help axes)", options.AXIS, name="world")
@option("--all-axes A_from_B", "axes of both: unity_from_ros, or x,-y,-z", options.AXIS, excludes=("axes", "world"))
@option("--find A,B,C", "Euler conventions with these angles (help euler)")
@option("--tolerance RAD", "tolerance of --find  [default: 1e-06]", parse_number, requires=("find",), default=1e-6)
@pose_stream_options
@options.pose_result_options("poses", "points")
@options.frames_out_option
@EXPLAIN
@option("--unwrap", "continue angles beyond half a turn")
@option("--time-column NAME", "column or key of the timestamps, for the next three", options.COLUMN,
    requires=("time_offset", "start", "stop"), under="Time")  # fmt: skip
@options.limit_options
def convert_command(inputs: Inputs) -> int:
    """Write one rotation or pose in other representations.

    \b
      frametool convert --from rpy_deg 0 0 90
      frametool convert '{xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}' --to matrix
      frametool convert --all-axes unity_from_ros '{rpy_deg: [0, 0, 90]}'
      frametool convert --from rpy_deg 10 20 30 --find 30,20,10 --deg

    VALUES are numbers in the order of the representation, after x y z when there is a position; an angle may carry
    its unit: 90deg, 1.57rad, pi/2. POSE is a mapping, what a tool printed (help pose), a file, or - for stdin.
    """
    values, task = poses.rejoined(inputs.values), Task(inputs, "poses", "points")
    output, axes, world, operation = task.output, inputs.axes, inputs.world, Operation()
    if {axes, world, inputs.all_axes} != {None}:
        axes, world, operation = _change_of_axes(axes, world, inputs.all_axes)
    if task.plan:
        one_argument(values[0] if values else axes or world)
    notations = output.notations or QUATERNION
    request = task.request(operation=operation, stamp_or_weight_column=inputs.time_column, notations=notations)
    if operation.turns and (values or task.path or task.has_input()):
        _report_axes(axes, world, request.rows.given, output, is_anew=bool(values) and values != ("-",))
    is_numbers = _are_numbers(values, has_from=request.rows.given is not None or bool(request.rows.given_place))
    if is_numbers and request.rows.given_place:
        from frametool.cli.earth_options import mapping_of

        values, is_numbers = (mapping_of(inputs, values, request.rows.given_place),), False
    is_alone = operation.turns and not values and (task.plan or not task.has_input())
    streamed = None if is_numbers or is_alone else task.stream_request(values, request)
    if streamed or not (is_numbers or all(map(poses.is_inline, values))):
        request = (streamed or request).with_results(unwrap=inputs.unwrap)
    if streamed:
        refuse(task.plan, f"{''.join(values)} is a stream; {ONE_RECORD}")
        return task.run(request)
    task.only_arguments(values)
    results: list[Any]
    sources: Sequence[str | Source] = ()
    if is_numbers or not values:
        pose = poses.pose_from_numbers(values, request) if values else Pose()
        moved = operation.pose([pose.components], None, floats)
        position = pose.position if pose.position is None or operation.keeps_position else moved[:3]
        results = [Result(Pose(position, moved[3:7], pose.name, pose.parent))]
    else:
        sources = [poses.pose_source(each, request) for each in values] if task.plan else values
        results = list(poses.values_of(sources, request, output))
    found = [each.pose for each in results if isinstance(each, Result)]
    if inputs.find is not None:
        output.style = _matching_style(found, inputs.find, inputs.tolerance, output.style)
    if task.plan:
        refuse(len(found) != 1, f"--explain derives one pose, found {len(found)}")
        source = sources[0] if sources else _source_of(values, request.rows.given, pose if values else found[0])
        change = _named_change(axes, world, operation) if values else None
        return task.derive("convert", task.read_written(source, warned=True), own=found[0], change=change)
    output.values(results)
    if len(found) == 1 and any(is_locked(found[0], each) for each in output.style.notations):
        say("note: gimbal lock: the angles are not unique; the third was set to 0")
    return 0


def _source_of(values: Sequence[str], default: Notation | None, pose: Pose) -> Source:
    """Return the pose to derive as a mapping: bare numbers as written; for a heading or without numbers `pose`."""
    from frametool.documents.writers import dump_json
    from frametool.grammar.pasted import mapping_of_numbers

    if values and not (default and default.representation.on_earth):
        return Source(poses.INLINE, dump_json(mapping_of_numbers(values, default)))
    return Source(poses.INLINE, dump_json(Result(pose).mapping(Style("json", (notation("xyzw"),), keep_sign=True))))


def _are_numbers(values: Sequence[str], *, has_from: bool) -> bool:
    """Return True for bare numbers, False for mappings and files; a single word is a number only with --from."""
    if not values or poses.is_inline(values[0]):
        return False
    with suppress(ValueInvalid):
        return len(values) > 1 or (bool(parse_angle(values[0])) and has_from)
    return False


def _matching_style(poses: Sequence[Pose], find: str, tolerance: float, style: Style) -> Style:
    """Return a style with the Euler conventions in which three angles are the rotation of a pose."""
    from frametool.geometry.conventions import find_euler
    from frametool.geometry.transform import Rotation

    refuse(len(poses) != 1 or poses[0].rotation is None, "--find is about one rotation")
    with misuse("--find: "):
        read = [parse_angle(text) for text in find.split(",")]
    refuse(len(read) != 3, f"--find takes three angles like 0.1,0,pi/2; found {len(read)}")
    degrees = style.degrees
    angles = [radians(angle) if unit == "deg" or (degrees and unit is None) else angle for angle, unit in read]
    axes = find_euler(Rotation.of(*poses[0].components[3:7]), angles, tolerance=tolerance)
    return style.changed(notations=tuple(notation(f"{'euler_deg' if degrees else 'euler'}:{each}") for each in axes))


def _change_of_axes(axes: str | None, world: str | None, both: str | None) -> tuple[str | None, str | None, Operation]:
    """Return the conventions of --axes and --world-axes, or --all-axes for both, and their operation."""
    from frametool.geometry.conventions import both_sides, sides_of

    if both is not None:
        with misuse("--all-axes: "):
            world, axes = sides_of(both)
    with misuse():
        left, mirrors, right = both_sides(world, axes)
    before = (0.0, 0.0, 0.0, *left.components) if left is not None else None
    behind = ((0.0, 0.0, 0.0, *right.components),) if right is not None else ()
    return axes, world, Operation(before, behind, turns=True, mirrors=mirrors)


def _named_change(axes: str | None, world: str | None, operation: Operation) -> OtherAxes | None:
    """Return the change of axes for a derivation, None without one."""
    from frametool.explain.derive import OtherAxes

    left = (world, operation.left[3:]) if world and operation.left else None
    right = (axes, operation.right[0][3:]) if axes and operation.right else None
    return OtherAxes(left, right, operation.mirrors) if left or right else None


def _report_axes(
    axes: str | None, world: str | None, read_as: Notation | None, output: Output, *, is_anew: bool
) -> None:
    """Report which axes changed and which did not, and where units and angles of engines differ from frametool's.

    is_anew: the result is not a stream, so that positions can be written in the unit of the engine
    """
    from frametool.geometry.conventions import ENGINE_ANGLES, IN_CENTIMETRES, other_side

    changed, unchanged, option = ("world", "body", "--axes") if world else ("body", "world", "--world-axes")
    if not (axes and world) and (other := other_side(world or axes or "", of_world=bool(world))):
        say(f"note: only the {changed} axes changed; the {unchanged} axes are as before ({option} {other})")
    into, _, out_of = (world or "").partition("_from_")
    if into == IN_CENTIMETRES:
        separate = not any(each.representation.whole for each in output.notations)
        in_cm = is_anew and separate and output.style.format in ("text", "yaml", "json")
        output.style = output.style._replace(in_cm=in_cm)
        here = "is written as xyz_cm" if in_cm else "stays in metres, or in the unit its name says"
        say(f"note: Unreal counts in centimetres: xyz {here}")
    if out_of == IN_CENTIMETRES:
        say("note: Unreal counts in centimetres: xyz is read as metres, xyz_cm and x_cm say them")
    for engine, wanted in ((into, output.notations), (out_of, (read_as,) if read_as else ())):
        if engine in ENGINE_ANGLES and any(each.representation.name == "rpy" for each in wanted):
            say(f"warning: rpy is not what {engine.title()} calls its angles; {ENGINE_ANGLES[engine]} is")
