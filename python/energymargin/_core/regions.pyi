"""
Sets of states, in the world's frame or another body's. `point` of those about a position: the body's "origin", that of its shape's frame, or its "center_of_mass".
"""
from __future__ import annotations
import collections.abc
import energymargin._core
import numpy
import numpy.typing
import typing
__all__: list[str] = ['AnnularSector', 'Ball', 'Box', 'Disc', 'HalfSpace', 'Joint', 'Predicate', 'Speed', 'Swept', 'Tilt', 'Touching']
def AnnularSector(body: str, center: numpy.typing.ArrayLike, radius: float, half_width: float, start_angle: float, sweep: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    What an arc of some width sweeps in x and y.
    
    body: Whose position, or motion, counts.
    center: Of the arc [m].
    radius: Mean radius of the arc [m].
    half_width: On each side of the mean radius [m].
    start_angle: From the x axis [rad].
    sweep: Counter-clockwise from the start, negative: clockwise; not 0, at most a full turn [rad].
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def Ball(body: str, center: numpy.typing.ArrayLike, radius: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    |position of the body - center| <= radius.
    
    body: Whose position, or motion, counts.
    center: [m]
    radius: [m]
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def Box(body: str, center: numpy.typing.ArrayLike, size: numpy.typing.ArrayLike, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    The body's position is inside a box along the frame's axes.
    
    body: Whose position, or motion, counts.
    center: [m]
    size: Full edge lengths [m], or "inf".
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def Disc(body: str, center: numpy.typing.ArrayLike, radius: float, frame: str | None = None, *, point: str = 'origin') -> energymargin._core.Region:
    """
    A ball of the plane: the distance counts in x and y alone.
    
    body: Whose position, or motion, counts.
    center: [m]
    radius: [m]
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def HalfSpace(body: str, normal: numpy.typing.ArrayLike, offset: float, frame: str | None = None, *, ahead: float = 0.0, point: str = 'origin') -> energymargin._core.Region:
    """
    normal . position of the body <= offset; with "ahead" also as far as the frame's body moves along the normal in that time.
    
    body: Whose position, or motion, counts.
    normal: Unit vector.
    offset: [m]
    ahead: It reaches further by what the frame's body covers along the normal in this time [s]; with a frame alone.
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def Joint(joint: str, *, lower: float = ..., upper: float = ...) -> energymargin._core.Region:
    """
    The position of a joint that moves is from lower to upper.
    
    joint: By its name.
    lower: [rad] or [m]; -inf: without it.
    upper: [rad] or [m]; inf: without it.
    """
def Predicate(function: collections.abc.Callable[[numpy.typing.NDArray[numpy.float64]], numpy.typing.ArrayLike]) -> energymargin._core.Region:
    """
    A user's own function of states, (N, n) -> (N,) bool. It cannot be saved to a file.
    """
def Speed(body: str, limit: float, point: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), frame: str | None = None, along_world: bool = False, along: numpy.typing.ArrayLike | None = None) -> energymargin._core.Region:
    """
    |velocity of a point of the body| <= limit; with a frame: as seen from that body.
    
    body: Whose position, or motion, counts.
    limit: [m/s]
    point: In the body's frame [m]; its centre of mass is at the center of its inertial, or of its mass properties.
    along_world: The point is given along the world's axes, from the body's origin.
    along: Unit vector of the frame: the velocity along it counts alone, and may be negative.
    """
def Swept(body: str, by: str, *, half_width: float, behind: float, ahead: float, least_speed: float, disc_radius: float, beyond: float = 0.0, at: dict[str, numpy.typing.ArrayLike] | None = None, point: str = 'origin') -> energymargin._core.Region:
    """
    Inside what another body is about to sweep in x and y: the annular sector about its instantaneous centre of rotation or, while it is too slow to have a direction, a disc about it.
    
    body: Whose position, or motion, counts.
    by: The body that sweeps.
    half_width: On each side of its path [m].
    behind: Length of path behind it that still counts [m].
    ahead: Time of its motion that counts [s].
    least_speed: Below it the disc counts [m/s].
    disc_radius: [m]
    beyond: Length of path beyond what is ahead that still counts [m].
    at: The sweep from this motion, fixed in the world; left out: from the state's own.
    point: Of the body: "origin" of its frame, as when left out, or "center_of_mass".
    """
def Tilt(body: str, axis: numpy.typing.ArrayLike, reference: numpy.typing.ArrayLike, limit: float, frame: str | None = None) -> energymargin._core.Region:
    """
    The angle between an axis of the body and a direction of the frame is at most the limit.
    
    body: Whose position, or motion, counts.
    axis: Unit vector in the body's frame.
    reference: Unit vector in the frame.
    limit: [rad]
    """
def Touching(body: str, other: str, *, force: float = 0.0, gap: float = 0.0001) -> energymargin._core.Region:
    """
    Two bodies touch: they are at most a gap apart and, with "force", press on each other at least so much.
    
    body: One of the two bodies.
    other: The other one, which can collide with it.
    force: Sum of the normal forces of their contacts in one step of the scene from the state, without a disturbance, at least [N]; 0, or left out: it does not count. Not with a plan, nor for the escape energy.
    gap: Between their surfaces, at most [m]; left out: 0.0001.
    """
