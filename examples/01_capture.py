"""Reads a problem file and prints how likely its objects stay captured, and arrive.

python examples/01_capture.py PROBLEM.json
"""

import sys

import energymargin as em

problem = em.Problem.load(sys.argv[1])

# Independent trees say how sure the score is.
score = em.capture_score(problem, nodes=200, trees=4, warn=False)

low, high = score.interval()
print(f"capture score {score.capture:.6f}, 95 % interval {low:.6f} to {high:.6f}")
if score.success is not None:
    print(f"success score {score.success:.6f}")
