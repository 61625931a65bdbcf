"""The energy audit of a rollout, and its measurement on the tasks."""

import csv
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin.experiments import audit as experiment

WORKS = experiment.ENTRIES


def sliding_block() -> tuple[em.World, np.ndarray]:
    scene = em.Scene()
    scene.add_plane("table", friction=1.0)
    scene.add_body(
        "block", em.Box((0.2, 0.2, 0.05)), mass=2.0, position=(0, 0, 0.025), role="object"
    )
    return em.World(scene), scene.pack(block={"velocity": (1.0, 0, 0)})


def test_there_is_no_audit_unless_it_is_asked_for_and_it_changes_no_bit():
    world, state = sliding_block()
    plain = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3)
    audited = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3, audit=True)
    assert plain.audit is None
    assert audited.audit is not None
    assert plain.state.tobytes() == audited.state.tobytes()
    assert (plain.effort, plain.work, plain.energy) == (
        audited.effort,
        audited.work,
        audited.energy,
    )


def test_the_entries_add_up_and_are_those_of_the_rollout():
    world, state = sliding_block()
    rollout = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3, audit=True)
    audit = rollout.audit
    assert audit.energy_change == rollout.energy - world.energy(state)
    assert audit.wrench == rollout.work
    works = [getattr(audit, name) for name in WORKS]
    assert sum(works) + audit.leftover == pytest.approx(audit.energy_change, abs=1e-14)
    assert audit.turnover == pytest.approx(abs(audit.energy_change) + np.abs(works).sum())
    assert audit.friction < -0.5


def test_the_repr_is_the_balance_as_a_table():
    world, state = sliding_block()
    audit = world.rollout(state, np.zeros(6), 1.0, audit=True).audit
    rows = [line.split() for line in repr(audit).splitlines()]
    assert [row[0] for row in rows] == [*WORKS, "leftover", "energy_change"]
    for name, value, unit in rows:
        assert float(value) == pytest.approx(getattr(audit, name), rel=1e-6)
        assert unit == "J"


# Bounds of docs/energy_audit.md.
@pytest.mark.parametrize("task", experiment.TASKS)
def test_little_is_left_over_on_the_tasks(task: str):
    audits = experiment.reproduce(5, names=[task], trajectories=2)
    shares = [row.share("leftover") for row in audits.of(task, *experiment.SETTINGS[0])]
    assert len(shares) == 5
    assert np.median(shares) < 0.002
    assert max(shares) < 0.03
    assert min(row.audit.turnover for row in audits.rows) > 0.0


def test_the_command_writes_a_table_and_every_rollout(tmp_path: Path):
    command = ["reproduce", "audit", "--tasks", "push", "--rollouts", "2", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "audit.md").read_text().count("| push |") == len(experiment.SETTINGS)
    rows = list(csv.DictReader((tmp_path / "audit.csv").open()))
    assert len(rows) == 2 * len(experiment.SETTINGS)
    for row in rows:
        balance = sum(float(row[name]) for name in (*WORKS, "leftover"))
        assert balance == pytest.approx(float(row["energy_change"]), abs=1e-12)
        assert float(row["friction"]) < 0


def test_the_command_names_an_unknown_task(tmp_path: Path):
    command = ["reproduce", "audit", "--tasks", "juggle", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    assert "juggle" in result.output
