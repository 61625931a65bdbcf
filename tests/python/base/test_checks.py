import math

import numpy as np
import pytest

from energymargin.base.checks import (
    check_shape,
    not_negative_number,
    one_of,
    positive_number,
    whole_number,
    yes_or_no,
)

NUMPY = [np.float64(2), np.float32(2), np.int64(2), np.uint8(2)]


@pytest.mark.parametrize("value", [2, 2.0, *NUMPY])
@pytest.mark.parametrize("check", [positive_number, not_negative_number])
def test_a_number_of_numpy_becomes_one_of_python(check, value):
    number = check("mass", value)
    assert number == 2 and type(number) in (int, float)


def test_a_positive_number_stays_whole_or_not():
    assert type(positive_number("mass", 2)) is int
    assert type(positive_number("mass", np.int64(2))) is int
    assert type(positive_number("mass", np.float32(2))) is float


@pytest.mark.parametrize(
    "value", [-1, math.inf, math.nan, np.float64("nan"), np.float32(-1), "2", None, True, 2j]
)
@pytest.mark.parametrize("check", [positive_number, not_negative_number])
def test_what_is_no_such_number_is_refused_by_its_name(check, value):
    with pytest.raises(ValueError, match=r"^mass is .*, expected a "):
        check("mass", value)


def test_zero_is_not_positive_and_has_no_sign():
    with pytest.raises(ValueError, match="mass is 0, expected a positive number"):
        positive_number("mass", 0)
    assert math.copysign(1, not_negative_number("mass", -0.0)) == 1


def test_a_whole_number_is_within_its_bounds():
    assert whole_number("nodes", np.int32(3), 1, 3) == 3
    with pytest.raises(ValueError, match="nodes is 0, expected a whole number of at least 1"):
        whole_number("nodes", 0, 1)
    with pytest.raises(ValueError, match="nodes is 4, expected a whole number from 1 to 3"):
        whole_number("nodes", 4, 1, 3)
    with pytest.raises(ValueError, match=r"nodes is 4\.0, expected a whole number, as 4"):
        whole_number("nodes", 4.0, 1)
    with pytest.raises(ValueError, match="nodes is True"):
        whole_number("nodes", True, 1)
    with pytest.raises(ValueError, match=r"nodes is 10{30}, .* whole number from 1 to 2147483647$"):
        whole_number("nodes", 10**30, 1)


def test_yes_or_no_takes_a_truth_of_numpy_and_no_number():
    assert yes_or_no("follow", np.True_) is True
    with pytest.raises(ValueError, match="follow is 1, expected true or false"):
        yes_or_no("follow", 1)


def test_one_of_names_the_choices():
    assert one_of("plan", "hold", ("hold", "script")) == "hold"
    with pytest.raises(ValueError, match="plan is 'fly', expected 'hold' or 'script'"):
        one_of("plan", "fly", ("hold", "script"))


def test_a_shape_and_a_kind_are_expected():
    check_shape("captured", np.zeros(3, bool), (3,), bool)
    with pytest.raises(ValueError, match=r"captured has shape \(3,\) of float64, .*\(3,\) of bool"):
        check_shape("captured", np.zeros(3), (3,), bool)
