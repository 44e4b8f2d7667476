"""Choose the format of results by the options and the suffix of the output, and write them."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from itertools import chain, islice
from operator import attrgetter
from os.path import splitext
from typing import TYPE_CHECKING, Any

from click import UsageError

from frametool.cli.command import Inputs, refuse
from frametool.cli.options import FULL
from frametool.cli.sink import encoded, in_colour, is_special, say, writing
from frametool.errors import ValueInvalid, first_of, listing, printable, shown, warn
from frametool.formats import table
from frametool.geometry.representations import Notation, notation
from frametool.grammar.result import SPELLED, RecordingStyle, Result, Style, sample_results

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from frametool.cli.sink import Write
    from frametool.frames.lookups import Frames
    from frametool.rows.batch import RowPoses
    from frametool.rows.plain import Value
    from frametool.rows.request import Operation
    from frametool.rows.sinks.results import BlockResults, ResultWriter


def _recording_path(fmt: str, output: str | None) -> str:
    """Return the path of a recording to write; raises UsageError if it does not fit the format."""
    if output is None or output == "-":
        raise UsageError(f"{fmt} is no text; give -o {'FOLDER' if fmt in table.FOLDERS else 'FILE'}")
    suffixes = table.FORMATS[fmt].suffixes
    if fmt in table.FOLDERS and output.endswith(suffixes):
        raise UsageError(f"-o {output}: a ROS 2 bag is written as a folder of MCAP; give -f {fmt} -o FOLDER")
    named = None if fmt in table.FOLDERS else table.by_name(output, table.writers("recording"))
    if named not in (None, fmt):
        raise UsageError(f"-o {output} is the name of {named}, -f says {fmt}; give -o NEW{suffixes[0]}")
    return output


def folder_of(place: str) -> str:
    """Return the folder of an output path, "" if it does not exist."""
    folder = os.path.dirname(os.path.abspath(place))
    return folder if os.path.isdir(folder) else ""


def copy_target(fmt: str, path: str, output: str | None, named: str | None) -> tuple[str, str]:
    """Return the format and the path of a copy of a recording; raise UsageError if they do not fit.

    named: the format of -f, None if the name of the output decides
    """
    folder = "bag2" if os.path.isdir(path) and output and not os.path.splitext(output)[1] else None
    copy = named or table.by_name(output, table.writers("recording")) or folder
    if copy is None:
        unknown = f"-o {output} names no format; " if output else ""
        raise UsageError(f"{unknown}give {'-o NEW.bag' if fmt == 'bag1' else '-o NEW.mcap or -f bag2 -o FOLDER'}")
    place = _recording_path(copy, output)
    if "bag1" in (fmt, copy) and fmt != copy:
        what = f"{path} is copied as {'a ROS 1 bag' if fmt == 'bag1' else 'mcap or bag2'}, not as {copy}"
        raise UsageError(f"{what}; rosbags-convert --src {path} --dst {output} makes that of it")
    return copy, place


BATCH = 256  # poses that are written together
QUATERNION = (notation("quaternion"),)  # the default representation
ZEROS = r"(?<![\w.:])(?P<dim>-?0\.0+)(?![\w.])"
ENDS = (  # the frames of a pose
    r"(?m)^(?P<green>\S.*?)(?: at \S+)? seen from (?P<cyan>.*?)(?: at \S+)?(?=  \(maps|$)",
    r"(?m)\(maps points in (?P<green>.+?) to points in (?P<cyan>.+?)\)$",
)
WITH_PLACES = ("text", *SPELLED, *table.writers("recording"))
OF_TEXT = (".txt", ".out", ".log", ".dat")


class Output:
    """The destination, format and style of results, from the options of a command."""

    marks: tuple[str, ...] = (ZEROS, *ENDS)  # patterns with a style in text on a terminal

    def __init__(self, inputs: Inputs, *what: str, otherwise: str | None = None) -> None:
        """Choose the format: that of --format, else by the file's suffix, else text for a terminal and YAML for a pipe.

        what: kinds of results, which determine the formats that a suffix may name
        otherwise: the default format, instead of text and YAML
        """
        self._inputs = inputs
        self.path: str | None = inputs.output
        self.force = bool(inputs.force)
        named: str | None = inputs.format_name
        if self.path is not None and named is None:
            from frametool.formats.detect import refuse_suffix

            refuse_suffix(self.path)
        self.chosen = named or (table.by_name(self.path, table.writers(*what)) if self.path is not None else None)
        notations, place = inputs.notations or (), None
        if inputs.peek("origin") is not None or any(map(attrgetter("representation.on_earth"), notations)):
            from frametool.cli.earth_options import places_of

            notations, place = places_of(inputs, notations)
        self.notations: tuple[Notation, ...] = notations
        self._format_is_default = not (self.chosen or otherwise)
        fmt = self.chosen or otherwise or ("text" if self.path is None and sys.stdout.isatty() else "yaml")
        row = table.FORMATS.get(fmt, table.Format("of people"))
        self.is_trajectory = "trajectory" in row.reads  # the poses of one frame over time
        self._is_text = {"arrays", "recording"}.isdisjoint(row.writes)
        self._in_blocks = self.is_trajectory or not self._is_text
        self.holds_all = self._in_blocks or fmt == "csv"  # formats for many rows
        if "arrays" in row.writes and self.path is None and sys.stdout.isatty():
            raise ValueInvalid(f"{fmt} is no text for a terminal; give -o FILE, or pipe it")
        usual = () if fmt in ("text", "dot", "mermaid") else QUATERNION  # text and drawings have other defaults
        digits = inputs.peek("precision")
        self.style = Style(
            fmt, notations or usual, degrees=bool(inputs.deg), precision=None if digits == FULL else digits,
            full=digits is not None, keep_sign=bool(inputs.keep_sign),
            screen=self.chosen in (None, "text") and self.path is None and sys.stdout.isatty(),
        ).changed(place=place)  # fmt: skip
        if "recording" in row.writes:
            folder = folder_of(_recording_path(fmt, self.path))
            frames = inputs.recorded_frames or next(iter(inputs.named_frames), ())
            is_pair = len(frames) in (0, 2) and len({*frames}) == len(frames)
            refuse(not is_pair, "--frames takes WORLD,BODY, different names")
            recording = RecordingStyle(tuple(inputs.messages), inputs.topic_out or "", frames, folder)
            self.style = self.style._replace(recording=recording)

    def set_camera_axes(self, known: str, operation: Operation | None = None) -> None:
        """Set the axes of the camera whose poses are written: by --camera-axes, else `known`, those of the input."""
        stated = self._inputs.peek("camera_axes") or ""
        axes = (stated or known) if operation is None or operation.keeps_child else ""
        self.style = self.style._replace(axes=axes, in_camera=operation is not None and operation.looks_back)
        row = table.FORMATS.get(self.style.format)
        if self.style.axes and row and row.rows.axes:
            self._inputs.use("camera_axes")

    def set_camera_axes_of(self, tree: Frames, source: str) -> None:
        """Set the camera axes of a frame of a tree; if the tree has no cameras, --camera-axes applies to this frame."""
        if source in tree.camera_axes or not tree.camera_axes:
            self.set_camera_axes(tree.camera_axes.get(source, ""))

    def values(self, values: Iterable[Value]) -> None:
        """Write results: poses in the chosen representations, other records, which are mappings, unchanged."""
        if not self._in_blocks:
            self.text(self.text_of([*values]))
            return
        from frametool.rows.sinks.results import blocks_of

        writer = self.writer()
        self.pieces(filter(None, chain(map(writer.of_block, blocks_of(values)), writer.end())))

    def rows(self, found: RowPoses) -> None:
        """Write poses or points, in blocks if the format holds rows."""
        from frametool.rows.batch import kept, values_of
        from frametool.rows.conversion import Blocks
        from frametool.rows.sinks.results import TOGETHER

        if not (self._in_blocks or self.style.format in SPELLED):
            self.values(values_of(found, self.style.place))
            return
        self._refuse_places()
        writer = Blocks(self.style)
        parts = (kept(found, slice(at, at + TOGETHER)) for at in range(0, len(found.numbers), TOGETHER))
        self.pieces(filter(None, chain(map(writer.of_block, parts), writer.end())))

    def _refuse_places(self) -> None:
        """Raise ValueInvalid if the format cannot hold latitude and longitude."""
        if self.style.place is not None and self.style.format not in WITH_PLACES:
            names = ", ".join(each.name for each in (self.style.place, *self.style.place.more))
            raise ValueInvalid(f"{self.style.format} has no place for {names}; write csv, json, yaml or text")

    def text_of(self, found: list[Value]) -> str:
        """Return the text of all results; warn of extras that the format cannot hold."""
        self._refuse_places()
        poses = [each for each in found if isinstance(each, Result)]
        if len(poses) < len(found) and self.style.format != "csv":
            if self.style.format in table.FORMATS and "points" not in self._writes:
                raise ValueInvalid(f"{self.style.format} holds poses; a point has no rotation")
            mappings = [each.mapping(self.style) if isinstance(each, Result) else each for each in found]
            placed = [each for each in mappings if not {"point", "vector"}.isdisjoint(each) and "header" not in each]
            # as text, points and vectors are one per line if all are lists of numbers; otherwise all records are YAML
            is_plain = all(any(isinstance(each.get(kind), list) for kind in ("point", "vector")) for each in mappings)
            text_module = "frametool.view.text" if is_plain else table.FORMATS["yaml"].writer
            text, others = self._module(text_module).write_points(mappings, self.style), {*chain.from_iterable(placed)}
        else:
            keys = {key for each in poses for key in each.all_extras(self.style)}
            if len(poses) > 1 or "covariance" in keys:
                self._shorten()
            if "scale" in keys:
                from frametool.rows.sinks.as_rows import refuse_scale_in

                refuse_scale_in(self.style.format, keys)
            text = self._module("frametool.view.text").write_poses(found, self.style)
            others = {*chain.from_iterable(map(attrgetter("extras"), poses))}
        if self.style.format not in WITH_PLACES and (others := others - {"stamp_ns", "point", "vector", "frame"}):
            warn(f"{self.style.format}: {listing(others)} left out")
        return str(text)

    def _shorten(self) -> None:
        """Show poses on a terminal as quaternion and rpy only, unless --to chooses a representation."""
        if self.style.screen and not self.style.notations:
            self.style = self.style._replace(notations=(notation("quaternion"), notation("rpy_deg")))

    def stream_poses(self, results: Iterator[Result]) -> None:
        """Write poses that have the same keys, in batches."""
        self._shorten()
        self._refuse_places()
        if self._in_blocks:
            self.values(results)
        else:
            self.pieces(self._batches(results))

    def _batches(self, results: Iterator[Result]) -> Iterator[str | bytes]:
        """Yield the text of results in batches of growing size.

        In every format the text of several results begins with that of the first one.  Each batch is formatted after
        the
        first result, whose text is then cut off.
        """
        write_poses = self._module("frametool.view.text").write_poses
        size = 2
        begin = list(islice(results, size))
        yield write_poses(begin, self.style)
        known = len(write_poses(begin[:1], self.style))
        while batch := list(islice(results, size)):
            yield write_poses([begin[0], *batch], self.style)[known:]
            size = min(2 * size, BATCH)

    def writer(self) -> ResultWriter:
        """Return the writer of the results of a stream of records."""
        from frametool.rows.sinks.results import CsvTable, Documents

        self._refuse_places()
        if self.style.format in SPELLED:
            return CsvTable(self.style) if self.style.format == "csv" else Documents(self.style)
        if not self._in_blocks:
            return CollectingWriter(self)
        from frametool.rows.conversion import Blocks

        return Blocks(self.style)

    def tree(self, tree: Frames, color: str = "auto") -> None:
        """Write a tree; as text in colour if `color` says so; in a format of poses with every sample."""
        if tree.drawn and self._format_is_default:
            self.style = self.style.changed(format="text")
        if tree.drawn and self.style.format != "text":
            raise ValueInvalid(f"{tree.name} has no poses to write as {self.style.format}; -f text shows its frames")
        fmt, is_ours = self.style.format, self.style.format in ("yaml", "json", "text")
        may_hold = fmt != "text" and (is_ours or "cameras" in table.FORMATS[fmt].reads)
        cameras = (not is_ours and tree.cameras) or (may_hold and tree.read_cameras())
        for what, held in (("covariances", not is_ours and tree.covariances), ("intrinsics of cameras", cameras)):
            if held:
                warn(f"{fmt}: {what} left out")
        if table.holds(self.style.format, "recording"):
            self.pieces(self._module("").tree_pieces(tree, self.style))
            return
        holds_samples = "trajectory" in self._writes or (tree.moves and "poses" in self._writes)
        if holds_samples and self.style.format not in ("yaml", "json"):
            if self.is_trajectory:
                children = [track.child for track in tree.tracks()]
                if len(children) != 1:
                    frames = first_of(children, 8, quote=shown) or "none"
                    instead = f"name two: lookup TREE TARGET SOURCE -f {self.style.format}"
                    raise ValueInvalid(f"{self.style.format} holds one frame, the tree has {frames}; {instead}")
                self.set_camera_axes_of(tree, children[0])
            self.values(sample_results(tree))
            return
        if self.style.format != "text":
            if loses := table.FORMATS[self.style.format].not_stored:
                say(f"note: {loses}")
            self.text(self._module("").write_tree(tree, self.style))
            return
        from frametool.view.reports import TREE_MARKS, write_tree

        text, self.marks = write_tree(tree, self.style), TREE_MARKS
        screen = self.path is None and (color == "always" or (color == "auto" and self.style.screen))
        self.style = self.style._replace(screen=screen)
        self.text(text)

    def report(self, entries: Sequence[dict[str, Any]]) -> None:
        """Write flat records that are neither poses nor points."""
        if self.style.format != "text":
            self.text(self._module("").write_points(entries, self.style))
            return
        from frametool.view.reports import problem_patterns, write_report

        self.marks = problem_patterns(entries)
        self.text(write_report(entries))

    @property
    def _writes(self) -> tuple[str, ...]:
        return table.FORMATS[self.style.format].writes if self.style.format in table.FORMATS else ()

    def _module(self, default: str) -> Any:
        return import_module(table.FORMATS[self.style.format].writer if self.style.format in table.FORMATS else default)

    def pieces(self, pieces: Iterable[str | bytes]) -> None:
        """Write pieces of text as they arrive; a file is written atomically."""
        if self._is_text:
            self._inputs.use("precision")
        with self.opened() as write:
            for piece in pieces:
                write(self.shown(piece) if isinstance(piece, str) else piece)
        if self.path:
            self.report_suffix()

    def shown(self, text: str) -> str:
        """Return text as it is written: the text format printable, and in colour on a terminal."""
        if self.style.format == "text":
            text = "\n".join(map(printable, text.split("\n")))
            return in_colour(text, self.marks) if self.style.screen else text
        return text

    def opened(self) -> AbstractContextManager[Write]:
        """Open the output for writing."""
        return writing(self.path, force=self.force, folder=self.style.format in table.FOLDERS)

    def report_suffix(self, fmt: str = "") -> None:
        """Report the format of an output file if no format has its suffix and --format is not set.

        fmt: format of a stream that is written as it was read: its suffixes and those of text are not reported
        """
        if not self._format_is_default or not self.path or any(map(self._inputs.peek, ("quiet", "explain"))):
            return
        suffix = splitext(self.path)[1]
        usual = (*OF_TEXT, f".{fmt}", *table.FORMATS[fmt].suffixes) if fmt else ()
        if suffix.lower() not in ("", *usual) and not is_special(self.path):
            none = f"no format written here has the suffix {shown(suffix)}"
            say(f"note: {self.path}: {none}; it holds {fmt or self.style.format}, -f says another")

    def text(self, text: str) -> None:
        """Write text."""
        self.pieces([text])


class CollectingWriter:
    """Collect results for formats that need all of them at once."""

    def __init__(self, output: Output) -> None:
        """Create a collector without results."""
        self.output, self.values = output, list[Any]()

    def of_block(self, block: BlockResults) -> bytes:
        """Collect the results of a block of records and return no text yet."""
        self.values += block.in_order()
        return b""

    def end(self) -> Iterator[bytes]:
        """Yield the text of all results."""
        yield encoded(self.output.shown(self.output.text_of(self.values)))
