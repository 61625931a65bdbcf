"""Golden values: every metric on every task, to the last bit (tests/golden/make.py writes them)."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from made_tasks import MADE

import energymargin as em
from energymargin.evaluate.searches import ALGORITHM, ALGORITHM_IMPROVED

GOLDEN = Path(__file__).parents[2] / "golden"


def load_maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("golden", GOLDEN / "make.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


make = load_maker()
golden = json.loads((GOLDEN / "values.json").read_text())
values = golden["values"]
problems = {path.stem: em.Problem.load(path) for path in make.problem_files()}


def test_there_is_a_golden_problem_of_every_task() -> None:
    made = {name: em.tasks.make(name) for name in MADE}
    packages = ("energymargin.", "energymargin_paper.")
    ours = {name for name, task in made.items() if type(task).__module__.startswith(packages)}
    assert {f"problem-{name}" for name in ours} == set(problems) == set(values)


def test_the_golden_values_are_those_of_the_algorithm_by_which_stores_know_scores() -> None:
    assert golden["algorithm"] == ALGORITHM
    assert golden["algorithm_improved"] == ALGORITHM_IMPROVED


@pytest.mark.parametrize(
    ("metric", "search"), [("effort", "improved"), ("effort/est", "published")]
)
def test_the_effort_of_a_batch_is_that_of_escape_effort_of_its_search(
    metric: str, search: str
) -> None:
    asked = list(problems.values())[:3]
    table = em.score(asked, [metric], nodes=make.NODES, seed=make.SEED)
    for i, problem in enumerate(asked):
        own = em.escape_effort(
            problem, nodes=make.NODES, seed=em.stream(make.SEED, i), search=search
        )
        assert table[metric][i] == own.effort


@pytest.mark.parametrize("name", problems)
@pytest.mark.parametrize("threads", [1, 3])
def test_every_metric_has_its_golden_value_on_any_number_of_threads(
    name: str, threads: int
) -> None:
    assert make.values(name, problems[name], threads) == values[name]


@pytest.mark.parametrize(
    "without", ["-FMA,-FMA4,-AVX2_Usable,-FMA_Usable", "-AVX2,-FMA,-AVX,-AVX512F"]
)
def test_every_processor_gives_the_golden_values(without: str) -> None:
    asked = ("grasp", "push-multi")
    program = (
        "import importlib.util, json, sys, energymargin as em\n"
        "spec = importlib.util.spec_from_file_location('golden', sys.argv[1] + '/make.py')\n"
        "make = importlib.util.module_from_spec(spec); spec.loader.exec_module(make)\n"
        "problems = {path.stem: em.Problem.load(path) for path in make.problem_files()}\n"
        "print(json.dumps({name: make.values(name, problems[name]) for name in sys.argv[2:]}))\n"
    )
    names = [f"problem-{name}" for name in asked]
    environment = {**os.environ, "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={without}"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program, str(GOLDEN), *names],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout) == {name: values[name] for name in names}


OTHERS = """
import sys
import numpy as np
import energymargin as em
sys.path.insert(0, sys.argv[2])
import test_many_bodies
problem = em.Problem.load(sys.argv[1] + "/problem-push.json").replace(horizon=0.3)
noise = em.disturbances.Gaussian(0.5, correlation_time=0.05)
found = em.capture_probability(problem, disturbance=noise, rollouts=30)
rare = em.capture_probability(problem, rare=True, rollouts=100)
scene = test_many_bodies.bin_of_boxes(54, 1.0)
poured = em.World(scene).simulate(scene.pack(), steps=80).states[-1]
numbers = [found.captured, found.mean_time, *found.interval(), rare.captured, *rare.interval()]
print(np.array([*numbers, *poured, *em.tasks.make("grasp").rollout(4).states[-1]]).tobytes().hex())
"""


def test_draws_rare_losses_many_bodies_and_a_task_are_the_same_on_every_processor() -> None:
    call = [sys.executable, "-W", "ignore", "-c", OTHERS, str(GOLDEN), str(Path(__file__).parent)]
    masks = ("", "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX,-AVX512F,-FMA4,-AVX2_Usable,-FMA_Usable")
    environments = ({**os.environ, "GLIBC_TUNABLES": mask} for mask in masks)
    one, other = (subprocess.check_output(call, env=environment) for environment in environments)
    assert one == other and len(one) > 1000


def test_a_batch_gives_the_same_bits_on_any_number_of_threads_and_after_any_history() -> None:
    asked = list(problems.values()) * 2
    tables = [
        em.score(asked, nodes=make.NODES, seed=make.SEED, threads=threads) for threads in (1, 4)
    ]
    em.escape_effort(asked[2], nodes=50, seed=1)
    again = em.score(asked, nodes=make.NODES, seed=make.SEED, threads=2)
    for metric in tables[0].scores:
        bits = tables[0][metric].tobytes()
        assert bits == tables[1][metric].tobytes() == again[metric].tobytes(), metric
