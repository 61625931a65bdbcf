#include "energymargin/metrics/probability.hpp"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "base/check.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/parallel.hpp"
#include "search/exit.hpp"
#include "search/horizon.hpp"

namespace energymargin {
namespace {

constexpr int default_rollouts = 30;
constexpr double most_diverged = 0.01;  // of the rollouts
constexpr double looked_at = 0.95;      // confidence of the interval that a tolerance is about

// What one rollout tells.
struct Path {
  std::vector<int> exits;  // of each set, steps; -1: none
  bool success = false;
  double effort = 0.0;
  int steps = 0;
  bool complete = true;
  bool diverged = false;
};

class Estimate {
 public:
  Estimate(const Problem& problem, const ProbabilityOptions& options)
      : problem_(problem), options_(options), timing_(*timing_of(problem)) {
    sets_.emplace_back(problem.captured, problem.scene);
    if (options.by_object && problem.captured_any) {
      sets_.emplace_back(*problem.captured_any, problem.scene);
      for (const Region& set : captured_by_object(problem)) sets_.emplace_back(set, problem.scene);
    }
    if (options.success) success_.emplace(*problem.succeeded, problem.scene);
    if (const auto* boltzmann = std::get_if<disturbances::Boltzmann>(&options.disturbance)) rate_ = boltzmann->rate;
  }

  CaptureProbability find() {
    const Disturbance nothing(problem_.scene.with_role(Role::object).size());
    undisturbed_ = run({{nothing, timing_.horizon}}, nullptr);
    if (!undisturbed_.complete) options_.limit.require();
    if (undisturbed_.diverged) throw Diverged("the undisturbed future");
    const int most = options_.rollouts.value_or(options_.tolerance ? most_rollouts : default_rollouts);
    int wanted = options_.tolerance ? std::min(first_look, most) : most;
    for (long long at = wanted; at < most; at *= 2) ++looks_;
    while (true) {
      roll(wanted);
      if (counted() < wanted || wanted == most || is_met()) break;
      wanted = static_cast<int>(std::min<long long>(2LL * wanted, most));
    }
    if (counted() == 0 && options_.limit.reached()) options_.limit.require();
    return result(wanted);
  }

 private:
  // Up to number `wanted`, each a function of its number alone.
  void roll(int wanted) {
    const std::size_t first = paths_.size();
    paths_.resize(static_cast<std::size_t>(wanted));
    done_.resize(paths_.size(), 0);
    parallel_for(
        paths_.size() - first, options_.threads,
        [&](std::size_t i) {
          const std::size_t index = first + i;
          paths_[index] = run(index);
          done_[index] = paths_[index].complete ? 1 : 0;
          if (options_.made) ++*options_.made;
        },
        options_.limit);
  }

  // Complete ones, up to the first that is not.
  int counted() const { return static_cast<int>(std::find(done_.begin(), done_.end(), 0) - done_.begin()); }

  Path run(std::size_t index) {
    const auto plan = draw_plan(options_.disturbance, problem_, options_.seed, index);
    return run(draw_pushes(options_.disturbance, problem_, timing_.horizon, options_.seed, index),
               plan ? &*plan : nullptr);
  }

  // Under `pushes`; `plan` in place of the problem's, if it is given.
  Path run(const std::vector<Push>& pushes, const Plan* plan) {
    std::unique_ptr<World> world = take();
    Path path;
    try {
      if (plan) world->follow(*plan);
      path = follow(*world, pushes, options_.limit);
    } catch (const Diverged&) {
      path.diverged = true;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    worlds_.push_back(std::move(world));
    return path;
  }

  std::unique_ptr<World> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (worlds_.empty()) return std::make_unique<World>(search::world_of(problem_));
    std::unique_ptr<World> world = std::move(worlds_.back());
    worlds_.pop_back();
    return world;
  }

  Path follow(World& world, const std::vector<Push>& pushes, const Limit& limit) const {
    std::vector<search::Exit> exits(sets_.size(), search::Exit(timing_.dwell));
    const auto look = [&](const State& state, int step) {
      bool all_left = true;
      for (std::size_t i = 0; i < sets_.size(); ++i) {
        if (!exits[i].left()) exits[i].look(sets_[i](state), step);
        all_left = all_left && exits[i].left();
      }
      return all_left;
    };
    const bool to_the_end = success_ || rate_;
    Path path;
    if (!look(problem_.state, 0) || to_the_end) {
      int step = 0;
      Watch watch;
      watch.look_every = timing_.check;
      watch.ends = [&](const State& state) { return look(state, step += timing_.check) && !to_the_end; };
      const Rollout rollout = world.rollout_unchecked(problem_.state, pushes, limit, watch);
      path.complete = rollout.complete;
      path.steps = rollout.steps;
      path.effort = rollout.effort;
      if (rollout.complete && rollout.steps == timing_.horizon) {
        look(rollout.state, timing_.horizon);
        for (search::Exit& exit : exits) exit.end();
        path.success = success_ && (*success_)(rollout.state);
      }
    }
    for (const search::Exit& exit : exits) path.exits.push_back(exit.left() ? exit.since() : -1);
    return path;
  }

  // Of the first rollouts; 0 for one that diverged.
  std::vector<double> weights(int count) const {
    std::vector<double> weights(static_cast<std::size_t>(count), 0.0);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count; ++i) {
      if (!paths_[std::size_t(i)].diverged) least = std::min(least, paths_[std::size_t(i)].effort);
    }
    for (int i = 0; i < count; ++i) {
      const Path& path = paths_[static_cast<std::size_t>(i)];
      if (path.diverged) continue;
      weights[static_cast<std::size_t>(i)] = rate_ ? std::exp(-*rate_ * (path.effort - least)) : 1.0;
    }
    return weights;
  }

