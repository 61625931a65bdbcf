#include "energymargin/signed_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "sets/body_reader.hpp"
#include "sets/sweep.hpp"

namespace energymargin {
namespace {

using Distance = std::function<double(const double*)>;

double distance_to(const regions::AnnularSector& sector, const Vector3& position) {
  const Vector2 arm = position.head<2>() - sector.center;
  const double across = std::abs(arm.norm() - sector.radius) - sector.half_width;
  const double half = 0.5 * std::abs(sector.sweep);
  if (2.0 * half >= full_turn) return across;
  const double middle = sector.start_angle + 0.5 * sector.sweep;
  const double turned = std::abs(std::remainder(std::atan2(arm.y(), arm.x()) - middle, full_turn));
  return std::max(across, sector.radius * (turned - half));  // along the arc
}

double distance_to(const regions::Swept& swept, const regions::PlanarMotion& motion, const Vector3& position) {
  const std::optional<regions::AnnularSector> sector = swept_sector(swept, motion);
  return sector ? distance_to(*sector, position) : (position.head<2>() - motion.position).norm() - swept.disc_radius;
}

class DistanceCompiler {
 public:
  DistanceCompiler(const Scene& scene, const State& start)
      : scene_(scene), kinematics_(std::make_shared<Kinematics>(scene)), start_(start) {}

  Distance compile(const Region& region) const { return std::visit(*this, region.expression()); }

  Distance operator()(const regions::Ball& ball) const {
    return scaled([ball, body = reader(ball)](const double* state) {
      return (body.position(state) - ball.center).norm() - ball.radius;
    });
  }
  Distance operator()(const regions::Box& box) const {
    return scaled([box, body = reader(box)](const double* state) {
      const Vector3 beyond = (body.position(state) - box.center).cwiseAbs() - 0.5 * box.size;
      return std::min(beyond.maxCoeff(), 0.0) + beyond.cwiseMax(0.0).norm();
    });
  }
  Distance operator()(const regions::Disc& disc) const {
    return scaled([disc, body = reader(disc)](const double* state) {
      return (body.position(state).head<2>() - disc.center).norm() - disc.radius;
    });
  }
  Distance operator()(const regions::AnnularSector& sector) const {
    return scaled(
        [sector, body = reader(sector)](const double* state) { return distance_to(sector, body.position(state)); });
  }
  Distance operator()(const regions::Swept& swept) const {
    return scaled([swept, body = RelativeReader(scene_, kinematics_, swept.body, "", position_in_body(scene_, swept)),
                   by = BodyReader(scene_, kinematics_, swept.by)](const double* state) {
      return distance_to(swept, swept.at ? *swept.at : planar_motion(by(state)), body.position(state));
    });
  }
  Distance operator()(const regions::HalfSpace& half_space) const {
    return scaled([half_space, body = reader(half_space)](const double* state) {
      const double beyond = half_space.normal.dot(body.position(state)) - half_space.offset;
      if (half_space.ahead == 0.0) return beyond;
      return beyond - std::max(half_space.ahead * half_space.normal.dot(body.frame_velocity(state)), 0.0);
    });
  }
  Distance operator()(const regions::Speed& speed) const {
    return scaled([speed, body = reader(speed)](const double* state) {
      const Vector3 velocity = body.velocity(state, speed.point, speed.along_world);
      return (speed.along ? velocity.dot(*speed.along) : velocity.norm()) - speed.limit;
    });
  }
  Distance operator()(const regions::Tilt& tilt) const {
    return scaled([tilt, body = reader(tilt)](const double* state) {
      const Vector3 direction = body.direction(state, tilt.axis);
      return std::atan2(direction.cross(tilt.reference).norm(), direction.dot(tilt.reference)) - tilt.limit;
    });
  }
  Distance operator()(const regions::Predicate&) const {
    reject("captured", "a Predicate, which has no distance to its edge",
           "other regions, or level=, a function of the state that rises towards the edge");
  }
  Distance operator()(const regions::Intersection& all) const {
    return [distances = compile_each(all.of)](const double* state) {
      double largest = -std::numeric_limits<double>::infinity();
      for (const Distance& distance : distances) largest = std::max(largest, distance(state));
      return largest;
    };
  }
  Distance operator()(const regions::Union& any) const {
    return [distances = compile_each(any.of)](const double* state) {
      double least = std::numeric_limits<double>::infinity();
      for (const Distance& distance : distances) least = std::min(least, distance(state));
      return least;
    };
  }
  Distance operator()(const regions::Complement& negated) const {
    return [distance = compile(negated.of.front())](const double* state) { return -distance(state); };
  }

 private:
  // In units of its size at the start; as it is where the start is at the edge, or without end from it.
  Distance scaled(Distance distance) const {
    const double at_start = std::abs(distance(start_.data()));
    const double unit = at_start > 0.0 && std::isfinite(at_start) ? at_start : 1.0;
    return [distance = std::move(distance), unit](const double* state) { return distance(state) / unit; };
  }

  template <typename Primitive>
  RelativeReader reader(const Primitive& primitive) const {
    return {scene_, kinematics_, primitive.body, primitive.frame, position_in_body(scene_, primitive)};
  }

  std::vector<Distance> compile_each(const std::vector<Region>& regions) const {
    std::vector<Distance> distances;
    for (const Region& region : regions) distances.push_back(compile(region));
    return distances;
  }

  const Scene& scene_;
  std::shared_ptr<const Kinematics> kinematics_;
  const State& start_;
};

}  // namespace

SignedDistance::SignedDistance(const Region& region, const Scene& scene, const State& start)
    : distance_(DistanceCompiler(scene, start).compile(region)) {}

}  // namespace energymargin
