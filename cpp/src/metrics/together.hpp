#pragma once
// Rollouts of a problem whose robot follows a policy, from one control time to the next.

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "base/thread_pool.hpp"
#include "energymargin/random.hpp"
#include "scene/feedback.hpp"
#include "search/horizon.hpp"

namespace energymargin {

//! One of the rollouts that go on together.
struct Together {
  Draw draw;
  std::function<bool(const State&, int step)> ends;  // asked at each check time
  std::size_t number = 0;

  State state{};
  int steps = 0;
  double effort = 0.0;
  StepCounts counts{};
  bool over = false, complete = true, diverged = false;
};

//! The law of a problem's policy.
class PolicyRollouts {
 public:
  PolicyRollouts(const Problem& problem, const Timing& timing)
      : problem_(problem),
        timing_(timing),
        law_(*problem.plan->feedback),
        policy_(*problem.plan->policy),
        observer_(problem.scene, law_.observed) {}

  //! Goes on until all are over. `world(thread)` has the problem's plan. Block b has the rollouts whose number is from
  //! b * Policy::block on.
  template <typename WorldOf>
  void run(std::vector<Together>& rollouts, ThreadPool& pool, const WorldOf& world, const Limit& limit) {
    const auto count = static_cast<Eigen::Index>(rollouts.size());
    begin(count);
    for (Together& rollout : rollouts) {
      rollout.state = problem_.state;
      rollout.over = rollout.ends(rollout.state, 0);
    }
    int step = 0;
    for (int number = first_number(); step < timing_.horizon; ++number) {
      const int next = std::min(first_step(number + 1), timing_.horizon);
      if (limit.reached()) return stop(rollouts);
      if (std::all_of(rollouts.begin(), rollouts.end(), [](const Together& each) { return each.over; })) return;
      if (!(step == 0 && goes_on()) && !ask(rollouts, number, limit)) return stop(rollouts);
      pool.run(rollouts.size(), [&](std::size_t i, std::size_t thread) {
        if (!rollouts[i].over)
          go_on(rollouts[i], world(thread), step, next, queue_.front().row(static_cast<Eigen::Index>(i)), limit);
      });
      step = next;
    }
  }

 private:
  static constexpr double rounding = 1e-6;  // of a step

  int first_step(int number) const {
    const double steps = (number * law_.period - law_.start) / problem_.scene.stepping().step;
    return static_cast<int>(std::floor(steps + 0.5 + rounding));
  }

  // The last control time up to the problem's state, or for a policy that begins the one that it begins with.
  int first_number() const {
    int number = std::max(0, static_cast<int>(law_.start / law_.period) - 1);
    while (first_step(number + 1) <= 0) ++number;
    return number;
  }

  // Whether it has been asked before, and not again with the problem's state.
  bool goes_on() const { return has_memory() && first_step(first_number()) < 0; }

  bool has_memory() const { return law_.memory.size() > 0 && law_.memory[0] != 0.0; }

  void begin(Eigen::Index count) {
    const Eigen::Index size = static_cast<Eigen::Index>(law_.corrected.size()), queued = size * (law_.delay + 1);
    Eigen::VectorXd memory = law_.memory;  // as Corrections have it
    if (!has_memory()) {
      memory = Eigen::VectorXd::Zero(1 + queued + policy_.memory);
      memory.segment(1, queued) = first_commands(problem_.scene, law_).replicate(law_.delay + 1, 1);
    }
    memory_ = memory.tail(policy_.memory).transpose().replicate(count, 1);
    queue_.clear();
    for (Eigen::Index i = 0; i <= law_.delay; ++i) {
      queue_.push_back(memory.segment(1 + i * size, size).transpose().replicate(count, 1));
    }
  }

  static void stop(std::vector<Together>& rollouts) {
    for (Together& rollout : rollouts) rollout.complete = rollout.complete && rollout.over;
  }

