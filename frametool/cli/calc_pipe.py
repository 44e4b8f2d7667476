"""Expressions from a pipe, one a line; each is answered before the next is read."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from frametool.calc.evaluate import evaluate_line, read_line
from frametool.calc.tokens import LONGEST, CalcError
from frametool.cli.calc_output import value_texts
from frametool.documents.source import decode
from frametool.errors import FormatError, FrametoolError
from frametool.stream.faults import ROWS_SKIPPED, STOP, RowsSkipped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.calc.scope import Scope
    from frametool.calc.values import Term
    from frametool.cli.output import Output
    from frametool.cli.streaming import Stream


def calculate_lines(stream: Stream, output: Output, scope: Scope) -> int:
    """Write the value of each line; a binding is shown only where nothing follows it.

    Ends at the first error, or with --on-error skip goes on behind it, and then returns 3.
    """
    pipe = PipedExpressions(stream, scope)
    if output.style.form == "csv":
        output.pieces(value_texts(pipe.values(), output.style))
    else:
        output.pieces(_parted(pipe, output))
    return pipe.finish()


def _parted(pipe: PipedExpressions, output: Output) -> Iterator[str]:
    """Yield the texts of values as they come, and what stands between them."""
    form, is_first = output.style.form, True
    for term in pipe.values():
        text = "".join(value_texts([term], output.style))
        if not is_first and (form == "yaml" or (form == "text" and text.count("\n") > 1)):
            yield "---\n" if form == "yaml" else "\n"
        yield text
        is_first = False


class PipedExpressions:
    """The lines of standard input, evaluated one after the other."""

    def __init__(self, stream: Stream, scope: Scope) -> None:
        """Take how bad lines are treated from the stream's options."""
        self.scope = scope
        self.bad = stream.policy("stdin")
        self.skips = stream.options["on_error"] != STOP
        self.tell = self.bad.tell
        self.most = self.bad.most
        self.count = self.skipped = 0

    def values(self) -> Iterator[Term]:
        """Yield the values that are shown."""
        held: Term | None = None
        for number, text in enumerate(self._lines(), 1):
            if not text.strip() or text.lstrip().startswith("#"):
                continue
            self.count += 1
            held = None
            try:
                line = read_line(text)
                term = evaluate_line(line, self.scope)
            except FrametoolError as error:
                if not self.skips:
                    raise
                self._skip(error, number)
                continue
            if line.name:
                held = term
            else:
                yield term
        if held is not None:
            yield held

    def _lines(self) -> Iterator[str]:
        """Yield the lines; one that is too long is cut, and then refused."""
        if sys.stdin is None:
            return
        while line := sys.stdin.buffer.readline(4 * LONGEST + 2):
            if len(line) > 4 * LONGEST and not line.endswith(b"\n"):
                size = len(line) + self._rest()
                raise CalcError(f"a line of {size} bytes; an expression has at most {LONGEST} characters")
            yield decode(line, "stdin").rstrip("\r\n")

    @staticmethod
    def _rest() -> int:
        """Count the bytes up to the end of a line."""
        size = 0
        while part := sys.stdin.buffer.readline(1 << 16):
            size += len(part)
            if part.endswith(b"\n"):
                break
        return size

    def _skip(self, error: FrametoolError, number: int) -> None:
        """Report a bad line."""
        self.skipped += 1
        if self.skipped <= self.most:
            told = FormatError(f"{error} (line skipped)", source="stdin", line=number)
            told.snippet = getattr(error, "snippet", "")
            self.tell(told)

    def finish(self) -> int:
        """Report how many lines were skipped; return the exit status."""
        if not self.skipped:
            return 0
        message = f"stdin: {self.skipped} of {self.count} lines skipped"
        self.tell(RowsSkipped(message, source="stdin", bad=self.skipped, rows=self.count))
        return ROWS_SKIPPED
