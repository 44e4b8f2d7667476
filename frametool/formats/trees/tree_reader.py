"""Frame trees in YAML and JSON, and of Apollo: nested, as a list, or as ROS messages; documents in, edges out.

    frames: {base: {lidar: {xyz: [0.9, 0, 2], rpy_deg: [0, 0, 90]}}}          nested: a root's keys are its children
    frames: [{name: lidar, parent: base, xyz: [0.9, 0, 2]}]                   list, any order
    frames: {lidar: {parent: base, xyz: [0.9, 0, 2]}}                         by name, any order
    {name: lidar, parent: base, xyz: [0.9, 0, 2]}                             one edge, as `lookup` prints it
    {name: base, parent: odom, samples: [{stamp: 0.5, xyz: [1, 0, 0]}]}       a moving frame; seconds
    {name: map, at: {lat: 48.1, lon: 11.5, alt: 520}, axes: enu}              a position on the Earth, in `ecef`

Metres, radians unless a key states degrees; every pose is that of the frame in its parent: parent_from_child.
Other formats in YAML and JSON use `edges_of` and `document_edges`, which do not depend on the keys of a format.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.documents.document import Document, locate_many, parse_documents
from frametool.errors import Finding, FormatError, alternatives, bare, first_of, shown
from frametool.frames.stamps import parse_stamp
from frametool.geometry.rigid import IDENTITY
from frametool.grammar import readers
from frametool.grammar.edges import Diagnostics, Edge, Options
from frametool.grammar.pose import COVARIANCE_KEYS, NAMES, POSE_KEYS, Pose, read_angle_unit, read_name, read_pose
from frametool.grammar.readers import AXES_KEY, Misfit, Path, Reading, as_mapping, kind, may_be_on_earth, tell, within
from frametool.ros import messages
from frametool.text.numbers import parse_number

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

    from frametool.documents.source import InputFile, Source

    Take = Callable[[Any, Reading], Iterable[Edge]]

TREE_KEYS = frozenset(("frames", "angles"))
STAMP_KEYS = frozenset(("stamp", "stamp_ns"))
TIMED = frozenset(("samples", "camera", *STAMP_KEYS))
NESTED = TIMED | {"children"}
XYZ = ("x", "y", "z")
MOST_KEYS, MOST_CHARACTERS = 5, 80  # of a mapping in a message
NO_NAME = "is in place of a frame's name: a root has no pose, its keys are its children"
CAMERA_KEYS = ("model", "K", "D", "size", "skew", "xi", "alpha", "beta", "w", "axes", "R", "P")
LOOSE = frozenset(("x", "roll", "yaw", "theta", "qw", "yaw_deg", "x_mm"))  # keys of poses with one key per number


def read(file: InputFile, options: Options) -> Iterator[Edge]:
    """Yield the edges of a text of trees, then emit its warnings."""
    notes: list[Finding] = []
    yield from edges_of(parse_documents(file.source.text, file.name), read_edges, notes, normalize=options.normalize)
    tell(file.source, notes)


def edges_of(
    documents: Iterable[Document], take: Take, notes: list[Finding], faults: list[Misfit] | None = None, *,
    normalize: bool = False, bare_numbers: bool = False,
) -> Iterator[Edge]:  # fmt: skip
    """Yield the edges that `take` finds in each document, with their paths from the top of the text.

    take: function of a document's value and a Reading that returns edges with paths relative to the document; raises
        Misfit, or collects it with `reading.refuse`
    notes, faults: receive warnings and errors, with such paths too; without `faults` errors raise FormatError
    """
    for document in documents:
        reading = Reading(document.source, normalize=normalize)
        reading.faults, reading.bare_numbers = None if faults is None else [], bare_numbers
        try:
            for edge in take(document.value, reading):
                found = edge
                if edge.child[0] == "/" or (edge.parent or "")[:1] == "/":  # one leading slash is removed, as by tf2
                    reading.here = edge.path
                    child = reading.bare(edge.child)
                    found = edge._replace(child=child, parent=edge.parent and reading.bare(edge.parent))
                yield found._replace(path=(document.index, *edge.path))
        except Misfit as misfit:
            if reading.faults is None:
                raise misfit.placed(document.source, document.index) from None
            reading.faults.append(misfit)
        if faults is not None:
            faults += [fault.below(document.index) for fault in reading.faults or ()]
        notes += [note._replace(path=(document.index, *note.path)) for note in reading.notes]


def read_edges(value: Any, reading: Reading) -> Iterator[Edge]:
    """Yield the edges of one document, in its order.

    Raises Misfit with the path from the document's top.
    """
    reading.framed = True
    if type(value) is list:
        yield from _entries(value, (), reading)
    elif type(value) is not dict:
        as_mapping(value, "a frame tree")
    elif "frames" in value:
        if not TREE_KEYS.issuperset(value):
            unknown = next(key for key in value if key not in TREE_KEYS)
            raise Misfit(f"unknown key {shown(unknown)} next to frames; expected angles", (unknown,), key=True)
        if "angles" in value:
            reading.degrees = read_angle_unit(value["angles"])
        frames = value["frames"]
        if type(frames) is list:
            yield from _entries(frames, ("frames",), reading)
        elif frames is not None:
            for name, entry in as_mapping(frames, "a mapping of root frames or a list of entries").items():
                if type(entry) is dict and type(entry.get("parent")) is str:
                    yield from _below(entry.pop("parent"), {name: entry}, ("frames",), reading)
                else:
                    yield Edge(None, name, IDENTITY, path=("frames", name))
                    yield from _below(name, entry, ("frames", name), reading)
    elif messages.is_message(value):
        yield from _messages(value, (), reading)
    elif not NAMES.isdisjoint(value):
        yield from _entry(value, (), reading)
    else:
        is_long = len("".join([*value][:MOST_KEYS])) > MOST_CHARACTERS
        raise Misfit(
            f"no frame tree: expected frames:, transforms: or an entry with name: and parent:; "
            f"found the keys {first_of([*value], 1 if is_long else MOST_KEYS, quote=shown)} (frametool help frames)",
        )


def _below(root: str, children: Any, path: Path, reading: Reading) -> Iterator[Edge]:
    """Yield the edges of one nested tree, parents before children; with a stack, so that any depth works."""
    pending = [(root, children, path)]
    while pending:
        parent, entries, path = pending.pop()
        deeper = []
        try:
            entries = as_mapping({} if entries is None else entries, "the children as a mapping by name")
        except Misfit as misfit:
            reading.refuse(misfit.below(*path))
            continue
        for child, entry in entries.items():
            here = reading.here = (*path, child)
            try:
                fields = {} if entry is None else entry
                if type(fields) is not dict:
                    if child in POSE_KEYS:
                        raise Misfit(f"{shown(child)} {NO_NAME}", key=True)
                    as_mapping(fields, f"the pose of frame {shown(child)}")  # raises
                if names := NAMES.intersection(fields):
                    raise Misfit(f"{min(names)} is defined by the nesting; remove it", (min(names),), key=True)
                pose = _pose(fields, reading, NESTED)
                yield from _edges(fields, pose, _above(pose, parent, fields), child, here, reading)
            except Misfit as misfit:
                reading.refuse(misfit.below(*here))
            if type(entry) is dict and "children" in entry:
                deeper.append((child, entry["children"], (*here, "children")))
        pending.extend(reversed(deeper))


def _entries(entries: list[Any], path: Path, reading: Reading) -> Iterator[Edge]:
    """Yield the edges of a list of entries, frametool's or ROS messages."""
    for index, entry in enumerate(entries):
        here = (*path, index)
        reading.here = here
        if type(entry) is dict and messages.is_message(entry):
            yield from _messages(entry, here, reading)
        else:
            yield from _entry(entry, here, reading)
        entries[index] = None  # frees the memory of a million entries


