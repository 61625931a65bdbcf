#include "search/rollout_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace energymargin::search {
namespace {

// Steps between two looks at a rollout: more often takes time in small scenes, and tells no more
// (docs/results/fewer_steps.md).
constexpr int look_every = 4;

constexpr int first_room = 4096;  // rows of a tree that may end before all its nodes are made

// The steps at which an edge is divided into so many stretches, without its end.
std::vector<int> division(int steps, int stretches) {
  stretches = std::min(stretches, steps);
  std::vector<int> division;
  for (int i = 1; i < stretches; ++i) {
    division.push_back(static_cast<int>(static_cast<long long>(i) * steps / stretches));
  }
  return division;
}

std::vector<std::unique_ptr<World>> worlds_of(const Problem& problem, Crew& crew) {
  std::vector<std::unique_ptr<World>> worlds(crew.size());
  crew.run(worlds.size(), [&](std::size_t i, std::size_t) { worlds[i] = std::make_unique<World>(world_of(problem)); });
  return worlds;
}

// The longest edges first: so the threads end a round at nearly the same time.
std::vector<std::size_t> by_length(const std::vector<EdgeFrom>& round) {
  std::vector<std::size_t> order(round.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return round[a].edge.steps > round[b].edge.steps; });
  return order;
}

}  // namespace

RolloutTree::RolloutTree(const Problem& problem, const CostSpace& space, int nodes, const Limit& limit,
                         const Region* captured, int threads)
    : space_(space),
      most_nodes_(nodes),
      limit_(limit),
      crew_(threads),
      worlds_(worlds_of(problem, crew_)),
      edge_start_(problem),
      horizon_(Horizon::of(problem, captured)),
      step_(problem.scene.stepping().step),
      times_{0},
      escaped_{false},
      counts_(1) {
  for (const std::size_t object : problem.scene.with_role(Role::object)) {
    objects_.push_back(worlds_[0]->layout().offset(object));
  }
  make_room(std::min(nodes, first_room) + 1);
  tree_.states.row(0) = problem.state.transpose();
  tree_.costs[0] = 0.0;
  tree_.parents[0] = -1;
  tree_.controls.row(0).setZero();
  tree_.durations[0] = 0.0;
}

int RolloutTree::extend(int from, const Edge& edge, double bound) {
  const std::vector<int> nodes = extend({EdgeFrom{from, edge}}, bound);
  return nodes.empty() ? -1 : nodes.front();
}

std::vector<int> RolloutTree::extend(const std::vector<EdgeFrom>& round) { return extend(round, space_.bound()); }

std::vector<int> RolloutTree::extend(const std::vector<EdgeFrom>& round, double bound) {
  const int before = nodes_;
  const std::vector<std::optional<Stretch>> stretches = roll_out(round, bound);
  std::vector<int> nodes;
  for (std::size_t i = 0; i < round.size(); ++i) {
    if (stretches[i] && !stretches[i]->rollout.complete) break;
    nodes.push_back(add(round[i], stretches[i]));
  }
  if (node_counter_) node_counter_->fetch_add(nodes_ - before, std::memory_order_relaxed);
  return nodes;
}

int RolloutTree::extend_undisturbed() {
  const Edge rest = horizon_->rest();
  std::optional<Stretch> stretch;
  try {
    stretch = horizon_->undisturbed(*worlds_[0], tree_.states.row(0), limit_);
  } catch (const Diverged&) {
    ++diverged_;
    return add(0, rest, 0, std::numeric_limits<double>::infinity(), tree_.states.row(0));
  }
  if (!stretch->rollout.complete) return -1;
  const int node = add(0, rest, stretch->rollout.steps, 0.0, stretch->rollout.state);
  count(*stretch);
  return node;
}

// Of a round, in its order. Each has the nodes that are left if those before it take as many as they may.
std::vector<std::optional<Stretch>> RolloutTree::roll_out(const std::vector<EdgeFrom>& round, double bound) {
  std::vector<std::optional<Stretch>> stretches(round.size());
  const std::vector<std::size_t> order = by_length(round);
  crew_.run(order.size(), [&](std::size_t job, std::size_t thread) {
    const std::size_t i = order[job];
    const int left = most_nodes_ - nodes_ - static_cast<int>(i) * nodes_per_edge_;
    stretches[i] = roll_out(*worlds_[thread], round[i], std::min(nodes_per_edge_, left), bound);
  });
  return stretches;
}

// None if the simulation diverges.
std::optional<Stretch> RolloutTree::roll_out(World& world, const EdgeFrom& from, int nodes, double bound) const {
  const Edge& edge = from.edge;
  const State start = tree_.states.row(from.node);
  const Watch watch{tree_.costs[from.node], bound, division(edge.steps, nodes), outside_, look_every};
  try {
    if (horizon_) return horizon_->extend(world, start, time(from.node), edge, limit_, watch);
    return Stretch{world.rollout_unchecked(edge_start_(start), {edge}, limit_, watch)};
  } catch (const Diverged&) {
    return std::nullopt;
  }
}

// The last of the nodes of a rollout.
int RolloutTree::add(const EdgeFrom& from, const std::optional<Stretch>& stretch) {
  if (!stretch) {
    ++diverged_;
    return add(from.node, from.edge, 0, std::numeric_limits<double>::infinity(), tree_.states.row(from.node));
  }
  const Rollout& rollout = stretch->rollout;
  for (const Moment& moment : rollout.recorded) {
    if (moment.steps < rollout.steps) add(from.node, from.edge, moment.steps, moment.effort, moment.state);
  }
  const int node = add(from.node, from.edge, rollout.steps, rollout.effort, rollout.state);
  count(*stretch);
  return node;
}

// That it led to the last node.
void RolloutTree::count(const Stretch& stretch) {
  escaped_.back() = stretch.escaped;
  counts_.back() += stretch.rollout;
  counts_.back() += stretch.after_exit;
}

int RolloutTree::add(int from, const Edge& edge, int steps, double effort, const State& state) {
  const int node = ++nodes_;
  if (node >= tree_.costs.size()) make_room(2 * tree_.costs.size());
  tree_.states.row(node) = state.transpose();
  tree_.costs[node] = tree_.costs[from] + effort;
  tree_.parents[node] = from;
  tree_.controls.row(node) = edge.wrenches.transpose();
  tree_.durations[node] = steps * step_;
  times_.push_back(time(from) + steps);
  escaped_.push_back(false);
  counts_.push_back(counts_.back());
  return node;
}

void RolloutTree::describe(int node, CostSpace::Values& values) const {
  const double* state = tree_.states.row(node).data();
  for (std::size_t i = 0; i < objects_.size(); ++i) values.objects[i] = StateLayout::read(state + objects_[i]);
  values.cost = tree_.costs[node];
  values.time = horizon_ ? time(node) * step_ : 0.0;
  values.node = node;
}

Edge RolloutTree::edge(int node) const {
  return {tree_.controls.row(node), static_cast<int>(std::lround(tree_.durations[node] / step_))};
}

void RolloutTree::make_room(Eigen::Index rows) {
  tree_.states.conservativeResize(rows, worlds_[0]->layout().dimension());
  tree_.costs.conservativeResize(rows);
  tree_.parents.conservativeResize(rows);
  tree_.controls.conservativeResize(rows, 6 * static_cast<Eigen::Index>(objects_.size()));
  tree_.durations.conservativeResize(rows);
}

Tree RolloutTree::take_tree(int nodes) {
  make_room(nodes + 1);
  return std::move(tree_);
}

}  // namespace energymargin::search
