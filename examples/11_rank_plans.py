"""Which of three pushes brings the box to the wall, whatever disturbs it?

python examples/11_rank_plans.py
"""

import energymargin as em

task = em.tasks.make("push", friction=0.3)
start = task.rollout(seed=3)
problem = task.future(start.states[2], start.times[2], start.params, horizon=1.5, plan="script")


def push(sideways: float) -> em.Plan:
    """The pusher is driven ahead with 9 N, and sideways."""
    rows = [[sideways, 9.0, 0, 0, 0, 0]] * 360
    return em.Plan(1 / 240, wrenches={"effector": rows})


pushes = {f"{force:+d} N sideways": push(force) for force in (-3, 0, 3)}
ranking = em.rank(problem, pushes, metric="probability/success", rollouts=100)
for one in ranking:
    print(f"{one.name}: {one.score:.3f}, 95 % interval {one.low:.3f} to {one.high:.3f}")
print(ranking.decision)
