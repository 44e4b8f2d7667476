"""Trajectories of any format as arrays: rows of poses or positions, files that list poses, moving frames of recordings.

walk.tum        rows.csv        run.mcap:/odom        run.mcap:map:base_link

In Python: `compare`, `align` and `resample` take trajectories or files.
"""

from __future__ import annotations

import os
import re
from contextlib import closing, nullcontext
from itertools import repeat
from operator import ge
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from frametool.documents.source import InputFile
from frametool.errors import FileProblem, FormatError, ValueInvalid, alternatives, shown, warn
from frametool.formats.detect import by_sign, detect, of_folder
from frametool.formats.load import FrameFile, Rules, checked_answers, listed, load_sources, opened_together
from frametool.formats.table import BAG, FORMATS, by_suffix
from frametool.frames.lookups import checked_rate
from frametool.frames.stamps import BILLION, FURTHEST_NS, parse_time
from frametool.frames.trajectory import BODY, WORLD, Trajectory
from frametool.geometry.rigid import IDENTITY
from frametool.geometry.transform import Rotation
from frametool.grammar.edges import Answers, Diagnostics, Names
from frametool.grammar.pose_algebra import sample_stamps
from frametool.grammar.readers import stamp_column
from frametool.ros.messages import body_of
from frametool.rows.faults import SKIP, BadRows, Fault
from frametool.rows.request import Operation, Request, ResultOptions, RowOptions
from frametool.rows.samples import POSITION, samples_of
from frametool.rows.sources.tables import TableRows

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import TypeAlias

    from frametool.fit.comparison import Comparison
    from frametool.frames.buffer import TransformBuffer
    from frametool.geometry import Array
    from frametool.geometry.transform import Transform
    from frametool.grammar.edges import Report
    from frametool.text.lines import ByteStream

    TrajectoryLike: TypeAlias = Trajectory | str | PathLike[str]

WORDS = {  # the text values of settings of `compare`
    "align": ("se3", "sim3", "yaw", "origin", "origin+scale", "none"), "mount": ("auto",), "like": ("evo",),
    "match": ("interpolate", "nearest"), "pairs_from": ("reference", "estimate"),
}  # fmt: skip
RECORDINGS = tuple(name for name, row in FORMATS.items() if row.reader == BAG)
TREE = rb"""(?m)^[^\S\n]*+(?:---\s*+)?+(?:\{\s*+)?+["']?(?:frames|transforms|angles)["']?\s*:"""  # keys of a tree file
POSITIONS = rb"""(?m)(?:^|[{,.]\s*)["']?(?:point|latitude)["']?\s*[:,.]"""  # keys of a message without a pose


def load_trajectory(
    path: str | PathLike[str],
    *,
    format: str | None = None,  # noqa: A002 - what it is
    topic: str | None = None,
    frames: Sequence[str] = (),
    **answers: Any,
) -> Trajectory:
    """Read a trajectory: a file of poses or positions over time, in any format that can hold them.

    path: a file, `-` for standard input, `FILE:TOPIC`, or `FILE:TARGET:SOURCE` for a frame of a tree or recording.
    format, topic, frames, answers: as for `frametool.load`.
    Raises FormatError with the line that cannot be read, ValueInvalid if there is not exactly one trajectory.
    """
    if format and format not in FORMATS:
        raise ValueInvalid(f"no trajectories are read from {format!r}{alternatives(format, FORMATS, 'formats')}")
    known = Answers(listed(frames), **checked_answers(answers))
    return read_trajectory(str(path), fmt=format or "", topics=[topic] if topic else [], answers=known)


def read_trajectory(
    text: str,
    *,
    fmt: str = "",
    topics: Sequence[str] = (),
    answers: Answers = Answers(),  # noqa: B008 - it is frozen
    policy: Callable[[str], BadRows] = BadRows,
    normalize: bool = False,
) -> Trajectory:
    """Read the trajectory that an argument names; otherwise as `load_trajectory`.

    policy: returns the reporter of a file's bad rows, from the name of the file
    normalize: accept any non-zero quaternion and any matrix near a rotation
    """
    name, inside = split_name(text)
    if len(inside) == 1:
        topics, inside = inside, []
    file, body = None, BODY
    if not inside and (fmt or by_suffix(name, RECORDINGS) or of_folder(name)) in RECORDINGS:
        from frametool.recordings.contents import open_trajectory

        if (found := open_trajectory(name, topics, Diagnostics())) is not None:
            file, fmt, body = InputFile(name, found[0]), "json", body_of(found[1], answers)
    if file is None and not (os.path.isdir(name) or inside or topics):
        file = InputFile(name)
    with nullcontext() if file is None else closing(file):
        if file is not None:
            reads = ("rows", "arrays", "records", *["tree"] * (re.search(POSITIONS, file.head()) is None))
            fmt = fmt or detect(file.head(), *reads, name=file.path)
        if file is None or holds_tree(file, fmt):
            return _of_tree(name, fmt, topics, answers, inside, file, normalize=normalize)
        return _of_samples(file, fmt, answers, policy(file.name), body, normalize=normalize)


