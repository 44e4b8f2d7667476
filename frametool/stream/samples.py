"""What hand-eye and matched points are solved from: pairs of poses, and points with their ids and weights.

- {gripper: {xyz: [..], rpy: [..]}, target: {..}}                      samples as one writes them
- {effector_wrt_world: [16 numbers], object_wrt_sensor: [..]}          of moveit_calibration
samples: [{robot: {translation: .., rotation: ..}, tracking: {..}}]    of easy_handeye2 (`optical` in the first)
id,x,y,z,weight                                                        points, in any format that holds such
"""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from frametool.documents.document import locate_many, parse_documents
from frametool.documents.source import InputFile
from frametool.errors import FormatError, ValueInvalid, bare, first_of, shown, warn
from frametool.formats.detect import detect
from frametool.formats.table import FORMATS
from frametool.formats.trees.tree_reader import MOST_KEYS
from frametool.geometry.transform import Transform
from frametool.grammar.edges import Answers
from frametool.grammar.pose import inverted, read_pose
from frametool.grammar.readers import Misfit, Reading, as_mapping, kind, tell, within
from frametool.stream.as_poses import FormatConverter
from frametool.stream.faults import BadRows
from frametool.stream.header import listed
from frametool.stream.record import value_at
from frametool.stream.record_values import pose_of, read_text
from frametool.stream.request import Operation, Request
from frametool.stream.row_poses import plain_cells
from frametool.stream.table import open_table
from frametool.stream.trajectories import TREE, gathered
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frametool.geometry.types import Array
    from frametool.grammar.edges import Answers
    from frametool.grammar.pose import Pose
    from frametool.grammar.readers import Path
    from frametool.text.lines import ByteStream

ROBOT = "robot"
PARTNERS = {"gripper": ("target",), "effector_wrt_world": ("object_wrt_sensor",), ROBOT: ("tracking", "optical")}
LIKE = "{gripper: POSE, target: POSE}"
IDS, WEIGHT = ("id", "name"), "weight"
MOST_NAMED = 5


class HandEyeSamples(NamedTuple):
    """Pairs of poses: base_from_gripper and camera_from_target, (n,) each.

    places: where each is; names: of base, gripper, camera and target, None where nothing says one
    files: what they are called; taken: how a format's own words were taken
    placed: whether they have positions; else these are 0
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
    """Read one file of samples: as one writes them, of moveit_calibration, of easy_handeye2, or a table of both poses.

    eye_to_hand: easy_handeye has gripper_from_base as `robot` then; it is inverted.
    columns: of a table, those of the gripper and those of the target; else they begin with these words
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
    found: list[tuple[Pose, Pose]] = []
    paths: list[Path] = []
    values: list[Any] = []
    for document in parse_documents(source.text, source.name):
        try:
            for path, value in _listed(document.value):
                values.append(value)
                reading.here = (document.index, *path)
                found.append(within(path, _sample, value, reading, eye_to_hand=eye_to_hand))
                paths.append(reading.here)
        except Misfit as misfit:
            raise misfit.placed(source, document.index) from None
    if not found:
        raise FormatError(f"no samples in it; each is {LIKE}", source=source.name)
    tell(source, reading.notes)
    places = [f"{source.name}:{line}" for line, _ in locate_many(source.text, paths)]
    sides = [[*each] for each in zip(*found, strict=True)]
    names = [_one_name(each, places) for side in sides for each in ([p.parent for p in side], [p.name for p in side])]
    taken = ""
    if any(ROBOT in value for value in values):
        ways = ("gripper<-base, inverted", "with") if eye_to_hand else ("base<-gripper", "without")
        taken = f"robot is taken for {ways[0]}, as easy_handeye has it {ways[1]} --eye-to-hand"
    placed = any(pose.position is not None for side in sides for pose in side)
    gripper, target = map(_batch, sides)
    return HandEyeSamples(gripper, target, places, tuple(names), (source.name,), taken, placed=placed)


def _of_table(file: InputFile, fmt: str, columns: Sequence[str], *, normalize: bool) -> HandEyeSamples:
    """Read the poses of gripper and target that are side by side in the rows of a table."""
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
        request = Request(Operation(moves=True), columns=(each,), normalize=normalize)
        poses = gathered(FormatConverter(fmt, request, file.name), BytesIO(text), BadRows(file.name))
        numbers = poses.numbers
        if numbers.shape[1] not in (4, 7):
            raise FormatError(f"no rotation among the columns {each}", source=file.name, line=1)
        placed |= numbers.shape[1] == 7
        sides.append(Transform.of(*np.pad(numbers, ((0, 0), (7 - numbers.shape[1], 0))).T.copy()))
        places = [f"{file.name}:{line}" for line in poses.lines.tolist()]
    return HandEyeSamples(sides[0], sides[1], places, (None,) * 4, (file.name,), placed=placed)


