"""A trajectory and its scores as a file of rerun (.rrd), whose viewer plays them over time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from energymargin._core import Plane, Scene
from energymargin.base.checks import whole_number
from energymargin.base.errors import needs_extra
from energymargin.base.replacing import replaced
from energymargin.look.plots.styles import BODY_COLORS
from energymargin.model.outlines import body_poses
from energymargin.model.scenes.corners import shape_parts
from energymargin.records import datasets
from energymargin.records.store import ScoreStore

Floats = NDArray[np.float64]

TIMELINE = "time"


def write_rerun(
    scores: str | os.PathLike[str],
    data: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    trajectory: int | None = None,
    run: int | None = None,
) -> int:
    """Writes a trajectory with its scores into a file of rerun; returns the trajectory's number.

    The bodies are meshes that move over the time of the frames [s], in "scene/NAME"; the scores are
    scalars, in "scores/METRIC", and so is whether each frame is captured, in "captured". An effort
    of inf has no point. Needs the extra [rerun].

    Args:
        scores: the file of scores.
        data: the dataset that was scored.
        output: the file, a name with .rrd. It appears whole or not at all.
        trajectory: its number; None is the first that is lost at its end, or else the first.
        run: as of `ScoreStore.run`; with its scores are those of the states as they are beside it.

    Raises ValueError if these files do not belong together, or on no such trajectory; OSError.
    """
    with needs_extra("a file of rerun", "rerun"):
        import rerun
    with ScoreStore(scores) as store, datasets.open(data) as dataset:
        chosen = store.run(run)
        if why := chosen.why_not_of(dataset, str(data), str(scores)):
            raise ValueError(why)
        last = len(dataset.lengths) - 1
        if trajectory is None:
            ends = (t for t, one in enumerate(dataset.trajectories) if not one.captured[-1])
            trajectory = next(ends, 0)
        trajectory = whole_number("trajectory", trajectory, 0, last)
        first = int(dataset.lengths[:trajectory].sum())
        frames = slice(first, first + int(dataset.lengths[trajectory]))
        values = {m: own[frames] for m, own in store.scores(chosen).items()}
        recorded = dataset.trajectories[trajectory]
        problems, _ = dataset.possible_problems(range(frames.start, frames.stop))
        if not problems:
            raise ValueError(f"trajectory {trajectory} has no frame that can be simulated")
        scene = next(iter(problems.values())).scene
        title = f"{dataset.task}, trajectory {trajectory}"
    with (
        replaced(Path(output)) as file,
        rerun.RecordingStream("energymargin", recording_id=title) as stream,
    ):
        memory = stream.memory_recording()  # its own writer of files says nothing of a full disk
        _log_scene(rerun, stream, scene, recorded.times, recorded.states)
        for name, numbers in {"captured": recorded.captured.astype(float), **values}.items():
            there, path = np.isfinite(numbers), f"scores/{name}" if name in values else name
            columns = rerun.Scalars.columns(scalars=numbers[there])
            _send(rerun, stream, path, recorded.times[there], columns)
        file.write_bytes(memory.drain_as_bytes())
    return trajectory


def _log_scene(rerun: Any, stream: Any, scene: Scene, times: Floats, states: Floats) -> None:
    """The bodies but planes: their meshes, and where they are in each state, shape (K, n)."""
    stream.log("scene", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    poses = [body_poses(scene, state) for state in states]
    for body in scene.bodies:
        if isinstance(body.shape, Plane):
            continue
        path, color = f"scene/{body.name}", BODY_COLORS[body.role]
        for number, corners in enumerate(shape_parts(body.shape)):
            faces = ConvexHull(corners).simplices
            mesh = rerun.Mesh3D(
                vertex_positions=corners, triangle_indices=faces, albedo_factor=_rgb(color)
            )
            stream.log(f"{path}/{number}", mesh, static=True)
        columns = rerun.Transform3D.columns(
            translation=[own[body.name][0] for own in poses],
            quaternion=[own[body.name][1] for own in poses],
        )
        _send(rerun, stream, path, times, columns)


def _send(rerun: Any, stream: Any, path: str, times: Floats, columns: Any) -> None:
    """Numbers of an entity over time [s]."""
    if len(times):
        index = rerun.TimeColumn(TIMELINE, duration=times)
        rerun.send_columns(path, indexes=[index], columns=columns, recording=stream)


def _rgb(color: str) -> list[int]:
    """A colour as "#E69F00", 0..255."""
    return [int(color[k : k + 2], 16) for k in (1, 3, 5)]
