"""The study of two engines goes on where it was stopped, and counts what it says."""

import json

from command_line import invoke

from energymargin_paper.evidence.engines import STUDY, Engines, Settings, ratios
from energymargin_paper.evidence.engines_states import Both, Escape, Job, Label, Probability

SMALL = ("--tasks", "topple", "--trajectories", "2", "--nodes", "40", "--rollouts", "2")
FAST = ("--parts", "1", "--threads", "1")


def test_the_command_writes_its_tables_and_goes_on_from_its_runs(tmp_path):
    command = ["reproduce", "engines", *SMALL, *FAST, "-o", str(tmp_path)]
    first = invoke(command)
    assert first.exit_code == 0, first.output
    table, runs = (tmp_path / "engines.md").read_text(), tmp_path / "runs.jsonl"
    lines = runs.read_text().splitlines(keepends=True)
    assert len(lines) == 2
    runs.write_text(lines[0])
    assert invoke(command).exit_code == 0
    assert (tmp_path / "engines.md").read_text() == table
    assert runs.read_text().splitlines(keepends=True) == lines
    assert (tmp_path / "engines.png").stat().st_size > 10_000
    labels = json.loads(lines[0])[1]["labels"]
    assert sum(one["captured"] == one["captured_there"] for one in labels) >= 8


def test_the_tables_count_misses_too():
    labels = [Label(0, True, True, False, 0.001), Label(1, True, False, False, 0.1)]
    escapes = [
        Escape(0, "script", 0.5, True, 0.6, 1.0, 0.1, 0.01),
        Escape(1, "script", 0.5, False, None, 1.1, 0.1, 0.01),
        Escape(2, "script", 0.5, False, None, None, 0.1, 0.01),
        Escape(3, "script", 0.0, True, 0.0, 1.0, 0.1, 0.01),
        Escape(4, "script", None, False, None, None, 0.0, 0.0),
    ]
    states = [Probability(0, 1.0, 0.5, 0.5), Probability(1, 0.0, 0.0, 1.0)]
    job = Job("0", "push", 0, 1, 2, 0.6, 4)
    found = Engines(
        Settings(tasks=("push",), trajectories=1),
        {job: Both(True, False, labels, escapes, states)},
    )
    assert ratios(escapes) == [1.2]
    text = found.to_markdown()
    assert "| push | 2 | 1 | 2, 1 | 0 | 0 of 1 |" in text
    assert "| push | script | 5 | 1 | 1 | 1 | 3 | 1 | 1 | 1 | 1.200 |" in text
    assert "| push | 2 | 0.500 | 0.250 | 0.250 | 0.500 | 1 | 0.500 | 1.000 | 0.750 |" in text
    assert STUDY.quick.trajectories < STUDY.settings.trajectories
