"""The study of races: what it counts, and that it goes on from what it has."""

import pytest

from energymargin._core import Cancel
from energymargin_paper.evidence import racing as study

SMALL = study.Settings(fields=1, strengths=(2.0,), rollouts=60)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("racing")
    return study.STUDY.reproduce(SMALL, folder), folder


def test_a_field_of_each_kind_is_raced_and_a_race_takes_fewer_steps(made):
    result, _ = made
    assert [field.kind for field in result.found] == ["plans", "starts"]
    saved = [found.saved for found in result.found.values()]
    assert min(saved) >= 0 and 0 < max(saved) < 1
    assert "same choice" in result.to_markdown()


def test_the_same_command_goes_on_from_what_is_there(made):
    result, folder = made
    assert study.STUDY.reproduce(SMALL, folder).to_csv() == result.to_csv()


def test_a_field_is_the_same_again(made):
    result, _ = made
    field, found = next(iter(result.found.items()))
    again = study.run(field, 1, Cancel())
    assert (again.same, again.as_good, again.saved) == (found.same, found.as_good, found.saved)
