#pragma once
// Rollouts of a problem that go on together: from one control time of a policy to the next, or in a simulator.

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "base/thread_pool.hpp"
#include "energymargin/random.hpp"
#include "energymargin/simulator.hpp"
#include "energymargin/state.hpp"
#include "scene/feedback.hpp"
#include "search/horizon.hpp"
#include "search/rollouts.hpp"

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

//! Takes the rollouts that are not over from `step` on, as far as `ask(rollout, question)` says.
template <typename WorldOf, typename Ask>
void go_on(std::vector<Together>& rollouts, const Timing& timing, int step, ThreadPool& pool, const WorldOf& world,
           const Limit& limit, const Ask& ask) {
  std::vector<Together*> going;
  for (Together& rollout : rollouts) {
    if (!rollout.over) going.push_back(&rollout);
  }
  if (going.empty()) return;
  std::vector<int> checks(going.size(), step / timing.check * timing.check);
  std::vector<RolloutQuestion> questions(going.size());
  for (std::size_t i = 0; i < going.size(); ++i) {
    Together& rollout = *going[i];
    questions[i].state = rollout.state;
    Watch& watch = questions[i].watch;
    watch.first = step;
    watch.check_every = timing.check;
    watch.plan = rollout.draw.plan ? &*rollout.draw.plan : nullptr;
    watch.ends = [&rollout, &check = checks[i], &timing](const State& state) {
      return rollout.over = rollout.ends(state, check += timing.check);
    };
    ask(rollout, questions[i]);
  }
  const std::vector<std::optional<Rollout>> parts = search::roll_out(questions, pool, world, limit);
  for (std::size_t i = 0; i < going.size(); ++i) {
    Together& rollout = *going[i];
    if (!parts[i]) {
      rollout.diverged = rollout.over = true;
      continue;
    }
    rollout.state = parts[i]->state;
    rollout.steps += parts[i]->steps;
    rollout.effort += parts[i]->effort;
    rollout.counts += *parts[i];
    rollout.complete = parts[i]->complete;
    if (rollout.complete && rollout.steps == timing.horizon && checks[i] != timing.horizon)
      rollout.ends(rollout.state, timing.horizon);
    rollout.over = rollout.over || !rollout.complete;
  }
}

//! All rollouts of a problem without a policy.
template <typename WorldOf>
void go_on_to_horizon(std::vector<Together>& rollouts, const Problem& problem, const Timing& timing, ThreadPool& pool,
                      const WorldOf& world, const Limit& limit) {
  for (Together& rollout : rollouts) {
    rollout.state = problem.state;
    rollout.over = rollout.ends(rollout.state, 0);
  }
  go_on(rollouts, timing, 0, pool, world, limit, [](Together& rollout, RolloutQuestion& question) {
    question.pushes = rollout.draw.pushes;
    question.watch.noise = &rollout.draw.noise;
    question.watch.ends_for_good = true;
  });
}

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
    const State first = with_memory(problem_.state);
    for (Together& rollout : rollouts) {
      rollout.state = first;
      rollout.over = rollout.ends(rollout.state, 0);
    }
    int step = 0;
    for (int number = first_number(); step < timing_.horizon; ++number) {
      const int next = std::min(first_step(number + 1), timing_.horizon);
      if (limit.reached()) return stop(rollouts);
      if (std::all_of(rollouts.begin(), rollouts.end(), [](const Together& each) { return each.over; })) return;
      if (!(step == 0 && goes_on()) && !ask(rollouts, number, limit)) return stop(rollouts);
      go_on(rollouts, pool, world, step, next, limit);
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

  // What a simulator knows behind a state that is set from outside.
  State with_memory(const State& state) const {
    const auto& simulator = problem_.scene.stepping().simulator;
    if (!simulator || state.size() != StateLayout(problem_.scene).dimension()) return state;
    State whole(state.size() + simulator->memory);
    whole << state, simulator->start(state.transpose()).row(0).transpose();
    return whole;
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

  template <typename WorldOf>
  void go_on(std::vector<Together>& rollouts, ThreadPool& pool, const WorldOf& world, int step, int next,
             const Limit& limit) {
    std::vector<Eigen::VectorXd> commands(rollouts.size());
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      if (!rollouts[i].over) commands[i] = queue_.front().row(static_cast<Eigen::Index>(i));
    }
    energymargin::go_on(rollouts, timing_, step, pool, world, limit, [&](Together& rollout, RolloutQuestion& question) {
      question.pushes = between(rollout.draw.pushes, step, next);
      question.watch.commands = &commands[static_cast<std::size_t>(&rollout - rollouts.data())];
    });
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
