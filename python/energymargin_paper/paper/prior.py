"""Velocities that are likely before any is measured: a prior, and its posterior with the errors.

A measurement with even errors lets a robot that goes ahead go aside as well, and a body at rest
move. Other motions of the same kind know better. Two normal distributions multiply in closed form;
all else is a weighting of the prior's velocities by how well the measurement fits them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Problem, Scene
from energymargin.base.checks import shown
from energymargin.base.errors import EnergyMarginError
from energymargin.beliefs import Belief
from energymargin.model.beliefs.uncertainty import (
    Source,
    covariance_root,
    is_covariance,
    is_distribution,
    standard_normal,
)

__all__ = ["ContradictionError", "InformedSource", "informed", "velocities"]

# Fewer samples say little of a distribution: then the errors count as larger.
LEAST_EFFECTIVE = 10.0
LARGER = 1.1
LARGEST = 3.0  # times the errors; beyond that prior and measurement contradict each other
FARTHEST = 6.0  # standard deviations; what is normal and farther away cannot be
DRAWN = 2**13  # samples of a normal prior, for errors that are not normal


class ContradictionError(EnergyMarginError, ValueError):
    """A measured velocity that its prior excludes: one of the two is wrong, or samples lack."""


@dataclass(frozen=True)
class InformedSource(Source):
    """The errors of a velocity, weighted by a prior's samples."""

    effective: float = 0.0
    """Number of samples of equal weight that say as much."""
    widened: float = 1.0
    """How many times larger the errors counted, since too few samples of the prior fit them."""


def velocities(scene: Scene, states: ArrayLike) -> dict[str, NDArray[np.float64]]:
    """Velocity [m/s] and angular velocity [rad/s], (K, 6), of each body that moves, in states of
    other motions, shape (K, n). It is a prior.

    Raises ValueError on states of another shape, or not finite.
    """
    size = len(scene.pack())
    values = np.asarray(states, dtype=float)
    if values.ndim != 2 or values.shape[1] != size or not np.isfinite(values).all():
        raise ValueError(f"states has shape {values.shape}, expected (K, {size}) of finite numbers")
    free = [body.name for body in scene.bodies if not body.fixed]
    places = {name: scene.slice(name).start for name in free if _has_velocity(scene, name)}
    return {name: values[:, start + 7 : start + 13] for name, start in places.items()}


def informed(belief: Belief, prior: Mapping[str, Any]) -> Belief:
    """A belief that also knows which velocities are likely before any is measured.

    `prior`: by names of bodies, samples of velocities, shape (N, 6), as `velocities` reads them
    from other motions, or a frozen `scipy.stats.multivariate_normal` of six. It is multiplied by
    the errors of the same body's velocity. Along axes without errors the measured velocity stays,
    and the prior does not count.

    Raises ValueError on another prior, and ContradictionError where a measured velocity contradicts
    it.
    """
    known = _checked(prior, belief.problem.scene, belief.sources)
    found = copy(belief)
    found.sources = [_with_prior(belief.problem, one, known) for one in belief.sources]
    return found


def _with_prior(problem: Problem, source: Source, prior: Mapping[str, Any]) -> Source:
    if source.quantity != "velocity" or source.body not in prior:
        return source
    measured = np.asarray(problem.state)[problem.scene.slice(source.body)][7:13]
    return _posterior(source, prior[source.body], measured)


def _posterior(source: Source, prior: Any, measured: NDArray[np.float64]) -> Source:
    """The source of the errors of a velocity that was measured, shape (6,), and its prior."""
    name = f"prior[{source.body!r}]"
    root = _normal_root(source.given)
    normal = _normal(name, prior)
    if normal is None:
        return _weighted(source, name, _samples(name, prior), measured)
    mean, covariance = normal
    if root is not None:
        return _product(source, name, root, mean - measured, covariance)
    return _weighted(source, name, _drawn(mean, covariance), measured)


