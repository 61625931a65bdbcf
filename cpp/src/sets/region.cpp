// Regions: how they combine, which states are in them, and how far from their edge.

#include "energymargin/region.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "energymargin/membership.hpp"
#include "energymargin/signed_distance.hpp"
#include "sets/primitives.hpp"
#include "sets/records.hpp"

namespace energymargin {
namespace {

template <typename Primitive>
void validate(const Primitive& primitive) {
  require_fields(primitive);
  if constexpr (std::is_same_v<Primitive, regions::HalfSpace>) {
    if (primitive.ahead <= 0.0 || !primitive.frame.empty()) return;
    reject("ahead", text(primitive.ahead), "0 without a frame, whose motion it is about");
  }
  if constexpr (std::is_same_v<Primitive, regions::Joint>) {
    if (primitive.lower <= primitive.upper) return;
    reject("lower", text(primitive.lower), "a number up to upper, " + text(primitive.upper));
  }
  if constexpr (std::is_same_v<Primitive, regions::Touching>) {
    if (primitive.body == primitive.other) reject("other", "'" + primitive.other + "'", "another body than body");
  }
}

void validate(const regions::Predicate& predicate) {
  if (!predicate.contains) reject("predicate", "empty", "a function of an (N, n) array of states");
}

// The regions that another one combines; null for a primitive.
const std::vector<Region>* combined_by(const Region::Expression& expression) {
  if (const auto* all = std::get_if<regions::Intersection>(&expression)) return &all->of;
  if (const auto* any = std::get_if<regions::Union>(&expression)) return &any->of;
  if (const auto* negated = std::get_if<regions::Complement>(&expression)) return &negated->of;
  return nullptr;
}

// A chain a & b & c is one intersection of three, not nested ones.
template <typename Combination>
Region combined(const Region& a, const Region& b) {
  std::vector<Region> of;
  for (const Region* region : {&a, &b}) {
    const auto* same = std::get_if<Combination>(&region->expression());
    if (same == nullptr) {
      of.push_back(*region);
    } else {
      of.insert(of.end(), same->of.begin(), same->of.end());
    }
  }
  return Combination{std::move(of)};
}

using Test = std::function<bool(const double*)>;

class TestCompiler {
 public:
  explicit TestCompiler(const Scene& scene)
      : scene_(scene), kinematics_(std::make_shared<Kinematics>(scene)), size_(StateLayout(scene).dimension()) {}

  Test compile(const Region& region) const { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  Test operator()(const Primitive& primitive) const {
    return [primitive, read = body_reader(scene_, kinematics_, primitive)](const double* state) {
      return beyond(primitive, read(state)) <= 0.0;
    };
  }
  Test operator()(const regions::Joint& set) const {
    return [read = joint_reader(scene_, set)](const double* state) { return read(state) <= 0.0; };
  }
  Test operator()(const regions::Touching& set) const {
    return [readers = touch_readers(scene_, set)](const double* state) {
      const auto& [gap, force] = readers;
      return gap(state) <= 0.0 && (!force || force(state) <= 0.0);
    };
  }
  Test operator()(const regions::Predicate& predicate) const {
    return [predicate, size = size_](const double* state) {
      const Mask mask = predicate.contains(Eigen::Map<const States>(state, 1, size));
      return static_cast<bool>(mask(0));
    };
  }
  Test operator()(const regions::Intersection& all) const {
    return [tests = compile_each(all.of)](const double* state) {
      return std::all_of(tests.begin(), tests.end(), [state](const Test& test) { return test(state); });
    };
  }
  Test operator()(const regions::Union& any) const {
    return [tests = compile_each(any.of)](const double* state) {
      return std::any_of(tests.begin(), tests.end(), [state](const Test& test) { return test(state); });
    };
  }
  Test operator()(const regions::Complement& negated) const {
    return [test = compile(negated.of.front())](const double* state) { return !test(state); };
  }

 private:
  std::vector<Test> compile_each(const std::vector<Region>& regions) const {
    std::vector<Test> tests;
    for (const Region& region : regions) tests.push_back(compile(region));
    return tests;
  }

  const Scene& scene_;
  std::shared_ptr<const Kinematics> kinematics_;
  int size_;
};

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

  // `read` gives a number, or three, in the unit of their distance at the start; 1 where that is 0, or infinite.
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

Region::Node::Node(Expression definition) : expression(std::move(definition)) {
  std::visit([](const auto& region) { validate(region); }, expression);
  const std::vector<Region>* const of = combined_by(expression);
  if (of == nullptr) return;
  const bool single = std::holds_alternative<regions::Complement>(expression);
  if (single && of->size() != 1) reject("of", std::to_string(of->size()) + " regions", "exactly one");
  if (of->empty()) reject("of", "empty", "at least one region");
  primitives = 0;
  for (const Region& region : *of) {
    levels = std::max(levels, region.node_->levels + 1);
    primitives += region.node_->primitives;
  }
  if (levels > most_region_levels) {
    reject("region", "of " + std::to_string(levels) + " levels of & | ~",
           "at most " + std::to_string(most_region_levels) + "; a chain of one of them is one level");
  }
  if (primitives > most_region_primitives) {
    reject("region", "made of " + std::to_string(primitives) + " primitives",
           "at most " + std::to_string(most_region_primitives) + "; a Predicate can test more at once");
  }
}

Region operator&(const Region& a, const Region& b) { return combined<regions::Intersection>(a, b); }
Region operator|(const Region& a, const Region& b) { return combined<regions::Union>(a, b); }

Region operator~(const Region& a) {
  const auto* negated = std::get_if<regions::Complement>(&a.expression());
  return negated != nullptr ? negated->of.front() : Region(regions::Complement{{a}});
}

Membership::Membership(const Region& region, const Scene& scene) : test_(TestCompiler(scene).compile(region)) {
  if (const auto* predicate = std::get_if<regions::Predicate>(&region.expression())) test_all_ = predicate->contains;
}

Mask Membership::operator()(const States& states) const {
  if (test_all_) return test_all_(states);
  Mask mask(states.rows());
  for (Eigen::Index i = 0; i < states.rows(); ++i) mask(i) = test_(states.row(i).data());
  return mask;
}

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
