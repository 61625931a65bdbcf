"""Which of three grasps of a bar will hold, and how sure is that? python examples/08_grasps.py"""

import numpy as np

import energymargin as em

hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=6)  # m, N of each finger
bar = em.grasps.GraspObject(em.Box((0.04, 0.18, 0.03)), mass=0.4, friction=0.7)

poses = np.array([np.diag([1.0, -1.0, -1.0, 1.0])] * 3)  # from above, fingers open along x
poses[:, 1, 3] = 0.0, 0.03, 0.06  # m, along the bar
poses[:, 2, 3] = 0.01
grasps = em.grasps.GraspSet(poses, names=("middle", "beside", "end"))

belief = em.grasps.GraspBelief(pose=[0.005] * 3 + [0.05] * 3)  # known to 5 mm and 3 degrees
scores = em.grasps.score(grasps, hand, bar, "lift", belief=belief, rollouts=30)
for name, held, (low, high) in zip(
    grasps.names, scores.probabilities, scores.interval(), strict=True
):
    print(f"{name}: held with probability {held:.3f}, 95 % interval {low:.3f} to {high:.3f}")
