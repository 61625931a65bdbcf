"""At which moment of a push is the box lost most easily? python examples/12_weakest_moment.py"""

import energymargin as em

task = em.tasks.make("push", friction=0.3)
start = task.rollout(seed=24)
problem = task.future(start.states[0], 0.0, start.params, horizon=2.2, plan="script")

profile = em.margin_profile(problem, every=0.3, ahead=1.0, rollouts=60, nodes=200)
for time, p, effort in zip(profile.times, profile.probabilities, profile.efforts, strict=True):
    print(f"{time:.2f} s: stays for a second with probability {p:.3f}, effort {effort:.4f} J")
print(f"weakest after {profile.weakest.time:.2f} s")
