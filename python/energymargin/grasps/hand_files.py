"""Hands of files: any URDF or MJCF, with the joints that close it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Scene
from energymargin.checks import numbers_of, positive_number
from energymargin.grasps.grasp_set import check_poses
from energymargin.grasps.hands import Fitted, Hand

XML_OF_MUJOCO = b"<mujoco"


@dataclass(frozen=True, eq=False)
class HandFile(Hand):
    """A hand of a URDF or MJCF file, moved by its root as a kinematic body.

    Args:
        path: of the file.
        close: by driven joint, or by tendon: where it is when the hand is open, and its target when
            the hand is closed [rad] or [m].
        fingers: links that touch a gripped object, all of them.
        frame: the grasp frame in the frame of the root, (4, 4): its origin is where the fingers
            meet, z is the approach, and they open along x.
        closing: time from open to closed [s].
        options: keywords of `em.scenes.from_urdf` or `from_mjcf`, as subtree and joints: drives of
            the joints of `close` that the file does not have.

    The hand opens as wide as `close` says; the openings of grasps do not count. Raises ValueError
    on what cannot be, and what the readers raise.
    """

    path: str | Path
    close: Mapping[str, tuple[float, float]]
    fingers: Sequence[str]
    frame: ArrayLike = field(default_factory=lambda: np.eye(4))
    closing: float = 1.0
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks all of it but for names, which the first scene does."""
        positive_number("closing", self.closing)
        check_poses("frame", self._frame[None], ["frame"])
        if not self.close:
            raise ValueError("close is empty, expected the joints that close the hand")
        for name, ends in self.close.items():
            numbers_of(f"close[{name!r}]", ends, "two finite numbers, open and closed", (2,))
        if not self.fingers or isinstance(self.fingers, str):
            raise ValueError(f"fingers is {self.fingers!r}, expected a list of links, one at least")

    @property
    def friction_rule(self) -> str:  # type: ignore[override]
        """As Hand.friction_rule."""
        return "max" if self._is_mjcf else "product"

    @property
    def force(self) -> float:
        """As Hand.force."""
        return 1.0

    def add_to(self, scene: Scene, *, force: float, opening: float) -> Fitted:
        """As Hand.add_to."""
        if force != 1.0:
            raise ValueError(
                f"force is {force:g}, expected that of the file's drives, 1: state another "
                "torque_limit of its joints in options"
            )
        before = len(scene.bodies)
        self._read(scene)
        bodies = scene.bodies[before:]
        names = [body.name for body in bodies]
        joints = {joint.name for joint in scene.joints}
        driven = joints | {tendon.name for tendon in scene.tendons}
        _require("fingers", self.fingers, names)
        _require("close", self.close, sorted(driven))
        base = next(body.name for body in bodies if body.kinematic)
        return Fitted(
            base=base,
            frame=self._frame,
            fingers=tuple(self.fingers),
            bodies=tuple(names),
            start={name: float(ends[0]) for name, ends in self.close.items() if name in joints},
            targets={name: (float(a), float(b)) for name, (a, b) in self.close.items()},
        )

    @property
    def text(self) -> dict[str, Any]:
        """As Hand.text."""
        return {
            "file": hashlib.sha256(Path(self.path).read_bytes()).hexdigest(),
            "close": {name: list(map(float, ends)) for name, ends in self.close.items()},
            "fingers": list(self.fingers),
            "frame": self._frame.tolist(),
            "closing": self.closing,
            "options": json.loads(json.dumps(dict(self.options), default=repr)),
        }

    @property
    def _frame(self) -> NDArray[np.float64]:
        return numbers_of("frame", self.frame, "a pose of finite numbers", (4, 4))

    @property
    def _is_mjcf(self) -> bool:
        return XML_OF_MUJOCO in Path(self.path).read_bytes()

    def _read(self, scene: Scene) -> None:
        from energymargin import scenes

        where: dict[str, Any] = {"position": (0, 0, 0), "orientation": (0, 0, 0, 1)}
        given = where | {"base": "kinematic"} | dict(self.options)
        if not self._is_mjcf:
            own = given.get("joints", {})
            given["joints"] = own | {
                name: {"start": start, "target": target} | own.get(name, {})
                for name, (start, target) in self.close.items()
            }
            scenes.from_urdf(self.path, scene, **{"role": "effector"} | given)
            return
        root = given.get("subtree")
        if root is None:
            raise ValueError("options has no subtree, expected the body of the model that is moved")
        scenes.from_mjcf(str(self.path), scene, **{"effector": (root,)} | given)


def _require(name: str, given: Any, there: Sequence[str]) -> None:
    for one in given:
        if one not in there:
            raise ValueError(f"{name} names {one!r}, expected one of {', '.join(there)}")
