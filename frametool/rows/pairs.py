"""Read the input of hand-eye calibration and of point matching: pairs of poses, and points with ids and weights.

- {gripper: {xyz: [..], rpy: [..]}, target: {..}}                      samples of frametool
- {effector_wrt_world: [16 numbers], object_wrt_sensor: [..]}          of moveit_calibration
samples: [{robot: {translation: .., rotation: ..}, tracking: {..}}]    of easy_handeye2 (`optical` in the first)
id,x,y,z,weight                                                        points, in any format that can hold them
"""

from __future__ import annotations

from contextlib import closing
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from frametool.documents.document import locate_many, parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, bare, first_of, shown, warn
from frametool.fit.pairing import between, nearest
from frametool.formats.detect import detect
from frametool.formats.table import FORMATS
from frametool.formats.trees.tree_reader import MOST_KEYS
from frametool.frames.trajectory import BODY, WORLD, Trajectory
from frametool.geometry.transform import Transform
from frametool.grammar.pose import COVARIANCE_KEYS, Pose, inverted
from frametool.grammar.readers import Misfit, Path, Reading, as_mapping, tell, within
from frametool.rows.batch import plain_cells
from frametool.rows.columns import listed
from frametool.rows.faults import BadRows
from frametool.rows.record import find_records, pose_of
from frametool.rows.request import NO_STAMPS, Request, RowOptions
from frametool.rows.samples import samples_of
from frametool.rows.shapes import POSE
from frametool.rows.sources.tables import open_table
from frametool.rows.trajectories import holds_tree
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.geometry import Array, Indices
    from frametool.grammar.edges import Answers
    from frametool.text.lines import ByteStream

ROBOT = "robot"
PARTNERS = {"gripper": ("target",), "effector_wrt_world": ("object_wrt_sensor",), ROBOT: ("tracking", "optical")}
LIKE = "{gripper: POSE, target: POSE}"
IDS, WEIGHT = ("id", "name"), "weight"
MOST_NAMED = 5
NEAR_NS = 50_000_000  # maximum between stamps of a gripper and a target that are paired


class HandEyeSamples(NamedTuple):
    """Pairs of poses: base_from_gripper and camera_from_target, (n,) each.

    places: of each pair, for messages; names: of base, gripper, camera and target, None if unknown
    files: their names; taken: how ambiguous keys of the format were interpreted
    placed: the poses have positions; else these are 0
    """

    gripper: Transform
    target: Transform
    places: list[str]
    names: tuple[str | None, ...]
    files: tuple[str, ...]
    taken: str = ""
    placed: bool = True


def read_samples(
    argument: str, *, eye_to_hand: bool, normalize: bool = False, fmt: str = "", columns: Sequence[str] = ()
) -> HandEyeSamples:
    """Read samples from one file: frametool's own, of moveit_calibration, of easy_handeye2, or a table with both poses.

    eye_to_hand: `robot` of easy_handeye is then gripper_from_base, and is inverted
    columns: of a table, those of the gripper and those of the target; by default those that begin with these words
    Raises FormatError with the place.
    """
    file = InputFile(argument)
    try:
        fmt = fmt or detect(file.head(), "rows", "records", name=file.path, otherwise="json")
        if columns or FORMATS[fmt].is_table:
            return _of_table(file, fmt, columns, normalize=normalize)
        source = file.source
    finally:
        file.close()
    reading = Reading(source, normalize=normalize)
    found: dict[Path, tuple[str, Pose, Pose]] = {}
    for document in parse_documents(source.text, source.name):
        value, at = document.value, tuple[Any, ...]((document.index,))
        if type(value) is dict and "samples" in value:
            value, at = value["samples"], (*at, "samples")
        is_list = type(value) is list
        try:
            for path, sample in [((*at, row), each) for row, each in enumerate(value)] if is_list else [(at, value)]:
                found[path] = _sample(sample, path, reading, eye_to_hand=eye_to_hand)
        except Misfit as misfit:
            raise misfit.placed(source) from None
    if not found:
        raise FormatError(f"no samples in it; each is {LIKE}", source=source.name)
    tell(source, reading.notes)
    places = [f"{source.name}:{line}" for line, _ in locate_many(source.text, [*found])]
    keys, *sides = zip(*found.values(), strict=True)
    names: list[str | None] = []
    for called in [[getattr(pose, role) for pose in side] for side in sides for role in ("parent", "name")]:
        known = [*dict.fromkeys(filter(None, called))]
        if len(known) > 1:
            place = places[called.index(known[1])]
            raise ValueInvalid(f"{place}: {shown(known[1])} is {shown(known[0])} in other samples")
        names += known or [None]
    taken = ""
    if ROBOT in keys:
        ways = ("gripper<-base, inverted", "with") if eye_to_hand else ("base<-gripper", "without")
        taken = f"robot is taken for {ways[0]}, as easy_handeye has it {ways[1]} --eye-to-hand"
    placed = any(pose.position is not None for side in sides for pose in side)
    gripper, target = (Transform.of(*np.array([pose.components for pose in side]).T.copy()) for side in sides)
    return HandEyeSamples(gripper, target, places, tuple(names), (source.name,), taken, placed=placed)


