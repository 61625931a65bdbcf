#include "energymargin/metrics/rare.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iterator>
#include <memory>
#include <sstream>
#include <utility>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "energymargin/signed_distance.hpp"
#include "metrics/forecast.hpp"
#include "metrics/splitting.hpp"
#include "search/horizon.hpp"
#include "search/rollouts.hpp"

namespace energymargin {
namespace {

constexpr std::size_t pilots = 20;        // rollouts that tell how long the rate of the level lasts
constexpr int replicas_a_scout = 20;      // one of so many replicas scouts first, for the forecast ...
constexpr int fewest_scouts = 20;         // ... but no fewer than these
constexpr double replicas_a_fold = 12.0;  // of e that a loss is rarer: 297 of 300 measured intervals held from there on
constexpr std::size_t fewest_batches = 4;  // that have a variance: Student's distribution of three degrees of freedom

// Their streams of random numbers, behind those of the batches.
constexpr std::size_t stream_of_pilots = splitting_batches;
constexpr std::size_t stream_of_scouts = splitting_batches + 1;

// How near a state is to its loss.
struct Nearness {
  std::optional<Forecast> forecast{};  // or, without one, the level and what it gains at its rate of now
  double ahead = 0.0;                  // in so long [s]
};

// A rollout: what acts on it, and how near it came to its loss.
struct Replica : Draw {
  std::vector<double> highest_until{};  // each check time
  int exit = -1;                        // first check time outside, if it has left [steps]

  double highest() const { return highest_until.back(); }

  // The first check time at which it is above a level.
  int rises_above(double level) const {
    return static_cast<int>(std::upper_bound(highest_until.begin(), highest_until.end(), level) -
                            highest_until.begin());
  }
};

// How many rollouts were simulated, and how many of them diverged.
struct Tally : StepCounts {
  int simulated = 0;
  int diverged = 0;

  Tally& operator+=(const Tally& other) {
    StepCounts::operator+=(other);
    simulated += other.simulated;
    diverged += other.diverged;
    return *this;
  }
};

// A rollout on its way.
struct ReplicaRun {
  Replica replica;
  int first = 0;  // check time from which its law is a fair draw
  search::Exit exit;
  int step = 0;
  double last = 0.0;            // level of the state at the last check time
  std::vector<double> gains{};  // of that level, from one check time to the next
  Track track{};
  Tally tally{};
};

// Rollouts, one after another or, in a simulator, together.
class ReplicaSimulator {
 public:
  // `fit`, which may be null, learns from each rollout.
  ReplicaSimulator(const Problem& problem, const RareOptions& options, const Nearness& nearness,
                   ForecastFit* fit = nullptr)
      : problem_(problem),
        options_(options),
        nearness_(nearness),
        fit_(fit),
        timing_(*timing_of(problem)),
        last_check_(static_cast<int>(search::check_steps(timing_).size()) - 1),
        captured_(problem.captured, problem.scene),
        world_(world_of(problem)),
        check_period_(timing_.check * problem.scene.stepping().step) {
    if (!options.level) distance_.emplace(problem.captured, problem.scene, problem.state);
  }

  ReplicaRun draw(std::uint64_t seed, std::size_t number) const {
    return run_of({energymargin::draw(options_.disturbance, problem_, timing_.horizon, seed, number)});
  }

  // A replica that leaves its parent where that first is above a level; the parent itself if that has happened there.
  ReplicaRun branch(const Replica& parent, double level, std::uint64_t seed, std::size_t number) const {
    const int first = parent.rises_above(level);
    if (parent.highest_until[static_cast<std::size_t>(first)] == splitting::happened) return run_of(parent);
    const int step = std::min(first * timing_.check, timing_.horizon);
    return run_of({energymargin::draw(options_.disturbance, problem_, timing_.horizon, seed, number, parent, step)},
                  first);
  }

