"""Gather the poses of a whole stream in arrays, for what needs all of them at once: trajectories, points, means."""

from __future__ import annotations

import re
from functools import reduce
from itertools import chain
from math import degrees, sqrt
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from frametool.errors import FormatError, ValueInvalid, did_you_mean, first_of, shown
from frametool.formats.table import FORMATS
from frametool.geometry.transform import Transform
from frametool.grammar.covariance import is_sigma
from frametool.grammar.edges import Answers
from frametool.grammar.pose import Pose
from frametool.grammar.readers import EARTH_FRAMES, NAME_KEYS, PARENT_COLUMNS, stamp_column
from frametool.grammar.result import Result, Style, uncertain
from frametool.rows.batch import RowPoses, block_of, codes_of, is_typed, kept, objects, plain_cells, read_each
from frametool.rows.conversion import AS_VALUES, FormatConverter
from frametool.rows.faults import BadRows, Fault, Outcome, run
from frametool.rows.plain import read_poses
from frametool.rows.request import COMBINED, NO_STAMPS, Operation, Request, RowOptions
from frametool.rows.shapes import NOWHERE, POINT, POSE
from frametool.rows.sinks.results import BlockResults
from frametool.rows.sources.records import run_records
from frametool.text.numbers import parse_number
from frametool.text.parse import parse_floats
from frametool.text.spans import Spans, without_quotes

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from frametool.documents.source import Source
    from frametool.rows.conversion import Step
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Ints

POSITION = 3  # numbers of a position


def posed(outcomes: Iterable[Outcome], source: str, *, timed: bool = True) -> Iterator[Step]:
    """Yield the results of records as poses or points with their lines, block by block.

    timed: either all results need a stamp, or none
    Raises FormatError for other results.
    """
    for outcome in outcomes:
        results: BlockResults = outcome.results or BlockResults((), [])  # type: ignore[assignment]
        found = block_of(results, timed=timed, as_poses=True)
        if found.kind not in (POSE, POINT):
            raise FormatError("expected poses, or points", source=source)
        ends = np.flatnonzero(np.frombuffer(results.text, np.uint8) == ord("\n"))
        yield found._replace(lines=np.searchsorted(ends, found.lines)), outcome


class Gathered:
    """The rows of a stream as poses (n, 7), in metres and as unit quaternions; a missing part is nan.

    keys: the other columns to keep
    """

    def __init__(self, keys: Sequence[str] = ()) -> None:
        """Begin without rows."""
        self.keys = keys
        self.blocks: list[RowPoses] = []

    def of(self, steps: Iterable[Step]) -> Generator[Outcome]:
        """Keep the rows of blocks, with lines from 1; yield the outcomes of the blocks."""
        line = 1
        for rows, outcome in steps:
            if len(rows.numbers):
                numbers = rows.numbers[:, : 7 if rows.kind == POSE else POSITION]  # a covariance is behind them
                numbers = np.pad(numbers, ((0, 0), (0, 7 - numbers.shape[1])), constant_values=np.nan)
                numbers[:, : 0 if rows.placed else POSITION] = np.nan
                extras = {key: rows.extras[key] for key in self.keys if key in rows.extras}
                self.blocks.append(rows._replace(numbers=numbers, lines=rows.lines + line, extras=extras))
            line += outcome.lines
            yield outcome

    def rows(self, source: str) -> RowPoses:
        """Return all rows as one block, with the kept columns that exist; raises FormatError if there are none."""
        if not self.blocks:
            raise FormatError("no poses or points in it", source=source)
        stamps = [each.stamps_ns for each in self.blocks if each.stamps_ns is not None]
        if len(stamps) not in (0, len(self.blocks)):
            raise FormatError("some poses have a stamp and some have none", source=source)
        parents = [*chain.from_iterable(each.for_each(each.parents) for each in self.blocks)]
        names = [*chain.from_iterable(each.for_each(each.names) for each in self.blocks)]
        extras = {
            key: objects(chain.from_iterable(
                plain_cells(each.extras[key]) if key in each.extras else [None] * len(each.numbers)
                for each in self.blocks
            ))
            for key in self.keys if any(key in each.extras for each in self.blocks)
        }  # fmt: skip
        numbers = np.concatenate([each.numbers for each in self.blocks])
        lines = np.concatenate([each.lines for each in self.blocks])
        return RowPoses(numbers, np.concatenate(stamps) if stamps else None, lines, parents, names, extras)


def gathered(steps: Iterable[Step], bad: BadRows, keys: Sequence[str] = ()) -> RowPoses:
    """Return all results of a stream as one block with lines from 1; keys: the other columns to keep, as plain values.

    bad: reports the bad rows.  Raises FormatError if no row is left.
    """
    found = Gathered(keys)
    run(found.of(steps), lambda _: None, bad)
    return found.rows(bad.source)