def _listed(value: Any) -> Iterator[tuple[Path, Any]]:
    """Yield the samples of a document with their paths."""
    path: Path = ()
    if type(value) is dict and "samples" in value:
        value, path = value["samples"], ("samples",)
    elif type(value) is dict and not PARTNERS.keys().isdisjoint(value):
        yield (), value
        return
    if type(value) is not list:
        found = f"the keys {first_of([*value], MOST_KEYS, quote=shown)}" if type(value) is dict else kind(value)
        raise Misfit(f"expected samples {LIKE}, found {found}; two files of poses are GRIPPER TARGET", path)
    yield from (((*path, at), each) for at, each in enumerate(value))


def _sample(value: Any, reading: Reading, *, eye_to_hand: bool) -> tuple[Pose, Pose]:
    """Read base_from_gripper and camera_from_target of one sample."""
    sample = as_mapping(value, f"a sample {LIKE}")
    first = next((key for key in PARTNERS if key in sample), None)
    if first is None:
        raise Misfit(f"no sample; expected {LIKE}, found the keys {first_of([*sample], MOST_KEYS, quote=shown)}")
    second = next((key for key in PARTNERS[first] if key in sample), None)
    if second is None:
        raise Misfit(f"missing {PARTNERS[first][0]} beside {first}")
    gripper, target = (within((key,), _pose, sample[key], reading) for key in (first, second))
    if first == ROBOT and eye_to_hand:
        gripper = inverted(gripper)._replace(name=gripper.parent, parent=gripper.name)
    return gripper, target


def _pose(value: Any, reading: Reading) -> Pose:
    """Read a pose in our grammar, as a matrix of 16 numbers, or as a message; it has a rotation."""
    if type(value) is list:
        if len(value) not in (4, 16):
            raise Misfit(f"expected the 16 numbers of a 4x4 matrix, found {len(value)}")
        rows = value if len(value) == 4 else [value[at : at + 4] for at in range(0, 16, 4)]
        return read_pose({"matrix": rows}, reading)
    pose = as_mapping(value, "a pose")
    header = pose.get("header")
    frames = {"parent": header.get("frame_id") if type(header) is dict else None, "name": pose.get("child_frame_id")}
    inner = pose.get("transform", {key: each for key, each in pose.items() if key not in ("header", "child_frame_id")})
    whole = as_mapping(inner, "a pose") | {key: name for key, name in frames.items() if type(name) is str and name}
    found = within(("transform",), read_pose, whole, reading) if "transform" in pose else read_pose(whole, reading)
    if found.rotation is None:
        raise Misfit("the pose has no rotation")
    if found.covariance is not None:
        reading.note("the covariance of a sample is not used: all count alike", rule="left-out")
    return found


def _batch(poses: Sequence[Pose]) -> Transform:
    return Transform.of(*np.array([pose.components for pose in poses]).T.copy())


def _one_name(names: Sequence[str | None], places: Sequence[str]) -> str | None:
    """Return the one name that samples give a frame; raises ValueInvalid where they give several."""
    known = [*dict.fromkeys(filter(None, names))]
    if len(known) > 1:
        raise ValueInvalid(f"{places[names.index(known[1])]}: {shown(known[1])} is {shown(known[0])} in other samples")
    return known[0] if known else None


class Points(NamedTuple):
    """Points of a file, (n, 3), metres.

    ids, weights: of each, None where the file has none; places: where each is; frame: the one they are expressed in
    """

    file: str
    xyz: Array
    ids: list[str] | None
    weights: list[float] | None
    places: list[str]
    frame: str | None


def read_points(argument: str, *, fmt: str, answers: Answers, policy: Callable[[str], BadRows]) -> Points:
    """Read the points of a file in any format that holds such, with what is called `id` or `name`, and `weight`.

    Raises FormatError with the place.
    """
    import re

    file = InputFile(argument)
    try:
        fmt = fmt or detect(file.head(), "rows", "arrays", "records", name=file.path)
        if "records" in FORMATS[fmt].reads and not re.search(TREE, file.head()):
            return _of_documents(file)
        return _of_rows(file, fmt, answers, policy(file.name))
    finally:
        file.close()