  // Makes the rollouts of those that have none.
  void simulate(std::vector<ReplicaRun>& runs) {
    if (!problem_.scene.stepping().simulator) {
      for (ReplicaRun& run : runs) {
        if (options_.limit.reached()) return;
        simulate(std::vector<ReplicaRun*>{&run});
      }
      return;
    }
    std::vector<ReplicaRun*> all;
    for (ReplicaRun& run : runs) all.push_back(&run);
    simulate(all);
  }

  // How long the rate of the level lasts, as the correlation of its gains from one check time to the next tells [s].
  double memory(std::uint64_t seed) {
    double squares = 0.0, products = 0.0;
    for (std::size_t number = 0; number < pilots && !options_.limit.reached(); ++number) {
      std::vector<ReplicaRun> runs{draw(seed, number)};
      simulate(runs);
      const std::vector<double>& gains = runs.front().gains;
      for (std::size_t i = 1; i < gains.size(); ++i) {
        squares += 0.5 * (gains[i - 1] * gains[i - 1] + gains[i] * gains[i]);
        products += gains[i - 1] * gains[i];
      }
    }
    const double longest = timing_.horizon * problem_.scene.stepping().step;
    if (!(products > 0.0)) return 0.0;
    if (products >= squares) return longest;
    return std::min(-check_period_ / portable::log(products / squares), longest);
  }

  // Throws Diverged, Cancelled or TimedOut.
  Replica undisturbed() {
    std::vector<ReplicaRun> runs{run_of({{{no_push(problem_, timing_.horizon)}}})};
    simulate(runs);
    options_.limit.require();
    if (tally_.diverged > 0) throw Diverged("the undisturbed future");
    return std::move(runs.front().replica);
  }

  const Tally& tally() const { return tally_; }

 private:
  ReplicaRun run_of(Replica replica, int first = 0) const {
    return {std::move(replica), first, search::Exit(timing_.dwell)};
  }

  // The past of a branch is simulated again.
  void simulate(const std::vector<ReplicaRun*>& runs) {
    std::vector<ReplicaRun*> going;
    for (ReplicaRun* run : runs) {
      if (run->replica.highest_until.empty() && begins(*run)) going.push_back(run);
    }
    std::vector<RolloutQuestion> questions(going.size());
    for (std::size_t i = 0; i < going.size(); ++i) ask(*going[i], questions[i]);
    const std::vector<std::optional<Rollout>> rollouts =
        search::roll_out(questions, pool_, [this](std::size_t) -> World& { return world_; }, options_.limit);
    for (std::size_t i = 0; i < going.size(); ++i) {
      going[i]->replica.pushes = std::move(questions[i].pushes);
      end(*going[i], rollouts[i]);
    }
    for (ReplicaRun* run : runs) {
      tally_ += run->tally;
      if (!fit_) continue;
      run->track.lost = run->replica.exit >= 0;
      if (!run->track.coordinates.empty()) fit_->add(run->track, run->first);
    }
  }

  bool begins(ReplicaRun& run) {
    check(problem_.state, 0, run);
    ++run.tally.simulated;
    if (options_.rollout_counter) ++*options_.rollout_counter;
    return !run.exit.left();
  }

  void ask(ReplicaRun& run, RolloutQuestion& question) {
    question = {problem_.state, std::move(run.replica.pushes)};
    question.watch.check_every = timing_.check;
    question.watch.plan = run.replica.plan ? &*run.replica.plan : nullptr;
    question.watch.noise = &run.replica.noise;
    question.watch.ends_for_good = true;
    question.watch.ends = [this, &run](const State& state) { return check(state, run.step += timing_.check, run); };
  }

  void end(ReplicaRun& run, const std::optional<Rollout>& rollout) {
    if (!rollout) {
      run.tally.steps += run.step;
      ++run.tally.diverged;
      return;
    }
    static_cast<StepCounts&>(run.tally) += *rollout;
    if (!rollout->complete || rollout->steps != timing_.horizon) return;
    if (run.step != timing_.horizon) check(rollout->state, timing_.horizon, run);
    if (run.exit.left()) return;
    run.exit.end();
    if (run.exit.left()) set_exit(run.exit, run.replica);
  }

