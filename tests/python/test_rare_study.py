"""The study of rare losses: its tables, its picture, and that it goes on from what it has."""

from pathlib import Path

import pytest
from command_line import invoke

from energymargin_paper.evidence import rare

SMALL = rare.Settings(replicas=40, runs=2)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[rare.Rare, Path]:
    folder = tmp_path_factory.mktemp("rare")
    return rare.STUDY.reproduce(SMALL, folder), folder


def test_the_known_losses_are_those_that_the_table_promises(
    made: tuple[rare.Rare, Path],
) -> None:
    for case, size in zip(made[0].cases, 2 * (1e-3, 1e-5, 1e-6), strict=True):
        assert size / 2 < case.known < 2 * size
        assert len(case.losses) == 2


def test_the_weaker_the_noise_the_nearer_is_the_exponent_to_the_effort(
    made: tuple[rare.Rare, Path],
) -> None:
    """The slope of -log p over effort / T, between the two weakest noises: nearly 1."""
    for name in rare.DAMPINGS:
        second, last = [case for case in made[0].weaker if case.name == name][-2:]
        rise = rare.exponent(last) - rare.exponent(second)
        way = last.well.effort * (1 / last.well.temperature - 1 / second.well.temperature)
        assert rise / way == pytest.approx(1.0, abs=0.15)


def test_it_goes_on_with_the_runs_that_it_has(made: tuple[rare.Rare, Path]) -> None:
    result, folder = made
    before = (folder / rare.RUNS_FILE).read_text()
    again = rare.STUDY.reproduce(SMALL, folder)
    assert (folder / rare.RUNS_FILE).read_text() == before
    assert again.to_csv() == result.to_csv() == (folder / "rare.csv").read_text()


def test_the_picture_shows_it(made: tuple[rare.Rare, Path]) -> None:
    result, folder = made
    rare.figure_rare(result).savefig(folder / "rare.png", dpi=50)
    assert (folder / "rare.png").stat().st_size > 10_000


def test_bad_settings_are_refused(tmp_path: Path) -> None:
    result = invoke(["reproduce", "rare", "--replicas", "39", "-o", str(tmp_path)])
    assert result.exit_code != 0
    assert "replicas" in result.output
