"""Read files of frames and merge them into one tree; errors name both places where files disagree.

Each file is read by the module of its format; edges are added to a FrameTree as long as all are static, and to a
TransformBuffer from the first stamp on.  This module does not know the formats themselves.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from functools import partial
from importlib import import_module
from io import BufferedReader, BytesIO
from itertools import islice
from operator import attrgetter, gt, itemgetter, lt
from os import PathLike
from typing import Any, BinaryIO

from frametool import errors
from frametool.documents.document import file_error, locate_many
from frametool.documents.source import InputFile, Source, paused_collector
from frametool.errors import BadTopology, FileProblem, FormatError, NamedTuple, ValueInvalid, alternatives, shown, warn
from frametool.formats.detect import Beginning, detect, of_folder
from frametool.formats.table import CHOICES, FORMATS, readers
from frametool.frames import topology
from frametool.frames.lookups import Frames, FrameTree
from frametool.geometry.representations import EARTH_FRAMES
from frametool.grammar.edges import Answers, Diagnostics, Edge, EdgeColumns, Options, Topics, stop
from frametool.grammar.readers import NAME_KEYS, PARENT_COLUMNS, alike, more_like_it

TYPE_CHECKING = False

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from frametool.frames.buffer import TransformBuffer
    from frametool.geometry import Components, Rigid
    from frametool.geometry.camera import Camera
    from frametool.grammar.edges import Report



class FrameFile(InputFile):
    """A file of frames and its format."""

    reader: Any = None  # function of the file and Options that yields edges; None: that of the format

    def __init__(
        self,
        path: str | PathLike[str],
        stream: BinaryIO | None = None,
        fmt: str | None = None,
        topics: Iterable[str] = (),
        answers: Answers = Answers(),  # noqa: B008 - it is frozen
        reads: Sequence[str] = ("tree",),
    ) -> None:
        """Open a file, a bag's folder, or standard input for `-`, and detect its format, unless it is set.

        stream: an opened stream, not yet read.  topics: of a recording, to be read.
        answers: options for what the format does not specify.  reads: restricts the formats, as in the table.
        Raises FileProblem.
        """
        folder = os.path.isdir(path) and of_folder(str(path))
        if folder is None and not fmt:
            raise FileProblem(f"{path}: is a directory; name a file in it, or the folder of a bag, with metadata.yaml")
        super().__init__(path, stream, folder=bool(folder) and fmt in (None, "", folder))
        try:
            self.format = fmt or folder or detect(self.head(), *reads, name=self.path, empty="yaml")
        except BaseException:
            self.close()
            raise
        self.tally = Diagnostics()
        self.topics = Topics(topics)
        self.answers = answers

    @classmethod
    def inline(cls, source: Source) -> FrameFile:
        """Create from text: a tree written on the command line, or already read."""
        made = cls(source.name, BufferedReader(BytesIO()), "yaml")
        made.text = source.text
        return made

    @property
    def holds_samples(self) -> bool:
        """Return True for a recording, False for a tree in YAML or JSON."""
        return "records" not in FORMATS[self.format].reads

    @property
    def required_options(self) -> tuple[str, ...]:
        """Return the options for what the file does not specify.

        Tables need `frames` unless they have columns for parent and child; recordings accept it if topics are chosen.
        """
        row = FORMATS[self.format]
        if self.format in ("csv", "tsv", "semicolon"):
            words = {word.strip('"# \r') for word in Beginning(self.head()).first_line.split(row.rows.delimiter)}
            return row.required_options[0 if words.isdisjoint(PARENT_COLUMNS) or words.isdisjoint(NAME_KEYS) else 1 :]
        return (*row.required_options, *["frames"] * bool(self.topics.chosen))

    def edges(self, report: Report = stop, *, tell: bool = True, normalize: bool = False) -> Iterator[Edge]:
        """Yield the edges one by one, in the order of the file, then emit warnings; parameters as for `pieces`."""
        for piece in self.pieces(report, tell=tell, normalize=normalize):
            yield from (piece,) if isinstance(piece, Edge) else piece.edges()

    def pieces(
        self, report: Report = stop, *, tell: bool = True, normalize: bool = False
    ) -> Iterator[Edge | EdgeColumns]:
        """Yield edges, one by one or in bulk, in the order of the file.

        report: receives errors, and reading continues after them if possible; without it the first one is raised.
        tell: emit warnings; without it they are only collected, in `tally`.
        normalize: accept any non-zero quaternion and any matrix near a rotation.
        """
        try:
            options = Options(self.tally, self.topics, report, normalize, self.answers)
            found = (self.reader or import_module(FORMATS[self.format].reader).read)(self, options)
            if offset_ns := self.answers.time_offset:
                from frametool.grammar.edges import at_other_times

                found = (at_other_times(piece, offset_ns) for piece in found)
            yield from found
        finally:
            self.close()
        if missing := self.topics.missing():
            report(FormatError(missing, source=self.name))
        if tell:
            self.tell()

    def __getstate__(self) -> dict[str, Any]:
        """Allow pickling a tree that still reads its cameras."""
        return {key: each for key, each in vars(self).items() if key != "stream"}

    def tell(self) -> None:
        """Emit the warnings about the file, once it was read."""
        found: dict[str | errors.Finding, list[errors.Finding]] = {}
        for finding in self.tally.findings():
            found.setdefault(finding if finding.rule == "odd" else alike(finding), []).append(finding)
        for first, *others in found.values():
            warn(f"{self.name}:{first.line}: {first.message}{more_like_it(1 + len(others))}", rule=first.rule)


def opened_together(files: Iterable[FrameFile]) -> list[FrameFile]:
    """Open files one after another; if one cannot be opened, close the others."""
    found: list[FrameFile] = []
    with ExitStack() as opened:
        for file in files:
            opened.callback(file.close)
            file.siblings = found
            found.append(file)
        opened.pop_all()
    return found


def refuse_unknown_joints(files: Sequence[FrameFile]) -> None:
    """Raise the error for a joint value, from options or files, of a joint that no robot has; call it after reading."""
    option, robots = "", list[Diagnostics]()
    for file in files:
        if file.answers.joints or file.answers.joint_files:
            option = option or ("--joint" if file.answers.joints else "--joints")
        if file.tally.robot is not None:
            robots.append(file.tally)
    if option and not robots:
        raise errors.BadAnswer(f"{option}: there are no joints in {', '.join(file.name for file in files)}")
    for name, error in robots[0].unknown_joints.items() if robots else ():
        if all(name in robot.unknown_joints for robot in robots):
            raise error


class Rules(NamedTuple):
    """How a tree is built: static and moving frames, inexact rotations, and the Earth's frame.

    moving: an edge with one stamp is valid only at that time, as in tf2; otherwise it is static
    keep_ns: as for TransformBuffer
    normalize: accept any non-zero quaternion and any matrix near a rotation
    earth: the name of the Earth's frame; "" for the first one used, `ecef` or `earth`
    """

    moving: bool = False
    keep_ns: int | None = None
    normalize: bool = False
    earth: str = ""


class TreeBuilder:
    """The edges read so far, and the place of each frame's first definition."""

    def __init__(self, name: str, rules: Rules | None = None) -> None:
        """Create an empty builder; `name` is that of the source, for messages."""
        self.name = name
        self.rules = rules or Rules()
        self.earth, self._one_earth = self.rules.earth, False  # the Earth's name; an edge to itself is reported
        self.tree = FrameTree(name)
        self.buffer: TransformBuffer | None = None
        self.first: dict[str, tuple[str, Rigid, EdgePlace]] = {}  # child -> its first definition
        self._replaced: list[tuple[str, str, EdgePlace]] = []  # samples that replaced another one at the same stamp
        self._moves: set[str] = set()  # children with samples at several stamps
        self._late: set[str] = set()  # children whose samples go back in time, for one warning each
        self.covariances: dict[str, Components] = {}  # child -> the covariance of its edge
        self.cameras: dict[str, Camera] = {}  # by their frames

    def one_name(self, frame: str) -> str:
        """Return the name of a frame; for the Earth's frame (`earth` or `ecef`) the name that was used first."""
        if frame not in EARTH_FRAMES:
            return frame
        self.earth = self.earth or frame
        return self.earth

    def add(self, place: EdgePlace) -> None:
        """Add an edge, one sample of it, or a root; an edge between `earth` and `ecef` must be the identity.

        Raises BadTopology and FormatError with the place.
        """
        edge, components = place.edge, place.edge.components
        parent, child = edge.parent and self.one_name(edge.parent), self.one_name(edge.child)
        if edge.camera is not None and edge.camera.mapping() != self.cameras.setdefault(child, edge.camera).mapping():
            warn(f"{place.file.name}: camera {errors.bare(child)} comes again with other numbers; the first ones hold")
        if parent == child and edge.parent != edge.child:
            if any(components[:6]):
                what = "'earth' and 'ecef' are one frame, this edge puts one elsewhere in the other; rename one"
                raise place.error(what, BadTopology)
            if not self._one_earth:
                warn(f"{self.name}: 'earth' and 'ecef' are one frame; the edge between them is left out")
            self._one_earth, parent = True, None
        if parent is None:
            (self.tree if self.buffer is None else self.buffer).add_root(child)
            return
        try:
            if self.buffer is None and edge.stamp_ns is None:
                self.first.setdefault(child, (parent, components, place))
                self.tree.add_components(parent, child, components)
            else:
                self._record(parent, child, place)
        except BadTopology as error:
            raise self._placed(error, parent, child, place) from None
        except ValueInvalid as error:
            raise place.error(str(error), FormatError) from None
        if edge.covariance is not None or child in self.covariances:
            known = self.first[child][2].edge.covariance
            if edge.covariance is None or edge.covariance != known:
                twice = topology.two_covariances(parent, child, known, edge.covariance)
                raise self._placed(twice, parent, child, place)
            self.covariances[child] = edge.covariance

    def _record(self, parent: str, child: str, place: EdgePlace) -> None:
        """Add a sample or a static edge to the buffer; the same pose with a stamp and without one counts once."""
        buffer, components, stamp_ns = self._moving(), place.edge.components, place.edge.stamp_ns
        track = buffer.track(child)
        settled = track is not None and child not in self._moves and (track.is_static or stamp_ns is None)
        if track is not None and settled and (track.parent, track.components) == (parent, components):
            return
        self.first.setdefault(child, (parent, components, place))
        if stamp_ns is not None and self.first[child][2].edge.stamp_ns != stamp_ns:
            self._moves.add(child)
        if buffer.insert_components(parent, child, components, stamp_ns) and stamp_ns is not None:
            self._replaced.append((parent, child, place))

    def add_columns(self, file: FrameFile, piece: EdgeColumns) -> None:
        """Add a block of edges: the samples of a frame all at once if they are in order, the others one by one."""
        pairs = [*zip(piece.parents, piece.children, strict=True)]
        found: dict[tuple[str, str], Any] = {pair: [] for pair in pairs}
        # several new edges are added one by one: their order matters for cycles
        known = len(found) == 1 or all(self._goes_on(*pair) for pair in found)
        if len(found) == 1:
            found[pairs[0]] = piece[2:5]
        else:
            for pair, row in zip(pairs, zip(*piece[2:5], strict=True), strict=True):
                found[pair].append(row)
            found = {pair: tuple(zip(*each, strict=True)) for pair, each in found.items()}
        known = known and all(self.one_name(name) == name for pair in found for name in pair)
        whole = {pair: each for pair, each in found.items() if known and self._takes_whole(*pair, each[0])}
        for (parent, child), (stamps_ns, components, lines) in whole.items():
            place = EdgePlace(file, Edge(parent, child, components[0], stamps_ns[0], lines[0]))
            try:
                self._moving().insert_many(parent, child, stamps_ns, components)
            except BadTopology as error:
                raise self._placed(error, parent, child, place) from None
            self.first.setdefault(child, (parent, components[0], place))
            self._moves.add(child)
        if len(whole) == len(found):
            return
        for (_, child), (stamps_ns, *_) in found.items() if piece.is_ordered else ():
            if child not in self._late and any(map(gt, stamps_ns, islice(stamps_ns, 1, None))):
                self._late.add(child)
                warn(f"{file.name}: stamps of {shown(child)} are out of order; sorted")
        for edge in piece.edges():
            if (edge.parent, edge.child) not in whole:
                self.add(EdgePlace(file, edge))

    def _goes_on(self, parent: str, child: str) -> bool:
        """Return True if a frame already has several samples, and its parent is this one."""
        track = None if self.buffer is None or child not in self._moves else self.buffer.track(child)
        return track is not None and not track.is_static and track.parent == parent

    def _takes_whole(self, parent: str, child: str, stamps_ns: Sequence[Any]) -> bool:
        """Return True if samples can be added all at once: in ascending order, and later than the known ones."""
        if self.rules.keep_ns is not None or len(stamps_ns) < 2 or stamps_ns[0] is None or child in self.covariances:
            return False
        track = None if self.buffer is None else self.buffer.track(child)
        if track is None:
            follows = child not in self.first
        else:
            follows = self._goes_on(parent, child) and track.last_ns < stamps_ns[0]  # type: ignore[union-attr]
        return follows and all(map(lt, stamps_ns, islice(stamps_ns, 1, None)))

    def _moving(self) -> TransformBuffer:
        """Return the buffer; it is created at the first stamp, with the static edges so far."""
        if self.buffer is None:
            from frametool.frames.buffer import TransformBuffer

            self.buffer = TransformBuffer(keep_ns=self.rules.keep_ns, name=self.name)
            for frame in self.tree.frames:
                self.buffer.add_root(frame)
            for child, (parent, components, _) in self.first.items():
                self.buffer.insert_components(parent, child, components)
        return self.buffer

    def settled(self, buffer: TransformBuffer) -> FrameTree | TransformBuffer:
        """Return the buffer, or a tree of its static edges if nothing moves.

        Without `moving`, a frame with one stamp is static.  Raises BadTopology for a static frame with two poses; warns
        of a moving frame with two poses at one stamp.
        """
        single = {track.child for track in buffer.tracks() if not track.is_static and track.child not in self._moves}
        static = set() if self.rules.moving else single
        for child in static:
            buffer.make_static(child)
        for parent, child, place in self._replaced:
            if child in static:
                raise self._placed(topology.two_poses(child, parent), parent, child, place)
        if self._replaced:
            from frametool.frames.stamps import format_stamp

            _, child, place = self._replaced[0]
            ((name, line),) = lines_of([place])
            what = f"frame {shown(child)} has two poses at {format_stamp(place.edge.stamp_ns or 0)}; the last one holds"
            warn(f"{name}:{line}: {what}{more_like_it(len(self._replaced))}")
        tree = FrameTree(self.name)  # checks the rules of static trees
        for frame in buffer.frames:
            tree.add_root(frame)
        for track in buffer.tracks():
            if track.is_static:
                try:
                    tree.add_components(track.parent, track.child, track.components)
                except BadTopology as error:
                    raise self.first[track.child][2].error(str(error), BadTopology) from None
        return buffer if buffer.moves else tree

    def _placed(self, error: BadTopology, parent: str, child: str, place: EdgePlace) -> FormatError:
        """Return an error with its place, or with both places if it contradicts an earlier definition."""
        known = self.first.get(child)
        if error.rule in ("cycle", "self") or known is None or known[2] is place:
            return place.error(str(error), BadTopology)
        places = known[2].seen_from(place), place.seen_from(place)
        if known[0] != parent and error.rule != "two-covariances":
            return place.error(str(topology.two_parents(child, known[0], parent, places)), BadTopology)
        return place.error(f"{error}: {' and '.join(places)}", BadTopology)


