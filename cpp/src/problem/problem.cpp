#include "energymargin/problem.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"

namespace energymargin {
namespace {

constexpr double default_check = 1.0 / 60.0;  // s

}  // namespace

Problem::Problem(Scene bodies, State start, Region set)
    : scene(std::move(bodies)), state(std::move(start)), captured(std::move(set)) {}

std::optional<Timing> timing_of(const Problem& problem) {
  if (!problem.horizon && !problem.plan) return std::nullopt;
  const double step = problem.scene.stepping().step;
  const auto steps = [step](double time) { return static_cast<int>(std::lround(time / step)); };
  const int horizon = steps(problem.horizon ? *problem.horizon : problem.plan->duration());
  return Timing{horizon, std::max(1, steps(problem.check.value_or(default_check))), steps(problem.dwell)};
}

void require_no_clock(const Problem& problem, const std::string& metric) {
  if (!problem.horizon && !problem.plan) return;
  reject("problem", std::string("with a ") + (problem.plan ? "plan" : "horizon"),
         metric + " of one without: problem.replace(horizon=None, plan=None)");
}

void require_free_object(const Problem& problem, std::size_t object, const std::string& metric) {
  if (!problem.scene.jointed(object)) return;
  reject("scene", "with the object '" + problem.scene.bodies()[object].name + "' on a joint",
         "a free body as the object of " + metric);
}

const Region& capture_set(const Problem& problem, Captured captured) {
  if (captured == Captured::all) return problem.captured;
  if (!problem.captured_any)
    reject("captured", "'any'", "'all': the problem has no set in which any object is captured");
  return *problem.captured_any;
}

World world_of(const Problem& problem, int parts) {
  Stepping stepping = problem.scene.stepping();
  if (parts > 1) stepping.step /= parts;
  const Scene& scene = parts > 1 ? problem.scene.with_stepping(stepping) : problem.scene;
  return problem.plan ? World(scene, *problem.plan) : World(scene);
}

Push no_push(const Problem& problem, int steps) {
  const auto objects = static_cast<Eigen::Index>(problem.scene.with_role(Role::object).size());
  return {Eigen::VectorXd::Zero(wrench_axes * objects), steps};
}

// The parts of the set of all, which is made of one set an object where there is one of any.
std::vector<Region> captured_by_object(const Problem& problem) {
  const auto* parts = std::get_if<regions::Intersection>(&problem.captured.expression());
  const std::size_t objects = problem.scene.with_role(Role::object).size();
  return problem.captured_any && parts && parts->of.size() == objects ? parts->of : std::vector<Region>{};
}

EdgeStart::EdgeStart(const Problem& problem) {
  if (problem.effector == Effector::coast) return;
  const Scene& scene = problem.scene;
  const StateLayout layout(scene);
  const auto drive = [&](int first, int count) { driven_.emplace_back(first, problem.state.segment(first, count)); };
  for (const std::size_t body : scene.with_role(Role::effector)) {
    if (layout.offset(body) >= 0) drive(layout.offset(body) + StateLayout::velocities_of_body, 6);
    const auto joint = scene.joint_to(body);
    if (joint && layout.joint_offset(*joint) >= 0) drive(layout.joint_offset(*joint) + 1, 1);
  }
}

State EdgeStart::operator()(const State& node) const {
  State state = node;
  for (const auto& [first, velocities] : driven_) state.segment(first, velocities.size()) = velocities;
  return state;
}

}  // namespace energymargin
