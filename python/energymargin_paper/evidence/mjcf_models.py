"""Which grippers, hands and arms of PyPI's packages load as scenes, and how exactly.

The models are those of robosuite, gymnasium-robotics and dm_control, where they are installed. A
model is loaded if nothing of its structure is left out: a tendon, a ball joint or a closed chain
that is missing counts as not loaded, other things that are ignored are named.
"""

from __future__ import annotations

import math
import time
import warnings
from dataclasses import astuple, dataclass, field, fields, replace
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from energymargin import mujoco as states
from energymargin._core import Scene
from energymargin.checks import whole_number
from energymargin.plausibility import PlausibilityWarning
from energymargin.scenes import NotSimulatedError, from_mjcf
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.study import Progress, Study, setting

__all__ = ["MODELS", "STUDY", "Loaded", "MjcfModels", "Model", "Settings", "load"]

STRUCTURE = ("actuator/tendon", "equality/", "flex", "joint/ball", "plugin", "tendon")
EXACT = 1e-9  # m, rad
GRIPPERS = "robosuite/models/assets/grippers"
ARMS = "robosuite/models/assets/robots"
ROBOTICS = "gymnasium_robotics/envs/assets"
BRANDS, SIDES = ("fourier", "inspire"), ("left", "right")
PACKAGES = {
    "robosuite": "robosuite",
    "gymnasium_robotics": "gymnasium-robotics",
    "dm_control": "dm_control",
}


@dataclass(frozen=True)
class Model:
    """A model of a package."""

    path: str
    """Beside the package."""
    name: str
    hand: bool = True
    """A gripper or a hand, or an arm or a whole scene."""
    subtree: str | None = None
    radians: bool = False
    """Whether angles are in radians whatever the file says, as in robosuite's base file."""
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Where the model's limits and couplings contradict each other."""

    @property
    def package(self) -> str:
        """As it is imported."""
        return self.path.partition("/")[0]


def _grippers() -> list[Model]:
    """Those of robosuite, with the base as subtree."""
    bent, straight = {"limits": (0.0, 1.51)}, {"limits": (0.0, 1.57)}
    roots = {
        **{
            f"{brand}_{side}_hand": f"{side}_hand" for brand in BRANDS for side in ("left", "right")
        },
        "null_gripper": "null_gripper",
        "rethink_gripper": "gripper_base",
        "robotiq_gripper_s": "palm",
        "wiping_gripper": "wiping_gripper",
    }
    own = {
        "jaco_three_finger_gripper": dict.fromkeys(
            ("joint_thumb", "joint_index", "joint_pinky"), bent
        ),
        "robotiq_gripper_s": dict.fromkeys(
            ("finger_1_joint_1", "finger_2_joint_1", "finger_middle_joint_1"), straight
        ),
    }
    names = (
        "bd_gripper",
        "fourier_left_hand",
        "fourier_right_hand",
        "inspire_left_hand",
        "inspire_right_hand",
        "jaco_three_finger_gripper",
        "null_gripper",
        "panda_gripper",
        "rethink_gripper",
        "robotiq_gripper_140",
        "robotiq_gripper_85",
        "robotiq_gripper_s",
        "wiping_gripper",
        "xarm7_gripper",
    )
    return [
        Model(
            f"{GRIPPERS}/{name}.xml",
            name,
            subtree=roots.get(name, "right_gripper"),
            radians=True,
            joints=own.get(name, {}),
        )
        for name in names
    ]


def _robots() -> list[Model]:
    names = ["baxter", "gr1", "iiwa", "jaco", "kinova3", "panda", "sawyer", "spot", "spot_arm"]
    names += ["tiago", "ur5e", "xarm7"]
    paths = {name: f"{ARMS}/{name}/robot.xml" for name in names}
    return [Model(path, name, hand=False, radians=True) for name, path in paths.items()]


