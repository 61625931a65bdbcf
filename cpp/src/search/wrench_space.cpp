#include <ompl/control/ControlSampler.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <vector>

#include "base/portable.hpp"
#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

constexpr double one_object_share = 0.5;  // of the draws disturb one object alone, where there are several
constexpr double repeated_share = 0.15;   // of the mixed draws have the wrench of the edge before

// How a mixed draw that does not repeat comes about.
enum class Kind {
  coasting,   // no wrench: what moves costs nothing
  at_bounds,  // each axis at a bound or at zero: least-effort pushes are often bang-bang
  one_axis,   // one axis alone
  even,       // evenly between the bounds
};

struct Share {
  Kind kind;
  double share;
};

// The rest is even, which keeps AO-x asymptotically optimal.
constexpr Share mixture[] = {{Kind::coasting, 0.15}, {Kind::at_bounds, 0.15}, {Kind::one_axis, 0.15}};

// The kind of a draw by a number from [0, 1).
Kind kind_of(double number) {
  for (const Share& part : mixture) {
    number -= part.share;
    if (number < 0.0) return part.kind;
  }
  return Kind::even;
}

// With a horizon.
constexpr double wait_share = 0.5;     // of the draws without a wrench last up to all the time that is left
constexpr double longest_share = 0.2;  // of the others last as long as they may

// Draws wrenches between their bounds, and durations as T U^(1/d) with d the number of axes that act on an object: even
// in what they reach. Of several objects it disturbs all, or one alone, which is what gets it out with the least work.
class WrenchSampler : public ompl::control::ControlSampler {
 public:
  WrenchSampler(const WrenchSpace* space, std::uint64_t seed)
      : ControlSampler(space),
        bounds_(space->getBounds()),
        axes_(space->getDimension() - 1),
        mixed_(space->sampling() == Sampling::mixed) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
    for (unsigned int axis = 0; axis < wrench_axes; ++axis) active_ += bounds_.high[axis] > 0.0 ? 1 : 0;
  }

  void sample(ompl::control::Control* control) override {
    double* values = control->as<WrenchSpace::ControlType>()->values;
    draw_evenly(values);
    const Kind kind = mixed_ ? kind_of(rng_.uniform01()) : Kind::even;
    change(values, kind);
    const bool coasts = kind == Kind::coasting;
    const bool waits = coasts && steps_left_ && rng_.uniform01() < wait_share;
    values[axes_] = waits ? rng_.uniformInt(1, std::max(*steps_left_, 1)) : draw_steps();
    if (mixed_ && steps_left_ && !coasts && rng_.uniform01() < longest_share) values[axes_] = bounds_.high.back();
  }

  void sample(ompl::control::Control* control, const ompl::base::State* state) override {
    steps_left_ = space_->as<WrenchSpace>()->steps_left(state);
    sample(control);
  }

  void sampleNext(ompl::control::Control* control, const ompl::control::Control* previous) override {
    if (!mixed_ || rng_.uniform01() >= repeated_share) return sample(control);
    double* values = control->as<WrenchSpace::ControlType>()->values;
    std::copy_n(previous->as<WrenchSpace::ControlType>()->values, axes_, values);
    values[axes_] = draw_steps();
  }

  void sampleNext(ompl::control::Control* control, const ompl::control::Control* previous,
                  const ompl::base::State* state) override {
    steps_left_ = space_->as<WrenchSpace>()->steps_left(state);
    // Planners call this one. Without a clock it is as OMPL's own, which forgets the edge before.
    if (steps_left_) return sampleNext(control, previous);
    sample(control);
  }

 private:
  void draw_evenly(double* values) {
    const unsigned int only = draw_object();
    for (unsigned int i = 0; i < axes_; ++i) {
      const double bound = only == objects() || only == i / wrench_axes ? bounds_.high[i] : 0.0;
      values[i] = bound > 0.0 ? rng_.uniformReal(-bound, bound) : 0.0;
    }
  }

  // Of an even draw.
  void change(double* values, Kind kind) {
    if (kind == Kind::coasting) std::fill_n(values, axes_, 0.0);
    if (kind == Kind::at_bounds) set_to_bounds(values);
    if (kind == Kind::one_axis) leave_one_axis(values);
  }

  void set_to_bounds(double* values) {
    for (unsigned int i = 0; i < axes_; ++i) {
      if (values[i] != 0.0) values[i] = rng_.uniformInt(-1, 1) * bounds_.high[i];
    }
  }

  void leave_one_axis(double* values) {
    std::vector<unsigned int> acting;
    for (unsigned int i = 0; i < axes_; ++i) {
      if (values[i] != 0.0) acting.push_back(i);
    }
    const auto index = static_cast<std::size_t>(rng_.uniformInt(0, std::max(static_cast<int>(acting.size()) - 1, 0)));
    for (std::size_t i = 0; i < acting.size(); ++i) {
      if (i != index) values[acting[i]] = 0.0;
    }
  }

  double draw_steps() {
    const double longest = bounds_.high.back();
    return std::clamp(std::ceil(longest * portable::pow(rng_.uniform01(), 1.0 / active_)), 1.0, longest);
  }

  // The one that is disturbed alone, or the number of objects for all.
  unsigned int draw_object() {
    if (objects() == 1 || rng_.uniform01() >= one_object_share) return objects();
    return static_cast<unsigned int>(rng_.uniformInt(0, static_cast<int>(objects()) - 1));
  }

  unsigned int objects() const { return axes_ / wrench_axes; }

  const ompl::base::RealVectorBounds& bounds_;
  unsigned int axes_;
  bool mixed_;
  int active_ = 0;
  std::optional<int> steps_left_;  // until the horizon, from the state that is drawn for
};

}  // namespace

WrenchSpace::WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed,
                         Sampling sampling)
    : RealVectorControlSpace(states, static_cast<unsigned int>(largest_edge(problem).wrenches.size()) + 1),
      seed_(seed),
      sampling_(sampling),
      step_(problem.scene.stepping().step) {
  const Edge largest = largest_edge(problem);
  ompl::base::RealVectorBounds bounds(getDimension());
  bounds.high.assign(largest.wrenches.begin(), largest.wrenches.end());
  bounds.high.push_back(largest.steps);
  std::transform(bounds.high.begin(), bounds.high.end(), bounds.low.begin(), std::negate<>());
  bounds.low.back() = 1.0;
  setBounds(bounds);
}

Edge WrenchSpace::edge(const ompl::control::Control* control) const {
  const double* values = control->as<ControlType>()->values;
  const Eigen::Index axes = getDimension() - 1;
  return {Eigen::Map<const Eigen::VectorXd>(values, axes), static_cast<int>(values[axes])};
}

std::optional<int> WrenchSpace::steps_left(const ompl::base::State* state) const {
  const std::optional<double>& horizon = stateSpace_->as<CostSpace>()->horizon();
  if (!horizon) return std::nullopt;
  return static_cast<int>(std::lround((*horizon - state->as<CostSpace::StateType>()->time) / step_));
}

ompl::control::ControlSamplerPtr WrenchSpace::allocDefaultControlSampler() const {
  return std::make_shared<WrenchSampler>(this, seed_);
}

std::shared_ptr<const void> quiet_ompl() {
  static std::mutex mutex;
  static int searches = 0;
  static ompl::msg::LogLevel before;
  const auto leave = [](const void*) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (--searches == 0) ompl::msg::setLogLevel(before);
  };
  const std::lock_guard<std::mutex> lock(mutex);
  if (searches++ == 0) {
    before = ompl::msg::getLogLevel();
    ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  }
  return {&searches, leave};
}

}  // namespace energymargin::search
