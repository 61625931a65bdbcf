#include "energymargin/metrics/probability.hpp"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "base/thread_pool.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/metrics/guards.hpp"
#include "metrics/together.hpp"
#include "problem/sobol.hpp"
#include "search/horizon.hpp"

namespace energymargin {
namespace {

constexpr int default_rollouts = 30;

// Rollouts that go on at once, however many are asked for: more would be memory that none needs, and draws that are
// made before the clock is looked at.
constexpr std::size_t piece = 4096;
constexpr std::size_t piece_together = 4 * Policy::block;
constexpr std::size_t first_together = 16;  // some are better than none once time is over; then as many as there are
constexpr std::size_t drawn_a_thread = 4;   // by a function, which draws for all of a piece before it begins
constexpr double confidence_of_tolerance = 0.95;

int most_of(const ProbabilityOptions& options) {
  return options.rollouts.value_or(options.above       ? most_of_decision
                                   : options.tolerance ? most_rollouts
                                                       : default_rollouts);
}

// The outcome of one rollout.
struct Future {
  std::vector<int> exits;  // of each set, steps; -1: it stays inside
  bool success = false;
  double effort = 0.0;
  StepCounts counts{};
  bool complete = true;
  bool diverged = false;
};

class Estimator {
 public:
  Estimator(const Problem& problem, const ProbabilityOptions& options)
      : problem_(problem),
        options_(options),
        timing_(*timing_of(problem)),
        pool_(std::min(options.threads, most_of(options))),
        worlds_(pool_.size()),
        designs_(pool_.size()) {
    sets_.emplace_back(problem.captured, problem.scene);
    if (options.by_object && problem.captured_any) {
      sets_.emplace_back(*problem.captured_any, problem.scene);
      for (const Region& set : captured_by_object(problem)) sets_.emplace_back(set, problem.scene);
    }
    if (options.success) success_.emplace(*problem.succeeded, problem.scene);
    if (const auto* boltzmann = std::get_if<disturbances::Boltzmann>(&options.disturbance)) rate_ = boltzmann->rate;
    const double step = problem.scene.stepping().step;
    if (options.drawn_step.value_or(step) != step) drawn_ = with_step(problem, *options.drawn_step);
  }

  CaptureProbability estimate() {
    if (options_.undisturbed) {
      const Push none = no_push(problem_, timing_.horizon);
      undisturbed_ = together() ? run_together({{{none}}}).front() : run({{none}}, 0);
      if (!undisturbed_->complete) options_.limit.require();
      if (undisturbed_->diverged) throw Diverged("the undisturbed future");
    }
    const int most = most_of(options_);
    int wanted = std::min(options_.above ? first_decision : options_.tolerance ? first_look : most, most);
    for (int look = wanted; look < most; look = next_look(look)) ++looks_;
    while (true) {
      roll(wanted);
      if (counted() < wanted || wanted == most || is_enough()) break;
      wanted = next_look(wanted);
    }
    if (counted() == 0 && options_.limit.reached()) options_.limit.require();
    return result(wanted);
  }

 private:
  // Rollouts up to number `wanted`, each a function of its number alone.
  void roll(int wanted) {
    const auto end = static_cast<std::size_t>(wanted);
    while (futures_.size() < end && !options_.limit.reached()) roll_piece(std::min(end, end_of_piece()));
  }

  std::size_t end_of_piece() const {
    const std::size_t first = futures_.size(), index = options_.first + first;
    if (together()) {
      const std::size_t most = piece_together - index % piece_together;
      return first + (asks() ? most : std::min(most, std::max(first, first_together)));
    }
    return first + (draws() ? drawn_a_thread * pool_.size() : piece);
  }

  void roll_piece(std::size_t end) {
    const std::size_t first = futures_.size();
    std::vector<Draw> drawn;
    if ((together() || draws()) && !draw_all(first, end, drawn)) return;
    futures_.resize(end);
    complete_.resize(end, 0);
    if (together()) return roll_together(first, std::move(drawn));
    const auto roll_one = [&](std::size_t i, std::size_t thread) {
      const std::size_t number = first + i;
      futures_[number] = run(draws() ? drawn[i] : draw_of(options_.first + number, thread), thread);
      complete_[number] = futures_[number].complete ? 1 : 0;
      if (options_.rollout_counter) ++*options_.rollout_counter;
    };
    pool_.run(end - first, roll_one, options_.limit);
  }

