"""Covariances, sigmas and scales in records and rows: read if the operation uses them, and transformed.

Imported only if a record or a table has one of them.
"""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING, Any

from frametool.errors import ValueInvalid, listing, warn
from frametool.geometry import rigid, uncertainty
from frametool.geometry.place import ECEF, ENU
from frametool.geometry.quaternion import TOLERATED
from frametool.geometry.rigid import EXACT, NOT_BOTH, SCALED, inverse_full, pose_of, scale_of
from frametool.geometry.uncertainty import UNKNOWN
from frametool.grammar import covariance
from frametool.grammar.pose import AT_EACH, LEFT_OUT, SCALE, read_angle_unit
from frametool.grammar.readers import RATES, Misfit, NotARotation, Path, Reading, read_number, within
from frametool.ros.messages import whole_list
from frametool.rows.shapes import IDENTITY, MOVERS, NORMAL, PARTS, POINT, POSE, RATE, TWIST, VECTOR, WRENCH, Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from frametool.geometry import Components, Namespace
    from frametool.rows.record import Record
    from frametool.rows.request import Operation, Request
    from frametool.rows.sources.tables import Table


PLACED = (POSE, POINT, VECTOR)


def with_covariances(
    record: Record, holder: Any, around: Path, keys: Sequence[str], request: Request, reading: Reading
) -> Record:
    """Add the numbers of a record's covariances, or the covariance of its sigmas.

    holder: the mapping that holds them, at the path `around`, under some of `keys`
    If records are moved, a covariance that begins with -1 is unknown and unchanged.
    """
    operation, shape, path = request.operation, record.shape, record.path
    there = [key for key in keys if key in holder]
    is_own = shape.kind in PLACED and around == path
    flat = [*holder] if is_own and covariance.SIGMA not in holder and not there else []
    flat = [flat[at] for at in covariance.find_columns(flat, 36 if shape.kind == POSE else uncertainty.POINT)[0]]
    has_sigma = is_own and (covariance.SIGMA in holder or bool(flat))
    said = (*there, *(flat or [covariance.SIGMA] * has_sigma))
    place, reading.here = request.results.place, path
    axes = place.axes if place else ECEF  # of x, y, z on the Earth
    own = (shape.place.axes or ENU) if shape.place and operation.keeps_frames else ECEF
    turns = shape.kind in PLACED and axes != own
    if place and place.origin and not turns and said:
        reading.note(AT_EACH.format(axes), rule="origin")
    if (operation.formula is not None or turns) and around == path:
        reading.note(LEFT_OUT.format("a result at a place" if turns else "calc"), rule="left-out")
        return record._replace(keys=record.keys._replace(others=(*record.keys.others, *said)))
    if operation.keeps_frames and not (turns or shape.inverse or (has_sigma and request.results.rewrite_records)):
        for key in there * is_own:
            within((*around, key), _entries, holder[key], (36, 9))
        return record
    if operation.formula is not None or turns or (not operation.moves and there not in ([], [covariance.COVARIANCE])):
        what = "the covariance would be wrong afterwards; leave it out, or move the message with apply"
        raise Misfit(what, (*around, [*there, covariance.SIGMA][0]))
    if has_sigma:
        return _with_sigmas(record, holder, path, reading, flat)
    sizes = (36,) if shape.kind in PARTS else (36, 9)[: 1 + operation.moves] if shape.kind == POSE else (9,)
    for key in there:
        below = (*around, key)
        found = within(below, _entries, holder[key], sizes)
        paths, numbers = tuple((*below, *at) for at, _ in found), [number for _, number in found]
        record = record._replace(begins=(*record.begins, paths[0]))
        if not (numbers[0] == UNKNOWN and operation.moves):
            within(below, covariance.check, numbers)
            record = _with_numbers(record, key, paths, numbers)
    return record


