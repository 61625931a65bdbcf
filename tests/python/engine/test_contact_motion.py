"""What moves freely keeps its energy and momentum; what slides, spins and rolls obeys Coulomb."""

from __future__ import annotations

import pytest

import energymargin as em
from energymargin_paper.evidence.contact_motion import (
    FLOORS,
    braking,
    linkage,
    pendulum,
    rolling_drift,
    slide,
    tumbling,
)
from energymargin_paper.evidence.contact_push import push_error

SEEDS = pytest.mark.parametrize("seed", range(4))


@SEEDS
def test_box_that_tumbles_about_its_middle_axis_keeps_energy_and_angular_momentum(
    seed: int,
) -> None:
    kept = tumbling(seed)
    assert kept.energy < 0.01
    assert kept.angular < 1e-4


@pytest.mark.parametrize("seed", [*range(4), 25, 1001])  # the last two whirl at 95 rad/s
def test_double_pendulum_without_friction_keeps_its_energy(seed: int) -> None:
    assert pendulum(seed) < 1e-4


@SEEDS
def test_linkage_that_whirls_at_a_hundred_radians_a_second_keeps_its_energy(seed: int) -> None:
    kept = linkage(seed, duration=1.0, faster=30.0)
    assert kept.energy < 1e-3
    assert kept.angular < 1e-3


@SEEDS
def test_linkage_that_flies_keeps_both_momenta(seed: int) -> None:
    kept = linkage(seed)
    assert kept.linear < 1e-4
    assert kept.angular < 1e-4


@SEEDS
def test_box_that_slides_stops_when_friction_has_used_its_speed_and_never_lifts(seed: int) -> None:
    found = slide(seed)
    assert found.lift < 0.1
    assert abs(found.steps) <= 1.0


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("seed", range(2))
def test_disc_that_spins_on_its_face_is_braked_as_by_even_pressure(floor: str, seed: int) -> None:
    assert braking(floor, seed) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("heading", [0.0, 0.3, 1.3, 4.0])
@pytest.mark.parametrize("radius", [0.05, 0.1])
def test_cylinder_rolls_straight(heading: float, radius: float) -> None:
    assert rolling_drift(heading, radius) < 1.0


@pytest.mark.parametrize("seed", range(3))
def test_pushed_box_on_three_feet_goes_where_friction_against_each_slip_lets_it(seed: int) -> None:
    assert push_error(seed) < 1.0


RADIUS, SIDEWAYS = 0.025, 0.3  # m, m/s
SOFT = em.Surface(stiffness=1e4, damping=20.0)


def rolls_off(
    floor: em.Box | None,
    *,
    surface: em.Surface | None,
    ball_first: bool,
    fall: float,
    step: float,
) -> float:
    """Speed after a ball that came with 0.3 m/s sideways has met a floor, as a share of that."""
    scene = em.Scene(step=step)

    def add_ball() -> None:
        scene.add_body(
            "ball",
            em.Sphere(RADIUS),
            mass=0.1,
            position=(0.0, 0.0, RADIUS + fall),
            velocity=(SIDEWAYS, 0.0, 0.0),
            friction=1.0,
            surface=surface,
        )

    if ball_first:
        add_ball()
    if floor is None:
        scene.add_plane("floor", friction=1.0)
    else:
        scene.add_body("floor", floor, mass=0.0, position=(0.0, 0.0, -0.1), friction=1.0)
    if not ball_first:
        add_ball()
    duration = (2.0 * fall / 9.81) ** 0.5 + 0.05
    ran = em.World(scene).simulate(scene.pack(), steps=round(duration / step))
    return float(scene.unpack(ran.states[-1])["ball"]["velocity"][0]) / SIDEWAYS


@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 1000])
@pytest.mark.parametrize("ball_first", [False, True])
@pytest.mark.parametrize("floor", [None, em.Box((4.0, 4.0, 0.2))])
@pytest.mark.parametrize("surface", [None, SOFT])
def test_ball_that_falls_and_goes_sideways_rolls_off_at_five_sevenths(
    surface: em.Surface | None, floor: em.Box | None, ball_first: bool, step: float
) -> None:
    for fall in (0.05, 0.11, 0.2, 0.31, 0.44):
        left = rolls_off(floor, surface=surface, ball_first=ball_first, fall=fall, step=step)
        assert left == pytest.approx(5 / 7, rel=0.01), f"a fall of {fall} m"


def speeds_on_a_board(
    mass: float, *, surface: em.Surface | None, ball_first: bool, fall: float, step: float
) -> tuple[float, float]:
    """Of a ball of 0.1 kg that fell and of the board on ice that it met, m/s."""
    scene = em.Scene(step=step)
    scene.add_plane("ice", friction=0.0)

    def add_board() -> None:
        board = em.Box((1.0, 1.0, 0.02))
        scene.add_body("board", board, mass=mass, position=(0.0, 0.0, 0.01), friction=1.0)

    if not ball_first:
        add_board()
    scene.add_body(
        "ball",
        em.Sphere(RADIUS),
        mass=0.1,
        position=(0.0, 0.0, 0.02 + RADIUS + fall),
        velocity=(SIDEWAYS, 0.0, 0.0),
        friction=1.0,
        surface=surface,
    )
    if ball_first:
        add_board()
    duration = (2.0 * fall / 9.81) ** 0.5 + 0.05
    ran = em.World(scene).simulate(scene.pack(), steps=round(duration / step))
    bodies = scene.unpack(ran.states[-1])
    return float(bodies["ball"]["velocity"][0]), float(bodies["board"]["velocity"][0])


@pytest.mark.parametrize("ball_first", [False, True])
@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize(
    ("step", "within"),  # of rigid bodies, and of soft ones
    [(1 / 60, (0.014, 0.046)), (1 / 240, (0.012, 0.022)), (1 / 1000, (0.005, 0.005))],
)
@pytest.mark.parametrize("mass", [0.05, 0.1, 0.4, 2.0])
def test_ball_that_falls_on_a_board_on_ice_rolls_off_and_takes_the_board_along(
    mass: float, step: float, within: tuple[float, float], soft: bool, ball_first: bool
) -> None:
    """Long steps shorten both levers: the miss shrinks with the step."""
    surface = em.Surface(stiffness=1e5, damping=20.0) if soft else None
    free = 0.1 / mass + 2.5  # inverse mass of the board and of the ball's spin, times the ball's
    for fall in (0.05, 0.2, 0.44):
        ball, board = speeds_on_a_board(
            mass, surface=surface, ball_first=ball_first, fall=fall, step=step
        )
        wanted = SIDEWAYS * free / (free + 1.0)
        assert ball == pytest.approx(wanted, rel=within[soft]), f"from {fall} m"
        assert 0.1 * ball + mass * board == pytest.approx(0.1 * SIDEWAYS, rel=1e-6)
