#include "search/cost_space.hpp"

#include <ompl/base/ProjectionEvaluator.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "base/portable.hpp"
#include "energymargin/kinematics.hpp"

namespace energymargin::search {
namespace {

// Samples reach as far as this many longest edges lead: well outside of the tree, so that it is drawn outwards.
constexpr double sample_reach = 6.0;
// The cost counts as much as one longest edge over the whole of [0, c].
constexpr double cost_weight = 1.0;
// Cells a longest edge leads through, and cells between 0 and the bound on the cost.
constexpr double cells_per_edge = 8.0;
constexpr double cells_of_cost = 4.0;

// Where nothing pushes, a longest edge counts as this share of an object's smallest half extent.
constexpr double smallest_reach = 0.01;

// Of the fastest part of the effector [m/s].
double effector_speed(const Problem& problem, const Kinematics& kinematics) {
  double speed = 0.0;
  for (const std::size_t effector : problem.scene.with_role(Role::effector)) {
    speed = std::max(speed, kinematics(problem.state.data(), effector).velocity.norm());
  }
  return speed;
}

double squared_distance(const BodyState& a, const BodyState& b, const Scales& scales) {
  const auto squared = [](const Vector3& difference, double scale) {
    return difference.squaredNorm() / (scale * scale);
  };
  const double alignment = std::min(std::abs(a.orientation.dot(b.orientation)), 1.0);
  const double angle = 2.0 * portable::acos(alignment) / scales.orientation;
  return squared(a.position - b.position, scales.position) + angle * angle +
         squared(a.velocity - b.velocity, scales.velocity) +
         squared(a.angular_velocity - b.angular_velocity, scales.angular_velocity);
}

BodyState interpolate(const BodyState& a, const BodyState& b, double t) {
  const auto mix = [t](const Vector3& x, const Vector3& y) -> Vector3 { return (1.0 - t) * x + t * y; };
  return {mix(a.position, b.position), portable::slerp(a.orientation, t, b.orientation), mix(a.velocity, b.velocity),
          mix(a.angular_velocity, b.angular_velocity)};
}

// Draws evenly: bodies around their starts, the cost below its bound, the time up to the horizon.
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
    const Vector3 axis = turn.norm() > 0.0 ? Vector3(turn.normalized()) : Vector3::UnitZ();
    sample.orientation = portable::turn(turn.norm(), axis) * start.orientation;
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

// OMPL numbers cells by int; what lies farther out is in the last one.
double within_cells(double coordinate) {
  if (std::isnan(coordinate)) {
    throw std::domain_error("a coordinate of EST's grid is nan, expected a number: the node's state is not finite");
  }
  using Cell = std::numeric_limits<int>;
  return std::clamp(coordinate, static_cast<double>(Cell::min()), static_cast<double>(Cell::max()));
}

// The grid in which EST and other planners count states.
class Projection : public ompl::base::ProjectionEvaluator {
 public:
  explicit Projection(const CostSpace& space) : ProjectionEvaluator(&space), cost_space_(space) {
    setCellSizes(std::vector<double>(getDimension(), 1.0));
  }

  unsigned int getDimension() const override {
    return 6 * static_cast<unsigned int>(cost_space_.starts().size()) + 1 + (cost_space_.horizon() ? 1 : 0);
  }

  void project(const ompl::base::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override {
    const auto* node = state->as<CostSpace::StateType>();
    const double bound = cost_space_.bound();
    for (std::size_t i = 0; i < node->objects.size(); ++i) {
      const BodyState& start = cost_space_.starts()[i];
      const Scales& scales = cost_space_.scales()[i];
      auto object = projection.segment<6>(6 * static_cast<Eigen::Index>(i));
      object.head<3>() = cells_per_edge / scales.position * (node->objects[i].position - start.position);
      object.tail<3>() = cells_per_edge / scales.orientation * rotation(start, node->objects[i]);
    }
    const Eigen::Index cost = 6 * static_cast<Eigen::Index>(node->objects.size());
    projection[cost] = std::isfinite(bound) && bound > 0.0 ? cells_of_cost * node->cost / bound : 0.0;
    if (cost_space_.horizon()) projection[cost + 1] = cells_per_edge / cost_space_.duration() * node->time;
    for (double& coordinate : projection) coordinate = within_cells(coordinate);
  }

 private:
  const CostSpace& cost_space_;
};

}  // namespace

Edge largest_edge(const Problem& problem) {
  const auto objects = static_cast<Eigen::Index>(problem.scene.with_role(Role::object).size());
  Edge largest;
  largest.wrenches.resize(objects * wrench_axes);
  for (Eigen::Index i = 0; i < objects; ++i) {
    largest.wrenches.segment<wrench_axes>(i * wrench_axes) << problem.force, problem.torque;
  }
  largest.steps = static_cast<int>(std::floor(problem.duration / problem.scene.stepping().step + 1e-9));
  return largest;
}

Scales::Scales(const Problem& problem, std::size_t index) {
  const Scene& scene = problem.scene;
  const Body& object = scene.bodies()[index];
  const Kinematics kinematics(scene);
  const BodyState start = kinematics(problem.state.data(), index);
  const double speed = effector_speed(problem, kinematics) + start.velocity.norm();
  const double time = problem.duration;
  const double acceleration = problem.force.norm() / object.mass;
  const double inertia = scene.inertial(index).moments.maxCoeff();
  const double angular_acceleration = problem.torque.norm() / inertia;
  const double radius_of_gyration = std::sqrt(inertia / object.mass);
  const double extent = scene.smallest_half_extent(index);
  const double radius = std::isfinite(extent) ? extent : radius_of_gyration;  // without parts it has none
  const double turning_radius = std::max(radius_of_gyration, radius);
  position = std::max(speed * time + 0.5 * acceleration * time * time, smallest_reach * radius);
  velocity = std::max(speed + acceleration * time, position / time);
  angular_velocity = start.angular_velocity.norm() + velocity / turning_radius + angular_acceleration * time;
  orientation =
      start.angular_velocity.norm() * time + position / turning_radius + 0.5 * angular_acceleration * time * time;
}

CostSpace::CostSpace(const Problem& problem, std::uint64_t seed)
    : bound_(std::numeric_limits<double>::infinity()), seed_(seed), duration_(problem.duration) {
  setName("StateCost");
  if (const auto timing = timing_of(problem)) horizon_ = timing->horizon * problem.scene.stepping().step;
  const Kinematics kinematics(problem.scene);
  for (const std::size_t object : problem.scene.with_role(Role::object)) {
    starts_.push_back(kinematics(problem.state.data(), object));
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
  return portable::rotation_vector(to.orientation * from.orientation.conjugate());
}

}  // namespace energymargin::search
