"""Reads a problem file and prints the least work found that takes an object out, and how.

python examples/02_effort.py PROBLEM.json
"""

import sys

import energymargin as em

problem = em.Problem.load(sys.argv[1])

for planner in ("est", "rrt"):
    escape = em.escape_effort(problem, planner=planner, nodes=300)
    print(f"{planner}: {escape.effort:.6f} J")
    for node in escape.path:
        print(f"  after {escape.tree.times[node]:.3f} s and {escape.tree.costs[node]:.6f} J")
