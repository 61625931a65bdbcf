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
// Where nothing pushes, a longest edge counts as this share of an object's smallest half extent.
constexpr double smallest_reach = 0.01;

Vector3 rotation_vector(const Quaternion& rotation) {
  const Eigen::AngleAxisd turn(rotation.w() < 0.0 ? Quaternion(-rotation.coeffs()) : rotation);
  return turn.angle() * turn.axis();
}

double squared_distance(const BodyState& a, const BodyState& b, const Scales& scales) {
  const auto squared = [](const Vector3& difference, double scale) {
    return difference.squaredNorm() / (scale * scale);
  };
  const double alignment = std::min(std::abs(a.orientation.dot(b.orientation)), 1.0);
  const double angle = 2.0 * std::acos(alignment) / scales.orientation;
  return squared(a.position - b.position, scales.position) + angle * angle +
         squared(a.velocity - b.velocity, scales.velocity) +
         squared(a.angular_velocity - b.angular_velocity, scales.angular_velocity);
}

BodyState between(const BodyState& a, const BodyState& b, double t) {
  const auto mix = [t](const Vector3& one, const Vector3& two) -> Vector3 { return (1.0 - t) * one + t * two; };
  return {mix(a.position, b.position), a.orientation.slerp(t, b.orientation), mix(a.velocity, b.velocity),
          mix(a.angular_velocity, b.angular_velocity)};
}

// Draws around the starts: position, orientation and velocities evenly, the cost evenly below its bound, the time
// evenly up to the horizon.
class CostSampler : public ompl::base::StateSampler {
 public:
  CostSampler(const CostSpace* space, std::uint64_t seed) : StateSampler(space), cost_space_(space) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  }

  void sampleUniform(ompl::base::State* state) override {
    auto* sample = state->as<CostSpace::StateType>();
    for (std::size_t i = 0; i < sample->objects.size(); ++i) {
      sample->objects[i] = around(cost_space_->starts()[i], cost_space_->scales()[i]);
    }
    const double bound = cost_space_->bound();
    sample->cost = std::isfinite(bound) ? rng_.uniformReal(0.0, bound) : 0.0;
    if (cost_space_->horizon()) sample->time = rng_.uniformReal(0.0, *cost_space_->horizon());
    sample->node = -1;
  }

  void sampleUniformNear(ompl::base::State* state, const ompl::base::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ompl::base::State* state, const ompl::base::State*, double) override { sampleUniform(state); }

 private:
  BodyState around(const BodyState& start, const Scales& scales) {
    BodyState drawn;
    drawn.position = around(start.position, scales.position);
    const Vector3 turn = around(Vector3::Zero(), std::min(scales.orientation, 1.0));
    const Eigen::AngleAxisd rotation(turn.norm(), turn.norm() > 0.0 ? Vector3(turn.normalized()) : Vector3::UnitZ());
    drawn.orientation = Quaternion(rotation) * start.orientation;
    drawn.velocity = around(start.velocity, scales.velocity);
    drawn.angular_velocity = around(start.angular_velocity, scales.angular_velocity);
    return drawn;
  }

  Vector3 around(const Vector3& centre, double scale) {
    Vector3 drawn = centre;
    for (double& value : drawn) value += rng_.uniformReal(-sample_reach * scale, sample_reach * scale);
    return drawn;
  }

  const CostSpace* cost_space_;
};

}  // namespace

Scales::Scales(const Problem& problem, std::size_t index) {
  const Scene& scene = problem.scene;
  const Body& object = scene.bodies()[index];
  const Kinematics kinematics(scene);
  const BodyState start = kinematics(problem.state.data(), index);
  double speed = 0.0;  // of the fastest part of the effector
  for (const std::size_t effector : scene.with_role(Role::effector)) {
    speed = std::max(speed, kinematics(problem.state.data(), effector).velocity.norm());
  }
  speed += start.velocity.norm();
  const double time = problem.duration;
  const double acceleration = problem.force.norm() / object.mass;
  const double inertia = object.principal_inertial().moments.maxCoeff();
  const double angular_acceleration = problem.torque.norm() / inertia;
  const double inertial = std::sqrt(inertia / object.mass);
  const double extent = smallest_half_extent(object.shape);
  const double radius = std::isfinite(extent) ? extent : inertial;  // without parts it has none
  const double gyration = std::max(inertial, radius);
  position = std::max(speed * time + 0.5 * acceleration * time * time, smallest_reach * radius);
  velocity = std::max(speed + acceleration * time, position / time);
  angular_velocity = start.angular_velocity.norm() + velocity / gyration + angular_acceleration * time;
  orientation = start.angular_velocity.norm() * time + position / gyration + 0.5 * angular_acceleration * time * time;
}

CostSpace::CostSpace(const Problem& problem, std::uint64_t seed)
    : bound_(std::numeric_limits<double>::infinity()), seed_(seed), duration_(problem.duration) {
  setName("StateCost");
  if (const auto timing = timing_of(problem)) horizon_ = timing->horizon * problem.scene.stepping().step;
  const StateLayout layout(problem.scene);
  for (const std::size_t object : problem.scene.with_role(Role::object)) {
    starts_.push_back(StateLayout::read(problem.state.data() + layout.offset(object)));
    scales_.emplace_back(problem, object);
  }
}

ompl::base::State* CostSpace::allocState() const {
  auto* state = new StateType;
  state->objects.resize(starts_.size());
  return state;
}

double CostSpace::distance(const ompl::base::State* a, const ompl::base::State* b) const {
  const auto* one = a->as<StateType>();
  const auto* two = b->as<StateType>();
  double sum = 0.0;
  for (std::size_t i = 0; i < scales_.size(); ++i) {
    sum += squared_distance(one->objects[i], two->objects[i], scales_[i]);
  }
  sum /= static_cast<double>(scales_.size());
  if (horizon_) {
    const double time = (one->time - two->time) / duration_;
    sum += time * time;
  }
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
  const auto same = [](const BodyState& x, const BodyState& y) {
    return x.position == y.position && x.orientation.coeffs() == y.orientation.coeffs() && x.velocity == y.velocity &&
           x.angular_velocity == y.angular_velocity;
  };
  return one->node == two->node && one->cost == two->cost && one->time == two->time &&
         std::equal(one->objects.begin(), one->objects.end(), two->objects.begin(), same);
}

void CostSpace::interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                            ompl::base::State* state) const {
  const Values one = *from->as<StateType>();
  const Values two = *to->as<StateType>();
  auto* middle = state->as<StateType>();
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    middle->objects[i] = between(one.objects[i], two.objects[i], t);
  }
  middle->cost = (1.0 - t) * one.cost + t * two.cost;
  middle->time = (1.0 - t) * one.time + t * two.time;
  middle->node = -1;
}

ompl::base::StateSamplerPtr CostSpace::allocDefaultStateSampler() const {
  return std::make_shared<CostSampler>(this, seed_);
}

Vector3 turned(const BodyState& from, const BodyState& to) {
  return rotation_vector(to.orientation * from.orientation.conjugate());
}

}  // namespace energymargin::search
