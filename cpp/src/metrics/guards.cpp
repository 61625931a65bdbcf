#include "energymargin/metrics/guards.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/check.hpp"
#include "energymargin/world.hpp"
#include "search/horizon.hpp"

namespace energymargin {
namespace {

constexpr const char* remedy =
    "raise solver_iterations, take a shorter step, or look for bodies that are squeezed or that overlap "
    "(docs/engineering/contact.md)";

std::string percent(double share) { return text(std::round(1000.0 * share) / 10.0) + " %"; }

}  // namespace

std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit) {
  Problem future = problem;
  const double step = problem.scene.stepping().step;
  future.horizon = step * std::max(1.0, std::floor(plausible::foresight / step));
  future.check.reset();
  future.dwell = 0.0;
  World world = world_of(future);
  try {
    const auto horizon = search::Horizon::of(future, &future.captured);
    const search::Stretch stretch = horizon->undisturbed(world, future.state, limit);
    if (stretch.escaped) return step * stretch.rollout.steps;
  } catch (const Diverged&) {
  }
  return std::nullopt;
}

std::vector<Warning> implausible(const StepCounts& counts, double time) {
  std::vector<Warning> warnings;
  const double unconverged = static_cast<double>(counts.unconverged) / static_cast<double>(counts.steps);
  if (unconverged > plausible::unconverged) {
    warnings.push_back({"steps that did not converge", "the contact solver did not converge in " +
                                                           percent(unconverged) + " of " +
                                                           std::to_string(counts.steps) + " steps: " + remedy});
  }
  if (counts.lost_time > plausible::lost_time * time) {
    warnings.push_back(
        {"lost time", "nothing moved in " + percent(counts.lost_time / time) + " of " + text(time) +
                          " s of simulation, as bodies would have passed through each other: " + remedy});
  }
  return warnings;
}

bool too_many_diverged(int diverged, int rollouts, double most) {
  if (most >= 1.0 || diverged == 0) return false;
  return diverged == rollouts || diverged > (most > 0.0 ? std::max(1.0, most * rollouts) : 0.0);
}

void require_few_diverged(int diverged, int rollouts, double most) {
  if (!too_many_diverged(diverged, rollouts, most)) return;
  throw std::runtime_error(
      std::to_string(diverged) + " of " + std::to_string(rollouts) +
      " rollouts diverged, which is too many for a probability: a shorter step of the scene, or a weaker disturbance");
}

std::vector<Warning> implausible(const CaptureScore& score, const Problem& problem) {
  std::vector<Warning> warnings = implausible(static_cast<const StepCounts&>(score), problem);
  const std::string value = "the capture score is " + text(score.capture.mean);
  if (score.nodes() > 0 && score.resolution > plausible::resolution) {
    warnings.push_back(
        {"capture_score: resolution",
         value + ", with a resolution of " + text(score.resolution) + ", above " + text(plausible::resolution) +
             ": one node has so much of the likelihood; more nodes, smaller bounds or a smaller rate make it finer"});
  }
  if (score.undisturbed_exit) {
    warnings.push_back(
        {"capture_score: undisturbed", value + ", but without any disturbance the state leaves the capture set after " +
                                           text(*score.undisturbed_exit) +
                                           " s: ask capture_probability, with a horizon, whether it stays"});
  }
  return warnings;
}

std::vector<Warning> implausible(const Escape& escape, const Problem& problem) {
  std::vector<Warning> warnings = implausible(static_cast<const StepCounts&>(escape), problem);
  const std::string effort = "the effort is " + text(escape.effort) + " J, but ";
  if (escape.discarded_effort < escape.effort) {
    warnings.push_back({"escape_effort: discarded",
                        effort + "an escape of " + text(escape.discarded_effort) +
                            " J was found that a simulation with a quarter of the step does not confirm (" +
                            std::to_string(escape.discarded) +
                            " were discarded): the true effort may be less; search with a shorter step"});
  }
  if (escape.undisturbed_exit && escape.effort > 0.0) {
    warnings.push_back(
        {"escape_effort: undisturbed",
         effort + "without any disturbance the state leaves the capture set after " + text(*escape.undisturbed_exit) +
             " s: " +
             (timing_of(problem) ? "a simulation with a quarter of the step does not confirm it; take a shorter step"
                                 : "ask with a horizon, with which a state that leaves by itself has the effort 0")});
  }
  return warnings;
}

std::vector<Warning> implausible(const StepCounts& counts, const Problem& problem) {
  return implausible(counts, static_cast<double>(counts.steps) * problem.scene.stepping().step);
}

}  // namespace energymargin