def _of_table(file: InputFile, fmt: str, columns: Sequence[str], *, normalize: bool) -> HandEyeSamples:
    """Read the poses of gripper and target from the rows of a table."""
    text = file.stream.read()
    names = open_table(text, fmt, header=True, source=file.name)[0].names or ()
    for first, others in () if columns else PARTNERS.items():
        found = [",".join(name for name in names if name.startswith(word)) for word in (first, *others)]
        columns = columns or [*filter(None, found)]
    if len(columns) != 2:
        what = "gripper_x .. and target_x ..; name those of each with --columns, twice"
        raise FormatError(f"no columns {what}; columns: {listed(names)}", source=file.name, line=1)
    sides, placed, places = list[Transform](), False, list[str]()
    for each in columns:
        asked = RowOptions(columns=(each,), normalize=normalize)
        poses = samples_of(BytesIO(text), fmt, asked, BadRows(file.name))
        missing = np.isnan(poses.numbers)
        if missing[0, -1]:
            raise FormatError(f"no rotation among the columns {each}", source=file.name, line=1)
        placed |= not missing[0, 0]
        sides.append(Transform.of(*np.where(missing, 0.0, poses.numbers).T.copy()))
        places = [f"{file.name}:{line}" for line in poses.lines.tolist()]
    return HandEyeSamples(sides[0], sides[1], places, (None,) * 4, (file.name,), placed=placed)


def paired_samples(
    gripper: Trajectory, target: Trajectory, files: tuple[str, str], max_gap_ns: int | None
) -> HandEyeSamples:
    """Pair poses: the gripper's at the target's stamps, or by row if not both have stamps.

    Within the maximum gap the gripper is interpolated, else the nearest pose within the gap is used.
    Raises ValueInvalid if nothing pairs.
    """
    names = [name if each.world != WORLD or each.body != BODY else None
             for each in (gripper, target) for name in (each.world, each.body)]  # fmt: skip
    for each, file in ((gripper, files[0]), (target, files[1])):
        if each.xyzw is None:
            raise ValueInvalid(f"{file}: positions alone are not poses: rotations are needed here")
    if gripper.stamps_ns is None or target.stamps_ns is None:
        if gripper.size != target.size:
            counts = f"{files[0]} has {gripper.size} poses, {files[1]} {target.size}"
            raise ValueInvalid(f"{counts}, and no stamps to pair them")
        kept: Indices = np.arange(target.size)
    else:
        gap_ns, dense = NEAR_NS if max_gap_ns is None else max_gap_ns, gripper.in_order()
        made, is_between = between(dense, target.stamps_ns, gap_ns)
        index, off = nearest(dense.stamps_ns, target.stamps_ns)
        gripper = dense.at(index)
        gripper.xyz[is_between], gripper.xyzw[is_between] = made.xyz, made.xyzw
        kept = np.flatnonzero(np.logical_or(is_between, off <= gap_ns))
        gap = f"{gap_ns / 1e6:g} ms"
        if not len(kept):
            apart = f"their stamps are {float(off.min()) / 1e9:.3f} s apart at least; one clock? --max-gap"
            raise ValueInvalid(f"no pose of {files[0]} is within {gap} of one of {files[1]}: {apart}")
        if alone := target.size - len(kept):
            warn(f"{files[1]}: {alone} of {target.size} poses have none of {files[0]} within {gap}: unpaired")
    places = [f"{files[1]} row {row + 1}" for row in kept.tolist()]
    if target.lines is not None:
        places = [f"{files[1]}:{line}" for line in target.lines[kept].tolist()]
    return HandEyeSamples(gripper.at(kept).poses, target.at(kept).poses, places, tuple(names), files)


def _sample(value: Any, path: Path, reading: Reading, *, eye_to_hand: bool) -> tuple[str, Pose, Pose]:
    """Return the key of a sample's first pose, base_from_gripper, and camera_from_target."""
    sample = within(path, as_mapping, value, f"a sample {LIKE}")
    first = next((key for key in PARTNERS if key in sample), None)
    if first is None:
        found = first_of([*sample], MOST_KEYS, quote=shown)
        raise Misfit(f"no sample; expected {LIKE}, found the keys {found}; two files are GRIPPER TARGET", path)
    second = next((key for key in PARTNERS[first] if key in sample), None)
    if second is None:
        raise Misfit(f"missing {PARTNERS[first][0]} beside {first}", path)
    gripper, target = (_pose(sample[key], (*path, key), reading) for key in (first, second))
    if first == ROBOT and eye_to_hand:
        gripper = inverted(gripper)._replace(name=gripper.parent, parent=gripper.name)
    return first, gripper, target


