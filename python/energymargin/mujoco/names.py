"""Which bodies and joints of a model are those of a scene: the ones of the same names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from energymargin._core import Body, Joint, Scene
from energymargin.mujoco.needed import needed

__all__ = ["Names"]


class Names:
    """The bodies and joints of a scene in a model."""

    def __init__(self, scene: Scene, model: Any, prefix: str = "") -> None:
        """`prefix`: of the scene's names, which the model's lack."""
        self._scene, self._model, self._prefix = scene, model, prefix
        self._links = {joint.child for joint in scene.joints}

    def _number(self, kind: str, name: str) -> int | None:
        """Of a body or a joint by its name, or by its number where the model has no name."""
        if not name.startswith(self._prefix):
            return None
        own, mujoco = name.removeprefix(self._prefix), needed()
        of = {"body": mujoco.mjtObj.mjOBJ_BODY, "joint": mujoco.mjtObj.mjOBJ_JOINT}[kind]
        number = int(mujoco.mj_name2id(self._model, of, own))
        if number >= 0:
            return number
        index = own.removeprefix(kind)
        count = {"body": self._model.nbody, "joint": self._model.njnt}[kind]
        if own.startswith(kind) and index.isdecimal() and int(index) < count:
            nameless = not mujoco.mj_id2name(self._model, of, int(index))
            return int(index) if nameless else None
        return None

    def body(self, name: str) -> int | None:
        """Of any body, the number; None if the model does not have it."""
        return self._number("body", name)

    def _bodies(self, *, fixed: bool) -> Iterator[tuple[Body, int]]:
        for body in self._scene.bodies:
            if body.fixed != fixed or body.name in self._links:
                continue
            number = self._number("body", body.name)
            if number is not None:
                yield body, number

    def fixed(self) -> Iterator[tuple[Body, int]]:
        """Fixed bodies that the model has; the world is where it is."""
        return ((body, number) for body, number in self._bodies(fixed=True) if number)

    def free(self) -> Iterator[tuple[Body, int]]:
        """Free bodies that the model has."""
        return self._bodies(fixed=False)

    def joints(self) -> Iterator[tuple[Joint, int]]:
        """Joints that the model has, also those that follow others."""
        for joint in self._scene.joints:
            number = None if joint.type == "fixed" else self._number("joint", joint.name)
            if number is not None:
                yield joint, number

    def moving(self) -> Iterator[tuple[Joint, int]]:
        """Those of them with numbers in a state."""
        return ((joint, number) for joint, number in self.joints() if joint.mimic is None)

    def welds(self) -> Iterator[tuple[Joint, int, int]]:
        """Held joints that the model does not have though it has both bodies: it welds them. Each
        with the numbers of its parent and its child."""
        for joint in self._scene.joints:
            other = joint.type == "fixed" or joint.mimic is not None
            if other or not joint.held or self._number("joint", joint.name) is not None:
                continue
            parent, child = self.body(joint.parent), self.body(joint.child)
            if parent is not None and child is not None:
                yield joint, parent, child

    def rigid(self) -> Iterator[tuple[Joint, int, int]]:
        """Fixed joints of whose parent and child the model has both, with their numbers."""
        for joint in self._scene.joints:
            parent, child = self.body(joint.parent), self.body(joint.child)
            if joint.type == "fixed" and parent is not None and child is not None:
                yield joint, parent, child

    def missing(self) -> list[str]:
        """Free bodies and joints of the scene's states that the model does not have."""
        there = {body.name for body, _ in self.free()}
        there |= {joint.name for joint, _ in self.moving()}
        there |= {joint.name for joint, _, _ in self.welds()}
        bodies = [b.name for b in self._scene.bodies if not b.fixed and b.name not in self._links]
        joints = [j.name for j in self._scene.joints if j.type != "fixed" and j.mimic is None]
        return [name for name in bodies + joints if name not in there]