def _with_numbers(record: Record, key: str, paths: Sequence[Path | None], numbers: Sequence[float]) -> Record:
    """Add a covariance or a scale, whose numbers follow the others."""
    return record._replace(
        shape=record.shape._replace(covariance=(*record.shape.covariance, len(numbers))),
        numbers=(*record.numbers, *paths), values=(*record.values, *numbers),
        keys=record.keys._replace(covariances=(*record.keys.covariances, key)),
    )  # fmt: skip


def _entries(value: Any, sizes: Sequence[int]) -> list[tuple[Path, float]]:
    """Read a covariance as `entries_of`; a printed one that is truncated raises an error that says so."""
    return covariance.entries_of(whole_list(value, " or ".join(f"{size} numbers" for size in sizes)), sizes)


def is_unknown(value: Any, sizes: Sequence[int]) -> bool:
    """Return True if a covariance begins with -1: neither it nor its quantity is known."""
    return _entries(value, sizes)[0][1] == UNKNOWN


def _of_sources(numbers: Sequence[Any], sigma: Sequence[tuple[int, str]], size: int) -> Components:
    """Return the covariance of independent sigmas; sigma: of each axis the index of its number (-1: 0) and unit."""
    zero = numbers[0] - numbers[0]
    entries = covariance.of_sigmas([zero if at < 0 else covariance.in_unit(numbers[at], unit) for at, unit in sigma])
    return entries if size == len(entries) else covariance.of_position(entries)


def _with_sigmas(record: Record, own: dict[str, Any], path: Path, reading: Reading, flat: Sequence[str]) -> Record:
    """Add the covariance of sigmas; its entries have no paths, and the result writes them under new names."""
    size = 36 if record.shape.kind == POSE else uncertainty.POINT
    degrees = read_angle_unit(own["angles"]) if "angles" in own else reading.degrees
    if not flat:
        entries = within(path, covariance.read_covariance, own, reading=Reading(reading.source, degrees=degrees))
    elif covariance.find_columns(flat, size)[1]:  # keys as columns: sigma_x ..
        said = [(key, (key,), own[key]) for key in flat]
        entries = covariance.of_sigmas(within(path, covariance.read_sigmas, said, size, degrees=degrees))
    else:  # c11 .. c66
        entries = tuple(within((*path, key), read_number, own[key]) for key in flat)
        within((*path, flat[0]), covariance.check, entries)
    if size < len(entries) and any(entries[18:]):
        raise Misfit("a point does not turn; its sigma has xyz alone", (*path, covariance.SIGMA))
    entries = entries if size == len(entries) else covariance.of_position(entries)
    keys = record.keys._replace(others=(*record.keys.others, *(flat or (covariance.SIGMA,))))
    record = record._replace(shape=record.shape._replace(sigma=()), keys=keys)
    return _with_numbers(record, covariance.SIGMA, [None] * size, entries)


def with_scale(record: Record, value: Any, around: Path, request: Request) -> Record:
    """Add the scale of a pose if the operation accepts one; else it must be 1."""
    if not request.operation.similar or around != record.path or type(value) in (dict, list):
        within(around, covariance.refuse_scale, value)
        return record
    scale = within(around, covariance.read_scale, value)
    if record.shape.covariance and request.operation.of != "arguments":
        raise NotARotation(NOT_BOTH, (*around, SCALE), key=True)
    return _with_numbers(record, SCALE, [(*around, SCALE)], [scale])


OTHER_ENTRIES = r"(?:(?!.*twist).*[._/])?covariance[._\[]?\d*\]?"  # names in other tools


