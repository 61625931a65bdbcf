"""The answers here are computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from energymargin_paper.evidence.calibration import brier, calibration_error, reliability


def test_a_bin_has_the_mean_probability_and_the_share_of_what_happened() -> None:
    p = np.array([0.1, 0.9, 0.2, 0.8])
    found = reliability(p, np.array([0.0, 1.0, 1.0, 1.0]), bins=2)
    assert found.predicted == pytest.approx([0.15, 0.85])
    assert found.happened == pytest.approx([0.5, 1.0])
    assert found.size.tolist() == [2, 2]
    assert calibration_error(p, np.array([0.0, 1.0, 1.0, 1.0]), bins=2) == pytest.approx(0.25)


def test_equal_probabilities_share_a_bin() -> None:
    p = np.array([1.0] * 8 + [0.0] * 2)
    happened = np.array([1.0] * 4 + [0.0] * 6)
    found = reliability(p, happened)
    assert found.predicted.tolist() == [0.0, 1.0] and found.happened.tolist() == [0.0, 0.5]
    assert calibration_error(p, happened) == pytest.approx(0.4)


def test_draws_with_the_stated_probability_are_calibrated() -> None:
    random = np.random.default_rng(0)
    p = random.uniform(size=20_000)
    happened = (random.uniform(size=len(p)) < p).astype(float)
    assert calibration_error(p, happened) < 0.02
    assert calibration_error(np.sqrt(p), happened) > 0.1
    assert brier(p, happened) == pytest.approx(1 / 6, abs=0.005)  # the mean of p (1 - p)


def test_ten_bins_have_about_equal_mass() -> None:
    p = np.random.default_rng(1).uniform(size=1000)
    assert (np.abs(reliability(p, p).size - 100) <= 1).all()
