"""Where on a shelf shall a cup be put, if the hand is off by a centimetre? And does it stay there?

python examples/10_set_it_down.py
"""

import energymargin as em

scene = em.Scene()
scene.add_body("shelf", em.Box((0.4, 0.25, 0.02)), mass=0, position=(0, 0, 1), friction=0.6)
cup = em.Cylinder(radius=0.03, length=0.1)
scene.add_body("cup", cup, mass=0.2, friction=0.6, role="object")

known = em.beliefs.Uncertainty(pose={"cup": [0.01, 0.01, 0, 0, 0, 0.1]})
found = em.placements(scene, "cup", on=["shelf"], spacing=0.12, uncertainty=known, rollouts=30)
x, y, z = found.pose[:3, 3]
print(f"{len(found.ranking.names)} places; the best is at {x:.3f}, {y:.3f}, {z:.3f} m")

settled = em.settle(scene, scene.pack(cup={"position": (x, y, z)}))
print(f"there it {settled['cup'].verdict}, on the {', '.join(settled['cup'].on)}")
