#include "energymargin/disturbances.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/portable.hpp"
#include "base/random_draws.hpp"
#include "problem/records.hpp"

namespace energymargin {
namespace {

using disturbances::ActuationNoise;
using disturbances::Boltzmann;
using disturbances::Draws;
using disturbances::Gaussian;
using disturbances::Uniform;

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

int steps_of(const std::vector<Push>& sequence) {
  return std::accumulate(sequence.begin(), sequence.end(), 0,
                         [](int sum, const Push& push) { return sum + push.steps; });
}

int longest_hold(const Uniform& model, const Problem& problem) {
  return steps_of(model.hold.value_or(problem.duration), problem);
}

// Goes on until there are `steps` steps.
void extend(const Uniform& model, const Problem& problem, int steps, Random& random, std::vector<Push>& sequence) {
  const std::size_t objects = objects_of(problem);
  const int longest = longest_hold(model, problem);
  for (int left = steps - steps_of(sequence); left > 0; left -= sequence.back().steps) {
    const auto hold = static_cast<int>(random.below(static_cast<std::size_t>(longest))) + 1;
    Push push = no_push(problem, std::min(left, hold));
    const std::size_t count = model.objects ? static_cast<std::size_t>(*model.objects) : objects;
    const std::vector<bool> acts_on = subset(count, objects, random);
    for (std::size_t i = 0; i < objects; ++i) {
      if (!acts_on[i]) continue;
      const Vector3 force = random.within(model.strength * problem.force);
      push.wrenches.segment<wrench_axes>(wrench_axes * static_cast<Eigen::Index>(i)) << force,
          random.within(model.strength * problem.torque);
    }
    sequence.push_back(std::move(push));
  }
}

// An Ornstein-Uhlenbeck process, sampled exactly, from its stationary distribution on.
void extend(const Gaussian& model, const Problem& problem, int steps, Random& random, std::vector<Push>& sequence) {
  const double decay =
      model.correlation_time > 0.0 ? portable::exp(-problem.scene.stepping().step / model.correlation_time) : 0.0;
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
  Push now = no_push(problem, 1);
  if (!sequence.empty()) now.wrenches = sequence.back().wrenches;
  for (int i = steps_of(sequence); i < steps; ++i) {
    for (Eigen::Index first = 0; first < now.wrenches.size(); first += wrench_axes) {
      auto force = now.wrenches.segment<3>(first), torque = now.wrenches.segment<3>(first + 3);
      force = next(force, problem.force, model.force, i == 0);
      torque = next(torque, problem.torque, model.torque, i == 0);
    }
    sequence.push_back(now);
  }
}

// The pushes that have begun before `step`.
std::vector<Push> begun(const std::vector<Push>& sequence, int step) {
  std::vector<Push> first;
  for (int time = 0; time < step; time += first.back().steps) first.push_back(sequence[first.size()]);
  return first;
}

// The seeds of noise that have begun before `step`, and one from there on.
NoiseSeeds seeds_of_noise(const Problem& problem, const NoiseSeeds& begun, int step, std::uint64_t seed) {
  NoiseSeeds seeds;
  if (!problem.plan || !problem.plan->feedback) return seeds;
  for (const auto& one : begun) {
    if (one.first < step) seeds.push_back(one);
  }
  seeds.emplace_back(step, seed);
  return seeds;
}

// How long the last piece is held is drawn anew, given that it is held until `step` at least.
void draw_hold(const Uniform& model, const Problem& problem, int step, int steps, Random& random,
               std::vector<Push>& sequence) {
  if (sequence.empty()) return;
  Push& last = sequence.back();
  const int start = steps_of(sequence) - last.steps;
  const int age = step - start;
  const int rest = longest_hold(model, problem) - age;
  const auto hold = age + static_cast<int>(random.below(static_cast<std::size_t>(rest) + 1));
  last.steps = std::min(hold, steps - start);
}

std::vector<Push> pushes(const Wrenches& rows, int steps) {
  std::vector<Push> sequence;
  for (int i = 0; i < steps; ++i) sequence.push_back({rows.row(i), 1});
  return sequence;
}

// Behind its end a plan with a feedback has its last row, up to so many.
void extend(Plan& plan, Eigen::Index rows) {
  const auto add = [rows](auto& all) {
    const Eigen::Index before = all.rows();
    if (before >= rows) return;
    all.conservativeResize(rows, all.cols());
    all.bottomRows(rows - before).rowwise() = all.row(before - 1).eval();
  };
  for (Drive& drive : plan.wrenches) add(drive.wrenches);
  for (Targets& targets : plan.targets) add(targets.positions);
  for (Servo& servo : plan.velocities) add(servo.velocities);
}

// The problem's plan, a row a step, with wrenches on each body that it drives by a force.
Plan rows_for_noise(const Problem& problem) {
  Plan plan = fine_rows(*problem.plan, problem.scene.stepping().step);
  if (plan.feedback) extend(plan, timing_of(problem)->horizon);
  for (const Servo& servo : problem.plan->velocities) {
    const auto has_it = [&servo](const Drive& drive) { return drive.body == servo.body; };
    if (problem.scene.body(servo.body).kinematic) continue;
    if (std::any_of(plan.wrenches.begin(), plan.wrenches.end(), has_it)) continue;
    plan.wrenches.push_back({servo.body, Wrenches::Zero(plan.rows(), 6)});
  }
  return plan;
}

// The problem's plan with noise, which goes on from that of the parent, if there is one, at `step`.
Plan noisy_plan(const ActuationNoise& noise, const Problem& problem, const std::optional<Plan>& parent, int step,
                Random& random) {
  Plan plan = rows_for_noise(problem);
  const int hold = noise.hold ? steps_of(*noise.hold, problem) : 1;
  const int known = std::min((step + hold - 1) / hold * hold, plan.rows());  // rows of the draws that have begun
  for (std::size_t i = 0; parent && i < plan.wrenches.size(); ++i) {
    plan.wrenches[i].wrenches.topRows(known) = parent->wrenches[i].wrenches.topRows(known);
  }
  for (std::size_t i = 0; parent && i < plan.targets.size(); ++i) {
    plan.targets[i].positions.head(known) = parent->targets[i].positions.head(known);
  }
  for (int first = known; first < plan.rows(); first += hold) {
    const int count = std::min(hold, plan.rows() - first);
    for (Drive& drive : plan.wrenches) {
      Eigen::Matrix<double, 1, 6> error;
      error << random.within(noise.force).transpose(), random.within(noise.torque).transpose();
      drive.wrenches.middleRows(first, count).rowwise() += error;
    }
    for (Targets& targets : plan.targets) {
      targets.positions.segment(first, count).array() += random.uniform(-noise.targets, noise.targets);
    }
  }
  return plan;
}

void require_objects(const Uniform& model, const Problem& problem) {
  const auto most = static_cast<int>(objects_of(problem));
  if (!model.objects || (*model.objects >= 1 && *model.objects <= most)) return;
  reject("objects", std::to_string(*model.objects), "from 1 to the scene's " + std::to_string(most));
}

void require_forces(const Problem& problem) {
  if (!problem.plan) reject("disturbance", "noise of the plan", "a problem with a plan");
  const Plan driven = rows_for_noise(problem);
  if (driven.wrenches.empty() && driven.targets.empty()) {
    reject("disturbance", "noise of a plan of kinematic bodies alone", "one of a plan with forces or targets");
  }
}

void require_rows(const Wrenches& rows, const Problem& problem, int steps) {
  const auto columns = static_cast<Eigen::Index>(6 * objects_of(problem));
  if (rows.rows() != steps || rows.cols() != columns) {
    reject("disturbance", "of shape (" + std::to_string(rows.rows()) + ", " + std::to_string(rows.cols()) + ")",
           "(" + std::to_string(steps) + ", " + std::to_string(columns) + "), a row a step");
  }
  if (!rows.allFinite()) reject("disturbance", "not finite", "finite numbers");
}

// The seed of what a robot observes in a rollout.
std::uint64_t seed_of_noise(std::uint64_t seed, std::size_t index) { return stream(stream(seed, index), 0); }

}  // namespace

void validate(const DisturbanceModel& model, const Problem& problem) {
  if (std::holds_alternative<ActuationNoise>(model)) require_forces(problem);
  const auto require = [](const auto& alternative) {
    if constexpr (is_record<std::decay_t<decltype(alternative)>>) require_fields(alternative);
  };
  std::visit(require, model);
  if (const auto* uniform = std::get_if<Uniform>(&model)) require_objects(*uniform, problem);
  if (const auto* boltzmann = std::get_if<Boltzmann>(&model)) require_objects(boltzmann->proposal, problem);
}

Draw draw(const DisturbanceModel& model, const Problem& problem, int steps, std::uint64_t seed, std::size_t index,
          const Draw& parent, int step, std::vector<double> leading) {
  const NoiseSeeds seeds = seeds_of_noise(problem, parent.noise, step, seed_of_noise(seed, index));
  Random random(seed, index, std::move(leading));
  if (const auto* noise = std::get_if<ActuationNoise>(&model)) {
    return {{no_push(problem, steps)}, noisy_plan(*noise, problem, parent.plan, step, random), seeds};
  }
  std::vector<Push> sequence = begun(parent.pushes, step);
  if (const auto* gaussian = std::get_if<Gaussian>(&model)) {
    extend(*gaussian, problem, steps, random, sequence);
    return {sequence, std::nullopt, seeds};
  }
  const auto* boltzmann = std::get_if<Boltzmann>(&model);
  const Uniform& uniform = boltzmann ? boltzmann->proposal : std::get<Uniform>(model);
  draw_hold(uniform, problem, step, steps, random, sequence);
  extend(uniform, problem, steps, random, sequence);
  return {sequence, std::nullopt, seeds};
}

Draw resampled(Draw draw, double from, double to, int steps) {
  constexpr double rounding = 1e-6;  // of a step
  std::vector<Push> sequence;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(draw.pushes.front().wrenches.size());
  int taken = 0, made = 0;        // steps of before, and of now
  double now = 0.0, mixed = 0.0;  // until when there are wrenches, and for how much of the next step `sum` has some
  const auto add = [&](const Eigen::VectorXd& wrenches, int count) {
    if (made < steps) sequence.push_back({wrenches, std::min(count, steps - made)});
    made += count;
  };
  for (const Push& push : draw.pushes) {
    taken += push.steps;
    const double exact = taken * (from / to), whole = std::round(exact);
    const double end = std::abs(exact - whole) < rounding ? whole : exact;
    while (now < end) {
      const double next = std::min(std::floor(now) + 1.0, end);
      if (now == std::floor(now) && end - now >= 1.0) {
        add(push.wrenches, static_cast<int>(std::floor(end - now)));
        now = std::floor(end);
        continue;
      }
      sum += (next - now) * push.wrenches;
      mixed += next - now;
      now = next;
      if (now != std::floor(now)) continue;
      add(sum / mixed, 1);
      sum.setZero();
      mixed = 0.0;
    }
  }
  if (mixed > 0.0) add(sum / mixed, 1);
  draw.pushes = std::move(sequence);
  if (draw.plan) draw.plan = from < to ? coarse_rows(*draw.plan, to) : fine_rows(*draw.plan, to);
  return draw;
}

std::optional<Draw> draw(const Draws& model, const Problem& problem, int steps, std::uint64_t seed, std::size_t index,
                         const Limit& limit) {
  const std::optional<Wrenches> rows = model.wrenches(index, limit);
  if (!rows) return std::nullopt;
  require_rows(*rows, problem, steps);
  return Draw{pushes(*rows, steps), std::nullopt, seeds_of_noise(problem, {}, 0, seed_of_noise(seed, index))};
}

}  // namespace energymargin
