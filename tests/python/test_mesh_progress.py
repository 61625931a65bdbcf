"""How far a decomposition is: for Python, and as a bar that commands draw."""

import io

import pytest
from mesh_files import angle, bars, written
from rich.console import Console
from urdf_files import INERTIAL, built, chain, joint, link

import energymargin as em
from energymargin.bars import bar, bars_by
from energymargin.cli import application
from energymargin.cli.progress import inner_bar, progress_bar
from energymargin.meshes import mesh
from energymargin.meshes.progress import Tally, pieces

LOG = """ - Preprocess
 - Decomposition (MCTS)
iter 0 ---- waiting pool: 1
Processing [0.0%]
Processing [100.0%]
iter 1 ---- waiting pool: 4
Processing [50.0%]
Processing [25.0%]
"""


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "cache"))


class Reports(list):
    def __call__(self, done, total):
        self.append((done, total))

    def are_whole(self):
        """Counts never fall, and end where all is done."""
        counts = [done for done, _ in self]
        return counts == sorted(counts) and self[-1][0] == self[-1][1]


@pytest.mark.parametrize(
    ("log", "count"),
    [
        ("", (0, 1)),
        (" - Preprocess\n", (0, 1)),
        ("iter 0 ---- waiting pool: 1\nProcessing [0.0%]\n", (0, 2)),
        (LOG, (3, 6)),
        (LOG + "Processing [100.0%]\niter 2 ---- waiting pool: 2\n", (5, 8)),
        (LOG + "Processing [100.0%]\n - Merge Convex Hulls\n", (5, 6)),
        ("iter 0 ---- waiting pool: 1\nProcessing [0.0", (0, 2)),  # a line that is being written
    ],
)
def test_pieces_are_counted_as_far_as_the_log_of_coacd_goes(log, count):
    assert pieces(log) == count


def test_a_tally_adds_up_works_that_follow_one_another():
    reports = Reports()
    tally = Tally(reports, 3)
    first = tally.begin()
    first(0, 1)
    first(4, 4)
    tally.begin()  # one that has nothing to report
    last = tally.begin()
    last(1, 2)
    last(2, 2)
    assert reports == [(0, 3), (4, 6), (6, 7), (7, 7)]


@pytest.mark.usefixtures("own_cache")
def test_a_decomposition_reports_its_pieces_and_one_from_the_cache_that_it_is_there(tmp_path):
    file, reports = angle(tmp_path), Reports()
    mesh(file, progress=reports)
    assert reports.are_whole() and reports[-1][1] >= 3  # coacd's log is understood
    again = Reports()
    mesh(file, progress=again)
    assert again == [(1, 1)]


@pytest.mark.usefixtures("own_cache")
def test_two_solids_in_a_file_are_one_count(tmp_path):
    far = bars()
    far.apply_translation((1, 0, 0))
    reports = Reports()
    mesh(written(tmp_path, bars() + far), progress=reports)
    assert reports.are_whole() and reports[-1][1] >= 5


@pytest.mark.usefixtures("own_cache")
def test_meshes_of_a_robot_are_one_count(tmp_path):
    angle(tmp_path)
    shape = '<collision><geometry><mesh filename="solid.stl"/></geometry></collision>'
    mesh_link = INERTIAL + shape.replace("solid", "angle")
    text = chain(joint("ab", "a", "b"), joint("bc", "b", "c"), links="a").replace(
        "</robot>", link("b", mesh_link) + link("c", mesh_link) + "</robot>"
    )
    reports = Reports()
    scene = built(tmp_path, text, progress=reports, inertia="shapes", self_collision=False)
    assert len(scene.bodies[2].shape.parts) >= 2
    assert reports.are_whole()
    assert reports[0][1] >= 2  # the other one has not begun


@pytest.mark.usefixtures("own_cache")
def test_what_a_progress_raises_ends_the_decomposition(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh(angle(tmp_path), progress=stop)
    assert not (tmp_path / "cache").exists()


@pytest.mark.usefixtures("own_cache")
def test_within_another_bar_it_is_a_row_until_its_end(tmp_path):
    file, text = angle(tmp_path), io.StringIO()
    console = Console(file=text, force_terminal=True, width=100)
    with (
        bars_by(lambda title, unit: inner_bar(console, title, unit)),
        progress_bar(console, "Reading", "files") as update,
    ):
        update(0, 1)
        mesh(file)
        update(1, 1)
    drawn = text.getvalue()
    assert "Decomposing angle.stl" in drawn
    assert drawn.rindex("Reading") > drawn.rindex("Decomposing angle.stl")


def test_without_a_command_nothing_is_drawn():
    with bar("Decomposing", "pieces") as update:
        assert update is None


@pytest.mark.usefixtures("own_cache")
def test_a_command_draws_a_bar_for_a_mesh_that_is_decomposed_and_for_no_other(
    tmp_path, monkeypatch
):
    text, file = io.StringIO(), angle(tmp_path)
    monkeypatch.setattr(application, "err", Console(file=text, force_terminal=True, width=100))

    @application.app.command("angle", hidden=True)
    def command() -> None:
        em.mesh(file)

    try:
        for drawn in (True, False):
            text.truncate(0)
            with pytest.raises(SystemExit):
                application.app(["angle"])
            assert ("Decomposing angle.stl" in text.getvalue()) == drawn
    finally:
        application.app.registered_commands.pop()