KITCHEN = f"{ROBOTICS}/kitchen_franka/kitchen_assets/kitchen_env_model.xml"
KINOVA = "dm_control/third_party/kinova"
MODELS = (
    *_grippers(),
    Model(f"{ROBOTICS}/fetch/pick_and_place.xml", "Fetch gripper", subtree="robot0:gripper_link"),
    Model(KITCHEN, "Franka hand", subtree="panda0_link7"),
    Model(f"{ROBOTICS}/hand/reach.xml", "Shadow hand", subtree="robot0:hand mount"),
    Model(f"{ROBOTICS}/adroit_hand/adroit_relocate.xml", "Adroit hand", subtree="forearm"),
    Model(f"{KINOVA}/jaco_hand.xml", "Jaco hand", subtree="hand"),
    Model("dm_control/suite/manipulator.xml", "planar manipulator's hand", subtree="hand"),
    *_robots(),
    Model(f"{ROBOTICS}/fetch/push.xml", "FetchPush", hand=False),
    Model(f"{ROBOTICS}/fetch/slide.xml", "FetchSlide", hand=False),
    Model(KITCHEN, "Franka kitchen", hand=False),
    Model(f"{KINOVA}/jaco_arm.xml", "Jaco arm", hand=False),
)


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    positions: int = setting(100, "Random joint positions at which poses are compared.")
    seed: int = setting(0, "Of the positions.")

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("positions", self.positions, 1)
        whole_number("seed", self.seed, 0, 2**63 - 1)


@dataclass(frozen=True)
class Loaded:
    """What became of a model."""

    package: str
    name: str
    hand: bool
    loaded: bool
    """Whether with all of its structure."""
    without: str = ""
    """What was ignored, or why there is no scene."""
    bodies: int = 0
    """That move, and that the model has too."""
    joints: int = 0
    """With numbers in the state."""
    overlaps: int = 0
    """Pairs of bodies that overlap at the start, and do not collide."""
    limits: str = ""
    """Joints whose limits were given."""
    pose: float = math.nan
    """Largest error of a body's position [m] or of an entry of its rotation matrix."""
    mass: float = math.nan
    """Largest error of a body's mass [kg]."""
    seconds: float = math.nan
    """To load it, compiled [s]."""


@dataclass(frozen=True)
class MjcfModels:
    """The result."""

    rows: list[Loaded]
    mujoco: str
    """MuJoCo's version."""

    def to_csv(self) -> str:
        """One line a model."""
        header = [each.name for each in fields(Loaded)]
        return csv_text(header, [astuple(row) for row in self.rows])

    def to_markdown(self) -> str:
        """A table of grippers and hands, and one of arms and scenes."""
        lines = [
            "# Models of MuJoCo",
            "",
            f"MuJoCo {self.mujoco}. Poses: the largest error of a position [m] or of an entry of a "
            "rotation matrix, over random joint positions; masses: the largest error [kg].",
        ]
        for title, hand in (("Grippers and hands", True), ("Arms and scenes", False)):
            rows = [row for row in self.rows if row.hand == hand]
            loaded = sum(row.loaded for row in rows)
            lines += ["", f"## {title}: {loaded} of {len(rows)} loaded", "", _table(rows)]
        return "\n".join(lines) + "\n"


def _table(rows: list[Loaded]) -> str:
    header = ["model", "loaded", "bodies", "joints", "poses", "masses", "seconds", "without"]
    cells = []
    for row in rows:
        numbers = [str(row.bodies), str(row.joints), f"{row.pose:.0e}", f"{row.mass:g}"]
        notes = [row.without] if row.without else []
        if row.overlaps:
            notes.append(f"contacts of {row.overlaps} pairs that overlap")
        if row.limits:
            notes.append(f"its own limits of {row.limits}")
        numbers.append(f"{row.seconds:.2f}")
        there = numbers if not math.isnan(row.seconds) else [""] * 5
        name = f"{row.package}: {row.name}"
        cells.append([name, "yes" if row.loaded else "no", *there, "; ".join(notes)])
    align = ["left", "left", *["right"] * 5, "left"]
    return markdown_table(header, cells, align)


class MjcfModelsStudy(Study[Settings, MjcfModels]):
    """Which grippers, hands and arms of PyPI's packages load from MuJoCo's files, and how exactly.

    Models are those of robosuite, gymnasium-robotics and dm_control; one that is not installed is
    named. The folder gets mjcf_models.md and mjcf_models.csv. It takes half a minute.

    Example: `energymargin reproduce mjcf-models`
    """

    name = "mjcf-models"
    title, unit = "Loading", "models"
    settings = Settings()
    quick = Settings(positions=10)
    resumes = threaded = False

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> MjcfModels:
        """Loads all, on one thread."""
        rows = []
        for done, model in enumerate(MODELS, 1):
            rows.append(load(model, settings))
            progress(done, len(MODELS))
        return MjcfModels(rows, version("mujoco"))


