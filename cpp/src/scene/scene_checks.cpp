#include "scene/scene_checks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <type_traits>

#include "energymargin/plausible.hpp"
#include "energymargin/state.hpp"
#include "scene/records.hpp"

namespace energymargin {
namespace {

void validate_kinematic(const Body& body) {
  if (body.fixed()) reject("kinematic", "true", "false for a body of mass 0, which never moves");
  if (body.role == Role::object) reject("kinematic", "true", "false for an object, which disturbances move");
  if (!body.force.isZero(0.0)) reject("force", text(body.force), "0 for a kinematic body, which no force moves");
  if (body.damped()) reject("linear_damping and angular_damping", "given", "none of a kinematic body");
}

void validate_mimic(const Joint& joint) {
  const Mimic& mimic = *joint.mimic;
  if (mimic.multiplier == 0.0) reject("mimic: multiplier", "0", "another number, or a joint of type fixed");
  if (joint.type == JointType::fixed) reject("mimic", "given", "none: the joint is fixed");
  if (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0) {
    reject("stiffness, damping or held", "given", "none of them: the joint follows '" + mimic.joint + "'");
  }
  if (joint.state.position != 0.0 || joint.state.velocity != 0.0) {
    reject("position and velocity", "not 0", "0: the joint follows '" + mimic.joint + "'");
  }
  if (joint.target != 0.0 || joint.target_velocity != 0.0 || std::isfinite(joint.torque_limit)) {
    reject("target, target_velocity or torque_limit", "given",
           "none of them: the drive of '" + mimic.joint + "' moves both, within its torque_limit");
  }
  if (std::isfinite(joint.lower) || std::isfinite(joint.upper)) {
    reject("limits", "given", "none: the joint follows '" + mimic.joint + "', and stops where that one does");
  }
}

// How fast a point of a free body moves after a unit impulse there, in the direction in which it is most [1/kg].
double inverse_effective_mass(const Body& body, const Vector3& point) {
  if (!body.dynamic()) return 0.0;
  const Inertial inertial = body.principal_inertial();
  const Vector3 arm = inertial.axes.conjugate() * (point - inertial.center);
  Eigen::Matrix3d cross;
  cross << 0.0, -arm.z(), arm.y(), arm.z(), 0.0, -arm.x(), -arm.y(), arm.x(), 0.0;
  const Eigen::Matrix3d turning = -cross * inertial.moments.cwiseInverse().asDiagonal() * cross;
  return 1.0 / body.mass + Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turning).eigenvalues().maxCoeff();
}

bool share_a_body(const Spring& a, const Spring& b) {
  return a.body_a == b.body_a || a.body_a == b.body_b || a.body_b == b.body_a || a.body_b == b.body_b;
}

// A spring is stepped explicitly; beyond these it would swing itself up. Springs on one body add up.
void require_soft(const Spring& spring, double inverse_mass, const std::vector<Spring>& others, double step) {
  double stiffness = 1.0 / (inverse_mass * step * step);
  double damping = 1.0 / (inverse_mass * step);
  for (const Spring& other : others) {
    if (!share_a_body(other, spring)) continue;
    stiffness -= other.stiffness;
    damping -= other.damping;
  }
  const std::string besides = " beside the bodies' other springs at this step, or a shorter step";
  if (spring.stiffness > stiffness) {
    reject("stiffness", text(spring.stiffness), "at most " + text(stiffness) + " N/m" + besides);
  }
  if (spring.damping > damping) {
    reject("damping", text(spring.damping), "at most " + text(damping) + " N s/m" + besides);
  }
}

void validate_surface(const Surface& surface) {
  if (surface.restitution > 1.0) reject("surface: restitution", text(surface.restitution), "at most 1");
  if (surface.damping > 0.0 && !(surface.stiffness > 0.0)) {
    reject("surface: stiffness", "0", "a stiffness above 0, since damping is " + text(surface.damping));
  }
}

}  // namespace

Inertial Inertial::from_tensor(const Vector3& center, const Eigen::Matrix3d& inertia, const Quaternion& axes) {
  if (!inertia.allFinite() || !inertia.isApprox(inertia.transpose(), 1e-9)) {
    reject("inertia", inertia.allFinite() ? "not symmetric" : "not finite", "a symmetric matrix of finite numbers");
  }
  require_finite("center", center);
  require_unit("axes", axes);
  Inertial inertial{center, inertia.diagonal(), axes};
  if (!inertia.isDiagonal(0.0)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
    Eigen::Matrix3d principal = solver.eigenvectors();
    if (principal.determinant() < 0.0) principal.col(0) = -principal.col(0);
    inertial.moments = solver.eigenvalues();
    inertial.axes = (axes * Quaternion(principal)).normalized();
  }
  require_form("inertia", inertial.moments, Form::moments);
  return inertial;
}

Inertial Body::principal_inertial() const {
  if (!dynamic()) return {Vector3::Zero(), Vector3::Zero(), Quaternion::Identity()};
  if (inertial) return *inertial;
  const MassProperties even = mass_properties(shape, mass);
  return {even.center, even.moments, even.axes};
}

