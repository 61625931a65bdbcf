import warnings

import pytest

from energymargin.deprecations import REMOVED_IN, moved_names, once_positional


@once_positional("nodes", "seed", after=1)
def search(problem, *, nodes=1000, seed=0):
    return problem, nodes, seed


def test_an_old_name_gives_the_new_thing_and_says_where_it_is():
    old = moved_names("energymargin", {"loads": "json.decoder.JSONDecoder"})
    with pytest.warns(DeprecationWarning) as warned:
        assert old("loads").__name__ == "JSONDecoder"
    text = f"energymargin.loads is deprecated and goes in energymargin {REMOVED_IN}: use json.deco"
    assert str(warned[0].message).startswith(text)


def test_a_name_that_never_was_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'energymargin' has no attribute 'dumps'"):
        moved_names("energymargin", {})("dumps")


def test_arguments_by_position_get_their_names_and_the_warning_is_of_the_users_line():
    with pytest.warns(DeprecationWarning, match="search with nodes, seed by position") as warned:
        assert search("problem", 10, 3) == ("problem", 10, 3)
    assert warned[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="use nodes=...$"):
        assert search("problem", 10, seed=3) == ("problem", 10, 3)


def test_arguments_by_name_do_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert search("problem", nodes=10) == ("problem", 10, 0)


def test_too_many_arguments_and_one_given_twice_are_the_functions_own_errors():
    with pytest.raises(TypeError, match="takes 1 positional argument but 4 were given"):
        search("problem", 10, 3, 4)
    with pytest.warns(DeprecationWarning), pytest.raises(TypeError, match="multiple values"):
        search("problem", 10, nodes=3)