  // The oldest answers act first. False if the limit was reached.
  bool ask(const std::vector<Together>& rollouts, int number, const Limit& limit) {
    std::rotate(queue_.begin(), queue_.begin() + 1, queue_.end());
    States& actions = queue_.back();
    for (std::size_t first = 0; first < rollouts.size();) {
      const auto place = static_cast<std::size_t>(rollouts[first].number % Policy::block);
      const std::size_t count = std::min(static_cast<std::size_t>(Policy::block) - place, rollouts.size() - first);
      const auto begin = rollouts.begin() + static_cast<std::ptrdiff_t>(first);
      const auto is_over = [](const Together& each) { return each.over; };
      const bool all_over = std::all_of(begin, begin + static_cast<std::ptrdiff_t>(count), is_over);
      if (!all_over && !ask_block(rollouts, first, count, place, number, actions, limit)) return false;
      first += count;
    }
    return true;
  }

  // Rows without a rollout repeat the first one's.
  bool ask_block(const std::vector<Together>& rollouts, std::size_t first, std::size_t count, std::size_t place,
                 int number, States& actions, const Limit& limit) {
    States observations(Policy::block, observer_.size()), memory(Policy::block, policy_.memory);
    States answers = States::Zero(Policy::block, actions.cols());
    std::vector<std::uint64_t> seeds;
    for (std::size_t row = 0; row < static_cast<std::size_t>(Policy::block); ++row) {
      const std::size_t i = row >= place && row < place + count ? first + row - place : first;
      const auto at = static_cast<Eigen::Index>(row);
      observations.row(at) = observer_(rollouts[i].state);
      memory.row(at) = memory_.row(static_cast<Eigen::Index>(i));
      if (!rollouts[i].draw.noise.empty()) seeds.push_back(rollouts[i].draw.noise.front().second);
    }
    if (!policy_.act({number * law_.period, number, observations, seeds, limit}, memory, answers)) return false;
    const auto begin = static_cast<Eigen::Index>(place), rows = static_cast<Eigen::Index>(count);
    memory_.middleRows(static_cast<Eigen::Index>(first), rows) = memory.middleRows(begin, rows);
    actions.middleRows(static_cast<Eigen::Index>(first), rows) = answers.middleRows(begin, rows);
    return true;
  }

  void go_on(Together& rollout, World& world, int step, int next, const Eigen::VectorXd& commands, const Limit& limit) {
    Watch watch;
    watch.first = step;
    watch.check_every = timing_.check;
    watch.plan = rollout.draw.plan ? &*rollout.draw.plan : nullptr;
    watch.commands = &commands;
    int check = step / timing_.check * timing_.check;
    watch.ends = [&](const State& state) { return rollout.over = rollout.ends(state, check += timing_.check); };
    try {
      const Rollout part =
          world.rollout_unchecked(rollout.state, between(rollout.draw.pushes, step, next), limit, watch);
      rollout.state = part.state;
      rollout.steps += part.steps;
      rollout.effort += part.effort;
      rollout.counts += part;
      rollout.complete = part.complete;
      if (part.complete && rollout.steps == timing_.horizon && check != timing_.horizon)
        rollout.ends(part.state, timing_.horizon);
      rollout.over = rollout.over || !part.complete;
    } catch (const Diverged&) {
      rollout.diverged = rollout.over = true;
    }
  }

  static std::vector<Push> between(const std::vector<Push>& pushes, int from, int to) {
    std::vector<Push> part;
    int begin = 0;
    for (const Push& push : pushes) {
      const int first = std::max(begin, from), last = std::min(begin + push.steps, to);
      if (first < last) part.push_back({push.wrenches, last - first});
      begin += push.steps;
    }
    return part;
  }

  const Problem& problem_;
  Timing timing_;
  const Feedback& law_;
  const Policy& policy_;
  Observer observer_;
  States memory_;
  std::vector<States> queue_;  // answers, those that act now first
};

}  // namespace energymargin