class EdgePlace(NamedTuple):
    """An edge and the file it was read from, for messages."""

    file: FrameFile
    edge: Edge

    def error(self, message: str, kind: type[FormatError]) -> FormatError:
        """Return an error at the line of this edge."""
        return file_error(self.file, message, self.edge.line, self.edge.path, kind)

    def seen_from(self, other: EdgePlace) -> str:
        """Format this place relative to another one: `line 7`, or `other.yaml:7` in another file."""
        line = locate_many(self.file.text, [self.edge.path])[0][0] if self.edge.path else self.edge.line
        return f"line {line}" if other.file.name == self.file.name else f"{self.file.name}:{line}"


def checked_answers(answers: dict[str, Any]) -> dict[str, Any]:
    """Return options about a format unchanged; raises ValueInvalid for words that are not among the choices."""
    for ask, choices in CHOICES.items():
        if (answer := answers.get(ask)) and answer not in choices:
            raise ValueInvalid(f"{ask} is {' or '.join(choices)}, not {shown(answer)}")
    return answers


def listed(values: Any) -> tuple[Any, ...]:
    """Return texts, paths or trees as a tuple; a single one as a tuple of one."""
    return (values,) if isinstance(values, str | PathLike | Frames) else tuple(values)


def load(
    *paths: str | PathLike[str],
    moving: bool = False,
    keep_ns: int | None = None,
    normalize: bool = False,
    topics: Iterable[str] = (),
    format: str | None = None,  # noqa: A002 - public name
    joints: Mapping[str, float | str] | str | PathLike[str] | None = None,
    frames: Sequence[str] = (),
    **answers: Any,
) -> FrameTree | TransformBuffer:
    """Read one or several files of frames and merge them: a FrameTree, or a TransformBuffer if anything moves.

    paths: files in any format of `frametool.FORMATS` that has trees; `-` is standard input.  format: its name there.
    moving: an edge with a single stamp is valid only at that time; otherwise it is static.
    keep_ns: as for TransformBuffer.  topics: of a recording, to be read  [default: all].
    normalize: accept any non-zero quaternion and any matrix near a rotation.
    joints: values by name (radians, metres, or text with a unit), or a file of them.  frames: names of frames that the
    format does not name, as (world, body).  answers: direction, camera_axes, dh, stamps as in
    `frametool.formats.table`. Raises FormatError, Unanswered and BadTopology with file, line and column; FileProblem.
    """
    chosen = listed(topics)
    if format is not None and format not in readers("tree"):
        raise ValueInvalid(f"no trees are read from {format!r}{alternatives(format, readers('tree'), 'formats')}")
    by_name = {} if joints is None or isinstance(joints, str | PathLike) else joints
    values = {name: value if isinstance(value, str) else repr(float(value)) for name, value in by_name.items()}
    joint_files = () if joints is None or by_name is joints else (str(joints),)
    known = Answers(listed(frames), joints=values, joint_files=joint_files, **checked_answers(answers))
    files = opened_together(FrameFile(path, fmt=format, topics=chosen, answers=known) for path in paths)
    for ask in ("frames", *answers):
        if getattr(known, ask) and not any(ask in file.required_options for file in files):
            warn(f"{ask} has no effect: {' and '.join({file.format: 0 for file in files})} specifies this itself")
    return load_sources(files, Rules(moving=moving, keep_ns=keep_ns, normalize=normalize))


