"""A scene of your own: a pusher moves a box over a table.

Will the box stay in front of it for the next half second? python examples/03_own_scene.py
"""

import energymargin as em

scene = em.Scene()
scene.add_plane("table", friction=0.5)
scene.add_body(
    *("box", em.Box((0.10, 0.06, 0.04))),
    mass=0.2,
    position=(0, 0, 0.02),
    friction=0.4,
    role="object",
)
scene.add_body(
    *("pusher", em.Cylinder(radius=0.01, length=0.04)),
    mass=0.5,
    position=(0, -0.042, 0.02),
    velocity=(0, 0.1, 0),
    friction=0.4,
    role="effector",
)

state = scene.pack()
problem = em.Problem(
    scene,
    state,
    force=(1.0, 1.0, 0.0),
    torque=(0, 0, 0.02),
    duration=0.2,
    captured=em.regions.Ball("box", center=(0, 0.04, 0), radius=0.05, frame="pusher"),
    plan=em.Plan.hold(scene, state, 0.5),  # the pusher goes on as it moves
)

p = em.capture_probability(problem, rollouts=100)
low, high = p.interval()
print(f"captured for 0.5 s: {p.captured:.6f}, 95 % interval {low:.6f} to {high:.6f}")
print(f"without a disturbance it {'stays' if p.undisturbed else 'leaves'}")
