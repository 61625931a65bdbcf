#include "energymargin/plan.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <type_traits>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/simulator.hpp"
#include "scene/feedback.hpp"

namespace energymargin {
namespace {

constexpr double standard_gravity = 9.81;  // m/s^2
constexpr double share_of_weight = 2.0;
constexpr double rounding = 1e-6;  // of a step

std::string named(const std::string& part, const std::string& name) { return part + "['" + name + "']"; }

template <typename Rows>
void require_rows(const std::string& name, const Rows& rows, int expected) {
  if (rows.rows() != expected) {
    reject(name, std::to_string(rows.rows()) + " rows", std::to_string(expected) + " rows, as the others of the plan");
  }
  if (!rows.allFinite()) reject(name, "not finite", "finite numbers");
}

void require_columns(const std::string& name, const Wrenches& rows) {
  if (rows.cols() != 6) reject(name, std::to_string(rows.cols()) + " columns", "6 columns");
}

void require_step(const Plan& plan, const Scene& scene) {
  const double steps = plan.step / scene.stepping().step;
  if (!(std::isfinite(steps) && steps > 1.0 - rounding)) {
    reject("step of the plan", text(plan.step),
           "at least a step of the scene, of " + text(scene.stepping().step) + " s");
  }
  if (!(plan.rows() * steps <= most_steps)) {
    reject("plan", text(plan.duration()) + " s", "at most " + std::to_string(most_steps) + " steps of the scene");
  }
}

void require_position_control(const Scene& scene, const std::string& name, const std::string& joint_name) {
  const std::size_t index = scene.control_index(joint_name);
  const Joint* joint = index < scene.joints().size() ? &scene.joints()[index] : nullptr;
  if ((joint && (!joint->moves() || joint->held)) || scene.control(index).stiffness == 0.0) {
    reject(name, joint ? "for a joint without position control" : "for a tendon without position control",
           "a joint that moves, is not held, and has a stiffness, or a tendon with one");
  }
}

// A simulator's robot knows commands alone.
void require_commands(const Plan& plan, const std::string& engine) {
  const std::string given = "given with the engine '" + engine + "'";
  if (!plan.wrenches.empty()) reject("wrenches of the plan", given, "`targets`, which are its commands");
  if (!plan.velocities.empty()) reject("velocities of the plan", given, "`targets`, which are its commands");
  if (!plan.feedback) return;
  for (const std::string& name : plan.feedback->observed) {
    if (name.rfind("force(", 0) == 0) reject("observed", "'" + name + "' " + given, "what it tells: no contact force");
  }
}

// The world's velocities of a body that goes on as it moves: its twist turns with it.
Wrenches constant_twist(const BodyState& state, int rows, double step) {
  Wrenches velocities(rows, 6);
  const double turn = state.angular_velocity.norm() * step;
  const Vector3 axis = turn > 0.0 ? Vector3(state.angular_velocity.normalized()) : Vector3::UnitZ();
  for (int i = 0; i < rows; ++i) {
    velocities.row(i) << (portable::turn(i * turn, axis) * state.velocity).transpose(),
        state.angular_velocity.transpose();
  }
  return velocities;
}

// The row that begins nearest to a step, at so many rows in each.
Eigen::Index first_of(Eigen::Index step, double each) {
  return static_cast<Eigen::Index>(std::floor(static_cast<double>(step) * each + 0.5 + rounding));
}

template <typename OfRows, typename OfTargets>
Plan with_rows(Plan plan, double step, const OfRows& of_rows, const OfTargets& of_targets) {
  plan.step = step;
  for (Drive& drive : plan.wrenches) drive.wrenches = of_rows(drive.wrenches);
  for (Targets& targets : plan.targets) targets.positions = of_targets(targets.positions);
  for (Servo& servo : plan.velocities) servo.velocities = of_rows(servo.velocities);
  return plan;
}

}  // namespace

int Plan::rows() const {
  if (!wrenches.empty()) return static_cast<int>(wrenches.front().wrenches.rows());
  if (!targets.empty()) return static_cast<int>(targets.front().positions.size());
  return velocities.empty() ? 0 : static_cast<int>(velocities.front().velocities.rows());
}

void validate(const Plan& plan, const std::string& wrenches) {
  const int rows = plan.rows();
  if (rows < 1) reject("plan", "empty", "at least one row of wrenches, targets or velocities");
  require_positive("step of the plan", plan.step);
  std::set<std::string> names;
  const auto require = [&](const std::string& name, const auto& numbers) {
    require_rows(name, numbers, rows);
    if (!names.insert(name).second) reject(name, "there twice", "each name once");
  };
  for (const Drive& drive : plan.wrenches) {
    require_columns(named(wrenches, drive.body), drive.wrenches);
    require(named(wrenches, drive.body), drive.wrenches);
  }
  for (const Targets& target : plan.targets) require(named("targets", target.joint), target.positions);
  for (const Servo& servo : plan.velocities) {
    require_columns(named("velocities", servo.body), servo.velocities);
    require(named("velocities", servo.body), servo.velocities);
    if (servo.force) require_not_negative(named("limits", servo.body) + " force", *servo.force);
    if (servo.torque) require_not_negative(named("limits", servo.body) + " torque", *servo.torque);
  }
  if (plan.feedback) validate(*plan.feedback, plan);
}

void validate(const Plan& plan, const Scene& scene, const std::string& wrenches) {
  validate(plan, wrenches);
  require_step(plan, scene);
  if (scene.stepping().simulator) require_commands(plan, scene.stepping().simulator->name);
  if (plan.feedback) {
    for (const std::string& name : plan.feedback->observed) observed(scene, name);
    if (!(plan.feedback->period > (1.0 - rounding) * scene.stepping().step)) {
      reject("period of the feedback", text(plan.feedback->period),
             "at least a step of the scene, of " + text(scene.stepping().step) + " s");
    }
  }
  for (const Drive& drive : plan.wrenches) {
    const Body& body = scene.body(drive.body);
    if (body.fixed()) reject(named(wrenches, drive.body), "on a fixed body", "a body that can move");
    if (body.kinematic) reject(named(wrenches, drive.body), "on a kinematic body", "`velocities`: no force moves it");
  }
  for (const Targets& target : plan.targets) {
    require_position_control(scene, named("targets", target.joint), target.joint);
  }
  for (const Servo& servo : plan.velocities) {
    if (scene.body(servo.body).fixed() || scene.joint_to(scene.index(servo.body))) {
      reject(named("velocities", servo.body), "on a body that is fixed or a link",
             "a free body or one that is made kinematic=True, which may carry links");
    }
    if (scene.body(servo.body).kinematic && (servo.force || servo.torque)) {
      reject(named("limits", servo.body), "of a kinematic body", "none: nothing stops it");
    }
  }
}

// How far a body of a tree may be from where the tree's root is, its joints' ways aside [m].
double reach_in_tree(const Scene& scene, std::size_t body) {
  double reach = scene.inertial(body).center.norm() + reach_from(scene.bodies()[body].shape, Vector3::Zero());
  for (auto joint = scene.joint_to(body); joint; joint = scene.joint_to(body)) {
    const Joint& above = scene.joints()[*joint];
    reach += above.in_parent.position.norm() + above.in_child.position.norm();
    body = scene.index(above.parent);
  }
  return reach;
}

Servo with_default_limits(const Scene& scene, Servo servo) {
  if (scene.body(servo.body).kinematic) return servo;
  double mass = 0.0, reach = reach_from(scene.body(servo.body).shape, Vector3::Zero());
  const bool has_shape = reach > 0.0;
  const std::size_t root = scene.index(servo.body);
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.root(i) != root) continue;
    mass += scene.bodies()[i].mass;
    if (!has_shape) reach = std::max(reach, reach_in_tree(scene, i));
  }
  if (!servo.force) servo.force = share_of_weight * mass * standard_gravity;
  if (!servo.torque) servo.torque = *servo.force * reach;
  return servo;
}

