#include "scene/feedback.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/simulator.hpp"

namespace energymargin {
namespace {

constexpr std::array<const char*, 6> pose_words = {"x", "y", "z", "rx", "ry", "rz"};
constexpr std::array<const char*, 6> velocity_words = {"vx", "vy", "vz", "wx", "wy", "wz"};
constexpr std::array<const char*, 6> wrench_words = {"fx", "fy", "fz", "tx", "ty", "tz"};
constexpr const char* force_begins = "force(";
constexpr std::size_t most_queued = 10'000;  // commands that wait for their delay, in each state of a search

int axis_of(const std::array<const char*, 6>& names, const std::string& word) {
  const auto found = std::find(names.begin(), names.end(), word);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

// What stands before and behind the last dot; nothing behind it where there is none.
std::pair<std::string, std::string> split(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) return {name, ""};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

template <typename Items>
std::optional<std::size_t> find(const Items& items, const std::string& name) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  if (found == items.end()) return std::nullopt;
  return static_cast<std::size_t>(found - items.begin());
}

std::optional<Observed> observed_force(const Scene& scene, const std::string& name) {
  const std::size_t comma = name.find(", ");
  if (name.rfind(force_begins, 0) != 0 || name.back() != ')' || comma == std::string::npos) return std::nullopt;
  const std::size_t begin = std::string(force_begins).size();
  const auto a = find(scene.bodies(), name.substr(begin, comma - begin));
  const auto b = find(scene.bodies(), name.substr(comma + 2, name.size() - comma - 3));
  if (!a || !b || *a == *b) return std::nullopt;
  return Observed{Observed::Kind::force, *a, *b};
}

void require_finite_numbers(const std::string& name, const Eigen::MatrixXd& numbers) {
  if (!numbers.allFinite()) reject(name, "not finite", "finite numbers");
}

std::string shape(const Eigen::MatrixXd& matrix) {
  return "of shape (" + std::to_string(matrix.rows()) + ", " + std::to_string(matrix.cols()) + ")";
}

void require_names(const std::string& what, const std::vector<std::string>& names) {
  if (names.empty()) reject(what, "empty", "at least one name");
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size()) {
    reject(what, "with a name twice", "each name once");
  }
}

template <typename Parts, typename Name>
bool has(const Parts& parts, const Name& name, const std::string& wanted) {
  return std::any_of(parts.begin(), parts.end(), [&](const auto& part) { return part.*name == wanted; });
}

void require_rows(const std::string& name, const Plan& plan) {
  const Corrected number = corrected(name);
  const bool there = number.kind == Corrected::Kind::target   ? has(plan.targets, &Targets::joint, number.of)
                     : number.kind == Corrected::Kind::wrench ? has(plan.wrenches, &Drive::body, number.of)
                                                              : has(plan.velocities, &Servo::body, number.of);
  if (there) return;
  const char* const of = number.kind == Corrected::Kind::target   ? "targets"
                         : number.kind == Corrected::Kind::wrench ? "wrenches"
                                                                  : "velocities";
  reject("corrected", "with '" + name + "'",
         "what the plan has rows of: " + std::string(of) + " of '" + number.of + "'");
}

void require_limits(const Feedback& feedback) {
  const auto m = static_cast<Eigen::Index>(feedback.corrected.size());
  for (const auto& [name, limits] : {std::pair{"low", feedback.low}, std::pair{"high", feedback.high}}) {
    if (limits.size() != 0 && limits.size() != m) {
      reject(std::string("limits ") + name, std::to_string(limits.size()) + " numbers", std::to_string(m));
    }
    if (limits.array().isNaN().any()) reject(std::string("limits ") + name, "not a number", "numbers");
  }
  if (feedback.low.size() != feedback.high.size() || (feedback.low.array() > feedback.high.array()).any()) {
    reject("limits", "with a low one above the high one", "low ones at most the high ones");
  }
}

}  // namespace

Observed observed(const Scene& scene, const std::string& name) {
  if (const auto force = observed_force(scene, name)) return *force;
  if (const auto joint = find(scene.joints(), name)) return {Observed::Kind::position, *joint};
  const auto [of, word] = split(name);
  if (const auto joint = find(scene.joints(), of); joint && word == "velocity") return {Observed::Kind::rate, *joint};
  if (const auto body = find(scene.bodies(), of)) {
    if (const int axis = axis_of(pose_words, word); axis >= 0) return {Observed::Kind::pose, *body, 0, axis};
    if (const int axis = axis_of(velocity_words, word); axis >= 0) return {Observed::Kind::velocity, *body, 0, axis};
  }
  reject(
      "observed", "with '" + name + "'",
      "numbers of the scene: a joint \"j\" or \"j.velocity\", a body \"b.x\" to \"b.rz\" or \"b.vx\" to \"b.wz\", or "
      "\"force(a, b)\"");
}

Observer::Observer(const Scene& scene, const std::vector<std::string>& names)
    : layout_(scene), kinematics_(scene), all_(layout_.dimension()) {
  if (const auto& simulator = scene.stepping().simulator) all_ += simulator->memory;
  for (const std::string& name : names) {
    names_.push_back(observed(scene, name));
    if (names_.back().kind == Observed::Kind::force) reject("observe", "with '" + name + "'", "numbers of a state");
  }
}