  // Whether the robot follows a policy, which is asked about many rollouts together.
  bool asks() const { return problem_.plan && problem_.plan->policy; }

  // Whether rollouts go on together.
  bool together() const { return asks() || problem_.scene.stepping().simulator; }

  // What draws if it is the user, one draw after the other.
  const disturbances::Draws* draws() const { return std::get_if<disturbances::Draws>(&options_.disturbance); }

  // One after the other; false if the limit was reached.
  bool draw_all(std::size_t first, std::size_t end, std::vector<Draw>& drawn) {
    for (std::size_t index = options_.first + first; drawn.size() < end - first; ++index) {
      if (options_.limit.reached()) return false;
      std::optional<Draw> next =
          draws() ? draw(*draws(), problem_, timing_.horizon, options_.seed, index, options_.limit) : draw_of(index);
      if (!next) return false;
      drawn.push_back(std::move(*next));
    }
    return true;
  }

  Draw draw_of(std::size_t index, std::size_t thread = 0) {
    std::vector<double> leading;
    if (options_.design == Design::sobol) {
      if (!designs_[thread]) designs_[thread].emplace(options_.seed);
      leading = designs_[thread]->point(index);
    }
    const Problem& problem = drawn_ ? *drawn_ : problem_;
    Draw drawn = draw(options_.disturbance, problem, timing_of(problem)->horizon, options_.seed, index, {}, 0,
                      std::move(leading));
    if (!drawn_) return drawn;
    return resampled(std::move(drawn), *options_.drawn_step, problem_.scene.stepping().step, timing_.horizon);
  }

  // The same rollouts, about which a policy or a simulator is asked together.
  void roll_together(std::size_t first, std::vector<Draw> draws) {
    std::vector<Future> futures = run_together(std::move(draws), options_.first + first);
    for (std::size_t i = 0; i < futures.size(); ++i) {
      complete_[first + i] = futures[i].complete ? 1 : 0;
      futures_[first + i] = std::move(futures[i]);
    }
    if (options_.rollout_counter) *options_.rollout_counter += static_cast<int>(futures.size());
  }

  // The first has this number.
  std::vector<Future> run_together(std::vector<Draw> draws, std::size_t number = 0) {
    std::vector<std::vector<search::Exit>> exits(draws.size(),
                                                 std::vector<search::Exit>(sets_.size(), search::Exit(timing_.dwell)));
    std::vector<Together> rollouts(draws.size());
    for (std::size_t i = 0; i < draws.size(); ++i) {
      rollouts[i].draw = std::move(draws[i]);
      rollouts[i].number = number + i;
      rollouts[i].ends = [this, &exits, i](const State& state, int step) { return check(exits[i], state, step); };
    }
    const auto world = [this](std::size_t thread) -> World& {
      if (!worlds_[thread]) worlds_[thread].emplace(world_of(problem_));
      return *worlds_[thread];
    };
    if (asks())
      PolicyRollouts(problem_, timing_).run(rollouts, pool_, world, options_.limit);
    else
      go_on_to_horizon(rollouts, problem_, timing_, pool_, world, options_.limit);
    std::vector<Future> futures(draws.size());
    for (std::size_t i = 0; i < futures.size(); ++i) {
      const Together& of = rollouts[i];
      Future& future = futures[i];
      future.complete = of.complete;
      future.diverged = of.diverged;
      future.counts = of.counts;
      future.effort = of.effort;
      close(exits[i], of.complete && of.steps == timing_.horizon, of.state, future);
    }
    return futures;
  }

  // Whether a rollout may end, as its exits tell it.
  bool check(std::vector<search::Exit>& exits, const State& state, int step) const {
    bool all_left = true;
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      if (!exits[i].left()) exits[i].check(sets_[i](state), step);
      all_left = all_left && exits[i].left();
    }
    return all_left && !success_ && !rate_;
  }

  void close(std::vector<search::Exit>& exits, bool at_horizon, const State& state, Future& future) const {
    if (at_horizon) {
      for (search::Exit& exit : exits) exit.end();
      future.success = success_ && (*success_)(state);
    }
    for (const search::Exit& exit : exits) future.exits.push_back(exit.left() ? exit.since() : -1);
  }

