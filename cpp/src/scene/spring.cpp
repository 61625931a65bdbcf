#include <Eigen/Eigenvalues>

#include "base/check.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin {
namespace {

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

}  // namespace

void validate_spring(const Spring& spring, const Body& a, const Body& b, const std::vector<Spring>& others,
                     double step) {
  if (a.name == b.name) reject("body_b", "'" + spring.body_b + "'", "another body than body_a");
  require_finite("point_a", spring.point_a);
  require_finite("point_b", spring.point_b);
  require_not_negative("stiffness", spring.stiffness);
  require_not_negative("rest_length", spring.rest_length);
  require_not_negative("damping", spring.damping);
  const double inverse_mass = inverse_effective_mass(a, spring.point_a) + inverse_effective_mass(b, spring.point_b);
  if (inverse_mass == 0.0) reject("body_b", "'" + spring.body_b + "'", "at most one fixed or kinematic body");
  require_soft(spring, inverse_mass, others, step);
}

}  // namespace energymargin
