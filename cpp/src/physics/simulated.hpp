#pragma once
// Rollouts of a scene that a Simulator steps: all go on together, from one instant that matters to the next.

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "energymargin/simulator.hpp"
#include "energymargin/world.hpp"
#include "physics/robot.hpp"

namespace energymargin {

class SimulatedRollouts {
 public:
  //! `geometry` has the scene's bodies, for what the robot observes. `plan` is null or that of the world.
  SimulatedRollouts(Engine& geometry, const Plan* plan)
      : geometry_(geometry), simulator_(*geometry.scene().stepping().simulator), plan_(plan) {}

  //! None for a rollout that diverged.
  std::vector<std::optional<Rollout>> run(const std::vector<RolloutQuestion>& questions, const Limit& limit) {
    begin(questions);
    for (std::vector<Row*> rows = going_on(); !rows.empty(); rows = going_on()) {
      if (limit.reached() || !go_on(rows, limit)) {
        for (Row* row : rows) row->result.complete = false;
        break;
      }
    }
    std::vector<std::optional<Rollout>> results;
    for (Row& row : rows_) {
      row.result.state = whole_state(row);
      if (row.diverged) {
        results.emplace_back();
      } else {
        results.emplace_back(std::move(row.result));
      }
    }
    return results;
  }

 private:
  // Steps of all rollouts in one call, at most: between two calls it is seen that the limit is reached.
  static constexpr int most_steps_of_call = 1 << 15;

  struct Row {
    const RolloutQuestion& question;
    std::optional<Robot> robot{};
    State state{};  // of the scene, and behind it the simulator's
    Rollout result{};
    int steps = 0;         // of all pushes
    std::size_t push = 0;  // that acts
    int left = 0;          // steps of it
    std::size_t recorded = 0;
    bool over = false, diverged = false;
  };

  Eigen::Index dimension() const { return geometry_.layout().dimension(); }
  Eigen::Index own() const { return dimension() + simulator_.memory; }

  void begin(const std::vector<RolloutQuestion>& questions) {
    rows_.clear();
    rows_.reserve(questions.size());
    std::vector<std::size_t> fresh;
    for (const RolloutQuestion& question : questions) {
      Row row{question};
      for (const Push& push : question.pushes) row.steps += push.steps;
      row.left = question.pushes.empty() ? 0 : question.pushes.front().steps;
      if (question.state.size() == dimension()) fresh.push_back(rows_.size());
      rows_.push_back(std::move(row));
    }
    States memory(0, simulator_.memory), states(static_cast<Eigen::Index>(fresh.size()), dimension());
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      states.row(static_cast<Eigen::Index>(i)) = questions[fresh[i]].state.transpose();
    }
    if (!fresh.empty()) memory = simulator_.start(states);
    Eigen::Index next = 0;
    for (Row& row : rows_) {
      row.state.resize(own());
      const State& given = row.question.state;
      if (given.size() == dimension()) {
        row.state << given, memory.row(next++).transpose();
      } else {
        row.state = given.head(own());
      }
      row.over = row.steps == 0;
      const Watch& watch = row.question.watch;
      const Plan* plan = watch.plan ? watch.plan : plan_;
      if (!plan) continue;
      row.robot.emplace(geometry_.scene(), *plan);
      row.robot->restore(given.size() == dimension() ? row.state : given, own());
      row.robot->take(watch.commands, watch.noise);
    }
  }

  std::vector<Row*> going_on() {
    std::vector<Row*> rows;
    for (Row& row : rows_) {
      if (!row.over) rows.push_back(&row);
    }
    return rows;
  }

  static int now(const Row& row) { return row.question.watch.first + row.result.steps; }

  // Whether several of its check times may pass in one call: nobody goes on from where it ends.
  static bool passes_checks(const Row& row) {
    const Watch& watch = row.question.watch;
    return watch.ends && watch.ends_for_good && now(row) % watch.check_every == 0;
  }

  // Steps up to the next one that is asked about.
  static int stretch(const Row& row, bool through_checks) {
    const Watch& watch = row.question.watch;
    int steps = row.steps - row.result.steps;
    if (row.recorded < watch.record.size()) steps = std::min(steps, watch.record[row.recorded] - row.result.steps);
    if (row.robot) steps = std::min(steps, row.robot->steps_until_asked(now(row)));
    if (watch.ends && !through_checks) steps = std::min(steps, watch.check_every - now(row) % watch.check_every);
    return steps;
  }

