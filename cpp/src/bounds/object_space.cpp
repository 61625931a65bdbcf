#include "bounds/object_space.hpp"

#include <algorithm>

#include "bounds/infinity.hpp"
#include "energymargin/kinematics.hpp"

namespace energymargin::bounds {

ObjectSpace::ObjectSpace(const Problem& problem, std::size_t object) {
  const Body& body = problem.scene.bodies()[object];
  const std::optional<double>& margin = problem.scene.stepping().margin;
  const BodyState start = Kinematics(problem.scene)(problem.state.data(), object);
  const double turns = body.angular_factor.sum();
  any_turn_ = std::holds_alternative<Sphere>(body.shape) || turns > 1.0;
  const std::vector<ConvexPiece> pieces = convex_pieces(body.shape, Pose{}, margin);
  reference_ = problem.scene.inertial(object).center;
  if (any_turn_ && !pieces.empty()) {
    const auto thinner = [](const ConvexPiece& a, const ConvexPiece& b) { return a.inner_radius() < b.inner_radius(); };
    const ConvexPiece& widest = *std::max_element(pieces.begin(), pieces.end(), thinner);
    reference_ = widest.center();
    pieces_.push_back({ConvexPiece(Sphere{widest.inner_radius()}, {reference_, Quaternion::Identity()}), 0.0, widest});
  } else if (!any_turn_) {
    for (const ConvexPiece& piece : pieces) {
      pieces_.push_back({piece, (piece.center() - reference_).norm() + piece.radius(), piece});
    }
  }
  if (turns == 1.0) axis_ = body.angular_factor;
  // A locked axis holds the centre of mass; another point moves along it when the object turns.
  const bool at_center = reference_ == problem.scene.inertial(object).center;
  for (int axis = 0; axis < 3; ++axis) {
    free_[static_cast<std::size_t>(axis)] = body.linear_factor[axis] != 0.0 || !at_center;
  }
  free_[turn_axis] = !any_turn_ && turns == 1.0;
  orientation_ = start.orientation;
  start_.head<3>() = start.position + start.orientation * reference_;
  for (const ObjectPiece& piece : pieces_) radius_ = std::max(radius_, piece.reach + piece.piece.radius());
}

Pose ObjectSpace::pose(const Coordinates& at) const {
  const Quaternion turned = Quaternion(Eigen::AngleAxisd(at[turn_axis], axis_)) * orientation_;
  return {at.head<3>() - turned * reference_, turned};
}

double ObjectSpace::thickness() const {
  double least = pieces_.empty() ? 0.0 : infinity;
  for (const ObjectPiece& piece : pieces_) least = std::min(least, piece.piece.inner_radius());
  return least;
}

Vector3 ObjectSpace::slack(const Coordinates& half, const Vector3& point) const {
  const double arm = (point - reference_).norm();
  return half.head<3>() + Vector3::Constant(arm * (any_turn_ ? 2.0 : chord(half[turn_axis])));
}

}  // namespace energymargin::bounds