def _entry(entry: Any, path: Path, reading: Reading) -> list[Edge]:
    """Read {name, parent, pose} or {name, parent, samples}; without parent and pose it only names a root."""
    try:
        pose = _pose(as_mapping(entry, "an entry {name, parent, ..}"), reading, TIMED)
        if pose.name is None:
            raise Misfit("missing name; an entry is {name: .., parent: .., xyz: [..], ..}")
        if pose.parent is None and (pose.position or pose.rotation or (pose.covariance and "samples" not in entry)):
            raise Misfit(f"frame {shown(pose.name)} has a pose but no parent")
        return _edges(entry, pose, pose.parent, pose.name, path, reading)
    except Misfit as misfit:
        reading.refuse(misfit.below(*path))
        return []


def _pose(entry: dict[str, Any], reading: Reading, also: Collection[str]) -> Pose:
    """Read the pose of an entry; `axes` next to `samples` belongs to the samples."""
    if AXES_KEY in entry and "samples" in entry:
        entry = {key: value for key, value in entry.items() if key != AXES_KEY}
    if not (POSE_KEYS.issuperset(entry) or LOOSE.isdisjoint(entry)):
        from frametool.grammar.pasted import read_loose_pose

        return read_loose_pose(entry, reading, also)
    return read_pose(entry, reading, also)


