"""What `solve` does with each kind of input: read it, solve, and put the result into one shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frametool.cli.command import inputs, refuse
from frametool.cli.stderr import say, say_error
from frametool.errors import ValueInvalid, alternatives, first_of, shown, warn
from frametool.geometry.rigid import IDENTITY
from frametool.stream.faults import STOP

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from frametool.fit.hand_eye import HandEye
    from frametool.fit.measured_tree import TreeSolution
    from frametool.geometry.transform import Transform
    from frametool.geometry.types import Array, Components
    from frametool.stream.measurements import Measurement
    from frametool.stream.samples import HandEyeSamples
    from frametool.view.fit_text import Solution, SolvedFrame, SolvedRow

NAMES = ("base", "gripper", "camera", "target")
SHARES = 1000  # of the way, as progress counts it
UNSURE = 1.2  # times too small: given sigmas of which it is told


def tell_taken(text: str) -> None:
    """Say how an input was taken, unless --quiet."""
    if not inputs().quiet:
        say(text)


def solved_tree(
    files: Sequence[str], *, root: str | None, fix: Sequence[str], without: Sequence[str], robust: bool,
    normalize: bool,
) -> Solution:
    """Solve the tree that the measurements of files mean, beside what is fixed."""
    from frametool.fit.measured_tree import solve_tree
    from frametool.view.tree_text import ProgressBar

    measurements = _measurements(files, without, normalize=normalize)
    measured = dict.fromkeys(name for each in measurements for name in each[:2])
    fixed = _fixed_edges(fix, measured, normalize=normalize) if fix else []
    with ProgressBar(SHARES, quiet=inputs().quiet, counted="") as bar:
        found = solve_tree(
            measurements,
            root=root,
            fixed=[edge[:3] for edge in fixed],
            robust=robust,
            progress=lambda share: bar.advance(0, round(SHARES * share) - bar.size),
        )
    for each in found.hints:
        warn(each)
    if found.sigma_factor > UNSURE:
        warn(f"the given sigmas are {found.sigma_factor:.2g} times too small for what the used rows are off")
    return _tree_solution(found, {(parent, child): entry for parent, child, *entry in fixed})


def _fixed_edges(
    files: Sequence[str], measured: Collection[str], *, normalize: bool
) -> list[tuple[str, str, Any, Components | None]]:
    """Return the edges of --fix trees: parent, child, components, covariance."""
    from frametool.cli.trees import load_tree
    from frametool.formats.load import Rules

    tree = load_tree(files[0], files[1:], Rules(normalize=normalize))
    if moving := next((track.child for track in tree.tracks() if not track.is_static), None):
        raise ValueInvalid(f"{tree.name}: {shown(moving)} moves; what is fixed stands still (tree --at TIME)")
    if not {*tree.frames} & {*measured}:
        known = alternatives(one := tree.frames[0], measured, "frames")
        raise ValueInvalid(f"{tree.name}: no frame of it is measured: {shown(one)}{known}")
    return [(track.parent, track.child, track.components, tree.covariances.get(track.child)) for track in tree.tracks()]


def _measurements(files: Sequence[str], places: Sequence[str], *, normalize: bool) -> list[Measurement]:
    from frametool.cli.trees import opened, state
    from frametool.stream.measurements import parted, read_measurements, without

    recordings = opened(files)
    found = read_measurements(recordings, normalize=normalize)
    state(recordings)
    for each in recordings:
        own = [row for row in found if parted(row.place)[0] == each.name]
        first = f": {own[0].parent}<-{own[0].child} .." if own else ""
        tell_taken(f"{each.name}: {len(own)} rows, each the pose of child in parent{first}")
    return without(found, places)


def _tree_solution(found: TreeSolution, fixed: dict[tuple[str, str], list[Any]]) -> Solution:
    from frametool.view.fit_text import Solution

    frames = [_solved_frame(found, name, fixed) for name in sorted(found.frames, key=lambda name: name != found.root)]
    unknown = [each.name for each in frames if each.parent and each.name not in found.fixed and not each.covariance]
    if unknown:
        warn(f"no covariance of {first_of(unknown, 5)}: neither loops nor sigmas say how sure that is")
    if (alone := [m.place for m, checked in zip(found.measurements, found.checked, strict=True) if not checked]):
        tell_taken(f"in no loop, so that nothing checks them: {first_of(alone, 5)}")
    rows = [
        _row(m.place, at, m.id, m.parent, m.child, found.residuals[at], float(found.u[at]),
             used=bool(found.used[at]), checked=bool(found.checked[at]), fits=found.fits[at])
        for at, m in enumerate(found.measurements)
    ]  # fmt: skip
    return Solution("tree", found.root, found.dof, found.rms_distance, found.rms_angle, found.sigma, frames, rows)


def _solved_frame(found: TreeSolution, name: str, fixed: dict[tuple[str, str], list[Any]]) -> SolvedFrame:
    """Return the entry of a frame: in the root, or as --fix has it."""
    from frametool.view.fit_text import SolvedFrame

    parent, is_fixed = found.parents.get(name), name in found.fixed
    pose, covariance = found.pose(name, parent).components, None
    if parent is not None and is_fixed:
        pose, covariance = fixed[parent, name]
    elif parent is not None:
        covariance = _listed(found.marginal(name))
    seen = found.rows[name], found.frame_checked[name], is_fixed
    return SolvedFrame(name, parent, _numbers(pose), covariance, *seen)


def _listed(covariance: Array | None) -> Components | None:
    return None if covariance is None else tuple(covariance.ravel().tolist())


def _numbers(components: Iterable[Any]) -> Any:
    """Return components as floats; none is -0.0."""
    return tuple(float(part) + 0.0 for part in components)


def _side(parent: str, name: str, pose: Transform, covariance: Array, rows: int) -> list[SolvedFrame]:
    """Return a root and the one frame in it."""
    from frametool.view.fit_text import SolvedFrame

    root = SolvedFrame(parent, None, IDENTITY, None, rows, checked=True)
    return [root, SolvedFrame(name, parent, _numbers(pose.components), _listed(covariance), rows, checked=True)]


def _row(
    place: str, at: int, name: str | None, parent: str, child: str, residual: Array, u: float, **said: Any
) -> SolvedRow:
    """Return a row of a report: how far it is off in metres, and in radians where it has turned."""
    from math import hypot

    from frametool.view.fit_text import SolvedRow

    parts = residual.tolist()
    angle = hypot(*parts[3:]) if len(parts) > 3 else None
    return SolvedRow(place, at + 1, name, parent, child, hypot(*parts[:3]), angle, u, **said)


def solved_hand_eye(
    files: Sequence[str], *, eye_to_hand: bool, max_gap_ns: int | None, names: Sequence[str] | None, robust: bool,
    normalize: bool,
) -> Solution:
    """Solve where a camera is on a hand, or beside a robot: two files of poses, or one of samples."""
    from frametool.stream.samples import read_samples

    if len(files) == 1:
        samples = read_samples(files[0], eye_to_hand=eye_to_hand, normalize=normalize)
    else:
        samples = _paired(files, max_gap_ns, normalize=normalize)
    called = _hand_eye_names(names, samples.names)
    base, gripper, camera, target = called
    holder, other = (base, gripper) if eye_to_hand else (gripper, base)
    second = f"; {samples.files[1]}:" if len(files) > 1 else ","
    tell_taken(f"{samples.files[0]}: {base}<-{gripper}{second} {camera}<-{target}; {_count(samples.places)}")
    if samples.taken:
        tell_taken(samples.taken)
    tell_taken(f"solving for {holder}<-{camera} and {other}<-{target}")
    for each in samples.told:
        say(each)
    from frametool.fit.hand_eye import solve_hand_eye

    found = solve_hand_eye(samples.gripper, samples.target, eye_to_hand=eye_to_hand, robust=robust, names=called)
    for each in found.warnings:
        warn(each)
    return _hand_eye_solution(found, samples, (holder, other, camera, target))


def _count(samples: Sequence[object]) -> str:
    return f"{len(samples)} sample{'s'[: len(samples) != 1]}"


def _paired(files: Sequence[str], max_gap_ns: int | None, *, normalize: bool) -> HandEyeSamples:
    from frametool.cli.comparing import forms_of, trajectory
    from frametool.fit.pairs import paired_samples

    named = zip(files, forms_of(2), strict=True)
    read = [trajectory(file, STOP, form, normalize=normalize)[:2] for file, form in named]
    (gripper, first), (target, second) = read
    if max_gap_ns is not None:
        for each, name in read:
            refuse(each.stamps_ns is None, f"--max-gap is not used: {name} has no stamps")
    return paired_samples(gripper, target, (first, second), max_gap_ns)


def _hand_eye_names(said: Sequence[str] | None, found: Sequence[str | None]) -> tuple[str, str, str, str]:
    """Choose the names of base, gripper, camera, target: those asked for, else of the rows, else these words."""
    base, gripper, camera, target = said or [each or name for each, name in zip(found, NAMES, strict=True)]
    if len({base, gripper, camera, target}) < len(NAMES):
        raise ValueInvalid(f"two of the frames {base}, {gripper}, {camera}, {target} are called alike; give --names")
    return base, gripper, camera, target


def _hand_eye_solution(found: HandEye, samples: HandEyeSamples, names: tuple[str, str, str, str]) -> Solution:
    from frametool.view.fit_text import Solution

    holder, other, camera, target = names
    count = int(found.used.sum())
    frames = [
        *_side(holder, camera, found.x, found.covariance_x, count),
        *_side(other, target, found.z, found.covariance_z, count),
    ]
    rows = [
        _row(place, at, None, camera, target, found.residuals[at], float(found.u[at]),
             used=bool(found.used[at]), checked=found.dof > 0)
        for at, place in enumerate(samples.places)
    ]  # fmt: skip
    return Solution(
        "hand-eye", None, found.dof, found.rms_distance, found.rms_angle, found.sigma, frames, rows,
        noise_at=found.noise_at, turns=found.turns,
    )  # fmt: skip


def solved_points(files: Sequence[str], *, names: Sequence[str] | None, scale: bool, robust: bool) -> Solution:
    """Solve the transform between two files of matched points."""
    from frametool.cli.comparing import forms_of
    from frametool.cli.trees import answers
    from frametool.fit.closed_forms import solve_points
    from frametool.stream.faults import BadRows
    from frametool.stream.samples import matched, read_points
    from frametool.view.fit_text import Solution

    def policy(name: str) -> BadRows:
        return BadRows(name, STOP, tell=lambda error: say_error(error, in_json=False))

    a, b = (
        read_points(file, form=form, answers=answers(), policy=policy)
        for file, form in zip(files, forms_of(2), strict=True)
    )
    found_names = (a.frame, b.frame) if a.frame and b.frame and a.frame != b.frame else (None, None)
    target, source = names or [each or name for each, name in zip(found_names, ("A", "B"), strict=True)]
    pairs = matched(a, b)
    how = "by row" if pairs.ids is None or a.ids is None or b.ids is None else "by id"
    tell_taken(f"{a.file}: points in {target}; {b.file}: points in {source}; {len(pairs.places)} matched {how}")
    for each in pairs.told:
        say(each)
    found = solve_points(
        pairs.target, pairs.source, weights=pairs.weights, scale=scale, robust=robust, names=(target, source)
    )
    for each in found.hints:
        warn(each)
    count = int(found.used.sum())
    frames = _side(target, source, found.transform, found.covariance, count)
    rows = [
        _row(place, at, pairs.ids[at] if pairs.ids else None, target, source, found.residuals[at], float(found.u[at]),
             used=bool(found.used[at]), checked=found.dof > 0, counted=bool(found.used[at] or found.left_out[at]))
        for at, place in enumerate(pairs.places)
    ]  # fmt: skip
    return Solution(
        "points", target, found.dof, found.rms_distance, None, (found.sigma, None), frames, rows,
        scale=found.scale, scale_sigma=found.scale_sigma,
    )  # fmt: skip
