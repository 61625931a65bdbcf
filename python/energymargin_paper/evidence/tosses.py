"""Real tosses of a cube onto a board: on which face, where and how does it end?

Each toss is simulated from its first recorded frame. Friction is chosen on one half of the tosses
and all else is told of the other one. A probability of each face is of draws of what the recording
does not know exactly: the start and the friction.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin import Box, Cancel, Scene, Surface, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import not_negative_number, positive_number, whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.model.scenes.mjcf_model import engine
from energymargin_paper.evidence.calibration import calibration_error
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["STUDY", "Settings", "Tosses"]

FOLDER = "ENERGYMARGIN_REAL"
WIDTH, MASS, RAISED = 0.1048, 0.37, 0.0012  # m, kg, m: of the cube, and of the recorded heights
AFTER = 0.5  # s behind the recorded end
ERRORS = {"position": 1e-3, "turn": np.deg2rad(1.0), "velocity": 0.03, "angular_velocity": 0.3}
ROUGH = 0.03  # of the coefficient of friction
FACES = 6
ENGINES = ("native", "MuJoCo", "MuJoCo, default")


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    data: str = setting("", "Folder with cube_tosses/.", shown=FOLDER)
    frictions: tuple[float, ...] = setting((0.14, 0.16, 0.18, 0.2, 0.22), "Tried coefficients.")
    restitution: float = setting(0.125, "Of the cube on the board.")
    draws: int = setting(16, "Of the start and the friction, for each toss.")
    every: int = setting(1, "Each so manieth toss.")
    step: float = setting(1 / 960, "Of the simulation [s].")
    seed: int = setting(0, "Seed of the draws.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed."""
        for name in ("draws", "every"):
            whole_number(name, getattr(self, name), 1)
        positive_number("step", self.step)
        not_negative_number("restitution", self.restitution)
        for friction in self.frictions:
            not_negative_number("frictions", friction)


class Pose(NamedTuple):
    """Of the cube: position (3,) [m], orientation x, y, z, w, and its velocities."""

    position: Floats
    orientation: Floats
    velocity: Floats
    angular_velocity: Floats

    def with_error(self, random: np.random.Generator) -> Pose:
        """With a draw of what is not known."""
        error = {name: random.normal(0.0, of, 3) for name, of in ERRORS.items()}
        turned = Rotation.from_rotvec(error.pop("turn")) * Rotation.from_quat(self.orientation)
        moved = {name: getattr(self, name) + of for name, of in error.items()}
        return self._replace(orientation=turned.as_quat(), **moved)


class Toss(NamedTuple):
    """A recorded toss."""

    first: Pose
    last: Pose
    duration: float
    """[s]."""


def _folder(data: str) -> Path:
    """The folder of the data. Raises ValueError if there is none."""
    folder = Path(data or os.environ.get(FOLDER, ""))
    if not (folder / "cube_tosses").is_dir():
        raise ValueError(
            f"data is {str(folder)!r}, expected a folder with cube_tosses/ in it; the environment "
            f"variable {FOLDER} may name it"
        )
    return folder


@lru_cache
def tosses(folder: str) -> list[Toss]:
    """All of a folder. Raises FileNotFoundError without it."""
    found = np.load(Path(folder) / "cube_tosses" / "tosses.npz")
    turns = Rotation.from_quat(np.roll(found["quaternion_wxyz"].astype(float), -1, axis=1))
    rates = turns.apply(found["angular_velocity"].astype(float))
    places = found["position"].astype(float) + np.array([0.0, 0.0, RAISED])
    rows = zip(places, turns.as_quat(), found["velocity"].astype(float), rates, strict=True)
    poses, starts = [Pose(*row) for row in rows], found["start"].tolist()
    return [
        Toss(poses[a], poses[b - 1], (b - 1 - a) * float(found["dt"])) for a, b in pairwise(starts)
    ]


def face(orientation: Floats) -> int:
    """The number of the face that looks up."""
    up = Rotation.from_quat(orientation).as_matrix()[2]
    axis = int(np.argmax(np.abs(up)))
    return 2 * axis + int(up[axis] > 0)


