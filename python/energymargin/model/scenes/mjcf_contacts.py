"""Which geoms of a MuJoCo model collide, and with which coefficients of friction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Surface
from energymargin.base.aliases import Floats
from energymargin.model.scenes.mjcf_model import Features, Selection, disabled, word

DIMENSIONS = np.array([2, 4, 6])  # of contacts that slide, twist, roll with friction
SMALL = 2e-3  # m, of a margin; contacts of MuJoCo overlap by as much


Friction = tuple[float, float, float]
"""Coefficients of sliding, and [m] of torsional and of rolling friction."""


@dataclass(frozen=True)
class Group:
    """Geoms of one body that collide with the same others, equally rough."""

    body: int
    geoms: tuple[int, ...]
    friction: Friction

    def keywords(self) -> dict[str, Any]:
        """Those of `Scene.add_body` that say how rough it is."""
        slides, torsional, rolling = self.friction
        turns = Surface(torsional_friction=torsional, rolling_friction=rolling)
        return {"friction": slides} | ({"surface": turns} if torsional or rolling else {})


class Contacts:
    """What MuJoCo's rules say of the geoms of a selection that can collide at all."""

    def __init__(self, selection: Selection) -> None:
        """Counts geoms and contacts that are not simulated."""
        self._selection, self._model = selection, selection.model
        most = 3 if "geom.condim" in selection.features.ignored else DIMENSIONS[-1]
        self._dimensions = np.minimum(self._model.geom_condim, most)
        self._pair_dimensions = np.minimum(self._model.pair_dim, most)
        chosen = {body: selection.carrier[body] for body in selection.bodies}
        self.geoms = [g for g in self._colliding() if int(self._model.geom_bodyid[g]) in chosen]
        self._count(selection.features)
        self.geoms = [g for g in self.geoms if self._kind(g) not in ("hfield", "sdf")]
        self._index = {geom: i for i, geom in enumerate(self.geoms)}
        self._coefficients = self._table()
        self.groups = list(self._groups(chosen))

    def coefficients(self, a: Group, b: Group) -> Friction | None:
        """Those of the contacts of two groups; None where they do not collide."""
        values = self._coefficients[self._index[a.geoms[0]], self._index[b.geoms[0]]]
        return None if np.isnan(values[0]) else tuple(values.tolist())

    def is_plane(self, geom: int) -> bool:
        """Whether it is a half space."""
        return self._kind(geom) == "plane"

    def _kind(self, geom: int) -> str:
        return word("mjtGeom", self._model.geom_type[geom])

    def _colliding(self) -> list[int]:
        model = self._model
        paired = {int(g) for g in [*model.pair_geom1, *model.pair_geom2]}
        masks = model.geom_contype | model.geom_conaffinity
        return [g for g in range(model.ngeom) if masks[g] or g in paired]

    def _count(self, features: Features) -> None:
        model, own = self._model, np.asarray(self.geoms, int)
        kinds = [self._kind(geom) for geom in self.geoms]
        for kind in ("hfield", "sdf"):
            features.add(f"geom/{kind}", kinds.count(kind))
        lost = model.geom_condim[own] > self._dimensions[own]
        features.leave("geom.condim", int(np.sum(lost)))
        wide = model.geom_margin[own] > SMALL
        features.add("geom.margin", int(np.sum(wide)))
        features.leave("geom.margin", int(np.sum((model.geom_margin[own] > 0) & ~wide)))
        if getattr(model, "flg_adhesion", False) or getattr(model, "flg_surfacevel", False):
            features.add("geom.adhesion")
        for pair in self._pairs():
            both_ways = model.pair_friction[pair][[[0, 2, 3], [1, 2, 4]]]
            one, other = _rough(both_ways, self._pair_dimensions[pair])
            features.add("pair.friction", bool(np.any(one != other)))
            features.add("geom.margin", int(model.pair_margin[pair] > SMALL))
            features.leave("geom.margin", int(0 < model.pair_margin[pair] <= SMALL))

    def _pairs(self) -> list[int]:
        """Pairs that the model names one by one, of the selection."""
        own = set(self.geoms)
        ends = zip(self._model.pair_geom1, self._model.pair_geom2, strict=True)
        return [i for i, (a, b) in enumerate(ends) if int(a) in own and int(b) in own]

    def _table(self) -> Floats:
        """Coefficients by two geoms, symmetric; NaN where they do not collide."""
        model, own = self._model, np.asarray(self.geoms, int)
        table = np.full((own.size, own.size, 3), np.nan)
        if not own.size or disabled(model, "CONTACT"):
            return table
        meet = (model.geom_contype[own][:, None] & model.geom_conaffinity[own]) != 0
        meet = (meet | meet.T) & self._bodies_meet(own)
        table[meet] = self._mixed(own)[meet]
        for pair in self._pairs():
            a, b = (self._index[int(g[pair])] for g in (model.pair_geom1, model.pair_geom2))
            rough = _rough(model.pair_friction[pair][[0, 2, 3]], self._pair_dimensions[pair])
            table[a, b] = table[b, a] = rough
        bodies = [int(model.geom_bodyid[geom]) for geom in self.geoms]
        table[np.array([[self._selection.rigid(a, b) for b in bodies] for a in bodies])] = np.nan
        return table

    def _bodies_meet(self, own: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Neither welded together, nor parent and child, nor excluded."""
        model = self._model
        bodies = model.geom_bodyid[own]
        weld = model.body_weldid[bodies]
        above = model.body_weldid[model.body_parentid[weld]]
        world = 0 if self._selection.root is None else -1  # a subtree hangs on what may move
        meet: NDArray[np.bool_] = weld[:, None] != weld
        if not disabled(model, "FILTERPARENT"):
            parent = (weld[:, None] == above) & (weld[:, None] != world)
            meet &= ~(parent | parent.T)
        for signature in map(int, model.exclude_signature):
            pair = (bodies[:, None] == signature >> 16) & (bodies == signature & 0xFFFF)
            meet &= ~(pair | pair.T)
        return meet

    def _mixed(self, own: NDArray[np.int64]) -> Floats:
        """The larger coefficients of two geoms, or those of the higher priority."""
        priority = self._model.geom_priority[own]
        values = np.c_[self._model.geom_friction[own], self._dimensions[own]]
        one, other = np.broadcast_arrays(values[:, None], values)
        first, equal = (by(priority[:, None], priority)[..., None] for by in (np.greater, np.equal))
        chosen = np.where(equal, np.maximum(one, other), np.where(first, one, other))
        return _rough(chosen[..., :3], chosen[..., 3])

    def _groups(self, carriers: dict[int, int]) -> Iterator[Group]:
        """By body the largest group first; each plane is a group of its own."""
        model, alike = self._model, dict[tuple[Any, ...], list[int]]()
        for i, geom in enumerate(self.geoms):
            body = carriers[int(model.geom_bodyid[geom])]
            alone = geom if self.is_plane(geom) else -1
            friction = tuple(_rough(model.geom_friction[geom], self._dimensions[geom]).tolist())
            row = self._coefficients[i].tobytes()
            alike.setdefault((body, alone, friction, row), []).append(geom)
        order = sorted(alike.items(), key=lambda item: (item[0][0], -len(item[1]), item[1][0]))
        for (body, _, friction, _), geoms in order:
            yield Group(body, tuple(geoms), friction)


def _rough(friction: Any, dimensions: Any) -> Floats:
    """Sliding, torsional and rolling friction (..., 3), without those that contacts do not have."""
    return np.where(np.asarray(dimensions)[..., None] >= DIMENSIONS, friction, 0.0)
