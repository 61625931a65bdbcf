#pragma once
// The words of enums, and the fields of shapes, bodies, joints and springs, in the order of problem files.

#include <tuple>

#include "base/record.hpp"
#include "base/words.hpp"
#include "energymargin/scene.hpp"

namespace energymargin {

template <>
struct Words<Role> {
  static constexpr std::pair<const char*, Role> all[]{
      {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
};

template <>
struct Words<FrictionRule> {
  static constexpr std::pair<const char*, FrictionRule> all[]{{"product", FrictionRule::product},
                                                              {"max", FrictionRule::max}};
};

template <>
struct Words<EngineKind> {
  static constexpr std::pair<const char*, EngineKind> all[]{{"native", EngineKind::native},
                                                            {"bullet", EngineKind::bullet}};
};

template <>
struct Words<JointType> {
  static constexpr std::pair<const char*, JointType> all[]{
      {"fixed", JointType::fixed}, {"revolute", JointType::revolute}, {"prismatic", JointType::prismatic}};
};

constexpr auto describe(Type<Plane>) {
  return Alternative{"plane", "The half space below a plane, {x : normal . x <= offset}; only fixed bodies have it.",
                     Field{"normal", &Plane::normal, "Unit vector out of the solid.", forms::direction},
                     Field{"offset", &Plane::offset, "Of the surface along the normal [m]."}};
}

constexpr auto describe(Type<Box>) {
  return Alternative{"box", "A box along the axes of its frame, about its origin.",
                     Field{"size", &Box::size, "Full edge lengths along x, y, z [m].", forms::positive_list}};
}

constexpr auto describe(Type<Sphere>) {
  return Alternative{"sphere", "A sphere about the origin of its frame.",
                     Field{"radius", &Sphere::radius, "[m]", forms::positive}};
}

constexpr auto describe(Type<Cylinder>) {
  return Alternative{"cylinder", "A cylinder about its own z axis.",
                     Field{"radius", &Cylinder::radius, "[m]", forms::positive},
                     Field{"length", &Cylinder::length, "Along z [m].", forms::positive}};
}

constexpr auto describe(Type<Capsule>) {
  return Alternative{"capsule", "A capsule about its own z axis.",
                     Field{"radius", &Capsule::radius, "[m]", forms::positive},
                     Field{"length", &Capsule::length, "Of the cylindrical part, along z [m].", forms::positive}};
}

constexpr auto describe(Type<ConvexHull>) {
  return Alternative{
      "convex_hull", "The convex hull of points in the body's frame.",
      Field{"points", &ConvexHull::points, "In the shape's frame [m]; they span a volume.", forms::points}};
}

constexpr auto describe(Type<MassProperties>) {
  return Description{"mass_properties",
                     "Mass properties of a solid, for a mass of 1 kg.",
                     Field{"volume", &MassProperties::volume, "[m^3]", forms::positive},
                     Field{"center", &MassProperties::center, "Centre of mass in the shape's frame [m]."},
                     Field{"moments", &MassProperties::moments, "Principal moments about the centre of mass [kg m^2].",
                           forms::moments},
                     Field{"axes", &MassProperties::axes,
                           "Unit quaternion x, y, z, w that turns the principal axes into the shape's frame."}};
}

constexpr auto describe(Type<Part>) {
  return Description{
      "part", "A solid at its place in a compound.", Field{"shape", &Part::shape, "The solid."},
      Field{"position", [](auto& part) -> auto& { return part.pose.position; }, "Of the part in the body's frame [m]."},
      Field{"orientation", [](auto& part) -> auto& { return part.pose.orientation; }, nullptr}};
}

constexpr auto describe(Type<Compound>) {
  return Alternative{"compound", "Several solids that move as one. Without parts there is nothing to collide with.",
                     Field{"parts", &Compound::parts, "Solids, each at its place in the body's frame."},
                     Field{"solid", &Compound::solid,
                           "Of the solid that the parts stand for, as of a mesh; unset: those of the parts together.",
                           Presence::optional}};
}

constexpr auto describe(Type<Pose>) {
  return Description{"pose", "A frame in another one.",
                     Field{"position", &Pose::position, "Of the frame's origin [m]."},
                     Field{"orientation", &Pose::orientation, nullptr}};
}

constexpr auto describe(Type<Inertial>) {
  return Description{
      "inertial", "Mass properties of a body, in its frame.", Field{"center", &Inertial::center, "Centre of mass [m]."},
      Field{"moments", &Inertial::moments, "Principal moments about the centre of mass [kg m^2].", forms::moments},
      Field{"axes", &Inertial::axes,
            "Unit quaternion x, y, z, w that turns the principal axes into the body's frame."}};
}

constexpr auto describe(Type<Surface>) {
  return Description{
      "surface",
      "How a body meets others, beside its friction.",
      Field{"torsional_friction", &Surface::torsional_friction,
            "Torque about a contact's normal by its normal force, within the cone of its friction; of two bodies the "
            "larger counts [m].",
            forms::not_negative, Presence::optional},
      Field{"rolling_friction", &Surface::rolling_friction, "As torsional_friction, about the contact's plane [m].",
            forms::not_negative, Presence::optional},
      Field{"patch_radius", &Surface::patch_radius,
            "Radius of the patch over which it spreads what presses at a point; above 0 friction acts in the middle of "
            "what two faces share, with the torque of an even pressure; the larger counts [m].",
            forms::not_negative, Presence::optional},
      Field{"restitution", &Surface::restitution,
            "Share of the speed at which bodies meet that they part with, above .1 m/s; 0 to 1; the larger counts.",
            forms::not_negative, Presence::optional},
      Field{"stiffness", &Surface::stiffness,
            "Of each contact point, in series with the other body's; 0: as hard as the step allows [N/m].",
            forms::not_negative, Presence::optional},
      Field{"damping", &Surface::damping, "Beside a stiffness above 0 [N s/m].", forms::not_negative,
            Presence::optional}};
}

constexpr auto body_place() {
  return std::tuple{Field{"name", &Body::name, "Unique among the bodies; not \"joints\"."},
                    Field{"shape", &Body::shape, "Its frame is the body's."},
                    Field{"mass", &Body::mass, "[kg]; 0: fixed.", forms::not_negative},
                    Field{"position", [](auto& body) -> auto& { return body.state.position; },
                          "Of the body's frame in the world [m]."},
                    Field{"orientation", [](auto& body) -> auto& { return body.state.orientation; }, nullptr}};
}

//! With the same names and defaults in Python.
constexpr auto body_settings() {
  return std::tuple{
      Field{"velocity", [](auto& body) -> auto& { return body.state.velocity; },
            "Of the frame's origin, in the world's axes [m/s]."},
      Field{"angular_velocity", [](auto& body) -> auto& { return body.state.angular_velocity; },
            "In the world's axes [rad/s]."},
      Field{"friction", &Body::friction,
            "The coefficient of a contact follows from those of its two bodies, by the scene's rule.",
            forms::not_negative},
      Field{"surface", &Body::surface, "How it meets others, beside its friction; unset: as a rigid body.",
            Presence::optional},
      Field{"surface_velocity", &Body::surface_velocity,
            "Of its surface beside that of the body, in its frame, as of a conveyor belt [m/s].", Presence::optional},
      Field{"role", &Body::role,
            "object: disturbances act on it, and it can escape. effector: a part of the robot. none: environment."},
      Field{"linear_factor", &Body::linear_factor, "For the world's x, y, z: 1, free along the axis, or 0, locked.",
            forms::factors},
      Field{"angular_factor", &Body::angular_factor, "For the world's x, y, z: 1, free about the axis, or 0, locked.",
            forms::factors},
      Field{"force", &Body::force, "Acts at the centre of mass all the time, in the world's axes [N].",
            Presence::added},
      Field{"linear_damping", &Body::linear_damping,
            "Resists the velocity of the centre of mass; of a link its joint's does [N s/m].", forms::not_negative,
            Presence::optional},
      Field{"angular_damping", &Body::angular_damping, "Resists its turning, as linear_damping [N m s/rad].",
            forms::not_negative, Presence::optional},
      Field{"inertial", &Body::inertial, "Its centre of mass and inertia; unset: those of the shape, of even density.",
            Presence::optional},
      Field{"kinematic", &Body::kinematic,
            "It goes on as it moves, or as a plan says, whatever it meets: as a body of infinite mass.",
            Presence::optional}};
}

constexpr auto describe(Type<Body>) {
  return Description{
      "body",
      "One rigid body. The child of a joint is where the joint says; its position and velocity here do not count.",
      std::tuple_cat(body_place(), body_settings())};
}

constexpr auto describe(Type<PairFriction>) {
  return Description{"pair_friction",
                     "The coefficient of the contacts of two bodies, whatever the scene's rule makes of theirs.",
                     Field{"body_a", &PairFriction::body_a, "One of the two bodies.", forms::body},
                     Field{"body_b", &PairFriction::body_b, "The other one.", forms::body},
                     Field{"friction", &PairFriction::friction, "The contacts' coefficient.", forms::not_negative},
                     Field{"torsional_friction", &PairFriction::torsional_friction, "[m]; unset: that of the surfaces.",
                           forms::not_negative, Presence::optional},
                     Field{"rolling_friction", &PairFriction::rolling_friction, "[m]; unset: that of the surfaces.",
                           forms::not_negative, Presence::optional}};
}

constexpr auto describe(Type<Mimic>) {
  return Description{
      "mimic",
      "The joint follows another one: position = multiplier * (that joint's position) + offset, always. Then it is not "
      "held, has no limits and no drive of its own.",
      Field{"joint", &Mimic::joint, "The joint that is followed: an earlier one that moves and follows no other."},
      Field{"multiplier", &Mimic::multiplier, "Of that joint's position; not 0."},
      Field{"offset", &Mimic::offset, "[rad] or [m]"}};
}

//! The control of a joint or a tendon.
template <typename Controlled>
constexpr auto control_fields() {
  return std::tuple{
      Field{"target_velocity", &Controlled::target_velocity, "[rad/s]"},
      Field{"stiffness", &Controlled::stiffness, "[N m/rad]", forms::not_negative},
      Field{"damping", &Controlled::damping, "[N m s/rad]", forms::not_negative},
      Field{"torque_limit", &Controlled::torque_limit, "[N m]; infinite: without limit.", forms::largest_size}};
}

//! Where a joint is, and how it moves. Python has other names for some of them.
constexpr auto joint_motion() {
  return std::tuple{
      Field{"name", &Joint::name, "Unique among the joints."},
      Field{"type", &Joint::type,
            "fixed: the two move as one. revolute: turns about its axis. prismatic: slides along its axis."},
      Field{"parent", &Joint::parent, "The body that carries the child.", forms::body},
      Field{"child", &Joint::child, "The body that is carried; it can move, and is on no other joint.", forms::body},
      Field{"in_parent", &Joint::in_parent, "The joint's frame in the parent's."},
      Field{"in_child", &Joint::in_child, "The joint's frame in the child's; the two are one at position 0."},
      Field{"axis", &Joint::axis, "Unit vector in the joint's frame.", forms::direction},
      Field{"lower", &Joint::lower, "Limit [rad], or \"-inf\".", forms::lower_limit},
      Field{"upper", &Joint::upper, "Limit [rad], or \"inf\".", forms::upper_limit},
      Field{"position", [](auto& joint) -> auto& { return joint.state.position; },
            "Its position where none is given [rad]."},
      Field{"velocity", [](auto& joint) -> auto& { return joint.state.velocity; }, "[rad/s]"},
      Field{"held", &Joint::held, "It keeps the position that it has, whatever the load."},
      Field{"target", &Joint::target, "[rad]"}};
}

//! Its control and the like: the same names and defaults in Python.
constexpr auto joint_drive() {
  return std::tuple_cat(
      control_fields<Joint>(),
      std::tuple{Field{"mimic", &Joint::mimic, "The joint that it follows, and how; unset: none.", Presence::optional},
                 Field{"armature", &Joint::armature,
                       "Inertia of the drive's rotor times the square of the gear ratio [kg m^2].", forms::not_negative,
                       Presence::optional},
                 Field{"friction", &Joint::friction, "Dry friction: torque that resists motion, up to this [N m].",
                       forms::not_negative, Presence::optional}});
}

constexpr auto describe(Type<Joint>) {
  return Description{
      "joint",
      "A joint that carries the child on the parent. It is driven by the torque stiffness (target - position) + "
      "damping (target_velocity - velocity), within its limit. For a prismatic joint read m for rad and N for N m.",
      std::tuple_cat(joint_motion(), joint_drive())};
}

constexpr auto describe(Type<TendonJoint>) {
  return Description{"tendon_joint", "A joint of a tendon.",
                     Field{"joint", &TendonJoint::joint, "One that is not fixed."},
                     Field{"coefficient", &TendonJoint::coefficient, "Of its position; not 0."}};
}

constexpr auto describe(Type<Tendon>) {
  return Description{
      "tendon",
      "A fixed tendon: its length is a sum of joints' positions, each times a coefficient. It has a control, limits "
      "and dry friction along its length, as a joint has.",
      std::tuple_cat(
          std::tuple{Field{"name", &Tendon::name, "Unique among the tendons and joints."},
                     Field{"joints", &Tendon::joints, "What its length is the sum of."},
                     Field{"lower", &Tendon::lower, "Limit of the length, or \"-inf\".", forms::lower_limit},
                     Field{"upper", &Tendon::upper, "Limit of the length, or \"inf\".", forms::upper_limit},
                     Field{"target", &Tendon::target, "Of the length."}},
          control_fields<Tendon>(),
          std::tuple{Field{"friction", &Tendon::friction, "Dry friction along the length.", forms::not_negative}})};
}

template <>
struct Words<LoopType> {
  static constexpr std::pair<const char*, LoopType> all[]{{"point", LoopType::point}, {"weld", LoopType::weld}};
};

constexpr auto describe(Type<Loop>) {
  return Description{
      "loop",
      "A frame of one body and a frame of another stay together: it closes a loop of joints, or ties free bodies.",
      Field{"body_a", &Loop::body_a, "One of the two bodies.", forms::body},
      Field{"body_b", &Loop::body_b, "The other one.", forms::body},
      Field{"type", &Loop::type, "point: the frames' origins stay together, as in a ball joint. weld: the frames do."},
      Field{"point_a", &Loop::point_a, "Origin of the frame of body_a in the body's [m]."},
      Field{"point_b", &Loop::point_b, "Origin of the frame of body_b in the body's [m]."},
      Field{"orientation_a", &Loop::orientation_a, "Of the frame of body_a in the body's: unit quaternion x, y, z, w."},
      Field{"orientation_b", &Loop::orientation_b,
            "Of the frame of body_b in the body's: unit quaternion x, y, z, w."}};
}

constexpr auto describe(Type<Spring>) {
  return Description{"spring",
                     "A spring between a point of one body and a point of another.",
                     Field{"body_a", &Spring::body_a, "The body at one end.", forms::body},
                     Field{"body_b", &Spring::body_b, "The body at the other end, another one.", forms::body},
                     Field{"point_a", &Spring::point_a, "In the frame of body_a [m]."},
                     Field{"point_b", &Spring::point_b, "In the frame of body_b [m]."},
                     Field{"stiffness", &Spring::stiffness, "[N/m]", forms::not_negative},
                     Field{"rest_length", &Spring::rest_length, "[m]", forms::not_negative},
                     Field{"damping", &Spring::damping, "Along the spring [N s/m].", forms::not_negative}};
}

}  // namespace energymargin
