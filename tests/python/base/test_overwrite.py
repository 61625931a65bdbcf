"""One rule for all commands: what is there is replaced with --overwrite alone."""

import pytest
from command_line import every_command, run_here

import energymargin as em
from energymargin.records.store.export import curves_path

OWN = "a user's own"
GOES_ON = {"score"}  # it adds to a file of scores, and refuses any other


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    """A folder with a dataset, its scores, and its probabilities, which have curves."""
    folder = tmp_path_factory.mktemp("scored")
    dataset = em.datasets.generate("topple", trajectories=3, frames=3, seed=0)
    dataset.save(folder / "topple.h5")
    em.store.score_dataset(dataset, folder / "s.db", nodes=2)
    future = em.datasets.Future(1)
    em.store.score_dataset(dataset, folder / "curves.db", ["probability"], future=future)
    problem = dataset.problems([0], future=future)[0]
    for name in ("a", "b"):
        problem.save(folder / f"{name}.json")
    return folder


def options():
    """The arguments and options of all commands, by name."""
    return {
        name: list(one.assemble_argument_collection(parse_docstring=True))
        for name, one in every_command().items()
    }


def test_every_command_that_writes_a_file_has_overwrite():
    words = {
        name: {word for each in own for word in each.parameter.name}
        for name, own in options().items()
    }
    writing = {name for name, own in words.items() if own & {"--output", "--picture"}}
    assert {"export", "evaluate", "report", "view", "demo", "reproduce all"} <= writing
    assert {name for name in writing if "--overwrite" not in words[name]} == GOES_ON


def test_every_option_of_every_command_says_what_it_does():
    silent = {
        (name, each.name)
        for name, own in options().items()
        for each in own
        if each.parse and each.show and not each.parameter.help
    }
    assert not silent


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (["export", "s.db", "-o", "mine.csv"], "mine.csv"),
        (["export", "curves.db", "-o", "mine.csv"], "mine-curves.csv"),
        (["evaluate", "s.db", "--draws", 9, "-o", "new.csv", "-o", "mine.md"], "mine.md"),
        (["report", "s.db", "--pictures", 0, "--draws", 9], "s.html"),
        (["report", "s.db", "--pictures", 0, "--draws", 9, "-o", "mine.html"], "mine.html"),
        (["rank", "a.json", "b.json", "--rollouts", 8, "-o", "mine.csv"], "mine.csv"),
        (["generate", "topple", "--trajectories", 1, "-o", "mine.h5"], "mine.h5"),
        (
            *(["generate", "topple", "--trajectories", 1, "-o", "t.h5", "--picture", "mine.png"],),
            "mine.png",
        ),
    ],
)
def test_a_file_that_is_there_stays_without_overwrite_and_is_replaced_with_it(scored, words, file):
    path = scored / file
    path.write_text(OWN)
    before = {path.name for path in scored.iterdir()}
    refused = run_here(*words, cwd=scored)
    assert refused.returncode == 2 and f"{file} exists" in refused.stderr
    assert "give --overwrite" in refused.stderr
    assert path.read_text() == OWN and {path.name for path in scored.iterdir()} == before
    done = run_here(*words, "--overwrite", cwd=scored)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() != OWN.encode()
    for new in scored.glob("mine*"):
        new.unlink()


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["export", "s.db", "-o"], "mine.csv"),
        (["evaluate", "s.db", "-o"], "mine.csv"),
        (["report", "s.db", "-o"], "mine.html"),
        (["rank", "a.json", "b.json", "--rollouts", 10**9, "-o"], "mine.csv"),
        (["generate", "topple", "--trajectories", 10**6, "-o"], "mine.h5"),
        (["generate", "topple", "--trajectories", 10**6, "-o", "new.h5", "--picture"], "mine.png"),
        (["learn", "s.db", "-o"], "mine.npz"),
        (["view", "push", "--nodes", 10**9, "-o"], "mine.png"),
        (["score", "topple.h5", "--nodes", 10**9, "-o"], "mine.db"),
        (["grasps", "g.csv", "--hand", "panda", "-o"], "mine.db"),
        (["grasps", "g.csv", "--hand", "panda", "-o"], "mine.html"),
        (["grasps", "g.csv", "--hand", "panda", "--write"], "mine.csv"),
        (["demo", "--trajectories", 10**6, "-o"], "mine"),
        (["reproduce", "contact", "-o"], "mine"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_anything_is_computed(scored, words, name):
    places = [f"/proc/{name}"]  # where nobody can make a file
    if words[0] not in ("demo", "reproduce"):  # they write folders
        places += ["folder.of/" + name]
        (scored / places[1]).mkdir(parents=True, exist_ok=True)
    before = sorted(scored.rglob("*"))
    for place in places:
        refused = run_here(*words, place, cwd=scored)
        assert refused.returncode == 2 and name in refused.stderr, refused.stderr
        assert len(refused.stderr.splitlines()) <= 3 and "Traceback" not in refused.stderr
    assert sorted(scored.rglob("*")) == before


def test_a_picture_of_the_viewer_is_refused_before_anything_is_searched(tmp_path):
    (tmp_path / "mine.png").write_text(OWN)
    refused = run_here("view", "push", "--nodes", 10**9, "-o", "mine.png", cwd=tmp_path)
    assert refused.returncode == 2 and "mine.png exists" in refused.stderr
    assert (tmp_path / "mine.png").read_text() == OWN


@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]])
def test_an_export_never_deletes_what_lies_beside_its_file(scored, tmp_path, overwrite):
    beside = curves_path(tmp_path / "mine.csv")
    beside.write_text(OWN)
    done = run_here("export", scored / "s.db", "-o", tmp_path / "mine.csv", *overwrite, cwd=scored)
    assert done.returncode == 0 and beside.read_text() == OWN
    said = " ".join(done.stderr.split())
    assert "mine-curves.csv is not of these scores" in said


@pytest.mark.parametrize(
    "words",
    [
        ["demo", "--trajectories", 4, "--nodes", 3],
        ["reproduce", "contact", "--percent", 1],
    ],
)
def test_a_folder_with_files_of_others_is_left_alone_without_overwrite(tmp_path, words):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "folder").mkdir()  # a command replaces files alone
    (folder / "table.md").write_text(OWN)
    refused = run_here(*words, "-o", "mine", cwd=tmp_path)
    assert refused.returncode == 2 and "mine has files of others" in refused.stderr
    assert {path.name for path in folder.iterdir()} == {"folder", "table.md"}
    assert (folder / "table.md").read_text() == OWN
    done = run_here(*words, "-o", "mine", "--overwrite", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    again = run_here(*words, "-o", "mine", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert ".energymargin" not in done.stderr and (folder / ".energymargin").exists()


def test_a_folder_of_folders_is_taken(tmp_path):
    (tmp_path / "out" / "table1").mkdir(parents=True)
    done = run_here("reproduce", "contact", "--percent", 1, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_folder_is_no_file_with_overwrite_either(scored, tmp_path):
    (tmp_path / "mine.csv").mkdir()
    words = ("export", scored / "s.db", "-o", "mine.csv", "--overwrite")
    refused = run_here(*words, cwd=tmp_path)
    assert refused.returncode == 2 and "mine.csv is a folder: choose another -o" in refused.stderr
