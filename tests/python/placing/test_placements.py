"""Where to set a thing down: what stays, what falls, and with whom."""

import csv

import numpy as np
import pytest
from command_line import run_here
from scipy import stats
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.placing.pushes import Pushes

trimesh = pytest.importorskip("trimesh")
BOARD, CUP = (0.5, 0.3, 0.02), (0.06, 0.06, 0.1)


def board_and_cup(engine="native", **given):
    scene = em.Scene(engine=engine)
    scene.add_body("board", em.Box(BOARD), mass=0.0, position=(0, 0, 0.5), friction=0.8)
    scene.add_body("cup", em.Box(CUP), mass=0.3, friction=0.8, role="object", **given)
    return scene


def at(x, y, z=0.56, yaw=0.0):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = x, y, z
    return pose


def test_the_middle_is_better_than_the_edge_and_beyond_it_nothing_stays():
    poses = {"beyond": at(0.26, 0), "edge": at(0.247, 0), "middle": at(0, 0)}
    found = em.placements(board_and_cup(), "cup", poses, rollouts=40, seed=1)
    assert found.best == "middle" and found.complete and not found.blocked
    scores = {one.name: one.score for one in found}
    assert scores["middle"] == 1.0 and scores["beyond"] == 0.0 < scores["edge"] < 1.0
    assert found.pose[:3, 3].tolist() == [0, 0, 0.56]


def test_a_pose_in_the_air_is_warned_of_with_what_is_nearest():
    few = {"rollouts": 2, "pushed": 0}
    words = r"1 of 2 poses are in the air, as 'high', 0.05 m from 'board'"
    with pytest.warns(em.PlausibilityWarning, match=words):
        em.placements(board_and_cup(), "cup", {"high": at(0, 0, 0.61), "right": at(0, 0)}, **few)


def test_the_error_of_a_pose_counts_at_the_edge():
    """Half of a cup whose centre is put at the edge, give or take, falls."""
    pose = {"cup": [0.01, 0, 0, 0, 0, 0]}
    known = em.beliefs.Uncertainty(pose=pose)
    options = {"knock": 0.0, "rollouts": 200, "race": False, "pushed": 0, "radius": 0.05}
    found = em.placements(
        board_and_cup(), "cup", {"edge": at(0.25, 0)}, uncertainty=known, **options
    )
    (one,) = found
    assert one.low <= 0.5 <= one.high


@pytest.mark.parametrize("engine", ["native", "bullet"])
def test_the_least_push_of_a_placement_is_that_of_its_edge(engine):
    found = em.placements(board_and_cup(engine), "cup", {"free": at(0, 0), "brink": at(0.24, 0)})
    weight, half = 0.3 * 9.81, CUP[2] / 2
    free, brink = (weight * (np.hypot(d, half) - half) for d in (CUP[0] / 2, 0.01))
    assert found.pushes["free"].effort == pytest.approx(free, rel=0.02)
    assert found.pushes["brink"].effort == pytest.approx(brink, rel=0.02)
    assert found.pushes["brink"].direction == pytest.approx((1, 0, 0))


def test_a_cup_that_falls_by_itself_needs_no_push():
    found = em.placements(board_and_cup(), "cup", {"beyond": at(0.27, 0)}, rollouts=5)
    push = found.pushes["beyond"]
    assert (push.effort, push.way, push.takes) == (0.0, "by itself", ())


def test_a_push_that_is_cut_off_is_missing(monkeypatch):
    cancel, least = em.Cancel(), Pushes.least

    def cut_off(*given):
        cancel.set()
        return least(*given)

    monkeypatch.setattr(Pushes, "least", cut_off)
    poses = {"a": at(0, 0), "b": at(0.1, 0)}
    found = em.placements(board_and_cup(), "cup", poses, rollouts=5, cancel=cancel)
    assert found.ranking.complete and not found.pushes and not found.complete


