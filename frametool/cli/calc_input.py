"""What `calc` reads and writes: files that get a name, expressions from a pipe and at the prompt, values as text.

A file is a tree if it holds frames, the pose if it holds one, a list if many.  Values are written as everywhere: poses
and points, numbers bare or, for a person, with units.
"""

from __future__ import annotations

import os
import re
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import click

from frametool.calc.api import line_of_value, machine_table, machine_text, plain_result
from frametool.calc.evaluate import Scope, evaluate_line, read_line
from frametool.calc.functions import BETWEEN_WORDS, Completer
from frametool.calc.rules import wanted
from frametool.calc.values import LIST, POINT, POSE, TREE, VECTOR, Term, Type
from frametool.cli.command import Text, refuse
from frametool.cli.commands.help import topic
from frametool.cli.poses import source_of
from frametool.cli.sink import writing
from frametool.cli.stderr import say_error, tell
from frametool.cli.trees import load_tree
from frametool.documents.source import HEAD, decode, opened
from frametool.errors import FrametoolError, heard_by
from frametool.formats.table import FORMATS
from frametool.grammar.result import Result, Style
from frametool.stream.faults import STOP, Fault

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from click.shell_completion import CompletionItem

    from frametool.cli.output import Output
    from frametool.cli.streaming import Stream

LIKE_A_FILE = r"(?!row\.)[^\s(){}\[\]*<>\"']*\.[A-Za-z]\w*"
LONGEST_PATH = 4096


def file_named_in(text: str, scope: Scope) -> Term | None:
    """Bind the name of `NAME=FILE` to what the file holds, and return it; None for everything else.

    What looks like the name of a file is read as one, and refused if there is none.
    """
    head, equals, tail = text.partition("=")
    name, path = head.strip(), tail.strip()
    if not equals or not name.isidentifier() or not 0 < len(path) < LONGEST_PATH:
        return None
    if path != "-" and not os.path.exists(path) and not re.fullmatch(LIKE_A_FILE, path):
        return None
    read_line(f"{name}=0")  # refuses a name that is taken
    scope.names[name] = named_file(path, scope)._replace(text=name)
    return scope.names[name]


def named_file(path: str, scope: Scope) -> Term:
    """Read a file for a name in expressions; `-` is standard input.  Raises FileProblem, FormatError."""
    from frametool.calc.rows import poses_of_table, values_of_document

    if path == "-":
        source = source_of("-")
        if found := values_of_document(source, scope):
            return found
        from frametool.formats.load import load_sources

        return Term(Type(TREE), (), tree=load_sources([source]))
    from frametool.formats.detect import detect

    with opened(path) as file:  # what is neither a table nor a document may be a tree
        fmt = detect(file.read(HEAD), "tree", "rows", "records", name=path, otherwise="yaml")[0]
    if "rows" in FORMATS[fmt].reads:
        return poses_of_table(path, fmt, normalize=scope.normalize, degrees=scope.degrees)
    found = values_of_document(source_of(path), scope) if "records" in FORMATS[fmt].reads else None
    return found or Term(Type(TREE), (), tree=load_tree(path, streams=True))


