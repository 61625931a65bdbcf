// A probability by many rollouts with a long step, and by a few of them with the scene's step again.

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "base/check.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/random.hpp"

namespace energymargin {
namespace {

constexpr double longer[] = {8.0, 4.0, 2.0};  // steps of the scene that are tried
constexpr int tried = 32;                     // rollouts that choose the step; they do not count, so all stays unbiased
constexpr std::uint64_t trial_stream = 0x7374657073;  // their own
constexpr int first_rollouts = 64;                    // with a tolerance
constexpr double least_share = 0.02;                  // of the rollouts take both steps
constexpr double usual_confidence = 0.95;

// A long step, and which share of the rollouts takes the scene's step too.
struct Choice {
  Problem problem;
  double share;
};

// Rollouts of one step, as they grow.
struct Level {
  std::vector<double> exits{};  // [s]; inf: none, NaN: it diverged
  int diverged = 0;
};

// Numbers of pairs that count, and of them those that one step alone keeps.
struct Pairs {
  double count = 0.0, better = 0.0, worse = 0.0;
};

bool stays(double exit, double time, double rounding) { return exit > time + rounding; }

Pairs pairs_of(const std::vector<double>& coarse, const std::vector<double>& fine, double time, double rounding) {
  Pairs pairs;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    if (std::isnan(coarse[i]) || std::isnan(fine[i])) continue;
    const bool with_long = stays(coarse[i], time, rounding), with_own = stays(fine[i], time, rounding);
    pairs.count += 1.0;
    pairs.better += with_own && !with_long ? 1.0 : 0.0;
    pairs.worse += with_long && !with_own ? 1.0 : 0.0;
  }
  return pairs;
}

// Of those that do not diverge: the mean of what `value` says of each.
template <typename Value>
double mean(const std::vector<double>& exits, const Value& value) {
  double sum = 0.0, count = 0.0;
  for (const double exit : exits) {
    if (std::isnan(exit)) continue;
    sum += value(exit);
    count += 1.0;
  }
  return sum / count;
}

// Agresti and Min (2005): a pair more of each kind that differs, at half its weight.
Interval interval_of(const Pairs& pairs, double confidence) {
  const double normal = quantile(boost::math::normal_distribution<>(), 0.5 * (1.0 + confidence));
  const double difference = pairs.better - pairs.worse, count = pairs.count + 2.0;
  const double half = normal * std::sqrt(pairs.better + pairs.worse + 1.0 - difference * difference / count) / count;
  return {difference / count - half, difference / count + half};
}

class TwoStepEstimate {
 public:
  TwoStepEstimate(const Problem& problem, const ProbabilityOptions& options)
      : problem_(problem), options_(options), step_(problem.scene.stepping().step) {
    options_.rollouts.reset();
    options_.tolerance.reset();
    options_.long_step.reset();
    options_.finds_step = false;
    if (!options_.drawn_step) options_.drawn_step = step_;
  }

  // Of all that it simulated.
  const StepCounts& counts() const { return counts_; }

  // None if the scene's step alone takes less.
  std::optional<CaptureProbability> estimate(const ProbabilityOptions& asked) {
    const std::optional<Choice> choice = choose(asked.long_step);
    if (!choice) return std::nullopt;
    const int most = asked.rollouts.value_or(asked.tolerance ? most_rollouts : 30);
    int wanted = asked.tolerance ? std::min(first_rollouts, most) : most, looks = 1;
    for (int look = wanted; look < most; look = std::min(2 * look, most)) ++looks;
    const double confidence = 1.0 - (1.0 - usual_confidence) / looks;
    while (true) {
      const auto again = static_cast<int>(std::ceil(choice->share * wanted));
      const bool complete = grow(choice->problem, wanted, coarse_) && grow(problem_, again, fine_);
      if (!first_) options_.limit.require();
      CaptureProbability p = result(*choice, looks);
      p.complete = complete;
      const Interval ends = interval_of_capture(p, confidence);
      if (!complete || wanted == most || 0.5 * (ends.high - ends.low) <= *asked.tolerance) return p;
      wanted = std::min(2 * wanted, most);
    }
  }