  // Whether it has left.
  bool check(const State& state, int step, ReplicaRun& run) {
    run.exit.check(captured_(state), step);
    std::vector<double>& highest = run.replica.highest_until;
    double level = level_of(state, last_check_ - static_cast<int>(highest.size()), run);
    if (run.exit.since() >= 0 && timing_.dwell > 0)
      level += static_cast<double>(step - run.exit.since()) / timing_.dwell;
    highest.push_back(highest.empty() ? level : std::max(level, highest.back()));
    if (run.exit.left()) set_exit(run.exit, run.replica);
    return run.exit.left();
  }

  // The level of a state with so many check times to come.
  double level_of(const State& state, int left, ReplicaRun& run) {
    if (distance_ && (fit_ || nearness_.forecast)) {
      const std::vector<double> coordinates = distance_->coordinates(state);
      run.track.coordinates.insert(run.track.coordinates.end(), coordinates.begin(), coordinates.end());
    }
    if (nearness_.forecast) return (*nearness_.forecast)(run.track, left);
    const double now = distance_ ? (*distance_)(state) : options_.level(state.head(problem_.state.size()));
    if (std::isnan(now)) reject("level", "not a number", "a number for every state");
    const double gain = left < last_check_ ? now - run.last : 0.0;
    if (left < last_check_) run.gains.push_back(gain);
    run.last = now;
    return now + nearness_.ahead * gain / check_period_;
  }

  static void set_exit(const search::Exit& exit, Replica& replica) {
    replica.highest_until.back() = splitting::happened;
    replica.exit = exit.since();
  }

  const Problem& problem_;
  const RareOptions& options_;
  Nearness nearness_;
  ForecastFit* fit_;
  Timing timing_;
  int last_check_;
  Membership captured_;
  std::optional<SignedDistance> distance_{};  // unless the level is the caller's
  World world_;
  double check_period_;  // [s]
  ThreadPool pool_{1};
  Tally tally_;
};

// What one batch says.
struct ReplicaBatch : Tally {
  Eigen::VectorXd lost;    // an unbiased estimate of the loss until each check time
  double mean_loss = 0.0;  // of the time that is lost [steps]
  int levels = 0;
  int replicas = 0;
  bool complete = false;
};

// One batch, which splits round by round.
class BatchRun {
 public:
  BatchRun(const RareOptions& options, int replicas, std::size_t number)
      : seed_(stream(options.seed, number)),
        random_(seed_, std::numeric_limits<std::uint64_t>::max()),  // a stream that no rollout has
        splitting_(replicas, random_),
        replicas_(replicas) {}
  BatchRun(const BatchRun&) = delete;
  BatchRun& operator=(const BatchRun&) = delete;

  //! The runs of the next round; none once it has ended.
  std::vector<ReplicaRun> next(const ReplicaSimulator& simulator) {
    std::vector<ReplicaRun> runs;
    for (const splitting::Path<Replica>& path : splitting_.next()) {
      runs.push_back(path.parent ? simulator.branch(*path.parent, path.level, seed_, path.number)
                                 : simulator.draw(seed_, path.number));
    }
    return runs;
  }

  template <typename Iterator>
  void take(Iterator begin, Iterator end) {
    std::vector<Replica> made;
    for (; begin != end; ++begin) {
      tally_ += begin->tally;
      made.push_back(std::move(begin->replica));
    }
    splitting_.take(std::move(made));
  }

  ReplicaBatch result(const Problem& problem) const {
    const auto& last = splitting_.generation();
    const Timing timing = *timing_of(problem);
    const std::vector<int> checks = search::check_steps(timing);
    ReplicaBatch batch;
    static_cast<Tally&>(batch) = tally_;
    batch.lost = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(checks.size()));
    for (const Replica& replica : last.replicas) {
      if (replica.exit < 0) continue;
      const auto from = std::lower_bound(checks.begin(), checks.end(), replica.exit) - checks.begin();
      batch.lost.tail(batch.lost.size() - from).array() += 1.0;
      batch.mean_loss += timing.horizon - replica.exit;
    }
    batch.lost *= last.weight / replicas_;
    batch.mean_loss *= last.weight / replicas_;
    batch.levels = last.levels;
    batch.replicas = replicas_;
    batch.complete = last.complete;
    return batch;
  }