  static double total(const std::vector<double>& weights) {
    return std::accumulate(weights.begin(), weights.end(), 0.0);
  }

  static double effective(const std::vector<double>& weights) {
    double squares = 0.0;
    for (const double weight : weights) squares += weight * weight;
    return std::pow(total(weights), 2) / squares;
  }

  bool is_met() const {
    const std::vector<double> shares = weights(counted());
    const Interval found =
        interval(survival(0, shares).captured(), effective(shares), 1.0 - (1.0 - looked_at) / looks_);
    return 0.5 * (found.high - found.low) <= *options_.tolerance;
  }

  std::vector<int> instants() const {
    std::vector<int> steps;
    for (int step = 0; step < timing_.horizon; step += timing_.check) steps.push_back(step);
    steps.push_back(timing_.horizon);
    return steps;
  }

  Survival survival(std::size_t set, const std::vector<double>& shares) const {
    const std::vector<int> steps = instants();
    const double step = problem_.scene.stepping().step;
    Survival found{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(steps.size()))};
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (shares[i] == 0.0) continue;
      const int exit = paths_[i].exits[set];
      found.mean_time += shares[i] * step * (exit < 0 ? timing_.horizon : exit);
      if (exit < 0) continue;
      const auto from = std::lower_bound(steps.begin(), steps.end(), exit) - steps.begin();
      found.curve.tail(found.curve.size() - from).array() += shares[i];
    }
    // Sums of the same numbers in the same order give exactly 0 and 1.
    found.curve = 1.0 - found.curve.array() / total(shares);
    found.mean_time /= total(shares);
    return found;
  }

  CaptureProbability result(int wanted) const {
    CaptureProbability found;
    const int count = counted();
    found.complete = count == wanted;
    found.looks = looks_;
    found.steps = undisturbed_.steps;
    for (int i = 0; i < count; ++i) {
      found.diverged += paths_[static_cast<std::size_t>(i)].diverged ? 1 : 0;
      found.steps += paths_[static_cast<std::size_t>(i)].steps;
    }
    found.rollouts = count - found.diverged;
    if (found.diverged > most_diverged * count) {
      throw std::runtime_error(std::to_string(found.diverged) + " of " + std::to_string(count) +
                               " rollouts diverged, which is too many for a probability: a shorter step of the scene, "
                               "or a weaker disturbance");
    }
    const double step = problem_.scene.stepping().step;
    found.times.resize(static_cast<Eigen::Index>(instants().size()));
    for (Eigen::Index i = 0; i < found.times.size(); ++i) found.times[i] = step * instants()[std::size_t(i)];
    const int exit = undisturbed_.exits[0];
    found.undisturbed = exit < 0;
    found.undisturbed_time = step * (exit < 0 ? timing_.horizon : exit);
    if (success_) found.undisturbed_success = undisturbed_.success;
    const std::vector<double> shares = weights(count);
    found.effective = effective(shares);
    found.all = survival(0, shares);
    if (sets_.size() > 1) found.any = survival(1, shares);
    for (std::size_t set = 2; set < sets_.size(); ++set) found.by_object.push_back(survival(set, shares));
    if (success_) {
      found.success = 0.0;
      for (std::size_t i = 0; i < shares.size(); ++i) *found.success += paths_[i].success ? shares[i] : 0.0;
      *found.success /= total(shares);
    }
    return found;
  }

  const Problem& problem_;
  const ProbabilityOptions& options_;
  Timing timing_;
  std::vector<Membership> sets_;  // all, and any and each object
  std::optional<Membership> success_;
  std::optional<double> rate_;
  Path undisturbed_;
  std::vector<Path> paths_;
  std::vector<char> done_;
  int looks_ = 1;  // that may be, known before the first one
  std::mutex mutex_;
  std::vector<std::unique_ptr<World>> worlds_;  // that nobody uses now
};

void validate(const Problem& problem, const ProbabilityOptions& options) {
  if (!timing_of(problem)) {
    reject("problem", "without horizon and plan", "one with: problem.replace(horizon=...)");
  }
  if (options.rollouts) require_at_least("rollouts", *options.rollouts, 1);
  require_at_least("threads", options.threads, 1);
  if (options.tolerance) require_positive("tolerance", *options.tolerance);
  if (options.success && !problem.succeeded) reject("success", "True", "a problem with a success set");
  if (options.by_object && !problem.captured_any) {
    reject("by_object", "True", "a problem with a capture set for each object, captured={...}");
  }
  validate(options.disturbance, problem);
  const auto* given = std::get_if<disturbances::Given>(&options.disturbance);
  if (given && static_cast<int>(given->rollouts.size()) < options.rollouts.value_or(default_rollouts)) {
    reject("disturbance", std::to_string(given->rollouts.size()) + " rollouts", "as many as `rollouts`");
  }
}

}  // namespace

CaptureProbability capture_probability(const Problem& problem, const ProbabilityOptions& options) {
  validate(problem);
  validate(problem, options);
  return Estimate(problem, options).find();
}

Interval interval(double probability, double effective, double confidence) {
  if (!(confidence > 0.0 && confidence < 1.0)) reject("confidence", text(confidence), "a number between 0 and 1");
  const double inside = probability * effective;
  const double outside = effective - inside;
  const double tail = 0.5 * (1.0 - confidence);
  const auto beta = [](double a, double b, double share) {
    return quantile(boost::math::beta_distribution<>(a, b), share);
  };
  return {inside > 0.0 ? beta(inside, outside + 1.0, tail) : 0.0,
          outside > 0.0 ? beta(inside + 1.0, outside, 1.0 - tail) : 1.0};
}

}  // namespace energymargin