class Expression(Text):
    """An expression, completed from --tree and from the files that were named before it."""

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Offer what its last word may become."""
        from click.shell_completion import CompletionItem

        scope = Scope()
        trees = ctx.params.get("trees") or ()
        with heard_by(lambda *_: None), suppress(FrametoolError, click.UsageError):  # a completion must not print
            scope.tree = load_tree(trees[0], trees[1:]) if trees else None
            for each in ctx.params.get("arguments") or ():
                file_named_in(each, scope)
        cut = max(incomplete.rfind(mark) for mark in BETWEEN_WORDS) + 1
        before, word = incomplete[:cut], incomplete[cut:]
        return [CompletionItem(before + each) for each in Completer(scope, None).completions(word, before)]


def value_texts(terms: Iterable[Term], style: Style) -> Iterator[str]:
    """Yield the text of each value in the format of a style, what parts it from the one before included.

    Each is written before the next one is looked at, but for the rows of a table, which share their columns.
    """
    values = (item for term in terms for item in (term.items if term.type.kind == LIST else (wanted(term),)))
    if style.format == "csv":
        yield machine_table(list(values), style)
        return
    before = ""
    for value in values:
        text = _for_a_person(value, style) if style.format == "text" else machine_text(value, style)
        if before and style.format == "yaml":
            yield "---\n"
        elif before and style.format == "text" and (before.count("\n") > 1 or text.count("\n") > 1):
            yield "\n"
        yield text
        before = text


def _for_a_person(term: Term, style: Style) -> str:
    """Describe one value."""
    from frametool.view.pose_text import write_points, write_poses

    type_ = term.type
    if type_.kind == POSE:
        result = plain_result(term, style)
        if (type_.target is None) == (type_.source is None):
            return write_poses([result], style)
        return f"{type_}\n{write_poses([Result(result.pose._replace(name=None, parent=None), result.extras)], style)}"
    if type_.kind in (POINT, VECTOR):
        result = plain_result(term, style)
        if type_.kind not in result:  # at a place on the Earth
            from frametool.formats.trees.written_poses import write_poses as write_documents

            return write_documents([result], style)
        return write_points([result], style)
    return line_of_value(term, style)


def calculate_lines(stream: Stream, output: Output, scope: Scope) -> int:
    """Write the value of each line of standard input; a binding is shown only where nothing follows it.

    Ends at the first error, or with --on-error skip goes on behind it, and then returns 3.
    """
    bad, count = stream.policy("stdin"), 0

    def values() -> Iterator[Term]:
        nonlocal count
        last: Term | None = None
        for number, data in enumerate(iter(sys.stdin.buffer.readline, b"") if sys.stdin else (), 1):
            text = decode(data, "stdin").rstrip("\r\n")
            if not text.strip() or text.lstrip().startswith("#"):
                continue
            count += 1
            last = None
            try:
                line = read_line(text)
                term = evaluate_line(line, scope)
            except FrametoolError as error:
                if bad.on_error == STOP:
                    raise
                bad.take([Fault.of(number, "", error)])
                continue
            if line.name:
                last = term
            else:
                yield term
        if last is not None:
            yield last

    output.pieces(value_texts(values(), output.style))
    return bad.finish(count)


LONGEST_HISTORY = 1000  # lines


def talk(scope: Scope, output: Output) -> int:
    """Answer lines until Ctrl-D; errors go on, Ctrl-C forgets the line."""
    refuse(output.path is not None, "-o FILE is for expressions that are given or piped, not for the prompt")
    prompt = "> " if sys.stdout.isatty() else ""
    with _readline(scope):
        while True:
            try:
                line = input(prompt)
                if line.strip() in ("exit", "quit"):
                    return 0
                if line.strip():
                    _answer(line, scope, output)
            except EOFError:
                if prompt:
                    tell("")
                return 0
            except KeyboardInterrupt:
                tell("")


def _answer(line: str, scope: Scope, output: Output) -> None:
    """Print the value of a line, or what is wrong with it."""
    if line.strip() == "help":
        with writing(None) as write:
            write(topic("calc"))
        return
    try:
        found = file_named_in(line, scope)
        if found is None:
            output.pieces(value_texts([evaluate_line(read_line(line), scope)], output.style))
    except click.UsageError as error:
        tell(f"frametool: {error.format_message()}")
    except BrokenPipeError:
        raise
    except FrametoolError as error:
        say_error(error, in_json=False)


@contextmanager
def _readline(scope: Scope) -> Iterator[None]:
    """Complete words and keep a history while lines are read; without readline lines are just read."""
    try:
        import readline
    except ImportError:
        yield
        return
    state = os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state")  # as the XDG base directories
    path = os.path.join(state, "frametool_history")
    readline.set_completer_delims(BETWEEN_WORDS)
    readline.set_completer(Completer(scope, readline))
    is_editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if is_editline else "tab: complete")
    readline.set_history_length(LONGEST_HISTORY)
    with suppress(OSError):
        readline.read_history_file(path)
    try:
        yield
    finally:
        readline.set_completer(None)
        with suppress(OSError):
            os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
            readline.write_history_file(path)
