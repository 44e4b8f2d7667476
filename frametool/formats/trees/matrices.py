"""Matrices under keys that say what they do, wherever in a document: what camchains, OpenCV and EuRoC files share.

Poses that a calibration states about pairs of frames, made into the edges of trees: turned round, checked, named.

    T_cam_imu of cam0 and cam1 both end at the IMU: in a tree the cameras hang under it, so each is turned round.

What is stated twice, the other way round or along another way, is no edge but a check.
"""

from __future__ import annotations

import re
from math import degrees
from typing import TYPE_CHECKING, Any, NamedTuple

from frametool.errors import bare, shown
from frametool.formats.table import DIRECTIONS
from frametool.formats.trees.matrix_keys import (
    TAGS,
    Ambiguous,
    Meaning,
    grid_of,
    is_tagged,
    meaning_of,
    no_pose,
    partner_of,
    read_shift,
    read_turn,
    read_whole,
    whole_pose,
)
from frametool.formats.trees.tree_reader import Unclear, dotted
from frametool.geometry import floats, rigid
from frametool.grammar.edges import Edge
from frametool.grammar.readers import Misfit, kind, within
from frametool.grammar.rotation_spelling import AGREEMENT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from frametool.formats.trees.matrix_keys import Grid, Pair
    from frametool.geometry.types import Rigid
    from frametool.grammar.edges import Answers
    from frametool.grammar.readers import Path, Reading

TOLERATED = 1e-3  # metres, radians: how far a pose and its stated inverse may lie apart, with a warning


class Stated(NamedTuple):
    """One pose as it is stated: target_from_source; in a tree `child` hangs under the other one.

    chained: it is about neighbours in a chain, and only a check where both are known otherwise
    firm: what the child hung under before hangs under the child from now on, never the other way round
    """

    target: str
    source: str
    child: str
    components: Rigid
    path: Path
    chained: bool = False
    firm: bool = False

    @property
    def parent(self) -> str:
        """Return the frame that is not the child."""
        return self.target if self.child == self.source else self.source


class _Forest:
    """Edges by their child, so far."""

    def __init__(self) -> None:
        self.edges: dict[str, Edge] = {}

    def hang(self, each: Stated) -> None:
        """Add a pose that connects two trees."""
        child, parent = each.child, each.parent
        if child in self.edges and parent not in self.edges and not each.firm:
            child, parent = parent, child
        self._make_root(child)
        pose = each.components if child == each.source else rigid.inverse(*each.components)
        self.edges[child] = Edge(parent, child, pose, path=each.path)

    def _make_root(self, frame: str) -> None:
        """Turn the edges above a frame round, so that all of its tree hangs under it."""
        way = []
        while frame in self.edges:
            way.append(self.edges.pop(frame))
            frame = way[-1].parent or ""
        for edge in way:
            parent = edge.parent or ""
            self.edges[parent] = Edge(edge.child, parent, rigid.inverse(*edge.components), path=edge.path)

    def lookup(self, target: str, source: str) -> Rigid | None:
        """Return target_from_source; None where the two are not connected."""
        (root, root_from_target), (other, other_from_source) = map(self._above, (target, source))
        return rigid.compose(*rigid.inverse(*root_from_target), *other_from_source) if root == other else None

    def _above(self, frame: str) -> tuple[str, Rigid]:
        """Return the root above a frame, and the pose of the frame in it."""
        pose: Rigid = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        while frame in self.edges:
            edge = self.edges[frame]
            pose, frame = rigid.compose(*edge.components, *pose), edge.parent or ""
        return frame, pose


def edges_of(statements: Iterable[Stated], reading: Reading) -> list[Edge]:
    """Return the edges, and check what is stated again against them.

    Raises Misfit where a pose and its inverse contradict each other; other contradictions are noted.
    """
    forest = _Forest()
    first: dict[frozenset[str], Stated] = {}
    for each in sorted(statements, key=lambda each: (each.chained, each.child != each.source)):
        if each.target == each.source:
            raise Misfit(f"frame {shown(each.source)} is its own parent", each.path, key=True)
        if (known := forest.lookup(each.target, each.source)) is None:
            first[frozenset((each.target, each.source))] = each
            forest.hang(each)
        else:
            _compare(known, each, first.get(frozenset((each.target, each.source))), reading)
    return list(forest.edges.values())


def _compare(known: Rigid, each: Stated, first: Stated | None, reading: Reading) -> None:
    """Check a pose that is stated again."""
    metres, radians = rigid.distance(*known, *each.components, floats)
    if metres <= AGREEMENT and radians <= AGREEMENT:
        return
    other = bare(dotted(first.path)) if first else "the others"
    message = f"differs from {other} by {metres * 1000.0:.6g} mm and {degrees(radians):.6g} degrees"
    if first and (metres > TOLERATED or radians > TOLERATED):
        raise Misfit(f"{bare(dotted(each.path))} {message}; keep one", each.path, key=True)
    reading.here = ()
    reading.note(f"{message}; {other} {'is' if first else 'are'} used", *each.path)


