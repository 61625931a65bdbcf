"""A result says where it says less than it seems to."""

from __future__ import annotations

import warnings

import pytest

import energymargin as em


def ball(bound: float, gravity: float = 9.81, mass: float = 1.0) -> em.Problem:
    """In free space, captured within 0.5 m of its start."""
    scene = em.Scene(gravity=(0.0, 0.0, -gravity))
    scene.add_body("object", em.Sphere(0.05), mass=mass, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(bound,) * 3,
        torque=(0.0,) * 3,
        duration=0.5,
        captured=em.regions.Ball("object", (0.0, 0.0, 0.0), 0.5),
    )


@pytest.fixture(autouse=True)
def new_to_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test is warned anew."""
    monkeypatch.setattr("energymargin.base.plausibility._known", set())


def test_a_high_score_of_what_falls_is_warned_of() -> None:
    with pytest.warns(em.PlausibilityWarning, match=r"leaves the capture set after 0\.33"):
        score = em.capture_score(ball(50.0), nodes=100)
    assert score.capture > 0.9
    # half a metre from rest takes 0.319 s, and the set is looked at every 1/60 s
    assert score.undisturbed_exit == pytest.approx(20 / 60)
    assert any("capture_probability" in warning for warning in score.warnings)
    assert "undisturbed_exit=0.333" in repr(score)
    assert "capture_probability" in score._repr_html_()


def test_a_coarse_score_is_warned_of() -> None:
    with pytest.warns(em.PlausibilityWarning, match="resolution of"):
        score = em.capture_score(ball(50.0, gravity=0.0, mass=0.1), nodes=20)
    assert score.resolution > 0.2
    assert score.undisturbed_exit is None
    assert len(score.warnings) == 1


def test_a_fine_score_of_what_stays_is_not() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        score = em.capture_score(ball(0.001, gravity=0.0), nodes=100)
    assert score.capture > 0.9
    assert score.warnings == ()


def test_a_score_that_is_stopped_is_looked_at_too() -> None:
    cancel = em.Cancel()
    late = em.capture_score(ball(50.0), nodes=10**6, timeout=0.05, cancel=cancel, warn=False)
    assert not late.complete
    assert late.undisturbed_exit == pytest.approx(20 / 60)


def test_many_states_of_a_scene_warn_once() -> None:
    problem = ball(50.0)
    with pytest.warns(em.PlausibilityWarning) as caught:
        for seed in range(5):
            em.capture_score(problem, nodes=50, seed=seed)
    about = [str(warning.message).split(" ")[4] for warning in caught]
    assert len(caught) == 2, about


def test_a_warning_can_be_an_error() -> None:
    with warnings.catch_warnings(), pytest.raises(em.PlausibilityWarning):
        warnings.simplefilter("error")
        em.capture_score(ball(50.0), nodes=50)


def test_a_table_of_many_does_not_warn() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        em.score([ball(50.0)], ["capture"], nodes=50)