def _product(
    source: Source,
    name: str,
    root: NDArray[np.float64],
    ahead: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> Source:
    """Source of a normal prior, its mean `ahead` of the measured velocity, and normal errors."""
    deviations = np.linalg.norm(root, axis=0)
    axes = root / deviations
    errors = np.diag(deviations**2)
    both = errors + axes.T @ covariance @ axes
    gain = np.linalg.solve(both, errors).T
    along = axes.T @ ahead
    _require_probable(name, float(np.sqrt(along @ np.linalg.solve(both, along))))
    variances, own = np.linalg.eigh(errors - gain @ errors)
    narrowed = axes @ own * np.sqrt(np.maximum(variances, 0.0))
    center = axes @ gain @ along

    def values(u: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(center + standard_normal(u) @ narrowed.T)

    inputs = tuple(f"axis {k + 1}" for k in range(len(variances)))
    return replace(source, inputs=inputs, values=values)


def _require_probable(name: str, distance: float) -> None:
    if distance > FARTHEST:
        raise ContradictionError(
            f"{name} and the measured velocity contradict each other: they are {distance:.3g} "
            "standard deviations apart, expected larger errors or a wider prior"
        )


def _weighted(
    source: Source, name: str, samples: NDArray[np.float64], measured: NDArray[np.float64]
) -> Source:
    """Source of samples, each as often as the measurement fits it. One input: their place in a row
    along the axis on which they differ most."""
    log_density, onto = _fit(source.given)
    errors = (samples - measured) @ onto
    widened, weights = 1.0, _weights(log_density(errors))
    while _effective(weights) < min(LEAST_EFFECTIVE, len(samples)):
        widened *= LARGER
        if widened > LARGEST:
            break
        weights = _weights(log_density(errors / widened))
    if not weights.any():
        raise ContradictionError(
            f"{name} and the measured velocity contradict each other: no sample is within "
            f"{LARGEST:g} times the errors, expected larger errors or other samples"
        )
    there = np.flatnonzero(weights)
    row = there[np.argsort(_along(errors[there], weights[there]), kind="stable")]
    ends = np.cumsum(weights[row])

    def values(u: NDArray[np.float64]) -> NDArray[np.float64]:
        place = np.searchsorted(ends, u[:, 0] * ends[-1], side="right")
        return np.asarray(errors[row[np.minimum(place, len(row) - 1)]])

    return InformedSource(
        source.quantity,
        source.body,
        inputs=("place among the prior's samples",),
        values=values,
        given=source.given,
        effective=_effective(weights),
        widened=min(widened, LARGEST),
    )


LogDensity = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def _normal_root(value: Any) -> NDArray[np.float64] | None:
    """Principal axes of normal errors of a pose or velocity, each as long as its deviation,
    (6, D). None of others."""
    if is_covariance(value):
        return covariance_root("covariance", value)
    if any(is_distribution(one) for one in value):
        return None
    deviations = np.array(value, dtype=float)
    return np.asarray(np.diag(deviations)[:, deviations > 0])


def _fit(given: Any) -> tuple[LogDensity, NDArray[np.float64]]:
    """The logarithm of the density of errors (N, 6), up to a constant, and the projection (6, 6)
    onto the axes that have errors."""
    root = _normal_root(given)
    if root is not None:
        deviations = np.linalg.norm(root, axis=0)
        axes = root / deviations
        return lambda e: _normal_logarithms(e @ axes / deviations).sum(axis=1), axes @ axes.T
    drawn = {k: one for k, one in enumerate(given) if is_distribution(one) or one > 0}

    def log_density(errors: NDArray[np.float64]) -> NDArray[np.float64]:
        logarithms = [
            one.logpdf(errors[:, k])
            if is_distribution(one)
            else _normal_logarithms(errors[:, k] / one)
            for k, one in drawn.items()
        ]
        return np.asarray(np.sum(logarithms, axis=0))

    return log_density, np.diag([float(k in drawn) for k in range(6)])


def _normal_logarithms(z: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.abs(z) > FARTHEST, -np.inf, -0.5 * z**2)


def _weights(logarithms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of which the largest is 1; all 0 where there is none."""
    most = logarithms.max()
    return np.exp(logarithms - most) if np.isfinite(most) else np.zeros(len(logarithms))


def _effective(weights: NDArray[np.float64]) -> float:
    """How many samples of one weight say as much (Kish)."""
    return float(weights.sum() ** 2 / (weights @ weights)) if weights.any() else 0.0


def _along(errors: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where each is on the first principal axis, shape (N,)."""
    centered = errors - np.average(errors, axis=0, weights=weights)
    _, axes = np.linalg.eigh((centered * weights[:, None]).T @ centered)
    return np.asarray(centered @ axes[:, -1])


def _normal(name: str, prior: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Mean and covariance; None of something else."""
    if not (hasattr(prior, "cov") and hasattr(prior, "rvs")):
        return None
    mean, covariance = np.asarray(prior.mean, dtype=float), np.asarray(prior.cov, dtype=float)
    if mean.shape != (6,):
        raise ValueError(f"{name} has a mean of shape {mean.shape}, expected (6,)")
    return mean, covariance


def _samples(name: str, prior: Any) -> NDArray[np.float64]:
    try:
        samples = np.asarray(prior, dtype=float)
    except (TypeError, ValueError):
        samples = np.zeros(0)
    if samples.ndim != 2 or samples.shape[1:] != (6,) or not np.isfinite(samples).all():
        raise ValueError(
            f"{name} is {shown(prior)}, expected velocities of shape (N, 6), or a frozen "
            "scipy.stats.multivariate_normal of six"
        )
    if len(samples) < 2:
        raise ValueError(f"{name} has {len(samples)} velocities, expected two at least")
    return samples


def _drawn(mean: NDArray[np.float64], covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quasi-random samples of a normal prior, (DRAWN, 6)."""
    from scipy.stats import qmc

    variances, axes = np.linalg.eigh(covariance)
    points = qmc.Sobol(6, scramble=True, seed=np.random.default_rng(0)).random(DRAWN)
    points = np.clip(points, 2.0**-31, 1 - 2.0**-31)
    deviations = np.sqrt(np.maximum(variances, 0.0))
    return np.asarray(mean + standard_normal(points) * deviations @ axes.T)


def _has_velocity(scene: Scene, body: str) -> bool:
    """Whether the state has one of this body, which a link's has not."""
    try:
        scene.slice(body)
    except ValueError:
        return False
    return True


def _checked(prior: Any, scene: Scene, sources: list[Source]) -> Mapping[str, Any]:
    """A prior by names of bodies. Raises ValueError on another, on bodies that the scene does not
    have, and if none of them has a velocity with errors."""
    bodies = [body.name for body in scene.bodies]
    if not isinstance(prior, Mapping) or not prior:
        raise ValueError(f"prior is {shown(prior)}, expected velocities by the names of bodies")
    for name in prior:
        if name not in bodies:
            raise ValueError(f"prior names {name!r}, expected one of {', '.join(bodies)}")
    if not any(s.quantity == "velocity" and s.body in prior for s in sources):
        raise ValueError(
            f"prior is of {', '.join(prior)}, expected a body whose velocity has errors"
        )
    return prior
