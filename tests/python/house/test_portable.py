"""What only Linux has is not needed: a Mac has it not. No processor's extensions choose bits."""

import re
import subprocess
import sys
from pathlib import Path

CPP = Path(__file__).parents[3] / "cpp"
CHOSEN = re.compile(  # by the C library, for a processor's extensions
    r"std::(sin|cos|tan|a?sinh?|acos|atan2?|exp|log|log1p)\("
    r"|std::pow\((?!.*, 2\))|AngleAxis|\.slerp\(|ompl::RNG\b"
)
HOME = {"portable.hpp", "ompl_random.hpp"}

WITHOUT_LINUX = """
import os, select, signal, sys

import h5py, numpy, scipy.stats  # others may need what is theirs

LINUX = {
    os: "sched_getaffinity sched_setaffinity posix_fallocate posix_fadvise memfd_create eventfd "
        "pidfd_open getrandom copy_file_range splice sync_file_range fdatasync",
    select: "epoll",
    signal: "sigtimedwait sigwaitinfo pidfd_send_signal",
}
for module, names in LINUX.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)

import energymargin as em

folder = sys.argv[1]
task = em.tasks.make("push")
dataset = em.datasets.generate(task, trajectories=2, frames=3, path=folder + "/push.h5")
trajectory = task.rollout(1)
problem = task.problem(trajectory.states[1], trajectory.params).replace(horizon=0.3)
em.capture_probability(problem, rollouts=4)
em.capture_score(problem.replace(horizon=None), nodes=5)
assert len(em.score([problem], ["probability"], rollouts=2)) == 1
em.rank({"a": problem, "b": problem}, rollouts=16)
em.margin_profile(problem, rollouts=2, nodes=5, every=0.3)
em.store.score_dataset(dataset, folder + "/scores.db", ["force"])
em.executors.Threads(), em.executors.Processes()
with em.Monitor(lambda state, time: problem, rollouts=2) as monitor:
    monitor.push(0.0, problem.state)
    assert monitor.wait(60) and monitor.latest.error is None
"""


def test_every_kind_of_score_is_made_where_a_system_lacks_what_linux_alone_has(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_LINUX, str(tmp_path)],
        check=False, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_functions_whose_bits_a_processor_chooses_are_called_in_one_place() -> None:
    found = [
        f"{path.name}: {line.strip()}"
        for folder in ("src", "bindings")
        for path in sorted((CPP / folder).rglob("*.[ch]pp"))
        if path.name not in HOME
        for line in path.read_text().splitlines()
        if CHOSEN.search(line)
    ]
    assert not found
