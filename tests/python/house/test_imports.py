"""A process starts fast: what a score does not need is imported when it is first asked for."""

import subprocess
import sys

import energymargin
from energymargin.records.datasets.dataset import StateError
from energymargin.records.datasets.files import FileError
from energymargin.records.evaluation.curves import OneLabelError

HEAVY = ("cyclopts", "dask", "h5py", "matplotlib", "rich", "scipy", "sklearn", "sqlite3", "trimesh")
OURS = (*energymargin.SUBPACKAGES, "cli", "meshes", "model.meshes.convex", "look.summaries")
SCORE = f"""
import sys
import energymargin as em
scene = em.Scene()
scene.add_plane("floor")
scene.add_body("box", em.Box((0.1,) * 3), mass=0.2, position=(0, 0, 0.05), role="object")
problem = em.Problem(
    scene, scene.pack(), force=(1, 1, 0), torque=(0, 0, 0), duration=0.2,
    captured=em.regions.Ball("box", (0, 0, 0.05), 0.05), horizon=0.1,
)
em.capture_probability(problem, rollouts=2)
print([name for name in {HEAVY} if name in sys.modules])
print([name for name in sys.modules if name.startswith("energymargin.")])
"""
HAND = f"""
import sys
import energymargin as em
em.tasks.make("grasp").rollout(0, frames=2)
print([name for name in {HEAVY} if name in sys.modules])
"""
APPLICATION = ("energymargin.cli.application",)
FOREIGN = (
    "cyclopts",
    "dask",
    "gymnasium",
    "h5py",
    "matplotlib.pyplot",
    "pandas",
    "rich",
)
FIRST = f"""
import os
for name in {(*FOREIGN, "scipy.spatial", "skimage.measure", "sklearn.metrics", "trimesh")}:
    __import__(name)  # once, not in each child: what is held here are our own modules
for name in {OURS}:
    child = os.fork()
    if child == 0:
        __import__("energymargin." + name)
        os._exit(0)
    if os.waitpid(child, 0)[1] != 0:
        print(name)
"""


def output(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_a_score_imports_no_heavy_package_and_few_modules_of_our_own():
    heavy, ours = map(eval, output(SCORE))
    assert heavy == []
    assert {name for name in ours if not name.startswith("energymargin._core")} == {
        "energymargin.base",
        "energymargin.base.aliases",
        "energymargin.base.bars",
        "energymargin.base.calls",
        "energymargin.base.checks",
        "energymargin.base.doors",
        "energymargin.base.summary",
        "energymargin.evaluate",
        "energymargin.disturbances",
        "energymargin.base.errors",
        "energymargin.summary",
        "energymargin.regions",
        "energymargin.evaluate.scores",
        "energymargin.base.table_text",
    }


def test_environments_and_the_terminal_import_no_more_than_they_need():
    for module, others in (("gym", ("scipy", "h5py", "rich")), ("cli.terminal", APPLICATION)):
        text = (
            f"import sys, energymargin.{module}; print([n for n in {others} if n in sys.modules])"
        )
        assert output(text) == ["[]"], module


def test_a_hand_imports_no_heavy_package():
    assert output(HAND) == ["[]"]


def test_every_part_can_be_the_first_that_is_imported():
    assert output(FIRST) == []


def test_every_public_name_is_there_and_no_other():
    lazy = {"gym", "mujoco", "plots", "report", "viewer", "__version__"}
    for name in (*energymargin.__all__, *lazy):
        assert getattr(energymargin, name) is getattr(energymargin, name)
        assert name in dir(energymargin)
    assert not hasattr(energymargin, "nothing")
    assert {*energymargin.__all__, *lazy} == set(dir(energymargin))


def test_own_errors_have_one_base_and_are_value_errors_still():
    own = (
        energymargin.ScoreError,
        energymargin.tasks.TaskError,
        StateError,
        FileError,
        OneLabelError,
    )
    assert all(issubclass(error, energymargin.EnergyMarginError) for error in own)
    assert all(issubclass(error, ValueError) for error in own)