  // False if the limit was reached.
  bool go_on(const std::vector<Row*>& rows, const Limit& limit) {
    const int check = rows.front()->question.watch.check_every;
    const bool through = std::all_of(rows.begin(), rows.end(), [check](const Row* row) {
      return passes_checks(*row) && row->question.watch.check_every == check;
    });
    int steps = std::max(most_steps_of_call / static_cast<int>(rows.size()), through ? check : 1);
    for (const Row* row : rows) steps = std::min(steps, stretch(*row, through));
    const bool many = through && steps > check;
    if (many) steps -= steps % check;
    if (!load(rows, steps, limit)) return false;
    const int every = many ? check : steps;
    SimulatorAnswer answer;
    if (!simulator_.play({states_, memory_, pushes_, commands_, commanded_, steps, every, limit}, answer)) return false;
    for (std::size_t i = 0; i < rows.size(); ++i) take(*rows[i], static_cast<Eigen::Index>(i), steps, every, answer);
    return true;
  }

  bool load(const std::vector<Row*>& rows, int steps, const Limit& limit) {
    const auto count = static_cast<Eigen::Index>(rows.size());
    commanded_.clear();
    if (rows.front()->robot) commanded_ = rows.front()->robot->target_names();
    states_.resize(count, dimension());
    memory_.resize(count, simulator_.memory);
    pushes_.resize(count * steps, rows.front()->question.pushes.front().wrenches.size());
    commands_.resize(count * steps, static_cast<Eigen::Index>(commanded_.size()));
    Eigen::Index at = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      Row& row = *rows[static_cast<std::size_t>(i)];
      states_.row(i) = row.state.head(dimension()).transpose();
      memory_.row(i) = row.state.tail(simulator_.memory).transpose();
      if (row.robot && row.robot->memory() > 0) geometry_.restore(row.state);
      for (int step = 0; step < steps; ++step, ++at) {
        while (row.left == 0) row.left = row.question.pushes[++row.push].steps;
        pushes_.row(at) = row.question.pushes[row.push].wrenches.transpose();
        --row.left;
        if (!row.robot) continue;
        if (!row.robot->decide(geometry_, now(row) + step, limit, &row.state)) return false;
        const std::vector<double>& targets = row.robot->targets();
        for (std::size_t k = 0; k < targets.size(); ++k) commands_(at, static_cast<Eigen::Index>(k)) = targets[k];
      }
    }
    return true;
  }

  void take(Row& row, Eigen::Index number, int steps, int every, const SimulatorAnswer& answer) const {
    const Watch& watch = row.question.watch;
    const Eigen::Index states = steps / every;
    row.state.tail(simulator_.memory) = answer.memory.row(number).transpose();
    Eigen::Index at = number * steps;
    for (Eigen::Index i = 0; i < states && !row.over; ++i) {
      for (int step = 0; step < every; ++step, ++at) {
        for (const double work : answer.work.row(at)) {
          row.result.effort += std::abs(work);
          row.result.work += work;
        }
      }
      row.result.steps += every;
      row.state.head(dimension()) = answer.states.row(number * states + i).transpose();
      row.diverged = !row.state.allFinite() || !std::isfinite(row.result.effort);
      row.over = row.diverged || row.result.steps == row.steps || !(watch.cost + row.result.effort < watch.bound);
      if (row.diverged) return;
      if (row.recorded < watch.record.size() && watch.record[row.recorded] == row.result.steps) {
        row.result.recorded.push_back({row.result.steps, row.result.effort, whole_state(row)});
        ++row.recorded;
      }
      if (!(watch.cost + row.result.effort < watch.bound)) return;
      if (watch.ends && now(row) % watch.check_every == 0 && watch.ends(whole_state(row))) row.over = true;
    }
  }

  // With what the robot remembers behind it.
  State whole_state(Row& row) const {
    if (!row.robot || row.robot->memory() == 0) return row.state;
    State state(own() + row.robot->memory());
    state << row.state, row.robot->remembered();
    return state;
  }

  Engine& geometry_;
  const Simulator& simulator_;
  const Plan* plan_;
  std::vector<Row> rows_;
  States states_, memory_, pushes_, commands_;  // of a question
  std::vector<std::string> commanded_;
};

}  // namespace energymargin
