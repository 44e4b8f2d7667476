"""Read the options on geodetic positions: origin, axes of rotations, UTM zone, positions in --to."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from frametool.cli.command import marking_use, misuse, refuse
from frametool.documents.source import Source
from frametool.errors import FormatError, warn
from frametool.geometry.conventions import world_of
from frametool.geometry.earth import zone_number
from frametool.geometry.place import LLA, UTM, Earth, Origin, Place, kernels
from frametool.geometry.representations import POSITIONS, Notation
from frametool.grammar.place import read_at
from frametool.grammar.readers import Misfit, Reading, tell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frametool.cli.command import Inputs
    from frametool.geometry import Vector

FIRST = "first"
EARTH_OPTIONS = {"origin": ("origin",), "axes": ("local_axes",), "zone": ("zone",)}  # field of Earth -> options


def earth(inputs: Inputs) -> Earth:
    """Return origin, axes and zone of the options; raises click.UsageError for invalid ones."""
    if inputs.earth is None:
        zone, origin = inputs.peek("zone"), inputs.peek("origin")
        with misuse("--zone: "):
            number = None if zone is None else zone_number(zone)
        place = None if origin is None else _origin(inputs, origin)
        inputs.earth = marking_use(inputs, Earth, EARTH_OPTIONS)(place, inputs.peek("local_axes") or "", number)
    return inputs.earth


def _origin(inputs: Inputs, text: str) -> Origin:
    """Read --origin: a mapping, the numbers lat, lon, alt, or `first`."""
    if text == FIRST:
        return Origin(tell=partial(_report_origin, inputs))
    from frametool.documents.document import parse_documents

    numbers = re.split(r"\s*,\s*|\s+", text.strip())
    if text[:1] != "{" and len(numbers) in (2, 3):
        text = mapping_of(inputs, numbers, LLA)
    source = Source("--origin", text)
    reading = Reading(source)
    try:
        documents = parse_documents(text, source.name) if text.startswith("{") else []
        refuse(len(documents) != 1, f"--origin takes LAT,LON[,ALT], {{lat: 48.1, lon: 11.5, alt: 520}} or {FIRST}")
        spot = read_at(documents[0].value, reading)
    except Misfit as misfit:
        raise click.UsageError(f"--origin: {misfit}") from None
    except FormatError as error:
        raise click.UsageError(str(error)) from None
    tell(source, [note._replace(path=(0, *note.path)) for note in reading.notes])
    lat, lon, alt = spot.place.lla(spot.numbers)
    return Origin((lat, lon, alt))


def _report_origin(inputs: Inputs, place: Vector) -> None:
    lat, lon, alt = place
    inputs.note(f"origin: lat {lat!r}, lon {lon!r}, alt {alt!r}, the first position")
    if lat == lon == 0.0:
        warn("the first position is lat 0, lon 0, as receivers write that have no fix; --origin PLACE names another")


def places_of(inputs: Inputs, notations: Sequence[Notation]) -> tuple[tuple[Notation, ...], Place | None]:
    """Return the rotation representations of --to, and its position format; raises ValueInvalid for --to enu alone."""
    names = [each.representation.name for each in notations if each.representation.is_place]
    rest = tuple(each for each in notations if not each.representation.is_place)
    place = Place.written(names, earth(inputs)) if names else None
    if inputs.peek("origin") == FIRST and not (place and place.is_local):
        raise click.UsageError("--origin first has no effect here: it is where --to enu, or ned, begins")
    world = place.axes if place else world_of(inputs.peek("world") or inputs.peek("all_axes") or "")
    return tuple(each.in_world(world) for each in rest), place


def mapping_of(inputs: Inputs, texts: Sequence[str], name: str) -> str:
    """Return a mapping of the bare numbers of a geodetic position; raises click.UsageError for a wrong count."""
    from frametool.documents.writers import dump_json

    row, arithmetic = POSITIONS[name], kernels(name)
    zoned = name == UTM and len(texts) == 3 and earth(inputs).zone is not None
    fields = row.names[zoned:]
    if not (arithmetic.least or len(fields)) - zoned <= len(texts) <= len(fields):
        raise click.UsageError(f"{name} has {len(row.names)} numbers ({' '.join(row.names)}); found {len(texts)}")
    members: Any = dict(zip(fields, texts, strict=False))
    return dump_json({name: members} if arithmetic.is_nested else members)
