"""
The compiled core of energymargin.
"""
from __future__ import annotations
import collections.abc
import energymargin.model.scenes.reports
import numpy
import numpy.typing
import typing
from . import regions
from . import disturbances
__all__: list[str] = ['Audit', 'Body', 'Box', 'Cancel', 'Cancelled', 'Capsule', 'CaptureProbability', 'CaptureScore', 'Compound', 'Contact', 'ContactMargins', 'ConvexHull', 'Cylinder', 'EscapeEffort', 'EscapeEnergy', 'FEWEST_TREES', 'Feedback', 'ForceScore', 'ForceWeights', 'Inertial', 'Joint', 'LEAST_GYRATION', 'Loop', 'LowerBound', 'MOST_GYRATION', 'MassProperties', 'Mimic', 'Part', 'Plan', 'Plane', 'PolicyPlan', 'Problem', 'Region', 'Rollout', 'Scene', 'ScoreRow', 'ScoreRun', 'Simulation', 'Sphere', 'Spring', 'Surface', 'Survival', 'Tendon', 'TendonJoint', 'Tree', 'World', 'capture_probability', 'capture_score', 'disturbances', 'effort_lower_bound', 'escape_effort', 'escape_energy', 'force_score', 'interval', 'mass_properties', 'regions', 'stream', 'too_many_diverged', 'warn_of_steps']
class Cancelled(RuntimeError):
    """
    A Cancel ended a long call that had no result yet.
    """
class Cancel:
    """
    Ends the long calls that have it as `cancel`, from any thread. It cannot be reset.
    """
    def __init__(self) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def set(self) -> None:
        """
        Ends these calls, and all later ones.
        """
    @property
    def is_set(self) -> bool:
        """
        Whether `set` was called.
        """
class Plane:
    """
    The half space below a plane, {x : normal . x <= offset}; only fixed bodies have it.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Unit vector out of the solid. Shape (3,).
        """
    @property
    def offset(self) -> float:
        """
        Of the surface along the normal [m].
        """
class Box:
    """
    A box along the axes of its frame, about its origin.
    """
    def __init__(self, size: numpy.typing.ArrayLike) -> None:
        """
        size: Full edge lengths along x, y, z [m].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def size(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Full edge lengths along x, y, z [m]. Shape (3,).
        """
class Sphere:
    """
    A sphere about the origin of its frame.
    """
    def __init__(self, radius: float) -> None:
        """
        radius: [m]
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def radius(self) -> float:
        """
        [m].
        """
class Cylinder:
    """
    A cylinder about its own z axis.
    """
    def __init__(self, radius: float, length: float) -> None:
        """
        radius: [m]
        length: Along z [m].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def length(self) -> float:
        """
        Along z [m].
        """
    @property
    def radius(self) -> float:
        """
        [m].
        """