  // The complete rollouts up to the first that is not.
  int counted() const { return static_cast<int>(std::find(complete_.begin(), complete_.end(), 0) - complete_.begin()); }

  Future run(const Draw& draw, std::size_t thread) {
    if (!worlds_[thread]) worlds_[thread].emplace(world_of(problem_));
    try {
      return follow(*worlds_[thread], draw);
    } catch (const Diverged&) {
      Future future;
      future.diverged = true;
      return future;
    }
  }

  Future follow(World& world, const Draw& draw) const {
    std::vector<search::Exit> exits(sets_.size(), search::Exit(timing_.dwell));
    const auto ends = [&](const State& state, int step) { return check(exits, state, step); };
    Future future;
    Rollout rollout;
    if (!ends(problem_.state, 0)) {
      rollout = search::roll_out_to_horizon(world, problem_.state, draw.pushes, timing_, options_.limit, ends,
                                            draw.plan ? &*draw.plan : nullptr, &draw.noise);
      future.complete = rollout.complete;
      future.counts = rollout;
      future.effort = rollout.effort;
    }
    close(exits, rollout.complete && rollout.steps == timing_.horizon, rollout.state, future);
    return future;
  }

  // The weights of the first `count` rollouts; 0 for one that diverged.
  std::vector<double> weights(int count) const {
    std::vector<double> weights(static_cast<std::size_t>(count), 0.0);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count; ++i) {
      const Future& future = futures_[static_cast<std::size_t>(i)];
      if (!future.diverged) least = std::min(least, future.effort);
    }
    for (int i = 0; i < count; ++i) {
      const Future& future = futures_[static_cast<std::size_t>(i)];
      if (future.diverged) continue;
      weights[static_cast<std::size_t>(i)] = rate_ ? portable::exp(-*rate_ * (future.effort - least)) : 1.0;
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

  int next_look(int look) const {
    const std::int64_t more = options_.above ? std::max(4, look / 4) : look;
    return static_cast<int>(std::min<std::int64_t>(look + more, most_of(options_)));
  }

  bool is_enough() const { return options_.above ? decision(counted()).has_value() : meets_tolerance(); }

  std::optional<bool> decision(int count) const {
    int captured = 0, rollouts = 0;
    for (int i = 0; i < count; ++i) {
      const Future& future = futures_[static_cast<std::size_t>(i)];
      if (future.diverged) continue;
      ++rollouts;
      captured += future.exits[0] < 0 ? 1 : 0;
    }
    return is_above(*options_.above, captured, rollouts);
  }

  // Of all objects until the horizon: of a design as its blocks tell, with Student's variance, but at least the
  // rollouts and at most so many times as many, since few blocks may by chance agree too well.
  double effective_of_all(const std::vector<double>& shares) const {
    constexpr double most = 3.0;
    if (options_.design == Design::independent) return effective(shares);
    const double count = total(shares);
    const std::uint64_t block = design::block_of(shares.size());
    if (block == 0) return count;
    const std::uint64_t first = (options_.first + block - 1) / block * block - options_.first;  // of a whole block
    const auto blocks = static_cast<Eigen::Index>((shares.size() - first) / block);
    Eigen::ArrayXd captured = Eigen::ArrayXd::Zero(blocks), counts = captured;
    for (std::uint64_t i = 0; i < block * static_cast<std::uint64_t>(blocks); ++i) {
      const Future& future = futures_[first + i];
      if (future.diverged) continue;
      const auto of = static_cast<Eigen::Index>(i / block);
      counts[of] += 1.0;
      captured[of] += future.exits[0] < 0 ? 1.0 : 0.0;
    }
    const double mean = captured.sum() / counts.sum();
    if (counts.minCoeff() < 1.0 || mean == 0.0 || mean == 1.0) return count;
    const auto n = static_cast<double>(blocks);
    const double variance = (captured / counts - mean).square().sum() / n / (n - 3.0);
    return std::clamp(mean * (1.0 - mean) / variance, count, most * count);
  }

  bool meets_tolerance() const {
    const std::vector<double> shares = weights(counted());
    const double confidence = 1.0 - (1.0 - confidence_of_tolerance) / looks_;
    const Interval ends = interval(survival(0, shares).captured(), effective_of_all(shares), confidence);
    return 0.5 * (ends.high - ends.low) <= *options_.tolerance;
  }

  Survival survival(std::size_t set, const std::vector<double>& shares) const {
    const std::vector<int> steps = search::check_steps(timing_);
    const double step = problem_.scene.stepping().step;
    Survival survival{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(steps.size()))};
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (shares[i] == 0.0) continue;
      const int exit = futures_[i].exits[set];
      survival.mean_time += shares[i] * step * (exit < 0 ? timing_.horizon : exit);
      if (exit < 0) continue;
      const auto from = std::lower_bound(steps.begin(), steps.end(), exit) - steps.begin();
      survival.curve.tail(survival.curve.size() - from).array() += shares[i];
    }
    // Sums of the same numbers in the same order give exactly 0 and 1.
    survival.curve = 1.0 - survival.curve.array() / total(shares);
    survival.mean_time /= total(shares);
    return survival;
  }

