"""`make bench-contact` on its short scenes: that three engines are asked the same; not how fast."""

import pytest

from contact import ENGINES, figure, report
from contact_engines import MuJoCo, Ours, PyBullet
from contact_scenes import SCENES, judged

QUESTIONS = {question.name: question for question in SCENES}


@pytest.mark.parametrize("engine", [Ours(), PyBullet(200), MuJoCo(1 / 4000)])
def test_hand_holds_its_cube_and_a_grip_falls_above_its_limit_in_every_engine(engine):
    assert judged(QUESTIONS["hand"], engine, 1).error < 2.0
    grip = judged(QUESTIONS["grip"], engine, 1)
    assert grip.error < 1.0
    assert grip.falls


def test_report_and_figure_show_every_engine_also_one_that_diverges():
    one = judged(QUESTIONS["hand"], Ours(), 1)
    found = {(question, engine.name): one for question in QUESTIONS for engine in ENGINES}
    found["push", ENGINES[1].name] = None
    text = report(found)
    assert all(text.count(f"| {engine.name} |") == len(SCENES) for engine in ENGINES)
    assert text.count("diverged") == 1
    assert len(figure(found).axes) == len(SCENES)
