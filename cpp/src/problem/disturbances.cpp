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
using disturbances::Draws;
using disturbances::Gaussian;
using disturbances::OfPlan;
using disturbances::Uniform;

// Random numbers that are the same with every standard library.
class Random {
 public:
  Random(std::uint64_t seed, std::size_t index) : engine_(stream(seed, index)) {}

  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  //! Box and Muller (1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * pi * uniform());
  }

  Vector3 within(const Vector3& bounds) {
    Vector3 sample;
    for (int axis = 0; axis < 3; ++axis) sample[axis] = uniform(-bounds[axis], bounds[axis]);
    return sample;
  }

  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform() * static_cast<double>(count)));
  }

 private:
  std::mt19937_64 engine_;
};

std::size_t objects_of(const Problem& problem) { return problem.scene.with_role(Role::object).size(); }

int steps_of(double time, const Problem& problem) {
  return std::max(1, static_cast<int>(std::lround(time / problem.scene.stepping().step)));
}

// A random subset: whether each of `total` is among the `count`.
std::vector<bool> subset(std::size_t count, std::size_t total, Random& random) {
  std::vector<std::size_t> order(total);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<bool> is_member(total, count >= total);
  for (std::size_t i = 0; i < count && count < total; ++i) {
    std::swap(order[i], order[i + random.below(total - i)]);
    is_member[order[i]] = true;
  }
  return is_member;
}

std::vector<Push> pushes(const Uniform& model, const Problem& problem, int steps, Random& random) {
  const std::size_t objects = objects_of(problem);
  const int longest = steps_of(model.hold.value_or(problem.duration), problem);
  std::vector<Push> sequence;
  for (int left = steps; left > 0; left -= sequence.back().steps) {
    const auto hold = static_cast<int>(random.below(static_cast<std::size_t>(longest))) + 1;
    Push push{Disturbance(objects), std::min(left, hold)};
    const std::size_t count = model.objects ? static_cast<std::size_t>(*model.objects) : objects;
    const std::vector<bool> acts_on = subset(count, objects, random);
    for (std::size_t i = 0; i < objects; ++i) {
      if (!acts_on[i]) continue;
      push.wrenches[i] = {random.within(model.strength * problem.force),
                          random.within(model.strength * problem.torque)};
    }
    sequence.push_back(std::move(push));
  }
  return sequence;
}

// An Ornstein-Uhlenbeck process, sampled exactly, from its stationary distribution on.
std::vector<Push> pushes(const Gaussian& model, const Problem& problem, int steps, Random& random) {
  const double decay =
      model.correlation_time > 0.0 ? std::exp(-problem.scene.stepping().step / model.correlation_time) : 0.0;
  const double innovation = std::sqrt(1.0 - decay * decay);
  const auto next = [&](const Vector3& last, const Vector3& bounds, double deviation, bool first) {
    Vector3 sample = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (bounds[axis] == 0.0) continue;
      const double noise = deviation * random.normal();
      sample[axis] = first ? noise : decay * last[axis] + innovation * noise;
    }
    return sample;
  };
  Disturbance now(objects_of(problem));
  std::vector<Push> sequence;
  for (int i = 0; i < steps; ++i) {
    for (Wrench& wrench : now) {
      wrench = {next(wrench.force, problem.force, model.force, i == 0),
                next(wrench.torque, problem.torque, model.torque, i == 0)};
    }
    sequence.push_back({now, 1});
  }
  return sequence;
}

std::vector<Push> pushes(const Wrenches& rows, const Problem& problem, int steps) {
  std::vector<Push> sequence;
  for (int i = 0; i < steps; ++i) {
    Push push{Disturbance(objects_of(problem)), 1};
    for (std::size_t k = 0; k < push.wrenches.size(); ++k) {
      const auto first = static_cast<Eigen::Index>(6 * k);
      push.wrenches[k] = {rows.row(i).segment<3>(first), rows.row(i).segment<3>(first + 3)};
    }
    sequence.push_back(std::move(push));
  }
  return sequence;
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

void validate_draws(const Draws& model, const Problem& problem) {
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
  if (const auto* draws = std::get_if<Draws>(&model)) validate_draws(*draws, problem);
}

std::vector<Push> draw_pushes(const DisturbanceModel& model, const Problem& problem, int steps, std::uint64_t seed,
                              std::size_t index) {
  Random random(seed, index);
  if (const auto* uniform = std::get_if<Uniform>(&model)) return pushes(*uniform, problem, steps, random);
  if (const auto* boltzmann = std::get_if<Boltzmann>(&model))
    return pushes(boltzmann->proposal, problem, steps, random);
  if (const auto* gaussian = std::get_if<Gaussian>(&model)) return pushes(*gaussian, problem, steps, random);
  if (const auto* draws = std::get_if<Draws>(&model)) return pushes(draws->rollouts[index], problem, steps);
  return {Push{Disturbance(objects_of(problem)), steps}};
}

std::optional<Plan> draw_plan(const DisturbanceModel& model, const Problem& problem, std::uint64_t seed,
                              std::size_t index) {
  const auto* noise = std::get_if<OfPlan>(&model);
  if (!noise) return std::nullopt;
  Random random(seed, index);
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
      Eigen::Matrix<double, 1, 6> error;
      error << random.within(noise->force).transpose(), random.within(noise->torque).transpose();
      drive.wrenches.middleRows(first, count).rowwise() += error;
    }
    for (Targets& targets : plan.targets) {
      targets.positions.segment(first, count).array() += random.uniform(-noise->targets, noise->targets);
    }
  }
  return plan;
}

}  // namespace energymargin