def test_a_neighbour_that_falls_with_it_is_named_and_one_in_its_way_blocks():
    scene = board_and_cup()
    slim = {"mass": 0.1, "friction": 0.8, "role": "object"}
    scene.add_body("pen", em.Box((0.02, 0.02, 0.12)), position=(0.1, 0, 0.57), **slim)
    walls = {"mass": 0.0, "position": (0, 0.1, 0.6)}
    scene.add_body("wall", em.Box((0.5, 0.02, 0.2)), **walls)
    poses = {"beside": at(0.055, 0), "in the pen": at(0.09, 0), "in the wall": at(0, 0.1)}
    found = em.placements(scene, "cup", poses, rollouts=10, knock=0.02)
    assert found.blocked == {"in the pen": "pen", "in the wall": "wall"}
    assert found.best == "beside" and found.pushes["beside"].takes in {("pen",), ()}
    toppled = em.stack_robustness(
        scene, scene.pack(cup={"position": (0.055, 0, 0.56)}), support=(), bodies=["cup"]
    )
    assert toppled.weakest.effort < 0.3 * 9.81 * (np.hypot(0.03, 0.05) - 0.05) * 1.02


def test_a_plane_has_no_grid_and_a_support_that_is_named_twice_has_one():
    scene = board_and_cup()
    scene.add_plane("floor", friction=1.0)
    with pytest.raises(ValueError, match="on is 'floor', a plane without an end"):
        em.placements(scene, "cup", on=["floor"])
    asked = {"spacing": 0.1, "rollouts": 16, "pushed": 0}
    once, twice = (em.placements(scene, "cup", on=on, **asked) for on in (["board"], ["board"] * 2))
    assert len(once) == len(twice)


def test_a_grid_covers_the_top_and_the_middle_comes_first():
    found = em.placements(board_and_cup(), "cup", on=["board"], spacing=0.1, rollouts=10, pushed=0)
    places = np.array([found.poses[one.name][:3, 3] for one in found])
    assert len(found) == 5 * 3 and np.allclose(places[:, 2], 0.56, atol=2e-4)
    assert abs(places[0, 0]) <= 0.1 and places[0, 1] == 0.0
    turned = em.placements(
        *(board_and_cup(), "cup"), on=["board"], spacing=0.2, yaws=(0, 0.5), rollouts=5, pushed=0
    )
    assert len(turned) == 2 * 3


def test_a_support_that_is_shaken_or_leans_takes_more_than_one_at_rest():
    poses = [at(0, 0)]
    slippery = board_and_cup().with_body("cup", friction=0.2)

    def stays(**given):
        found = em.placements(slippery, "cup", poses, knock=0.0, rollouts=40, pushed=0, **given)
        return next(iter(found)).score

    assert stays() == 1.0
    # It slides beyond atan(0.16) = 9.1 degrees: 45 % of the slopes up to 20 are below that.
    assert 0.25 <= stays(tilt=np.radians(20)) <= 0.7
    assert stays(shake=8.0) < 1.0


@pytest.mark.parametrize("given", [{"tilt": 1.2}, {"shake": 12.0}])
@pytest.mark.parametrize("mass", [0.1, 0.9])
def test_a_slope_and_a_shake_act_by_the_mass_of_each_draw(given, mass):
    """What slides or topples on a support that moves does so whatever its mass."""
    asked = board_and_cup(), "cup", [at(0, 0)]
    given |= {"knock": 0.0, "height": 0.0, "rollouts": 40, "pushed": 0}
    known = em.beliefs.Uncertainty(mass={"cup": stats.uniform(0.999 * mass, 0.002 * mass)})
    (one,) = em.placements(*asked, **given)
    (other,) = em.placements(*asked, **given, uncertainty=known)
    assert 0.2 < one.score < 0.95 and other.score == pytest.approx(one.score, abs=0.03)


def test_the_same_seed_gives_the_same_table_on_any_threads():
    asked = board_and_cup(), "cup", {"a": at(0.247, 0), "b": at(0.243, 0)}
    one, two = (em.placements(*asked, rollouts=20, threads=n, seed=7) for n in (1, 2))
    assert one.to_csv() == two.to_csv()


