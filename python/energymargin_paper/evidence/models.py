"""Public models of robots and objects: how many load at once, and are their links in place?

A try is a call of `from_urdf` or `from_mjcf`. After one that fails the next one has what the error
says, to the letter, and nothing else: so many tries a new user needs. Limits that the error asks
for are -1 and 1. Where the links are is compared with MuJoCo, at random positions of the joints;
so is where driven links get in a second, from the same state under the same controls, without
contacts, and whether a closed hand holds a ball.
"""

from __future__ import annotations

import ast
import os
import re
import warnings
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import Joint, Scene, Tendon, World
from energymargin.base.checks import whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.model.scenes.mjcf_model import engine
from energymargin.mujoco.states import Names, servos, state as em_state
from energymargin.scenes import from_mjcf, from_urdf
from energymargin_paper.evidence.hand_grips import HEAD, Grip, grip
from energymargin_paper.study import Progress, Study, setting

__all__ = ["FOLDERS", "STUDY", "Model", "Models", "Settings", "tries", "ways_out"]

FOLDERS = "ENERGYMARGIN_MODELS"
PACKAGES = ("robosuite", "gymnasium_robotics", "dm_control", "pybullet_data")
HANDS = re.compile("hand|gripper|finger|adroit|jaco|robotiq|fetch|panda|so101|manipulator", re.I)
MANY = "random_urdfs"  # a thousand objects in a folder of PyBullet's, all alike
SCENE = "scene"  # of one of the other files and a floor
MOST_TRIES = 9
LONGEST = 60.0  # s, of a try
POSES = 5  # of each model
STEP = 5e-4  # s, of MuJoCo's
NEAR = 1e-3  # m
KEYWORDS = ("ignore", "joints", "inertia", "mimic_limits", "disable_collisions", "frictions")
# What a URDF says to MuJoCo, which compares where links are: their shapes and masses do not matter.
COMPILER = {"fusestatic": "false", "balanceinertia": "true", "boundmass": "1", "boundinertia": "1"}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    every: int = setting(1, "Each so manieth file.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("every", self.every, 1)


@dataclass(frozen=True)
class Model:
    """What became of one file."""

    source: str
    """The package or folder that it is from."""
    file: str
    hand: bool
    tries: int
    """Calls until it loaded; 0 if it never did."""
    asked: str
    """What the errors asked for, or the last error if it never loaded."""
    distance: float
    """Of a link from where MuJoCo has it, at most [m]; NaN if MuJoCo does not read the file."""
    angle: float
    """The same [rad]."""
    motion: float
    """The same after a second of motion, of links that something drives [m]; NaN if there are
    none."""


@dataclass(frozen=True, eq=False)
class Models:
    """What became of all files."""

    models: list[Model]
    grips: list[Grip]
    """Of hands on their own that load at the first or second try."""

    def to_csv(self) -> str:
        """A line for each file."""
        return csv_text([field.name for field in fields(Model)], map(astuple, self.models))

    def to_markdown(self) -> str:
        """By source: how many load in how many tries, what they ask for, and where links are."""
        groups: dict[tuple[bool, str], list[Model]] = {}
        for model in self.models:
            groups.setdefault((model.hand, model.source), []).append(model)
        for hand in (True, False):
            groups[hand, "all"] = [model for model in self.models if model.hand == hand]
        head = ["", "files", "first try", "second", "later", "never", "apart [m]", "apart [rad]"]
        head += ["moved", "within 1 mm"]
        lines = ["# Public models", ""]
        for hand, title in ((True, "Hands, and scenes with one"), (False, "Other files")):
            rows = [_row(of, models) for (kind, of), models in groups.items() if kind == hand]
            lines += [f"## {title}", "", markdown_table(head, rows), ""]
        grips = markdown_table(HEAD, [each.row() for each in self.grips])
        lines += ["## A ball of 5 cm in the closed hand", "", grips, ""]
        asked = Counter(word for m in self.models if m.tries > 1 for word in m.asked.split(", "))
        lines += ["## What a second try needs", ""]
        lines += [f"- {word}: {count} files" for word, count in asked.most_common()]
        lines += ["", "## What never loads", ""]
        lines += [f"- {m.source}, {m.file}: {m.asked}" for m in self.models if not m.tries]
        return "\n".join(lines) + "\n"


def _row(source: str, models: list[Model]) -> list[str]:
    counts = Counter(min(model.tries, 3) for model in models)
    apart = np.array([(model.distance, model.angle) for model in models])
    known = apart[np.isfinite(apart).all(axis=1)]
    worst = [f"{value:.0e}" for value in known.max(axis=0)] if len(known) else ["", ""]
    moved = np.array([m.motion for m in models if np.isfinite(m.motion)])
    near = [str(len(moved)), str(int(np.sum(moved < NEAR)))]
    return [source, str(len(models)), *(str(counts[n]) for n in (1, 2, 3, 0)), *worst, *near]


class ModelsStudy(Study[Settings, Models]):
    """How many public models load at the first try, and whether their links are where MuJoCo has
    them; and whether hands hold a ball as there.

    The files are those of robosuite, gymnasium-robotics, dm_control and PyBullet's data, as far as
    they are installed, and of the folders that the environment variable ENERGYMARGIN_MODELS names
    (separated as in PATH). Files that MuJoCo does not read do not count; meshes are hulls.

    The folder gets models.md and models.csv.

    Example: `energymargin reproduce models`
    """

    name = "models"
    title, unit = "Loading", "files"
    settings = Settings()
    quick = Settings(every=10)
    packages = ("mujoco", "robosuite", "gymnasium-robotics", "dm_control", "pybullet")
    folders = (FOLDERS,)
    resumes = threaded = False

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Models:
        """Loads each file."""
        files, found = list(_files())[:: settings.every], list[Model]()
        grips: list[Grip | None] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for done, (source, root, file) in enumerate(files):
                progress(done, len(files))
                count, asked, scene, options = tries(file)
                apart = (np.nan, np.nan) if scene is None else _apart(scene, file)
                name = str(file.relative_to(root))
                hand = HANDS.search(name) is not None
                moves = hand and scene is not None and file.suffix == ".xml"
                motion = _motion(file, options) if moves else np.nan
                if moves and not file.name.startswith(SCENE):
                    grips.append(grip(file, options))
                found.append(Model(source, name, hand, count, asked, *apart, motion))
        return Models(found, [each for each in grips if each])


STUDY = ModelsStudy()


def _files() -> Iterator[tuple[str, Path, Path]]:
    """Source, its folder, and each file in it that is a URDF, or that MuJoCo compiles."""
    specs = {name: find_spec(name) for name in PACKAGES}
    places = [
        (name, Path(spec.origin).parent) for name, spec in specs.items() if spec and spec.origin
    ]
    given = [Path(folder) for folder in os.environ.get(FOLDERS, "").split(os.pathsep) if folder]
    for source, root in [*places, *((folder.name, folder) for folder in given)]:
        for file in sorted(root.rglob("*")):
            urdf = file.suffix == ".urdf" and MANY not in file.parts
            if urdf or (file.suffix == ".xml" and _compiles(file)):
                yield source, root, file


def _compiles(file: Path) -> bool:
    try:
        engine().MjModel.from_xml_path(str(file))
    except ValueError:
        return False
    return True


def tries(file: Path) -> tuple[int, str, Scene | None, dict[str, Any]]:
    """Calls until a file loads, what the errors asked for, the scene, and the keywords it took.

    0, the last error and None if an error repeats what was already given.
    """
    options: dict[str, Any] = {"decompose": False} if file.suffix == ".urdf" else {}
    read = from_urdf if file.suffix == ".urdf" else from_mjcf
    asked: dict[str, None] = {}
    for count in range(1, MOST_TRIES):
        try:
            return count, ", ".join(asked), read(file, timeout=LONGEST, **options), options
        except Exception as error:  # whatever a user meets
            text = str(error)
        new = ways_out(text)
        more = {**options, **new, "ignore": (*options.get("ignore", ()), *new.get("ignore", ()))}
        if more == options or not new:
            break
        options = more
        asked |= dict.fromkeys((*new.get("ignore", ()), *(new.keys() - {"ignore"})))
    return 0, text.splitlines()[0].replace(str(file), file.name), None, options


def ways_out(error: str) -> dict[str, Any]:
    """The keywords that an error says to give, by name; the first one of each that is a value."""
    ways: dict[str, Any] = {}
    for found in re.finditer(
        rf"({'|'.join(KEYWORDS)})=(?=[\[({{'])", error.replace("(lower, upper)", "(-1.0, 1.0)")
    ):
        rest = found.string[found.end() :]
        for end in (m.end() for m in re.finditer(r"[\])}']", rest)):
            try:
                value = ast.literal_eval(rest[:end])
            except (SyntaxError, ValueError):
                continue
            if "Ellipsis" not in repr(value):
                joined = isinstance(value, Mapping) and found[1] in ways
                ways[found[1]] = {**ways[found[1]], **value} if joined else value
            break
    return ways


def _apart(scene: Scene, file: Path) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] of a body from where MuJoCo has it; NaN without it."""
    mujoco, random, apart = engine(), np.random.default_rng(0), list[tuple[float, float]]()
    try:
        text = _bare(file) if file.suffix == ".urdf" else ""
        model = mujoco.MjModel.from_xml_string(text) if text else None
        model = model or mujoco.MjModel.from_xml_path(str(file))
    except ValueError:
        return np.nan, np.nan
    data, moving = mujoco.MjData(model), [j for j in scene.joints if j.type != "fixed"]
    leading = [j for j in moving if j.mimic is None]
    for _ in range(POSES):
        ends = np.clip([j.limits for j in leading], -np.pi, np.pi).reshape(-1, 2)
        places = dict(zip((j.name for j in leading), random.uniform(*ends.T), strict=True))
        bodies = scene.unpack(scene.pack(joints=places))
        joints = bodies.pop("joints", {})
        for joint in moving:
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint.name) >= 0:
                data.joint(joint.name).qpos = joints[joint.name]["position"]
        mujoco.mj_kinematics(model, data)
        for name, at in bodies.items():
            number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
            if number > 0:
                there = data.body(number)
                turn = Rotation.from_quat(at["orientation"]).inv()
                angle = (turn * Rotation.from_quat(np.roll(there.xquat, -1))).magnitude()
                distance = float(np.linalg.norm(at["position"] - there.xpos))
                apart.append((distance, float(angle)))
    distances, angles = zip(*apart, strict=True) if apart else ((np.nan,), (np.nan,))
    return max(distances), max(angles)


def _motion(file: Path, options: Mapping[str, Any]) -> float:
    """How far [m] a driven link is from where MuJoCo has it after a second, at most; NaN of none.

    Drives ask for positions a third of the way from where a joint is to the middle of its limits,
    so that no soft limit counts; nothing collides.
    """
    mujoco = engine()
    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.timestep = STEP
    data = mujoco.MjData(model)
    given = {**options, "self_collision": False}
    made = from_mjcf(model, data=data, **given)
    if not (aims := _aims(made)):
        return np.nan
    for name, servo in servos(Names(made, model), model).items():
        if name in aims:
            of = servo.actuator
            data.ctrl[of.address] = np.clip(servo.control(aims[name]), of.low, of.high)
    scene = from_mjcf(model, data=data, **given)
    state = World(scene).simulate(em_state(scene, model, data), round(1 / scene.step)).states[-1]
    while data.time < 1 - STEP / 2:
        mujoco.mj_step(model, data)
    links, now = _driven(scene), scene.unpack(state)
    there = (data.body(name).xpos for name in links)
    off = [np.linalg.norm(now[n]["position"] - at) for n, at in zip(links, there, strict=True)]
    return float(max(off, default=np.nan))


def _aims(scene: Scene) -> dict[str, float]:
    """By joint or tendon under position control with limits, where its drive is to ask for."""
    start = scene.unpack(scene.pack()).get("joints", {})
    places = {name: at["position"] for name, at in start.items()}
    for tendon in scene.tendons:
        terms = (of.coefficient * places[of.joint] for of in tendon.joints)
        places[tendon.name] = sum(terms)
    driven: list[Joint | Tendon] = [*scene.joints, *scene.tendons]
    return {
        of.name: places[of.name] + (np.mean(of.limits) - places[of.name]) / 3
        for of in driven
        if of.stiffness > 0 and np.isfinite(of.limits).all()
    }


def _driven(scene: Scene) -> list[str]:
    """Links of which every joint above is driven or held, follows another one, or is in a loop."""
    pulled = {of.joint for tendon in scene.tendons if tendon.stiffness for of in tendon.joints}
    tied = {body for loop in scene.loops for body in (loop.body_a, loop.body_b)}
    above = {joint.child: joint for joint in scene.joints}
    fixed = {body.name for body in scene.bodies if body.fixed}

    def moves_alike(body: str) -> bool:
        if body not in above:
            return body in fixed
        joint = above[body]
        own = joint.stiffness or joint.held or joint.mimic or joint.type == "fixed"
        return bool(own or joint.name in pulled or body in tied) and moves_alike(joint.parent)

    return [body for body in above if moves_alike(body) and "/" not in body]


def _bare(file: Path) -> str:
    """A URDF for MuJoCo without shapes, whose fixed links stay bodies."""
    root = ET.fromstring(file.read_bytes().lstrip())
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", COMPILER)
    return ET.tostring(root, encoding="unicode")