Plan fine_rows(const Plan& plan, double step) {
  const auto fine = [each = plan.step / step](const auto& rows) {
    std::decay_t<decltype(rows)> result(first_of(rows.rows(), each), rows.cols());
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      for (Eigen::Index i = first_of(row, each); i < first_of(row + 1, each); ++i) result.row(i) = rows.row(row);
    }
    return result;
  };
  return with_rows(plan, step, fine, fine);
}

Plan coarse_rows(const Plan& plan, double step) {
  const double each = step / plan.step;
  const auto count = std::max<Eigen::Index>(1, std::lround(plan.rows() / each));
  const auto end = [&](Eigen::Index i) { return i + 1 < count ? first_of(i + 1, each) : Eigen::Index{plan.rows()}; };
  const auto means = [&](const auto& rows) {
    std::decay_t<decltype(rows)> result(count, rows.cols());
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index first = first_of(i, each);
      result.row(i) = rows.middleRows(first, end(i) - first).colwise().mean();
    }
    return result;
  };
  const auto ends = [&](const auto& rows) {
    std::decay_t<decltype(rows)> result(count, rows.cols());
    for (Eigen::Index i = 0; i < count; ++i) result.row(i) = rows.row(end(i) - 1);
    return result;
  };
  return with_rows(plan, step, means, ends);
}