MOST_TOLD = 3  # matrices that are no poses


class MatrixBlock(NamedTuple):
    """A map of a document that may hold matrices: what it is called, and the way to it."""

    name: str
    entries: dict[str, Any]
    path: Path


class FrameNames(NamedTuple):
    """How frames are called that no key names.

    base: what all is seen from; alone: what a matrix outermost in the file belongs to; told: all names of `--frames`
    blocks: names of blocks by their place in the file, where they were told
    """

    base: str
    alone: str
    told: tuple[str, ...] = ()
    blocks: tuple[str, ...] = ()


class Matrices:
    """The poses of one document, and which of its matrices are none."""

    def __init__(self, document: dict[str, Any], naming: FrameNames, answers: Answers, reading: Reading) -> None:
        """Read all of it; raises Misfit."""
        self.naming = naming
        self.answers = answers
        self.reading = reading
        self.left: list[str] = []
        self.asked = 0
        self.blocks = _renamed(_blocks(document, "", ()), naming)
        self.poses = [pose for block in self.blocks for pose in self._of_block(block)]

    def edges(self) -> list[Edge]:
        """Return the edges that the poses make; raises Misfit where they contradict each other."""
        return edges_of(self.poses, self.reading)

    def about(self, edges: list[Edge]) -> str:
        """Say how many poses there are, and what was left out."""
        count = f"{len(edges)} {'pose' if len(edges) == 1 else 'poses'}"
        more = f" and {len(self.left) - MOST_TOLD} more" if len(self.left) > MOST_TOLD else ""
        verb = "is no pose" if len(self.left) == 1 else "are no poses"
        return f"{count}; {', '.join(self.left[:MOST_TOLD])}{more} {verb}" if self.left else count

    def _of_block(self, block: MatrixBlock) -> Iterator[Stated]:
        """Yield the poses of one map."""
        paired: set[str] = set()
        for key, value in block.entries.items():
            if key in paired:
                continue
            self.reading.here = (*block.path, key)
            grid = within(self.reading.here, grid_of, value)
            partner = partner_of(key, [other for other in block.entries if other != key]) if grid else None
            if grid is not None and partner is not None:
                paired.add(partner.translation)
                yield self._pair(block, key, grid, partner)
            elif (pose := self._single(block, key, value, grid)) is not None:
                yield pose

    def _single(self, block: MatrixBlock, key: str, value: Any, grid: Grid | None) -> Stated | None:
        """Return the pose under one key, if it is one."""
        path = (*block.path, key)
        whole = whole_pose(grid)
        known = self._known(block)
        meaning = meaning_of(key, known, self.naming.told)
        says = isinstance(meaning, Meaning) and meaning.said
        if says and whole is None and grid is not None and grid.holds(12):
            whole = whole_pose(grid._replace(rows=3, columns=4))
        if says and whole is None and (grid is not None or type(value) is not str):
            found = grid.size if grid else kind(value)
            raise Misfit(f"{bare(key)}: expected a 4 x 4 or 3 x 4 matrix, found {found}", path)
        if whole is None or (not says and no_pose(key)):
            self._leave(path, value, grid)
            return None
        if meaning is None or not says:
            meaning = self._directed(block, key, path, meaning)
        if isinstance(meaning, Ambiguous):
            ways = " or ".join(f"{bare(a)},{bare(b)}" for a, b in meaning.names)
            raise Unclear(f"{bare(key)} may name its two frames in several ways; give --frames {ways}", path, key=True)
        if "" in (meaning.target, meaning.source):
            raise Misfit(f"{bare(key)}: there is no camera before {bare(block.name)}", path, key=True)
        components = within(path, read_whole, whole, self.reading)
        return Stated(*meaning[:3], components, path, chained=key == "T_cn_cnm1")

    def _known(self, block: MatrixBlock) -> dict[str, str]:
        """Return the names that the templates of the table stand for."""
        base = self.naming.base or "imu"
        body = self.naming.base or "body"
        inertial = next((each.name for each in self.blocks if each is not block and "T_BS" in each.entries), body)
        me = block.name or self.naming.alone
        return {"me": me, "before": self._before(block), "imu": base, "body": body, "sensor": inertial}

    def _before(self, block: MatrixBlock) -> str:
        """Return the camera before this one: cam0 of cam1; else the block before it; "" if there is none."""
        around, own = block.path[:-1], block.path[-1] if block.path else ""
        beside = {each.path[-1]: each.name for each in self.blocks if each.path and each.path[:-1] == around}
        if match := re.fullmatch(r"(.*?)([0-9]+)", str(own)):
            return beside.get(f"{match[1]}{int(match[2]) - 1}", "")
        earlier = [*beside.values()][: [*beside].index(own)] if own in beside else []
        return earlier[-1] if earlier else ""

    def _directed(
        self, block: MatrixBlock, key: str, path: Path, named: Meaning | Ambiguous | None
    ) -> Meaning | Ambiguous:
        """Return what a key means that does not say its direction, as it was told; raises Unclear if it was not."""
        if isinstance(named, Ambiguous):
            return named
        if named is not None:
            parent, child = named.target, named.source
        else:
            told = self.naming.told[1:]
            parent = self.naming.base or ("imu" if block.name else "body")
            child = block.name or (told[self.asked] if self.asked < len(told) else key.rpartition(".")[2])
            self.asked += 1
        return self._told(dotted(path), path, parent, child)

    def _told(self, what: str, path: Path, parent: str, child: str) -> Meaning:
        """Return the direction that was told for two frames; raises Unclear if none was."""
        if not self.answers.direction:
            one, other = DIRECTIONS
            a, b = bare(parent), bare(child)
            ways = f"--direction {one} (takes points of {b} to {a}) or {other} (of {a} to {b})"
            raise Unclear(f"{shown(what)}: the key does not say its direction: give {ways}", path, key=True)
        ends = (parent, child) if self.answers.direction == DIRECTIONS[0] else (child, parent)
        return Meaning(*ends, child)

    def _pair(self, block: MatrixBlock, key: str, turn: Grid, pair: Pair) -> Stated:
        """Read a rotation and the translation beside it."""
        path, place = (*block.path, key), (*block.path, pair.translation)
        shift = within(place, grid_of, block.entries[pair.translation])
        if shift is None:
            found = kind(block.entries[pair.translation])
            raise Misfit(f"{pair.translation}: expected 3 numbers, found {found}", place)
        if pair.target:
            target, source = self._names_of(pair)
            meaning = Meaning(target, source, target if pair.target == "cam1" else source)
        else:
            parent, child = self.answers.names(self.naming.base or "body", block.name or key)
            meaning = self._told(f"{key} and {pair.translation}", path, parent, child)
        rotation = within(path, read_turn, turn, self.reading)
        return Stated(*meaning[:3], (*within(place, read_shift, shift), *rotation), path)

    def _names_of(self, pair: Pair) -> tuple[str, str]:
        """Return target and source of a pair under the names that were told; of two cameras cam0 is told first."""
        if pair.target == "cam1":
            source, target = self.answers.names(pair.source, pair.target)
        else:
            target, source = self.answers.names(pair.target, pair.source)
        return target, source

    def _leave(self, path: Path, value: Any, grid: Grid | None) -> None:
        """Keep the name of a matrix that is no pose."""
        is_matrix = grid is not None and (grid.rows > 1 or type(value) is dict)
        if is_matrix or any(is_tagged(value, tag) for tag in TAGS):
            what = no_pose(str(path[-1]))
            self.left.append(f"{bare(dotted(path))} ({what})" if what else bare(dotted(path)))


