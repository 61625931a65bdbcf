#pragma once
// What holds for the tree of every search.

#include <gtest/gtest.h>

#include <cmath>

#include "energymargin/membership.hpp"
#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/escape.hpp"
#include "energymargin/world.hpp"
#include "expect.hpp"

namespace energymargin {

//! A planner; one that draws nothing itself has no seed.
template <typename Planner>
Planner planner_of(search::BoundedProblem& problem, std::uint64_t seed) {
  if constexpr (std::is_constructible_v<Planner, search::BoundedProblem&, std::uint64_t>) {
    return Planner(problem, seed);
  } else {
    return Planner(problem);
  }
}

//! The wrenches on all objects that lead to a node.
inline Disturbance control(const Tree& tree, int node) {
  Disturbance wrenches;
  for (Eigen::Index first = 0; first < tree.controls.cols(); first += 6) {
    const Vector3 force = tree.controls.row(node).segment<3>(first);
    const Vector3 torque = tree.controls.row(node).segment<3>(first + 3);
    wrenches.push_back({force, torque});
  }
  return wrenches;
}

//! Each node is what its control leads to from its parent, to the bit, and its cost the sum of efforts on the way.
inline void expect_each_edge_is_a_rollout(const Tree& tree, const Problem& problem) {
  World world(problem.scene);
  const EdgeStart edge_start(problem);
  EXPECT_TRUE(same_bits(State(tree.states.row(0)), problem.state));
  EXPECT_EQ(tree.costs[0], 0.0);
  EXPECT_EQ(tree.parents[0], -1);
  int different = 0;
  for (int node = 1; node < tree.size(); ++node) {
    const int parent = tree.parents[node];
    ASSERT_GE(parent, 0);
    ASSERT_LT(parent, node);
    const State start = edge_start(tree.states.row(parent));
    const Rollout rollout = world.rollout(start, control(tree, node), tree.durations[node]);
    EXPECT_GE(tree.costs[node], tree.costs[parent]) << "node " << node;
    different += same_bits(rollout.state, State(tree.states.row(node))) &&
                         same_bits(tree.costs[parent] + rollout.effort, tree.costs[node])
                     ? 0
                     : 1;
  }
  EXPECT_EQ(different, 0) << "of " << tree.size() << " nodes";
}

//! Wrenches lie within the problem's bounds, durations are whole steps up to the longest.
inline void expect_controls_within_bounds(const Tree& tree, const Problem& problem) {
  for (int node = 1; node < tree.size(); ++node) {
    for (const Wrench& wrench : control(tree, node)) {
      EXPECT_TRUE((wrench.force.cwiseAbs().array() <= problem.force.array()).all()) << "node " << node;
      EXPECT_TRUE((wrench.torque.cwiseAbs().array() <= problem.torque.array()).all()) << "node " << node;
    }
    const double steps = tree.durations[node] / problem.scene.stepping().step;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    EXPECT_GE(steps, 1.0 - 1e-9);
    EXPECT_LE(tree.durations[node], problem.duration + 1e-9);
  }
}

//! The best effort strictly falls from one improvement to the next, and the last one is the answer.
inline void expect_history_falls_to_the_effort(const Escape& escape) {
  ASSERT_FALSE(escape.history.empty());
  for (std::size_t i = 1; i < escape.history.size(); ++i) {
    EXPECT_GT(escape.history[i].first, escape.history[i - 1].first);
    EXPECT_LT(escape.history[i].second, escape.history[i - 1].second);
  }
  EXPECT_EQ(escape.history.back().second, escape.effort);
  EXPECT_EQ(escape.tree.costs[escape.path.back()], escape.effort);
}

//! The path leads from the root to a node outside of the capture set, through nodes inside of it and of the bounds.
inline void expect_path_leaves_the_capture_set_only_at_its_end(const Escape& escape, const Problem& problem,
                                                               Captured of = Captured::all) {
  const Membership captured(capture_set(problem, of), problem.scene);
  ASSERT_FALSE(escape.path.empty());
  EXPECT_EQ(escape.path.front(), 0);
  for (std::size_t i = 0; i < escape.path.size(); ++i) {
    const State state = escape.tree.states.row(escape.path[i]);
    EXPECT_EQ(captured(state), i + 1 < escape.path.size()) << "node " << i << " of the path";
    EXPECT_TRUE(!problem.within || Membership(*problem.within, problem.scene)(state)) << "node " << i << " of the path";
    EXPECT_EQ(escape.tree.parents[escape.path[i]], i == 0 ? -1 : escape.path[i - 1]);
  }
}

//! The path's controls alone lead from the start to the same escape, to the bit.
inline void expect_path_replays_from_its_controls(const Escape& escape, const Problem& problem) {
  World world(problem.scene);
  const EdgeStart edge_start(problem);
  State state = problem.state;
  double effort = 0.0;
  for (std::size_t i = 1; i < escape.path.size(); ++i) {
    const int node = escape.path[i];
    const State start = edge_start(state);
    const Rollout rollout = world.rollout(start, control(escape.tree, node), escape.tree.durations[node]);
    state = rollout.state;
    effort += rollout.effort;
  }
  EXPECT_TRUE(same_bits(state, State(escape.tree.states.row(escape.path.back()))));
  EXPECT_TRUE(same_bits(effort, escape.effort));
}

}  // namespace energymargin
