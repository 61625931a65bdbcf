"""
What may act on the objects at random.
"""
from __future__ import annotations
import numpy
import numpy.typing
import typing
__all__: list[str] = ['Boltzmann', 'Gaussian', 'OfPlan', 'Uniform', 'of_plan']
class Uniform:
    """
    Piecewise constant: along and about each axis even within strength times the problem's bounds, each piece held for an even draw of time.
    """
    def __init__(self, strength: float = 1.0, objects: int | None = None, hold: float | None = None) -> None:
        """
        strength: of the bounds. objects: how many of several objects each piece meets, drawn anew for each; by default all. hold: the longest piece [s]; by default the problem's duration.
        """
    def __repr__(self) -> str:
        ...
    @property
    def hold(self) -> float | None:
        """
        [s]
        """
    @property
    def objects(self) -> int | None:
        """
        How many objects it meets at a time; None: all.
        """
    @property
    def strength(self) -> float:
        """
        Share of the problem's bounds.
        """
class Gaussian:
    """
    Normal in each step, on the axes whose bounds are not 0, with a correlation that fades as exp(-t / correlation_time).
    """
    def __init__(self, force: float, torque: float = 0.0, correlation_time: float = 0.1) -> None:
        """
        force [N], torque [N m]: standard deviations. correlation_time [s].
        """
    def __repr__(self) -> str:
        ...
    @property
    def correlation_time(self) -> float:
        """
        [s]
        """
    @property
    def force(self) -> float:
        """
        [N]
        """
    @property
    def torque(self) -> float:
        """
        [N m]
        """
class Boltzmann:
    """
    Uniform, each rollout weighted by exp(-rate * effort): what costs much work is less likely (eq. 4). All rollouts run to the horizon.
    """
    def __init__(self, rate: float, strength: float = 1.0, objects: int | None = None, hold: float | None = None) -> None:
        """
        rate: lambda [1/J]; the others as of Uniform.
        """
    def __repr__(self) -> str:
        ...
    @property
    def hold(self) -> float | None:
        """
        [s]
        """
    @property
    def objects(self) -> int | None:
        """
        How many objects it meets at a time; None: all.
        """
    @property
    def rate(self) -> float:
        """
        [1/J]
        """
    @property
    def strength(self) -> float:
        """
        Share of the problem's bounds.
        """
class OfPlan:
    """
    Noise of the robot: an even draw is added to what its plan says.
    """
    def __repr__(self) -> str:
        ...
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Largest along each axis, shape (3,) [N].
        """
    @property
    def hold(self) -> float | None:
        """
        [s]
        """
    @property
    def targets(self) -> float:
        """
        Largest, of each joint's target [rad] or [m].
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Largest about each axis, shape (3,) [N m].
        """
def of_plan(force: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), torque: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), targets: float = 0.0, hold: float | None = None) -> OfPlan:
    """
    Noise of the robot itself: to the wrenches on each body that its plan pushes or drives an even draw within force (3,) [N] and torque (3,) [N m] is added, and to each joint's target one within targets [rad] or [m]; each is held for hold [s], by default a step.
    """