 private:
  std::uint64_t seed_;
  Random random_;
  splitting::Splitting<Replica> splitting_;
  int replicas_;
  Tally tally_;
};

// So many replicas, and the number of the batch.
using BatchSize = std::pair<int, std::size_t>;

// Batches whose rounds are simulated together.
std::vector<ReplicaBatch> run_batches(const Problem& problem, const RareOptions& options, const Nearness& nearness,
                                      const std::vector<BatchSize>& sizes, ForecastFit* fit = nullptr) {
  ReplicaSimulator simulator(problem, options, nearness, fit);
  std::vector<std::unique_ptr<BatchRun>> batches;
  for (const auto& [replicas, number] : sizes) batches.push_back(std::make_unique<BatchRun>(options, replicas, number));
  bool goes_on = true;
  while (goes_on && !options.limit.reached()) {
    std::vector<ReplicaRun> runs;
    std::vector<std::size_t> counts;
    for (const auto& batch : batches) {
      std::vector<ReplicaRun> next = batch->next(simulator);
      counts.push_back(next.size());
      std::move(next.begin(), next.end(), std::back_inserter(runs));
    }
    goes_on = !runs.empty();
    simulator.simulate(runs);
    if (options.limit.reached()) break;
    auto run = runs.begin();
    for (std::size_t i = 0; i < batches.size(); ++i) {
      if (counts[i] == 0) continue;
      batches[i]->take(run, run + static_cast<std::ptrdiff_t>(counts[i]));
      run += static_cast<std::ptrdiff_t>(counts[i]);
    }
  }
  std::vector<ReplicaBatch> results;
  for (const auto& batch : batches) results.push_back(batch->result(problem));
  return results;
}

// A few replicas that split by the rate of their distance find the forecast by which all others split: what they see is
// evenly spread from the start to the edge, and their estimate counts for nothing. Returns their steps.
StepCounts scout(const Problem& problem, const RareOptions& options, Nearness& nearness) {
  const SignedDistance distance(problem.captured, problem.scene, problem.state);
  ForecastFit fit(distance, static_cast<int>(search::check_steps(*timing_of(problem)).size()));
  const int scouts = std::max(options.rollouts / replicas_a_scout, fewest_scouts);
  const StepCounts counts = run_batches(problem, options, nearness, {{scouts, stream_of_scouts}}, &fit).front();
  nearness.forecast = fit.fit();
  return counts;
}

// Where all batches are worth less than one loss that was counted, or the replicas are too few for so rare a loss.
void warn_of_spread(const CaptureProbability& p, std::vector<Warning>& warnings) {
  const double lost = p.lost[p.lost.size() - 1];
  const double losses = p.effective * lost;
  if (losses == 0.0) return;  // the interval ends where counting it would
  const double enough = std::ceil(-replicas_a_fold * portable::log(lost));
  const bool few = p.rollouts < enough;
  if (losses >= 1.0 && !few) return;
  std::ostringstream what;
  what << std::setprecision(2) << "a loss of " << lost << " by " << p.rollouts << " replicas and "
       << p.splitting->levels << " levels is worth " << losses << " counted losses: most such estimates are too low, "
       << "and the interval is wide" << (few ? ", or ends far below the loss" : "") << "; take at least "
       << std::setprecision(9) << (few ? enough : 5.0 * p.rollouts)
       << " `rollouts`, or a level that foresees the loss better (`ahead`, `level`)";
  warnings.push_back({"rare loss", what.str()});
}

// What the batches say together.
CaptureProbability result_of(const Problem& problem, const std::vector<ReplicaBatch>& batches) {
  const std::vector<int> checks = search::check_steps(*timing_of(problem));
  const double step = problem.scene.stepping().step;
  const auto count = static_cast<Eigen::Index>(batches.size());
  Eigen::MatrixXd lost(count, static_cast<Eigen::Index>(checks.size()));
  CaptureProbability p;
  Splitting splitting;
  double mean_loss = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const ReplicaBatch& batch = batches[static_cast<std::size_t>(i)];
    lost.row(i) = batch.lost;
    mean_loss += batch.mean_loss / static_cast<double>(count);
    splitting.levels += static_cast<double>(batch.levels) / static_cast<double>(count);
    splitting.simulated += batch.simulated;
    p.rollouts += batch.replicas;
    p += batch;
    p.diverged += batch.diverged;
  }
  require_few_diverged(p.diverged, splitting.simulated, ProbabilityOptions{}.most_diverged);
  p.times = search::times_of(checks, step);
  p.lost = lost.colwise().mean();
  p.all.curve = 1.0 - p.lost.array();
  p.all.mean_time = step * (checks.back() - mean_loss);
  splitting.effective.resize(lost.cols());
  for (Eigen::Index i = 0; i < lost.cols(); ++i)
    splitting.effective[i] = splitting::effective_size(lost.col(i), p.rollouts);
  p.effective = splitting.effective[lost.cols() - 1];
  p.splitting = splitting;
  return p;
}