def samples_of(
    stream: ByteStream, fmt: str, asked: RowOptions, bad: BadRows, keys: Sequence[str] = (),
    answers: Answers = Answers(),  # noqa: B008 - it is frozen
) -> RowPoses:  # fmt: skip
    """Return the poses or points of a stream in any format of records, rows, or columns of numbers.

    asked: how they are read; bad, keys: as for `gathered`
    """
    request = Request(rows=asked, on_error=bad.on_error)
    if "records" not in FORMATS[fmt].reads:
        request = request._replace(operation=Operation(moves=True), rename=lambda parent, name: (parent, name))
    has_stamps = asked.stamps != NO_STAMPS
    return gathered(steps_of(stream, fmt, request, bad.source, Style("tum"), answers, timed=has_stamps), bad, keys)


def steps_of(
    stream: ByteStream, fmt: str, request: Request, source: str, style: Style = AS_VALUES,
    answers: Answers = Answers(),  # noqa: B008 - it is frozen
    *, header: bool = True, timed: bool = False,
) -> Iterator[Step]:  # fmt: skip
    """Yield the results of each block of a stream in such a format; timed: as for `posed`."""
    if "records" in FORMATS[fmt].reads:
        return posed(run_records(stream, fmt, request, source=source, style=style), source, timed=timed)
    return FormatConverter(fmt, request, source, style, answers).steps(stream, header=header)


class MeanRows(Gathered):
    """The poses of streams and arguments to average, each with its weight or label if there are any.

    extra: for each block the weights, or the indices of the labels in `labels`
    place: returns the place of a line of the stream; named: the places of the poses from arguments
    """

    def __init__(self, weights: str | None, by: str | None) -> None:
        """Begin without rows; weights: the column or key of the weights, by: that of the labels."""
        super().__init__()
        self.key, self.by = by or weights, by
        self.uncertain = self.stamped = self.local = False  # local: results have other axes, so no covariance
        self.extra, self.labels = list[Any](), dict[str, int]()
        self.named: list[str] = []
        self.place: Callable[[int], str] = str

    def take(self, steps: Iterable[Step], place: Callable[[int], str]) -> Generator[Outcome]:
        """Keep the rows of a stream; a row without a weight is bad; place: returns the place of a line."""
        self.place = place
        return self.of(map(self._looked_at, steps))

    def add(self, source: Source, request: Request, *, name: str) -> list[Pose]:
        """Add the poses of an argument and return them; name: of the argument, for messages."""
        poses = read_poses(source, request._replace(operation=COMBINED))
        self.named += [f"{name}, pose {at}" for at in range(1, len(poses) + 1)] if len(poses) > 1 else [name]
        results = BlockResults((), [*enumerate(map(Result, poses))])
        for _ in self.of(map(self._looked_at, posed([Outcome(b"", results=results)], name, timed=False))):
            self.stamped |= any(pose.stamp_ns is not None for pose in poses)
            self.uncertain |= any(pose.covariance is not None for pose in poses)
        return poses

    def _looked_at(self, step: Step) -> Step:
        """Take the weights or labels of a block, and note covariances and stamps; rows without a weight are bad."""
        rows, outcome = step
        if not len(rows.numbers):
            return step
        with_each = (*rows.extras, *rows.more)
        self.uncertain |= any(re.fullmatch("sigma|c11|.*covariance", key) or is_sigma(key) for key in with_each)
        self.stamped |= rows.stamps_ns is not None or stamp_column(with_each) is not None
        rows = rows._replace(stamps_ns=None)
        if self.key is None or self.named:
            return rows, outcome
        values, reasons = self._values(rows, self.key)
        faults = [Fault(int(rows.lines[row]), self.key, reason) for row, reason in reasons.items()]
        if reasons:
            good = np.delete(np.arange(len(values)), [*reasons])
            rows, values = kept(rows, good), values[good]
        self.extra.append(values)
        return rows, outcome._replace(faults=sorted([*outcome.faults, *faults]))

    def _values(self, rows: RowPoses, key: str) -> tuple[Any, dict[int, str]]:
        """Return the weights or labels of rows, and the reason for each row that has none."""
        cells: Any = rows.extras.get(key, rows.extras.get(f"column {key}"))
        if cells is None and key in NAME_KEYS + PARENT_COLUMNS:
            cells = objects(rows.for_each(rows.names if key in NAME_KEYS else rows.parents))
        elif cells is None:  # a key in a mapping: `detections.weight`
            first, *steps = key.split(".")
            outer = plain_cells(rows.extras[first]) if first in rows.extras else [None] * len(rows.numbers)
            cells = objects(reduce(_below, steps or [key], each) for each in outer)
        size, missing, numbers = len(rows.numbers), dict[int, str](), np.zeros(len(rows.numbers))
        if not (isinstance(cells, Spans) or is_typed(cells)):
            none = f"no key {shown(key)}{did_you_mean(key, rows.extras)}"
            missing = {row: none for row, cell in enumerate(cells.tolist()) if cell is None}
        if self.by is not None:
            texts, codes = codes_of(cells)
            own = [self.labels.setdefault(text, len(self.labels)) for text in texts]
            return np.array(own)[codes], missing
        unread = np.arange(size)
        if isinstance(cells, Spans):
            numbers, unread = parse_floats(without_quotes(cells))
        elif is_typed(cells):
            numbers, unread = cells.astype(np.float64), np.flatnonzero(~np.isfinite(cells))
        texts = codes_of(cells).each() if len(unread) else []
        there = (row for row in unread.tolist() if row not in missing)
        reasons = missing | read_each(numbers, there, lambda row: parse_number(texts[row]))
        negative = np.flatnonzero(numbers < 0.0).tolist()
        return numbers, reasons | {row: f"weight {numbers[row]:g} is negative" for row in negative}

    def groups(self, size: int) -> Iterator[tuple[str | None, Ints]]:
        """Yield each label with its rows, by the first row that has it; without labels None with all rows."""
        if self.by is None:
            yield None, np.arange(size)
            return
        if not self.extra:
            raise ValueInvalid("what was pasted has no columns or keys to group it by; leave --by out")
        labels, codes = [*self.labels], np.concatenate(self.extra)
        order = np.argsort(codes, kind="stable")
        for rows in sorted(np.split(order, np.flatnonzero(np.diff(codes[order])) + 1), key=itemgetter(0)):
            yield labels[codes[rows[0]]], rows


