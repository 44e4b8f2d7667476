"""Results of streams of records in another form than theirs: many at once where records are written alike.

What is simple is computed in bulk; all else, and all that there is something to say of, as a text of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from frametool import sizes
from frametool.documents.document import parse_nodes
from frametool.documents.source import Source, decode
from frametool.errors import FormatError, FrametoolError, ValueInvalid
from frametool.formats.table import has_no_text
from frametool.geometry.representations import notation
from frametool.grammar.pose import Pose
from frametool.grammar.result import NoResult, Result
from frametool.stream.evaluate import Run, State
from frametool.stream.faults import DEGREES, NULL, Fault
from frametool.stream.record_cuts import FoundRecords, RecordCutter, block_of, plan_of
from frametool.stream.record_text import column_in, without_noise
from frametool.stream.record_values import MESSAGES, Teller, plain, plain_scalar, results, with_stamp_ns
from frametool.stream.request import Memory
from frametool.stream.row_layout import POINT, POSE, ROTATION, VECTOR, Target
from frametool.stream.run import tell_of_rounding
from frametool.stream.splitter import Part, Splitter
from frametool.stream.stamp_source import read_header_stamp
from frametool.stream.template import nulled
from frametool.text.lines import read_blocks
from frametool.text.spans import framed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from frametool.documents.document import Node
    from frametool.grammar.result import Style
    from frametool.stream.evaluate import Plan
    from frametool.stream.faults import BadRows
    from frametool.stream.record_cuts import Cut
    from frametool.stream.record_values import Value
    from frametool.stream.request import Request
    from frametool.stream.template import Template
    from frametool.text.lines import ByteStream
    from frametool.text.spans import Bytes

ROUNDED = "rounded"  # rule of what is told of rotations that were normalised
QUATERNIONS = Target(1.0, ((notation("quaternion"), False),), keep_sign=True)


class RecordResult(NamedTuple):
    """A record of a block, and its result if that was computed in bulk; mended: its rotation was normalised."""

    part: Part
    value: Value | None = None
    mended: bool = False


class AlikeRecords:
    """Compute the results of one block of records after the other, of those that are written alike and simple."""

    def __init__(self, splitter: Splitter, form: str, request: Request, style: Style, source: str) -> None:
        """Begin without templates."""
        self.request = request._replace(canonical=True)
        self.cutter = RecordCutter(splitter, form, self.request, source)
        self.form = style.form
        self.is_yaml = form == "yaml"
        operation = request.operation
        self.left = sizes.LEARNED  # where no records are alike, learning is lost time
        depends = operation.formula is not None or operation.velocity or self.request.in_order or request.place
        self.is_bulk = self.left > 0 and not depends
        self._plans: dict[Template, Plan | None] = {}

    def of_block(self, text: bytes, told: Mapping[str, int]) -> list[RecordResult]:
        """Return all records of a block in their order; told: how often things were told, by their rules."""
        records, rest = self.cutter.cut(text) if self.is_bulk else (FoundRecords(), [(0, len(text))])
        found: list[RecordResult] = []
        for start, end in rest:
            for part, hit in self.cutter.singly(text, start, end):
                if hit is not None:
                    records.add(part, *hit)
                    continue
                found.append(RecordResult(part))
                if self.is_bulk and self.left and not part.problem:
                    self.left -= 1
                    self.cutter.learn(text, part)
        data = framed(text)
        for cut in records.by_template():
            found += self._of_cut(cut, data, text, told)
        return sorted(found, key=lambda each: each.part.start)

    def _of_cut(self, cut: Cut, data: Bytes, text: bytes, told: Mapping[str, int]) -> list[RecordResult]:
        """Return the records of one template; those that are odd, and the first that tells something, stay open."""
        template = cut.template
        begins, ends = cut.starts[:, 0].tolist(), cut.ends[:, -3].tolist()
        found = [RecordResult(Part(start, start, end, end)) for start, end in zip(begins, ends, strict=True)]
        is_new = template not in self._plans
        if is_new:
            self._plans[template] = self._plan(template)
        if (plan := self._plans[template]) is None:
            return found
        run = Run(plan, block_of(cut, data, text), State())
        mended = {*run.mended}
        left = {*([0] if is_new else []), *(row for row, _, _ in run.doubted[:1] if not told[DEGREES])}
        left |= {*run.mended[:1]} if not told[ROUNDED] else set()
        make = self._maker(cut, text)
        for row, numbers in zip(run.rows.tolist(), run.results.tolist(), strict=True):
            if row not in left and (value := make(row, numbers)) is not None:
                found[row] = found[row]._replace(value=value, mended=row in mended)
        return found

    def _plan(self, template: Template) -> Plan | None:
        """Plan the records of a template; None where they are not simple."""
        if len(template.entries) != 1 or not (template.regular and template.says_apart):
            return None
        (entry,) = template.entries
        record, target, shape = entry.record, entry.target, entry.record.shape
        extras = shape.covariance or self.request.operation.extras(shape)
        if extras or shape.multiple or shape.place or record.placed or target.place:
            return None
        if any(type(node.value) in (dict, list) and self.is_yaml for _, node in template.rest.values()):
            return None  # it could not be read without what stands around it
        plan = plan_of(template, self.request, yaml=self.is_yaml)._replace(pieces=())
        if shape.kind in (POSE, ROTATION) and (record.key != VECTOR or target.notations):
            return plan._replace(targets=(QUATERNIONS,)) if self.form not in MESSAGES else None
        is_flat = shape.kind in (POINT, VECTOR) and (self.form == "csv" or has_no_text(self.form))
        return plan if is_flat else None

    def _maker(self, cut: Cut, text: bytes) -> Callable[[int, Sequence[float]], Value | None]:
        """Return what makes the result of a row of its numbers, as `record_values` does; None where that fails."""
        (entry,) = cut.template.entries
        kind, name, parent, target = entry.record.shape.kind, entry.name, entry.parent, entry.target
        placed, turned = target.unit is not None or target.whole, bool(target.notations)
        keys = [*cut.template.rest]
        cells = [_cells(cut, at, node, text) for at, node in cut.template.rest.values()]
        header = [_texts(cut, at, text) for at in cut.template.header]
        named: dict[str, Any] = {} if parent is None else {"frame": parent}

        def make(row: int, numbers: Sequence[float]) -> Value | None:
            try:
                stamp = {"stamp_ns": read_header_stamp(*(part[row] for part in header))} if header else {}
                said = stamp | with_stamp_ns({key: each[row] for key, each in zip(keys, cells, strict=True)}, self.form)
            except ValueInvalid:
                return None
            if kind in (POSE, ROTATION):
                tx, ty, tz, x, y, z, w = numbers
                position, rotation = (tx, ty, tz) if placed else None, (x, y, z, w) if turned else None
                return Result(Pose(position, rotation, name, parent), said)
            return named | {kind: [*numbers]} | said

        return make


def _texts(cut: Cut, at: int, text: bytes) -> list[str]:
    """Return a stretch of each record."""
    places = zip(cut.starts[:, at].tolist(), cut.ends[:, at].tolist(), strict=True)
    return [text[start:end].decode() for start, end in places]


def _cells(cut: Cut, at: int, node: Node, text: bytes) -> list[Any]:
    """Return a stretch of each record as a plain value, written like the node it was learned from."""
    texts = _texts(cut, at, text)
    known: dict[str, Any] = {cut.template.text[node.start : node.end]: plain(node)}
    for each in {*texts} - known.keys():
        if type(node.value) in (dict, list) or "\\" in each:
            known[each] = plain(parse_nodes(each)[0])
        else:
            known[each] = each[1:-1] if node.quote else plain_scalar(each)
    return [known[each] for each in texts]


def stream_results(stream: ByteStream, form: str, request: Request, style: Style, bad: BadRows) -> Iterator[Value]:
    """Yield the results of a stream of records in another form than theirs; bad ones are reported as rows are."""
    splitter = Splitter(form)
    alike = AlikeRecords(splitter, form, request, style, bad.source)
    line, rows = 1, 0
    memory, teller = Memory(), Teller(most=1)
    for block in read_blocks(stream, whole=splitter.whole):
        at = 0
        for part, value, mended in alike.of_block(block, teller.counts):
            rows += 1
            line, at = line + block.count(b"\n", at, part.start), part.start
            if value is not None:
                teller.counts[ROUNDED] += mended
                yield value
                continue
            before = bad.count
            if part.problem:
                bad.take([Fault(line, "", part.problem)])
            source = Source(bad.source, "", line)
            try:
                if not part.problem:
                    text = decode(block[part.start : part.end], bad.source)
                    plain_text = without_noise(text) if form == "yaml" else text
                    source = Source(bad.source, plain_text, line, column_in(block, part.start))
                    yield from results(source, request, style, memory, teller)
            except FormatError as error:
                below, column = source.place(max(error.line, 1), error.column)
                bad.take([Fault(below, str(column) if error.column else "", error.message)])
            except FrametoolError as error:
                bad.take([Fault.of(line, "", error)])
            if bad.count > before and bad.on_error == NULL and not part.outside:
                yield _no_result(block[part.start : part.end], form, style)
        line += block.count(b"\n", at)
    tell_of_rounding(bad.source, teller.counts[ROUNDED], rows)
    bad.finish(rows)


def _no_result(record: bytes, form: str, style: Style) -> NoResult:
    """Return what a bad record says beside its numbers; in a table those are empty cells under names of their own."""
    try:
        text = record.decode()
        said = plain(parse_nodes(nulled(text, json=form == "json") or text)[0])
    except (FormatError, UnicodeDecodeError, IndexError, TypeError):  # broken: no parser has taken it before
        said = None
    kept = said if type(said) is dict else {}
    return NoResult(Pose(), {key: value for key, value in kept.items() if style.form != "csv" or _says(value)})


def _says(value: Any) -> bool:
    """Tell whether there is more than null in a value."""
    inner = value.values() if type(value) is dict else value if type(value) is list else None
    return value is not None if inner is None else any(map(_says, inner))