def covariance_columns(
    table: Table, request: Request, shapes: tuple[Shape, ...]
) -> tuple[tuple[int, ...], tuple[Shape, ...]]:
    """Find the columns of a covariance or of sigmas if the operation uses them; return their indices and the shapes."""
    operation, asked, names = request.operation, request.results, table.names or ()
    kinds = [shape.kind for shape in shapes]
    passes = operation.keeps_frames or operation.only_adds
    own, place = shapes[0].place if shapes else None, None if operation.only_adds else asked.last_place or asked.place
    axes = own.axes if own and passes else ECEF
    stay = [name for name in names if re.fullmatch(OTHER_ENTRIES, name)]
    if shapes and place and any(covariance.find_columns(names, size)[0] for size in (9, 36)):
        if axes != place.axes:  # the covariance is along other axes than the result
            remedy, there = "" if axes or not place.axes else f", or say --local-axes {place.axes}", "the axes there"
            message = f"the covariance is along {axes or there}, the result along {place.axes or there}"
            raise ValueInvalid(f"{message}; leave its columns out{remedy}")
        if place.origin:
            warn(f"{table.source}: {AT_EACH.format(axes)}")
    elif stay and own and place and passes and not asked.keep and (place.axes != ENU or place.origin):
        warn(f"{table.source}: {listing(stay, 3)} stay along east, north, up at each position")
    if passes or not kinds or not {*PLACED}.issuperset(kinds):
        return (), shapes
    places, sigma = covariance.find_columns(names, 36 if POSE in kinds else 9)
    shape = shapes[0]
    if own is not None:
        from frametool.rows.columns_earth import along

        places, shape = along(own, shape, names, places)
    if operation.formula is not None:
        if places:
            warn(f"{table.source}: {LEFT_OUT.format('calc')}", rule="left-out")
        return places, shapes
    if stay and not places:
        warn(f"{table.source}: not moved: {listing(stay, 3)}; the columns of a covariance are c11, c12 ..")
    if not places:
        return (), shapes
    if len(shapes) != 1:
        raise ValueInvalid("a covariance beside several poses in a row: whose it is nobody can tell")
    sigma = tuple((at, unit or "deg" * (request.rows.degrees and axis > 2)) for axis, (at, unit) in enumerate(sigma))
    return places, (shape._replace(covariance=(len(places),), sigma=sigma),)


def find_rates(
    names: Sequence[str], taken: Collection[int], operation: Operation, source: str
) -> list[tuple[tuple[int, ...], str]]:
    """Find velocities and rates among the columns, three by three, that rotate with the axes of poses.

    Warns about velocities that are assumed to be along the axes of the world, and about columns that are unchanged.
    """
    rates: dict[tuple[str, ...], list[int]] = {}
    for name, place in sorted(zip(names, range(len(names)), strict=True)):
        if (match := re.fullmatch(RATES, name)) and place not in taken:
            rates.setdefault(match.groups(""), []).append(place)
    turns = operation.turns and not operation.mirrors
    turned = [tuple(each) for each in rates.values() if len(each) == 3 and turns]
    if stay := [names[at] for each in rates.values() if tuple(each) not in turned for at in each]:
        three = next((",".join(names[at] for at in each) for each in rates.values() if len(each) == 3), "")
        remedy = f"; --columns {three} --as vector turns velocities" * bool(three)
        apart = f"stay as they are: points and poses move{remedy}"
        why = "keep to the old axes: poses and covariances turn alone" if operation.turns else apart
        warn(f"{source}: {listing(stay, 9)} {why}")
    kinds = [NORMAL if names[each[0]][0] in "vV" else RATE for each in turned]
    at_world = [names[at] for each, kind in zip(turned, kinds, strict=True) if kind == NORMAL for at in each]
    if at_world and operation.right:
        warn(f"{source}: {listing(at_world, 9)} are along the axes of the world; call those of the body body_vx ..")
    return [*zip(turned, kinds, strict=True)]


MIRRORED = "the covariance cannot be carried through axes that mirror; leave it out"
SCALED_ALONE = (POINT, VECTOR, NORMAL, POSE)  # kinds that a similarity can move


