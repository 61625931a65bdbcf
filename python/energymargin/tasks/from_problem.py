"""A problem file as a task: its question, asked of the states that were recorded in its scene."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from energymargin._core import Contact, Problem, Region, Scene
from energymargin.base.aliases import Floats
from energymargin.tasks.base import Params, Regions
from energymargin.tasks.trajectories import Trajectory

DIGITS = 16  # of the digest


class ProblemTask:
    """The question of a problem file of your own, at states that were recorded."""

    name = "problem"

    def __init__(self, file: str = "", digest: str = "") -> None:
        """A problem file, and the digest that it has to have; by default that which it has.

        Raises OSError if it cannot be read, and ValueError if it is another one than the digest
        says, is no problem, or has a plan or a horizon.
        """
        self.file = str(file)
        self.digest = sha256(Path(file).read_bytes()).hexdigest()[:DIGITS] if file else ""
        if digest not in ("", self.digest):
            raise ValueError(
                f"{self.file} has changed since it was recorded with: its digest is "
                f"{self.digest or 'missing'}, expected {digest}; import the recordings again"
            )

    @cached_property
    def _problem(self) -> Problem:
        if not self.file:
            raise ValueError(
                "file is '', expected a problem file, as `energymargin import REC.csv --problem "
                "P.json` takes"
            )
        problem = Problem.load(self.file, start_outside=True)
        for name in ("plan", "horizon"):
            if getattr(problem, name) is not None:
                raise ValueError(
                    f"{self.file} has a {name}, expected none: it begins at its own state, and "
                    "recordings have others; --frames and --plan of `energymargin score` ask "
                    "ahead of each"
                )
        return problem

    @property
    def engine(self) -> str:
        """What steps the problem's scene."""
        return str(self._problem.scene.engine)

    def in_engine(self, engine: str) -> ProblemTask:
        """The same question in a scene that another engine steps."""
        made = copy(self)
        made.__dict__["_problem"] = self._problem.with_engine(engine)
        return made

    def body(self, role: str) -> str:
        """The one body of a role, "object" or "effector", that no joint carries and that moves.

        Raises ValueError if there is none, or another one.
        """
        scene = self._problem.scene
        links = {joint.child for joint in scene.joints}
        free = [body for body in scene.bodies if not body.fixed and body.name not in links]
        found = [body.name for body in free if body.role == role]
        if len(found) != 1:
            shown = ", ".join(map(repr, found)) or "none"
            wrong = f"{self.file} has {shown} with the role {role!r} that moves freely, on no joint"
            raise ValueError(f"{wrong}, expected one: role={role!r} of Scene.add_body")
        return found[0]

    def rollout(self, seed: int, frames: int = 10) -> Trajectory:
        """Raises ValueError: there are only recordings."""
        way = "it has those that `energymargin import REC.csv --problem P.json` reads"
        raise ValueError(f"task {self.name!r} makes no trajectories: {way}")

    def scene(self, params: Params) -> Scene:
        """The problem's; the same for all recordings."""
        return self._problem.scene

    def captured(self, state: Floats, params: Params) -> Regions:
        """The problem's capture set; the same for all states."""
        return self._problem.captured_by_object or self._problem.captured

    def succeeded(self, params: Params) -> Region:
        """The problem's success set, or else its capture set."""
        own = self._problem.succeeded
        return self._problem.captured if own is None else own

    def problem(
        self, state: Floats, params: Params | None = None, contacts: Sequence[Contact] | None = None
    ) -> Problem:
        """The question at a state, shape (n,)."""
        return self._problem.replace(state=state, contacts=contacts, start_outside=True)
