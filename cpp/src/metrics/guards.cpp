#include "energymargin/metrics/guards.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "energymargin/world.hpp"
#include "search/horizon.hpp"

namespace energymargin {

std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit) {
  Problem future = problem;
  const double step = problem.scene.stepping().step;
  future.horizon = step * std::max(1.0, std::floor(plausible::foresight / step));
  future.check.reset();
  future.dwell = 0.0;
  World world = search::world_of(future);
  try {
    const auto horizon = search::Horizon::of(future, &future.captured);
    const search::Stretch stretch = horizon->undisturbed(world, future.state, limit);
    if (stretch.escaped) return step * stretch.rollout.steps;
  } catch (const Diverged&) {
  }
  return std::nullopt;
}

CaptureScore guarded_capture_score(const Problem& problem, const CaptureOptions& options) {
  CaptureScore score = capture_score(problem, options);
  // A second of simulation is quick: a score that ran out of time is checked too.
  if (score.capture.mean > plausible::capture_score) {
    score.undisturbed_exit = undisturbed_exit(problem, options.limit.without_time());
  }
  return score;
}

std::vector<Doubt> implausible(const CaptureScore& score) {
  std::vector<Doubt> doubts;
  if (score.nodes() > 0 && score.resolution > plausible::resolution) {
    doubts.push_back({"capture_score: resolution",
                      "the capture score " + text(score.capture.mean) + " has a resolution of " +
                          text(score.resolution) + ", above " + text(plausible::resolution) +
                          ": one node has so much of the likelihood; more nodes, smaller bounds or a smaller rate make "
                          "it finer"});
  }
  if (score.undisturbed_exit) {
    doubts.push_back(
        {"capture_score: undisturbed", "the capture score is " + text(score.capture.mean) +
                                           ", but without any disturbance the state leaves the capture set after " +
                                           text(*score.undisturbed_exit) +
                                           " s: ask capture_probability, with a horizon, whether it stays"});
  }
  return doubts;
}

}  // namespace energymargin
