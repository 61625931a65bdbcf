"""Acting on the margin: the demonstrations, held-out worlds in both engines, and the study."""

from dataclasses import replace

import numpy as np
import pytest

from energymargin._core import Cancel
from energymargin.base.replacing import replace_figure
from energymargin_paper.evidence import act as study
from energymargin_paper.evidence.act_demo import HOLD, noise
from energymargin_paper.evidence.act_methods import METHODS
from energymargin_paper.evidence.act_strips import figure_strip
from energymargin_paper.evidence.act_trials import ENGINES, duration, met, run

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")  # the scoop's

SMALL = study.Settings(demos=("balance",), worlds=2, budget=1)


@pytest.fixture(scope="module", params=study.DEMOS)
def demo(request):
    return study.demo_of(request.param)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("act")
    return study.STUDY.reproduce(SMALL, folder), folder


def test_the_nominal_plan_is_allowed_and_does_its_job_where_nothing_disturbs_it(demo):
    assert all(constraint(demo.nominal) >= 0 for constraint in demo.constraints)
    assert duration(demo.problem(demo.nominal)) is not None


def test_every_plan_meets_the_same_world_and_the_same_disturbance(demo):
    moved = {name: (start + high) / 2 for name, (_, start, high) in demo.parameters.items()}
    (one, rows), (other, same) = met(demo, demo.nominal, 3), met(demo, moved, 3)
    assert np.array_equal(rows, same) and rows.any()
    assert one.to_json() != other.to_json()
    frictions = [[body.friction for body in problem.scene.bodies] for problem in (one, other)]
    assert frictions[0] == frictions[1]


def test_another_seed_is_another_world_with_another_disturbance(demo):
    (one, rows), (other, others) = met(demo, demo.nominal, 3), met(demo, demo.nominal, 4)
    assert one.to_json() != other.to_json() and not np.array_equal(rows, others)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_square_is_lost_from_a_bar_that_is_jerked_away_in_both_engines(engine):
    demo = study.demo_of("balance")
    away = {**demo.nominal, "peak": -2.5}
    outcome = run(demo, away, engine, 0, Cancel())
    assert outcome.lost and not outcome.success


@pytest.mark.parametrize("engine", ENGINES)
def test_a_bar_that_is_drawn_under_the_square_loses_it_less_often_in_both_engines(engine):
    demo = study.demo_of("balance")
    under = {**demo.nominal, "peak": 2.5, "after": 0.6}
    nominal, drawn = (
        sum(run(demo, values, engine, world, Cancel()).lost for world in range(12))
        for values in (demo.nominal, under)
    )
    assert 0 <= drawn < nominal


def test_noise_has_its_deviations_and_forgets_in_its_correlation_time():
    rows = noise(np.random.default_rng(0), 20_000, np.array([2.0, 0.0]), 0.2)
    assert rows[:, 0].std() == pytest.approx(2.0, rel=0.05) and not rows[:, 1].any()
    alike = np.corrcoef(rows[:-1, 0], rows[1:, 0])[0, 1]
    assert alike == pytest.approx(np.exp(-HOLD / 0.2), abs=0.02)


def test_the_study_has_a_row_for_each_way_of_choosing_in_each_engine(made):
    result, _ = made
    text = result.to_markdown()
    for method in METHODS:
        assert text.count(f"| {method} | ") == len(ENGINES) + 1
    assert len(result.outcomes) == len(METHODS) * len(ENGINES) * SMALL.worlds


def test_the_search_without_disturbance_has_the_budget_of_the_margin(made):
    steps = {choice.method: found.steps for choice, found in made[0].chosen.items()}
    assert 0.5 < steps["randomization"] / steps["margin"] < 2


def test_the_same_command_goes_on_from_what_is_there(made):
    result, folder = made
    assert study.STUDY.reproduce(SMALL, folder).to_csv() == result.to_csv()


def test_a_task_in_which_the_margin_alone_holds_has_a_picture(made):
    result, folder = made
    lost = {t: replace(o, lost=t.method == "nominal") for t, o in result.outcomes.items()}
    [(name, figure)] = study.STUDY.figures(replace(result, outcomes=lost))
    replace_figure(folder / name, figure)
    assert name == "act_balance.png" and (folder / name).stat().st_size > 5000


def test_a_strip_has_a_row_of_moments_for_each_plan():
    demo = study.demo_of("balance")
    figure = figure_strip(demo, {"one": demo.nominal, "other": demo.nominal}, 0)
    labels = [ax.get_ylabel().split("\n")[0] for ax in figure.axes]
    assert [label for label in labels if label] == ["one", "other"]


@pytest.mark.parametrize(
    "wrong", [{"demos": ("throw",)}, {"engines": ("ode",)}, {"worlds": 0}, {"budget": -1}]
)
def test_settings_that_cannot_be_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        study.Settings(**wrong)
