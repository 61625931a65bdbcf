"""The JSON Schema of problem files, against another validator than the library's own."""

import copy
import json
from pathlib import Path

import jsonschema
import jsonschema_rs
import pytest
from made_tasks import MADE
from problem_files import at_path, full_problem, planned_problem, run

import energymargin as em

CORE = Path(__file__).parents[3] / "cpp/src"
SCHEMA = jsonschema_rs.Draft7Validator(em.Problem.schema())  # quick


@pytest.fixture(scope="module")
def problem():
    return full_problem()


def test_the_schema_is_the_one_that_is_shipped_and_a_valid_one():
    jsonschema.Draft7Validator.check_schema(em.Problem.schema())
    shipped = (CORE / "problem_io/problem.schema.json").read_text()
    assert json.loads(shipped) == em.Problem.schema()
    assert run("--schema").stdout == shipped


def test_the_schema_says_what_each_value_is():
    def nodes(schema):
        yield schema
        for key in ("properties", "definitions"):
            for part in schema.get(key, {}).values():
                yield from nodes(part)

    definitions = em.Problem.schema()["definitions"]
    for node in nodes(em.Problem.schema()):
        for name, part in node.get("properties", {}).items():
            meant = definitions.get(part.get("$ref", "").rpartition("/")[2], {})
            assert "const" in part or "description" in part | meant, (node["title"], name)


@pytest.mark.parametrize("name", MADE)
def test_the_problem_of_every_task_fits_the_schema(name):
    task = em.tasks.make(name)
    trajectory = task.rollout(0)
    made = task.problem(trajectory.states[0], params=trajectory.params)
    SCHEMA.validate(json.loads(made.to_json()))


def test_everything_that_a_file_can_hold_fits_the_schema(problem, tmp_path):
    SCHEMA.validate(json.loads(problem.to_json()))
    SCHEMA.validate(json.loads(planned_problem().to_json()))
    problem.save(tmp_path / "p.json", meshes="files")
    SCHEMA.validate(json.loads((tmp_path / "p.json").read_text()))


def places(json_value, at=(), kind=""):
    """(path, kind) of each value; two of a kind have the same keys on the way to them."""
    yield at, kind
    if isinstance(json_value, dict):
        for key, value in json_value.items():
            yield from places(value, (*at, key), f"{kind}:{json_value.get('type')}/{key}")
    if isinstance(json_value, list):
        for index, value in enumerate(json_value):
            yield from places(value, (*at, index), f"{kind}[]")


def spoiled(given):
    """The file, with one value of each kind replaced by one of another type, or a key added."""
    one_of_a_kind = {kind: path for path, kind in places(given)}
    for path in one_of_a_kind.values():
        own = at_path(given, path)
        if isinstance(own, dict):
            changed = copy.deepcopy(given)
            at_path(changed, path)["colour"] = "red"
            yield path, changed
        if path:
            changed = copy.deepcopy(given)
            at_path(changed, path[:-1])[path[-1]] = 7 if isinstance(own, dict | list) else {}
            yield path, changed


def test_the_reader_refuses_what_the_schema_refuses_and_has_the_better_words():
    for path, changed in spoiled(json.loads(planned_problem().to_json())):
        assert not SCHEMA.is_valid(changed), path
        with pytest.raises(ValueError, match=r"expected") as refused:
            em.Problem.from_json(json.dumps(changed))
        assert "does not fit the schema" not in str(refused.value), path


@pytest.mark.parametrize("value", [-1, 0, "-inf", ""])
def test_the_reader_alone_refuses_each_value_that_the_schema_refuses(problem, value):
    refused = 0
    for given in (problem, planned_problem()):
        file = json.loads(given.to_json())
        for path in {kind: path for path, kind in places(file) if path}.values():
            changed = copy.deepcopy(file)
            at_path(changed, path[:-1])[path[-1]] = value
            if SCHEMA.is_valid(changed):
                continue
            refused += 1
            with pytest.raises(ValueError, match=r"expected|no problem file"):
                em.Problem.from_json(json.dumps(changed))
    assert refused > 100


@pytest.mark.parametrize("key", ["horizon", "check", "dwell", "plan"])
def test_an_older_version_with_a_clock_is_refused_by_schema_and_reader(key):
    fields = json.loads(planned_problem().to_json())
    for other in {"horizon", "check", "dwell", "plan"} - {key}:
        del fields[other]
    for other in ("friction_rule", "pair_frictions"):
        del fields["scene"][other]
    SCHEMA.validate(fields)
    older = {**fields, "version": 3}
    assert not SCHEMA.is_valid(older)
    with pytest.raises(ValueError, match=f'problem has "{key}", expected only from "version"'):
        em.Problem.from_json(json.dumps(older))


@pytest.mark.parametrize("key", ["friction_rule", "pair_frictions"])
def test_an_older_version_with_a_friction_rule_is_refused_by_schema_and_reader(problem, key):
    fields = json.loads(problem.to_json())
    for other in {"friction_rule", "pair_frictions"} - {key}:
        del fields["scene"][other]
    SCHEMA.validate(fields)
    for version in (3, 4):
        older = {**fields, "version": version}
        assert not SCHEMA.is_valid(older)
        with pytest.raises(ValueError, match=f'scene has "{key}", expected only from "version": 5'):
            em.Problem.from_json(json.dumps(older))
