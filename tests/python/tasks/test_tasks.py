import pytest

from energymargin import tasks
from energymargin.tasks.push import PushTask


def test_a_task_is_found_by_its_name_and_takes_its_parameters():
    assert "push" in tasks.names()
    task = tasks.make("push", friction=0.3, effector="coast")
    assert isinstance(task, PushTask)
    assert task.parameters == {"friction": 0.3, "effector": "coast", "follow": True}


def test_an_unknown_task_is_refused_with_the_names_of_those_that_exist():
    with pytest.raises(ValueError, match=r"there is no task 'shove'; there are: .*push"):
        tasks.make("shove")


def test_a_parameter_that_the_task_does_not_have_is_refused_by_name():
    with pytest.raises(ValueError, match=r"push.*'colour'"):
        tasks.make("push", colour="red")


@pytest.mark.parametrize(
    "parameters",
    [
        {"friction": 0.0},
        {"friction": float("nan")},
        {"friction": True},
        {"friction": "0.3"},
        {"effector": "fly"},
        {"effector": None},
        {"follow": 1},
    ],
)
def test_a_parameter_out_of_range_is_refused(parameters):
    with pytest.raises(ValueError, match=next(iter(parameters))):
        tasks.make("push", **parameters)
