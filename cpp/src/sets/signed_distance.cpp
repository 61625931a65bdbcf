#include "energymargin/signed_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "sets/body_reader.hpp"

namespace energymargin {
namespace {

// Of the coordinates of all primitives, in the units of each.
using Distance = std::function<double(const double*, const double*)>;
using Reader = std::function<void(const double*, double*)>;
using Position = Eigen::Map<const Vector3>;

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

  std::vector<int> sizes{};
  std::vector<double> units_at_start{};
  std::vector<Reader> readers{};

  Distance compile(const Region& region) { return std::visit(*this, region.expression()); }

  Distance operator()(const regions::Ball& ball) {
    return add_position(ball,
                        [ball](const Vector3& position) { return (position - ball.center).norm() - ball.radius; });
  }
  Distance operator()(const regions::Box& box) {
    return add_position(box, [box](const Vector3& position) {
      const Vector3 beyond = (position - box.center).cwiseAbs() - 0.5 * box.size;
      return std::min(beyond.maxCoeff(), 0.0) + beyond.cwiseMax(0.0).norm();
    });
  }
  Distance operator()(const regions::Disc& disc) {
    const auto in_plane = [body = reader(disc)](const double* state) {
      const Vector3 position = body.position(state);
      return Vector3(position.x(), position.y(), 0.0);
    };
    return add_vector(
        in_plane, [disc](const Vector3& position) { return (position.head<2>() - disc.center).norm() - disc.radius; });
  }
  Distance operator()(const regions::AnnularSector& sector) {
    return add_scalar(
        [sector, body = reader(sector)](const double* state) { return distance_to(sector, body.position(state)); });
  }
  Distance operator()(const regions::Swept& swept) {
    return add_scalar([swept, body = reader(swept)](const double* state) {
      return distance_to(swept, swept.at ? *swept.at : planar_motion(body.other(state)), body.position(state));
    });
  }
  Distance operator()(const regions::HalfSpace& half_space) {
    return add_scalar([half_space, body = reader(half_space)](const double* state) {
      const double beyond = half_space.normal.dot(body.position(state)) - half_space.offset;
      if (half_space.ahead == 0.0) return beyond;
      return beyond - std::max(half_space.ahead * half_space.normal.dot(body.frame_velocity(state)), 0.0);
    });
  }
  Distance operator()(const regions::Speed& speed) {
    const auto velocity = [speed, body = reader(speed)](const double* state) { return body.velocity(state, speed); };
    if (speed.along) {
      return add_scalar(
          [speed, velocity](const double* state) { return velocity(state).dot(*speed.along) - speed.limit; });
    }
    return add_vector(velocity, [speed](const Vector3& now) { return now.norm() - speed.limit; });
  }
  Distance operator()(const regions::Tilt& tilt) {
    const auto direction = [tilt, body = reader(tilt)](const double* state) {
      return body.direction(state, tilt.axis);
    };
    return add_vector(direction, [tilt](const Vector3& now) {
      return std::atan2(now.cross(tilt.reference).norm(), now.dot(tilt.reference)) - tilt.limit;
    });
  }
  Distance operator()(const regions::Joint& set) {
    return add_scalar([set, layout = StateLayout(scene_), joint = moving_joint(scene_, set)](const double* state) {
      const double position = layout.joint(state, joint).position;
      return std::max(set.lower - position, position - set.upper);
    });
  }
  Distance operator()(const regions::Predicate&) {
    reject("captured", "a Predicate, which has no distance to its edge",
           "other regions, or level=, a function of the state that rises towards the edge");
  }
  Distance operator()(const regions::Intersection& all) {
    return [distances = compile_each(all.of)](const double* coordinates, const double* units) {
      double largest = -std::numeric_limits<double>::infinity();
      for (const Distance& distance : distances) largest = std::max(largest, distance(coordinates, units));
      return largest;
    };
  }
  Distance operator()(const regions::Union& any) {
    return [distances = compile_each(any.of)](const double* coordinates, const double* units) {
      double least = std::numeric_limits<double>::infinity();
      for (const Distance& distance : distances) least = std::min(least, distance(coordinates, units));
      return least;
    };
  }
  Distance operator()(const regions::Complement& negated) {
    return [distance = compile(negated.of.front())](const double* coordinates, const double* units) {
      return -distance(coordinates, units);
    };
  }

 private:
  template <typename Primitive, typename OfPosition>
  Distance add_position(const Primitive& primitive, const OfPosition& distance) {
    return add_vector([body = reader(primitive)](const double* state) { return body.position(state); }, distance);
  }

  template <typename Read, typename OfVector>
  Distance add_vector(const Read& read, const OfVector& distance) {
    return add(
        3, [read](const double* state, double* to) { Eigen::Map<Vector3>{to} = read(state); },
        [distance](const double* at) { return distance(Position(at)); });
  }

  template <typename Read>
  Distance add_scalar(const Read& read) {
    return add(1, [read](const double* state, double* to) { *to = read(state); }, [](const double* at) { return *at; });
  }

  // Its unit is its size at the start; 1 where the start is at the edge, or without end from it.
  template <typename OfCoordinates>
  Distance add(int size, const Reader& read, const OfCoordinates& distance) {
    std::vector<double> at_start(static_cast<std::size_t>(size));
    read(start_.data(), at_start.data());
    const double length = std::abs(distance(at_start.data()));
    const std::size_t number = units_at_start.size();
    const int first = count_;
    count_ += size;
    sizes.push_back(size);
    units_at_start.push_back(length > 0.0 && std::isfinite(length) ? length : 1.0);
    readers.push_back(read);
    return [distance, number, first](const double* coordinates, const double* units) {
      return distance(coordinates + first) / units[number];
    };
  }

  template <typename Primitive>
  BodyReader reader(const Primitive& primitive) const {
    return {scene_, kinematics_, primitive};
  }

  std::vector<Distance> compile_each(const std::vector<Region>& regions) {
    std::vector<Distance> distances;
    for (const Region& region : regions) distances.push_back(compile(region));
    return distances;
  }

  const Scene& scene_;
  std::shared_ptr<const Kinematics> kinematics_;
  const State& start_;
  int count_ = 0;  // of coordinates
};

}  // namespace

SignedDistance::SignedDistance(const Region& region, const Scene& scene, const State& start) {
  DistanceCompiler compiler(scene, start);
  distance_ = compiler.compile(region);
  sizes_ = compiler.sizes;
  units_ = compiler.units_at_start;
  readers_ = compiler.readers;
}

double SignedDistance::operator()(const State& state) const {
  return distance_(coordinates(state).data(), units_.data());
}

std::vector<double> SignedDistance::coordinates(const State& state) const {
  std::vector<double> all(static_cast<std::size_t>(std::accumulate(sizes_.begin(), sizes_.end(), 0)));
  double* next = all.data();
  for (std::size_t i = 0; i < readers_.size(); ++i) {
    readers_[i](state.data(), next);
    next += sizes_[i];
  }
  return all;
}

}  // namespace energymargin