class Capsule:
    """
    A capsule about its own z axis.
    """
    def __init__(self, radius: float, length: float) -> None:
        """
        radius: [m]
        length: Of the cylindrical part, along z [m].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def length(self) -> float:
        """
        Of the cylindrical part, along z [m].
        """
    @property
    def radius(self) -> float:
        """
        [m].
        """
class ConvexHull:
    """
    The convex hull of points in the body's frame.
    """
    def __init__(self, points: numpy.typing.ArrayLike) -> None:
        """
        points: In the shape's frame [m]; they span a volume.
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    def centered(self) -> ConvexHull:
        """
        The hull with its centre of mass moved to the origin.
        """
    @property
    def points(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        In the shape's frame [m]; they span a volume. Shape (n, 3).
        """
class Part:
    """
    A solid at its place in a Compound: position [m] and orientation (x, y, z, w).
    """
    def __init__(self, shape: Box | Sphere | Cylinder | Capsule | ConvexHull, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), orientation: numpy.typing.ArrayLike | None = None) -> None:
        """
        shape: The solid.
        position: Of the part in the body's frame [m].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of the part in the body's frame [m]. Shape (3,).
        """
    @property
    def shape(self) -> Box | Sphere | Cylinder | Capsule | ConvexHull:
        """
        The solid.
        """
class MassProperties:
    """
    Volume, centre of mass and inertia of a solid of even density and of the given mass, 1 kg by default. The inertia of another mass is in proportion.
    """
    def __init__(self, volume: float, center: numpy.typing.ArrayLike, moments: numpy.typing.ArrayLike, axes: numpy.typing.ArrayLike | None = None) -> None:
        """
        volume: [m^3]
        center: Centre of mass in the shape's frame [m].
        moments: Principal moments about the centre of mass [kg m^2].
        axes: Unit quaternion x, y, z, w that turns the principal axes into the shape's frame.
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def axes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w that turns the principal axes into the shape's frame.
        """
    @property
    def center(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Centre of mass in the shape's frame [m]. Shape (3,).
        """
    @property
    def moments(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Principal moments about the centre of mass [kg m^2]. Shape (3,).
        """
    @property
    def volume(self) -> float:
        """
        [m^3].
        """
class Compound:
    """
    Several solids that move as one.
    
    parts: Parts, or solids that stand at the body's frame; without any there is nothing to collide with. solid: the mass
    properties, for a mass of 1 kg, of the solid that the parts stand for, as for a mesh; by default those of the parts
    together. Raises ValueError on values that no solid can have.
    """
    def __init__(self, parts: collections.abc.Sequence[Part | Box | Sphere | Cylinder | Capsule | ConvexHull], solid: MassProperties | None = None) -> None:
        ...
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def parts(self) -> list[Part]:
        """
        Solids, each at its place in the body's frame.
        """
    @property
    def solid(self) -> MassProperties | None:
        """
        Of the solid that the parts stand for, as of a mesh; unset: those of the parts together.
        """
class Inertial:
    """
    Mass properties of a body, in its frame.
    
    center: the centre of mass [m]; inertia: about it, principal moments (3,) or a matrix (3, 3) [kg m^2], along axes, by
    default the frame's, or those of a frame turned by this unit quaternion (x, y, z, w). Raises ValueError unless it is
    symmetric, positive, and such that a rigid body can have it.
    """
    def __init__(self, center: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), *, inertia: numpy.typing.ArrayLike, axes: numpy.typing.ArrayLike | None = None) -> None:
        ...
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def axes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w that turns the principal axes into the body's frame.
        """
    @property
    def center(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Centre of mass [m]. Shape (3,).
        """
    @property
    def moments(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Principal moments about the centre of mass [kg m^2]. Shape (3,).
        """
class Surface:
    """
    How a body meets others, beside its friction; by default as a rigid body does.
    """
    def __init__(self, *, torsional_friction: float = 0.0, rolling_friction: float = 0.0, patch_radius: float = 0.0, restitution: float = 0.0, stiffness: float = 0.0, damping: float = 0.0) -> None:
        """
        torsional_friction: Torque about a contact's normal by its normal force, within the cone of its friction; of two bodies the larger counts [m].
        rolling_friction: As torsional_friction, about the contact's plane [m].
        patch_radius: Radius of the patch over which it spreads what presses at a point; above 0 friction acts in the middle of what two faces share, with the torque of an even pressure; the larger counts [m].
        restitution: Share of the speed at which bodies meet that they part with, above .1 m/s; 0 to 1; the larger counts.
        stiffness: Of each contact point, in series with the other body's; 0: as hard as the step allows [N/m].
        damping: Beside a stiffness above 0 [N s/m].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def damping(self) -> float:
        """
        Beside a stiffness above 0 [N s/m].
        """
    @property
    def patch_radius(self) -> float:
        """
        Radius of the patch over which it spreads what presses at a point; above 0 friction acts in the middle of what two faces share, with the torque of an even pressure; the larger counts [m].
        """
    @property
    def restitution(self) -> float:
        """
        Share of the speed at which bodies meet that they part with, above .1 m/s; 0 to 1; the larger counts.
        """
    @property
    def rolling_friction(self) -> float:
        """
        As torsional_friction, about the contact's plane [m].
        """
    @property
    def stiffness(self) -> float:
        """
        Of each contact point, in series with the other body's; 0: as hard as the step allows [N/m].
        """
    @property
    def torsional_friction(self) -> float:
        """
        Torque about a contact's normal by its normal force, within the cone of its friction; of two bodies the larger counts [m].
        """
class Body:
    """
    One body of a scene.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def angular_damping(self) -> float:
        """
        Resists its turning, as linear_damping [N m s/rad].
        """
    @property
    def angular_factor(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        For the world's x, y, z: 1, free about the axis, or 0, locked. Shape (3,).
        """
    @property
    def angular_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        In the world's axes [rad/s]. Shape (3,).
        """
    @property
    def fixed(self) -> bool:
        """
        Whether it has no mass, and never moves.
        """
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Acts at the centre of mass all the time, in the world's axes [N]. Shape (3,).
        """
    @property
    def friction(self) -> float:
        """
        The coefficient of a contact follows from those of its two bodies, by the scene's rule.
        """
    @property
    def inertial(self) -> Inertial | None:
        """
        Its centre of mass and inertia; unset: those of the shape, of even density.
        """
    @property
    def kinematic(self) -> bool:
        """
        It goes on as it moves, or as a plan says, whatever it meets: as a body of infinite mass.
        """
    @property
    def linear_damping(self) -> float:
        """
        Resists the velocity of the centre of mass; of a link its joint's does [N s/m].
        """
    @property
    def linear_factor(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        For the world's x, y, z: 1, free along the axis, or 0, locked. Shape (3,).
        """
    @property
    def mass(self) -> float:
        """
        [kg]; 0: fixed.
        """
    @property
    def name(self) -> str:
        """
        Unique among the bodies; not "joints".
        """
    @property
    def orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of the body's frame in the world [m]. Shape (3,).
        """
    @property
    def role(self) -> str:
        """
        object: disturbances act on it, and it can escape. effector: a part of the robot. none: environment.
        """
    @property
    def shape(self) -> Plane | Box | Sphere | Cylinder | Capsule | ConvexHull | Compound:
        """
        Its frame is the body's.
        """
    @property
    def surface(self) -> Surface | None:
        """
        How it meets others, beside its friction; unset: as a rigid body.
        """
    @property
    def surface_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of its surface beside that of the body, in its frame, as of a conveyor belt [m/s]. Shape (3,).
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of the frame's origin, in the world's axes [m/s]. Shape (3,).
        """
class Mimic:
    """
    A joint follows another: position = multiplier * (that joint's position) + offset, always.
    """
    def __init__(self, joint: str, multiplier: float = 1.0, offset: float = 0.0) -> None:
        """
        joint: The joint that is followed: an earlier one that moves and follows no other.
        multiplier: Of that joint's position; not 0.
        offset: [rad] or [m]
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def joint(self) -> str:
        """
        The joint that is followed: an earlier one that moves and follows no other.
        """
    @property
    def multiplier(self) -> float:
        """
        Of that joint's position; not 0.
        """
    @property
    def offset(self) -> float:
        """
        [rad] or [m].
        """
class Joint:
    """
    A joint of a scene; for a prismatic one read m for rad and N for N m.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def armature(self) -> float:
        """
        Inertia of the drive's rotor times the square of the gear ratio [kg m^2].
        """
    @property
    def axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Unit vector in the joint's frame. Shape (3,).
        """
    @property
    def child(self) -> str:
        """
        The body that is carried; it can move, and is on no other joint.
        """
    @property
    def child_orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w.
        """
    @property
    def child_origin(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        In the child's frame [m]. Shape (3,).
        """
    @property
    def damping(self) -> float:
        """
        [N m s/rad].
        """
    @property
    def friction(self) -> float:
        """
        Dry friction: torque that resists motion, up to this [N m].
        """
    @property
    def held(self) -> bool:
        """
        It keeps the position that it has, whatever the load.
        """
    @property
    def limits(self) -> tuple[float, float]:
        """
        [rad].
        """
    @property
    def mimic(self) -> Mimic | None:
        """
        The joint that it follows, and how; unset: none.
        """
    @property
    def name(self) -> str:
        """
        Unique among the joints.
        """
    @property
    def orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Unit quaternion x, y, z, w.
        """
    @property
    def origin(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        In the parent's frame [m]. Shape (3,).
        """
    @property
    def parent(self) -> str:
        """
        The body that carries the child.
        """
    @property
    def start(self) -> float:
        """
        [rad].
        """
    @property
    def start_velocity(self) -> float:
        """
        [rad/s].
        """
    @property
    def stiffness(self) -> float:
        """
        [N m/rad].
        """
    @property
    def target(self) -> float:
        """
        [rad].
        """
    @property
    def target_velocity(self) -> float:
        """
        [rad/s].
        """
    @property
    def torque_limit(self) -> float:
        """
        [N m]; infinite: without limit.
        """
    @property
    def type(self) -> str:
        """
        fixed: the two move as one. revolute: turns about its axis. prismatic: slides along its axis.
        """
class TendonJoint:
    """
    A joint of a tendon, and how much of its position counts.
    """
    def __init__(self, joint: str, coefficient: float = 1.0) -> None:
        """
        joint: One that is not fixed.
        coefficient: Of its position; not 0.
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def coefficient(self) -> float:
        """
        Of its position; not 0.
        """
    @property
    def joint(self) -> str:
        """
        One that is not fixed.
        """
class Tendon:
    """
    A fixed tendon of a scene: a sum of joints' positions.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def damping(self) -> float:
        """
        [N m s/rad].
        """
    @property
    def friction(self) -> float:
        """
        Dry friction along the length.
        """
    @property
    def joints(self) -> list[TendonJoint]:
        """
        What its length is the sum of.
        """
    @property
    def limits(self) -> tuple[float, float]:
        """
        Of its length.
        """
    @property
    def name(self) -> str:
        """
        Unique among the tendons and joints.
        """
    @property
    def stiffness(self) -> float:
        """
        [N m/rad].
        """
    @property
    def target(self) -> float:
        """
        Of the length.
        """
    @property
    def target_velocity(self) -> float:
        """
        [rad/s].
        """
    @property
    def torque_limit(self) -> float:
        """
        [N m]; infinite: without limit.
        """
class Loop:
    """
    A frame of one body and one of another that stay together.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def body_a(self) -> str:
        """
        One of the two bodies.
        """
    @property
    def body_b(self) -> str:
        """
        The other one.
        """
    @property
    def orientation_a(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Of the frame of body_a in the body's: unit quaternion x, y, z, w.
        """
    @property
    def orientation_b(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Of the frame of body_b in the body's: unit quaternion x, y, z, w.
        """
    @property
    def point_a(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Origin of the frame of body_a in the body's [m]. Shape (3,).
        """
    @property
    def point_b(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Origin of the frame of body_b in the body's [m]. Shape (3,).
        """
    @property
    def type(self) -> str:
        """
        point: the frames' origins stay together, as in a ball joint. weld: the frames do.
        """
class Spring:
    """
    A spring between two bodies.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def body_a(self) -> str:
        """
        The body at one end.
        """
    @property
    def body_b(self) -> str:
        """
        The body at the other end, another one.
        """
    @property
    def damping(self) -> float:
        """
        Along the spring [N s/m].
        """
    @property
    def point_a(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        In the frame of body_a [m]. Shape (3,).
        """
    @property
    def point_b(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        In the frame of body_b [m]. Shape (3,).
        """
    @property
    def rest_length(self) -> float:
        """
        [m].
        """
    @property
    def stiffness(self) -> float:
        """
        [N/m].
        """
class Scene:
    """
    Bodies, joints and springs under gravity [m/s^2], and how the physics is stepped.
    """
    def __init__(self, gravity: numpy.typing.ArrayLike = (0.0, 0.0, -9.81), step: float = 0.004166666666666667, solver_iterations: int | None = None, solver_tolerance: float | None = None, margin: float | None = None, friction_rule: str = 'product', engine: typing.Any = 'native') -> None:
        """
        An empty scene.
        
        gravity [m/s^2]. step [s]: of the simulation. solver_iterations: Newton iterations of the contact solver in a step, at most,
        1 to 10000, 200 by default. solver_tolerance: a step has converged when the residual of the equations of motion is below this share of the
        impulses that act in it (relative, without a unit), above 0 and at most 0.01, 1e-5 by default. margin [m]: of collision shapes, by default a
        twentieth of each one's smallest half extent. friction_rule: what two bodies' coefficients make of their contact's,
        'product' (as in Bullet) or 'max' (as in MuJoCo); set_friction says it for a pair. engine: what steps the scene, 'native' (the
        library's own dynamics), 'bullet' (Bullet's multi-body world) or an em.engines.Engine, whose step has to be the scene's. In Bullet solver_iterations are sweeps, 50 by default, and solver_tolerance is
        the largest squared change of an impulse in the last sweep [N^2 s^2], 1e-7 by default.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def add_body(self, name: str, shape: Plane | Box | Sphere | Cylinder | Capsule | ConvexHull | Compound, *, mass: float | None = None, density: float | None = None, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), orientation: numpy.typing.ArrayLike | None = None, yaw: float | None = None, velocity: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), angular_velocity: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), friction: float = 0.5, surface: Surface | None = None, surface_velocity: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), role: str = 'none', linear_factor: numpy.typing.ArrayLike = (1.0, 1.0, 1.0), angular_factor: numpy.typing.ArrayLike = (1.0, 1.0, 1.0), force: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), linear_damping: float = 0.0, angular_damping: float = 0.0, inertial: Inertial | None = None, kinematic: bool = False) -> None:
        """
        Add a body.
        
        position and orientation (unit quaternion x, y, z, w, or a yaw angle about z [rad]) are those of its frame, which is its
        shape's; velocities are in the world's axes. Either mass [kg] or density [kg/m^3] says how heavy it is; a mass of 0 fixes
        it. role is 'object' (a body that disturbances act on), 'effector' or 'none'. The factors lock axes of the centre of mass:
        linear_factor=(1, 1, 0), angular_factor=(0, 0, 1) makes a planar body. Raises ValueError on bad values.
        
        velocity: Of the frame's origin, in the world's axes [m/s].
        angular_velocity: In the world's axes [rad/s].
        friction: The coefficient of a contact follows from those of its two bodies, by the scene's rule.
        surface: How it meets others, beside its friction; unset: as a rigid body.
        surface_velocity: Of its surface beside that of the body, in its frame, as of a conveyor belt [m/s].
        role: object: disturbances act on it, and it can escape. effector: a part of the robot. none: environment.
        linear_factor: For the world's x, y, z: 1, free along the axis, or 0, locked.
        angular_factor: For the world's x, y, z: 1, free about the axis, or 0, locked.
        force: Acts at the centre of mass all the time, in the world's axes [N].
        linear_damping: Resists the velocity of the centre of mass; of a link its joint's does [N s/m].
        angular_damping: Resists its turning, as linear_damping [N m s/rad].
        inertial: Its centre of mass and inertia; unset: those of the shape, of even density.
        kinematic: It goes on as it moves, or as a plan says, whatever it meets: as a body of infinite mass.
        """
    def add_joint(self, name: str, *, parent: str, child: str, type: str = 'revolute', axis: numpy.typing.ArrayLike = (0.0, 0.0, 1.0), limits: tuple[float, float] = ..., held: bool = False, target: float | None = None, origin: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), orientation: numpy.typing.ArrayLike | None = None, child_origin: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), child_orientation: numpy.typing.ArrayLike | None = None, start: float = 0.0, start_velocity: float = 0.0, target_velocity: float = 0.0, stiffness: float = 0.0, damping: float = 0.0, torque_limit: float = ..., mimic: Mimic | None = None, armature: float = 0.0, friction: float = 0.0) -> None:
        """
        Hang the body `child` on the body `parent`, which makes it a link.
        
        type is 'revolute' (limits and positions in rad), 'prismatic' (in m; a rail) or 'fixed'. The joint's frame is at origin [m]
        and orientation (unit quaternion x, y, z, w) in the parent's frame, and at child_origin and child_orientation in the child's;
        the two are one at position 0. axis is in the joint's frame. start and start_velocity are where it is when a state does not
        say. It is driven by the torque stiffness (target - position) + damping (target_velocity - velocity), at most torque_limit
        [N m]; target is by default the start. held: it keeps the position that it has in the state, whatever the load. mimic: it
        follows another joint, without limits and a drive of its own: the other one's torque_limit counts for both. armature:
        inertia of the drive's rotor times the square of the gear ratio [kg m^2]. friction: dry friction, which resists motion by up
        to this torque [N m]. For a prismatic joint read N for N m, and kg for kg m^2.
        
        The parent may be fixed, free, kinematic or a link; a body has one parent, joints make no loops, and bodies on joints have no
        locked axes. Bodies that a joint connects do not collide. Raises ValueError on bad values.
        """
    def add_loop(self, body_a: str, body_b: str, *, type: str = 'point', point_a: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), point_b: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), orientation_a: numpy.typing.ArrayLike | None = None, orientation_b: numpy.typing.ArrayLike | None = None) -> None:
        """
        Tie a frame of one body to a frame of another: it closes a loop of joints.
        
        type is 'point' (a ball joint: the frames' origins stay together) or 'weld' (the frames do). point_a, point_b [m] and
        orientation_a, orientation_b (unit quaternions x, y, z, w) are in the bodies' frames; where they are apart at the start they
        are pulled together. The bodies still collide unless disable_collisions says otherwise. Raises ValueError on bad values, and
        on two bodies that no force moves.
        """
    def add_plane(self, name: str, *, normal: numpy.typing.ArrayLike = (0.0, 0.0, 1.0), offset: float = 0.0, friction: float = 0.5, surface: Surface | None = None, surface_velocity: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """
        Add the fixed half space below a plane; by default z <= 0.
        """
    def add_spring(self, body_a: str, body_b: str, *, point_a: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), point_b: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), stiffness: float, rest_length: float = 0.0, damping: float = 0.0) -> None:
        """
        Add a spring between a point of one body and a point of another, in their frames.
        
        It pulls with stiffness (length - rest_length) + damping * rate of the length. Raises ValueError on bad values, and on
        a spring too stiff for the scene's step.
        """
    def add_tendon(self, name: str, joints: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex], *, limits: tuple[float, float] = ..., target: float | None = None, target_velocity: float = 0.0, stiffness: float = 0.0, damping: float = 0.0, torque_limit: float = ..., friction: float = 0.0) -> None:
        """
        Add a fixed tendon, whose length is the sum of joints' positions, each times a coefficient.
        
        joints: {joint: coefficient}. limits, friction and the control are as those of a joint, along the length; target is by default
        the length at the scene's start. A plan's targets may name it. Raises ValueError on bad values, a fixed joint, and joints on
        more than two chains of links that hang on fixed bodies.
        """
    def contact_friction(self, body_a: str, body_b: str) -> float:
        """
        Coefficient of the contacts of two bodies: that of the pair, or else by friction_rule.
        """
    def contact_surface(self, body_a: str, body_b: str) -> Surface:
        """
        What the surfaces of two bodies make of their contacts.
        """
    def disable_collisions(self, body_a: str, body_b: str) -> None:
        """
        From now on the two bodies never collide. Those that a joint connects never do.
        """
    def joint_slice(self, name: str) -> slice:
        """
        Where a joint's position and velocity stand in a state.
        """
    def pack(self, *, joints: dict[str, typing.Any] | None = None, **kwargs: dict[str, typing.Any]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        State vector, shape (n,): scene.pack(box=dict(position=..., yaw=..., velocity=...), joints=dict(knee=0.1, ankle=dict(position=..., velocity=...))). What is left out has the scene's own value. Raises ValueError on unknown bodies, joints or keys and bad values. Warns of a joint that is beyond its limits.
        """
    def set_friction(self, body_a: str, body_b: str, friction: float, *, torsional_friction: float | None = None, rolling_friction: float | None = None) -> None:
        """
        From now on contacts of the two bodies have this coefficient of friction.
        
        It counts instead of what friction_rule makes of the bodies' own; torsional_friction and rolling_friction [m] instead of those
        of their surfaces. With None these stay what they were. Raises ValueError on unknown bodies, one body given twice, and a coefficient that is negative or not finite.
        """
    def slice(self, name: str) -> slice:
        """
        Where a free body's 13 numbers stand in a state: position 3, quaternion 4, velocity 3, angular velocity 3.
        """
    def unpack(self, state: numpy.typing.ArrayLike) -> dict[str, dict[str, typing.Any]]:
        """
        Dict of dicts by body, links included: position (3,), orientation (4,), velocity (3,), angular_velocity (3,), yaw; and, if there are joints, under 'joints' a dict of dicts by joint: position, velocity.
        """
    def with_body(self, name: str, *, friction: float | None = None, mass: float | None = None, torsional_friction: float | None = None, rolling_friction: float | None = None) -> Scene:
        """
        A copy with other coefficients of friction (torsional and rolling [m]) or another mass [kg] of one body.
        
        Its inertia grows with its mass; coefficients of pairs stay. Raises ValueError on an unknown body, bad values, the mass of a
        fixed body, and a spring that is too stiff for a lighter one.
        """
    def with_engine(self, engine: typing.Any) -> Scene:
        """
        The same scene, stepped by 'native' or 'bullet', with that one's own solver_iterations and solver_tolerance, or by an em.engines.Engine in its own step. Raises ValueError on another word.
        """
    @property
    def bodies(self) -> list[Body]:
        """
        In the order in which they were added.
        """
    @property
    def dimension(self) -> int:
        """
        n, numbers in a state vector.
        """
    @property
    def disabled_collisions(self) -> list[tuple[str, str]]:
        """
        Pairs of bodies.
        """
    @property
    def engine(self) -> typing.Any:
        """
        What steps the scene: 'native', 'bullet' or an em.engines.Engine.
        """
    @property
    def friction_rule(self) -> str:
        """
        What two bodies' coefficients make of their contact's: 'product' or 'max'.
        """
    @property
    def gravity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape (3,) [m/s^2].
        """
    @property
    def joints(self) -> list[Joint]:
        """
        In the order in which they were added.
        """
    @property
    def loops(self) -> list[Loop]:
        """
        In the order in which they were added.
        """
    @property
    def margin(self) -> float | None:
        """
        [m]
        """
    @property
    def pair_frictions(self) -> dict[tuple[str, str], float]:
        """
        Coefficients that were set, by pair of bodies, the one that was added first in front.
        """
    @property
    def report(self) -> energymargin.model.scenes.reports.SceneReport:
        """
        What the readers of files left out of this scene, left loose, or stated; a table.
        """
    @property
    def solver_iterations(self) -> int:
        """
        Newton iterations of the contact solver in a step, at most.
        """
    @property
    def solver_tolerance(self) -> float:
        """
        A step has converged when the residual of the equations of motion is below this share of its impulses.
        """
    @property
    def springs(self) -> list[Spring]:
        """
        In the order in which they were added.
        """
    @property
    def step(self) -> float:
        """
        [s]
        """
    @property
    def tendons(self) -> list[Tendon]:
        """
        In the order in which they were added.
        """
class Plan:
    """
    The robot's actions from a problem's state on: K rows in time, each for `step` [s].
    
    Args:
        step: duration of a row [s], at least a step of the scene. Each row begins at the step that is nearest to its time.
        wrenches: by free or jointed body, shape (K, 6): force [N] and torque [N m] at its centre of mass, along the world's
            axes.
        targets: by joint under position control, shape (K,) [rad] or [m].
        velocities: by free body, shape (K, 6): the velocity of its frame [m/s] and its angular velocity [rad/s]. A motor of
            limited force keeps the body at them. A kinematic body has them, whatever it meets.
        limits: of the motors, by body of `velocities`: (force [N], torque [N m]), the largest along and about each axis of the
            world. By default twice what holds the body and its links against gravity, and that at the body's radius. A kinematic
            body has none.
    
    After the last row motors and wrenches are off, joints keep their targets, and kinematic bodies their velocities. Raises ValueError on rows of unequal number,
    or that are not finite.
    """
    @staticmethod
    def from_json(text: str, policies: collections.abc.Mapping[str, Plan] = {}) -> Plan:
        """
        A plan from JSON text; policies: as of Problem.load. Raises ValueError that names the place and what was expected.
        """
    @staticmethod
    def hold(scene: Scene, state: numpy.typing.ArrayLike, duration: float) -> Plan:
        """
        The robot goes on as it moves at a state (n,), for a duration [s]. Free effector bodies, or those that carry one, keep their twist in their own frames; joints under position control keep the scene's targets.
        """
    def __getstate__(self) -> tuple[str, typing.Any, typing.Any]:
        ...
    def __init__(self, step: float, wrenches: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, targets: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, velocities: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, limits: collections.abc.Mapping[str, tuple[float, float]] = {}) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple[str, typing.Any, typing.Any]) -> None:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def fine_rows(self, step: float) -> Plan:
        """
        The same plan with a row for each step [s] of a scene, at most the plan's own. Each row begins at the step that is nearest to its time.
        """
    def rest(self, done: int, step: float, memory: numpy.typing.ArrayLike | None = None) -> Plan:
        """
        What is left after `done` steps [s] of a scene. Rows stay as they are where one begins there, and otherwise have the scene's step. A Feedback and a Policy go on with their `memory` of then, as `World.simulate(...).memory` has it; None: they begin anew. Raises ValueError if nothing is left.
        """
    def to_json(self) -> str:
        """
        The plan as JSON text, as it stands in a problem file.
        """
    @property
    def duration(self) -> float:
        """
        Of all rows [s].
        """
    @property
    def feedback(self) -> typing.Any:
        """
        The arguments of a Feedback that are not of its plan; None: a plan alone.
        """
    @property
    def limits(self) -> dict[str, typing.Any]:
        """
        Of motors, where the plan has them: by body, (force [N], torque [N m]).
        """
    @property
    def policy(self) -> typing.Any:
        """
        The em.Policy that is asked; None: there is none.
        """
    @property
    def rows(self) -> int:
        """
        K.
        """
    @property
    def step(self) -> float:
        """
        Of a row [s].
        """
    @property
    def targets(self) -> dict[str, typing.Any]:
        """
        By joint, shape (K,) [rad] or [m].
        """
    @property
    def velocities(self) -> dict[str, typing.Any]:
        """
        By body, shape (K, 6) [m/s, rad/s].
        """
    @property
    def wrenches(self) -> dict[str, typing.Any]:
        """
        By body, shape (K, 6) [N, N m].
        """