void validate(const Problem& problem, const RareOptions& options) {
  if (!timing_of(problem)) reject("problem", "without horizon and plan", "one with: problem.replace(horizon=...)");
  require_at_least("rollouts", options.rollouts, fewest_replicas);
  require_at_least("threads", options.threads, 1);
  if (options.ahead) require_not_negative("ahead", *options.ahead);
  validate(options.disturbance, problem);
  const bool branches = std::holds_alternative<disturbances::Uniform>(options.disturbance) ||
                        std::holds_alternative<disturbances::Gaussian>(options.disturbance) ||
                        std::holds_alternative<disturbances::ActuationNoise>(options.disturbance);
  if (!branches) {
    const bool weighted = std::holds_alternative<disturbances::Boltzmann>(options.disturbance);
    reject("disturbance", weighted ? "Boltzmann" : "a function, or draws",
           "Uniform, Gaussian or noise of the plan: rollouts of rare losses branch on their way");
  }
}

}  // namespace

CaptureProbability rare_capture_probability(const Problem& problem, const RareOptions& options) {
  validate(problem);
  validate(problem, options);
  ReplicaSimulator simulator(problem, options, Nearness{});
  const Replica undisturbed = simulator.undisturbed();
  Nearness nearness;
  nearness.ahead = options.ahead ? *options.ahead : simulator.memory(stream(options.seed, stream_of_pilots));
  const StepCounts of_scouts = options.level || options.ahead ? StepCounts{} : scout(problem, options, nearness);
  std::vector<ReplicaBatch> batches(splitting_batches);
  std::vector<BatchSize> sizes;
  for (std::size_t i = 0; i < batches.size(); ++i) {
    const bool has_more = static_cast<int>(i) < options.rollouts % splitting_batches;
    sizes.emplace_back(options.rollouts / splitting_batches + (has_more ? 1 : 0), i);
  }
  if (problem.scene.stepping().simulator) {
    batches = run_batches(problem, options, nearness, sizes);
  } else {
    const auto run = [&](std::size_t i) { batches[i] = run_batches(problem, options, nearness, {sizes[i]}).front(); };
    parallel_for(batches.size(), options.threads, run, options.limit);
  }
  const auto missing =
      std::find_if(batches.begin(), batches.end(), [](const ReplicaBatch& batch) { return !batch.complete; });
  const bool complete = missing == batches.end();
  batches.erase(missing, batches.end());
  if (batches.size() < fewest_batches) options.limit.require();
  CaptureProbability p = result_of(problem, batches);
  p.complete = complete;
  p += simulator.tally();
  p += of_scouts;
  p.undisturbed = undisturbed.exit < 0;
  p.undisturbed_time = p.undisturbed ? p.times[p.times.size() - 1] : undisturbed.exit * problem.scene.stepping().step;
  p.warnings = implausible(p, problem);
  warn_of_spread(p, p.warnings);
  return p;
}

}  // namespace energymargin
