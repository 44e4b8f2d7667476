"""`frametool formats`: the formats of files, what they mean, what is read from them and written in them."""

from __future__ import annotations

from frametool.cli.command import Inputs, argument, command_named
from frametool.cli.options import format_among, list_options
from frametool.cli.output import Output
from frametool.cli.sink import show
from frametool.formats.table import FORMATS
from frametool.view.reports import format_entry, write_format, write_formats


@command_named("formats")
@argument("name", format_among(FORMATS, "known"), required=False)
@list_options()
def formats_command(inputs: Inputs) -> None:
    """List the file formats that are read and written: suffixes, meaning of the numbers, required options.

    \b
      frametool formats
      frametool formats yaml
      frametool formats -f json

    The names are those of --in and -f. `asks for` lists options for what a format does not specify. A format is
    detected by content first, then by the suffix of the file; --in NAME overrides this. NAME shows one format in full,
    with an example if there is one. `frametool help formats` explains the options that files need.
    """
    output, name = Output(inputs, "report", otherwise="text"), inputs.name
    entries = list(map(format_entry, FORMATS if name is None else [name]))
    if output.style.format == "text":
        text = write_formats(entries) if name is None else write_format(entries[0])
        show(text, paged=True) if output.path is None else output.text(text)
        return
    if output.style.format == "csv":  # a list is one cell
        for entry in entries:
            entry |= {key: " ".join(value) for key, value in entry.items() if isinstance(value, tuple)}
    output.report(entries)
