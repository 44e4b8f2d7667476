"""A folder that results go to: there whole or not at all, as `frametool.cli.sink` has it of a file."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, BinaryIO

from frametool.cli.signals import clean_up
from frametool.cli.sink import check, created, give_name, problems_of, refuse_existing, unnamed_beside, writer_into
from frametool.errors import FileProblem, printable, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from frametool.cli.sink import Write

BAG_FILE, BAG_DATA = "metadata.yaml", (".mcap", ".db3")  # what a folder may hold that is replaced


@contextmanager
def filling(path: str, *, force: bool) -> Iterator[Write]:
    """Yield what fills a new folder, each file begun by a piece that has its name; it is there whole or not at all."""
    place = os.path.realpath(path)
    _refuse_folder(path, force=force)
    clean_up()
    files: dict[str, BinaryIO] = {}
    part = ""

    def fill(piece: str | bytes | memoryview) -> None:
        nonlocal part
        with problems_of(path):
            if name := getattr(piece, "name", ""):
                stream = unnamed_beside(place, 0o666)
                if stream is None:
                    part = part or created(place, os.mkdir)[0]
                    stream = open(os.path.join(part, name), "xb", buffering=0)  # noqa: SIM115 - closed below
                files[name] = stream
            if piece:  # nothing comes before the first name
                writer_into(files[next(reversed(files))], path)(piece)

    try:
        yield fill
        check()
        with problems_of(path):
            part = part or created(place, os.mkdir)[0]
            for name, stream in files.items():
                if isinstance(stream.name, int):
                    give_name(stream, os.path.join(part, name))
            _refuse_folder(path, force=force)  # it may have come meanwhile
            before = f"{part}.before" if os.path.isdir(place) else ""
            if before:
                os.rename(place, before)
            os.rename(part, place)
            _remove(before)
    except BaseException:
        _remove(part)
        raise
    finally:
        for stream in files.values():
            stream.close()


def _remove(folder: str) -> None:
    """Remove a folder, if there is one."""
    if folder:
        from shutil import rmtree

        rmtree(folder, ignore_errors=True)


def _refuse_folder(path: str, *, force: bool) -> None:
    """Raise FileProblem for a folder that may not be replaced: without --force, or of other files than a bag's."""
    refuse_existing(path, force=force)
    if not os.path.lexists(path):
        return
    if not os.path.isdir(path):
        raise FileProblem(f"{printable(path)}: is a file; a folder is to be written there")
    if not force:
        raise FileProblem(f"{printable(path)}: exists; give --force to replace it")
    others = sorted(name for name in os.listdir(path) if name != BAG_FILE and not name.endswith(BAG_DATA))
    if others:
        raise FileProblem(f"{printable(path)}: holds more than a bag ({shown(others[0])}); it is not replaced")
