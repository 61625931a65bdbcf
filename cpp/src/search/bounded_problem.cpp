#include "energymargin/search/bounded_problem.hpp"

#include <ompl/base/Goal.h>
#include <ompl/base/ValidStateSampler.h>
#include <ompl/control/StatePropagator.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <utility>

#include "base/check.hpp"
#include "base/thread_pool.hpp"
#include "energymargin/random.hpp"
#include "search/confirmation.hpp"
#include "search/cost_space.hpp"
#include "search/horizon.hpp"

namespace energymargin::search {
namespace {

// Once the limit is reached, an escape may still be confirmed, if that is quick [s].
constexpr double grace = 0.1;

// What rests in a simulation changes each number of its state by less, over an edge [SI].
constexpr double still = 1e-8;

// Steps from one check time of a rollout to the next: more takes time, and tells no more (docs/results/fewer_steps.md).
constexpr int check_every = 4;

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

// The longest edges first: so the threads end at nearly the same time.
std::vector<std::size_t> by_length(const std::vector<EdgeFrom>& edges) {
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return edges[a].edge.steps > edges[b].edge.steps; });
  return order;
}

// The complement of the capture set.
class Outside : public ompl::base::Goal {
 public:
  Outside(const ompl::base::SpaceInformationPtr& si, const BoundedProblem& problem) : Goal(si), problem_(problem) {}
  bool isSatisfied(const ompl::base::State* state) const override {
    return problem_.answer([&] { return problem_.escaped(node_of(state)); });
  }

 private:
  const BoundedProblem& problem_;
};

// The problem's rollouts as a state propagator. A control carries its own duration. A rollout that reaches the limit,
// or throws, leads to no node, and to an infinite cost, which is valid nowhere.
class Propagator : public ompl::control::StatePropagator {
 public:
  Propagator(const ompl::control::SpaceInformationPtr& si, BoundedProblem& problem)
      : StatePropagator(si), problem_(problem) {}
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double,
                 ompl::base::State* to) const override {
    const int start = node_of(from);  // which may be the same state as `to`
    int node = -1;
    problem_.answer([&] {
      node = problem_.extend(start, si_->getControlSpace()->as<WrenchSpace>()->edge(control));
      return true;
    });
    if (node >= 0) return problem_.describe(node, to);
    auto& nowhere = *to->as<CostSpace::StateType>();
    nowhere.cost = std::numeric_limits<double>::infinity();
    nowhere.node = -1;
  }
  bool canPropagateBackward() const override { return false; }

 private:
  BoundedProblem& problem_;
};

// EST asks for a target before it extends; a random control needs none.
class NoTarget : public ompl::base::ValidStateSampler {
 public:
  using ValidStateSampler::ValidStateSampler;
  bool sample(ompl::base::State*) override { return true; }
  bool sampleNear(ompl::base::State*, const ompl::base::State*, double) override { return true; }
};

}  // namespace

struct BoundedProblem::Simulations {
  ThreadPool pool;
  std::vector<std::unique_ptr<World>> worlds;  // one a thread
  EdgeStart edge_start;
  std::optional<Horizon> horizon;

  Simulations(const Problem& problem, const Region* captured, int threads)
      : pool(threads), worlds(pool.size()), edge_start(problem), horizon(Horizon::of(problem, captured)) {
    const auto make = [&](std::size_t i, std::size_t) { worlds[i] = std::make_unique<World>(world_of(problem)); };
    pool.run(worlds.size(), make);
  }
};

