#include "energymargin/scene.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/plausible.hpp"
#include "energymargin/state.hpp"

namespace energymargin {
namespace {

void validate_factor(const std::string& name, const Vector3& factor) {
  for (const double value : factor) {
    if (value != 0.0 && value != 1.0) reject(name, text(factor), "0 (locked) or 1 (free) for each axis");
  }
}

void validate_body(const Body& body) {
  const std::string name = "body '" + body.name + "': ";
  try {
    validate(body.shape);
    if (std::holds_alternative<Plane>(body.shape) && !body.fixed()) {
      reject("mass", text(body.mass), "0: a plane is fixed");
    }
    require_not_negative("mass", body.mass);
    const double extent = 2.0 * smallest_half_extent(body.shape);
    if (std::isfinite(extent) && extent > plausible::refused_extent) {
      reject("its least extent", text(extent) + " m", "at most " + text(plausible::refused_extent) + " m");
    }
    if (body.inertial) {
      require_finite("inertial: center", body.inertial->center);
      require_unit("inertial: axes", body.inertial->axes);
      validate_moments("inertial: moments", body.inertial->moments);
    } else if (!body.fixed() && !(body.principal_inertial().moments.array() > 0.0).all()) {
      reject("inertial", "not given", "one for a body with a mass and without a volume");
    }
    require_not_negative("friction", body.friction);
    require_finite("force", body.force);
    validate_factor("linear_factor", body.linear_factor);
    validate_factor("angular_factor", body.angular_factor);
    validate(body, body.state, "");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + error.what());
  }
  if (body.role == Role::object && body.fixed()) {
    throw std::invalid_argument(name + "mass is 0, expected a mass above 0: the object must be able to move");
  }
}

void validate_mimic(const Joint& joint) {
  const Mimic& mimic = *joint.mimic;
  require_finite("mimic multiplier", mimic.multiplier);
  require_finite("mimic offset", mimic.offset);
  if (mimic.multiplier == 0.0) reject("mimic multiplier", "0", "another number, or a joint of type fixed");
  if (joint.type == JointType::fixed) reject("mimic", "given", "none: the joint is fixed");
  if (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0) {
    reject("stiffness, damping or held", "given", "none of them: the joint follows '" + mimic.joint + "'");
  }
  if (joint.state.position != 0.0 || joint.state.velocity != 0.0) {
    reject("position and velocity", "not 0", "0: the joint follows '" + mimic.joint + "'");
  }
  if (std::isfinite(joint.lower) || std::isfinite(joint.upper)) {
    reject("limits", "given", "none: the joint follows '" + mimic.joint + "', and stops where that one does");
  }
}

void validate_joint(const Joint& joint) {
  if (joint.name.empty()) reject("name", "empty", "a name that no other joint has");
  for (const auto& [name, pose] : {std::pair{"in_parent", joint.in_parent}, {"in_child", joint.in_child}}) {
    require_finite(std::string(name) + " position", pose.position);
    require_unit(std::string(name) + " orientation", pose.orientation);
  }
  require_unit("axis", joint.axis);
  if (!(joint.lower < joint.upper)) {
    reject("lower limit", text(joint.lower), "a number below the upper limit, " + text(joint.upper));
  }
  if (joint.type == JointType::fixed && (joint.state.position != 0.0 || joint.state.velocity != 0.0)) {
    reject("position and velocity", "not 0", "0: the joint is fixed");
  }
  if (joint.type == JointType::fixed && (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0)) {
    reject("stiffness, damping or held", "given", "none of them: the joint is fixed");
  }
  validate(joint, joint.state, "");
  for (const double limit : {joint.lower, joint.upper}) {
    if (joint.type != JointType::revolute || !std::isfinite(limit)) continue;
    if (std::abs(limit) > plausible::refused_angle) {
      reject("limits", text(limit), "angles of at most " + text(plausible::refused_angle) + " rad, or inf for none");
    }
  }
  require_finite("target", joint.target);
  require_finite("target_velocity", joint.target_velocity);
  require_not_negative("stiffness", joint.stiffness);
  require_not_negative("damping", joint.damping);
  if (joint.mimic) validate_mimic(joint);
  if (!(joint.torque_limit >= 0.0)) reject("torque_limit", text(joint.torque_limit), "a number of at least 0");
}

// Bullet's articulated bodies move freely or along their joints; they know no locked axes.
void require_hangable(const Body& body, const std::string& what) {
  if (body.fixed()) reject(what, "'" + body.name + "'", "a body with a mass above 0; this one is fixed");
  if (body.linear_factor != Vector3::Ones() || body.angular_factor != Vector3::Ones()) {
    reject(what, "'" + body.name + "'", "a body without locked axes");
  }
}

// How fast a point of a free body moves after a unit impulse there, in the direction in which it is most [1/kg].
double inverse_effective_mass(const Body& body, const Vector3& point) {
  if (body.fixed()) return 0.0;
  const Inertial inertial = body.principal_inertial();
  const Vector3 arm = inertial.axes.conjugate() * (point - inertial.center);
  Eigen::Matrix3d cross;
  cross << 0.0, -arm.z(), arm.y(), arm.z(), 0.0, -arm.x(), -arm.y(), arm.x(), 0.0;
  const Eigen::Matrix3d turning = -cross * inertial.moments.cwiseInverse().asDiagonal() * cross;
  return 1.0 / body.mass + Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turning).eigenvalues().maxCoeff();
}

