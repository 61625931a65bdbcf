#include "energymargin/problem.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "energymargin/membership.hpp"
#include "energymargin/plausibility.hpp"
#include "problem/records.hpp"

namespace energymargin {
namespace {

constexpr double default_check = 1.0 / 60.0;  // s

// A share of the smaller body's smallest half extent; in a simulation bodies sink into each other by up to 0.3 of it.
constexpr double deep = 0.5;

// A disturbance along a locked axis does nothing, and would pass for robustness.
void require_free(const std::string& name, const Vector3& bounds, const Vector3& factor) {
  if (((bounds.array() > 0.0) && (factor.array() == 0.0)).any()) {
    reject(name, text(bounds), "0 on the axes that are locked for the object, whose factors are " + text(factor));
  }
}

void require_roles(const Scene& scene, Effector effector) {
  if (scene.with_role(Role::object).empty()) reject("scene", "without a body of role \"object\"", "at least one");
  const std::vector<std::size_t> effectors = scene.with_role(Role::effector);
  const bool moves =
      std::any_of(effectors.begin(), effectors.end(), [&](std::size_t body) { return !scene.bodies()[body].fixed(); });
  if (effector == Effector::drive && !moves) {
    reject("effector", "\"drive\"", "a scene with a body of role \"effector\" that can move, or \"coast\"");
  }
}

void require_no_deep_penetration(const Scene& scene, const State& state) {
  const Contact contact = deepest_contact(scene, state);
  if (contact.distance == 0.0) return;
  const double most = deep * smaller_half_extent(scene, contact);
  if (-contact.distance > most) {
    reject("state",
           "one in which '" + contact.body_a + "' and '" + contact.body_b + "' penetrate each other by " +
               text(-contact.distance) + " m",
           "at most " + text(most) + " m");
  }
}

void require_region(const std::string& name, const Region& region, const Problem& problem) {
  at_place(name + ": ", [&] { Membership(region, problem.scene); });
  if (!problem.plan || !asks_for_force(region)) return;
  reject(name, "a set with a Touching of a force", "one of a gap alone: its step knows nothing of the problem's plan");
}

void require_whole_steps(const std::string& name, double value, int least, double step) {
  const double steps = std::round(value / step);
  const bool whole = std::abs(value - steps * step) <= 1e-6 * step * std::max(1.0, steps);
  if (whole && steps >= least && steps <= most_steps) return;
  const std::string from = least == 0 ? "0, or " : "";
  reject(name, text(value),
         from + "whole steps of the scene, of " + text(step) + " s, at most " + std::to_string(most_steps));
}

void require_clock(const Problem& problem) {
  const double step = problem.scene.stepping().step;
  if (problem.horizon) require_whole_steps("horizon", *problem.horizon, 1, step);
  if (problem.check) require_whole_steps("check", *problem.check, 1, step);
  require_whole_steps("dwell", problem.dwell, 0, step);
  const std::optional<Timing> timing = timing_of(problem);
  if (timing && timing->dwell > 0 && timing->dwell < timing->check) {
    reject("dwell", text(problem.dwell),
           "0, or at least as long as `check`, the time between two looks, " + text(timing->check * step) +
               " s: a shorter one is not seen");
  }
  if (!problem.plan) return;
  validate(*problem.plan, problem.scene);
  if (problem.effector == Effector::drive) {
    reject("effector", "\"drive\" with a plan", "\"coast\": the plan says what the effector does");
  }
  if (!problem.horizon && problem.plan->feedback && problem.plan->rows() == 1) {
    reject("horizon", "left out with a robot that reacts for as long as it is asked", "seconds: its plan has one row");
  }
  if (problem.horizon && !problem.plan->feedback && problem.plan->duration() < *problem.horizon - 0.5 * step) {
    reject("plan", text(problem.plan->duration()) + " s",
           "at least as long as the horizon, " + text(*problem.horizon) + " s");
  }
}

void require_disturbance(const Problem& problem) {
  require_form("force", problem.force, Form::bounds);
  require_form("torque", problem.torque, Form::bounds);
  for (const std::size_t index : problem.scene.with_role(Role::object)) {
    const Body& object = problem.scene.bodies()[index];
    require_free("force", problem.force, object.linear_factor);
    require_free("torque", problem.torque, object.angular_factor);
  }
  const double step = problem.scene.stepping().step;
  if (!(problem.duration >= step && problem.duration <= most_steps * step)) {
    reject("duration", text(problem.duration),
           "at least one step, " + text(step) + " s, and at most " + std::to_string(most_steps) + " steps");
  }
}

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

void require_disturbed(const Problem& problem, const std::string& metric) {
  if (!problem.force.isZero(0.0) || !problem.torque.isZero(0.0)) return;
  reject("force and torque", "0 on all axes", "at least one axis on which " + metric + " can push");
}

void require_free_object(const Problem& problem, std::size_t object, const std::string& metric) {
  const std::string& name = problem.scene.bodies()[object].name;
  const auto ties = [&](const Loop& loop) { return loop.body_a == name || loop.body_b == name; };
  const std::vector<Loop>& loops = problem.scene.loops();
  const bool tied = std::any_of(loops.begin(), loops.end(), ties);
  if (!tied && !problem.scene.jointed(object)) return;
  reject("scene", "with the object '" + name + (tied ? "' in a loop" : "' on a joint"),
         "a free body as the object of " + metric);
}

void validate(const Problem& problem) {
  const Scene& scene = problem.scene;
  require_roles(scene, problem.effector);
  validate(scene, problem.state);
  require_disturbance(problem);
  require_clock(problem);
  require_fields(problem);
  if (const auto& simulator = scene.stepping().simulator; simulator && problem.effector == Effector::drive) {
    reject("effector", "\"drive\" with the engine '" + simulator->name + "'", "\"coast\", or a plan of its commands");
  }
  require_region("captured", problem.captured, problem);
  if (problem.succeeded) require_region("succeeded", *problem.succeeded, problem);
  if (problem.captured_any) require_region("captured_any", *problem.captured_any, problem);
  if (problem.succeeded_any) require_region("succeeded_any", *problem.succeeded_any, problem);
  if (problem.within) {
    require_region("within", *problem.within, problem);
    if (!Membership(*problem.within, scene)(problem.state)) {
      reject("state", "outside of the bounds `within`", "a start inside, or no bounds");
    }
  }
  for (const Contact& contact : problem.contacts.value_or(std::vector<Contact>{})) {
    scene.index(contact.body_a);
    scene.index(contact.body_b);
    require_fields(contact, "contact ");
  }
  if (!scene.stepping().simulator) require_no_deep_penetration(scene, problem.state);
}

bool asks_for_force(const Region& region) {
  const auto asks = [](const auto& set) {
    using Set = std::decay_t<decltype(set)>;
    if constexpr (std::is_same_v<Set, regions::Touching>) return set.force > 0.0;
    if constexpr (std::is_same_v<Set, regions::Intersection> || std::is_same_v<Set, regions::Union> ||
                  std::is_same_v<Set, regions::Complement>) {
      return std::any_of(set.of.begin(), set.of.end(), asks_for_force);
    }
    return false;
  };
  return std::visit(asks, region.expression());
}

const Region& capture_set(const Problem& problem, Captured captured) {
  if (captured == Captured::all) return problem.captured;
  if (!problem.captured_any)
    reject("captured", "'any'", "'all': the problem has no set in which any object is captured");
  return *problem.captured_any;
}

Problem with_step(const Problem& problem, double step) {
  Problem copy = problem;
  Stepping stepping = problem.scene.stepping();
  stepping.step = step;
  copy.scene = problem.scene.with_stepping(stepping);
  if (copy.plan && copy.plan->step < step) copy.plan = coarse_rows(*copy.plan, step);
  validate(copy);
  return copy;
}

Problem with_engine(const Problem& problem, EngineKind engine) {
  Problem copy = problem;
  copy.scene = problem.scene.with_engine(engine);
  static_cast<void>(world_of(copy, 1));  // refuses what the engine does not do
  return copy;
}

Problem with_simulator(const Problem& problem, std::shared_ptr<const Simulator> simulator) {
  Problem copy = problem;
  copy.scene = problem.scene.with_simulator(std::move(simulator));
  validate(copy);
  return copy;
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
