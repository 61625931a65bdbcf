"""Processes to which the system gives no thread, or that end while their threads are in a call."""

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


ENDS = """
import threading, time
import numpy as np
import energymargin as em

started = threading.Event()

def problem(captured):
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("block", em.Sphere(0.05), mass=1.0, role="object")
    push = dict(force=(1.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), duration=0.1, horizon=1.0)
    return em.Problem(scene, scene.pack(), captured=captured, **push)

def slow(states):
    started.set()
    time.sleep(0.002)
    return np.ones(len(states), bool)

def report(done, total):
    started.set()
    time.sleep(0.002)

ball = problem(em.regions.Ball("block", (0.0, 0.0, 0.0), 9.0))
asked = problem(em.regions.Predicate(slow))
threading.Thread(target=lambda: {call}, daemon=True).start()
started.wait()
"""


@pytest.mark.parametrize(
    "call",
    [
        "started.set() or em.capture_probability(ball, rollouts=10**8)",
        "em.capture_probability(ball, rollouts=10**8, progress=report)",
        "em.capture_probability(asked, rollouts=10**6, threads=2)",
    ],
    ids=["runs", "reports", "asks"],
)
def test_a_program_that_ends_while_a_daemon_thread_is_in_a_call_ends_quietly(call):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", ENDS.format(call=call)],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


LATE = """
import atexit
atexit.register(lambda: print(em.capture_probability(asked, rollouts=5, threads=2).captured))
"""


def test_a_call_that_an_ending_program_makes_has_its_answer():
    script = LATE + ENDS.format(call="started.set()")
    done = subprocess.run(
        [sys.executable, "-c", script], check=False, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (0, "1.0\n")
