"""
What may act on the objects at random.
"""
from __future__ import annotations
import numpy
import numpy.typing
import typing
__all__: list[str] = ['ActuationNoise', 'Boltzmann', 'Gaussian', 'Uniform', 'of_plan']
class Uniform:
    """
    Piecewise constant. Each piece is uniform within strength times the problem's bounds, along and about each axis, and lasts for a uniform time.
    """
    def __init__(self, strength: float = 1.0, objects: int | None = None, hold: float | None = None) -> None:
        """
        strength: Share of the problem's bounds.
        objects: How many objects each piece acts on, drawn for each piece; None: all.
        hold: Longest piece [s]; None: the problem's duration.
        """
    def __repr__(self) -> str:
        ...
    @property
    def hold(self) -> float | None:
        """
        Longest piece [s]; None: the problem's duration.
        """
    @property
    def objects(self) -> int | None:
        """
        How many objects each piece acts on, drawn for each piece; None: all.
        """
    @property
    def strength(self) -> float:
        """
        Share of the problem's bounds.
        """
class Gaussian:
    """
    Normal in each step, on the axes whose bounds are not 0. The correlation decays as exp(-t / correlation_time).
    """
    def __init__(self, force: float, torque: float = 0.0, correlation_time: float = 0.1) -> None:
        """
        force: Standard deviation along each axis [N].
        torque: Standard deviation about each axis [N m].
        correlation_time: Time constant of the correlation [s].
        """
    def __repr__(self) -> str:
        ...
    @property
    def correlation_time(self) -> float:
        """
        Time constant of the correlation [s].
        """
    @property
    def force(self) -> float:
        """
        Standard deviation along each axis [N].
        """
    @property
    def torque(self) -> float:
        """
        Standard deviation about each axis [N m].
        """
class Boltzmann:
    """
    Uniform, with each rollout weighted by exp(-rate * effort): more work is less likely (eq. 4). All rollouts run to the horizon.
    """
    def __init__(self, rate: float, strength: float = 1.0, objects: int | None = None, hold: float | None = None) -> None:
        """
        rate: lambda [1/J].
        strength: As Uniform.
        objects: As Uniform.
        hold: As Uniform.
        """
    def __repr__(self) -> str:
        ...
    @property
    def hold(self) -> float | None:
        """
        As Uniform.
        """
    @property
    def objects(self) -> int | None:
        """
        As Uniform.
        """
    @property
    def rate(self) -> float:
        """
        lambda [1/J].
        """
    @property
    def strength(self) -> float:
        """
        As Uniform.
        """
class ActuationNoise:
    """
    Noise of the robot: a uniform draw is added to its plan.
    """
    def __repr__(self) -> str:
        ...
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Largest along each axis, on each body that the plan pushes or drives [N]. Shape (3,).
        """
    @property
    def hold(self) -> float | None:
        """
        How long a draw lasts [s]; None: a step.
        """
    @property
    def targets(self) -> float:
        """
        Largest error of each joint's target [rad] or [m].
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        The same about each axis [N m]. Shape (3,).
        """
def of_plan(force: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), torque: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), targets: float = 0.0, hold: float | None = None) -> ActuationNoise:
    """
    Noise of the robot: a uniform draw is added to the wrenches on each body that the plan pushes or drives, and one to each joint's target.
    
    force: Largest along each axis, on each body that the plan pushes or drives [N].
    torque: The same about each axis [N m].
    targets: Largest error of each joint's target [rad] or [m].
    hold: How long a draw lasts [s]; None: a step.
    """