def holds_tree(file: InputFile, fmt: str) -> bool:
    """Return True if a file holds edges, not records, rows or columns of numbers."""
    reads = FORMATS[fmt].reads
    return re.search(TREE, file.head()) is not None if "records" in reads else {"rows", "arrays"}.isdisjoint(reads)


def split_name(text: str) -> tuple[str, list[str]]:
    """Split FILE:TOPIC or FILE:TARGET:SOURCE; the file is the longest beginning that exists.

    Names with a colon must be quoted.  Raises FileProblem.
    """
    ends = [len(text), *(found.start() for found in reversed([*re.finditer(":", text)]))]
    end = next((end for end in ends if text[:end] == "-" or os.path.exists(text[:end])), None)
    if end is None:
        raise FileProblem(f"{text}: no such file or directory")
    names = ["".join(each) for each in re.findall(r':(?:"([^"]*)"|\'([^\']*)\'|([^:]*))', text[end:])]
    if len(names) > 2 or not all(names):
        raise ValueInvalid(f"{shown(text)}: behind the file stand a topic, or TARGET:SOURCE; quote names with a colon")
    return text[:end], names


def read_stamps(path: str, report: Report) -> list[int]:
    """Return the stamps of a file in its order: one per line, or those of a table, trajectory or recording (sorted).

    path: a file or a folder, or FILE:TOPIC; report: called with the error of each invalid line
    """
    if path != "-" and not os.path.isfile(path) and (os.path.isdir(path) or ":" in path):
        name, topics = split_name(path)
        return _stamps_of(name, topics=topics)
    with closing(InputFile(path)) as file:
        head, fmt = file.head(), "columns"
        words = next((line.split() for line in head.splitlines() if line.strip() and line.lstrip()[:1] != b"#"), [])
        is_list = len(words) < 2 and not re.search(rb"[,;:{\[<\0]", b"".join(words)) and by_sign(head, "tree") is None
        if is_list and not words:
            raise FormatError(NO_TIMES, source=file.name)
        if not is_list:
            fmt = detect(head, "rows", "arrays", "tree", "records", name=file.path)
            if not FORMATS[fmt].is_table or fmt == "kitti":
                reads, is_tree = FORMATS[fmt].reads, holds_tree(file, fmt)
                return _stamps_of(path, fmt, is_tree="tree" in reads and (is_tree or "records" not in reads))
        titled = not is_list or stamp_column([words[0].decode("utf-8", "replace")]) is not None
        named = ResultOptions(all_numbers=True, prefix=" ")  # no column begins like this
        request = Request(Operation(left=IDENTITY), RowOptions(poses=0), named, on_error=SKIP)
        rows = TableRows(cast("ByteStream", file.stream), fmt, request, file.name, header=titled)
        if not rows.layout.times:
            columns = f"; columns: {rows.columns}" if rows.table.names else ""
            raise FormatError(f"no column of stamps (t, stamp, time, stamp_ns ..){columns}", source=file.name, line=1)
        found, count, line = list[int](), 0, rows.lines + 1
        for text in rows.texts:
            run, outcome, _ = rows.of_text(text)
            stamps = run.block.stamps[0][run.rows]
            far = np.flatnonzero(abs(stamps) >= FURTHEST_NS)
            places = map(run.block.line_of, run.rows[far].tolist())
            beyond = (f"stamp {stamp} ns is beyond the year 2116" for stamp in stamps[far])
            for fault in sorted([*outcome.faults, *map(Fault, places, repeat(""), beyond)]):
                report(FormatError(str(fault.reason), source=file.name, line=line + fault.line))
            found += np.delete(stamps, far).tolist()
            line, count = line + outcome.lines, count + outcome.rows
    if not count:
        raise FormatError(NO_TIMES, source=file.name)
    if any(map(ge, found, found[1:])):
        warn(f"{file.name}: stamps are out of order or doubled; used as they stand")
    return found


NO_TIMES = "no times in it; write one a line"