BoundedProblem::BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed,
                               const Limit& limit, Sampling sampling, int threads)
    : most_nodes_(nodes),
      limit_(limit),
      step_(problem.scene.stepping().step),
      kinematics_(problem.scene),
      objects_(problem.scene.with_role(Role::object)),
      times_{0},
      escaped_{false},
      counts_(1),
      quiet_(quiet_ompl()) {
  require_at_least("nodes", nodes, 1);
  require_at_least("threads", threads, 1);
  space_ = std::make_shared<CostSpace>(problem, stream(seed, streams::states));
  simulations_ = std::make_unique<Simulations>(problem, captured, threads);
  if (simulations_->horizon) horizon_ = simulations_->horizon->end();
  if (captured) {
    captured_.emplace(*captured, problem.scene);
    problem_ = problem;
    problem_->captured = *captured;
  }
  if (captured && problem.within) within_.emplace(*problem.within, problem.scene);
  dimension_ = problem.state.size();
  tree_.states.resize(0, dimension_ + simulations_->worlds[0]->memory());
  tree_.controls.resize(0, wrench_axes * static_cast<Eigen::Index>(objects_.size()));
  make_room(std::min(nodes, first_room) + 1);
  tree_.states.row(0).setZero();
  tree_.states.row(0).head(dimension_) = problem.state.transpose();
  if (const Simulator* simulator = simulations_->worlds[0]->simulator()) {
    tree_.states.row(0).segment(dimension_, simulator->memory) = simulator->start(problem.state.transpose()).row(0);
  }
  if (problem.plan && problem.plan->feedback && problem.plan->feedback->memory.size() > 0) {
    tree_.states.row(0).tail(problem.plan->feedback->memory.size()) = problem.plan->feedback->memory.transpose();
  }
  tree_.costs[0] = 0.0;
  tree_.parents[0] = -1;
  tree_.controls.row(0).setZero();
  tree_.durations[0] = 0.0;
  const auto controls = std::make_shared<WrenchSpace>(space_, problem, stream(seed, streams::controls), sampling);
  si_ = std::make_shared<ompl::control::SpaceInformation>(space_, controls);
  si_->setStatePropagator(std::make_shared<Propagator>(si_, *this));
  // The control carries its own duration, so OMPL's counts as one.
  si_->setPropagationStepSize(1.0);
  si_->setMinMaxControlDuration(1, 1);
  si_->setValidStateSamplerAllocator(
      [](const ompl::base::SpaceInformation* space) { return std::make_shared<NoTarget>(space); });
  si_->setStateValidityChecker([this](const ompl::base::State* state) {  // below the bound, and within Z_b
    return answer([&] { return allowed(node_of(state)); });
  });
  si_->setup();
  definition_ = std::make_shared<ompl::base::ProblemDefinition>(si_);
  definition_->setGoal(std::make_shared<Outside>(si_, *this));
  CostSpace::StateType root;
  root.objects = space_->starts();
  root.node = 0;
  definition_->addStartState(&root);
}

BoundedProblem::~BoundedProblem() = default;

ompl::base::PlannerTerminationCondition BoundedProblem::termination(int nodes) const {
  return ompl::base::PlannerTerminationCondition([this, nodes] { return this->nodes() >= nodes || spent(); });
}

double BoundedProblem::bound() const { return space_->bound(); }

void BoundedProblem::lower_bound(double cost) { space_->lower_bound(cost); }

void BoundedProblem::describe(int node, ompl::base::State* state) const {
  CostSpace::Values& values = *state->as<CostSpace::StateType>();
  const double* const numbers = tree_.states.row(node).data();
  for (std::size_t i = 0; i < objects_.size(); ++i) values.objects[i] = kinematics_(numbers, objects_[i]);
  values.cost = cost(node);
  values.time = horizon_ ? time(node) * step_ : 0.0;
  values.node = node;
}

Edge BoundedProblem::edge(int node) const {
  return {tree_.controls.row(node), static_cast<int>(std::lround(tree_.durations[node] / step_))};
}

bool BoundedProblem::allowed(int node, std::optional<double> bound) const {
  if (node >= 0 && horizon_ && time(node) >= *horizon_ && !escaped(node)) return false;
  if (node > 0 && (discarded_.count(node) > 0 || discarded_.count(parent(node)) > 0)) return false;
  return node >= 0 && cost(node) < bound.value_or(this->bound()) && (!within_ || (*within_)(state(node)));
}

bool BoundedProblem::escaped(int node) const {
  if (discarded_.count(node) > 0) return false;
  if (node > 0 && horizon_) return escaped_[static_cast<std::size_t>(node)];
  return node >= 0 && captured_ && !(*captured_)(state(node));
}

bool BoundedProblem::at_rest(int node) const {
  return node > 0 && (tree_.states.row(node) - tree_.states.row(parent(node))).cwiseAbs().maxCoeff() < still;
}

bool BoundedProblem::worth_keeping(int node, double bound) const {
  return cost(node) < bound && discarded_.count(node) == 0 && !spent();
}

int BoundedProblem::extend(int node, const Edge& edge, std::optional<double> bound) {
  const std::vector<int> nodes = extend({EdgeFrom{node, edge}}, bound);
  return nodes.empty() ? -1 : nodes.front();
}

std::vector<int> BoundedProblem::extend(const std::vector<EdgeFrom>& edges, std::optional<double> bound) {
  const int before = nodes_;
  std::vector<std::optional<Stretch>> stretches(edges.size());
  // Each edge has the nodes that are left if those before it take as many as they may.
  std::vector<Watch> watches;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const int left = most_nodes_ - nodes_ - static_cast<int>(i) * nodes_per_edge_;
    watches.push_back({cost(edges[i].node),
                       bound.value_or(this->bound()),
                       division(edges[i].edge.steps, std::min(nodes_per_edge_, left)),
                       {},
                       check_every});
    if (stops_at_escape_ && captured_ && !horizon_)
      watches.back().ends = [this](const State& now) { return !(*captured_)(now); };
  }
  if (simulations_->worlds[0]->simulator()) {
    stretches = roll_out_together(edges, watches);
  } else {
    const std::vector<std::size_t> order = by_length(edges);
    simulations_->pool.run(order.size(), [&](std::size_t job, std::size_t thread) {
      const std::size_t i = order[job];
      stretches[i] = roll_out(*simulations_->worlds[thread], edges[i], watches[i]);
    });
  }
  std::vector<int> nodes;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (stretches[i] && !stretches[i]->rollout.complete) break;
    nodes.push_back(add(edges[i], stretches[i]));
  }
  if (node_counter_) node_counter_->fetch_add(nodes_ - before, std::memory_order_relaxed);
  return nodes;
}