def with_own(
    shape: Shape, pose: Components, extra: Components, mover: Components | None, *, mirrors: bool
) -> tuple[Components, Components]:
    """Return a row's pose with its own covariance or scale, and the remaining numbers."""
    size = shape.covariance[0]
    entries, rest = extra[:size], extra[size:]
    if mirrors and size > 1:
        raise ValueInvalid(MIRRORED)
    if size == uncertainty.POINT:  # of position or rotation alone: rotated like that of a vector
        if mover is not None and len(mover) > EXACT:
            raise ValueInvalid(f"covariance has {size} numbers; 36 are needed (6x6) where others count too")
        count = sum(shape.covariance)
        parts = [extra[at : at + size] for at in range(0, count, size)]
        turned = [part if mover is None else uncertainty.rotate_covariance(part, *mover[3:]) for part in parts]
        return pose, (*chain.from_iterable(turned), *extra[count:])
    if shape.inverse:
        back = inverse_full((*rigid.inverse(*pose), *entries))
        return (back if size == 1 else (*pose, *back[EXACT:])), rest
    return (*pose, *entries), rest


def of_multiple(
    shape: Shape, own: Components, rotation: Callable[[Components], Components], xp: Namespace
) -> Components:
    """Return the pose of a matrix that may be s R, followed by s, the root mean square length of its rows.

    An s within TOLERATED of 1 is exactly 1; `rotation` checks the remaining rotation.
    """
    size = xp.sqrt(sum(entry * entry for entry in shape.rotation(own)) / 3.0)
    s = xp.where(abs(size - 1.0) <= TOLERATED, size - size + 1.0, size)
    bare = tuple(number / s if at in shape.rotation_at else number for at, number in enumerate(own))
    pose = pose_of((*shape.position(own), *rotation(bare)))
    return inverse_full((*pose, s)) if shape.inverse else (*pose, s)


def in_full(shape: Shape, own: Components, extra: Components) -> tuple[Shape, Components]:
    """Return the shape and the extra numbers of a row with its full covariance, also from sigmas, and along ECEF."""
    size, place = shape.covariance[0], shape.place
    entries = extra[:size]
    if shape.sigma:
        entries = _of_sources(entries, shape.sigma, 36 if shape.kind == POSE else uncertainty.POINT)
    if place is not None:
        turn = place._replace(level=False).turned(own[: place.size], IDENTITY)
        entries = uncertainty.rotate_covariance(entries, *turn)
    full = shape._replace(covariance=(len(entries), *shape.covariance[1:]), sigma=())
    return full, (*entries, *extra[size:])


def move(shape: Shape, own: Components, extra: Components, mover: Components, *, mirrors: bool) -> Components:
    """Move a point, vector, twist, .. with its covariances by a pose; the covariance of the pose is propagated."""
    pose, kind = pose_of(mover), shape.kind
    if mirrors and shape.covariance:
        raise ValueInvalid(MIRRORED)
    if len(mover) == SCALED:
        if kind not in SCALED_ALONE or shape.covariance:
            what = "a covariance" if shape.covariance else f"a {kind}"
            raise ValueInvalid(f"{what} cannot be carried through a scale; points, vectors and poses can")
        s = scale_of(mover)
        return (*MOVERS[kind](*pose, *(s * each for each in own)), *extra)
    moved = MOVERS[kind](*pose, *own)
    if len(mover) > EXACT and kind != NORMAL:
        if kind not in (POINT, VECTOR):
            raise ValueInvalid(f"the covariance cannot be carried through to a {kind}; leave --covariance out")
        size = sum(shape.covariance[:1])
        found = uncertainty.of_three(pose, mover[EXACT:], own, extra[:size] or None, is_vector=kind == VECTOR)
        return (*moved, *(found or ()), *extra[size:])
    for size in shape.covariance:
        if kind in (TWIST, WRENCH):
            turned = uncertainty.of_moved(MOVERS[kind], pose, extra[:size])
        else:
            turned = uncertainty.rotate_covariance(extra[:size], *pose[3:])
        moved, extra = (*moved, *turned), extra[size:]
    return (*moved, *extra)
