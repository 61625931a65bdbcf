"""A task that a program makes known to its own process alone."""

import pytest
from stores import rows

import energymargin as em
from energymargin.tasks.registry import overview
from energymargin.tasks.topple import ToppleTask


@em.tasks.register
class Gentle(ToppleTask):
    """A box that is pushed by a program of ours."""

    name = "gentle"


def test_its_dataset_is_scored_viewed_and_reported(tmp_path):
    report = pytest.importorskip("energymargin.report")
    viewer = pytest.importorskip("energymargin.viewer")
    task = em.tasks.make("gentle", friction=0.4)
    path, scores = tmp_path / "gentle.h5", tmp_path / "gentle-scores.db"
    with em.datasets.generate(task, path=path, trajectories=2, frames=3) as made:
        assert (made.task, made.parameters["friction"]) == ("gentle", 0.4)
    assert em.store.score_dataset(path, scores, ["capture", "force"], nodes=10, seed=3)
    assert rows(scores, "scores") == 2 * 6

    report.write(scores, tmp_path / "gentle.html", options=report.Options(draws=9, pictures=1))
    assert "gentle" in (tmp_path / "gentle.html").read_text()
    (seen,) = viewer.view(path, trajectory=1, frame=2, scores=scores).scored
    problem = em.datasets.load(path).problems([5])[0]
    direct = em.capture_score(problem, nodes=10, seed=em.stream(3, 5))
    assert seen.capture.capture == direct.capture


def test_it_is_listed_as_of_this_process_and_made_by_workers_of_no_other(tmp_path):
    (entry,) = (entry for entry in overview() if entry.name == "gentle")
    assert entry.summary.startswith("A box") and entry.note == "of this process"
    with pytest.raises(ValueError, match=r"processes is 2, .*'gentle'.* or use processes=1"):
        em.datasets.generate("gentle", trajectories=4, frames=2, processes=2)


def test_it_is_replaced_by_another_of_its_name_but_no_installed_one_is():
    class Other(Gentle):
        """Another."""

    assert em.tasks.register(Other) is Other
    assert type(em.tasks.make("gentle")) is Other
    em.tasks.register(Gentle)
    with pytest.raises(em.tasks.TaskError, match=r"energymargin has a task of that name; rename"):
        em.tasks.register(ToppleTask)


@pytest.mark.parametrize(
    ("strange", "message"),
    [
        (42, "constructor is 42, expected a task's class, with a `name`"),
        (type("Nameless", (), {}), "Nameless'>, expected a task's class, with a `name`"),
        (type("Idle", (), {"name": "idle"}), "task 'idle' of .* has no method 'rollout'"),
    ],
)
def test_what_is_no_task_is_refused(strange, message):
    with pytest.raises(em.tasks.TaskError, match=message):
        em.tasks.register(strange)
    assert "idle" not in em.tasks.names()