def test_a_store_keeps_the_draws(tmp_path):
    asked = board_and_cup(), "cup", {"a": at(0.247, 0), "b": at(0.243, 0)}
    given = {"rollouts": 20, "pushed": 0, "store": tmp_path / "draws.db"}
    one, two = (em.placements(*asked, **given) for _ in range(2))
    assert one.to_csv() == two.to_csv() and given["store"].stat().st_size > 0
    with pytest.raises(ValueError, match="store"):
        em.placements(*asked, **given, tilt=0.1)


def test_a_limit_keeps_the_draws_that_are_done():
    cancel = em.Cancel()
    found = em.placements(
        *(board_and_cup(), "cup", [at(0, 0), at(0.1, 0)]),
        rollouts=100_000,
        race=False,
        progress=lambda done, _: cancel.set() if done > 20 else None,
        cancel=cancel,
    )
    assert not found.complete and found.ranking["0"].draws >= 16 and not found.pushes


def test_a_loose_tray_that_would_not_feel_a_slope_is_refused():
    scene = board_and_cup()
    scene.add_body("tray", em.Box((0.2, 0.2, 0.02)), mass=0.5, position=(0, 0, 0.52))
    few = {"rollouts": 2, "pushed": 0}
    assert em.placements(scene, "cup", {"on it": at(0, 0, 0.58)}, knock=0.1, **few).best == "on it"
    with pytest.raises(ValueError, match=r"tilt is 0.1, and 'tray' is a free body .*role 'object'"):
        em.placements(scene, "cup", {"on it": at(0, 0, 0.58)}, tilt=0.1, **few)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"poses": {"in it": at(0, 0, 0.5)}}, "none of which has room: board"),
        ({"on": ["table"]}, "on is 'table'"),
        ({"poses": [np.eye(3)]}, "poses is"),
        ({"poses": {"big": 2 * at(0, 0)}}, r"poses\['big'\] is .*expected a rotation and a place"),
        ({"poses": [np.diag([-1, 1, 1, 1])]}, r"poses\['0'\] is .*expected a rotation and a place"),
        ({"on": "board"}, "on is 'board', expected a list of names"),
        ({"on": ["board"], "yaws": ()}, "yaws is empty"),
        ({"on": ["board"], "yaws": [np.nan]}, "yaws is .*nan.*, expected turns"),
        ({"poses": {1: at(0, 0), "1": at(0.1, 0)}}, "poses has names .*expected different ones"),
        ({"on": ["board"], "grasp": np.eye(4)}, "grasp is given, and no hand has it"),
        ({"on": ["board"], "spacing": 1e-9}, "spacing is 1e-09, expected a larger one"),
        ({"poses": [at(0, 0)], "knock": -1}, "knock is -1"),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        em.placements(board_and_cup(), "cup", **given)
    with pytest.raises(ValueError, match="body is 'board'"):
        em.placements(board_and_cup(), "board")