def _below(value: Any, key: str) -> Any:
    return value.get(key) if type(value) is dict else None


def means_of(rows: MeanRows, values: list[float] | None, *, robust: bool) -> Iterator[tuple[Result, list[str]]]:
    """Yield the mean of all poses, or of each label, with its spread, and a message for each outlier.

    values: the weights of poses from arguments
    """
    from frametool.fit.least_squares import length, off_text
    from frametool.fit.robust_mean import solve_mean

    if not rows.blocks:
        raise ValueInvalid("no poses to take the mean of")
    by, (numbers, _, lines, *named) = rows.by, rows.rows("")[:5]
    placed, turned = (not np.isnan(part).all() for part in (numbers[:, 0], numbers[:, POSITION]))
    poses = Transform.of(*np.where(np.isnan(numbers), NOWHERE, numbers).T.copy())
    parents, names = (np.array(each, object) for each in named)
    weights = np.concatenate(rows.extra) if by is None and rows.extra else values
    for label, at in rows.groups(len(poses)):
        frames, bodies = ({*(each if by is None else each[at])} for each in (parents, names))
        frames = {each for each in frames if each is not None and not each.isdecimal()}  # a counter is no frame
        if len(frames) > 1 and not frames.issubset(EARTH_FRAMES):
            raise ValueInvalid(f"the poses are in {first_of(sorted(map(str, frames)), 3)}; use one frame for all")
        found = solve_mean(poses if by is None else poses[at], weights=weights, robust=robust)
        (metres, radians), (farthest, widest), covariance = found.rms, found.most, found.covariance
        extras: dict[str, Any] = {} if by is None else {by: label}
        extras |= {"count": len(found.used)} | ({"used": int(found.used.sum())} if robust else {})
        left_out: list[str] = []
        for row in found.left_out.nonzero()[0].tolist():
            off = off_text(*length(found.residuals[row].reshape(2, 3)), digits=2)
            place = rows.named[at[row]] if rows.named else rows.place(int(lines[at[row]]))
            left_out.append(f"{place}: left out, {off} off (u {found.u[row]:.1f})")
        body = bodies.pop() if len(bodies) == 1 else None
        pose = Pose.of(found.transform.components, body, max(frames, default=None))
        if placed:
            extras |= {"distance_rms": metres, "distance_max": farthest}
        if turned:
            extras |= {"angle_rms": radians, "angle_rms_deg": degrees(radians)}
            extras |= {"angle_max": widest, "angle_max_deg": degrees(widest)}
        if covariance is not None and not rows.local:
            if placed:
                extras |= {f"std_{axis}": sqrt(covariance[at, at]) for at, axis in enumerate("xyz")}
            if turned:
                angle = sqrt(covariance[3:, 3:].trace())
                extras |= {"std_angle": angle, "std_angle_deg": degrees(angle)}
            extras |= uncertain((covariance if turned else covariance[:3, :3]).ravel().tolist())
        position, rotation = pose.position if placed else None, pose.rotation if turned else None
        yield Result(pose._replace(position=position, rotation=rotation), extras), left_out
