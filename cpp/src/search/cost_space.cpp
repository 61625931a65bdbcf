#include "energymargin/search/cost_space.hpp"

#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "energymargin/kinematics.hpp"
#include "energymargin/random.hpp"

namespace energymargin::search {
namespace {

// Samples reach as far as this many longest edges lead: well outside of the tree, so that it is drawn outwards.
constexpr double sample_reach = 6.0;
// The cost counts as much as one longest edge over the whole of [0, c].
constexpr double cost_weight = 1.0;
// Where nothing pushes, a longest edge counts as this share of the object's smallest half extent.
constexpr double smallest_reach = 0.01;

Vector3 rotation_vector(const Quaternion& rotation) {
  const Eigen::AngleAxisd turn(rotation.w() < 0.0 ? Quaternion(-rotation.coeffs()) : rotation);
  return turn.angle() * turn.axis();
}

// Draws around the start: position, orientation and velocities evenly, the cost evenly below its bound.
class CostSampler : public ompl::base::StateSampler {
 public:
  CostSampler(const CostSpace* space, std::uint64_t seed) : StateSampler(space), cost_space_(space) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  }

  void sampleUniform(ompl::base::State* state) override {
    auto* sample = state->as<CostSpace::StateType>();
    const BodyState& start = cost_space_->start();
    const Scales& scales = cost_space_->scales();
    sample->object.position = around(start.position, scales.position);
    const Vector3 turn = around(Vector3::Zero(), std::min(scales.orientation, 1.0));
    const Eigen::AngleAxisd rotation(turn.norm(), turn.norm() > 0.0 ? Vector3(turn.normalized()) : Vector3::UnitZ());
    sample->object.orientation = Quaternion(rotation) * start.orientation;
    sample->object.velocity = around(start.velocity, scales.velocity);
    sample->object.angular_velocity = around(start.angular_velocity, scales.angular_velocity);
    const double bound = cost_space_->bound();
    sample->cost = std::isfinite(bound) ? rng_.uniformReal(0.0, bound) : 0.0;
    sample->node = -1;
  }

  void sampleUniformNear(ompl::base::State* state, const ompl::base::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ompl::base::State* state, const ompl::base::State*, double) override { sampleUniform(state); }

 private:
  Vector3 around(const Vector3& centre, double scale) {
    Vector3 drawn = centre;
    for (double& value : drawn) value += rng_.uniformReal(-sample_reach * scale, sample_reach * scale);
    return drawn;
  }

  const CostSpace* cost_space_;
};

}  // namespace

Scales::Scales(const Problem& problem) {
  const Scene& scene = problem.scene;
  const std::size_t index = scene.with_role(Role::object).front();
  const Body& object = scene.bodies()[index];
  const Kinematics kinematics(scene);
  const BodyState start = kinematics(problem.state.data(), index);
  double speed = 0.0;  // of the fastest part of the effector
  for (const std::size_t effector : scene.with_role(Role::effector)) {
    speed = std::max(speed, kinematics(problem.state.data(), effector).velocity.norm());
  }
  speed += start.velocity.norm();
  const double radius = smallest_half_extent(object.shape);
  const double time = problem.duration;
  const double acceleration = problem.force.norm() / object.mass;
  const double inertia = mass_properties(object.shape, object.mass).inertia.maxCoeff();
  const double angular_acceleration = problem.torque.norm() / inertia;
  const double gyration = std::max(std::sqrt(inertia / object.mass), radius);
  position = std::max(speed * time + 0.5 * acceleration * time * time, smallest_reach * radius);
  velocity = std::max(speed + acceleration * time, position / time);
  angular_velocity = start.angular_velocity.norm() + velocity / gyration + angular_acceleration * time;
  orientation = start.angular_velocity.norm() * time + position / gyration + 0.5 * angular_acceleration * time * time;
}

CostSpace::CostSpace(const Problem& problem, std::uint64_t seed)
    : scales_(problem), bound_(std::numeric_limits<double>::infinity()), seed_(seed) {
  setName("StateCost");
  const StateLayout layout(problem.scene);
  start_ = StateLayout::read(problem.state.data() + layout.offset(problem.scene.with_role(Role::object).front()));
}

double CostSpace::distance(const ompl::base::State* a, const ompl::base::State* b) const {
  const auto* one = a->as<StateType>();
  const auto* two = b->as<StateType>();
  const auto squared = [](const Vector3& difference, double scale) {
    return difference.squaredNorm() / (scale * scale);
  };
  const double alignment = std::min(std::abs(one->object.orientation.dot(two->object.orientation)), 1.0);
  const double angle = 2.0 * std::acos(alignment) / scales_.orientation;
  double sum = squared(one->object.position - two->object.position, scales_.position) + angle * angle +
               squared(one->object.velocity - two->object.velocity, scales_.velocity) +
               squared(one->object.angular_velocity - two->object.angular_velocity, scales_.angular_velocity);
  if (std::isfinite(bound_) && bound_ > 0.0) {
    const double cost = cost_weight * (one->cost - two->cost) / bound_;
    sum += cost * cost;
  }
  return std::sqrt(sum);
}

double CostSpace::getMaximumExtent() const { return 4.0 * sample_reach; }

void CostSpace::copyState(ompl::base::State* destination, const ompl::base::State* source) const {
  static_cast<Values&>(*destination->as<StateType>()) = *source->as<StateType>();
}

bool CostSpace::equalStates(const ompl::base::State* a, const ompl::base::State* b) const {
  const auto* one = a->as<StateType>();
  const auto* two = b->as<StateType>();
  return one->node == two->node && one->cost == two->cost && one->object.position == two->object.position &&
         one->object.orientation.coeffs() == two->object.orientation.coeffs() &&
         one->object.velocity == two->object.velocity && one->object.angular_velocity == two->object.angular_velocity;
}

void CostSpace::interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                            ompl::base::State* state) const {
  const Values one = *from->as<StateType>();
  const Values two = *to->as<StateType>();
  const auto mix = [t](const auto& a, const auto& b) -> Vector3 { return (1.0 - t) * a + t * b; };
  auto* between = state->as<StateType>();
  between->object = {
      mix(one.object.position, two.object.position), one.object.orientation.slerp(t, two.object.orientation),
      mix(one.object.velocity, two.object.velocity), mix(one.object.angular_velocity, two.object.angular_velocity)};
  between->cost = (1.0 - t) * one.cost + t * two.cost;
  between->node = -1;
}

ompl::base::StateSamplerPtr CostSpace::allocDefaultStateSampler() const {
  return std::make_shared<CostSampler>(this, seed_);
}

Vector3 turned(const BodyState& from, const BodyState& to) {
  return rotation_vector(to.orientation * from.orientation.conjugate());
}

}  // namespace energymargin::search
