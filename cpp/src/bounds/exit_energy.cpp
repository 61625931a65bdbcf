#include "bounds/exit_energy.hpp"

#include <algorithm>
#include <cmath>

#include "bounds/infinity.hpp"
#include "bounds/pose_range.hpp"
#include "energymargin/kinematics.hpp"
#include "sets/body_reader.hpp"
#include "sets/sweep.hpp"

namespace energymargin::bounds {
namespace {

constexpr double rounding = 1e-9;  // of distances and angles: a share of their size, or rad

using Extent = std::array<Vector3, 2>;

const Extent everywhere{Vector3::Constant(-infinity), Vector3::Constant(infinity)};

}  // namespace

// The regions, part by part.
class ExitEnergy::Set {
 public:
  Set(const Problem& problem, const Region& captured, std::size_t object, const std::vector<bool>& immovable,
      const ObjectSpace& space)
      : root(captured),
        problem_(problem),
        object_(object),
        immovable_(immovable),
        space_(space),
        kinematics_(problem.scene) {
    const Body& body = problem.scene.bodies()[object];
    const Inertial& inertial = problem.scene.inertial(object);
    center_ = inertial.center;
    push_ = 1.0 / body.mass;
    turn_ = 1.0 / inertial.moments.minCoeff();
  }

  const Region root;

  CrossingEnergy crossing(const Region& region, const PoseCell& cell) const {
    return std::visit([&](const auto& part) { return of(part, cell); }, region.expression());
  }

  // The first reason why a part bounds nothing.
  std::string reason(const Region& region) const {
    return std::visit([&](const auto& part) { return why(part); }, region.expression());
  }

  bool depends(const Region& region, int axis) const {
    return std::visit([&](const auto& part) { return differs(part, axis); }, region.expression());
  }

  Extent extent(const Region& region) const {
    return std::visit([&](const auto& part) { return range(part); }, region.expression());
  }

 private:
  std::size_t index(const std::string& body) const { return problem_.scene.index(body); }
  bool stays(const std::string& body) const { return body.empty() || immovable_[index(body)]; }

  BodyState state(const std::string& body) const {
    return body.empty() ? BodyState{} : kinematics_(problem_.state.data(), index(body));
  }

  template <typename Primitive>
  bool known(const Primitive& primitive) const {
    return (index(primitive.body) == object_ || stays(primitive.body)) && stays(primitive.frame);
  }

  template <typename Primitive>
  std::string why_unknown(const Primitive& primitive) const {
    if (known(primitive)) return {};
    const std::string& moves = stays(primitive.frame) ? primitive.body : primitive.frame;
    return "the capture set goes along with '" + moves + "', which can move";
  }

  template <typename Primitive>
  PoseRange pose_range(const Primitive& primitive, const PoseCell& cell) const {
    return pose_range(primitive.body, position_in_body(problem_.scene, primitive), cell).from(state(primitive.frame));
  }

  PoseRange pose_range(const std::string& body, const Vector3& point, const PoseCell& cell) const {
    if (index(body) != object_) {
      const BodyState there = state_at_point(point, state(body));
      return {there.position, Vector3::Zero(), there.orientation, 0.0};
    }
    const Pose pose = space_.pose(cell.center());
    const Coordinates half = cell.half();
    return {pose.position + pose.orientation * point, space_.slack(half, point), pose.orientation,
            space_.any_turn() ? pi : half[turn_axis]};
  }