class Feedback(Plan):
    """
    A plan that the robot corrects by what it observes: u = u_plan(t) + K(t) (x_ref(t) - x).
    
    It is a Plan, and goes where a plan goes. A correction acts from one control time to the next; each control time is at the
    step of the scene that is nearest to it. With a Feedback the last row of the plan stays, so that one row is enough.
    
    Args:
        gains: K, shape (m, n), or (R, m, n) with one a control time, the last of which stays.
        observed: names of the n numbers x. Of a joint: its position "j" or velocity "j.velocity". Of a body: "b.x", "b.y", "b.z"
            [m], "b.rx", "b.ry", "b.rz" (rotation vector [rad]), "b.vx" to "b.vz" [m/s], "b.wx" to "b.wz" [rad/s]. Of two bodies:
            the normal force in the last step, "force(a, b)" [N].
        corrected: names of the m numbers u. A joint's target "j"; of a wrench "b.fx" to "b.fz" [N], "b.tx" to "b.tz" [N m], at the
            centre of mass; of a velocity "b.vx" to "b.wz" of a free body.
        states: x_ref, shape (n,), or (R, n) with a row a control time, the last of which stays; None: zero.
        targets, wrenches, velocities: u_plan, as of Plan. Wrenches and velocities that are left out are zero.
        motors: as the `limits` of Plan.
        period: between two control times [s].
        delay: control periods from an observation to its correction.
        limits: (low, high) of u, each (m,), infinite where there is none.
        start: of the law's time that is over as the plan begins [s].
        noise: standard deviations of what is added to x in rollouts, (n,) or one for all; None: none. Searches have none.
        step: of a row of the plan [s]; None: the period.
    
    Raises ValueError on bad shapes, names and numbers.
    """
    @staticmethod
    def admittance(contacts: collections.abc.Mapping[str, str], *, force: float, compliance: float, period: float, wrenches: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, targets: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, velocities: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, motors: collections.abc.Mapping[str, tuple[float, float]] = {}, delay: int = 0, limits: tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike] | None = None) -> Feedback:
        """
        A robot that presses with a force: what it moves goes on, or gives way, until a contact has that force.
        
        Args:
            contacts: by the name of a corrected number, as `corrected` of Feedback, which contact it controls, as
                {"slide": "force(finger, object)"}: fingers that press by targets, or an effector by velocities "b.vx".
            force: wanted normal force [N].
            compliance: of a target, [m/N] or [rad/N] for each newton that is missing; of a velocity [m/(N s)].
        
        The others are as of Feedback.
        """
    @staticmethod
    def impedance(body: str, *, stiffness: numpy.typing.ArrayLike, damping: numpy.typing.ArrayLike, period: float, states: numpy.typing.ArrayLike | None = None, delay: int = 0, limits: tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike] | None = None) -> Feedback:
        """
        A virtual spring and damper on a body: `stiffness` (6,) [N/m, N m/rad] and `damping` (6,) [N s/m, N m s/rad] along and about the world's axes, about its centre of mass. `states` (12,) or (R, 12): where it is to be, as position, rotation vector, velocity and angular velocity of its frame; None: zeros. The others as of Feedback.
        """
    def __getstate__(self) -> tuple[str, typing.Any, typing.Any]:
        ...
    def __init__(self, gains: numpy.typing.ArrayLike, *, observed: collections.abc.Sequence[str], corrected: collections.abc.Sequence[str], states: numpy.typing.ArrayLike | None = None, wrenches: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, targets: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, velocities: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, motors: collections.abc.Mapping[str, tuple[float, float]] = {}, period: float, delay: int = 0, limits: tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike] | None = None, start: float = 0.0, noise: numpy.typing.ArrayLike | None = None, step: float | None = None) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple[str, typing.Any, typing.Any]) -> None:
        ...
