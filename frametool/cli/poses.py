"""Read poses from the command line: inline mappings, bare numbers, files, standard input.

Pasted output of other tools, in arguments and standard input, is distinguished from streams of rows or records.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager
from functools import lru_cache, partial
from io import BufferedReader, BytesIO
from typing import TYPE_CHECKING, Any

from frametool.cli.command import misuse, refuse, refuse_two_readers, say_if_typed
from frametool.documents.source import InputFile, Pasted, Source, decode
from frametool.errors import FormatError, Misused, NamedTuple, ValueInvalid, heard_by, shown, warn
from frametool.grammar.pose import Pose, pose_of_numbers
from frametool.grammar.readers import NotARotation, Reading, stamp_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from frametool.cli.output import Output
    from frametool.cli.streaming import Task
    from frametool.geometry.representations import Notation
    from frametool.grammar.result import Result
    from frametool.rows.request import Request

INLINE = "argument"
OPENING = ("{", "[")  # a mapping or list on the command line begins with one of these
# patterns of the beginning of records and tables
_MAPPING = r'\s*\{\s*["}\w][^,{]*:'
_HEADER = r"""\s*(?![ijk]\s*$|[xyzw]:\s*[-+.\d]+\s*,|Out\[)[A-Za-z_"'%#][\w"'-]*\s*(?:[,:\t]|$)"""
_COMMAS = r"\s*[-+]?[.\d][-+.\deE]*(?:[ \t]*,[ \t]*[-+]?[.\d][-+.\deE]*)+[ \t\r]*(?:\n|\Z)"
# pasted text that looks like the header of a table; the last two patterns: GTSAM, Gazebo, tf2_echo
_NO_HEADER = r"\s*[A-Za-z_]\w*:\s*\n|\s*\w+\s*=|\s*(?:R|Model|- Pose[^:]*|Translation):\s*\[|\s*Rotation: in "


def is_inline(text: str) -> bool:
    """Return True for a mapping or list written on the command line, or the inverse of one; False for a file name."""
    while found := _inverted(text):
        text = (found[1] or found[2] or "").strip()
    return text.startswith(OPENING)


def is_pasted(text: str, notation: Notation | None = None) -> bool:
    """Return True for text with a pose; False for a file name, also for the name of any existing file.

    Raises FormatError for a text of a known format that is invalid.
    """
    if is_inline(text) or text == "-" or os.path.exists(text):
        return is_inline(text)
    is_known = _inverted(text) or "\n" in text or re.match(r"\w+: *[\[{]", text)
    return bool(is_known or rewritten(Source(INLINE, text), notation, normalize=False, points=False))


@lru_cache(8)  # `is_pasted` and `pose_source` read an argument, and its warnings are written once
def rewritten(source: Source, notation: Notation | None, *, normalize: bool, points: bool) -> Source | None:
    """Return pasted text as a mapping of the grammar of poses; None for text that already is one."""
    if (re.match(_MAPPING, source.text) or re.match(_HEADER, source.text)) and "\n" not in source.text.strip():
        return None
    from frametool.ros.pasted_blocks import in_grammar

    with inline_misuse():
        return in_grammar(source, notation, normalize=normalize, points=points)


def rejoined(values: Sequence[str]) -> tuple[str, ...]:
    """Join arguments that the shell has split: `[0, 0, 0.7, 0.7]` and `0.7 + 0.7k` without quotes."""
    text = " ".join(values)
    is_apart = len(values) > 1 and (
        any(value[-1:] == "," for value in values[:-1])
        or (values[0][:1] in ("[", "(") and values[0].count("[") > values[0].count("]"))
        or re.fullmatch(r"(?=.*[ijk])[-+\d.eE*ijk ]+", text) is not None
    )
    return (text,) if is_apart else tuple(values)


def pasted_stream(
    stream: BufferedReader, name: str, request: Request, notation: Notation | None, place: str
) -> tuple[Source | None, BufferedReader]:
    """Return pasted text in a stream as a source in the grammar of poses, else None; and the unread stream.

    The stream is read to its end only if it begins as no valid stream of rows or records does.
    notation, place: the representation, or the format of geodetic positions, of --from
    """
    head = stream.peek()[:4096].decode("utf-8", "replace").lstrip("\ufeff")
    if (re.match(_MAPPING, head) or re.match(_HEADER, head)) and not re.match(_NO_HEADER, head):
        return None, stream
    if found := re.match(_COMMAS, head):  # rows in the notation of --from without a header, not rows of a matrix
        rep = notation and notation.representation
        if place or (rep and rep.whole is None and found[0].count(",") + 1 - len(rep.columns) in (0, 3)):
            return None, stream
    from frametool.grammar.pasted import begins_freely
    from frametool.ros.pasted_blocks import MOST_PASTED, in_grammar, may_be_pasted

    moves, alone = request.operation.moves, request.rows.poses == 1 and request.operation.keeps_position
    notation = None if moves else request.rows.given or notation
    is_free = may_be_pasted(head) and begins_freely(head, notation, moves=moves, alone=alone)
    if is_free is None:
        raise Misused("three rows of three numbers may be a rotation or positions; give --from matrix, or --in columns")
    if not is_free:
        return None, stream
    data = stream.read(MOST_PASTED + 1)
    if len(data) > MOST_PASTED:
        raise FormatError(f"begins as what is pasted, which is {MOST_PASTED} bytes at most; give --in", source=name)
    source = Source(name, decode(data, name))
    text = in_grammar(source, notation, normalize=request.rows.normalize, points=request.operation.moves)
    return text, BufferedReader(BytesIO(data))


def _inverted(text: str) -> re.Match[str] | None:
    """Match `inv(POSE)` and `~POSE`; `~/` begins the name of a file."""
    text = text.strip()
    return re.fullmatch(r"~(?!/)(.*)|inv\((.*)\)", text, re.DOTALL) if text.startswith(("~", "inv(")) else None


def without_inverse(argument: str) -> tuple[str, bool]:
    """Return an argument without `inv(..)` and `~`, and True if its inverse is meant: two inverses cancel.

    Raises click.UsageError if no pose is left.
    """
    bare, is_inverse = argument, False
    while (found := _inverted(bare)) and not os.path.exists(bare):
        bare, is_inverse = (found[1] or found[2] or "").strip(), not is_inverse
        refuse(not bare, f"{shown(argument)}: there is no pose whose inverse is meant")
    return bare, is_inverse


def _inverses(source: Source, request: Request) -> Source:
    """Return a source with the inverse of each pose of another source, as `invert -f json` writes them."""
    from frametool.documents.writers import dump_json
    from frametool.geometry.representations import notation
    from frametool.grammar.result import Style
    from frametool.rows.plain import results
    from frametool.rows.request import Operation, Request, RowOptions

    own = request.operation
    inverses = Request(
        Operation(similar=own.similar, multiples=own.multiples), earth=request.earth,
        rows=RowOptions(kind="pose", degrees=request.rows.degrees, normalize=request.rows.normalize),
    ).of_inverses()  # fmt: skip
    style = Style("json", (notation("quaternion"),), keep_sign=True)
    found: Iterable[Any] = results(source, inverses, style)
    return Pasted(source.name, "\n".join(dump_json(each.mapping(style)) for each in found))


def source_of(argument: str | Source) -> Source:
    """Return the source of an argument: itself if already read, inline text, a file, or standard input for `-`."""
    if isinstance(argument, Source):
        return argument
    if is_inline(argument):
        return Source(INLINE, argument)
    if argument != "-":
        try:
            return Source(argument, InputFile(argument).text)
        except FormatError as error:
            from frametool.formats.detect import instead_of_text

            raise instead_of_text(error, argument) from None
    say_if_typed()
    return Source("stdin", InputFile("-").text)


def pose_source(argument: str | Source, request: Request) -> Source:
    """Return the source of an argument as `source_of` does, with pasted text rewritten in the grammar of poses.

    In requests that move records, three numbers are a point.
    """
    if not isinstance(argument, Source):
        bare, is_inverse = without_inverse(argument)
        if is_inverse:
            return _inverses(pose_source(bare, request), request)
        argument = Source(INLINE, bare) if is_pasted(bare, request.rows.given) else bare
    source = source_of(argument)
    if request.offset_ns:
        from frametool.documents.document import parse_documents
        from frametool.rows.sources.records import with_offset

        parse_documents(source.text, source.name)  # raises for invalid text
        text, count = with_offset(source.text, request.offset_ns)
        if not count:
            raise FormatError("--time-offset has no effect: no timestamps in it", source=source.name)
        source = Source(source.name, text)
    points = request.operation.moves
    return rewritten(source, request.rows.given, normalize=request.rows.normalize, points=points) or source


def values_of(arguments: Sequence[str | Source], request: Request, output: Output) -> Iterator[Result | dict[str, Any]]:
    """Yield the results of the records of arguments."""
    from frametool.rows.plain import results

    for argument in arguments:
        yield from read_with(argument, request, partial(results, style=output.style))


def read_with(
    argument: str | Source, request: Request, read: Callable[[Source, Request], Iterable[Any]]
) -> Iterator[Any]:
    """Yield what `read` finds in an argument: inline, `-`, or a file; errors for files of frames suggest lookup."""
    with inline_misuse():
        source = pose_source(argument, request)
        try:
            yield from read(source, request)
        except FormatError as error:
            if source.name == INLINE:
                raise
            from frametool.formats.detect import with_hint

            raise with_hint(error, source.text.encode(), source.name) from None


@contextmanager
def inline_misuse() -> Iterator[None]:
    """Let the error of an invalid inline argument exit with 2; an invalid rotation is bad data, which exits with 1."""
    try:
        yield
    except FormatError as error:
        if error.source == INLINE and not isinstance(error.__cause__, NotARotation):
            error.exit_code = 2
        raise


class ArgumentPoses(NamedTuple):
    """The poses of an argument.

    others: names of extra keys; warnings: message and rule of each warning, not yet emitted
    """

    source: Source
    poses: list[Pose]
    others: set[str]
    warnings: list[tuple[Any, ...]]

    def only_poses(self, *, timed: bool) -> list[Pose]:
        """Return the poses, and emit the warnings; also warn of extra keys, except stamps if `timed`."""
        for message, rule in self.warnings:
            warn(message, rule=rule)
        left_out = [key for key in sorted(self.others) if not (timed and stamp_column([key]) is not None)]
        if left_out:
            warn(f"{self.source.name}: {', '.join(map(shown, left_out))} left out: only its pose is used")
        return self.poses

    def only_pose(self, *, timed: bool = False) -> Pose:
        """Return the single pose, with the warnings of `only_poses`; raises click.UsageError for several."""
        refuse(len(self.poses) != 1, f"one pose is wanted here, {self.source.name} holds {len(self.poses)}")
        return self.only_poses(timed=timed)[0]


def _read_argument(argument: str | Source, request: Request) -> ArgumentPoses:
    """Read all poses of one of several arguments, and collect the warnings."""
    from frametool.rows.plain import read_given
    from frametool.rows.request import COMBINED

    own = request.operation
    request = request._replace(operation=COMBINED._replace(similar=own.similar, multiples=own.multiples))
    warnings: list[tuple[Any, ...]] = []
    with heard_by(lambda *warning: warnings.append(warning)):
        read = read_with(argument, request, lambda *text: [ArgumentPoses(text[0], *read_given(*text), warnings)])
        found: ArgumentPoses = next(read)
    return found


def _several(read: Sequence[ArgumentPoses | None]) -> list[int]:
    """Return the index of the argument with several poses, [] if none has; raise ValueInvalid if two have."""
    found = [at for at, each in enumerate(read) if each and len(each.poses) > 1]
    if len(found) > 1:
        named = " and ".join(f"{each.source.name} ({len(each.poses)})" for each in read if each and each.poses[1:])
        raise ValueInvalid(f"only one argument may hold several poses, found {named}")
    return found


class Operands(NamedTuple):
    """The argument with the records, each of which has a result, and the single poses of the other arguments.

    at: the index of the argument with the records
    before, behind: the poses of the arguments to the left and right of it
    timed: the common stamp of single poses, {} without one; None if each result has the stamp of its record
    """

    at: int
    argument: str | Source
    before: list[Pose]
    behind: list[Pose]
    timed: dict[str, Any] | None


def rows_among(arguments: Sequence[str], request: Request, task: Task) -> Operands:
    """Choose the argument with the records: standard input, a table, several poses, or the last one with extra keys."""
    bare = [without_inverse(each)[0] for each in arguments]
    refuse_two_readers(bare)
    refuse(task.path and "-" not in bare, "-i FILE is read where - stands among the poses")
    streams = [at for at, each in enumerate(bare) if each == "-" or task.has_table(each)]
    files = " and ".join(bare[at] for at in streams)
    refuse(len(streams) > 1, f"only one argument may hold rows, {files} do; frametool compare takes two trajectories")
    stream = streams[0] if streams else None
    read = [None if at == stream else _read_argument(each, request) for at, each in enumerate(arguments)]
    with_extras = [at for at, each in enumerate(read) if each and each.others]
    at = [0, *with_extras, *_several(read)][-1] if stream is None else stream
    both = zip(bare, read, strict=True)
    uncertain = [text for text, each in both if each and any(pose.covariance is not None for pose in each.poses)]
    if twice := [each for each in dict.fromkeys(uncertain) if uncertain.count(each) > 1]:
        warn(f"{shown(twice[0])} appears twice: the two count as independent, as all poses do")
    rows, timed = read[at], None
    if rows is not None and len(rows.poses) == 1:
        from frametool.grammar.pose_algebra import shared_stamp

        timed = shared_stamp(pose for each in read if each for pose in each.poses)
    sides = read[:at], read[at + 1 :]
    before, behind = ([each.only_pose(timed=timed is not None) for each in side if each] for side in sides)
    streamed = "inv(-)" if without_inverse(arguments[at])[1] else "-"
    return Operands(at, rows.source if rows else streamed, before, behind, timed)


def combinations(arguments: Sequence[str], request: Request) -> list[tuple[Pose, ...]]:
    """Return tuples of one pose per argument: one tuple, or one for each pose of the argument with several."""
    found = [_read_argument(each, request) for each in arguments]
    several = _several(found)
    read = [each.only_poses(timed=True) for each in found]
    most = len(read[several[0]]) if several else 1
    return [tuple(poses[at if len(poses) > 1 else 0] for poses in read) for at in range(most)]


def one_pose(argument: str | Source, request: Request) -> Pose:
    """Return the single pose of an argument; warn of extra keys."""
    return _read_argument(argument, request).only_pose()


def pose_from_numbers(texts: Sequence[str], request: Request) -> Pose:
    """Read a pose from bare numbers; raises click.UsageError, or NotARotation for an invalid rotation."""
    reading = Reading(Source(INLINE, ""), degrees=request.rows.degrees, normalize=request.rows.normalize)
    with misuse():
        found = pose_of_numbers(texts, request.rows.given, reading)
    for note in reading.notes:
        warn(note.message)
    return found
