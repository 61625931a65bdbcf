#include "energymargin/metrics/effort.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "metrics/words.hpp"
#include "search/planners.hpp"
#include "search/shortening.hpp"

namespace energymargin {
namespace {

// Algorithm 1: AO-x over EST or RRT.
Escape find_escape(const Problem& problem, const EffortOptions& options, search::Confirm confirm) {
  const bool improved = options.search == Search::improved;
  const Sampling sampling = options.sampling.value_or(improved ? Sampling::mixed : Sampling::uniform);
  search::BoundedProblem bounded(problem, &capture_set(problem, options.captured), options.nodes, options.seed,
                                 options.limit, sampling);
  bounded.count_in(options.node_counter);
  if (options.stop_at_escape) bounded.stop_at_escape();
  std::unique_ptr<search::Shortening> shortening;
  if (options.shorten.value_or(improved)) {
    shortening =
        std::make_unique<search::Shortening>(problem, bounded, stream(options.seed, search::streams::shortening));
  }
  if (options.planner == "est") {
    search::Est est(bounded, stream(options.seed, search::streams::planner));
    return ao(bounded, est, shortening.get(), confirm);
  }
  search::Rrt rrt(bounded);
  return ao(bounded, rrt, shortening.get(), confirm);
}

// Nearly all best escapes are confirmed, and then the last one says as much as all of them.
Escape find_escape(const Problem& problem, const EffortOptions& options) {
  Escape escape = find_escape(problem, options, search::Confirm::best);
  if (escape.discarded == 0) return escape;
  if (options.node_counter) *options.node_counter -= escape.nodes();
  return find_escape(problem, options, search::Confirm::each_turn);
}

// The first of those of least effort, with what all of them counted. A search that has not begun by the limit has none.
Escape best_of(std::vector<std::optional<Escape>> escapes) {
  const auto effort = [](const std::optional<Escape>& escape) {
    return escape ? escape->effort : std::numeric_limits<double>::infinity();
  };
  const auto is_less = [&](const auto& a, const auto& b) { return effort(a) < effort(b); };
  const auto found = std::min_element(escapes.begin(), escapes.end(), is_less);
  const bool all = std::all_of(escapes.begin(), escapes.end(), [](const auto& of) { return of && of->complete; });
  Escape best = std::move(**found);
  best.complete = all || best.effort == 0.0;
  for (auto other = escapes.begin(); other != escapes.end(); ++other) {
    if (!*other || other == found) continue;
    best += **other;
    best.discarded += (*other)->discarded;
    best.discarded_effort = std::min(best.discarded_effort, (*other)->discarded_effort);
    best.diverged += (*other)->diverged;
  }
  return best;
}

Escape find_escapes(const Problem& problem, const EffortOptions& options) {
  if (options.searches == 1) return find_escape(problem, options);
  std::vector<std::optional<Escape>> escapes(static_cast<std::size_t>(options.searches));
  const auto search = [&](std::size_t i) {
    EffortOptions one = options;
    const auto more = static_cast<std::size_t>(options.nodes % options.searches);  // the first have one more
    one.nodes = options.nodes / options.searches + (i < more ? 1 : 0);
    one.seed = stream(options.seed, i);
    escapes[i] = find_escape(problem, one);
  };
  parallel_for(escapes.size(), options.threads, search, options.limit);
  if (!escapes[0]) search(0);  // its root alone
  return best_of(std::move(escapes));
}

}  // namespace

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  require_word("planner", options.planner, effort_planners);
  require_at_least("nodes", options.nodes, 1);
  require_at_least("threads", options.threads, 1);
  require_at_least("searches", options.searches, 1);
  if (options.searches > options.nodes) {
    reject("searches", std::to_string(options.searches), "at most `nodes`, " + std::to_string(options.nodes));
  }
  validate(problem);
  Escape escape = find_escapes(problem, options);
  if (options.check_undisturbed && escape.effort > 0.0 && !escape.undisturbed_exit && !timing_of(problem)) {
    Problem future = problem;
    future.captured = capture_set(problem, options.captured);
    escape.undisturbed_exit = undisturbed_exit(future, options.limit.without_time());
  }
  escape.warnings = implausible(escape, problem);
  return escape;
}

}  // namespace energymargin
