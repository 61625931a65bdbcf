#include "energymargin/disturbances.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "energymargin/random.hpp"

namespace energymargin {
namespace {

using disturbances::Boltzmann;
using disturbances::Gaussian;
using disturbances::Given;
using disturbances::OfPlan;
using disturbances::Uniform;

// Draws that are the same with every standard library.
class Draw {
 public:
  Draw(std::uint64_t seed, std::size_t index) : engine_(stream(seed, index)) {}

  double even() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double even(double low, double high) { return low + (high - low) * even(); }

  //! Box and Muller (1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - even()));
    return radius * std::cos(2.0 * pi * even());
  }

  Vector3 within(const Vector3& bounds) {
    Vector3 sample;
    for (int axis = 0; axis < 3; ++axis) sample[axis] = even(-bounds[axis], bounds[axis]);
    return sample;
  }

  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(even() * static_cast<double>(count)));
  }

 private:
  std::mt19937_64 engine_;
};

std::size_t objects_of(const Problem& problem) { return problem.scene.with_role(Role::object).size(); }

int steps_of(double time, const Problem& problem) {
  return std::max(1, static_cast<int>(std::lround(time / problem.scene.stepping().step)));
}

// So many of `count`, by their numbers.
std::vector<bool> choose(std::size_t count, std::size_t of, Draw& draw) {
  std::vector<std::size_t> order(of);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<bool> is_chosen(of, count >= of);
  for (std::size_t i = 0; i < count && count < of; ++i) {
    std::swap(order[i], order[i + draw.below(of - i)]);
    is_chosen[order[i]] = true;
  }
  return is_chosen;
}

std::vector<Push> sample(const Uniform& model, const Problem& problem, int steps, Draw& draw) {
  const std::size_t objects = objects_of(problem);
  const int longest = steps_of(model.hold.value_or(problem.duration), problem);
  std::vector<Push> pushes;
  for (int left = steps; left > 0; left -= pushes.back().steps) {
    const auto held = static_cast<int>(draw.below(static_cast<std::size_t>(longest))) + 1;
    Push push{Disturbance(objects), std::min(left, held)};
    const std::size_t hits = model.objects ? static_cast<std::size_t>(*model.objects) : objects;
    const std::vector<bool> hit = choose(hits, objects, draw);
    for (std::size_t i = 0; i < objects; ++i) {
      if (hit[i])
        push.wrenches[i] = {draw.within(model.strength * problem.force), draw.within(model.strength * problem.torque)};
    }
    pushes.push_back(std::move(push));
  }
  return pushes;
}

// An Ornstein-Uhlenbeck process, sampled exactly, from its stationary distribution on.
std::vector<Push> sample(const Gaussian& model, const Problem& problem, int steps, Draw& draw) {
  const double decay =
      model.correlation_time > 0.0 ? std::exp(-problem.scene.stepping().step / model.correlation_time) : 0.0;
  const double noise_share = std::sqrt(1.0 - decay * decay);
  const auto next = [&](const Vector3& last, const Vector3& bounds, double deviation, bool first) {
    Vector3 sample = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (bounds[axis] == 0.0) continue;
      const double noise = deviation * draw.normal();
      sample[axis] = first ? noise : decay * last[axis] + noise_share * noise;
    }
    return sample;
  };
  Disturbance now(objects_of(problem));
  std::vector<Push> pushes;
  for (int i = 0; i < steps; ++i) {
    for (Wrench& wrench : now) {
      wrench = {next(wrench.force, problem.force, model.force, i == 0),
                next(wrench.torque, problem.torque, model.torque, i == 0)};
    }
    pushes.push_back({now, 1});
  }
  return pushes;
}

std::vector<Push> sample(const Wrenches& rows, const Problem& problem, int steps) {
  std::vector<Push> pushes;
  for (int i = 0; i < steps; ++i) {
    Push push{Disturbance(objects_of(problem)), 1};
    for (std::size_t k = 0; k < push.wrenches.size(); ++k) {
      const auto first = static_cast<Eigen::Index>(6 * k);
      push.wrenches[k] = {rows.row(i).segment<3>(first), rows.row(i).segment<3>(first + 3)};
    }
    pushes.push_back(std::move(push));
  }
  return pushes;
}