  double success(const std::vector<double>& shares) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < shares.size(); ++i) sum += futures_[i].success ? shares[i] : 0.0;
    return sum / total(shares);
  }

  CaptureProbability result(int wanted) const {
    CaptureProbability p;
    const int count = counted();
    p.complete = count == wanted;
    p.looks = looks_;
    if (options_.above) p.above = decision(count);
    count_rollouts(count, p);
    set_times(p);
    const std::vector<double> shares = weights(count);
    p.effective = effective_of_all(shares);
    p.effective_of_parts = effective(shares);
    p.all = survival(0, shares);
    p.lost = 1.0 - p.all.curve.array();
    if (sets_.size() > 1) p.any = survival(1, shares);
    for (std::size_t set = 2; set < sets_.size(); ++set) {
      const Body& object = problem_.scene.bodies()[problem_.scene.with_role(Role::object)[set - 2]];
      p.by_object.emplace_back(object.name, survival(set, shares));
    }
    if (success_) p.success = success(shares);
    set_outcomes(count, p);
    return p;
  }

  void set_outcomes(int count, CaptureProbability& p) const {
    const double step = problem_.scene.stepping().step;
    p.exit_times = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());
    for (int i = 0; i < count; ++i) {
      const Future& future = futures_[static_cast<std::size_t>(i)];
      if (future.diverged) {
        p.exit_times[i] = std::numeric_limits<double>::quiet_NaN();
      } else if (future.exits[0] >= 0) {
        p.exit_times[i] = step * future.exits[0];
      }
      if (success_) p.successes.push_back(future.success ? 1 : 0);
    }
  }

  void count_rollouts(int count, CaptureProbability& p) const {
    if (undisturbed_) p += undisturbed_->counts;
    for (int i = 0; i < count; ++i) {
      p.diverged += futures_[static_cast<std::size_t>(i)].diverged ? 1 : 0;
      p += futures_[static_cast<std::size_t>(i)].counts;
    }
    p.rollouts = count - p.diverged;
    require_few_diverged(p.diverged, count, options_.most_diverged);
  }

  void set_times(CaptureProbability& p) const {
    const double step = problem_.scene.stepping().step;
    p.times = search::times_of(search::check_steps(timing_), step);
    p.undisturbed_time = std::numeric_limits<double>::quiet_NaN();
    if (!undisturbed_) return;
    const int exit = undisturbed_->exits[0];
    p.undisturbed = exit < 0;
    p.undisturbed_time = step * (exit < 0 ? timing_.horizon : exit);
    if (success_) p.undisturbed_success = undisturbed_->success;
  }

  const Problem& problem_;
  const ProbabilityOptions& options_;
  Timing timing_;
  std::optional<Problem> drawn_;  // in whose steps disturbances are drawn
  std::vector<Membership> sets_;  // of all objects; with `by_object` also of any, and of each
  std::optional<Membership> success_;
  std::optional<double> rate_;
  std::optional<Future> undisturbed_;
  std::vector<Future> futures_;
  std::vector<char> complete_;
  int looks_ = 1;  // the most looks at the tolerance or the threshold
  ThreadPool pool_;
  std::vector<std::optional<World>> worlds_;  // of each thread, from its first rollout on
  std::vector<std::optional<design::Sobol>> designs_;
};