class PolicyPlan(Plan):
    """
    A plan whose robot is asked what to do; em.Policy makes it.
    """
    def __init__(self, act: collections.abc.Callable[[float, int, numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.uint64], numpy.typing.NDArray[numpy.float64]], tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float64], typing.Annotated[numpy.typing.ArrayLike, numpy.float64]]], *, observed: collections.abc.Sequence[str], commanded: collections.abc.Sequence[str], period: float, delay: int, memory: int, noise: numpy.typing.ArrayLike, limits: tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike] | None, name: str) -> None:
        ...
class Contact:
    """
    One point where two bodies touch, and the forces there over the last part of its step: where bodies come into contact or bounce, a step has several. What a Feedback observes as "force(a, b)" is the mean over a step.
    """
    def __init__(self, *, body_a: str, body_b: str, position: numpy.typing.ArrayLike, normal: numpy.typing.ArrayLike, distance: float, normal_force: float, tangential_force: numpy.typing.ArrayLike, friction: float) -> None:
        """
        body_a: A body.
        body_b: Another body.
        position: On body_b, in the world [m].
        normal: Unit vector from body_b to body_a, in the world's axes.
        distance: Between the surfaces; negative: depth [m].
        normal_force: Along the normal, on body_a [N].
        tangential_force: Friction on body_a, in the world's axes [N].
        friction: The contact's coefficient.
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def body_a(self) -> str:
        """
        A body.
        """
    @property
    def body_b(self) -> str:
        """
        Another body.
        """
    @property
    def distance(self) -> float:
        """
        Between the surfaces; negative: depth [m].
        """
    @property
    def friction(self) -> float:
        """
        The contact's coefficient.
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Unit vector from body_b to body_a, in the world's axes. Shape (3,).
        """
    @property
    def normal_force(self) -> float:
        """
        Along the normal, on body_a [N].
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        On body_b, in the world [m]. Shape (3,).
        """
    @property
    def tangential_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Friction on body_a, in the world's axes [N]. Shape (3,).
        """
