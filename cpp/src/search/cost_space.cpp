#include "search/cost_space.hpp"

#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "search/projection.hpp"

namespace energymargin::search {
namespace {

// Samples reach as far as this many longest edges lead: well outside of the tree, so that it is drawn outwards.
constexpr double sample_reach = 6.0;
// The cost counts as much as one longest edge over the whole of [0, c].
constexpr double cost_weight = 1.0;

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

BodyState interpolate(const BodyState& a, const BodyState& b, double t) {
  const auto mix = [t](const Vector3& x, const Vector3& y) -> Vector3 { return (1.0 - t) * x + t * y; };
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
    BodyState sample;
    sample.position = around(start.position, scales.position);
    const Vector3 turn = around(Vector3::Zero(), std::min(scales.orientation, 1.0));
    const Eigen::AngleAxisd rotation(turn.norm(), turn.norm() > 0.0 ? Vector3(turn.normalized()) : Vector3::UnitZ());
    sample.orientation = Quaternion(rotation) * start.orientation;
    sample.velocity = around(start.velocity, scales.velocity);
    sample.angular_velocity = around(start.angular_velocity, scales.angular_velocity);
    return sample;
  }

  Vector3 around(const Vector3& centre, double scale) {
    Vector3 sample = centre;
    for (double& value : sample) value += rng_.uniformReal(-sample_reach * scale, sample_reach * scale);
    return sample;
  }

  const CostSpace* cost_space_;
};

}  // namespace

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

void CostSpace::registerProjections() { registerDefaultProjection(std::make_shared<Projection>(*this)); }

ompl::base::State* CostSpace::allocState() const {
  auto* state = new StateType;
  state->objects.resize(starts_.size());
  return state;
}

double CostSpace::distance(const ompl::base::State* a, const ompl::base::State* b) const {
  const auto* from = a->as<StateType>();
  const auto* to = b->as<StateType>();
  double sum = 0.0;
  for (std::size_t i = 0; i < scales_.size(); ++i) {
    sum += squared_distance(from->objects[i], to->objects[i], scales_[i]);
  }
  sum /= static_cast<double>(scales_.size());
  if (horizon_) {
    const double time = (from->time - to->time) / duration_;
    sum += time * time;
  }
  if (std::isfinite(bound_) && bound_ > 0.0) {
    const double cost = cost_weight * (from->cost - to->cost) / bound_;
    sum += cost * cost;
  }
  return std::sqrt(sum);
}

double CostSpace::getMaximumExtent() const { return 4.0 * sample_reach; }

void CostSpace::copyState(ompl::base::State* destination, const ompl::base::State* source) const {
  static_cast<Values&>(*destination->as<StateType>()) = *source->as<StateType>();
}

bool CostSpace::equalStates(const ompl::base::State* a, const ompl::base::State* b) const {
  const auto* from = a->as<StateType>();
  const auto* to = b->as<StateType>();
  const auto same = [](const BodyState& x, const BodyState& y) {
    return x.position == y.position && x.orientation.coeffs() == y.orientation.coeffs() && x.velocity == y.velocity &&
           x.angular_velocity == y.angular_velocity;
  };
  return from->node == to->node && from->cost == to->cost && from->time == to->time &&
         std::equal(from->objects.begin(), from->objects.end(), to->objects.begin(), same);
}

void CostSpace::interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                            ompl::base::State* state) const {
  const Values first = *from->as<StateType>();  // copies: `state` may be either
  const Values last = *to->as<StateType>();
  auto* middle = state->as<StateType>();
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    middle->objects[i] = search::interpolate(first.objects[i], last.objects[i], t);
  }
  middle->cost = (1.0 - t) * first.cost + t * last.cost;
  middle->time = (1.0 - t) * first.time + t * last.time;
  middle->node = -1;
}

ompl::base::StateSamplerPtr CostSpace::allocDefaultStateSampler() const {
  return std::make_shared<CostSampler>(this, seed_);
}

Vector3 rotation(const BodyState& from, const BodyState& to) {
  return rotation_vector(to.orientation * from.orientation.conjugate());
}

}  // namespace energymargin::search