// Whether rollouts may be drawn evenly.
bool spreads(const DisturbanceModel& model) {
  return !std::holds_alternative<disturbances::Boltzmann>(model) && !std::holds_alternative<disturbances::Draws>(model);
}

void validate(const Problem& problem, const ProbabilityOptions& options) {
  if (!timing_of(problem)) reject("problem", "without horizon and plan", "one with: problem.replace(horizon=...)");
  if (options.rollouts) require_at_least("rollouts", *options.rollouts, 1);
  require_at_least("threads", options.threads, 1);
  if (options.tolerance) require_positive("tolerance", *options.tolerance);
  if (options.above && !(*options.above > 0.0 && *options.above < 1.0)) {
    reject("above", text(*options.above), "a probability between 0 and 1");
  }
  if (options.design != Design::independent && (options.above || !spreads(options.disturbance))) {
    reject(
        "design", "\"sobol\"",
        "\"independent\" with `above`, Boltzmann disturbances and draws: a sequential test, weights and given numbers "
        "take rollouts that are independent");
  }
  if (options.above && options.tolerance) reject("tolerance", "given with above", "one of them");
  if (options.above && std::holds_alternative<disturbances::Boltzmann>(options.disturbance)) {
    reject("above", "given with a Boltzmann disturbance", "one whose rollouts all weigh the same");
  }
  if (!(options.most_diverged >= 0.0 && options.most_diverged <= 1.0)) {
    reject("most_diverged", text(options.most_diverged), "a share, from 0 to 1");
  }
  if (options.success && !problem.succeeded) reject("success", "True", "a problem with a success set");
  if (options.by_object && !problem.captured_any) {
    reject("by_object", "True", "a problem with a capture set for each object, captured={...}");
  }
  if (options.drawn_step && std::holds_alternative<disturbances::Draws>(options.disturbance)) {
    reject("drawn_step", text(*options.drawn_step),
           "a model of disturbances: a function knows the steps that it draws for");
  }
  validate(options.disturbance, problem);
}

}  // namespace

CaptureProbability capture_probability(const Problem& problem, const ProbabilityOptions& options) {
  validate(problem);
  validate(problem, options);
  if (options.long_step || options.finds_step) return capture_probability_of_two_steps(problem, options);
  CaptureProbability p = Estimator(problem, options).estimate();
  p.warnings = implausible(p, problem);
  return p;
}

std::optional<bool> is_above(double threshold, int captured, int rollouts, double error) {
  const double inside = captured, outside = rollouts - captured;
  const double at_threshold = inside * portable::log(threshold) + outside * portable::log1p(-threshold);
  const double beta = boost::math::lgamma(inside + 1.0) + boost::math::lgamma(outside + 1.0) -
                      boost::math::lgamma(inside + outside + 2.0);
  const double all = beta - at_threshold;
  const double below = boost::math::ibeta(inside + 1.0, outside + 1.0, threshold);
  const double beyond = boost::math::ibetac(inside + 1.0, outside + 1.0, threshold);
  if (all + portable::log(beyond / (1.0 - threshold)) >= -portable::log(error)) return true;
  if (all + portable::log(below / threshold) >= -portable::log(error)) return false;
  return std::nullopt;
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

Interval interval_of_loss(const CaptureProbability& p, double confidence, std::optional<Eigen::Index> time) {
  const Eigen::Index at = time.value_or(p.lost.size() - 1);
  if (p.splitting) return interval(p.lost[at], p.splitting->effective[at], confidence);
  const Interval captured = interval_of_capture(p, confidence, at);
  return {1.0 - captured.high, 1.0 - captured.low};
}

Interval interval_of_capture(const CaptureProbability& p, double confidence, std::optional<Eigen::Index> time) {
  const Eigen::Index at = time.value_or(p.lost.size() - 1);
  if (p.two_steps) return interval(*p.two_steps, at, confidence);
  const bool is_last = at == p.lost.size() - 1;
  if (!p.splitting) return interval(p.all.curve[at], is_last ? p.effective : p.effective_of_parts, confidence);
  const Interval loss = interval_of_loss(p, confidence, at);
  return {1.0 - loss.high, 1.0 - loss.low};
}

}  // namespace energymargin