def test_the_command_ranks_poses_of_a_table_and_a_grid(tmp_path):
    trimesh.creation.box(CUP).export(tmp_path / "cup.obj")
    trimesh.creation.box(BOARD).export(tmp_path / "board.obj")
    rows = "name,x,y,z,qx,qy,qz,qw\nmiddle,0,0,.06,0,0,0,1\nbeyond,.26,0,.06,0,0,0,1\n"
    (tmp_path / "poses.csv").write_text(rows)
    mesh = ["--object", "cup.obj", "--mass", 0.3, "--on", "board.obj", "--rollouts", 20]
    done = run_here("placements", "poses.csv", *mesh, "-o", "out.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first, last = csv.DictReader((tmp_path / "out.csv").open())
    assert (first["name"], last["name"]) == ("middle", "beyond")
    assert first["way"] == "topples" and "the best is middle" in done.stdout.lower()
    grid = ["--spacing", 0.2, "--pose", 0, "-o", "out.png"]
    done = run_here("placements", *mesh, *grid, cwd=tmp_path)
    assert done.returncode == 0 and (tmp_path / "out.png").stat().st_size > 5000, done.stderr
    (tmp_path / "board.obj").rename(tmp_path / "object.obj")  # the name of what is set down
    few = ["--on", "object.obj", *mesh[:4], "--rollouts", 2, "--spacing", 0.2, "--pushed", 0]
    done = run_here("placements", *few, cwd=tmp_path)
    assert done.returncode == 0 and "object-.0 (" in done.stdout, done.stderr
    (tmp_path / "object.obj").rename(tmp_path / "board.obj")
    done = run_here("placements", *mesh, "--pose", 9, cwd=tmp_path)
    assert done.returncode == 2 and "--pose is 9" in done.stderr
    done = run_here("placements", "poses.csv", *mesh, "--turns", 4, cwd=tmp_path)
    assert done.returncode == 2 and "--turns is 4, but it is of a grid" in done.stderr


def test_the_command_takes_poses_that_are_far_from_the_origin(tmp_path):
    trimesh.creation.box(CUP).export(tmp_path / "cup.obj")
    board = trimesh.creation.box(BOARD)
    board.apply_translation((8, 0, 0))
    board.export(tmp_path / "board.obj")
    (tmp_path / "poses.csv").write_text("name,x,y,z,qx,qy,qz,qw\nfar,8,0,.06,0,0,0,1\n")
    mesh = ["--object", "cup.obj", "--mass", 0.3, "--on", "board.obj", "--rollouts", 2]
    done = run_here("placements", "poses.csv", *mesh, "--pushed", 0, cwd=tmp_path)
    assert done.returncode == 0 and "| far | 1.00 |" in done.stdout, done.stderr


def test_poses_that_are_none_and_a_single_turn_are_named():
    with pytest.raises(TypeError, match=r"poses is 3, expected poses \(4, 4\), a dict"):
        em.placements(board_and_cup(), "cup", 3)
    with pytest.raises(ValueError, match="yaws is 3, expected turns in rad"):
        em.placements(board_and_cup(), "cup", on=["board"], yaws=3)


def test_the_command_sets_it_down_with_a_hand(tmp_path):
    trimesh.creation.box(CUP).export(tmp_path / "cup.obj")
    trimesh.creation.box(BOARD).export(tmp_path / "board.obj")
    head = "name,x,y,z,qx,qy,qz,qw\n"
    (tmp_path / "poses.csv").write_text(head + "middle,0,0,.06,0,0,0,1\n")
    (tmp_path / "grasps.csv").write_text(head + "above,0,0,.03,1,0,0,0\n")
    mesh = ["poses.csv", "--object", "cup.obj", "--mass", 0.3, "--friction", 0.8, "--rollouts", 5]
    words = ["placements", *mesh, "--on", "board.obj", "--pushed", 0, "--hand", "panda"]
    done = run_here(*words, "--grasp", "grasps.csv", cwd=tmp_path)
    assert done.returncode == 0 and "| middle | 1.00 |" in done.stdout, done.stderr
    done = run_here(*words, cwd=tmp_path)
    assert done.returncode == 2 and "--grasp is not given" in done.stderr


def between_pads(**changes):
    """The cup from above, between pads along x; the grasp frame is 2 cm below its rim."""
    grasp = np.diag([1.0, -1.0, -1.0, 1.0])
    grasp[2, 3] = 0.03
    gripper = em.grasps.ParallelGripper(opening=0.09, pad=(0.02, 0.02), force=20.0)
    return {"hand": gripper, "grasp": grasp, "knock": 0.0, "rollouts": 10, "pushed": 0, **changes}


def test_a_hand_that_opens_and_backs_off_leaves_the_cup_where_it_was_put():
    poses = {"middle": at(0, 0), "beyond": at(0.26, 0)}
    found = em.placements(board_and_cup(), "cup", poses, **between_pads())
    assert {one.name: one.score for one in found} == {"middle": 1.0, "beyond": 0.0}


def test_a_hand_that_does_not_let_go_takes_the_cup_along():
    keeps = em.grasps.Protocol([em.grasps.Motion("lift", 0.6, -0.1, frame="hand")])
    (one,) = em.placements(board_and_cup(), "cup", [at(0, 0)], **between_pads(release=keeps))
    assert one.score == 0.0


def test_a_neighbour_that_is_in_the_way_of_the_hand_alone_blocks():
    scene = board_and_cup()
    post = {"mass": 0.0, "position": (0.052, 0, 0.61)}
    scene.add_body("post", em.Box((0.02, 0.02, 0.2)), **post)
    free = em.placements(scene, "cup", [at(0, 0)], rollouts=5, pushed=0)
    assert not free.blocked
    with pytest.raises(ValueError, match="none of which has room: post"):
        em.placements(scene, "cup", [at(0, 0)], **between_pads())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"grasp": None}, "grasp is None, expected where the hand holds the body"),
        ({"grasp": np.eye(4) + 0.2 * np.eye(4, k=3)}, "grasp is one whose hand"),
        ({"uncertainty": em.beliefs.Uncertainty(pose={"cup": [0.01] * 6})}, "the hand holds"),
    ],
)
def test_what_does_not_go_with_a_hand_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        em.placements(board_and_cup(), "cup", [at(0, 0)], **between_pads(**changes))