STUDY = MjcfModelsStudy()


def load(model: Model, settings: Settings) -> Loaded:
    """What becomes of one model."""
    row = Loaded(PACKAGES[model.package], model.name, model.hand, loaded=False)
    spec = find_spec(model.package)
    if spec is None or not spec.submodule_search_locations:
        return replace(row, without="not installed")
    path = Path(spec.submodule_search_locations[0]).parent / model.path
    try:
        compiled = _compiled(path, model.radians)
    except ValueError as error:
        return replace(row, without=f"MuJoCo: {str(error).splitlines()[0]}")
    began = time.perf_counter()
    scene, ignored = _scene(compiled, model)
    seconds = time.perf_counter() - began
    if scene is None:
        return replace(row, without=ignored[0])
    pose, mass, bodies = _errors(scene, compiled, settings)
    missing = [name for name in ignored if name.startswith(STRUCTURE)]
    return replace(
        row,
        loaded=not missing and not pose > EXACT and mass == 0.0,
        without=", ".join(ignored),
        bodies=bodies,
        joints=sum(joint.type != "fixed" and joint.mimic is None for joint in scene.joints),
        overlaps=_overlaps(compiled, model, ignored, scene),
        limits=", ".join(model.joints),
        pose=pose,
        mass=mass,
        seconds=seconds,
    )


def _compiled(path: Path, radians: bool) -> Any:
    """ValueError with what MuJoCo says of the file."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(path))
    if radians:
        spec.compiler.degree = False
    return spec.compile()


def _scene(compiled: Any, model: Model) -> tuple[Scene | None, tuple[str, ...]]:
    """The scene and what was ignored for it, or no scene and why."""
    ignored: tuple[str, ...] = ()
    for _ in range(2):
        try:
            return _from(compiled, model, ignored), ignored
        except NotSimulatedError as error:
            ignored = tuple(error.features)
        except ValueError as error:
            return None, (str(error),)
    return None, ignored


def _from(compiled: Any, model: Model, ignored: tuple[str, ...], **others: Any) -> Scene:
    options = {"disable_collisions": "overlapping", **others}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)
        return from_mjcf(
            compiled, subtree=model.subtree, joints=model.joints, ignore=ignored, **options
        )


def _overlaps(compiled: Any, model: Model, ignored: tuple[str, ...], scene: Scene) -> int:
    try:
        _from(compiled, model, ignored, disable_collisions=())
    except ValueError as error:
        return str(error).partition(";")[0].count(" by ")
    return 0


def _errors(scene: Scene, compiled: Any, settings: Settings) -> tuple[float, float, int]:
    """Of poses and of masses, and how many bodies were compared."""
    import mujoco

    data, random = mujoco.MjData(compiled), np.random.default_rng(settings.seed)
    ids = {
        body.name: mujoco.mj_name2id(compiled, mujoco.mjtObj.mjOBJ_BODY, body.name)
        for body in scene.bodies
        if not body.fixed
    }
    known = {name: number for name, number in ids.items() if number >= 0}
    masses = {body.name: body.mass for body in scene.bodies}
    heavy = {name: number for name, number in known.items() if compiled.body_mass[number] > 0}
    mass = max((abs(masses[n] - compiled.body_mass[i]) for n, i in heavy.items()), default=0.0)
    worst = 0.0
    for _ in range(settings.positions if known else 0):
        state = scene.pack(joints=_random_joints(scene, random))
        states.set_state(compiled, data, scene, state)
        worst = max(worst, _pose_error(scene.unpack(state), data, known))
    return worst, float(mass), len(known)


def _random_joints(scene: Scene, random: np.random.Generator) -> dict[str, float]:
    """Even within the limits, or a turn where there are none."""
    ends = {
        joint.name: np.clip(joint.limits, -math.pi, math.pi)
        for joint in scene.joints
        if joint.type != "fixed" and joint.mimic is None and not joint.held
    }
    return {name: float(random.uniform(*limits)) for name, limits in ends.items()}


def _pose_error(now: dict[str, Any], data: Any, known: dict[str, int]) -> float:
    worst = 0.0
    for name, number in known.items():
        x, y, z, w = now[name]["orientation"]
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        off = np.abs(data.xpos[number] - now[name]["position"]).max()
        worst = max(worst, off, np.abs(turn.ravel() - data.xmat[number]).max())
    return float(worst)
