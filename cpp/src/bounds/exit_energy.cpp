#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/portable.hpp"
#include "bounds/object_space.hpp"
#include "energymargin/kinematics.hpp"
#include "sets/primitives.hpp"

namespace energymargin::bounds {
namespace {

constexpr double rounding = 1e-9;  // of distances and angles: a share of their size, or rad

constexpr CrossingEnergy surely_inside{infinity, 0.0};
constexpr CrossingEnergy surely_outside{0.0, infinity};
constexpr CrossingEnergy either{0.0, 0.0};

// Where a body may be in a cell, and how it may be turned there.
struct PoseRange {
  Vector3 position, slack;  // of its point, along the axes of the world [m]
  Quaternion orientation;
  double turn;  // by which the orientation may differ [rad]

  // As seen from a frame that stays.
  PoseRange from(const BodyState& frame) const {
    const Quaternion back = frame.orientation.conjugate();
    return {back * (position - frame.position), back.toRotationMatrix().cwiseAbs() * slack, back * orientation, turn};
  }
};

struct Range {
  double low, high;
};

// The least and the largest distance of a point from a centre, over the first axes [m].
Range distance(const PoseRange& at, const Vector3& center, int axes) {
  Eigen::VectorXd far = (at.position - center).cwiseAbs().head(axes) + at.slack.head(axes);
  Eigen::VectorXd near = ((at.position - center).cwiseAbs().head(axes) - at.slack.head(axes)).cwiseMax(0.0);
  return {near.norm(), far.norm()};
}

// A value that lies between two is to be at most a limit.
CrossingEnergy at_most(double limit, const Range& range) {
  const auto [low, high] = range;
  const double slack = rounding * (std::abs(limit) + std::abs(low) + std::abs(high));
  if (high + slack <= limit) return surely_inside;
  return low - slack > limit ? surely_outside : either;
}

CrossingEnergy both(const CrossingEnergy& a, const CrossingEnergy& b) {
  return {std::min(a.outside, b.outside), std::max(a.inside, b.inside)};
}

CrossingEnergy in_sector(const regions::AnnularSector& sector, const PoseRange& at) {
  const Vector3 center(sector.center.x(), sector.center.y(), 0.0);
  const Range arm = distance(at, center, 2);
  const CrossingEnergy ring = both(at_most(sector.radius + sector.half_width, arm),
                                   at_most(sector.half_width - sector.radius, {-arm.high, -arm.low}));
  const double sweep = std::abs(sector.sweep);
  if (sweep >= full_turn) return ring;
  const Vector2 middle = at.position.head<2>() - sector.center;
  const double slack = at.slack.head<2>().norm();
  if (slack >= middle.norm()) return both(ring, either);
  const double spread = portable::asin(slack / middle.norm()) + rounding;
  const double turned =
      (sector.sweep < 0.0 ? -1.0 : 1.0) * (portable::atan2(middle.y(), middle.x()) - sector.start_angle);
  const double angle = turned - full_turn * std::floor(turned / full_turn);
  if (angle - spread >= 0.0 && angle + spread <= sweep) return ring;
  const bool out = angle - spread > sweep && angle + spread < full_turn;
  return both(ring, out ? surely_outside : either);
}

Vector3 in_plane(const Vector2& point) { return {point.x(), point.y(), 0.0}; }

// Reads a region, part by part. What is in the frame of, or about, another body that moves bounds nothing.
class Reader {
 public:
  Reader(const Subject& subject, const ObjectSpace& space)
      : subject_(subject), scene_(subject.problem.scene), space_(space) {}

  ExitEnergy read(const Region& region) const {
    return std::visit([&](const auto& part) { return of(part); }, region.expression());
  }

 private:
  using PoseRanges = std::function<PoseRange(const PoseCell&)>;

  bool is_object(const std::string& body) const { return scene_.index(body) == subject_.object; }
  bool stays(const std::string& body) const { return body.empty() || subject_.immovable[scene_.index(body)]; }

  BodyState state(const std::string& body) const {
    return body.empty() ? BodyState{} : subject_.at(scene_.index(body));
  }

  static ExitEnergy unknown(std::string reason) {
    ExitEnergy exit;
    exit.crossing = [](const PoseCell&) { return either; };
    exit.reason = std::move(reason);
    return exit;
  }

