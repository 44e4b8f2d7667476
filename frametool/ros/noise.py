"""What the echo tools or the shell print between messages."""

from __future__ import annotations

import re

# what the tools or the shell print between messages; the note about lost messages is the one that ends a document
NOISE = re.compile(
    r"""(?x) \ufeff? (?:
      A\ message\ was\ lost!!! | \ttotal\ count\ change:\ ?\d+ | \ttotal\ count:\ ?\d+(?:---)?
    | WARNING:\ .* | Is\ /clock\ being\ published\?
    | \[\ ?(?:DEBUG|INFO|WARN|ERROR|FATAL)\ ?\].*
    | \d{4}-\d\d-\d\d\ [\d:.]+\ \[[A-Z_]+\ \w+\].* | selected\ interface\ .*\ multicast.*
    | \$\ .* | \[exit\ \d+\] | \^C.* )""",
).fullmatch
