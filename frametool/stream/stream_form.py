"""Tell the form of a stream: by its suffix, else by how it begins."""

from __future__ import annotations

import re

from frametool.errors import FormatError

SUFFIXES = {
    ".csv": "csv", ".tsv": "tsv", ".tab": "tsv", ".tum": "tum", ".txt": "columns", ".json": "json", ".jsonl": "json",
    ".ndjson": "json", ".yaml": "yaml", ".yml": "yaml",
}  # fmt: skip
# name -> what it is; `columns` with eight numbers is a trajectory as TUM writes it
STREAMS = {
    "csv": "CSV with a header",
    "tsv": "tab-separated values with a header",
    "columns": "columns between blanks, # comments",
    "tum": "trajectory: t x y z qx qy qz qw",
    "json": "JSON, one object a line, or an array",
    "yaml": "YAML documents parted by ---",
}
RECORDS = frozenset(("json", "yaml"))

# compiled when first needed, not at start-up
_JSON = rb'\s*(?:\{\s*["}]|\[\s*(?:[\[{"\]]|-?\d|$))'
_YAML = rb"---(?:\s|$)|%YAML|- |(?:[\w./-]+|\"[^\"\n]*\"):(?:\s|$)|[\[{]"
_MARK = b"\xef\xbb\xbf"


def form_of(begin: bytes, name: str, *, told: str = "") -> tuple[str, str]:
    """Return the form of a stream and by what it was known ("" if told).

    begin: its first bytes; name: of its file, "" for standard input.  Raises FormatError if nothing tells.
    """
    if told:
        return told, ""
    suffix = name[name.rfind(".") :].lower() if "." in name else ""
    if suffix in SUFFIXES and suffix != ".txt":
        return SUFFIXES[suffix], f"the suffix {suffix}"
    return _by_content(begin.removeprefix(_MARK), name), "its first line"


def _by_content(begin: bytes, name: str) -> str:
    line = _first_line(begin)
    if re.match(_JSON, begin):
        return "json"
    if re.match(_YAML, line) and not _is_table(line):
        return "yaml"
    for delimiter, form in ((b"\t", "tsv"), (b",", "csv")):
        if delimiter in line:
            return form
    if len(line.split()) > 1 or begin.lstrip().startswith(b"#"):
        return "columns"
    if not begin.strip():
        raise FormatError("nothing in it", source=name or "stdin")
    raise FormatError(
        f"cannot tell the form of {line[:60].decode('utf-8', 'replace')!r}; give --in {'|'.join(STREAMS)}",
        source=name or "stdin",
        line=1,
    )


def _is_table(line: bytes) -> bool:
    """Tell a header whose first column ends in a colon from a key of YAML."""
    return b"," in line and b"{" not in line and b"[" not in line and b": " not in line


def _first_line(begin: bytes) -> bytes:
    """Return the first line that is no comment; a comment with commas or tabs is a header."""
    lines = [line.strip(b"\r") for line in begin.split(b"\n") if line.strip()]
    plain = [line for line in lines if not line.startswith(b"#")]
    if (
        lines
        and lines[0].startswith(b"#")
        and (b"," in lines[0] or b"\t" in lines[0])
        and (not plain or b"," in plain[0] or b"\t" in plain[0])
    ):
        return lines[0]
    return plain[0] if plain else b""