def _stamps_of(path: str, fmt: str = "", topics: Sequence[str] = (), *, is_tree: bool = True) -> list[int]:
    """Return the stamps of all moving frames of a tree or recording, sorted, or of poses or records in their order."""
    if is_tree:
        recording = FrameFile(path, fmt=fmt or None, topics=topics)
        found = sorted({edge.stamp_ns for edge in recording.edges() if edge.stamp_ns is not None})
        fmt = recording.format
    else:
        stamps_ns = read_trajectory(path, fmt=fmt).stamps_ns
        found = [] if stamps_ns is None else stamps_ns.tolist()
    if not found:
        raise FormatError(f"no stamps in it ({FORMATS[fmt].summary})", source=path)
    return found


def _of_samples(
    file: InputFile, fmt: str, answers: Answers, bad: BadRows, body: str, *, normalize: bool
) -> Trajectory:  # fmt: skip
    """Read records, rows or columns of numbers; body: the name of the moving frame, if records have none.

    Raises ValueInvalid for poses of several frames.
    """
    known, source = FORMATS[fmt], file.name
    are_records, counts = "records" in known.reads, bool(known.rows.counted)
    answers = answers if counts or fmt == "csv" else answers._replace(stamps="")
    poses = samples_of(cast("ByteStream", file.stream), fmt, RowOptions(normalize=normalize), bad, answers=answers)
    if np.isnan(poses.numbers[:, 0]).any():
        raise FormatError("rotations without positions are no trajectory", source=source)
    world, body = (WORLD, body) if are_records else answers.names(WORLD, BODY)
    named = {(parent or world, name or body) for parent, name in zip(poses.parents, poses.names, strict=True)}
    if len(named) > 1:
        some = ", ".join(f"{parent}:{name}" for parent, name in sorted(named)[:3])
        raise ValueInvalid(f"{source}: poses of several frames ({some} ..); name one: {source}:TARGET:SOURCE")
    ((parent, name),) = named
    turns = poses.numbers[:, POSITION:]
    return Trajectory(
        None if counts and not answers.stamps else poses.stamps_ns, poses.numbers[:, :POSITION],
        None if np.isnan(turns).any() else turns, Names().bare(parent), name,
        None if are_records or "arrays" in known.reads else poses.lines,
    )  # fmt: skip


def _of_tree(
    name: str, fmt: str, topics: Sequence[str], answers: Answers, frames: Sequence[str], file: InputFile | None = None,
    *, normalize: bool = False,
) -> Trajectory:
    """Sample the transform of SOURCE in TARGET in a tree; without names that of its only moving edge."""
    recording = FrameFile(name, None if file is None else file.stream, fmt or None, topics, answers)
    tree = cast("TransformBuffer", load_sources(opened_together([recording]), Rules(normalize=normalize)))
    if topics and not recording.topics.counts:
        raise ValueInvalid(f"{recording.name}: {FORMATS[recording.format].summary}: nothing in it came by a topic")
    if not tree.moves:
        raise ValueInvalid(f"{recording.name}: nothing moves in it")
    if not frames:
        moving = [(track.parent, track.child) for track in tree.tracks() if not track.is_static]
        if len(moving) != 1:
            some = ", ".join(f"{parent}:{child}" for parent, child in moving[:3])
            what = f"{len(moving)} frames move ({some} ..)"
            raise ValueInvalid(f"{recording.name}: {what}; name one: {name}:TARGET:SOURCE")
        frames = moving[0]
    target, source = frames
    stamps = sample_stamps(tree, target, source)
    found = tree.lookup_many(target, source, stamps)
    return Trajectory(np.array(stamps, np.int64), found.xyz, np.stack(found.components[3:], -1), target, source)


class Alignment(NamedTuple):
    """The estimate's world in the reference's, p' = scale R p + t; moved: the whole aligned estimate."""

    transform: Transform
    scale: float
    offset_s: float
    moved: Trajectory