 private:
  CaptureProbability ask(const Problem& problem, int first, int rollouts) const {
    ProbabilityOptions options = options_;
    options.first = static_cast<std::uint64_t>(first);
    options.rollouts = rollouts;
    options.undisturbed = options_.undisturbed && first == 0 && problem.scene.stepping().step == step_;
    return capture_probability(problem, options);
  }

  void count(const CaptureProbability& p, const Problem& problem) {
    counts_ += p;
    simulated_ += static_cast<double>(p.steps) * problem.scene.stepping().step;
  }

  // The step, and the share that takes both, with which an answer as sure takes the fewest steps, by a trial.
  std::optional<Choice> choose(const std::optional<double>& long_step) {
    TwoStepEstimate trial = *this;
    trial.options_.seed = stream(options_.seed, trial_stream);
    trial.options_.undisturbed = false;
    trial.options_.rollout_counter = nullptr;
    const CaptureProbability own = trial.ask(problem_, 0, tried);
    if (!own.complete) options_.limit.require();
    count(own, problem_);
    const double cost = static_cast<double>(own.steps) / tried;
    double least = long_step ? std::numeric_limits<double>::infinity() : cost * variance(own.all.captured());
    std::optional<Choice> best;
    const auto look = [&](const Problem& problem) {
      const CaptureProbability p = trial.ask(problem, 0, tried);
      if (!p.complete) options_.limit.require();
      count(p, problem);
      const Pairs pairs = pairs_of(exits_of(p), exits_of(own), horizon_of(own), 0.5 * step_);
      const double differ = (pairs.better + pairs.worse + 1.0) / (pairs.count + 2.0);
      const double of_long = variance(p.all.captured()), cost_of_long = static_cast<double>(p.steps) / tried;
      const double total = std::pow(std::sqrt(of_long * cost_of_long) + std::sqrt(differ * cost), 2);
      if (!(total < least)) return;
      least = total;
      const double share = std::sqrt(differ * cost_of_long / (of_long * cost));
      best = {problem, std::clamp(share, least_share, 1.0)};
    };
    if (long_step) {
      look(with_step(problem_, *long_step));
    } else {
      for (const double steps : longer) {
        try {
          look(with_step(problem_, steps * step_));
        } catch (const std::invalid_argument&) {  // it does not fit the problem
        } catch (const std::runtime_error&) {     // it diverges
          options_.limit.require();
        }
      }
    }
    return best;
  }

  // Of a few rollouts.
  static double variance(double captured) {
    const double p = (captured * tried + 1.0) / (tried + 2.0);
    return p * (1.0 - p);
  }

  static std::vector<double> exits_of(const CaptureProbability& p) {
    return {p.exit_times.begin(), p.exit_times.end()};
  }

  static double horizon_of(const CaptureProbability& p) { return p.times[p.times.size() - 1]; }

  // Up to so many rollouts. False if the limit was reached before.
  bool grow(const Problem& problem, int wanted, Level& level) {
    const auto there = static_cast<int>(level.exits.size());
    if (there == wanted) return true;
    try {
      CaptureProbability p = ask(problem, there, wanted - there);
      const std::vector<double> exits = exits_of(p);
      level.exits.insert(level.exits.end(), exits.begin(), exits.end());
      level.diverged += p.diverged;
      count(p, problem);
      if (&level == &fine_ && there == 0) first_ = std::move(p);
    } catch (const Cancelled&) {
      if (!first_) throw;
    } catch (const TimedOut&) {
      if (!first_) throw;
    }
    return static_cast<int>(level.exits.size()) == wanted;
  }

