"""Pictures on their way out: in which form, by the suffix of a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from frametool.view.shapes import Picture

PICTURES = (".svg", ".html", ".png")


def drawn(picture: Picture, suffix: str, more: str = "") -> str | bytes:
    """Return a picture in the form of a suffix of PICTURES; `more` stands below it in HTML."""
    if suffix == ".png":
        from frametool.view.png import write_png

        return write_png(picture)
    from frametool.view.svg import write_html, write_svg

    return write_svg(picture) if suffix == ".svg" else write_html(picture, more)