def on_a_moving_board(acceleration):
    """A board that speeds up along x for half a second."""
    scene = em.Scene()
    board = {"mass": 1.0, "kinematic": True, "position": (0, 0, 0.5), "friction": 0.8}
    scene.add_body("board", em.Box(BOARD), role="effector", **board)
    scene.add_body("cup", em.Box(CUP), mass=0.3, friction=0.8, role="object")
    speeds = np.zeros((120, 6))
    speeds[:, 0] = acceleration * (np.arange(120) + 0.5) / 240
    return scene, em.Plan(1 / 240, velocities={"board": speeds})


def test_a_support_that_moves_on_takes_the_cup_along_up_to_its_limit():
    """w / h = 0.6 and mu = 0.64: it topples beyond 0.6 g, and slides later."""
    for acceleration, stays in ((4.0, 1.0), (9.0, 0.0)):
        scene, plan = on_a_moving_board(acceleration)
        asked = {"plan": plan, "knock": 0.0, "rollouts": 5, "pushed": 0, "height": 0.0005}
        (one,) = em.placements(scene, "cup", [at(-0.15, 0)], **asked, radius=0.03)
        assert one.score == stays
    with pytest.raises(
        ValueError, match="plan moves nothing, expected velocities of one kinematic"
    ):
        wrench = em.Plan(0.5, wrenches={"cup": [[0, 0, 0, 0, 0, 0]]})
        em.placements(scene, "cup", [at(0, 0)], plan=wrench)


@pytest.mark.parametrize(("degrees", "stays"), [(15, 1.0), (25, 0.0)])
def test_on_a_support_that_leans_it_is_put_along_it_and_slides_beyond_friction(degrees, stays):
    scene = em.Scene()
    turn = Rotation.from_euler("y", degrees, degrees=True)
    desk = {"mass": 0.0, "friction": 0.6, "orientation": turn.as_quat()}  # atan(0.36) is 20 degrees
    scene.add_body("desk", em.Box((0.4, 0.4, 0.02)), **desk)
    scene.add_body("book", em.Box((0.1, 0.06, 0.04)), mass=0.5, friction=0.6, role="object")
    options = {"spacing": 0.15, "rollouts": 10, "pushed": 0, "knock": 0.0}
    found = em.placements(scene, "book", on=["desk"], **options)
    assert len(found) == 9 and {one.score for one in found} == {stays}
    there = turn.inv().apply([pose[:3, 3] for pose in found.poses.values()])
    assert there[:, 2] == pytest.approx(0.03, abs=2e-4)  # half of both
