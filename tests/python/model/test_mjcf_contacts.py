"""Contacts of a MuJoCo model: who collides, how rough, how firm, and its margins."""

import mujoco
import pytest
from mjcf_models import body, built, joint, link, loose, model

import energymargin as em
from energymargin.scenes import from_mjcf


def contacts(of, scene=None):
    """Pairs of bodies that touch, and their coefficients, in MuJoCo and in the scene."""
    data = mujoco.MjData(of)
    mujoco.mj_forward(of, data)
    name = lambda geom: of.body(of.geom_bodyid[geom]).name  # noqa: E731
    in_mujoco = {
        frozenset((name(c.geom1), name(c.geom2))): (c.friction[0] if c.dim > 1 else 0.0)
        for c in data.contact
    }
    made = scene or from_mjcf(of, ignore=["geom.condim"])
    world, start = em.World(made), made.pack()
    ours = {frozenset((c.body_a, c.body_b)) for c in world.contacts(start)}
    frictions = {pair: made.contact_friction(*pair) for pair in ours}
    return in_mujoco, frictions


def test_who_collides_and_how_rough_is_what_mujoco_says():
    of = model(
        loose("a", "0 0 0", friction=0.3)
        + loose("b", "0.9 0 0", friction=0.7)
        + loose("c", "0.4 0.8 0", friction=0.1, priority=1)
        + loose("d", "0.4 -0.8 0", condim=1, friction=0.9)
        + loose("e", "0.4 0 0.8", contype=2, conaffinity=2)
        + loose("f", "0.4 0 -0.8", contype=2, conaffinity=1),
        contact='<pair geom1="a" geom2="e" friction="0.05 0.05 0 0 0"/>'
        '<exclude body1="b" body2="f"/>',
    )
    in_mujoco, ours = contacts(of)
    assert len(in_mujoco) == 7
    assert ours == pytest.approx(in_mujoco)


def test_a_parent_collides_with_its_child_only_if_it_is_the_world():
    ball = '<geom size="0.3"/>'
    inside = link("b", link("c", at="0.2 0 0", geom=ball), at="0.2 0 0", geom=ball)
    of = model('<geom name="wall" size="0.3"/>' + link("a", inside, at="0.2 0 0", geom=ball))
    scene = from_mjcf(of, disable_collisions="overlapping")
    in_mujoco, _ = contacts(of, scene)
    allowed = {frozenset(pair) for pair in scene.disabled_collisions}
    allowed |= {frozenset((j.parent, j.child)) for j in scene.joints}
    names = {"world": "wall"}
    ours = {frozenset(names.get(name, name) for name in pair) for pair in in_mujoco}
    assert frozenset(("wall", "a")) in ours
    assert frozenset(("a", "b")) not in ours
    assert ours <= allowed  # as they overlap at the start


def test_geoms_of_a_body_that_collide_with_others_differently_are_bodies_fixed_to_it():
    geoms = (
        '<geom name="rough" size="0.1" friction="1"/>'
        '<geom name="smooth" size="0.1" pos="0.3 0 0" friction="0.1"/>'
    )
    scene = built(
        '<geom name="floor" type="plane" size="1 1 1" friction="0"/>' + link("a", geom=geoms)
    )
    light = body(scene, "a/smooth")
    assert (body(scene, "a").friction, light.friction) == (1.0, pytest.approx(0.1))
    assert body(scene, "a").mass == 0.5
    assert 0 < light.mass < 1e-8
    assert joint(scene, "a/smooth/fixed").parent == "a"


def test_links_that_always_overlap_never_collide_and_others_are_let_through_if_asked():
    with pytest.warns(em.PlausibilityWarning, match="'a' and 'b' by 50 mm. They never collide"):
        assert ("a", "b") in built(link("a") + link("b", at="0.05 0 1")).disabled_collisions
    slide = '<joint name="{0}" type="slide" range="0 1" limited="true"/>'
    inside = link("a") + link("b", at="0.05 0 1", joint=slide)
    assert built(inside).disabled_collisions == []
    for options in (
        {"disable_collisions": "overlapping"},
        {"disable_collisions": [("a", "b")]},
        {"self_collision": False},
    ):
        assert ("a", "b") in built(inside, **options).disabled_collisions
    with pytest.raises(ValueError, match="body is 'c', expected one of"):
        built(inside, disable_collisions=[("a", "c")])


# A finger that a servo presses on a cube or on a table; the cube rests on the table.
PRESS = """<mujoco>
  <worldbody>
    <geom name="table" type="plane" size="1 1 1" friction="1"/>
    <body name="palm" pos="0 0 0.3">
      <body name="finger">
        <joint name="down" type="slide" axis="0 0 -1" range="0 0.3" damping="5"/>
        <geom type="sphere" size="0.02" mass="0.2" friction="1"/>
      </body>
    </body>
    <body name="cube" pos="{at} 0 0.03">
      <freejoint/><geom type="box" size="0.03 0.03 0.03" mass="0.2" friction="1"/>
    </body>
  </worldbody>
  <actuator><position joint="down" kp="200" forcerange="-20 20"/></actuator>
</mujoco>"""