@dataclass(frozen=True)
class Job:
    """A toss in an engine."""

    engine: str
    toss: int
    friction: float
    restitution: float
    step: float
    draws: int
    seed: int
    folder: str


@dataclass(frozen=True, eq=False)
class Ended:
    """How it ends."""

    position: list[float]
    orientation: list[float]
    faces: list[int]
    """Of the draws."""


def run(job: Job, cancel: Cancel) -> Ended:
    """Simulates a toss, and its draws."""
    toss = tosses(job.folder)[job.toss]
    play = _in_mujoco if job.engine.startswith("MuJoCo") else _here
    end, ends = play(job, toss.first, toss.duration), []
    for number in range(job.draws):
        if cancel.is_set:
            break
        random = np.random.default_rng([job.seed, job.toss, number])
        rough = max(0.01, job.friction + random.normal(0.0, ROUGH))
        drawn = replace(job, friction=rough)
        ends.append(face(play(drawn, toss.first.with_error(random), toss.duration).orientation))
    return Ended(end.position.tolist(), end.orientation.tolist(), ends)


def _here(job: Job, start: Pose, duration: float) -> Pose:
    scene = Scene(step=job.step)
    scene.add_plane("board", friction=1.0)
    bounces = Surface(restitution=job.restitution)
    about: dict[str, Any] = {"mass": MASS, "friction": job.friction, "surface": bounces}
    scene.add_body("cube", Box((WIDTH,) * 3), **about, role="object")
    steps = round((duration + AFTER) / job.step)
    done = World(scene).simulate(scene.pack(cube=start._asdict()), steps=steps, record=[steps])
    end = scene.unpack(done.states[-1])["cube"]
    return Pose(*(end[name] for name in Pose._fields))


CUBE = """<mujoco><option timestep="{step}" {option}/><worldbody>
<geom type="plane" size="5 5 1" friction="{friction} 0 0" condim="3" {contact}/>
<body><freejoint/><geom type="box" size="{half} {half} {half}" mass="{mass}"
friction="{friction} 0 0" condim="3" {contact}/></body></worldbody></mujoco>"""
STIFF = {"option": 'cone="elliptic" impratio="10"', "contact": ""}
DEFAULT = {"option": "", "contact": ""}


def _in_mujoco(job: Job, start: Pose, duration: float) -> Pose:
    mujoco = engine()
    kind = {**(DEFAULT if job.engine.endswith("default") else STIFF), "step": 1 / 1480}
    text = CUBE.format(friction=job.friction, half=WIDTH / 2, mass=MASS, **kind)
    model = mujoco.MjModel.from_xml_string(text)
    data, turn = mujoco.MjData(model), Rotation.from_quat(start.orientation)
    data.qpos[:] = [*start.position, *np.roll(turn.as_quat(), 1)]
    data.qvel[:] = [*start.velocity, *turn.inv().apply(start.angular_velocity)]
    mujoco.mj_step(model, data, round((duration + AFTER) / model.opt.timestep))
    none = np.zeros(3)
    return Pose(data.qpos[:3].copy(), np.roll(data.qpos[3:], -1), none, none)


