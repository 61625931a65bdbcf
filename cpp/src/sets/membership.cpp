#include "energymargin/membership.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "sets/primitives.hpp"

namespace energymargin {
namespace {

using Test = std::function<bool(const double*)>;

class Compiler {
 public:
  explicit Compiler(const Scene& scene)
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

}  // namespace

Membership::Membership(const Region& region, const Scene& scene) : test_(Compiler(scene).compile(region)) {
  if (const auto* predicate = std::get_if<regions::Predicate>(&region.expression())) test_all_ = predicate->contains;
}

Mask Membership::operator()(const States& states) const {
  if (test_all_) return test_all_(states);
  Mask mask(states.rows());
  for (Eigen::Index i = 0; i < states.rows(); ++i) mask(i) = test_(states.row(i).data());
  return mask;
}

}  // namespace energymargin
