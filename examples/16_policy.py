"""How robust is a controller that looks 20 times a second, beside the plan that it replaces?

python examples/16_policy.py
"""

import numpy as np

import energymargin as em

task = em.tasks.make("balance")
start = task.rollout(seed=24)
replay = task.future(start.states[2], start.times[2], start.params, horizon=1.0, plan="script")
forward = replay.plan.wrenches["effector"][0, 1]  # N, what the plan pushes with


def act(seen, memory, time):
    """Forces along x and y, a row for each of 32 rollouts: the support follows the object."""
    off, drift = seen[:, 1] - seen[:, 0], seen[:, 3] - seen[:, 2]
    return np.stack([-1e5 * off - 2e4 * drift, np.full(len(seen), forward)], axis=1)


policy = em.Policy(
    act,
    period=1 / 20,
    observe=["object.x", "effector.x", "object.vx", "effector.vx"],
    command=["effector.fx", "effector.fy"],
)
for name, robot in {"the plan alone": replay.plan, "the policy": policy}.items():
    p = em.capture_probability(replay.replace(plan=robot), rollouts=100)
    low, high = p.interval()
    print(f"{name}: captured {p.captured:.3f}, 95 % interval {low:.3f} to {high:.3f}")