@dataclass(frozen=True, eq=False)
class Tosses:
    """What came out."""

    settings: Settings
    chosen: float
    """The friction of the engine here that ends most tosses of one half on their faces."""
    tried: dict[tuple[str, float], float]
    """Share of the faces, by engine and friction, on that half."""
    ended: dict[str, dict[int, Ended]]
    """By engine and toss of the other half."""

    def to_csv(self) -> str:
        """A line a toss and engine."""
        rows = [
            (name, toss, *end.position, *end.orientation, *end.faces)
            for name, ends in self.ended.items()
            for toss, end in ends.items()
        ]
        head = ("engine", "toss", *"xyz", "qx", "qy", "qz", "qw")
        return csv_text((*head, *(f"draw {k}" for k in range(self.settings.draws))), rows)

    def to_markdown(self) -> str:
        """Two tables."""
        s = self.settings
        count = len(next(iter(self.ended.values())))
        head = ("", "last face", "place off", "turn off", "log loss", "Brier", "calibration error")
        frictions = [
            (name, *(f"{self.tried[name, one]:.3f}" for one in s.frictions))
            for name in ("native", "MuJoCo")
        ]
        return "\n".join(
            [
                "# Tosses of a cube\n",
                f"{count} tosses, of which none chose anything; friction {self.chosen:g}; draws of "
                f"{s.draws}. *Place*: median; *turn*: median of those on the right face. MuJoCo "
                "takes steps of 1/1480 s, with elliptic cones and impratio 10, or as it is.\n",
                markdown_table(head, [(name, *self._row(name)) for name in self.ended]),
                "\nShare of the faces on the half that chose the friction:\n",
                markdown_table(("friction", *(f"{one:g}" for one in s.frictions)), frictions),
            ]
        )

    def _row(self, name: str) -> Iterator[str]:
        ends = self.ended[name]
        recorded = tosses(self.settings.data)
        last = {k: recorded[k].last for k in ends}
        right = [
            face(np.array(end.orientation)) == face(last[k].orientation) for k, end in ends.items()
        ]
        off = [
            np.linalg.norm(np.subtract(e.position, last[k].position)[:2]) for k, e in ends.items()
        ]
        turns = [
            (Rotation.from_quat(e.orientation) * Rotation.from_quat(last[k].orientation).inv())
            for k, e in ends.items()
        ]
        angles = np.rad2deg([turn.magnitude() for turn in turns])[np.array(right)]
        yield f"{np.mean(right):.3f}"
        yield f"{1e3 * np.median(off):.0f} mm"
        yield f"{np.median(angles):.1f} deg"
        shares = np.array([_shares(end.faces) for end in ends.values()])
        true = np.array([face(last[k].orientation) for k in ends])
        happened = np.eye(FACES)[true]
        yield f"{-np.log(shares[np.arange(len(true)), true]).mean():.3f}"
        yield f"{((shares - happened) ** 2).sum(axis=1).mean():.3f}"
        yield f"{calibration_error(shares.ravel(), happened.ravel()):.3f}"


def _shares(faces: list[int]) -> Floats:
    """Probabilities of the faces, none of which is 0: one draw more is shared by all."""
    counts = np.bincount(faces, minlength=FACES)
    return np.asarray((counts + 1 / FACES) / (len(faces) + 1))


class TossesStudy(Study[Settings, Tosses]):
    """Real tosses of a cube (ContactNets): does it end here as it did, and in MuJoCo?

    Example: energymargin reproduce tosses --data DIR
    """

    name = "tosses"
    settings, quick = Settings(), Settings(frictions=(0.18,), draws=4, every=8)
    title, unit = "Tossing", "tosses"
    packages = ("mujoco",)
    folders = (FOLDER,)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Tosses:
        """Runs what the folder does not have yet."""
        engine()
        s = replace(settings, data=str(_folder(settings.data)))
        numbers = range(0, len(tosses(s.data)), s.every)
        chooses, others = numbers[::2], numbers[1::2]
        about: dict[str, Any] = {"restitution": s.restitution, "step": s.step, "folder": s.data}

        def jobs(name: str, friction: float, which: range, draws: int) -> list[Job]:
            asked: dict[str, Any] = {
                "engine": name,
                "friction": friction,
                "draws": draws,
                "seed": s.seed,
            }
            return [Job(toss=toss, **asked, **about) for toss in which]

        def runs(asked: list[Job]) -> dict[Job, Ended]:
            lines = pairs(Job, Ended)
            path = folder / "tosses.jsonl"
            return resumed(path, asked, run, threads, lines=lines, progress=progress)

        tried = {
            (name, friction): _right(runs(jobs(name, friction, chooses, 0)))
            for name in ENGINES[:2]
            for friction in s.frictions
        }
        chosen = max(s.frictions, key=lambda one: tried["native", one])
        found = {
            name: {job.toss: end for job, end in runs(jobs(name, chosen, others, s.draws)).items()}
            for name in ENGINES
        }
        return Tosses(s, chosen, tried, found)


def _right(found: dict[Job, Ended]) -> float:
    """Share of the tosses that end on the recorded face."""
    return float(
        np.mean(
            [
                face(np.array(end.orientation))
                == face(tosses(job.folder)[job.toss].last.orientation)
                for job, end in found.items()
            ]
        )
    )


STUDY = TossesStudy()
