"""A process to which the system gives no thread: every call does its work where it is called."""

import subprocess
import sys

import pytest

LATER = """
import ctypes, threading, time
import energymargin as em

task = em.tasks.make("push")
trajectory = task.rollout(seed=0)
problems = [task.problem(trajectory.states[i], trajectory.params) for i in (0, 2)]
world = em.World(problems[0].scene)
settings = dict(nodes=40, seed=3)


def answers(threads):
    progress = []
    score = em.capture_score(problems[0], trees=3, threads=threads, **settings)
    tree = em.capture_score(problems[0], nodes_per_round=8, threads=threads, **settings).tree
    told = em.escape_effort(problems[0], progress=lambda *told: progress.append(told), **settings)
    assert progress[-1][0] == told.nodes
    table = em.score(problems, threads=threads, **settings)
    rollout = world.rollout(problems[0].state, (0.1, 0, 0, 0, 0, 0), 2.0)
    return [
        score.capture.hex(), score.capture_stderr.hex(), tree.states.tobytes(), told.effort.hex(),
        table.complete, *(table[metric].tobytes() for metric in table.scores),
        rollout.state.tobytes(),
    ]


expected = answers(1)

# No address space holds the stack of a thread.
libc = ctypes.CDLL(None)
attributes = ctypes.create_string_buffer(256)
assert libc.pthread_attr_init(attributes) == 0
assert libc.pthread_attr_setstacksize(attributes, ctypes.c_size_t(1 << 60)) == 0
assert libc.pthread_setattr_default_np(attributes) == 0
try:
    threading.Thread(target=print).start()
except RuntimeError as error:
    assert "can't start new thread" in str(error)
else:
    raise SystemExit("a thread has started")

assert answers(4) == expected
"""


@pytest.mark.skipif(sys.platform != "linux", reason="glibc sets the stack of all threads")
def test_where_no_thread_can_start_every_call_gives_the_same_bits():
    done = subprocess.run(
        [sys.executable, "-c", LATER], check=False, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
