"""
Sets of states, in the world's frame or another body's. `point` of those about a position: the body's "origin", that of its shape's frame, or its "center_of_mass".
"""
from __future__ import annotations
import collections.abc
import energymargin._core
import numpy
import numpy.typing
import typing
__all__: list[str] = ['AnnularSector', 'Ball', 'Box', 'Disc', 'HalfSpace', 'Predicate', 'Speed', 'Swept', 'Tilt']
def AnnularSector(body: str, center: numpy.typing.ArrayLike, radius: float, half_width: float, start_angle: float, sweep: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    What an arc about a center (2,) of mean radius and half width [m] sweeps in x and y, from start_angle by sweep [rad], positive counter-clockwise.
    """
def Ball(body: str, center: numpy.typing.ArrayLike, radius: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    |position - center| <= radius [m].
    """
def Box(body: str, center: numpy.typing.ArrayLike, size: numpy.typing.ArrayLike, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    Position inside a box along the frame's axes; full edge lengths [m], inf for no limit.
    """
def Disc(body: str, center: numpy.typing.ArrayLike, radius: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    Distance from the center (2,) in x and y <= radius [m].
    """
def HalfSpace(body: str, normal: numpy.typing.ArrayLike, offset: float, frame: str | None = None, *, ahead: float = 0.0, point: str = 'origin') -> energymargin._core.Region:
    """
    normal . position <= offset [m]; the normal is a unit vector. Where the frame's body moves along the normal it reaches further, by what that covers in `ahead` [s].
    """
def Predicate(function: collections.abc.Callable[[numpy.typing.NDArray[numpy.float64]], numpy.typing.ArrayLike]) -> energymargin._core.Region:
    """
    A user's own function of states, (N, n) -> (N,) bool. It cannot be saved to a file.
    """
def Speed(body: str, limit: float, point: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), frame: str | None = None, along_world: bool = False, along: numpy.typing.ArrayLike | None = None) -> energymargin._core.Region:
    """
    |velocity of a point of the body| <= limit [m/s]; the point is in its frame or, `along_world`, from its origin along the world's axes. That of the centre of mass is at the `center` of em.mass_properties, or of the body's inertial. along: a unit vector (3,); the velocity along it counts alone, and may be negative.
    """
def Swept(body: str, by: str, *, half_width: float, behind: float, ahead: float, least_speed: float, disc_radius: float, at: collections.abc.Mapping[str, numpy.typing.ArrayLike] | None = None, beyond: float = 0.0, point: str = 'origin') -> energymargin._core.Region:
    """
    Inside what the body `by` is about to sweep in x and y: an annular sector about its instantaneous centre of rotation, half_width [m] on each side of its path, from `behind` [m] behind it to `beyond` [m] beyond `ahead` [s] of its motion; below least_speed [m/s] a disc of disc_radius [m] about it. at: dict of position (2,), velocity (2,), yaw_rate, a motion to fix the sweep in the world; by default the state's own.
    """
def Tilt(body: str, axis: numpy.typing.ArrayLike, reference: numpy.typing.ArrayLike, limit: float, frame: str | None = None) -> energymargin._core.Region:
    """
    The angle between the body's axis and the reference is at most limit [rad].
    """