def camera_fields(value: Any) -> dict[str, Any]:
    """Return the arguments of `Camera` from `camera: {..}`; raises Misfit."""
    known = as_mapping(value, "a camera as {K: [fx, fy, cx, cy], ..}")
    for key in known:
        if key not in CAMERA_KEYS:
            raise Misfit(f"unknown key {shown(key)}{alternatives(key, CAMERA_KEYS, 'keys')}", (key,), key=True)
    if known.get("K") is None:
        raise Misfit("a camera without K; it is {model: .., K: [fx, fy, cx, cy], D: [..], size: [w, h]}")
    texts = ("model", "axes")
    return {key: str(each) if key in texts else numbers_of(each) for key, each in known.items() if each is not None}


def numbers_of(value: Any) -> Any:
    """Convert texts to numbers: a single one, nested lists, or the `data` of an OpenCV matrix."""
    if isinstance(value, dict):
        return numbers_of(value.get("data", []))
    if isinstance(value, list):
        return [numbers_of(each) for each in value]
    return parse_number(value) if isinstance(value, str) else value


def _above(pose: Pose, parent: str | None, entry: dict[str, Any]) -> str | None:
    """Return the reference frame of a pose: the enclosing frame, or its own; raises Misfit if they conflict."""
    if pose.parent is None or "parent" in entry:
        return pose.parent or parent
    if parent not in (None, *readers.EARTH_FRAMES):  # a position on the Earth implies its frame
        key = next(filter(may_be_on_earth, entry))
        raise Misfit(f"{key} places a frame in ecef; its parent is {shown(parent)}", (key,), key=True)
    return parent or pose.parent


def _edges(
    entry: dict[str, Any], pose: Pose, parent: str | None, child: str, path: Path, reading: Reading
) -> list[Edge]:
    """Return the edges of one entry: a static edge or one with a stamp, or the samples of a moving frame."""
    camera = None
    if "camera" in entry:
        from frametool.geometry.camera import Camera

        fields = within(("camera",), camera_fields, entry["camera"])
        camera = within(("camera",), Camera, **{"model": None, **fields})
    if "samples" in entry:
        first, *edges = _samples(entry, pose, parent, child, path, reading)
        return [first._replace(camera=camera), *edges]
    if parent is not None and pose.position is None and pose.rotation is None:
        reading.note(f"frame {shown(child)} has neither position nor rotation: taken as the identity", rule="identity")
    return [Edge(parent, child, pose.components, stamp_of(entry), path=path, covariance=pose.covariance, camera=camera)]


def _messages(value: dict[str, Any], path: Path, reading: Reading) -> Iterator[Edge]:
    """Yield one edge per TransformStamped of a ROS message."""
    for message, here in messages.messages(value, path):
        reading.here = here
        try:
            parent, child, position, rotation, stamp_ns = messages.read_transform(message, reading)
            yield Edge(parent, child, (*position, *rotation), stamp_ns, path=here)
        except Misfit as misfit:
            reading.refuse(misfit.below(*here))
        message.clear()  # frees the memory of a million messages


def _samples(
    entry: dict[str, Any], pose: Pose, parent: str | None, child: str, path: Path, reading: Reading
) -> list[Edge]:
    """Read `samples: [{stamp: 0.0, xyz: [..]}, ..]`; a sample may name another parent."""
    if pose.position is not None or pose.rotation is not None or not STAMP_KEYS.isdisjoint(entry):
        message = f"frame {shown(child)} has samples and also a pose or a stamp; put all into samples"
        raise Misfit(message, ("samples",), key=True)
    if entry.get("inverse") == "true":
        raise Misfit("inverse belongs into each of the samples", ("inverse",), key=True)
    samples = entry["samples"]
    if type(samples) is not list or not samples:
        raise Misfit(f"expected samples as a list of {{stamp: .., xyz: [..], ..}}, found {kind(samples)}", ("samples",))
    outer, earth = reading.degrees, reading.earth
    edges = []
    try:
        reading.degrees = read_angle_unit(entry["angles"]) if "angles" in entry else outer
        if AXES_KEY in entry:
            from frametool.geometry.place import Earth
            from frametool.grammar.place import take_axes

            if not any(may_be_on_earth(key) for sample in samples if type(sample) is dict for key in sample):
                what = "axes next to samples are for positions on the Earth; none of these has one"
                raise Misfit(what, (AXES_KEY,), key=True)
            reading.earth = Earth(axes=take_axes({AXES_KEY: entry[AXES_KEY]}, reading))
        for index, sample in enumerate(samples):
            reading.here = (*path, "samples", index)
            moved, stamp_ns = within(("samples", index), _sample, sample, reading, uncertain=bool(pose.covariance))
            above = within(("samples", index), _above, moved, parent, sample)
            if above is None:
                raise Misfit(f"frame {shown(child)} moves but has no parent", ("samples", index))
            edges.append(Edge(above, child, moved.components, stamp_ns, path=reading.here, covariance=pose.covariance))
    finally:
        reading.degrees, reading.earth = outer, earth
    return edges


