"""What nobody holds any more is freed: policies, predicates, monitors, agents that hold them."""

import gc
import threading
import weakref

import numpy as np
import pytest
from reacting import asked, policy, problem

import energymargin as em

BALL = em.regions.Ball("ball", center=(0, 0, 0), radius=1)


class Agent:
    """A robot's program that keeps the policy, the question and the world that ask it."""

    def __init__(self, keep):
        self.policy = policy(self.act)
        kept = {
            "policy": lambda: self.policy,
            "after": lambda: self.policy.after([0.0, 0.0, 0.0]),
            "problem": lambda: problem(self.policy),
            "replaced": lambda: problem(self.policy).replace(rate=2.0),
            "region": lambda: (
                ~em.regions.Predicate(self.inside) & em.regions.Ball("ball", (0, 0, 0), 1)
            ),
            "captured": lambda: problem(self.policy, succeeded=em.regions.Predicate(self.inside)),
            "world": lambda: em.World(problem().scene, plan=self.policy),
            "rest": lambda: self.policy.rest(0, 1 / 240),
        }
        self.kept = kept[keep]()

    def act(self, seen, memory, time):
        return np.zeros((len(seen), 3))

    def inside(self, states):
        return np.ones(len(states), bool)


KEPT = ["policy", "after", "problem", "replaced", "region", "captured", "world", "rest"]


@pytest.mark.parametrize("keep", KEPT)
def test_an_agent_is_freed_with_the_policy_and_the_question_that_ask_it(keep):
    agent = weakref.ref(Agent(keep))
    gc.collect()
    assert agent() is None


@pytest.mark.parametrize("keep", KEPT)
def test_what_is_held_is_not_freed_and_answers(keep):
    agent = Agent(keep)
    held, of = agent.kept, weakref.ref(agent)
    del agent
    gc.collect()
    assert of() is not None
    if keep in ("policy", "after", "problem", "replaced"):
        question = held if isinstance(held, em.Problem) else problem(held)
        del held
        gc.collect()
        assert em.capture_probability(question, rollouts=2).complete


def test_a_policy_is_freed_with_its_network():
    class Network:
        def __call__(self, seen, memory, time):
            return np.zeros((len(seen), 3))

    network = Network()
    plan = policy(network)
    asked(plan, rollouts=2)
    freed = [weakref.ref(network), weakref.ref(plan)]
    del network, plan
    gc.collect()
    assert [one() for one in freed] == [None, None]


def test_rollouts_that_are_under_way_keep_what_they_ask():
    agent = Agent("problem")
    gone = weakref.ref(agent)
    cancel, collected = em.Cancel(), threading.Event()

    def act(seen, memory, time):
        gc.collect()
        collected.set()
        return agent_free(len(seen))

    def agent_free(rows):
        return np.zeros((rows, 3))

    question = problem(policy(act))
    del agent
    assert em.capture_probability(question, rollouts=2, cancel=cancel).complete
    assert collected.is_set() and gone() is None


def monitors(count):
    return [em.Monitor(lambda state, time: problem(), rollouts=2, threads=1) for _ in range(count)]


def names_of_workers():
    return [one for one in threading.enumerate() if one.name.startswith("energymargin monitor")]


def test_a_monitor_that_nobody_holds_is_freed_and_its_threads_end():
    before = len(names_of_workers())
    held = monitors(3)
    for monitor in held[:2]:
        monitor.push(0.0, problem().state)
        assert monitor.wait(60)
    assert len(names_of_workers()) == before + 3
    freed = [weakref.ref(monitor) for monitor in held]
    held.clear()
    del monitor
    gc.collect()
    assert [one() for one in freed] == [None] * 3
    assert len(names_of_workers()) == before


def test_a_guard_that_is_refused_leaves_no_thread():
    before = len(names_of_workers())
    with pytest.raises(ValueError, match="monitor has no alarm"):
        em.Guard(lambda seen: seen, monitors(1)[0])
    gc.collect()
    assert len(names_of_workers()) == before
