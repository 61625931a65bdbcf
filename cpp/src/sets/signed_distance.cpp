#include "energymargin/signed_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "sets/primitives.hpp"

namespace energymargin {
namespace {

// Of the coordinates of all primitives, in the units of each.
using Distance = std::function<double(const double*, const double*)>;
using Reader = std::function<void(const double*, double*)>;

class DistanceCompiler {
 public:
  DistanceCompiler(const Scene& scene, const State& start)
      : scene_(scene), kinematics_(std::make_shared<Kinematics>(scene)), start_(start) {}

  std::vector<int> sizes{};
  std::vector<double> units_at_start{};
  std::vector<Reader> readers{};

  Distance compile(const Region& region) { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  Distance operator()(const Primitive& primitive) {
    return add(body_reader(scene_, kinematics_, primitive),
               [primitive](const auto& at) { return beyond(primitive, at); });
  }
  Distance operator()(const regions::Speed& speed) {
    const auto velocity = body_reader(scene_, kinematics_, speed);
    const auto far = [speed](const Vector3& now) { return beyond(speed, now); };
    if (!speed.along) return add(velocity, far);
    return add_scalar([far, velocity](const double* state) { return far(velocity(state)); });
  }
  Distance operator()(const regions::Joint& set) { return add_scalar(joint_reader(scene_, set)); }
  Distance operator()(const regions::Touching& set) {
    const auto [read_gap, read_force] = touch_readers(scene_, set);
    const Distance gap = add_scalar(read_gap);
    if (!read_force) return gap;
    return [gap, force = add_scalar(read_force)](const double* coordinates, const double* units) {
      return std::max(gap(coordinates, units), force(coordinates, units));
    };
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
  template <typename Read>
  Distance add_scalar(const Read& read) {
    return add(read, [](double at) { return at; });
  }

  // `read` gives a number, or three. Their unit is the size of their distance at the start; 1 where the start is at the
  // edge, or without end from it.
  template <typename Read, typename Beyond>
  Distance add(const Read& read, const Beyond& beyond_edge) {
    constexpr bool scalar = std::is_same_v<decltype(read(nullptr)), double>;
    constexpr int size = scalar ? 1 : 3;
    const auto distance = [beyond_edge](const double* at) {
      if constexpr (scalar) return beyond_edge(*at);
      if constexpr (!scalar) return beyond_edge(Vector3(Eigen::Map<const Vector3>(at)));
    };
    readers.push_back([read](const double* state, double* to) {
      if constexpr (scalar) *to = read(state);
      if constexpr (!scalar) Eigen::Map<Vector3>{to} = read(state);
    });
    std::array<double, size> at_start;
    readers.back()(start_.data(), at_start.data());
    const double length = std::abs(distance(at_start.data()));
    const std::size_t number = units_at_start.size();
    const int first = count_;
    count_ += size;
    sizes.push_back(size);
    units_at_start.push_back(length > 0.0 && std::isfinite(length) ? length : 1.0);
    return [distance, number, first](const double* coordinates, const double* units) {
      return distance(coordinates + first) / units[number];
    };
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
