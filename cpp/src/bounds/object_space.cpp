#include "bounds/object_space.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin::bounds {

ObjectSpace::ObjectSpace(const Subject& subject) {
  const Body& body = subject.body();
  const Vector3 center = subject.problem.scene.inertial(subject.object).center;
  const BodyState start = subject.at(subject.object);
  const double turns = body.angular_factor.sum();
  any_turn_ = std::holds_alternative<Sphere>(body.shape) || turns > 1.0;
  const std::vector<ConvexPiece> pieces = convex_pieces(body.shape, Pose{}, subject.problem.scene.stepping().margin);
  reference_ = center;
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
  const bool at_center = reference_ == center;
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

PotentialBounds::PotentialBounds(const Subject& subject, const ObjectSpace& space)
    : space_(space),
      center_(subject.problem.scene.inertial(subject.object).center),
      step_(subject.problem.scene.stepping().step),
      inverse_mass_(1.0 / subject.body().mass) {
  const Scene& scene = subject.problem.scene;
  const std::size_t object = subject.object;
  const Body& body = subject.body();
  load_ = body.linear_factor.cwiseProduct(body.mass * scene.gravity() + body.force);
  const double turning = 1.0 / scene.inertial(object).moments.minCoeff();
  for (const auto& spring : scene.springs()) {
    const bool first = scene.index(spring.body_a) == object;
    const std::size_t other = scene.index(first ? spring.body_b : spring.body_a);
    if ((!first && scene.index(spring.body_b) != object) || !subject.immovable[other]) continue;
    const BodyState at = subject.at(other);
    const Vector3 anchor = at.position + at.orientation * (first ? spring.point_b : spring.point_a);
    const Vector3 point = first ? spring.point_a : spring.point_b;
    const double inverse_mass = inverse_mass_ + turning * (point - center_).squaredNorm();
    springs_.push_back({point, anchor, spring.stiffness, spring.rest_length, inverse_mass});
  }
  // The start itself, whose turn is known.
  const Pose pose = space.pose(space.start());
  const BodyState moving = subject.at(object);
  start_ = -load_.dot(pose.position + pose.orientation * center_);
  double power = load_.dot(state_at_point(center_, moving).velocity);
  for (const Spring& spring : springs_) {
    const Vector3 span = pose.position + pose.orientation * spring.point - spring.anchor;
    const double stretch = span.norm() - spring.rest_length;
    start_ += 0.5 * spring.stiffness * stretch * stretch;
    power -= spring.stiffness * stretch * span.normalized().dot(state_at_point(spring.point, moving).velocity);
  }
  start_ += 0.5 * step_ * std::max(power, 0.0);
}

EnergyRange PotentialBounds::operator()(const PoseCell& cell) const {
  const Pose pose = space_.pose(cell.center());
  const Coordinates half = cell.half();
  const double middle = -load_.dot(pose.position + pose.orientation * center_);
  const double slack = load_.cwiseAbs().dot(space_.slack(half, center_));
  EnergyRange range{middle - slack, middle + slack, lag(load_.norm(), inverse_mass_)};
  for (const Spring& spring : springs_) {
    const double length = (pose.position + pose.orientation * spring.point - spring.anchor).norm();
    const double stretch = std::abs(length - spring.rest_length);
    const double change = space_.slack(half, spring.point).norm();
    range.low += 0.5 * spring.stiffness * std::pow(std::max(stretch - change, 0.0), 2);
    range.high += 0.5 * spring.stiffness * std::pow(stretch + change, 2);
    range.lag += lag(spring.stiffness * (stretch + change), spring.inverse_mass);
  }
  return range;
}

double PotentialBounds::beyond(int axis, bool upper, double face) const {
  if (axis == turn_axis || (load_.isZero(0.0) && springs_.empty())) return 0.0;
  Vector3 others = load_;
  others[axis] = 0.0;
  const bool rises = upper ? load_[axis] <= 0.0 : load_[axis] >= 0.0;
  if (!others.isZero(0.0) || !rises) return -infinity;
  const Vector3 slack = space_.slack(Coordinates::Zero(), center_);
  // What springs have there is more than what they lag by, but for stiff ones.
  double stiffness = 0.0;
  for (const Spring& spring : springs_) stiffness += spring.stiffness * spring.inverse_mass * step_ * step_;
  if (stiffness > 2.0) return -infinity;
  const double low = -load_[axis] * face - std::abs(load_[axis]) * slack[axis];
  return EnergyRange{low, low, std::sqrt(2.0) * lag(load_.norm(), inverse_mass_)}.passed();
}

}  // namespace energymargin::bounds