  CrossingEnergy of(const regions::Ball& ball, const PoseCell& cell) const {
    if (!known(ball)) return either;
    const Range away = distance(pose_range(ball, cell), ball.center, 3);
    return at_most(ball.radius, away.low, away.high);
  }
  CrossingEnergy of(const regions::Disc& disc, const PoseCell& cell) const {
    if (!known(disc)) return either;
    const Range away = distance(pose_range(disc, cell), {disc.center.x(), disc.center.y(), 0.0}, 2);
    return at_most(disc.radius, away.low, away.high);
  }
  CrossingEnergy of(const regions::Box& box, const PoseCell& cell) const {
    if (!known(box)) return either;
    const PoseRange at = pose_range(box, cell);
    CrossingEnergy all = surely_inside;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::isinf(box.size[axis])) continue;
      const double away = std::abs(at.position[axis] - box.center[axis]);
      all = both(all, at_most(0.5 * box.size[axis], away - at.slack[axis], away + at.slack[axis]));
    }
    return all;
  }
  CrossingEnergy of(const regions::AnnularSector& sector, const PoseCell& cell) const {
    return known(sector) ? in_sector(sector, pose_range(sector, cell)) : either;
  }
  CrossingEnergy of(const regions::Swept& swept, const PoseCell& cell) const {
    if (!why(swept).empty()) return either;
    const PoseRange at = pose_range(swept.body, position_in_body(problem_.scene, swept), cell);
    const regions::PlanarMotion motion = motion_of(swept);
    const auto sector = swept_sector(swept, motion);
    if (sector) return in_sector(*sector, at);
    const Range away = distance(at, {motion.position.x(), motion.position.y(), 0.0}, 2);
    return at_most(swept.disc_radius, away.low, away.high);
  }
  CrossingEnergy of(const regions::HalfSpace& half_space, const PoseCell& cell) const {
    if (!known(half_space)) return either;  // a frame that stays has no motion that counts
    const PoseRange at = pose_range(half_space, cell);
    const double middle = half_space.normal.dot(at.position);
    const double slack = half_space.normal.cwiseAbs().dot(at.slack);
    return at_most(half_space.offset, middle - slack, middle + slack);
  }
  // The way to move whose point has the speed at the least energy has m_eff v^2 / 2, where a push at the
  // point moves it by at most 1/m + r^2/I.
  CrossingEnergy of(const regions::Speed& speed, const PoseCell&) const {
    if (!known(speed) || index(speed.body) != object_) return either;
    const double arm = speed.along_world ? speed.point.norm() + center_.norm() : (speed.point - center_).norm();
    const double limit = std::max(speed.limit, 0.0);
    return {0.5 * limit * limit / (push_ + turn_ * arm * arm), 0.0};
  }
  CrossingEnergy of(const regions::Tilt& tilt, const PoseCell& cell) const {
    if (!known(tilt)) return either;
    const PoseRange at = pose_range(tilt, cell);
    const Vector3 direction = at.orientation * tilt.axis;
    const double angle = std::atan2(direction.cross(tilt.reference).norm(), direction.dot(tilt.reference));
    return at_most(tilt.limit, std::max(angle - at.turn, 0.0), std::min(angle + at.turn, pi));
  }
  CrossingEnergy of(const regions::Predicate&, const PoseCell&) const { return either; }
  CrossingEnergy of(const regions::Intersection& all, const PoseCell& cell) const {
    CrossingEnergy result = surely_inside;
    for (const Region& part : all.of) result = both(result, crossing(part, cell));
    return result;
  }
  CrossingEnergy of(const regions::Union& any, const PoseCell& cell) const {
    CrossingEnergy result = surely_outside;
    for (const Region& part : any.of) {
      const CrossingEnergy one = crossing(part, cell);
      result = {std::max(result.outside, one.outside), std::min(result.inside, one.inside)};
    }
    return result;
  }
  CrossingEnergy of(const regions::Complement& negated, const PoseCell& cell) const {
    const CrossingEnergy crossed = crossing(negated.of.front(), cell);
    return {crossed.inside, crossed.outside};
  }

  regions::PlanarMotion motion_of(const regions::Swept& swept) const {
    if (swept.at) return *swept.at;
    return {state(swept.by).position.head<2>(), Vector2::Zero(), 0.0};
  }

  template <typename Primitive>
  std::string why(const Primitive& primitive) const {
    return why_unknown(primitive);
  }
  std::string why(const regions::Swept& swept) const {
    if (!swept.at && !stays(swept.by)) return "the capture set goes along with '" + swept.by + "', which can move";
    if (index(swept.body) == object_ || stays(swept.body)) return {};
    return "the capture set is about '" + swept.body + "', which can move";
  }
  std::string why(const regions::Predicate&) const { return "the capture set has a Predicate"; }
  std::string why(const regions::Intersection& all) const { return why_any(all.of); }
  std::string why(const regions::Union& any) const { return why_any(any.of); }
  std::string why(const regions::Complement& negated) const { return why_any(negated.of); }
  std::string why_any(const std::vector<Region>& of) const {
    for (const Region& part : of) {
      if (const std::string found = reason(part); !found.empty()) return found;
    }
    return {};
  }

  // What is about the world's axes may be the same along one of them; in another frame it is taken to depend on all.
  template <typename Primitive>
  bool about_object(const Primitive& primitive) const {
    return known(primitive) && index(primitive.body) == object_;
  }
  bool differs(const regions::Ball& ball, int) const { return about_object(ball); }
  bool differs(const regions::Disc& disc, int axis) const {
    return about_object(disc) && (axis < 2 || !disc.frame.empty());
  }
  bool differs(const regions::AnnularSector& sector, int axis) const {
    return about_object(sector) && (axis < 2 || !sector.frame.empty());
  }
  bool differs(const regions::Box& box, int axis) const {
    return about_object(box) && (std::isfinite(box.size[axis]) || !box.frame.empty());
  }
  bool differs(const regions::Swept& swept, int axis) const { return why(swept).empty() && axis < 2; }
  bool differs(const regions::HalfSpace& half_space, int axis) const {
    return about_object(half_space) && (half_space.normal[axis] != 0.0 || !half_space.frame.empty());
  }
  bool differs(const regions::Speed&, int) const { return false; }
  bool differs(const regions::Tilt&, int) const { return false; }
  bool differs(const regions::Predicate&, int) const { return false; }
  bool differs(const regions::Intersection& all, int axis) const { return any_differs(all.of, axis); }
  bool differs(const regions::Union& any, int axis) const { return any_differs(any.of, axis); }
  bool differs(const regions::Complement& negated, int axis) const { return any_differs(negated.of, axis); }
  bool any_differs(const std::vector<Region>& of, int axis) const {
    return std::any_of(of.begin(), of.end(), [&](const Region& part) { return depends(part, axis); });
  }

  // A box in a frame, in the world.
  template <typename Primitive>
  Extent about(const Primitive& primitive, const Vector3& center, const Vector3& half) const {
    if (!about_object(primitive)) return everywhere;
    const BodyState frame = state(primitive.frame);
    const Vector3 middle = frame.position + frame.orientation * center;
    const Eigen::Matrix3d turn = frame.orientation.toRotationMatrix().cwiseAbs();
    Vector3 reach = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      for (int along = 0; along < 3; ++along) {
        if (turn(axis, along) > rounding) reach[axis] += turn(axis, along) * half[along];
      }
    }
    return {middle - reach, middle + reach};
  }
  Extent range(const regions::Ball& ball) const { return about(ball, ball.center, Vector3::Constant(ball.radius)); }
  Extent range(const regions::Box& box) const { return about(box, box.center, 0.5 * box.size); }
  Extent range(const regions::Disc& disc) const {
    return about(disc, {disc.center.x(), disc.center.y(), 0.0}, {disc.radius, disc.radius, infinity});
  }
  Extent range(const regions::AnnularSector& sector) const {
    const double reach = sector.radius + sector.half_width;
    return about(sector, {sector.center.x(), sector.center.y(), 0.0}, {reach, reach, infinity});
  }
  Extent range(const regions::HalfSpace& half_space) const {
    Extent extent = everywhere;
    if (!about_object(half_space) || !half_space.frame.empty()) return extent;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(half_space.normal[axis]) < 1.0) continue;
      extent[half_space.normal[axis] > 0.0][axis] = half_space.normal[axis] * half_space.offset;
    }
    return extent;
  }
  Extent range(const regions::Intersection& all) const {
    Extent extent = everywhere;
    for (const Region& part : all.of) {
      const Extent one = this->extent(part);
      extent = {extent[0].cwiseMax(one[0]), extent[1].cwiseMin(one[1])};
    }
    return extent;
  }
  Extent range(const regions::Union& any) const {
    Extent extent = this->extent(any.of.front());
    for (const Region& part : any.of) {
      const Extent one = this->extent(part);
      extent = {extent[0].cwiseMin(one[0]), extent[1].cwiseMax(one[1])};
    }
    return extent;
  }
  template <typename Other>
  Extent range(const Other&) const {
    return everywhere;
  }

  const Problem& problem_;
  std::size_t object_;
  const std::vector<bool>& immovable_;
  const ObjectSpace& space_;
  Kinematics kinematics_;
  Vector3 center_;
  double push_, turn_;  // inverse mass [1/kg], and the greatest inverse inertia [1/(kg m^2)]
};

ExitEnergy::ExitEnergy(const Problem& problem, const Region& captured, std::size_t object,
                       const std::vector<bool>& immovable, const ObjectSpace& space)
    : set_(std::make_unique<Set>(problem, captured, object, immovable, space)), reason_(set_->reason(captured)) {}

ExitEnergy::~ExitEnergy() = default;

double ExitEnergy::operator()(const PoseCell& cell) const { return set_->crossing(set_->root, cell).outside; }

bool ExitEnergy::depends_on(int axis) const { return set_->depends(set_->root, axis); }

std::array<Vector3, 2> ExitEnergy::extent() const { return set_->extent(set_->root); }

}  // namespace energymargin::bounds
