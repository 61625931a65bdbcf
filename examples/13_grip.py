"""Two fingers that press with F hold 2 mu F, and not more: a limit that is known on paper.

python examples/13_grip.py
"""

import energymargin as em

F, MU, MASS = 10.0, 0.5, 0.8  # N of each finger, of finger and cube, kg

scene = em.Scene()
scene.add_body("palm", em.Box((0.12, 0.04, 0.02)), mass=0, position=(0, 0, 0.30), role="effector")
scene.add_body("cube", em.Box((0.04, 0.04, 0.04)), mass=MASS, position=(0, 0, 0.24), role="object")
for side, name in ((-1, "left"), (1, "right")):
    scene.add_body(name, em.Box((0.01, 0.02, 0.02)), mass=0.1, role="effector")
    scene.add_joint(
        f"{name}_slide",
        type="prismatic",
        parent="palm",
        child=name,
        origin=(side * 0.05, 0, -0.06),
        axis=(-side, 0, 0),
        limits=(0, 0.05),
        start=0.025,  # the finger touches
        target=0.035,  # 1 cm inside: 50 N, so F acts
        stiffness=5000.0,
        damping=10.0,
        torque_limit=F,
    )
    scene.set_friction(name, "cube", MU)

world, held = em.World(scene), scene.pack()
for share in (0.97, 1.03):
    pull = share * 2 * MU * F - 9.81 * MASS  # N, beside the weight
    rollout = world.rollout(held, (0, 0, -pull, 0, 0, 0), 1.0)
    height = scene.unpack(rollout.state)["cube"]["position"][2]
    print(f"{share:.2f} of the limit: {'held' if 0.24 - height < 0.001 else 'lost'}")