  PoseRanges pose_ranges(const std::string& body, const Vector3& point) const {
    if (!is_object(body)) {
      const BodyState there = state_at_point(point, state(body));
      const PoseRange range{there.position, Vector3::Zero(), there.orientation, 0.0};
      return [range](const PoseCell&) { return range; };
    }
    return [point, &space = space_](const PoseCell& cell) -> PoseRange {
      const Pose pose = space.pose(cell.center());
      const Coordinates half = cell.half();
      return {pose.position + pose.orientation * point, space.slack(half, point), pose.orientation,
              space.any_turn() ? pi : half[turn_axis]};
    };
  }

  // `crossing` takes a range of poses as seen from the frame.
  template <typename Primitive, typename Crossing>
  ExitEnergy about(const Primitive& primitive, const Crossing& crossing) const {
    if (!stays(primitive.frame)) return moves_along_with(primitive.frame);
    if (!is_object(primitive.body) && !stays(primitive.body)) return moves_along_with(primitive.body);
    ExitEnergy exit;
    exit.crossing = [crossing, frame = state(primitive.frame),
                     ranges = pose_ranges(primitive.body, position_in_body(scene_, primitive))](const PoseCell& cell) {
      return crossing(ranges(cell).from(frame));
    };
    return exit;
  }
  static ExitEnergy moves_along_with(const std::string& body) {
    return unknown("the capture set goes along with '" + body + "', which can move");
  }

  // The same of a region that a box in its frame holds; in a frame other than the world's it depends on all axes.
  template <typename Primitive, typename Crossing>
  ExitEnergy in_box(const Primitive& primitive, const Vector3& center, const Vector3& half,
                    const Crossing& crossing) const {
    ExitEnergy exit = about(primitive, crossing);
    if (!exit.reason.empty() || !is_object(primitive.body)) return exit;
    const BodyState frame = state(primitive.frame);
    const Vector3 middle = frame.position + frame.orientation * center;
    const Eigen::Matrix3d turn = frame.orientation.toRotationMatrix().cwiseAbs();
    Vector3 reach = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      for (int along = 0; along < 3; ++along) {
        if (turn(axis, along) > rounding) reach[axis] += turn(axis, along) * half[along];
      }
      exit.depends_on[static_cast<std::size_t>(axis)] = std::isfinite(half[axis]) || !primitive.frame.empty();
    }
    exit.extent = {middle - reach, middle + reach};
    return exit;
  }

