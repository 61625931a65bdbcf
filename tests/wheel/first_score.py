"""A state of a task, and its score."""

import energymargin as em

task = em.tasks.make("push", friction=0.3)
state = task.rollout(seed=9).states[3]
score = em.capture_score(task.problem(state), nodes=100, warn=False)
print(f"capture score {score.capture:.3f}")
