"""The command `energymargin settle`: is a scene at rest?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.bars import bar
from energymargin.cli.options import Outputs, panel
from energymargin.cli.terminal import require_outputs, show_table

MOVED = 1
"""Exit code where something moves."""
ROBOT, RULE = panel("What the file says"), panel("What counts as rest")


def settle(
    file: Path,
    /,
    *,
    ground: Annotated[float | None, ROBOT] = None,
    base: Annotated[str | None, ROBOT] = None,
    keyframe: Annotated[str | None, ROBOT] = None,
    ignore: Annotated[list[str] | None, ROBOT] = None,
    time: Annotated[float, RULE] = 10.0,
    tolerance: Annotated[float, RULE] = 1e-3,
    still: Annotated[float, RULE] = 1e-4,
    during: Annotated[float, RULE] = 0.25,
    output: Outputs = None,
    overwrite: bool = False,
    timeout: float | None = None,
) -> None:
    """Is this scene at rest? Lets it come to rest and says what moved, how far, and when.

    Exit code 0: nothing moves. 1: something does, or falls out. So it checks scenes in CI.

    Example: `energymargin settle scene.xml`

    An object of a file, on the ground: `energymargin settle mug.urdf --base free --ground 0`

    Where a problem starts: `energymargin settle push.json --tolerance 0.002 -o moved.csv`

    Args:
        file: A scene of MuJoCo (.xml), a URDF (.urdf), or a problem file (.json).
        ground: Adds a plane at this height [m].
        base: Of a URDF: fixed (by default), or free to move.
        keyframe: Of MuJoCo's model, by name or number: where it starts.
        ignore: What to do without of what is not simulated, once for each.
        time: When it ends at the latest [s].
        tolerance: A body has moved if a point of it is farther from where it was [m].
        still: The most by which a body at rest may move [m].
        during: The time for which it may not [s].
        output: Also the table, as .csv or .md. May be repeated.
        overwrite: Replace files that exist.
        timeout: Seconds after which it ends with what is known; exit code 124.
    """
    require_outputs(output or (), overwrite=overwrite)
    scene, state = _start(file, ground, base, keyframe, tuple(ignore or ()))
    with bar("Settling", "steps") as progress:
        asked: Any = {"time": time, "still": still, "during": during, "tolerance": tolerance}
        found = em.settle(scene, state, progress=progress, timeout=timeout, **asked)
    show_table(found, output or (), "it came to rest")
    if not found.stays:
        raise SystemExit(MOVED)


def _start(
    file: Path,
    ground: float | None,
    base: str | None,
    keyframe: str | None,
    ignore: tuple[str, ...],
) -> tuple[em.Scene, Floats | None]:
    """The scene of a file, and the state of a problem. Raises ValueError on another format, and on
    an option of another one."""
    suffix, state = file.suffix.lower(), None
    of_others = {"base": base if suffix != ".urdf" else None}
    of_others |= {"keyframe": keyframe if suffix != ".xml" else None}
    of_others |= {"ignore": ", ".join(ignore) if suffix == ".json" else None}
    for option, value in of_others.items():
        if value:
            raise ValueError(
                f"--{option} is {value}, which a {suffix} file does not have: leave it out"
            )
    if suffix == ".json":
        problem = em.Problem.load(str(file), start_outside=True)
        scene, state = problem.scene, problem.state
    elif suffix == ".urdf":
        scene = em.scenes.from_urdf(file, base=base or "fixed", ignore=ignore)
    elif suffix == ".xml":
        frame = int(keyframe) if keyframe and keyframe.isdecimal() else keyframe
        try:
            scene = em.scenes.from_mjcf(file, keyframe=frame, ignore=ignore)
        except ValueError as error:  # which names the argument of Python
            raise ValueError(re.sub(r"ignore=\(.*?\)", _as_options, str(error))) from error
    else:
        way = f"; `xacro {file} > robot.urdf` makes a .urdf" if file.suffix == ".xacro" else ""
        text = f"FILE is {file}, expected .xml of MuJoCo, .urdf, or .json of a problem{way}"
        raise ValueError(text)
    if ground is not None:
        scene.add_plane("ground", offset=ground, friction=1.0)
    return scene, state


def _as_options(names: re.Match[str]) -> str:
    return " ".join(f"--ignore {name}" for name in re.findall(r"'([^']*)'", names[0]))
