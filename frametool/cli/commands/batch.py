"""`frametool batch`: many commands in one process."""

from __future__ import annotations

from frametool.cli.command import FILE, Inputs, argument, command_named, option
from frametool.cli.stderr import say
from frametool.documents.source import opened
from frametool.stream.faults import SKIP, STOP

EXIT_CODES = "Exit codes: 0 done, 3 lines or rows skipped, else that of the line that failed."



@command_named("batch", epilog=EXIT_CODES)
@argument("file", FILE, default="-", metavar="[FILE]")
@option("--on-error", "end at a line that fails, or report it and go on", (STOP, SKIP), name="on_failure", default=STOP)
def command(inputs: Inputs) -> int:
    """Run the commands of FILE, or of standard input, in one process: one a line, as typed behind frametool.

    \b
      frametool batch commands.txt
      frametool batch --on-error skip < commands.txt
      seq 0 90 | sed 's/.*/convert --from rpy_deg 0 0 &/' | frametool batch

    \b
      base = lookup robot.yaml map base_link                  # kept, not printed
      compose $base '{xyz: [0, 0, 1]}' --to rpy_deg

    Each line prints what it prints alone into a pipe, and nothing stands between; a pipe is answered line by line.
    Files of frames that several lines name are read once, and anew when they have changed.

    NAME = COMMAND keeps a pose, point, number or tree instead of printing it; $NAME or ${NAME} in an argument is then
    that result, with all its digits. Words are a shell's: in 'single quotes' all is as written, in "double quotes" and
    bare $NAME counts, \\ takes the next character as it is, $$ is a dollar sign, # begins a comment, and a backslash at
    its end joins a line with the next. Pipes, > and < are not for a batch.

    A line that fails is reported with its number: commands.txt:12: .. The status is that of the failed line, or 3
    where lines were skipped. Standard input is not for the lines: name files. A line cannot be a batch itself, nor run
    on the clock or without end, as sim --realtime does.
    """
    from frametool.cli.batch import CommandBatch

    file, skips = inputs.file, inputs.on_failure == SKIP
    stream = opened(file)
    if file != "-":
        with stream:
            return CommandBatch(file, skips=skips).run(stream)
    if stream.isatty():
        say("reading from the terminal; end with Ctrl-D")
    return CommandBatch("stdin", skips=skips).run(stream)