def _sample(sample: Any, reading: Reading, *, uncertain: bool) -> tuple[Pose, int]:
    """Read one pose with its stamp; uncertain: the entry has a covariance for all samples."""
    pose = _pose(as_mapping(sample, "a sample {stamp: .., xyz: [..], ..}"), reading, STAMP_KEYS)
    if found := COVARIANCE_KEYS.intersection(sample):
        raise Misfit(f"{min(found)} is common to all samples; write it next to samples", (min(found),), key=True)
    if uncertain and pose.parent is not None and "parent" not in sample:
        raise Misfit("axes turn from place to place; one covariance for all is in no axes; leave it out")
    if uncertain and sample.get("inverse") == "true":
        raise Misfit("a sample that is inverted has no part in one covariance for all; write its inverse", ("inverse",))
    if pose.name is not None:
        raise Misfit("name is defined by the entry; remove it", ("name",), key=True)
    stamp_ns = stamp_of(sample)
    if stamp_ns is None:
        raise Misfit("missing stamp; a sample is {stamp: 12.5, xyz: [..], ..}, in seconds")
    return pose, stamp_ns


def stamp_of(entry: dict[str, Any]) -> int | None:
    """Read `stamp: 12.5` in seconds or `stamp_ns: 12500000000`, exactly; None if there is neither."""
    if STAMP_KEYS.isdisjoint(entry):
        return None
    if STAMP_KEYS.issubset(entry):
        raise Misfit("stamp and stamp_ns in one entry; keep one", ("stamp",), key=True)
    return read_time(entry, "stamp" if "stamp" in entry else "stamp_ns")


def read_time(entry: dict[str, Any], key: str, example: str = "") -> int:
    """Read the time under a key: seconds, or nanoseconds if the key ends in _ns; raises Misfit."""
    text = entry[key]
    if type(text) is not str:
        raise Misfit(f"expected a time{example}, found {kind(text)}", (key,))
    return int(within((key,), parse_stamp, f"{text}ns" if key.endswith("_ns") else text))


def named(fields: dict[str, Any], key: str) -> str:
    """Return the name under a key; raises Misfit if it is missing."""
    name = read_name(fields, key)
    if name is None:
        raise Misfit(f"missing {key}")
    return name


def document_edges(file: InputFile, options: Options, take: Take, tags: Collection[str] = ()) -> Iterator[Edge]:
    """Yield the edges of a file of another format in YAML or JSON, as `edges_of` does.

    tags: of YAML, for this format.
    Errors go to `options.report`, warnings to `options.tally`.
    """
    source = file.source
    try:
        documents = parse_documents(source.text, source.name, tags)
    except FormatError as error:
        options.report(error)
        return
    notes, faults = list[Finding](), list[Misfit]()
    yield from edges_of(documents, take, notes, faults, normalize=options.normalize, bare_numbers=True)
    for at, (fault, line, column) in enumerate(located(faults, source)):
        if isinstance(fault, readers.Unclear):
            raise fault.placed(source)
        placed = FormatError(str(fault), source=source.name, line=line, column=column, rule=fault.rule)
        options.report(placed if at else fault.placed(source))
    lines = [line for line, _ in locate_many(source.text, [note.path for note in notes])]
    remember([note._replace(path=note.path[1:]) for note in notes], lines, options.tally)


def located(faults: Sequence[Misfit], source: Source) -> Iterator[tuple[Misfit, int, int]]:
    """Yield errors with their lines and columns; their paths begin at the top of the text."""
    paths = [fault.path for fault in faults]
    values, keys = (locate_many(source.text, paths, key=key) for key in (False, True))
    for fault, *places in zip(faults, values, keys, strict=True):
        yield fault, *places[fault.key]


def remember(notes: Iterable[Finding], lines: Iterable[int], tally: Diagnostics) -> None:
    """Record warnings in `tally`, each with its line, and with its path in front."""
    for note, line in zip(notes, lines, strict=True):
        tally.note_each(f"{bare(dotted(note.path))}: {note.message}" if note.path else note.message, line, note.rule)


def dotted(path: Path) -> str:
    """Return the keys of a path with dots between them: `cam0.T_cam_imu`."""
    return ".".join(str(step) for step in path)