int BoundedProblem::extend_undisturbed() {
  if (!horizon_ || !captured_) return -1;
  ++most_nodes_;
  const Horizon& horizon = *simulations_->horizon;
  std::optional<Stretch> stretch;
  try {
    stretch = horizon.undisturbed(*simulations_->worlds[0], state(0), limit_);
    if (!stretch->rollout.complete) return -1;
  } catch (const Diverged&) {
    stretch.reset();
  }
  return add({0, horizon.rest()}, stretch);
}

// None if the simulation diverges.
std::optional<Stretch> BoundedProblem::roll_out(World& world, const EdgeFrom& from, const Watch& watch) const {
  const Edge& edge = from.edge;
  const State start = state(from.node);
  try {
    if (horizon_) return simulations_->horizon->extend(world, start, time(from.node), edge, limit_, watch);
    return Stretch{world.rollout_unchecked(simulations_->edge_start(start), {edge}, limit_, watch)};
  } catch (const Diverged&) {
    return std::nullopt;
  }
}

// The same of several edges in a simulator.
std::vector<std::optional<Stretch>> BoundedProblem::roll_out_together(const std::vector<EdgeFrom>& edges,
                                                                      const std::vector<Watch>& watches) const {
  World& world = *simulations_->worlds[0];
  const std::optional<Horizon>& horizon = simulations_->horizon;
  std::deque<bool> outside(edges.size(), false);
  std::vector<RolloutQuestion> questions;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto& [node, edge] = edges[i];
    if (horizon)
      questions.push_back(horizon->ask(state(node), time(node), edge, watches[i], outside[i]));
    else
      questions.push_back({simulations_->edge_start(state(node)), {edge}, watches[i]});
  }
  std::vector<std::optional<Rollout>> rollouts = world.rollouts_unchecked(questions, limit_);
  std::vector<std::optional<Stretch>> stretches(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!rollouts[i]) continue;
    if (horizon)
      stretches[i] = horizon->extended(world, questions[i], std::move(*rollouts[i]), outside[i], limit_);
    else
      stretches[i] = Stretch{std::move(*rollouts[i])};
  }
  return stretches;
}

// The last of the nodes of a rollout; one of infinite cost if it diverged.
int BoundedProblem::add(const EdgeFrom& from, const std::optional<Stretch>& stretch) {
  if (!stretch) {
    ++diverged_;
    return add(from.node, from.edge, 0, std::numeric_limits<double>::infinity(), state(from.node));
  }
  const Rollout& rollout = stretch->rollout;
  for (const Moment& moment : rollout.recorded) {
    if (moment.steps < rollout.steps) add(from.node, from.edge, moment.steps, moment.effort, moment.state);
  }
  const int node = add(from.node, from.edge, rollout.steps, rollout.effort, rollout.state);
  escaped_.back() = stretch->escaped;
  counts_.back() += rollout;
  counts_.back() += stretch->after_exit;
  return node;
}

int BoundedProblem::add(int from, const Edge& edge, int steps, double effort, const State& state) {
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

void BoundedProblem::make_room(Eigen::Index rows) {
  tree_.states.conservativeResize(rows, Eigen::NoChange);
  tree_.costs.conservativeResize(rows);
  tree_.parents.conservativeResize(rows);
  tree_.controls.conservativeResize(rows, Eigen::NoChange);
  tree_.durations.conservativeResize(rows);
}

std::optional<bool> BoundedProblem::confirm(int node) {
  if (!confirmation_) confirmation_ = std::make_unique<Confirmation>(*problem_);
  std::vector<int> nodes = path_to(node);
  nodes.erase(nodes.begin());
  std::vector<Edge> edges;
  for (const int next : nodes) edges.push_back(edge(next));
  const std::optional<bool> leads_out = confirmation_->leads_out(nodes, edges, limit_);
  return leads_out ? leads_out : confirmation_->leads_out(nodes, edges, Limit(nullptr, grace));
}

Tree BoundedProblem::take_tree(std::optional<int> nodes) {
  make_room(nodes.value_or(nodes_) + 1);
  tree_.states.conservativeResize(Eigen::NoChange, dimension_);
  return std::move(tree_);
}

}  // namespace energymargin::search