  CaptureProbability result(const Choice& choice, int looks) const {
    CaptureProbability p = *first_;
    static_cast<StepCounts&>(p) = counts_;
    const double rounding = 0.5 * step_, horizon = horizon_of(p);
    TwoSteps& of = p.two_steps.emplace();
    of.step = choice.problem.scene.stepping().step;
    of.captured = of.better = of.worse = Eigen::VectorXd::Zero(p.times.size());
    for (Eigen::Index i = 0; i < p.times.size(); ++i) {
      const double time = p.times[i];
      of.captured[i] = mean(coarse_.exits, [&](double exit) { return stays(exit, time, rounding) ? 1.0 : 0.0; });
      const Pairs pairs = pairs_of(coarse_.exits, fine_.exits, time, rounding);
      of.better[i] = pairs.better;
      of.worse[i] = pairs.worse;
      of.pairs = static_cast<int>(pairs.count);
    }
    of.rollouts = p.rollouts = static_cast<int>(coarse_.exits.size()) - coarse_.diverged;
    p.diverged = coarse_.diverged + fine_.diverged;
    const Eigen::ArrayXd differences = (of.better - of.worse).array() / of.pairs;
    p.all.curve = (of.captured.array() + differences).max(0.0).min(1.0);
    p.lost = 1.0 - p.all.curve.array();
    p.all.mean_time = mean_time(horizon);
    p.exit_times =
        Eigen::Map<const Eigen::VectorXd>(coarse_.exits.data(), static_cast<Eigen::Index>(coarse_.exits.size()));
    p.looks = looks;
    const Eigen::Index last = p.times.size() - 1;
    const double q = of.captured[last], differ = (of.better[last] + of.worse[last]) / of.pairs;
    const double spread = q * (1.0 - q) / of.rollouts + differ / of.pairs, captured = p.all.captured();
    p.effective = spread > 0.0 && captured * (1.0 - captured) > 0.0 ? captured * (1.0 - captured) / spread : of.pairs;
    p.effective_of_parts = p.effective;
    p.warnings = implausible(counts_, simulated_);
    return p;
  }

  double mean_time(double horizon) const {
    const auto within = [horizon](double exit) { return std::min(exit, horizon); };
    double sum = 0.0, count = 0.0;
    for (std::size_t i = 0; i < fine_.exits.size(); ++i) {
      if (std::isnan(coarse_.exits[i]) || std::isnan(fine_.exits[i])) continue;
      sum += within(fine_.exits[i]) - within(coarse_.exits[i]);
      count += 1.0;
    }
    return mean(coarse_.exits, within) + sum / count;
  }

  const Problem& problem_;
  ProbabilityOptions options_;  // of each part
  double step_;
  Level coarse_, fine_;
  StepCounts counts_{};
  double simulated_ = 0.0;                   // [s]
  std::optional<CaptureProbability> first_;  // of the scene's step
};

}  // namespace

CaptureProbability capture_probability_of_two_steps(const Problem& problem, const ProbabilityOptions& options) {
  const bool weighs = std::holds_alternative<disturbances::Boltzmann>(options.disturbance);
  for (const auto& [given, name] : {std::pair{options.above.has_value(), "above"},
                                    {options.success, "success=True"},
                                    {options.by_object, "by_object=True"},
                                    {options.first != 0, "first"},
                                    {options.design != Design::independent, "design"},
                                    {weighs, "a Boltzmann disturbance"}}) {
    if (given) reject("step", std::string("given with ") + name, "without: it is for the loss of all objects alone");
  }
  const double step = problem.scene.stepping().step;
  if (options.long_step && !(*options.long_step > step)) {
    reject("step", text(*options.long_step), "a longer one than the scene's, " + text(step));
  }
  TwoStepEstimate estimate(problem, options);
  if (const auto p = estimate.estimate(options)) return *p;
  ProbabilityOptions alone = options;
  alone.finds_step = false;
  CaptureProbability p = capture_probability(problem, alone);
  p += estimate.counts();
  return p;
}

Interval interval(const TwoSteps& of, Eigen::Index time, double confidence) {
  const double captured = of.captured[time];
  const Interval first = interval(captured, of.rollouts, confidence);
  const Interval second = interval_of({1.0 * of.pairs, of.better[time], of.worse[time]}, confidence);
  const double middle = 0.5 * (second.low + second.high), half = second.high - middle;
  const double low = captured + middle - std::hypot(captured - first.low, half);
  const double high = captured + middle + std::hypot(first.high - captured, half);
  return {std::max(low, 0.0), std::min(high, 1.0)};
}

}  // namespace energymargin