def compare(
    ref: TrajectoryLike, est: TrajectoryLike, *, offset: float | str | None = None, align: str | None = None,
    mount: Transform | str | None = None, deltas: Iterable[str] | None = None, like: str | None = None, **more: Any,
) -> Comparison:  # fmt: skip
    """Compare a trajectory with a reference.

    ref, est: a Trajectory, or the path of a file as for `load_trajectory`
    offset: seconds by which est's clock lags, or "auto"; align: se3, sim3, yaw, origin or none
    mount: pose of the reference sensor in est's body, or "auto"; deltas: as "1m", "10frames", "1s", "5deg"; like: "evo"
    more: other fields of the groups of `frametool.fit.comparison.Settings`; align_first as "10s", times in nanoseconds
    Raises ValueInvalid if the two have no stamps in common, or a fit is not determined; FormatError.
    """
    from frametool.fit.comparison import AUTO, EVO, SETTINGS, Settings, compared
    from frametool.fit.trajectory_errors import parse_delta

    argument = {"align": align, "mount": mount, **more}
    for name, words in WORDS.items():
        if isinstance(given := {"like": like, **argument}.get(name), str) and given not in words:
            raise ValueInvalid(f"{name} {shown(given)} is not known{alternatives(given, words, 'words')}")
    if unknown := [name for name in argument if name not in SETTINGS]:
        raise TypeError(f"compare has no {unknown[0]!r}{alternatives(unknown[0], SETTINGS, 'settings')}")
    if offset is not None:
        argument["offset"] = AUTO if offset == AUTO else parse_time(str(offset))
    if deltas is not None:
        argument["deltas"] = tuple(map(parse_delta, [deltas] if isinstance(deltas, str) else deltas))
    if isinstance(first := argument.get("align_first"), str):
        argument["align_first"] = parse_delta(first, ("m", "s", "frames"))
    chosen = {name: value for name, value in argument.items() if value is not None}
    base = EVO if like else Settings()
    names = [name if isinstance(each, Trajectory) else fspath(each) for each, name in ((ref, "ref"), (est, "est"))]
    return compared(_taken(ref, "ref"), _taken(est, "est"), base.changed(**chosen), (names[0], names[1]))


def align(ref: TrajectoryLike, est: TrajectoryLike, **settings: Any) -> Alignment:
    """Align a trajectory with a reference; settings as for `compare`."""
    found = compare(ref, est, **settings)
    return Alignment(found.fit.transform, found.fit.scale, found.pairs.offset_ns / BILLION, found.whole_estimate())


def resample(
    trajectory: TrajectoryLike, *, rate: float | None = None, at: Sequence[int] | None = None, every: str | None = None,
    max_gap_ns: float | None = None,
) -> Trajectory:  # fmt: skip
    """Interpolate a trajectory: `rate` poses per second, `at` stamps in nanoseconds, or `every` "1m" or "5deg".

    Times beyond its ends, or in gaps longer than max_gap_ns (default: 3 median intervals), have no pose.
    """
    from frametool.fit.pairing import between, stamps_at_rate, stamps_every
    from frametool.fit.trajectory_errors import parse_delta

    argument = in_order(_taken(trajectory, "trajectory"), "trajectory")
    if sum(each is not None for each in (rate, at, every)) != 1:
        raise ValueInvalid("give one of rate, at and every")
    if argument.stamps_ns is None:
        raise ValueInvalid("a trajectory without stamps is not resampled")
    if rate is not None:
        stamps = stamps_at_rate(argument, checked_rate(rate))
    else:
        step = None if every is None else parse_delta(every, ("m", "deg"))
        stamps = _nanoseconds(at, "at") if step is None else stamps_every(argument, step)
    return between(argument, stamps, max_gap_ns)[0]


def in_order(found: Trajectory, name: str) -> Trajectory:
    """Sort a trajectory by its stamps; warn if that changes it."""
    for hint in found.disorder(name):
        warn(hint)
    return found.in_order()


def _taken(argument: TrajectoryLike, name: str) -> Trajectory:
    """Read a path; check and convert the arrays of a trajectory."""
    if not isinstance(argument, Trajectory):
        return load_trajectory(argument)
    xyz = np.asarray(argument.xyz, np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or not len(xyz) or not np.isfinite(xyz).all():
        raise ValueInvalid(f"{name}.xyz: finite positions of shape (n, 3) are wanted, found shape {xyz.shape}")
    xyzw = None if argument.xyzw is None else np.stack(Rotation.from_quaternion(argument.xyzw).components, -1)
    stamps = None if argument.stamps_ns is None else _nanoseconds(argument.stamps_ns, f"{name}.stamps_ns")
    for field, values in (("xyzw", xyzw), ("stamps_ns", stamps)):
        if values is not None and len(values) != len(xyz):
            raise ValueInvalid(f"{name}.{field}: {len(values)} rows for {len(xyz)} positions")
    return argument._replace(xyz=xyz, xyzw=xyzw, stamps_ns=stamps)


def _nanoseconds(values: Any, name: str) -> Array:
    stamps = np.asarray(values)
    if stamps.dtype.kind not in "iu" and stamps.size:
        raise ValueInvalid(f"{name}: integer nanoseconds are wanted, found {stamps.dtype}")
    return stamps.astype(np.int64)