def _renamed(blocks: Iterator[MatrixBlock], naming: FrameNames) -> list[MatrixBlock]:
    """Return the blocks, those of cameras under the names that were told: cam0 has the first of them."""
    found = list(blocks)
    cameras = [block for block in found if block.name and not block.name.startswith("imu") and _looks_posed(block)]
    numbered = sorted(cameras, key=lambda block: [int(number) for number in re.findall(r"[0-9]{1,9}", block.name)])
    told = {block.path: name for block, name in zip(numbered, naming.blocks, strict=False)}
    return [block._replace(name=told.get(block.path, block.name)) for block in found]


def _looks_posed(block: MatrixBlock) -> bool:
    """Tell whether a block has a pose or is that of a camera, whose first in a chain has none."""
    return any(key.startswith("T_") for key in block.entries) or block.name.startswith("cam")


def _blocks(entries: dict[str, Any], name: str, path: Path, depth: int = 0) -> Iterator[MatrixBlock]:
    """Yield a map and the maps in it; those of a list by its name and their number."""
    yield MatrixBlock(name, entries, path)
    for key, value in entries.items():
        here = (*path, key)
        if depth > 8:
            return
        if type(value) is dict and not {"rows", "cols", "data"} <= value.keys():
            yield from _blocks(value, _block_name(key), here, depth + 1)
        elif type(value) is list:
            for index, each in enumerate(value):
                if type(each) is dict:
                    yield from _blocks(each, f"{_block_name(key)}{index}", (*here, index), depth + 1)


def _block_name(key: str) -> str:
    """Return what a block is about: okvis writes `cameras`, `imu_params`."""
    return {"cameras": "cam", "imu_params": "imu", "imu_parameters": "imu"}.get(key, key)