def _of_rows(file: InputFile, fmt: str, answers: Answers, bad: BadRows) -> Points:
    """Gather the points of a table, or of columns of numbers."""
    if {"rows", "arrays"}.isdisjoint(FORMATS[fmt].reads):
        raise FormatError(f"no points in it: {FORMATS[fmt].summary}", source=file.name)
    converter = FormatConverter(fmt, Request(Operation(moves=True)), file.name, answers=answers)
    poses = gathered(converter, cast("ByteStream", file.stream), bad, (*IDS, WEIGHT))
    if poses.numbers.shape[1] < 3 or not converter.placed:
        raise FormatError("no positions in it: rotations alone are no points", source=file.name)
    extra: dict[str, list[Any]] = dict.fromkeys((*IDS, WEIGHT), [None] * len(poses.numbers))
    extra |= {key: plain_cells(cells) for key, cells in poses.extras.items()}
    if poses.names[0] is not None:
        extra[IDS[1]] = [*poses.names]
    on_lines = "arrays" not in FORMATS[fmt].reads
    lines = enumerate(poses.lines.tolist(), 1)
    places = [f"{file.name}:{line}" if on_lines else f"{file.name} row {at}" for at, line in lines]
    return _points(file.name, poses.numbers[:, :3], extra, places, {*poses.parents})


def _of_documents(file: InputFile) -> Points:
    """Gather the points of YAML or JSON."""
    source, request = file.source, Request()
    xyz: list[Any] = []
    extra: dict[str, list[Any]] = {key: [] for key in (*IDS, WEIGHT)}
    paths: list[Path] = []
    frames: set[str | None] = set()
    known = read_text(source, request)
    for record in known.records:
        position = pose_of(record, request).position
        if position is None:
            raise Misfit("expected a point {id: .., xyz: [x, y, z]}", record.path).placed(source)
        xyz.append(position)
        paths.append(record.path)
        frames.add(record.parent.text)
        around = _around(known.values, record.path)
        for key, cells in extra.items():
            cells.append(around.get(key))
    if not xyz:
        raise FormatError("no points in it; each is {id: .., xyz: [x, y, z]}", source=source.name)
    places = [f"{source.name}:{line}" for line, _ in locate_many(source.text, paths)]
    return _points(source.name, np.array(xyz, float), extra, places, frames)


def _around(documents: dict[int, Any], path: Path) -> dict[str, Any]:
    """Return the members of a record and of the mappings that hold it, up to the item of a list that it is."""
    found: dict[str, Any] = {}
    for depth in range(len(path), 0, -1):
        value = value_at(documents, path[:depth])
        if type(value) is dict:
            found = {key: each for key, each in value.items() if type(each) is str} | found
        if depth > 1 and type(path[depth - 1]) is int:
            break
    return found


def _points(
    file: str, xyz: Array, extra: dict[str, list[Any]], places: list[str], frames: set[str | None]
) -> Points:
    """Check ids and weights."""
    key = next((key for key in IDS if any(each is not None for each in extra[key])), None)
    ids = None if key is None else [str(each) for each in extra[key]]
    if key is not None and ids is not None:
        first: dict[str, str] = {}
        for label, place in zip(extra[key], places, strict=True):
            if label is None:
                raise ValueInvalid(f"{place}: no {key}, the others have one")
            if (before := first.setdefault(label, place)) is not place:
                raise ValueInvalid(f"{place}: {key} {shown(str(label))} appears twice, first at {before}")
    weights = None
    if any(each is not None for each in extra[WEIGHT]):
        weights = [_weight(each, place) for each, place in zip(extra[WEIGHT], places, strict=True)]
    frame = frames.pop() if len(frames) == 1 else None
    return Points(file, xyz, ids, weights, places, frame)


def _weight(text: Any, place: str) -> float:
    try:
        weight = parse_number(str(text))
    except ValueInvalid as error:
        raise ValueInvalid(f"{place}: weight: {error}") from None
    if weight < 0.0:
        raise ValueInvalid(f"{place}: weight is negative: {text}")
    return weight


class Matched(NamedTuple):
    """Points of two files that belong together, (n, 3) each.

    places, ids: of each in the first file
    """

    target: Array
    source: Array
    weights: list[float] | None
    places: list[str]
    ids: list[str] | None


def matched(a: Points, b: Points) -> Matched:
    """Match points by their ids, or row by row where one file has none; warn of what has no partner.

    Raises ValueInvalid where nothing matches.
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