def pressed(at):
    """In MuJoCo, with the cube beside the finger, until all is at rest."""
    of = mujoco.MjModel.from_xml_string(PRESS.format(at=at))
    data = mujoco.MjData(of)
    data.ctrl[:] = 0.4
    mujoco.mj_step(of, data, 2000)
    return of, data


def fingertip(scene, state, name="finger"):
    return scene.unpack(state)[name]["position"][2]


@pytest.mark.parametrize("options", [{}, {"disable_collisions": "overlapping"}])
def test_a_grip_of_mujoco_is_a_contact_that_holds(options):
    of, data = pressed(at=0)
    assert min(contact.dist for contact in data.contact) < -1e-4
    scene = from_mjcf(of, object="cube", effector="finger", data=data, **options)
    start = em.mujoco.state(scene, of, data)
    end = em.World(scene).simulate(start, steps=240, record=[240]).states[-1]
    assert fingertip(scene, end) == pytest.approx(0.08, abs=1e-3)
    inside = em.regions.Ball("cube", (0, 0, 0.03), 0.01)
    bounds = {"force": (3, 3, 0), "torque": (0, 0, 0), "duration": 0.1, "captured": inside}
    problem = em.Problem(scene, start, horizon=0.5, **bounds)
    assert em.capture_probability(problem, rollouts=20).captured == 1.0


def test_a_finger_that_presses_on_a_table_in_a_keyframe_presses_on_it_here():
    data = pressed(at=0.5)[1]
    key = f'<keyframe><key qpos="{" ".join(map(str, data.qpos))}" ctrl="0.4"/></keyframe>'
    saved = PRESS.format(at=0.5).replace("</mujoco>", key + "</mujoco>")
    with pytest.warns(em.PlausibilityWarning, match=r"'finger' and 'table' by .*pressed apart"):
        scene = from_mjcf(saved, keyframe=0)
    assert scene.report.names("overlap, touching") == ["finger and table"]
    end = em.World(scene).simulate(scene.pack(), steps=240, record=[240]).states[-1]
    assert fingertip(scene, end) == pytest.approx(0.02, abs=1e-3)


def test_margins_are_named():
    with pytest.raises(ValueError, match=r"geom.margin \(1\)"):
        built(link("a", geom='<geom size="0.05" margin="0.01"/>'))


def test_friction_that_turns_is_that_of_the_dimensions_of_contacts():
    """Of a pair the larger ones, where its contacts have so many dimensions."""
    rough = '<geom size="0.05" friction="0.9 0.03 0.002" condim="{}"/>'
    places = {"a": 3, "b": 4, "c": 6}
    inside = [
        link(name, at=f"{i} 0 1", geom=rough.format(condim))
        for i, (name, condim) in enumerate(places.items())
    ]
    scene = built("".join(inside))
    expected = {"ab": (0.03, 0.0), "ac": (0.03, 0.002), "bc": (0.03, 0.002)}
    for (a, b), turning in expected.items():
        surface = scene.contact_surface(a, b)
        assert (surface.torsional_friction, surface.rolling_friction) == turning
        assert scene.contact_friction(a, b) == 0.9
    assert scene.bodies[[body.name for body in scene.bodies].index("a")].surface is None
    sliding = built("".join(inside), ignore=("geom.condim",))
    assert sliding.report.names("left out") == ["geom.condim"]
    assert all(body.surface is None for body in sliding.bodies)


def test_a_pair_has_its_own_friction_that_turns():
    geoms = [
        link(name, at=f"{i} 0 1", geom=f'<geom name="{name}" size="0.05"/>')
        for i, name in enumerate("ab")
    ]
    pair = '<pair geom1="a" geom2="b" condim="6" friction="0.4 0.4 0.02 0.001 0.001"/>'
    scene = built("".join(geoms), sections={"contact": pair})
    surface = scene.contact_surface("a", "b")
    assert (surface.torsional_friction, surface.rolling_friction) == (0.02, 0.001)
    assert scene.contact_friction("a", "b") == 0.4


def test_a_margin_as_small_as_an_overlap_of_mujoco_is_left_out_with_a_warning():
    with pytest.warns(em.PlausibilityWarning, match=r"next to nothing: geom.margin \(1\)"):
        scene = built(link("a", geom='<geom size="0.05" margin="0.001"/>'))
    assert scene.report == (("left out", "geom.margin", "1"), ("joint undriven", "a", ""))