Eigen::RowVectorXd Observer::operator()(const State& state) const {
  if (names_.empty()) return state.head(all_).transpose();
  Eigen::RowVectorXd numbers(size());
  for (std::size_t i = 0; i < names_.size(); ++i) numbers[static_cast<Eigen::Index>(i)] = (*this)(state, names_[i]);
  return numbers;
}

double Observer::operator()(const State& state, const Observed& of) const {
  if (of.kind == Observed::Kind::position) return layout_.joint(state.data(), of.index).position;
  if (of.kind == Observed::Kind::rate) return layout_.joint(state.data(), of.index).velocity;
  const BodyState body = kinematics_(state.data(), of.index);
  if (of.kind == Observed::Kind::velocity) {
    return of.axis < 3 ? body.velocity[of.axis] : body.angular_velocity[of.axis - 3];
  }
  if (of.axis < 3) return body.position[of.axis];
  return portable::rotation_vector(body.orientation)[of.axis - 3];
}

Corrected corrected(const std::string& name) {
  const auto [of, word] = split(name);
  if (const int axis = axis_of(wrench_words, word); axis >= 0) return {Corrected::Kind::wrench, of, axis};
  if (const int axis = axis_of(velocity_words, word); axis >= 0) return {Corrected::Kind::velocity, of, axis};
  return {Corrected::Kind::target, name};
}

Eigen::Index memory_size(const Feedback& feedback, const Policy* policy) {
  const auto is_force = [](const std::string& name) { return name.rfind(force_begins, 0) == 0; };
  const auto forces = std::count_if(feedback.observed.begin(), feedback.observed.end(), is_force);
  const auto corrected = static_cast<Eigen::Index>(feedback.corrected.size());
  return 1 + corrected * (feedback.delay + 1) + (policy ? policy->memory : static_cast<Eigen::Index>(forces));
}

Eigen::VectorXd first_commands(const Scene& scene, const Feedback& feedback) {
  Eigen::VectorXd commands = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(feedback.corrected.size()));
  for (std::size_t i = 0; i < feedback.corrected.size(); ++i) {
    const Corrected number = corrected(feedback.corrected[i]);
    if (number.kind != Corrected::Kind::target) continue;
    commands[static_cast<Eigen::Index>(i)] = scene.control(scene.control_index(number.of)).target;
  }
  return commands;
}

void validate(const Feedback& feedback, const Plan& plan) {
  require_positive("period of the feedback", feedback.period);
  require_not_negative("start of the feedback", feedback.start);
  require_at_least("delay", feedback.delay, 0);
  require_names("corrected", feedback.corrected);
  // Each state of a search remembers them: 80 kB at most.
  const auto longest = static_cast<Eigen::Index>(most_queued / std::max<std::size_t>(1, feedback.corrected.size()));
  if (feedback.delay >= longest) {
    reject("delay", std::to_string(feedback.delay) + " control periods",
           "less than " + std::to_string(longest) + ": a state holds " + std::to_string(most_queued) +
               " commands at most");
  }
  require_limits(feedback);
  for (const std::string& name : feedback.corrected) require_rows(name, plan);
  if (const Eigen::Index size = memory_size(feedback, plan.policy.get());
      feedback.memory.size() != 0 && feedback.memory.size() != size) {
    reject("memory", std::to_string(feedback.memory.size()) + " numbers", std::to_string(size));
  }
  require_finite_numbers("memory", feedback.memory);
  if (plan.policy) return;
  require_names("observed", feedback.observed);
  const auto n = static_cast<Eigen::Index>(feedback.observed.size());
  const auto m = static_cast<Eigen::Index>(feedback.corrected.size());
  if (feedback.gains.empty()) reject("gains", "empty", "at least one");
  for (const Eigen::MatrixXd& gain : feedback.gains) {
    if (gain.rows() != m || gain.cols() != n) {
      reject("gains", shape(gain), "(" + std::to_string(m) + ", " + std::to_string(n) + "), corrected by observed");
    }
    require_finite_numbers("gains", gain);
  }
  if (feedback.references.rows() < 1 || feedback.references.cols() != n) {
    reject("references", shape(feedback.references), "(K, " + std::to_string(n) + "), a column a number observed");
  }
  require_finite_numbers("references", feedback.references);
  if (feedback.noise.size() != 0 && feedback.noise.size() != n) {
    reject("noise", std::to_string(feedback.noise.size()) + " numbers", std::to_string(n) + ", one a number observed");
  }
  for (const double deviation : feedback.noise) require_not_negative("noise", deviation);
}

Plan with_feedback(Plan plan, Feedback feedback) {
  const Eigen::Index rows = std::max(1, plan.rows());
  const bool commands = plan.policy != nullptr;
  for (const std::string& name : feedback.corrected) {
    const Corrected number = corrected(name);
    if (number.kind == Corrected::Kind::target && commands && !has(plan.targets, &Targets::joint, number.of)) {
      plan.targets.push_back({number.of, Eigen::VectorXd::Zero(rows)});
    }
    if (number.kind == Corrected::Kind::wrench && !has(plan.wrenches, &Drive::body, number.of)) {
      plan.wrenches.push_back({number.of, Wrenches::Zero(rows, 6)});
    }
    if (number.kind == Corrected::Kind::velocity && !has(plan.velocities, &Servo::body, number.of)) {
      plan.velocities.push_back({number.of, Wrenches::Zero(rows, 6)});
    }
  }
  validate(feedback, plan);
  plan.feedback = std::move(feedback);
  validate(plan);
  return plan;
}

}  // namespace energymargin