std::shared_ptr<const BodyConstants> validate_body(const Body& body) {
  const std::string name = "body '" + body.name + "': ";
  std::shared_ptr<const BodyConstants> constants;
  at_place(name, [&] {
    validate(body.shape);
    if (std::holds_alternative<Plane>(body.shape) && !body.fixed()) {
      reject("mass", text(body.mass), "0: a plane is fixed");
    }
    require_fields(body);
    constants = std::make_shared<BodyConstants>(body);
    const double extent = 2.0 * constants->smallest_half_extent();
    if (std::isfinite(extent) && extent > plausible::refused_extent) {
      reject("its least extent", text(extent) + " m", "at most " + text(plausible::refused_extent) + " m");
    }
    if (!body.inertial && body.dynamic() && !(constants->inertial().moments.array() > 0.0).all()) {
      reject("inertial", "not given", "one for a body with a mass and without a volume");
    }
    if (body.kinematic) validate_kinematic(body);
    if (body.surface) validate_surface(*body.surface);
    validate(body, body.state, "");
  });
  if (body.role == Role::object && body.fixed()) {
    throw std::invalid_argument(name + "mass is 0, expected a mass above 0: the object must be able to move");
  }
  return constants;
}

std::vector<Part> solids_of(const Shape& shape) {
  return std::visit(
      [](const auto& of) -> std::vector<Part> {
        using Kind = std::decay_t<decltype(of)>;
        if constexpr (std::is_same_v<Kind, Compound>) {
          return of.parts;
        } else if constexpr (std::is_same_v<Kind, Plane>) {
          return {};
        } else {
          return {{of}};
        }
      },
      shape);
}

BodyConstants::BodyConstants(const Body& body) : inertial_(body.principal_inertial()) {
  const auto half_extent = [](const auto& solid) { return energymargin::smallest_half_extent(solid); };
  for (const Part& part : solids_of(body.shape)) half_extents_.push_back(std::visit(half_extent, part.shape));
}

double BodyConstants::smallest_half_extent() const {
  if (half_extents_.empty()) return std::numeric_limits<double>::infinity();
  return *std::max_element(half_extents_.begin(), half_extents_.end());
}

const CollisionShape& BodyConstants::collision_shape(const Body& body, std::optional<double> margin) const {
  std::call_once(shape_made_, [&] { collision_shape_ = make_collision_shape(body, *this, margin); });
  return *collision_shape_;
}

double beyond_limits(const Joint& joint, double position) {
  const double slack = joint.type == JointType::revolute ? plausible::stop_angle : plausible::stop_length;
  const double beyond = std::max(joint.lower - position, position - joint.upper);
  return beyond > slack ? beyond : 0.0;
}

void validate_joint(const Joint& joint) {
  if (joint.name.empty()) reject("name", "empty", "a name that no other joint has");
  if (!(joint.lower < joint.upper)) {
    reject("lower limit", text(joint.lower), "a number below the upper limit, " + text(joint.upper));
  }
  require_fields(joint);
  if (joint.type == JointType::fixed && (joint.state.position != 0.0 || joint.state.velocity != 0.0)) {
    reject("position and velocity", "not 0", "0: the joint is fixed");
  }
  for (const auto& [name, value] : {std::pair{"armature", joint.armature}, std::pair{"friction", joint.friction}}) {
    if (value != 0.0 && !joint.moves()) reject(name, text(value), "0: the joint is fixed, or follows another one");
  }
  if (joint.type == JointType::fixed && (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0)) {
    reject("stiffness, damping or held", "given", "none of them: the joint is fixed");
  }
  validate(joint, joint.state, "");
  if (beyond_limits(joint, joint.state.position) > 0.0) {
    reject("position", text(joint.state.position), "from " + text(joint.lower) + " to " + text(joint.upper));
  }
  for (const double limit : {joint.lower, joint.upper}) {
    if (joint.type == JointType::revolute && std::isfinite(limit) && std::abs(limit) > plausible::refused_angle) {
      reject("limits", text(limit), "angles of at most " + text(plausible::refused_angle) + " rad, or inf for none");
    }
  }
  if (joint.mimic) validate_mimic(joint);
}

void validate_tendon(const Tendon& tendon) {
  if (tendon.name.empty()) reject("name", "empty", "a name that no other tendon has");
  require_fields(tendon);
  if (!(tendon.lower < tendon.upper)) {
    reject("lower limit", text(tendon.lower), "a number below the upper limit, " + text(tendon.upper));
  }
  if (tendon.joints.empty()) reject("joints", "none", "at least one joint");
  std::set<std::string> names;
  for (const TendonJoint& of : tendon.joints) {
    require_fields(of, "joint '" + of.joint + "': ");
    if (of.coefficient == 0.0) reject("joint '" + of.joint + "': coefficient", "0", "another number");
    if (!names.insert(of.joint).second) reject("joints", "'" + of.joint + "' twice", "each joint once");
  }
}

void validate_spring(const Spring& spring, const Body& a, const Body& b, const std::vector<Spring>& others,
                     double step) {
  if (a.name == b.name) reject("body_b", "'" + spring.body_b + "'", "another body than body_a");
  require_fields(spring);
  const double inverse_mass = inverse_effective_mass(a, spring.point_a) + inverse_effective_mass(b, spring.point_b);
  if (inverse_mass == 0.0) reject("body_b", "'" + spring.body_b + "'", "at most one fixed or kinematic body");
  require_soft(spring, inverse_mass, others, step);
}

}  // namespace energymargin
