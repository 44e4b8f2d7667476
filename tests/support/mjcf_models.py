"""Made-up MJCF models in every spelling, and what the `mujoco` package says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator

SEQUENCES = ("xyz", "XYZ", "zyx", "ZXZ", "xYz", "yXy", "ZyX", "zxy")


def numbers(rng: Generator, count: int, scale: float = 1.0) -> str:
    return " ".join(map(repr, (scale * rng.normal(size=count)).tolist()))


def placed(rng: Generator, turn: float) -> str:
    """Return the attributes of a pose; `turn` is the size of an angle."""
    kind = rng.integers(6)
    spelled = [
        "",
        f'quat="{numbers(rng, 4, 3.0)}"',
        f'axisangle="{numbers(rng, 3)} {numbers(rng, 1, turn)}"',
        f'euler="{numbers(rng, 3, turn)}"',
        f'xyaxes="{numbers(rng, 6)}"',
        f'zaxis="{numbers(rng, 3)}"',
    ][kind]
    return f'pos="{numbers(rng, 3)}" {spelled}' if rng.integers(4) else spelled


def joint(rng: Generator, name: str, turn: float) -> tuple[str, str]:
    """Return a joint as text, and its kind; what it does not say its class does."""
    choice = rng.integers(4)
    where = f'pos="{numbers(rng, 3)}"' if rng.integers(2) else ""
    axis = f'axis="{numbers(rng, 3)}"' if rng.integers(3) else ""
    if choice == 0:
        return f'<joint name="{name}" class="sliding" {where} {axis}/>', "slide"
    if choice == 1:
        return f'<joint name="{name}" type="slide" {axis} {where} ref="{numbers(rng, 1)}"/>', "slide"
    ref = f'ref="{numbers(rng, 1, turn)}"' if rng.integers(2) else ""
    return f'<joint name="{name}" {where} {axis} {ref}/>', "hinge"


def model(seed: int) -> tuple[str, dict[str, str]]:
    """Return a random model, and the kinds of its joints by name, in the order of qpos."""
    rng = np.random.default_rng(seed)
    degrees = bool(rng.integers(2))
    turn = 60.0 if degrees else 1.0
    kinds: dict[str, str] = {}
    counter = iter(range(1000))

    def body(depth: int) -> str:
        n = next(counter)
        inside = ['<geom size="0.1"/>']
        if depth == 0 and rng.integers(2):
            kinds[f"j{n}"] = "free"
            inside.append(f'<freejoint name="j{n}"/>' if n % 2 else f'<joint type="free" name="j{n}"/>')
        elif rng.integers(4) == 0:
            kinds[f"j{n}"] = "ball"
            inside.append(f'<joint name="j{n}" type="ball" pos="{numbers(rng, 3)}"/>')
        else:
            for k in range(rng.integers(3)):
                text, kind = joint(rng, f"j{n}_{k}", turn)
                kinds[f"j{n}_{k}"] = kind
                inside.append(f"<frame {placed(rng, turn)}>{text}</frame>" if rng.integers(3) == 0 else text)
        inside.append(f'<site name="s{n}" {placed(rng, turn)}/>')
        inside.append(f'<site name="b{n}" class="turned"/><camera name="s{n}" {placed(rng, turn)}/>')
        inside += [framed(body(depth + 1)) for _ in range(rng.integers(3) if depth < 3 else 0)]
        child = ' childclass="moved"' if rng.integers(3) == 0 else ""
        return f'<body name="b{n}" {placed(rng, turn)}{child}>{"".join(inside)}</body>'

    def framed(text: str) -> str:
        if rng.integers(3):
            return text
        return f"<frame {placed(rng, turn)}><frame {placed(rng, turn)}>{text}</frame></frame>"

    bodies = "".join(framed(body(0)) for _ in range(2))
    defaults = (
        f'<default><joint axis="{numbers(rng, 3)}"/><site euler="{numbers(rng, 3, turn)}"/>'
        f'<default class="moved"><joint pos="{numbers(rng, 3)}" ref="{numbers(rng, 1, turn)}"/>'
        f'<default class="sliding"><joint type="slide" ref="{numbers(rng, 1)}"/></default></default>'
        f'<default class="turned"><site quat="{numbers(rng, 4, 2.0)}" pos="{numbers(rng, 3)}"/></default></default>'
    )
    compiler = f'<compiler angle="{"degree" if degrees else "radian"}" eulerseq="{SEQUENCES[seed % len(SEQUENCES)]}"/>'
    return f"<mujoco>{compiler}<worldbody>{bodies}</worldbody>{defaults}</mujoco>", kinds


def values(seed: int, kinds: dict[str, str]) -> dict[str, list[float]]:
    """Return random values of joints, as they stand in qpos; some joints have none and stay where they are."""
    rng = np.random.default_rng(1000 + seed)
    sizes = {"free": 7, "ball": 4}
    drawn = {name: rng.normal(size=sizes.get(kind, 1)).tolist() for name, kind in kinds.items()}
    return {name: value for name, value in drawn.items() if rng.integers(4)}


def told(kinds: dict[str, str], drawn: dict[str, list[float]]) -> dict[str, Any]:
    """Return values of joints as `frametool.load` takes them."""
    found: dict[str, Any] = {}
    for name, value in drawn.items():
        w, x, y, z = np.array(value[-4:]) / np.linalg.norm(value[-4:]) if len(value) > 1 else (1.0, 0.0, 0.0, 0.0)
        pose = f"wxyz: [{w!r}, {x!r}, {y!r}, {z!r}]".replace("np.float64(", "").replace(")", "")
        if kinds[name] == "free":
            found[name] = f"{{xyz: {value[:3]}, {pose}}}"
        else:
            found[name] = f"{{{pose}}}" if kinds[name] == "ball" else value[0]
    return found


def poses(mujoco: Any, text: str, drawn: dict[str, list[float]]) -> dict[str, list[float]]:
    """Return where MuJoCo has each frame in the world: the entries of a 3x4 matrix, row by row."""
    compiled = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(compiled)
    data.qpos[:] = compiled.qpos0
    for name, value in drawn.items():
        start = compiled.joint(name).qposadr[0]
        data.qpos[start : start + len(value)] = value
    mujoco.mj_kinematics(compiled, data)
    mujoco.mj_comPos(compiled, data)
    mujoco.mj_camlight(compiled, data)
    found: dict[str, list[float]] = {}
    kinds = (("", compiled.nbody, compiled.body, data.xpos, data.xmat), ("site:", compiled.nsite, compiled.site, data.site_xpos, data.site_xmat),
             ("camera:", compiled.ncam, compiled.camera, data.cam_xpos, data.cam_xmat))  # fmt: skip
    for prefix, count, named, xpos, xmat in kinds:
        for n in range(count):
            matrix = np.column_stack([xmat[n].reshape(3, 3), xpos[n]])
            found[prefix + named(n).name] = matrix.ravel().tolist()
    return found