Plan rest_of(const Plan& plan, int done, double step, const Eigen::VectorXd& memory) {
  const double each = plan.step / step;
  const Eigen::Index end = first_of(plan.rows(), each);
  if (done < 0 || (done >= end && !plan.feedback)) {
    reject("done", std::to_string(done), plan.feedback ? "0 or more" : "0 to " + std::to_string(end - 1));
  }
  Eigen::Index first = plan.feedback ? std::min<Eigen::Index>(done, first_of(plan.rows() - 1, each)) : done;
  const auto whole = static_cast<Eigen::Index>(std::lround(each));
  const bool begins_a_row = whole > 0 && std::abs(each - static_cast<double>(whole)) < rounding && first % whole == 0;
  Plan rest = begins_a_row ? plan : fine_rows(plan, step);
  if (begins_a_row) first /= whole;
  const auto cut = [first](auto& all) { all = all.bottomRows(all.rows() - first).eval(); };
  for (Drive& drive : rest.wrenches) cut(drive.wrenches);
  for (Targets& targets : rest.targets) cut(targets.positions);
  for (Servo& servo : rest.velocities) cut(servo.velocities);
  if (rest.feedback) {
    rest.feedback->start += done * step;
    rest.feedback->memory = memory;
    validate(*rest.feedback, rest);
  }
  return rest;
}

Plan hold(const Scene& scene, const State& state, double duration) {
  validate(scene, state);
  const double step = scene.stepping().step;
  if (!(duration >= 0.5 * step && duration <= most_steps * step)) {
    reject("duration", text(duration),
           "at least a step, " + text(step) + " s, and at most " + std::to_string(most_steps) + " steps");
  }
  const int rows = static_cast<int>(std::lround(duration / step));
  Plan plan{step};
  const StateLayout layout(scene);
  std::set<std::size_t> held;
  for (const std::size_t effector : scene.with_role(Role::effector)) {
    const std::size_t root = scene.root(effector);
    if (scene.bodies()[root].fixed() || !held.insert(root).second) continue;
    const BodyState at = StateLayout::read(state.data() + layout.offset(root));
    plan.velocities.push_back({scene.bodies()[root].name, constant_twist(at, rows, step)});
  }
  for (const Joint& joint : scene.joints()) {
    if (!joint.moves() || joint.held || joint.mimic || joint.stiffness == 0.0) continue;
    plan.targets.push_back({joint.name, Eigen::VectorXd::Constant(rows, joint.target)});
  }
  for (const Tendon& tendon : scene.tendons()) {
    if (tendon.stiffness == 0.0) continue;
    plan.targets.push_back({tendon.name, Eigen::VectorXd::Constant(rows, tendon.target)});
  }
  if (plan.rows() == 0) {
    reject("scene", "without a free body of role \"effector\" and without a joint under position control",
           "something that a robot can hold");
  }
  return plan;
}

}  // namespace energymargin
