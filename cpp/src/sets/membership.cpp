#include "energymargin/membership.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "sets/primitives.hpp"

namespace energymargin {
namespace {

using Test = std::function<bool(const double*)>;

bool in_sector(const regions::AnnularSector& sector, const Vector3& position) {
  const Vector2 arm = position.head<2>() - sector.center;
  if (std::abs(arm.norm() - sector.radius) > sector.half_width) return false;
  const double direction = sector.sweep < 0.0 ? -1.0 : 1.0;
  const double turned = direction * (std::atan2(arm.y(), arm.x()) - sector.start_angle);
  return turned - full_turn * std::floor(turned / full_turn) <= std::abs(sector.sweep);
}

bool contains(const regions::AnnularSector& sector, const BodyReader& body, const double* state) {
  return in_sector(sector, body.position(state));
}

bool contains(const regions::Swept& swept, const BodyReader& body, const double* state) {
  const regions::PlanarMotion motion = swept.at ? *swept.at : planar_motion(body.other(state));
  const Vector3 position = body.position(state);
  const std::optional<regions::AnnularSector> sector = swept_sector(swept, motion);
  return sector ? in_sector(*sector, position) : (position.head<2>() - motion.position).norm() <= swept.disc_radius;
}

bool contains(const regions::Speed& speed, const BodyReader& body, const double* state) {
  const Vector3 velocity = body.velocity(state, speed);
  return (speed.along ? velocity.dot(*speed.along) - speed.limit : beyond(speed, velocity)) <= 0.0;
}

template <typename Primitive>
bool contains(const Primitive& primitive, const BodyReader& body, const double* state) {
  return beyond(primitive, read(primitive, body, state)) <= 0.0;
}

class Compiler {
 public:
  explicit Compiler(const Scene& scene)
      : scene_(scene), kinematics_(std::make_shared<Kinematics>(scene)), size_(StateLayout(scene).dimension()) {}

  Test compile(const Region& region) const { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  Test operator()(const Primitive& primitive) const {
    return [primitive, body = BodyReader(scene_, kinematics_, primitive)](const double* state) {
      return contains(primitive, body, state);
    };
  }
  Test operator()(const regions::Joint& set) const {
    return [read = joint_reader(scene_, set)](const double* state) { return read(state) <= 0.0; };
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