  ExitEnergy of(const regions::Ball& ball) const {
    return in_box(ball, ball.center, Vector3::Constant(ball.radius),
                  [ball](const PoseRange& at) { return at_most(ball.radius, distance(at, ball.center, 3)); });
  }
  ExitEnergy of(const regions::Disc& disc) const {
    return in_box(disc, in_plane(disc.center), {disc.radius, disc.radius, infinity},
                  [disc](const PoseRange& at) { return at_most(disc.radius, distance(at, in_plane(disc.center), 2)); });
  }
  ExitEnergy of(const regions::Box& box) const {
    return in_box(box, box.center, 0.5 * box.size, [box](const PoseRange& at) {
      CrossingEnergy all = surely_inside;
      for (int axis = 0; axis < 3; ++axis) {
        if (std::isinf(box.size[axis])) continue;
        const double away = std::abs(at.position[axis] - box.center[axis]);
        all = both(all, at_most(0.5 * box.size[axis], {away - at.slack[axis], away + at.slack[axis]}));
      }
      return all;
    });
  }
  ExitEnergy of(const regions::AnnularSector& sector) const {
    const double reach = sector.radius + sector.half_width;
    return in_box(sector, in_plane(sector.center), {reach, reach, infinity},
                  [sector](const PoseRange& at) { return in_sector(sector, at); });
  }
  ExitEnergy of(const regions::Swept& swept) const {
    if (!swept.at && !stays(swept.by)) return moves_along_with(swept.by);
    if (!is_object(swept.body) && !stays(swept.body)) {
      return unknown("the capture set is about '" + swept.body + "', which can move");
    }
    const regions::PlanarMotion motion =
        swept.at ? *swept.at : regions::PlanarMotion{state(swept.by).position.head<2>(), Vector2::Zero(), 0.0};
    ExitEnergy exit;
    exit.crossing = [sector = swept_sector(swept, motion), radius = swept.disc_radius,
                     center = in_plane(motion.position),
                     ranges = pose_ranges(swept.body, position_in_body(scene_, swept))](const PoseCell& cell) {
      return sector ? in_sector(*sector, ranges(cell)) : at_most(radius, distance(ranges(cell), center, 2));
    };
    exit.depends_on = {true, true, false};
    return exit;
  }
  // A frame that stays has no motion that counts.
  ExitEnergy of(const regions::HalfSpace& half_space) const {
    ExitEnergy exit = about(half_space, [half_space](const PoseRange& at) {
      const double middle = half_space.normal.dot(at.position);
      const double slack = half_space.normal.cwiseAbs().dot(at.slack);
      return at_most(half_space.offset, {middle - slack, middle + slack});
    });
    if (!exit.reason.empty() || !is_object(half_space.body)) return exit;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = half_space.normal[axis];
      exit.depends_on[static_cast<std::size_t>(axis)] = along != 0.0 || !half_space.frame.empty();
      if (half_space.frame.empty() && std::abs(along) >= 1.0)
        exit.extent[along > 0.0][axis] = along * half_space.offset;
    }
    return exit;
  }
  // The least energy is m_eff v^2 / 2, where a push at the point moves it by at most 1/m + r^2/I.
  ExitEnergy of(const regions::Speed& speed) const {
    CrossingEnergy energy = either;
    if (is_object(speed.body)) {
      const Inertial& inertial = scene_.inertial(subject_.object);
      const double push = 1.0 / subject_.body().mass;
      const double turn = 1.0 / inertial.moments.minCoeff();
      const Vector3& center = inertial.center;
      const double arm = speed.along_world ? speed.point.norm() + center.norm() : (speed.point - center).norm();
      const double limit = std::max(speed.limit, 0.0);
      energy.outside = 0.5 * limit * limit / (push + turn * arm * arm);
    }
    return about(speed, [energy](const PoseRange&) { return energy; });
  }
  ExitEnergy of(const regions::Tilt& tilt) const {
    return about(tilt, [tilt](const PoseRange& at) {
      const Vector3 direction = at.orientation * tilt.axis;
      const double angle = portable::atan2(direction.cross(tilt.reference).norm(), direction.dot(tilt.reference));
      return at_most(tilt.limit, {std::max(angle - at.turn, 0.0), std::min(angle + at.turn, pi)});
    });
  }
  ExitEnergy of(const regions::Joint&) const { return unknown("the capture set is one of a joint"); }
  ExitEnergy of(const regions::Touching&) const { return unknown("the capture set is one of contacts"); }
  ExitEnergy of(const regions::Predicate&) const { return unknown("the capture set has a Predicate"); }
  ExitEnergy of(const regions::Intersection& all) const { return combined(all.of, true); }
  ExitEnergy of(const regions::Union& any) const { return combined(any.of, false); }
  ExitEnergy of(const regions::Complement& negated) const {
    ExitEnergy exit = read(negated.of.front());
    exit.crossing = [crossing = std::move(exit.crossing)](const PoseCell& cell) {
      const CrossingEnergy crossed = crossing(cell);
      return CrossingEnergy{crossed.inside, crossed.outside};
    };
    exit.extent = ExitEnergy{}.extent;
    return exit;
  }

  ExitEnergy combined(const std::vector<Region>& of, bool all) const {
    std::vector<ExitEnergy> parts;
    for (const Region& part : of) parts.push_back(read(part));
    ExitEnergy exit;
    if (!all) exit.extent = parts.front().extent;
    auto& [low, high] = exit.extent;
    for (const ExitEnergy& part : parts) {
      if (exit.reason.empty()) exit.reason = part.reason;
      for (std::size_t axis = 0; axis < 3; ++axis) exit.depends_on[axis] |= part.depends_on[axis];
      low = all ? low.cwiseMax(part.extent[0]).eval() : low.cwiseMin(part.extent[0]).eval();
      high = all ? high.cwiseMin(part.extent[1]).eval() : high.cwiseMax(part.extent[1]).eval();
    }
    exit.crossing = [parts = std::move(parts), all](const PoseCell& cell) {
      CrossingEnergy result = all ? surely_inside : surely_outside;
      for (const ExitEnergy& part : parts) {
        const CrossingEnergy one = part.crossing(cell);
        result = all ? both(result, one)
                     : CrossingEnergy{std::max(result.outside, one.outside), std::min(result.inside, one.inside)};
      }
      return result;
    };
    return exit;
  }

  const Subject& subject_;
  const Scene& scene_;
  const ObjectSpace& space_;
};

}  // namespace

ExitEnergy exit_energy(const Subject& subject, const Region& captured, const ObjectSpace& space) {
  return Reader(subject, space).read(captured);
}

}  // namespace energymargin::bounds
