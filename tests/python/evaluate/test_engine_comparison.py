"""What a comparison of engines says of its draws."""

import numpy as np

from energymargin.evaluate.engine_comparison import EngineComparison


def test_draws_that_diverged_in_an_engine_do_not_agree():
    exits = np.array([[np.inf, np.inf, 0.2], [np.nan, 0.1, 0.3], [np.inf, np.inf, np.inf]])
    found = EngineComparison(("a", "b", "c"), (), exits, np.zeros(1), np.zeros((3, 1)))
    assert found.agreement.tolist() == [1.0, 0.5, 1 - 1 / 3]
    assert found.differing().tolist() == [1] and found.differing(2).tolist() == [2]
