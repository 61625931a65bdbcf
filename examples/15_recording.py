"""A camera saw a cup being pushed: how likely was it, at each moment, to stay on the tray?

The table stands for a CSV file: energymargin.recordings.read_csv. python examples/15_recording.py
"""

import numpy as np
import pandas as pd

import energymargin as em

time = np.arange(40) / 40  # s, frames of a camera
table = pd.DataFrame({"time": time, "cup_x": 0.09 * time**2, "cup_y": 0.0, "cup_z": 0.05})
table = table.assign(cup_qx=0.0, cup_qy=0.0, cup_qz=0.0, cup_qw=1.0)
recording = em.recordings.from_table(table)  # velocities come from a smoothing spline

scene = em.Scene()
scene.add_body("tray", em.Box((0.3, 0.3, 0.02)), mass=0, position=(0, 0, -0.01), friction=0.5)
cup = em.Cylinder(radius=0.03, length=0.1)
scene.add_body("cup", cup, mass=0.2, position=(0, 0, 0.05), friction=0.5, role="object")
on_tray = em.regions.Box("cup", center=(0, 0, 0.05), size=(0.2, 0.2, 0.04))

placed = em.recordings.placed(recording, scene)
for frame in range(0, 40, 8):
    problem = em.Problem(
        scene,
        placed.states[frame],
        captured=on_tray,
        force=(0.7, 0.7, 0),
        torque=(0, 0, 0),
        duration=0.2,
        horizon=0.5,
    )
    p = em.capture_probability(problem, rollouts=60)
    print(f"{recording.times[frame]:.2f} s: {p.captured:.3f}")
