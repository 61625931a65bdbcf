import importlib
import pickle
import warnings

import pytest

import energymargin
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


@pytest.mark.parametrize(
    ("module", "name", "use"),
    [
        ("datasets", "generate_file", r"datasets\.generate\(task, path=\.\.\.\)"),
        ("datasets", "load_or_generate", r"datasets\.generation\.load_or_generate"),
        ("evaluation", "auc_ap", r"evaluation\.bootstrap\.auc_ap"),
        ("evaluation", "CSV_COLUMNS", r"evaluation\.table\.CSV_COLUMNS"),
        ("store", "begin_run", r"store\.scoring\.begin_run"),
        ("tasks", "overview", r"tasks\.registry\.overview"),
    ],
)
def test_names_that_are_no_longer_public_say_where_they_are(module, name, use):
    package = getattr(energymargin, module)
    assert name not in package.__all__
    with pytest.warns(DeprecationWarning, match=rf"energymargin\.{module}\.{name} is .*{use}$"):
        assert callable(getattr(package, name)) or name == "CSV_COLUMNS"


# What was public up to 0.10.
MOVED = {
    "datasets": "Label generate_file load_or_generate trajectories_kept",
    "evaluation": "ALL_TITLE AMONG ANY_TITLE CSV_COLUMNS DASH DRAWS FORCE HORIZON HORIZONS "
    "LAST_FRAMES PAPER PAPER_HORIZON SUCCESS SUCCESSES Compared auc_ap captured_labels "
    "compared_states compared_trajectories csv_fields paper_text ranked short state_metrics "
    "trajectory_score",
    "store": "begin_run curves_path dataset_metrics score_run",
    "tasks": "FrictionTask Registered drawn overview",
}


def test_the_curves_are_still_where_they_were():
    curves = importlib.import_module("energymargin.curves")
    with pytest.warns(DeprecationWarning, match=r"use energymargin\.evaluation\.curves\.roc"):
        assert curves.roc is importlib.import_module("energymargin.evaluation.curves").roc


@pytest.mark.parametrize(
    ("module", "names", "home"),
    [
        ("settings", "ALGORITHM ALGORITHM_IMPROVED SEARCHES algorithm", "scoring.settings"),
        ("settings", "SearchSettings", ""),
        ("scoring", "chosen_metrics require_objects", "scoring.problem_metrics"),
        ("scoring", "run_all", "scoring.batch"),
        ("tasks.base", "Drive FrictionTask ScriptedTask drawn", "tasks.scripted"),
        ("tasks.base", "Regions", "tasks.object_sets"),
    ],
)
def test_names_of_modules_that_moved_are_still_there(module, names, home):
    before = importlib.import_module(f"energymargin.{module}")
    now = importlib.import_module(f"energymargin.{home}".rstrip("."))
    for name in names.split():
        with pytest.warns(DeprecationWarning, match=rf"{module}\.{name} is .*\.{name}$"):
            assert getattr(before, name) is getattr(now, name)


@pytest.mark.parametrize("module", MOVED)
def test_every_name_that_moved_is_still_there(module):
    for name in MOVED[module].split():
        with pytest.warns(DeprecationWarning, match=rf"{module}\.{name} is deprecated"):
            assert getattr(getattr(energymargin, module), name) is not None


def test_a_mesh_with_a_capital_is_the_function_and_warns_of_the_users_line():
    with pytest.warns(
        DeprecationWarning, match=r"energymargin\.Mesh .*: use energymargin\.mesh"
    ) as w:
        assert energymargin.Mesh is energymargin.mesh
    assert w[0].filename == __file__


def problem():
    scene = energymargin.Scene()
    scene.add_plane("floor")
    shape, place = energymargin.Box((0.1, 0.1, 0.1)), (0, 0, 0.05)
    scene.add_body("box", shape, mass=0.2, position=place, role="object")
    return energymargin.Problem(
        scene,
        scene.pack(),
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.2,
        captured=energymargin.regions.Ball("box", place, 0.05),
    )


@pytest.mark.parametrize(
    ("name", "positions"),
    [
        ("capture_score", {"nodes": 20, "seed": 3, "rate": 2.0, "trees": 2, "threads": 2}),
        ("escape_effort", {"planner": "rrt", "nodes": 20, "seed": 3, "captured": "all"}),
        ("escape_energy", {"planner": "rrt*", "samples": 20, "seed": 3, "reach": None}),
    ],
)
def test_scores_take_by_position_what_they_took_and_warn(name, positions):
    search = getattr(energymargin, name)
    with pytest.warns(DeprecationWarning, match=f"{name} with {', '.join(positions)} by position"):
        late = search(problem(), *positions.values())
    assert repr(late) == repr(search(problem(), **positions))
    assert pickle.loads(pickle.dumps(search)) is search


def test_a_docstring_and_an_error_of_a_score_are_those_of_the_compiled_module():
    assert energymargin.capture_score.__doc__ == energymargin._core.capture_score.__doc__
    with pytest.raises(ValueError, match="nodes is 'a', expected a whole number"):
        energymargin.capture_score(problem(), nodes="a")


def test_a_run_of_a_store_is_given_by_name(tmp_path):
    load = energymargin.store.load
    with (
        pytest.warns(DeprecationWarning, match="load with run by position .*: use run=...$"),
        pytest.raises(FileNotFoundError),
    ):
        load(tmp_path / "none.db", 1)
    export = energymargin.store.export
    with (
        pytest.warns(DeprecationWarning, match="export with run by position .*: use run=...$"),
        pytest.raises(FileNotFoundError),
    ):
        export(tmp_path / "none.db", tmp_path / "scores.csv", 1)


def test_a_future_of_a_datasets_problems_is_given_by_name():
    dataset = energymargin.datasets.generate("push", trajectories=1, frames=2)
    with pytest.warns(DeprecationWarning, match="problems with future by position") as warned:
        (late,) = dataset.problems([0], energymargin.datasets.Future(1))
    assert warned[0].filename == __file__
    (by_name,) = dataset.problems([0], future=energymargin.datasets.Future(1))
    assert late.to_json() == by_name.to_json()