def load_sources(
    sources: Sequence[Source | FrameFile], rules: Rules | None = None, places: dict[str, EdgePlace] | None = None
) -> FrameTree | TransformBuffer:
    """Merge the frames of several texts and files as `load` does.

    places: receives the place of each frame's first definition
    """
    files = [FrameFile.inline(source) if isinstance(source, Source) else source for source in sources]
    builder = TreeBuilder(", ".join(map(attrgetter("name"), files)), rules)
    try:
        with paused_collector():
            for file in files:
                piece = None
                for piece in file.pieces(normalize=builder.rules.normalize):
                    if isinstance(piece, Edge):
                        builder.add(EdgePlace(file, piece))
                    else:
                        builder.add_columns(file, piece)
                if piece is None:
                    raise file.error("no frames in it")
            refuse_unknown_joints(files)
            tree = builder.tree if builder.buffer is None else builder.settled(builder.buffer)
    finally:
        for file in files:
            file.close()
    tree.covariances |= builder.covariances
    tree.cameras = builder.cameras
    held, tree.robots = list[FrameFile](), []
    for file in files:
        tree.camera_axes.update(filter(itemgetter(1), file.tally.axes.items()))  # only known axes
        tree.drawn |= file.tally.drawn
        if file.tally.robot is not None:
            tree.robots.append(file.tally.robot)
        if "cameras" in FORMATS[file.format].reads:
            held.append(file)
    if held:
        tree.read_cameras = partial(_read_cameras, tree, held)
    if places is not None:
        places |= {child: place for child, (_, _, place) in builder.first.items()}
    return tree


def _read_cameras(tree: FrameTree | TransformBuffer, files: Sequence[FrameFile]) -> dict[str, Any]:
    from frametool.formats.cameras import cameras_of_tree

    return cameras_of_tree(tree, files)


def lines_of(places: Sequence[EdgePlace]) -> list[tuple[str, int]]:
    """Return file name and line of each place (0 if the line is unknown); each file is scanned once."""
    lines: dict[int, int] = {}
    for file in {id(each.file): each.file for each in places}.values():
        inside = [each for each in places if each.file is file and each.edge.path]
        found = locate_many(file.text, [each.edge.path for each in inside]) if inside else []
        lines |= {id(each): line for each, (line, _) in zip(inside, found, strict=True)}
    return [(each.file.name, lines.get(id(each), each.edge.line)) for each in places]
