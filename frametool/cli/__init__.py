"""Run the command line; every error becomes one line on stderr and an exit code.

Importing this module opens no files: Ctrl-C ends the process without a traceback from the start, and a module that
cannot be opened is an error of one line.
"""

import gc
import os
import sys
from io import TextIOWrapper

IN_OUT, INTERRUPTED = 5, 130  # exit codes
COLLECTED_EVERY = (100_000, 20, 100)  # thresholds of the garbage collector: scanning a large tree repeatedly is slow


def main(arguments: list[str] | None = None) -> None:
    """Run the command line as a program of its own and exit with its status."""
    try:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # unused threads would cost memory
        gc.set_threshold(*COLLECTED_EVERY)
        from frametool.cli.signals import with_signals

        status = with_signals(run, sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt:
        status = INTERRUPTED
    except (ImportError, OSError) as error:  # modules cannot be opened, not even those that write messages
        sys.stderr.write(f"frametool: {(getattr(error, 'strerror', None) or str(error)).lower()}\n")
        status = IN_OUT
    gc.freeze()  # no garbage collection at exit
    sys.exit(status)


def run(arguments: list[str]) -> int:
    """Run one command; every error becomes one line on stderr and an exit code."""
    from frametool.cli.commands import TROUBLE, call_command
    from frametool.cli.signals import end_by_signal
    from frametool.cli.sink import SYSTEM_ERRORS, discard, say, say_error, say_warning, system_message, wants_json
    from frametool.errors import FrametoolError, heard_by
    from frametool.sizes import DEEPEST

    own = TROUBLE.get(arguments[0] if arguments else "")
    in_out = own or IN_OUT
    if sys.stdout is None:
        say("standard output is closed")
        return in_out
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # the same bytes in every locale and on every system
            stream.reconfigure(encoding="utf-8", errors=stream.errors, newline="\n")
    sys.setrecursionlimit(max(sys.getrecursionlimit(), 20 * DEEPEST))  # calls for each level of a document
    status = 0
    try:
        with heard_by(say_warning):
            try:
                status = call_command(arguments)
            except KeyboardInterrupt:
                status = INTERRUPTED
            except FrametoolError as error:
                say_error(error, in_json=wants_json(arguments))
                status = own or error.exit_code
        sys.stdout.flush()
    except BrokenPipeError:
        status = end_by_signal("SIGPIPE")  # as `cat` does if its reader is gone
    except SYSTEM_ERRORS as error:
        if status != in_out or not isinstance(error, OSError):  # else it was reported, and flushing failed again
            say(system_message(error))
        if isinstance(error, OSError):
            discard(sys.stdout)
        status = in_out
    return status