class Audit:
    """
    Where the energy of a rollout went.
    
    Each work [J] is work on the bodies: positive where it gives them energy. An impulse works along the mean of the velocities
    before and after the step. The entries and `leftover` add up to `energy_change`.
    """
    def __repr__(self) -> str:
        ...
    @property
    def contacts(self) -> float:
        """
        Work of the normal impulses at contacts [J]. Impacts lose energy: negative. Positive where what overlaps is parted.
        """
    @property
    def damping(self) -> float:
        """
        Work of the damping of joints and springs; negative [J].
        """
    @property
    def drives(self) -> float:
        """
        Work of drives to a target velocity: damping * target velocity, within the torque limit [J].
        """
    @property
    def energy_change(self) -> float:
        """
        Mechanical energy, World.energy, at the end minus at the start [J].
        """
    @property
    def friction(self) -> float:
        """
        Work of friction at contacts; negative but for solver error [J].
        """
    @property
    def integration(self) -> float:
        """
        Known error of time integration, of the order of the step h [J]. Velocities are h / 2 behind the positions, which counts the power P of gravity, constant forces and springs as -h / 2 (P at the end - P at the start). Implicit integration damps compliant joints as stiffness * h does.
        """
    @property
    def joints(self) -> float:
        """
        Work of joint stops, negative where a joint hits one, of dry friction of joints, and of the coupling of mimic joints [J].
        """
    @property
    def leftover(self) -> float:
        """
        energy_change minus all entries [J]: the error of the simulation without a known cause, mostly that of finite rotations.
        """
    @property
    def overlap(self) -> float:
        """
        Work of penetration recovery (split impulses) against gravity, constant forces and springs; it takes no impulse [J].
        """
    @property
    def plan(self) -> float:
        """
        Work of the robot's plan: its wrenches, its servos, targets that differ from the scene's, and kinematic bodies [J].
        """
    @property
    def turnover(self) -> float:
        """
        Sum of the absolute values of energy_change and all entries [J]: the scale of leftover.
        """
    @property
    def wrench(self) -> float:
        """
        Work of the disturbance: Rollout.work [J].
        """
class Rollout:
    """
    The result of one rollout.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def audit(self) -> Audit | None:
        """
        Where the energy went; None unless audit.
        """
    @property
    def effort(self) -> float:
        """
        Integral of |f . v + tau . omega| dt, eq. 2 and 3 [J].
        """
    @property
    def energy(self) -> float:
        """
        Mechanical energy at the end [J].
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        At the end, shape (n,).
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps, fewer than asked for if it ended early.
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
    @property
    def work(self) -> float:
        """
        The same with its sign [J].
        """