template <typename Named>
std::size_t find(const std::unordered_map<std::string, std::size_t>& indices, const std::vector<Named>& all,
                 const std::string& name, const std::string& what) {
  if (const auto found = indices.find(name); found != indices.end()) return found->second;
  std::string names;
  for (const Named& one : all) names += (names.empty() ? "'" : ", '") + one.name + "'";
  reject(what, "'" + name + "'", all.empty() ? "a " + what + ", but the scene has none" : "one of " + names);
}

void validate(const Stepping& stepping) {
  require_positive("step", stepping.step);
  if (stepping.step > plausible::refused_step) {
    reject("step", text(stepping.step), "at most " + text(plausible::refused_step) + " s");
  }
  if (stepping.iterations < 1 || stepping.iterations > most_solver_iterations) {
    reject("solver_iterations", std::to_string(stepping.iterations),
           "a whole number from 1 to " + std::to_string(most_solver_iterations));
  }
  require_not_negative("solver_tolerance", stepping.tolerance);
  if (stepping.friction_directions != 1 && stepping.friction_directions != 2) {
    reject("friction_directions", std::to_string(stepping.friction_directions), "1 or 2");
  }
  if (stepping.margin) require_positive("margin", *stepping.margin);
}

}  // namespace

Inertial inertial(const Vector3& center, const Eigen::Matrix3d& inertia, const Quaternion& axes) {
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
  validate_moments("inertia", inertial.moments);
  return inertial;
}

Inertial Body::principal_inertial() const {
  if (fixed()) return {Vector3::Zero(), Vector3::Zero(), Quaternion::Identity()};
  if (inertial) return *inertial;
  const MassProperties even = mass_properties(shape, mass);
  return {even.center, even.moments, even.axes};
}

Scene::Scene(const Vector3& gravity, const Stepping& stepping) : gravity_(gravity), stepping_(stepping) {
  require_finite("gravity", gravity);
  validate(stepping);
}

Scene Scene::with_stepping(const Stepping& stepping) const {
  validate(stepping);
  Scene scene = *this;
  scene.stepping_ = stepping;
  return scene;
}

std::size_t Scene::add_body(Body body) {
  if (body.name.empty()) reject("name", "empty", "a name that no other body of the scene has");
  if (body.name == "joints") reject("name", "'joints'", "another name: a state calls its joints so");
  if (body_indices_.count(body.name)) {
    reject("name", "'" + body.name + "'", "a name that no other body of the scene has");
  }
  validate_body(body);
  body_indices_[body.name] = bodies_.size();
  joints_to_.emplace_back();
  joints_below_.emplace_back();
  bodies_.push_back(std::move(body));
  return bodies_.size() - 1;
}

