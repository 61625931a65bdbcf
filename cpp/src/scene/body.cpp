#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/check.hpp"
#include "energymargin/plausible.hpp"
#include "energymargin/state.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin {
namespace {

void validate_factor(const std::string& name, const Vector3& factor) {
  for (const double value : factor) {
    if (value != 0.0 && value != 1.0) reject(name, text(factor), "0 (locked) or 1 (free) for each axis");
  }
}

void validate_kinematic(const Body& body) {
  if (body.fixed()) reject("kinematic", "true", "false for a body of mass 0, which never moves");
  if (body.role == Role::object) reject("kinematic", "true", "false for an object, which disturbances move");
  if (!body.force.isZero(0.0)) reject("force", text(body.force), "0 for a kinematic body, which no force moves");
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
  validate_moments("inertia", inertial.moments);
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
  try {
    validate(body.shape);
    if (std::holds_alternative<Plane>(body.shape) && !body.fixed()) {
      reject("mass", text(body.mass), "0: a plane is fixed");
    }
    require_not_negative("mass", body.mass);
    constants = std::make_shared<BodyConstants>(body);
    const double extent = 2.0 * constants->smallest_half_extent();
    if (std::isfinite(extent) && extent > plausible::refused_extent) {
      reject("its least extent", text(extent) + " m", "at most " + text(plausible::refused_extent) + " m");
    }
    if (body.inertial) {
      require_finite("inertial: center", body.inertial->center);
      require_unit("inertial: axes", body.inertial->axes);
      validate_moments("inertial: moments", body.inertial->moments);
    } else if (body.dynamic() && !(constants->inertial().moments.array() > 0.0).all()) {
      reject("inertial", "not given", "one for a body with a mass and without a volume");
    }
    require_not_negative("friction", body.friction);
    require_finite("force", body.force);
    if (body.kinematic) validate_kinematic(body);
    validate_factor("linear_factor", body.linear_factor);
    validate_factor("angular_factor", body.angular_factor);
    validate(body, body.state, "");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + error.what());
  }
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

}  // namespace energymargin
