"""A folder in the formats of the authors' published data, with numbers of our own."""

import math

from energymargin_paper.paper.authors.task import COLUMNS
from energymargin_paper.paper.authors.topple import PublishedTopple

FRAMES = 4
STAMPS = (
    "timestamp_sec,tag_id1,tvec_world_tag_1_x,tvec_world_tag_1_y,rvec_world_tag_1_z,"
    "vel_tvec_world_tag_1_x,vel_tvec_world_tag_1_y,vel_rvec_world_tag_1_z,tag_id2,"
    "tvec_world_tag_2_x,tvec_world_tag_2_y,rvec_world_tag_2_z,vel_tvec_world_tag_2_x,"
    "vel_tvec_world_tag_2_y,vel_rvec_world_tag_2_z"
)


def write(path, header, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join([header if isinstance(header, str) else ",".join(header), *lines]))


def write_simulated(root, part, columns, state, drawn=()):
    """Two trajectories, 0 and 2; `state(number, k)` gives their rows."""
    own = root / "simulated" / part
    places = [(number, k) for number in (0, 2) for k in range(FRAMES)]
    write(
        own / "viapoints.csv",
        ["num_traj", "data_id", *columns],
        [[*place, *state(*place)] for place in places],
    )
    write(
        own / "maneuver_labels.csv",
        ["num_traj", "data_id", "label", *drawn],
        [[number, k, int(number == 0 or k < 2), *[0.5 for _ in drawn]] for number, k in places],
    )
    write(own / "success_labels.csv", "num_traj,label", [[0, 1], [2, 0]])
    scores = [
        [0, 0, 100, 1, 0.1 * k, 0.9 if number == 0 else 0.1, 1 - 0.2 * k] for number, k in places
    ]
    header = "data_id,trial,plan_iters,plan_time,best_cost,success_metric,maneuverability_metric"
    write(own / "prob-aoest.csv", header, scores)
    for planner in ("est", "rrt"):
        rows = [[*row[:4], "inf" if row[4] > 0.25 else row[4], *row[5:]] for row in scores]
        write(own / f"effort-ao{planner}.csv", header, rows)


def push(number, k):
    """The first goes on ahead of the pusher, the second is passed by."""
    y = 7.0 + 0.1 * k
    x = 4.5 if number == 0 else 4.5 + 0.4 * k
    return [x, y, 0, 0, 0.4, 0, 4.5, y - 0.31, 0, 0, 0.4, 0]


def topple(number, k):
    """Sliding boxes."""
    return [6 + 0.1 * k, 2.0, 0.0, 0.2, 0.0, 0.0, 2.0 + 0.1 * k, 3.6 + 0.1 * k, 0.2, 0.2]


def tag(number, k):
    """A row of a recording: the tool pushes the object towards the wall, the second past it."""
    y = 0.1 - 0.02 * k
    drift = 0.0 if number == 0 else 0.012 * k
    yaw = math.pi / 2
    # columns of the files: x of the scene is their y, and turns have the other sign
    tool, object_ = (y + 0.062, 0.1), (y, 0.1 + drift)
    return [k / 30, 1, *tool, 0.0, -0.6, 0, 0, 2, *object_, -yaw, -0.6, 0, 0]


def write_box(path, x, y, z):
    """An OBJ file of a box with these edges, ten times as large as it is."""
    corners = [(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = [f"v {5 * x * i} {5 * y * j} {5 * z * k}" for i, j, k in corners]
    for a, b, c, d in faces:
        lines += [f"f {a + 1} {b + 1} {c + 1}", f"f {a + 1} {c + 1} {d + 1}"]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["o box", *lines]) + "\n")


def write_recordings(root, frames=12):
    """Two recordings of jaw-pushes-rectangle, of which the first succeeds."""
    own = root / "recordings" / "jaw-pushes-rectangle"
    for number in (0, 2):
        still = [tag(number, 0) for _ in range(3)]
        rows = [*still, *(tag(number, k) for k in range(frames))]
        for n, row in enumerate(rows):
            row[0] = n / 30
        write(own / f"{number:02}" / "apriltag_results.csv", STAMPS, rows)
    write(own / "labels.csv", "id,task_success", [["0", "1"], ["2", "0", "not aligned"]])
    places = [(number, k) for number in (0, 2) for k in range(frames)]
    write(
        own / "maneuver_labels_PlanePushReal.csv",
        "traj_id,data_id,maneuver_label",
        [[number, k, int(number == 0 or k < 6)] for number, k in places],
    )
    write(
        own / "ao_est.csv",
        "data_id,trial,plan_iters,plan_time,best_cost,success_metric,maneuverability_metric,traj_id",
        [[k, 0, 5, 1, "inf", 0.1 * number, 1 - 0.01 * k, number] for number, k in places],
    )
    write_box(root / "shapes/rectangle-object/rectangle-object.obj", 0.07, 0.1, 0.03)
    write_box(root / "shapes/jaw-gripper/jaw-gripper.obj", 0.05, 0.02, 0.03)


def write_data(root):
    """All of it."""
    write_simulated(root, "push", COLUMNS, push)
    write_simulated(root, "topple", PublishedTopple.columns, topple, ["lateral_friction_coef"])
    write_recordings(root)
    return root