std::size_t Scene::add_joint(Joint joint) {
  const std::string where = "joint '" + joint.name + "': ";
  std::size_t parent = 0;
  std::size_t child = 0;
  try {
    validate_joint(joint);
    if (stepping_.friction_directions != 2)
      reject("friction_directions of the scene", "1", "2 for a scene with joints");
    if (joint_indices_.count(joint.name)) reject("name", "'" + joint.name + "'", "a name that no other joint has");
    parent = index(joint.parent);
    child = index(joint.child);
    require_hangable(bodies_[child], "child");
    if (!bodies_[parent].fixed()) require_hangable(bodies_[parent], "parent");
    if (joint_to(child)) reject("child", "'" + joint.child + "'", "a body that no other joint carries");
    if (carries(child, parent)) reject("parent", "'" + joint.parent + "'", "a body that the child does not carry");
    if (joint.mimic && !joints_[joint_index(joint.mimic->joint)].moves()) {
      reject("mimic", "of '" + joint.mimic->joint + "'", "of a joint that moves, and follows no other");
    }
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(where + error.what());
  }
  joint_indices_[joint.name] = joints_.size();
  joints_to_[child] = joints_.size();
  joints_below_[parent].push_back(joints_.size());
  joints_.push_back(std::move(joint));
  place_links(joints_.size() - 1);
  return joints_.size() - 1;
}

// Whether a body is another one, or hangs on it. Most bodies that are hung carry nothing: then there is no way up to
// go.
bool Scene::carries(std::size_t above, std::size_t body) const {
  if (above == body) return true;
  if (joints_below_[above].empty()) return false;
  while (const auto up = joint_to(body)) {
    body = index(joints_[*up].parent);
    if (body == above) return true;
  }
  return false;
}

// Places the link that a joint carries and all that hangs on it; the other links stay where they are.
void Scene::place_links(std::size_t joint) {
  for (std::vector<std::size_t> left{joint}; !left.empty();) {
    const Joint& next = joints_[left.back()];
    left.pop_back();
    const std::size_t child = index(next.child);
    JointState state = next.state;
    if (const auto& mimic = next.mimic) {
      const JointState& source = joints_[joint_index(mimic->joint)].state;
      state = {mimic->multiplier * source.position + mimic->offset, mimic->multiplier * source.velocity};
    }
    bodies_[child].state = carried(next, state, bodies_[index(next.parent)].state);
    left.insert(left.end(), joints_below_[child].begin(), joints_below_[child].end());
  }
}

void Scene::add_spring(Spring spring) {
  const std::string where = "spring '" + spring.body_a + "' - '" + spring.body_b + "': ";
  try {
    const std::size_t a = index(spring.body_a);
    const std::size_t b = index(spring.body_b);
    if (a == b) reject("body_b", "'" + spring.body_b + "'", "another body than body_a");
    require_finite("point_a", spring.point_a);
    require_finite("point_b", spring.point_b);
    require_not_negative("stiffness", spring.stiffness);
    require_not_negative("rest_length", spring.rest_length);
    require_not_negative("damping", spring.damping);
    const double light =
        inverse_effective_mass(bodies_[a], spring.point_a) + inverse_effective_mass(bodies_[b], spring.point_b);
    if (light == 0.0) reject("body_b", "'" + spring.body_b + "'", "at most one fixed body");
    // A spring is stepped explicitly; beyond these it would swing itself up. Springs on one body add up.
    double stiffness = 1.0 / (light * stepping_.step * stepping_.step);
    double damping = 1.0 / (light * stepping_.step);
    for (const Spring& other : springs_) {
      const bool shares = other.body_a == spring.body_a || other.body_a == spring.body_b ||
                          other.body_b == spring.body_a || other.body_b == spring.body_b;
      if (!shares) continue;
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
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(where + error.what());
  }
  springs_.push_back(std::move(spring));
}

void Scene::disable_collisions(const std::string& body_a, const std::string& body_b) {
  if (index(body_a) == index(body_b)) reject("body_b", "'" + body_b + "'", "another body than body_a");
  disabled_.insert(std::minmax(body_a, body_b));
}

std::size_t Scene::index(const std::string& name) const { return find(body_indices_, bodies_, name, "body"); }

std::size_t Scene::joint_index(const std::string& name) const { return find(joint_indices_, joints_, name, "joint"); }

std::optional<std::size_t> Scene::joint_to(std::size_t body) const { return joints_to_[body]; }

bool Scene::jointed(std::size_t body) const { return joints_to_[body] || !joints_below_[body].empty(); }

std::vector<std::size_t> Scene::with_role(Role role) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].role == role) found.push_back(i);
  }
  return found;
}

}  // namespace energymargin