void validate_uniform(const Uniform& model, const Problem& problem) {
  require_not_negative("strength", model.strength);
  if (model.hold) require_positive("hold", *model.hold);
  if (!model.objects) return;
  const auto most = static_cast<int>(objects_of(problem));
  if (*model.objects < 1 || *model.objects > most) {
    reject("objects", std::to_string(*model.objects), "from 1 to the scene's " + std::to_string(most));
  }
}

void validate_given(const Given& model, const Problem& problem) {
  const auto timing = timing_of(problem);
  const auto columns = static_cast<Eigen::Index>(6 * objects_of(problem));
  for (const Wrenches& rows : model.rollouts) {
    if (rows.rows() != timing->horizon || rows.cols() != columns) {
      reject("disturbance", "of shape (" + std::to_string(rows.rows()) + ", " + std::to_string(rows.cols()) + ")",
             "(" + std::to_string(timing->horizon) + ", " + std::to_string(columns) + "), a row a step");
    }
    if (!rows.allFinite()) reject("disturbance", "not finite", "finite numbers");
  }
}

}  // namespace

void validate(const DisturbanceModel& model, const Problem& problem) {
  if (const auto* uniform = std::get_if<Uniform>(&model)) validate_uniform(*uniform, problem);
  if (const auto* boltzmann = std::get_if<Boltzmann>(&model)) {
    require_not_negative("rate", boltzmann->rate);
    validate_uniform(boltzmann->proposal, problem);
  }
  if (const auto* gaussian = std::get_if<Gaussian>(&model)) {
    require_not_negative("force", gaussian->force);
    require_not_negative("torque", gaussian->torque);
    require_not_negative("correlation_time", gaussian->correlation_time);
  }
  if (const auto* noise = std::get_if<OfPlan>(&model)) {
    if (!problem.plan) reject("disturbance", "noise of the plan", "a problem with a plan");
    for (int axis = 0; axis < 3; ++axis) {
      require_not_negative("force", noise->force[axis]);
      require_not_negative("torque", noise->torque[axis]);
    }
    require_not_negative("targets", noise->targets);
    if (noise->hold) require_positive("hold", *noise->hold);
  }
  if (const auto* given = std::get_if<Given>(&model)) validate_given(*given, problem);
}

std::vector<Push> draw_pushes(const DisturbanceModel& model, const Problem& problem, int steps, std::uint64_t seed,
                              std::size_t index) {
  Draw draw(seed, index);
  if (const auto* uniform = std::get_if<Uniform>(&model)) return sample(*uniform, problem, steps, draw);
  if (const auto* boltzmann = std::get_if<Boltzmann>(&model)) return sample(boltzmann->proposal, problem, steps, draw);
  if (const auto* gaussian = std::get_if<Gaussian>(&model)) return sample(*gaussian, problem, steps, draw);
  if (const auto* given = std::get_if<Given>(&model)) return sample(given->rollouts[index], problem, steps);
  return {Push{Disturbance(objects_of(problem)), steps}};
}

std::optional<Plan> draw_plan(const DisturbanceModel& model, const Problem& problem, std::uint64_t seed,
                              std::size_t index) {
  const auto* noise = std::get_if<OfPlan>(&model);
  if (!noise) return std::nullopt;
  Draw draw(seed, index);
  Plan plan = fine_rows(*problem.plan, problem.scene);
  const int rows = plan.rows();
  const int hold = noise->hold ? steps_of(*noise->hold, problem) : 1;
  for (const Servo& servo : problem.plan->velocities) {
    const auto has_it = [&servo](const Drive& drive) { return drive.body == servo.body; };
    if (std::any_of(plan.wrenches.begin(), plan.wrenches.end(), has_it)) continue;
    plan.wrenches.push_back({servo.body, Wrenches::Zero(rows, 6)});
  }
  for (int first = 0; first < rows; first += hold) {
    const int count = std::min(hold, rows - first);
    for (Drive& drive : plan.wrenches) {
      Eigen::Matrix<double, 1, 6> added;
      added << draw.within(noise->force).transpose(), draw.within(noise->torque).transpose();
      drive.wrenches.middleRows(first, count).rowwise() += added;
    }
    for (Targets& targets : plan.targets) {
      targets.positions.segment(first, count).array() += draw.even(-noise->targets, noise->targets);
    }
  }
  return plan;
}

}  // namespace energymargin