def _pose(value: Any, path: Path, reading: Reading) -> Pose:
    """Read a pose with a rotation from a record, or from the 16 numbers of a matrix."""
    if type(value) is list and len(value) == 16:
        value = [value[at : at + 4] for at in range(0, 16, 4)]
    request = Request(rows=RowOptions(kind=POSE, normalize=reading.normalize))
    records = [*find_records(value, request, reading, path)]
    found = pose_of(records[0], request)
    if len(records) > 1 or found.rotation is None:
        what = "the pose has no rotation" if len(records) == 1 else f"expected one pose, found {len(records)}"
        raise Misfit(what, path)
    if not {*COVARIANCE_KEYS}.isdisjoint(records[0].keys.others) or records[0].shape.covariance:
        reading.note("the covariance of a sample is not used: all count alike", rule="left-out")
    return found


class Points(NamedTuple):
    """The points of a file, (n, 3), in metres.

    ids, weights: of each point, None if the file has none; places: of each point, for messages
    frame: the frame that all are expressed in; None if unknown or if there are several
    """

    file: str
    xyz: Array
    ids: list[str] | None
    weights: list[float] | None
    places: list[str]
    frame: str | None


def read_points(argument: str, *, fmt: str, answers: Answers, policy: Callable[[str], BadRows]) -> Points:
    """Read the points of a file in any format that can hold them, with the columns `id` or `name`, and `weight`.

    Raises FormatError with the place.
    """
    with closing(InputFile(argument)) as file:
        fmt = fmt or detect(file.head(), "rows", "arrays", "records", name=file.path)
        if holds_tree(file, fmt):
            raise FormatError(f"no points in it: {FORMATS[fmt].summary}", source=file.name)
        stream, asked = cast("ByteStream", file.stream), RowOptions(stamps=NO_STAMPS)
        rows = samples_of(stream, fmt, asked, policy(file.name), (*IDS, WEIGHT), answers)
    if np.isnan(rows.numbers[:, 0]).any():
        raise FormatError("no positions in it: rotations alone are no points", source=file.name)
    row = " row " if "arrays" in FORMATS[fmt].reads else ":"
    places = [f"{file.name}{row}{line}" for line in rows.lines.tolist()]
    extras = {key: plain_cells(cells) for key, cells in rows.extras.items()}
    if len({*rows.names}) > 1:  # a name that all share identifies no point
        extras["name"] = [*rows.names]
    key = next((key for key in IDS if any(each is not None for each in extras.get(key, ()))), "")
    first: dict[str, str] = {}
    for label, place in zip(extras.get(key, ()), places, strict=False):
        if label is None:
            raise ValueInvalid(f"{place}: no {key}, the others have one")
        if (before := first.setdefault(str(label), place)) is not place:
            raise ValueInvalid(f"{place}: {key} {shown(str(label))} appears twice, first at {before}")
    weights: list[float] = []
    is_weighed = any(each is not None for each in extras.get(WEIGHT, ()))
    for text, place in zip(extras[WEIGHT], places, strict=True) if is_weighed else ():
        try:
            weights.append(parse_number(str(text)))
        except ValueInvalid as error:
            raise ValueInvalid(f"{place}: weight: {error}") from None
        if weights[-1] < 0.0:
            raise ValueInvalid(f"{place}: weight is negative: {text}")
    frame = rows.parents[0] if len({*rows.parents}) == 1 else None
    return Points(file.name, rows.numbers[:, :3], [*first] or None, weights or None, places, frame)


class Matched(NamedTuple):
    """The points of two files with the same id or row, (n, 3) each.

    places, ids: of the points in the first file
    """

    target: Array
    source: Array
    weights: list[float] | None
    places: list[str]
    ids: list[str] | None


def matched(a: Points, b: Points) -> Matched:
    """Match points by their ids, or by row if one file has none; warn about points without a partner.

    Raises ValueInvalid if nothing matches.
    """
    if a.ids is not None and b.ids is not None:
        of_b = {name: at for at, name in enumerate(b.ids)}
        rows = [at for at, name in enumerate(a.ids) if name in of_b]
        others = [of_b[a.ids[at]] for at in rows]
        if not rows:
            named = " | ".join(first_of(ids, MOST_NAMED, quote=bare) for ids in (a.ids, b.ids))
            raise ValueInvalid(f"{a.file} and {b.file} have no id in common: {named}")
        for one, two in ((a, b), (b, a)):
            known = {*(two.ids or ())}
            if alone := [name for name in one.ids or () if name not in known]:
                count = f"{len(alone)} of {len(one.xyz)} points have no partner in {two.file}"
                warn(f"{one.file}: {count}: {first_of(alone, MOST_NAMED, quote=bare)}")
    elif len(a.xyz) != len(b.xyz):
        raise ValueInvalid(f"{a.file} has {len(a.xyz)} points, {b.file} {len(b.xyz)}, and no ids to match them")
    else:
        rows = others = [*range(len(a.xyz))]
        if a.ids is not None or b.ids is not None:
            warn(f"{(a if a.ids is None else b).file} has no ids: points are matched row by row")
    own, other = (each.weights and [each.weights[at] for at in some] for each, some in ((a, rows), (b, others)))
    if own and other and own != other:
        raise ValueInvalid(f"{a.file} and {b.file} have different weights; keep one column {WEIGHT}")
    ids = a.ids or b.ids
    places = [a.places[at] for at in rows]
    return Matched(a.xyz[rows], b.xyz[others], own or other, places, ids and [ids[at] for at in rows])