class Simulation:
    """
    A recorded simulation of K frames.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def contacts(self) -> list[list[Contact]]:
        """
        For each frame the contacts of its last step.
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def memory(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        What the plan's Feedback or Policy remembers, shape (K, h).
        """
    @property
    def states(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape (K, n).
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps, up to the last frame.
        """
    @property
    def times(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape (K,) [s].
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
class World:
    """
    One simulation of a Scene, in which the robot follows a plan if there is one. Every result is a pure function of the arguments. Threads may share a world, which answers one at a time.
    """
    def __init__(self, scene: Scene, plan: Plan | None = None) -> None:
        ...
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    def contacts(self, state: numpy.typing.ArrayLike) -> list[Contact]:
        """
        Contacts at a state, with the forces of one step without a wrench.
        """
    def distance(self, state: numpy.typing.ArrayLike, body_a: str, body_b: str) -> float:
        """
        Least distance between two bodies, negative in penetration [m].
        """
    def energy(self, state: numpy.typing.ArrayLike) -> float:
        """
        Mechanical energy [J]: kinetic energy of all moving bodies, links included; potential energy of gravity and of the bodies' constant forces, zero at the world's origin; energy of the springs and of the joints' compliance, zero at their targets.
        """
    def rollout(self, state: numpy.typing.ArrayLike, wrench: numpy.typing.ArrayLike, duration: float, *, audit: bool = False, time: float = 0.0, timeout: float | None = None, cancel: Cancel | None = None) -> Rollout:
        """
        Applies a wrench (6,), force [N] and torque [N m], to the object, or (k, 6) to k objects.
        
        duration [s]: of the wrench, rounded to whole steps. audit: also balances the energy; only the time that it takes changes.
        time [s]: where the robot's plan starts. timeout [s], cancel: when the rollout ends early. Warns of a joint that starts
        beyond its limits, and if more than 1 % of the steps did not converge, or of the time is lost. Raises TimeoutError, or Cancelled.
        """
    def simulate(self, state: numpy.typing.ArrayLike, steps: int, drives: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, targets: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, record: collections.abc.Sequence[int] | None = None, *, timeout: float | None = None, cancel: Cancel | None = None) -> Simulation:
        """
        One unbroken simulation of a number of steps.
        
        The robot follows the world's plan. On top of it: drives, wrenches by body, shape (steps, 6), which add to the plan's; targets,
        of joints under position control, shape (steps,) [rad] or [m], which replace the plan's. record: the steps after which a frame is recorded, ascending, from 0, the
        start, to steps; by default all but 0. timeout [s], cancel: when the simulation ends early. Warns of a joint that starts
        beyond its limits, and of bodies deep in each other. Raises TimeoutError, or Cancelled.
        """
    @property
    def scene(self) -> Scene:
        """
        A copy.
        """
class Region:
    """
    A set of states; combine with & | ~. Built by the functions of em.regions.
    """
    def __and__(self, arg0: Region) -> Region:
        ...
    def __bool__(self) -> bool:
        ...
    def __invert__(self) -> Region:
        ...
    def __or__(self, arg0: Region) -> Region:
        ...
    def __repr__(self) -> str:
        ...
    def contains(self, scene: Scene, states: numpy.typing.ArrayLike) -> typing.Any:
        """
        Membership of one state (n,) as bool, or of several (N, n) as an array (N,). Raises ValueError if the region names a body that the scene does not have.
        """
class ForceWeights:
    """
    Weights of the force score, Section V-B.
    
    engage [1/N]: of the normal forces between effector and object. stick [1/N]: of their distances to the friction cones'
    edges. distance [1/m]: of the distance between object and effector, which the score subtracts. ground_engage and
    ground_stick: as engage and stick, for the object's contacts with everything but the effector.
    """
    def __init__(self, engage: float = 1.0, stick: float = 1.0, distance: float = 10.0, ground_engage: float = 0.0, ground_stick: float = 0.0) -> None:
        """
        engage: Of the normal forces between effector and objects [1/N].
        stick: Of their distance to the edge of the friction cone [1/N].
        distance: Taken off per metre between object and effector [1/m].
        ground_engage: As engage, for contacts with all that is not the effector [1/N].
        ground_stick: As stick, for those [1/N].
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def distance(self) -> float:
        """
        Taken off per metre between object and effector [1/m].
        """
    @property
    def engage(self) -> float:
        """
        Of the normal forces between effector and objects [1/N].
        """
    @property
    def ground_engage(self) -> float:
        """
        As engage, for contacts with all that is not the effector [1/N].
        """
    @property
    def ground_stick(self) -> float:
        """
        As stick, for those [1/N].
        """
    @property
    def stick(self) -> float:
        """
        Of their distance to the edge of the friction cone [1/N].
        """
class Problem:
    """
    One question: how robust is this state against these disturbances?
    
    Args:
        scene: the bodies.
        state: where they are and how they move, shape (n,).
        captured: the capture set Z_cap. Of several objects a dict, a region for each: it asks whether all of them are in
            theirs (captured), and whether at least one is (captured_any).
        succeeded: the success set Z_suc, or a dict in the same way.
        within: where the search for an escape may go, Z_b.
        start_outside: do not warn of a state outside of the capture set, as along a recorded trajectory.
        force: Largest |force| of the disturbance on each object, along the world's x, y and z axes [N].
        torque: Largest |torque| of the disturbance on each object, about the world's x, y and z axes [N m].
        duration: Longest edge of the search [s]; at least one step of the simulation.
        effector: What the effector does while the objects are disturbed. coast: no script acts on it. drive: each edge of the search starts with its velocities of the start.
        rate: lambda: how fast the likelihood of a state falls with the work to get there [1/J].
        force_weights: Weights of the force score.
        contacts: Contacts that were measured at the state, for the force score; left out: simulated.
        horizon: The question is about the next so many seconds, whole steps of the simulation; left out: as long as the plan, or without a clock.
        check: Time between two looks at the capture set, whole steps of the simulation [s]; left out: about 1/60.
        dwell: How long an object has to stay outside of the capture set for an escape, whole steps of the simulation [s]; left out: 0.
        plan: The robot's actions from the state on; left out: the effector coasts.
    
    Raises ValueError on bad values and on a state in deep penetration. Warns, as PlausibilityWarning, of values that look like
    another unit, and of a start that falls or is outside of the capture set.
    """
    @staticmethod
    def from_json(text: str, folder: typing.Any = None, policies: collections.abc.Mapping[str, Plan] = {}) -> Problem:
        """
        A problem from JSON text. folder: what the paths of its meshes are relative to; policies: as of load. Raises ValueError that names the place and what was expected.
        """
    @staticmethod
    def from_mujoco(model: typing.Any, data: typing.Any = None, **question: typing.Any) -> Problem:
        """
        The question of a `mujoco.MjModel` from its `mujoco.MjData` on, in MuJoCo itself:
            `em.mujoco.problem(model, data, objects=..., captured=..., force=..., horizon=...)`.
        """
    @staticmethod
    def load(path: typing.Any, *, start_outside: bool = False, policies: collections.abc.Mapping[str, Plan] = {}) -> Problem:
        """
        Reads a JSON file. policies: by name, the em.Policy of which a file has that name alone. Raises OSError if it cannot be opened, and ValueError that names the file, the place in it and what was expected, as a policy. Warns as the constructor does, and of friction along one direction, which files of version 0.13 may ask for.
        """
    @staticmethod
    def schema() -> dict[str, typing.Any]:
        """
        The JSON Schema (draft-07) of problem files.
        """
    def __getstate__(self) -> tuple[str, typing.Any, typing.Any]:
        ...
    def __init__(self, scene: Scene, state: numpy.typing.ArrayLike, *, captured: collections.abc.Mapping[str, Region] | Region, succeeded: collections.abc.Mapping[str, Region] | Region | None = None, within: Region | None = None, start_outside: bool = False, force: numpy.typing.ArrayLike, torque: numpy.typing.ArrayLike, duration: float, effector: str = 'coast', rate: float = 5.0, force_weights: ForceWeights = ..., contacts: collections.abc.Sequence[Contact] | None = None, horizon: float | None = None, check: float | None = None, dwell: float = 0.0, plan: Plan | None = None) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple[str, typing.Any, typing.Any]) -> None:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def edge_start(self, node: numpy.typing.ArrayLike) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Where an edge from a node's state (n,) starts: there or, under effector 'drive', there with the effector at its velocity of the start state.
        """
    def replace(self, **changes: typing.Any) -> Problem:
        """
        A copy with other values of some of the constructor's keywords. Raises as the constructor does, and TypeError on other keywords.
        """
    def save(self, path: typing.Any, meshes: str = 'embedded') -> None:
        """
        Writes a JSON file, atomically.
        
        meshes: 'embedded' writes the points of convex hulls, as those of a mesh, into the file; 'files' writes them into OBJ files
        beside it, for compounds whose parts are all hulls without a pose of their own. A policy goes by its name alone. Raises
        ValueError if a region is a Predicate or a policy has no name, and OSError if a file cannot be written.
        """
    def to_json(self) -> str:
        """
        The problem as JSON text.
        """
    def with_engine(self, engine: typing.Any) -> Problem:
        """
        The same question in a simulation by another engine: 'native' or 'bullet', with its own solver_iterations and solver_tolerance, or an em.engines.Engine in its own step. Raises ValueError on another word, and on what an engine does not do.
        """
    def with_state(self, state: numpy.typing.ArrayLike) -> Problem:
        """
        The same question about another state, shape (n,). The copy has no measured contacts. Warns of a joint that is beyond its limits.
        """
    def with_step(self, step: float) -> Problem:
        """
        The same question in a simulation with another step [s]; a plan with shorter rows has the means of their wrenches and velocities, and their last targets. em.longest_step finds how long it may be. Raises ValueError where a time is not whole steps of this length, or a spring is too stiff for it.
        """
    @property
    def captured(self) -> Region:
        """
        The capture set Z_cap; of several objects: all are captured.
        """
    @property
    def captured_any(self) -> Region | None:
        """
        Of several objects: at least one is captured.
        """
    @property
    def captured_by_object(self) -> dict[str, Region] | None:
        """
        The capture set of each object by its name; None where there is one for all.
        """
    @property
    def check(self) -> float | None:
        """
        Time between two looks at the capture set, whole steps of the simulation [s]; left out: about 1/60.
        """
    @property
    def contacts(self) -> list[Contact] | None:
        """
        Contacts that were measured at the state, for the force score; left out: simulated.
        """
    @property
    def duration(self) -> float:
        """
        Longest edge of the search [s]; at least one step of the simulation.
        """
    @property
    def dwell(self) -> float:
        """
        How long an object has to stay outside of the capture set for an escape, whole steps of the simulation [s]; left out: 0.
        """
    @property
    def effector(self) -> str:
        """
        What the effector does while the objects are disturbed. coast: no script acts on it. drive: each edge of the search starts with its velocities of the start.
        """
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Largest |force| of the disturbance on each object, along the world's x, y and z axes [N]. Shape (3,).
        """
    @property
    def force_weights(self) -> ForceWeights:
        """
        Weights of the force score.
        """
    @property
    def horizon(self) -> float | None:
        """
        The question is about so many seconds [s]; None: it has no clock.
        """
    @property
    def plan(self) -> Plan | None:
        """
        The robot's actions from the state on; left out: the effector coasts.
        """
    @property
    def rate(self) -> float:
        """
        lambda: how fast the likelihood of a state falls with the work to get there [1/J].
        """
    @property
    def scene(self) -> Scene:
        """
        A copy.
        """
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        z_init, shape (n,).
        """
    @property
    def succeeded(self) -> Region | None:
        """
        The success set Z_suc; of several objects: all have succeeded.
        """
    @property
    def succeeded_any(self) -> Region | None:
        """
        Of several objects: at least one has succeeded.
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Largest |torque| of the disturbance on each object, about the world's x, y and z axes [N m]. Shape (3,).
        """
    @property
    def within(self) -> Region | None:
        """
        Bounds Z_b: where the search for an escape may go. The start is inside.
        """
class Tree:
    """
    All rollouts of a search as flat arrays; row 0 is the root.
    """
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def path_to(self, node: int) -> list[int]:
        """
        Rows from the root to a node, both included.
        """
    @property
    def controls(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Wrenches that led to the node, shape (M + 1, 6 k) for k objects [N, N m].
        """
    @property
    def costs(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Effort from the root, eq. 8, shape (M + 1,) [J].
        """
    @property
    def durations(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        How long the wrenches acted, shape (M + 1,) [s].
        """
    @property
    def parents(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"]:
        """
        Row of the parent, -1 for the root, shape (M + 1,).
        """
    @property
    def states(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape (M + 1, n).
        """
    @property
    def times(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Since the root, shape (M + 1,) [s].
        """
class CaptureScore:
    """
    Capture and success score, Section IV-B and Algorithm 2.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def interval(self, confidence: float = 0.95, which: str = 'capture') -> tuple[float, float]:
        """
        (low, high), a confidence interval for the score of infinitely many trees of this size.
        
        which: 'capture', 'success', 'capture_any' or 'success_any'. The interval holds Student's interval of the trees' scores
        and Wilson's, which counts what a few trees cannot see. Raises ValueError on a single tree, or a set that the problem does
        not have.
        """
    @property
    def capture(self) -> float:
        """
        Omega_cap, eq. 5, 0..1; mean over the trees.
        """
    @property
    def capture_any(self) -> float | None:
        """
        The same that at least one of several objects stays; None without such a set.
        """
    @property
    def capture_any_by_tree(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        `capture_any` of each tree alone, shape (trees,); empty without such a set.
        """
    @property
    def capture_any_stderr(self) -> float | None:
        """
        Standard error of `capture_any`; None for a single tree.
        """
    @property
    def capture_by_tree(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        `capture` of each tree alone, shape (trees,); empty without such a set.
        """
    @property
    def capture_stderr(self) -> float | None:
        """
        Standard error of `capture`; None for a single tree.
        """
    @property
    def complete(self) -> bool:
        """
        Whether no tree is missing and a tolerance is met. False if the timeout, the cancel or the largest number of trees came first.
        """
    @property
    def diverged(self) -> int:
        """
        Rollouts of all trees that diverged: nodes of infinite cost and no likelihood.
        """
    @property
    def likelihoods(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Of the first tree's nodes, eq. 4, shape (M + 1,).
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def nodes(self) -> int:
        """
        Of each tree, besides its root.
        """
    @property
    def resolution(self) -> float:
        """
        Likelihood of a tree's heaviest node, mean over the trees: no score is finer.
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps of its rollouts.
        """
    @property
    def success(self) -> float | None:
        """
        Omega_suc, eq. 6, 0..1; mean over the trees. None without a success set.
        """
    @property
    def success_any(self) -> float | None:
        """
        The same that at least one of several objects succeeds; None without such a set.
        """
    @property
    def success_any_by_tree(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        `success_any` of each tree alone, shape (trees,); empty without such a set.
        """
    @property
    def success_any_stderr(self) -> float | None:
        """
        Standard error of `success_any`; None for a single tree.
        """
    @property
    def success_by_tree(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        `success` of each tree alone, shape (trees,); empty without such a set.
        """
    @property
    def success_stderr(self) -> float | None:
        """
        Standard error of `success`; None for a single tree.
        """
    @property
    def tree(self) -> Tree:
        """
        The first tree.
        """
    @property
    def trees(self) -> list[Tree]:
        """
        All trees that count.
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
    @property
    def undisturbed_exit(self) -> float | None:
        """
        When the state leaves the capture set without a disturbance [s]. None if it stays for 1 s, or if the score is at most 0.5, which needs no such check.
        """
    @property
    def value(self) -> float:
        """
        As `capture`.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        Sentences that speak against the result: its resolution is above 0.2; the score is above 0.5 although the state leaves without a disturbance; more than 1 % of the steps did not converge, or of the time is lost.
        """
class LowerBound:
    """
    A lower bound of the effort of escape.
    """
    def __repr__(self) -> str:
        ...
    @property
    def barrier(self) -> float:
        """
        Least rise of the object's energy on any way out, or less [J].
        """
    @property
    def cage(self) -> bool:
        """
        Whether it is proved that there is no escape.
        """
    @property
    def cells(self) -> int:
        """
        Cells of poses that were looked at.
        """
    @property
    def complete(self) -> bool:
        """
        Whether the barrier is known to the tolerance, or it is a cage. False: the cells, the timeout or the cancel came first, and more cells may give a higher bound.
        """
    @property
    def effort(self) -> float:
        """
        No escape takes less [J]; inf: there is none, a cage.
        """
    @property
    def kinetic(self) -> float:
        """
        Kinetic energy of all bodies at the start [J].
        """
    @property
    def reason(self) -> str:
        """
        Why the effort is bounded by 0 alone; empty if it is bounded by more.
        """
    @property
    def stored(self) -> float:
        """
        Energy that other bodies, springs and joints can release [J]; inf: there is no end of it.
        """
    @property
    def value(self) -> float:
        """
        As `effort`.
        """
class EscapeEffort:
    """
    Effort of escape, Section IV-A and Algorithm 1.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    @property
    def bound(self) -> LowerBound | None:
        """
        How the lower bound came about; None unless it was asked for.
        """
    @property
    def complete(self) -> bool:
        """
        Whether the search used all nodes, or no escape can be cheaper. False if the timeout or the cancel came first.
        """
    @property
    def discarded(self) -> int:
        """
        Best escapes that do not count: in a simulation with a quarter of the step, with wrenches up to 1.2 times as strong, they do not lead out.
        """
    @property
    def discarded_effort(self) -> float:
        """
        Least effort of these [J]; inf if there is none.
        """
    @property
    def diverged(self) -> int:
        """
        Rollouts that diverged: nodes of infinite cost.
        """
    @property
    def effort(self) -> float:
        """
        Omega_esc, eq. 2 [J]; inf without an escape.
        """
    @property
    def history(self) -> list[tuple[int, float]]:
        """
        (nodes so far, best effort) at each improvement.
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def lower_bound(self) -> float | None:
        """
        No escape takes less [J]; None unless it was asked for.
        """
    @property
    def nodes(self) -> int:
        """
        Nodes besides the root and, with a horizon, the undisturbed future in row 1. A search of so many nodes gives the same bits. Of several searches those of the best one.
        """
    @property
    def path(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        Rows of the tree from the root to the escape; empty without an escape.
        """
    @property
    def proved_cage(self) -> bool:
        """
        Whether the lower bound proves that there is no escape.
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps of its rollouts.
        """
    @property
    def tree(self) -> Tree:
        """
        All rollouts of the search.
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
    @property
    def undisturbed_exit(self) -> float | None:
        """
        When the state leaves the capture set without a disturbance [s], as the search sees it; without a horizon also as 1 s of simulation does, if the effort is above 0. None if it stays.
        """
    @property
    def value(self) -> float:
        """
        As `effort`.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        Sentences that speak against the result: a cheaper escape was discarded; the effort is above 0 although the state leaves without a disturbance; more than 1 % of the steps did not converge, or of the time is lost.
        """
class EscapeEnergy:
    """
    Escape energy, Definitions 1 and 2.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    @property
    def barrier(self) -> int | None:
        """
        Row of the path's highest energy; None without an escape.
        """
    @property
    def complete(self) -> bool:
        """
        Whether all poses are drawn, or no barrier can be lower. False if the timeout or the cancel came first.
        """
    @property
    def energy(self) -> float:
        """
        Lowest barrier [J]; inf without an escape, as from a cage.
        """
    @property
    def history(self) -> list[tuple[int, float]]:
        """
        (samples so far, best energy) at each improvement.
        """
    @property
    def path(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        States of the scene, at rest, from the start to the first one outside, shape (P, n); P is 0 without an escape.
        """
    @property
    def samples(self) -> int:
        """
        Poses drawn.
        """
    @property
    def value(self) -> float:
        """
        As `energy`.
        """
class ContactMargins:
    """
    What the object's contacts with one kind of body can bear.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def engage(self) -> float:
        """
        Sum of the normal forces [N].
        """
    @property
    def stick(self) -> float:
        """
        Sum of the distances to the friction cones' edges [N].
        """
class ForceScore:
    """
    The wrench-based baseline, Section V-B.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    @property
    def distance(self) -> float:
        """
        Least distance between object and effector [m].
        """
    @property
    def effector(self) -> ContactMargins:
        """
        Of the contacts with all bodies of the effector.
        """
    @property
    def force(self) -> float:
        """
        Omega_force, the weighted sum.
        """
    @property
    def ground(self) -> ContactMargins:
        """
        Of the contacts with all other bodies.
        """
    @property
    def value(self) -> float:
        """
        As `force`.
        """
class ScoreRow:
    """
    The scores of one problem of a batch.
    """
    def __getstate__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    def __setstate__(self, arg0: tuple[typing.Any, ...]) -> None:
        ...
    @property
    def curves(self) -> dict[str, tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]]:
        """
        (times [s], probability of being captured throughout until each), shape (T,) both, of "probability" and "probability/any".
        """
    @property
    def diverged(self) -> int:
        """
        Rollouts of its searches that diverged.
        """
    @property
    def error(self) -> str | None:
        """
        The error of the first search that failed, or None.
        """
    @property
    def index(self) -> int:
        """
        The problem's stream index.
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def scores(self) -> dict[str, float]:
        """
        By metric.
        """
    @property
    def seconds(self) -> float:
        """
        Sum of the times of its searches [s].
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps of its rollouts.
        """
    @property
    def times(self) -> dict[str, float]:
        """
        Time of a search [s], by its first metric. The metrics of one tree share a search, and so do the probabilities.
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        Sentences that speak against the result: those of each score; more than 1 % of the steps did not converge, or of the time is lost.
        """
class ScoreRun:
    """
    A running batch on a pool of threads. Problems can be added to it.
    """
    def __init__(self, metrics: collections.abc.Sequence[str], nodes: int, seed: int, threads: int, **kwargs: typing.Any) -> None:
        """
        Starts without problems.
        """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    def add(self, problems: collections.abc.Sequence[Problem], indices: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], metrics: collections.abc.Sequence[str] | None = None) -> None:
        """
        Puts problems at the end of the queue, with their stream indices. metrics: None takes the run's.
        """
    def cancel(self) -> None:
        """
        Stops within one rollout. Problems that are not complete give no row.
        """
    def take(self, timeout: typing.SupportsFloat | typing.SupportsIndex) -> list[ScoreRow]:
        """
        Rows that are complete since the last call. Waits up to timeout [s] for the first.
        """
    @property
    def finished(self) -> bool:
        """
        Whether no row will come unless problems are added.
        """
    @property
    def pending(self) -> int:
        """
        Problems that were added and whose rows are not taken yet.
        """
class Survival:
    """
    The survival curve of one capture set over the horizon.
    """
    def __repr__(self) -> str:
        """
        Name(property=value, ...)
        """
    @property
    def captured(self) -> float:
        """
        Probability of staying captured until the horizon.
        """
    @property
    def curve(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The same until each of the times, shape (T,).
        """
    @property
    def mean_time(self) -> float:
        """
        Mean time captured within the horizon [s].
        """
class CaptureProbability:
    """
    Probability of staying captured under a stated random disturbance.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        """
        The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
            cell of a notebook fails for its picture.
        """
    def band(self, confidence: float = 0.95, which: str = 'captured') -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
        """
        (low, high), each of shape (T,): the interval of each point of the curve alone. which: 'captured' or 'any'.
        """
    def interval(self, confidence: float = 0.95, which: str = 'captured') -> tuple[float, float]:
        """
        (low, high) of the probability, by Clopper and Pearson: it holds at least as often as `confidence`.
        
        With design="sobol" it is that of the `effective` size, which blocks of the rollouts tell: it holds about as often.
        With a tolerance or a threshold it is wider, by the number of looks. which: 'captured', 'lost', 'success' or
        'any'.
        """
    @property
    def above(self) -> bool | None:
        """
        Whether the probability is above the threshold that was asked; None: that is not told.
        """
    @property
    def any(self) -> Survival | None:
        """
        Of at least one object, a Survival; None unless by_object.
        """
    @property
    def by_object(self) -> dict[str, Survival]:
        """
        A Survival for each object by its name, in the scene's order; empty unless by_object.
        """
    @property
    def captured(self) -> float:
        """
        Probability that all objects stay captured throughout the horizon.
        """
    @property
    def complete(self) -> bool:
        """
        Whether no rollout is missing. False if the timeout or the cancel came first.
        """
    @property
    def curve(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Probability of being captured throughout until each time, shape (T,).
        """
    @property
    def diverged(self) -> int:
        """
        Rollouts that diverged, and do not count.
        """
    @property
    def effective(self) -> float:
        """
        Effective sample size: rollouts of equal weight that say as much.
        """
    @property
    def exit_times(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        When each rollout leaves the capture set [s], shape (rollouts,), in the order of their numbers: inf if it stays, NaN if it diverged. Empty with rare=True; with `step` those of the long one.
        """
    @property
    def levels(self) -> float:
        """
        Levels at which replicas split, in the mean of the batches; 0 unless rare.
        """
    @property
    def long_step(self) -> float | None:
        """
        The long step that the rollouts took [s]; None if they took that of the scene.
        """
    @property
    def lost(self) -> float:
        """
        Probability that an object is lost within the horizon: 1 - captured, in full precision.
        """
    @property
    def lost_curve(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Probability of having been lost until each time, shape (T,): 1 - curve, in full precision.
        """
    @property
    def lost_time(self) -> float:
        """
        Time in which nothing moved, as bodies would have passed through each other [s].
        """
    @property
    def mean_time(self) -> float:
        """
        Mean time captured within the horizon [s], the restricted mean survival time.
        """
    @property
    def repeated(self) -> int:
        """
        Of them, those that took the scene's step too.
        """
    @property
    def rollouts(self) -> int:
        """
        Random rollouts that count; with rare=True the replicas.
        """
    @property
    def steps(self) -> int:
        """
        Simulation steps of its rollouts.
        """
    @property
    def success(self) -> float | None:
        """
        Probability of being in the success set at the horizon; None unless success.
        """
    @property
    def successes(self) -> numpy.typing.NDArray[numpy.bool] | None:
        """
        Whether each rollout ends in the success set, shape (rollouts,); None unless success.
        """
    @property
    def times(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Of the looks at the sets, shape (T,) [s].
        """
    @property
    def unconverged(self) -> int:
        """
        Of these, steps whose contact solver did not converge.
        """
    @property
    def undisturbed(self) -> bool | None:
        """
        Whether the objects stay captured without a disturbance; None with undisturbed=False.
        """
    @property
    def undisturbed_success(self) -> bool | None:
        """
        Whether the undisturbed future ends in the success set; None unless success.
        """
    @property
    def undisturbed_time(self) -> float:
        """
        When they leave without a disturbance [s]; the horizon if they stay, NaN with undisturbed=False.
        """
    @property
    def value(self) -> float:
        """
        As `captured`.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        Sentences that speak against the result: more than 1 % of the steps did not converge, or of the time is lost.
        """
def capture_probability(problem: Problem, **kwargs: typing.Any) -> CaptureProbability:
    ...
def capture_score(problem: Problem, **kwargs: typing.Any) -> CaptureScore:
    ...
def effort_lower_bound(problem: Problem, **kwargs: typing.Any) -> LowerBound:
    ...
def escape_effort(problem: Problem, **kwargs: typing.Any) -> EscapeEffort:
    ...
def escape_energy(problem: Problem, **kwargs: typing.Any) -> EscapeEnergy:
    ...
def force_score(problem: Problem, **kwargs: typing.Any) -> ForceScore:
    ...
def interval(scores: numpy.typing.ArrayLike, resolution: float, confidence: float = 0.95) -> tuple[float, float]:
    """
    (low, high), a confidence interval for the score of infinitely many trees, from those of two or more, shape (trees,). CaptureScore.interval gives the same.
    """
def mass_properties(shape: Plane | Box | Sphere | Cylinder | Capsule | ConvexHull | Compound, mass: float = 1.0) -> MassProperties:
    """
    Mass properties of a solid shape of a mass [kg], of even density.
    """
def stream(seed: int, number: int) -> int:
    """
    The seed of one of a seed's own streams.
    """
def too_many_diverged(diverged: typing.SupportsInt | typing.SupportsIndex, rollouts: typing.SupportsInt | typing.SupportsIndex) -> bool:
    """
    Whether more of so many rollouts have diverged than a probability may have by default.
    """
def warn_of_steps(steps: typing.SupportsInt | typing.SupportsIndex, unconverged: typing.SupportsInt | typing.SupportsIndex, lost_time: typing.SupportsFloat | typing.SupportsIndex, scene: Scene) -> None:
    """
    Warns if too many steps of a scene did not converge, or too much of their time is lost.
    """
FEWEST_TREES: int = 8
LEAST_GYRATION: float = 0.01
MOST_GYRATION: float = 2.0
