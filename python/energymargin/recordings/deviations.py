"""How well a smoothing spline knows the values and the rates that it gives.

A cubic smoothing spline is the mean of a belief: that of a value whose acceleration is white noise,
seen with errors (Wahba, Improper priors, spline smoothing and the problem of guarding against model
errors in regression, 1978). The variances of that belief are those of two Kalman filters, forward
and back (Fraser and Potter, 1969); how large the errors are, the spline's residuals tell. So a
frame that was filled, or that is near an end, is known less well than one amid others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["error_variance", "unit_variances"]

Matrix = NDArray[np.float64]


def unit_variances(
    moments: NDArray[np.float64], at: NDArray[np.float64], scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Variances of the spline's value and rate at the K times `at`, each (K,), and of its value at
    the N rising `moments` of the measurements, (N,), for errors of variance 1.

    Times and the spline's time scale are in steps; shape (K, 2) and (N,).
    """
    times = np.union1d(moments, at)
    seen = np.isin(times, moments)
    smooth = _smoothed(times, seen, scale**-4)
    return smooth[np.searchsorted(times, at)], smooth[seen, 0]


def error_variance(residuals: NDArray[np.float64], unit: NDArray[np.float64]) -> float:
    """Of the measurements, from the spline's residuals at them, shape (N,), and its variances there
    for errors of variance 1: their sum is the number of the spline's parameters."""
    return float((residuals**2).sum() / (len(residuals) - unit.sum()))


def _smoothed(times: NDArray[np.float64], seen: NDArray[np.bool_], noise: float) -> Matrix:
    """Variances of value and rate at each time, (T, 2), of a white acceleration of this density.

    What is known from before and what from behind are added up, as inverses of covariances: at the
    ends one of them is nothing.
    """
    steps = np.diff(times)
    look = np.diag([1.0, 0.0])  # at the value, with an error of variance 1
    looks = [look if one else np.zeros((2, 2)) for one in seen]
    forward = [looks[0]]
    for step, own in zip(steps, looks[1:], strict=True):
        forward.append(_ahead(forward[-1], step, noise) + own)
    behind = [np.zeros((2, 2))]
    for step, own in zip(steps[::-1], looks[:0:-1], strict=True):
        behind.append(_back(behind[-1] + own, step, noise))
    both = np.array(forward) + np.array(behind[::-1])
    return np.asarray(np.diagonal(np.linalg.inv(both), axis1=1, axis2=2))


def _ahead(known: Matrix, step: float, noise: float) -> Matrix:
    """What was known, as the inverse of a covariance, after a step of a white acceleration."""
    back = np.array([[1.0, -step], [0.0, 1.0]])
    moved = back.T @ known @ back
    return np.asarray(np.linalg.solve(np.eye(2) + moved @ _added(step, noise), moved))


def _back(known: Matrix, step: float, noise: float) -> Matrix:
    """The same before the step."""
    ahead = np.array([[1.0, step], [0.0, 1.0]])
    return np.asarray(
        ahead.T @ np.linalg.solve(np.eye(2) + known @ _added(step, noise), known) @ ahead
    )


def _added(step: float, noise: float) -> Matrix:
    """The covariance that a white acceleration adds in a step."""
    return noise * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
