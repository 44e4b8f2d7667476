"""What commands on poses share: their stream, their output, and `--explain`, the derivation in place of the result."""

from __future__ import annotations

import os
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import Inputs, option, refuse, together
from frametool.cli.options import FULL, pose_reading_options
from frametool.cli.output import Output
from frametool.cli.poses import inline_misuse, is_pasted, pose_source, values_of, without_inverse
from frametool.cli.streaming import Stream, stream_options
from frametool.errors import heard_by, warn

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frametool.documents.source import Source
    from frametool.explain.derive import DerivationStyle
    from frametool.explain.operations import WrittenPose
    from frametool.explain.render import Explanation
    from frametool.stream.request import Request

FORMS = ("text", "markdown")
ONE_RECORD = "--explain derives one record; write it as an argument"


def explain_option(**rest: Any) -> Callable[[Any], Any]:
    """Return --explain, with what it says of other options."""
    return option("--explain [=FORM]", "derive the result step by step (help explain)", FORMS, under="Result", **rest)


EXPLAIN = explain_option()
pose_stream_options = together(stream_options, pose_reading_options)


class PoseTask:
    """What the options of a command on poses say.

    derives: whether the derivation is wanted instead of the result
    plan: how then
    """

    def __init__(self, inputs: Inputs, *what: str) -> None:
        """Look at what the options say; `what` are the results that the command writes."""
        self.inputs = inputs
        self._format: str = inputs.explain or ""
        self.derives = bool(self._format)
        self.normalize: bool = inputs.normalize
        self.stream = Stream(inputs)
        self.output = Output(inputs, *what or ("poses",))
        self.plan = self._plan() if self.derives else None

    def request(self, **rest: Any) -> Request:
        """Return what is done with rows and records: they are read as the options say."""
        from frametool.stream.request import Request

        offset_ns = 0 if self.inputs.reads_trees else self.inputs.time_offset or 0
        if rest.get("window"):
            self.inputs.ask("start", "stop")
            rest["extra_column"] = rest.get("extra_column") or ""
        said = [self.inputs.peek(name) or () for name in ("values", "poses", "pose", "a", "b")]
        texts = [text for each in said for text in ([each] if isinstance(each, str) else each)]
        if rest.get("poses") != 0 and not (texts and all(map(_says_all, texts))):
            self.inputs.ask("from_rep")
        own = {"given": self.stream.notation, "degrees": self.output.style.degrees, "normalize": self.normalize}
        made = self.at_places(Request(offset_ns=offset_ns, **own, **rest))
        self.output.take_axes("", made.operation)
        return made

    def at_places(self, request: Request) -> Request:
        """Add what the options say of places on the Earth, where they say anything."""
        place = self.output.style.place
        if not (place or self.stream.place or any(map(self.inputs.peek, ("origin", "local_axes", "zone")))):
            return request
        from frametool.cli.earth import earth

        usual = request.by_default or not self.output.notations
        return request._replace(place=place, given_place=self.stream.place, earth=earth(), by_default=usual)

    def has_table(self, argument: str) -> bool:
        """Return True if an argument is a file of rows; it is then what -i FILE would be."""
        return not is_pasted(argument, self.stream.notation) and self.stream.takes_rows(argument)

    def only_arguments(self, arguments: Sequence[str | Source | None]) -> None:
        """Ask for what is said of files, where arguments are all that is read and one of them may be a file."""
        refuse(self.stream.path is not None, "-i FILE and arguments are two inputs; give one")
        if any(isinstance(each, str) and os.path.exists(each) for each in arguments):
            self.inputs.ask("input_formats")

    def answer(self, argument: str | Source, request: Request, timed: dict[str, Any] | None = None) -> int:
        """Write the results of the records of one argument: inline, a file, or the stream of the command.

        timed: the stamp of a single result, {} for none, where it is not that of its record
        """
        if isinstance(argument, str):
            bare, is_inverse = without_inverse(argument)
            if bare == "-" or self.has_table(bare):
                return self.stream.run(request.of_inverses() if is_inverse else request, self.output)
        self.only_arguments([argument])
        values = values_of([argument], request, self.output)
        if timed is not None:
            from frametool.stream.record_values import at_time

            values = (at_time(each, timed) for each in values)
        self.output.values(values)
        return 0

    def _plan(self) -> DerivationStyle:
        """Return how to derive; refuse what a derivation cannot be: a machine format, a stream."""
        from frametool.explain.derive import DerivationStyle

        if self.output.chosen not in (None, "text"):
            written = f"{', '.join(FORMS)}, not {self.output.chosen}"
            raise click.UsageError(f"--explain writes {written}; leave one of them out")
        return DerivationStyle(self.output.style, significant(self.inputs.precision))

    def written(self, argument: str | Source | None, *, warned: bool = False) -> WrittenPose:
        """Read the one pose of an argument as it is written.

        warned: its warnings are on stderr already
        """
        if isinstance(argument, str):
            argument, is_inverse = without_inverse(argument)
            if is_inverse:
                return self.written(argument, warned=warned).turned()
        from frametool.stream.written import written_poses

        request = self.request()
        with inline_misuse(), heard_by(lambda *_: None) if warned else nullcontext():
            source = pose_source(one_argument(argument), request)
            found = written_poses(source, degrees=request.degrees, normalize=request.normalize)
        refuse(len(found) != 1, f"--explain derives one pose, {source.name} holds {len(found)}")
        if found[0].pose.covariance is not None:
            warn(f"{source.name}: --explain derives the pose alone; its covariance is left out")
        return found[0]

    def derive(self, operation: str, *parts: Any, **more: Any) -> int:
        """Write the derivation of an operation where the result would go."""
        from frametool.explain import derive

        return self.write(getattr(derive, operation)(self.plan, *parts, **more))

    def write(self, explanation: Explanation) -> int:
        """Write a derivation where the result would go."""
        self.output.text(explanation.render(self._format))
        return 0


def _says_all(text: str) -> bool:
    """Return True for a mapping, whose keys say what its numbers are."""
    bare = without_inverse(text)[0].strip()
    return bare.startswith("{") and ":" in bare


def significant(precision: int | None) -> int | None:
    """Return how many significant digits --precision asks for; None for all."""
    from frametool.explain.run import DIGITS

    refuse(precision == 0, "--precision counts significant digits with --explain; give 1 or more, or full")
    return DIGITS if precision is None else None if precision == FULL else precision


def one_argument(argument: str | Source | None) -> str | Source:
    """Return an argument that holds a record; standard input is a stream."""
    refuse(argument in (None, "-"), f"standard input is a stream; {ONE_RECORD}")
    return argument or ""
