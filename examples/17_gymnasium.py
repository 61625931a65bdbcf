"""How robust is a policy in an environment of gymnasium, which is asked in its own simulator?

python examples/17_gymnasium.py
"""

import gymnasium
import numpy as np

import energymargin as em


def balance(seen: np.ndarray) -> np.ndarray:
    """Actions, a row an observation; or a model of stable-baselines3."""
    return seen @ np.array([[0.5], [4.0], [0.5], [0.9]])


env = gymnasium.make("InvertedPendulum-v5")
env.reset(seed=0)
engine = em.engines.Gymnasium(env, objects="pole", effector="cart")
upright = em.regions.Joint("hinge", lower=-0.2, upper=0.2)
asked = {"force": (10, 0, 0), "duration": 0.1, "horizon": 0.8, "check": engine.step}
policy = engine.policy(balance)
for name, robot in {"alone": None, "with the policy": policy}.items():
    problem = em.engines.problem(engine, captured=upright, plan=robot, **asked)
    low, high = em.capture_probability(problem, rollouts=100).interval()
    print(f"{name}: captured {low:.2f} to {high:.2f}")
(push,) = em.critical_values(problem, {"push": (0, 40)})
print(f"it withstands pushes of {push.value:.0f} N ({push.low:.0f} to {push.high:.0f})")
