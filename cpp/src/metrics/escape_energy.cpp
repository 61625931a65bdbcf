#include "energymargin/metrics/escape_energy.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "metrics/words.hpp"
#include "quasistatic/barrier_problem.hpp"

namespace energymargin {
namespace {

std::size_t escaping_object(const Scene& scene, const std::string& name) {
  const std::vector<std::size_t> objects = scene.with_role(Role::object);
  std::string names;
  for (const std::size_t object : objects) {
    if (scene.bodies()[object].name == name) return object;
    names += (names.empty() ? "'" : " or '") + scene.bodies()[object].name + "'";
  }
  if (!name.empty()) reject("object", "'" + name + "'", names);
  if (objects.size() != 1) reject("object", "not given", "one of the scene's objects, " + names);
  return objects.front();
}

EscapeEnergy result(quasistatic::BarrierProblem& problem) {
  EscapeEnergy escape;
  escape.energy = problem.energy();
  escape.history = problem.history();
  escape.samples = problem.samples();
  escape.complete = problem.finished();
  const quasistatic::Path& path = problem.path();
  if (path.empty()) return escape;
  quasistatic::Landscape& landscape = problem.landscape();
  const quasistatic::Path rows = landscape.divide(path);
  escape.path.resize(static_cast<Eigen::Index>(rows.size()), landscape.state(rows.front()).size());
  const auto lower = [&](const Pose& a, const Pose& b) { return landscape.energy(a) < landscape.energy(b); };
  escape.barrier = static_cast<int>(std::max_element(rows.begin(), rows.end(), lower) - rows.begin());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    escape.path.row(static_cast<Eigen::Index>(i)) = landscape.state(rows[i]).transpose();
  }
  return escape;
}

}  // namespace

EscapeEnergy escape_energy(const Problem& problem, const EscapeEnergyOptions& options) {
  require_word("planner", options.planner, escape_energy_planners);
  require_at_least("samples", options.samples, 1);
  if (options.reach) require_positive("reach", *options.reach);
  validate(problem);
  require_no_clock(problem, "escape_energy");
  if (asks_for_force(problem.captured) || (problem.within && asks_for_force(*problem.within))) {
    reject("captured or within", "a set with a Touching of a force", "one of a gap alone: nothing moves, and presses");
  }
  const std::size_t object = escaping_object(problem.scene, options.object);
  require_free_object(problem, object, "escape_energy");
  if (!std::isfinite(problem.scene.smallest_half_extent(object))) {
    reject("object", "'" + problem.scene.bodies()[object].name + "', which has no parts",
           "one that can collide with something");
  }
  quasistatic::BarrierProblem barrier(problem, object, {options.samples, options.seed, options.reach, options.limit});
  if (options.planner == "bit*") {
    quasistatic::bit_star(barrier);
  } else {
    quasistatic::rrt_star(barrier);
  }
  return result(barrier);
}

}  // namespace energymargin
