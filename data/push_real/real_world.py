"""The stand-in for the real world: a table, a wall, a printed object and an arm, in MuJoCo.

It shares no physics with the library: another contact model (soft, elliptic friction cones),
another integrator, bodies that are free in all six degrees of freedom, and an arm that is driven by
position servos.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from energymargin_paper.paper.printed import Printed

STEP = 0.001  # s
WALL = 0.15  # m, y of its near face
FARTHEST = 1.0  # m, that a gap is measured
CLEARANCE = 0.001  # m, of the arm's tool above the table
STIFFNESS, DAMPING = 500.0, 40.0  # of the arm's servos [N/m, N s/m]
TURNING = 0.02  # of the tool about z, m^2: the servo's share of STIFFNESS and DAMPING


@dataclass(frozen=True)
class Truth:
    """What nobody knows who looks at a recording."""

    table_friction: float
    tool_friction: float
    mass: float
    """Of the object [kg]."""


class RealWorld:
    """One push. The tool follows commands (x, y, yaw), with the compliance of an arm."""

    def __init__(self, body: Printed, tool: Printed, truth: Truth) -> None:
        """The object at the origin, and the tool, in it."""
        self._model = mujoco.MjModel.from_xml_string(_xml(body, tool, truth))
        self._data = mujoco.MjData(self._model)

    def start(self, object_pose: NDArray[np.float64], tool_pose: NDArray[np.float64]) -> None:
        """At rest, at poses x, y, yaw."""
        x, y, yaw = object_pose
        self._data.joint("object").qpos[:2] = x, y
        self._data.joint("object").qpos[3:] = np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)
        for joint, value in zip("xyz", tool_pose, strict=True):
            self._data.joint(joint).qpos[:] = value
        self._data.ctrl[:] = tool_pose
        mujoco.mj_forward(self._model, self._data)

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self._data.time)

    def run(self, until: float, command: NDArray[np.float64]) -> None:
        """The tool is sent to x, y, yaw, to the step that is nearest to a time [s]."""
        self._data.ctrl[:] = command
        while self.time < until - STEP / 2:
            mujoco.mj_step(self._model, self._data)

    @property
    def object_pose(self) -> NDArray[np.float64]:
        """x, y, yaw."""
        place = self._data.body("object")
        return np.array([*place.xpos[:2], _yaw(place.xmat)])

    @property
    def tool_pose(self) -> NDArray[np.float64]:
        """x, y, yaw."""
        return np.array([self._data.joint(joint).qpos[0] for joint in "xyz"])

    @property
    def gap(self) -> float:
        """Between object and tool [m]."""
        geoms = [self._geoms(body) for body in ("object", "tool")]
        return min(
            mujoco.mj_geomDistance(self._model, self._data, a, b, FARTHEST, None)
            for a, b in itertools.product(*geoms)
        )

    def _geoms(self, body: str) -> range:
        own = self._model.body(body)
        first = int(own.geomadr[0])
        return range(first, first + int(own.geomnum[0]))


def _yaw(rotation: NDArray[np.float64]) -> float:
    return float(np.arctan2(rotation[3], rotation[0]))


def _xml(body: Printed, tool: Printed, truth: Truth) -> str:
    """The model. Of two surfaces the one of higher priority says the friction."""
    assets = [*_meshes("object", body), *_meshes("tool", tool)]
    inertia = _inertia(tool)
    return f"""
<mujoco>
  <option timestep="{STEP}" cone="elliptic" impratio="10" integrator="implicitfast"/>
  <default><geom condim="4" solref="0.004 1"/></default>
  <asset>{"".join(assets)}</asset>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1" priority="1"
          friction="{truth.table_friction} 0.0005 0.0001"/>
    <geom name="wall" type="box" size="0.5 0.05 0.03" pos="0 {WALL + 0.05} 0.03" priority="1"
          friction="{truth.table_friction} 0.0005 0.0001"/>
    <body name="object" pos="0 0 {body.height / 2}">
      <freejoint name="object"/>
      {"".join(_geoms("object", body, truth.mass, 'friction="0.4 0.0005 0.0001"'))}
    </body>
    <body name="tool" pos="0 0 {tool.height / 2 + CLEARANCE}">
      <joint name="x" type="slide" axis="1 0 0" armature="1"/>
      <joint name="y" type="slide" axis="0 1 0" armature="1"/>
      <joint name="z" type="hinge" axis="0 0 1" armature="{inertia}"/>
      {
        "".join(
            _geoms(
                "tool",
                tool,
                tool.mass,
                f'priority="2" friction="{truth.tool_friction} 0.0005 0.0001"',
            )
        )
    }
    </body>
  </worldbody>
  <contact><exclude body1="world" body2="tool"/></contact>
  <actuator>
    <position joint="x" kp="{STIFFNESS}" kv="{DAMPING}"/>
    <position joint="y" kp="{STIFFNESS}" kv="{DAMPING}"/>
    <position joint="z" kp="{STIFFNESS * TURNING}" kv="{DAMPING * TURNING}"/>
  </actuator>
</mujoco>"""


def _inertia(tool: Printed) -> float:
    """About z, of the arm that carries the tool [kg m^2]."""
    return 0.002 + tool.mass * tool.height**2


def _meshes(name: str, body: Printed) -> Iterator[str]:
    """The parts of a body, as meshes."""
    for number, outline in enumerate(body.outlines):
        corners = [
            f"{x:.5f} {y:.5f} {z:.5f}"
            for z in (-body.height / 2, body.height / 2)
            for x, y in outline
        ]
        yield f'<mesh name="{name}_{number}" vertex="{" ".join(corners)}"/>'


def _geoms(name: str, body: Printed, mass: float, surface: str) -> Iterator[str]:
    """The parts of a body, each with its share of the mass."""
    if body.radius is not None:
        size = f"{body.radius} {body.height / 2}"
        yield f'<geom type="cylinder" size="{size}" mass="{mass}" {surface}/>'
        return
    areas = np.array([_area(outline) for outline in body.outlines])
    for number, share in enumerate(areas / areas.sum()):
        yield f'<geom type="mesh" mesh="{name}_{number}" mass="{mass * share}" {surface}/>'


def _area(outline: NDArray[np.float64]) -> float:
    x, y = outline.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)
