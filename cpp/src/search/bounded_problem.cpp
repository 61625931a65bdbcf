#include "energymargin/search/bounded_problem.hpp"

#include "base/check.hpp"
#include "energymargin/random.hpp"
#include "search/adapters.hpp"
#include "search/confirmation.hpp"
#include "search/cost_space.hpp"
#include "search/quiet.hpp"
#include "search/rollout_tree.hpp"
#include "search/streams.hpp"
#include "search/wrench_space.hpp"

namespace energymargin::search {
namespace {

// Once the limit is reached, an escape may still be confirmed, if that is quick [s].
constexpr double grace = 0.1;

// Of each number of a state, over an edge: what rests in a simulation moves less [SI].
constexpr double still = 1e-8;

}  // namespace

BoundedProblem::BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed,
                               const Limit& limit, Sampling sampling, int threads)
    : most_nodes_(nodes), limit_(limit), quiet_(quiet_ompl()) {
  require_at_least("nodes", nodes, 1);
  require_at_least("threads", threads, 1);
  space_ = std::make_shared<CostSpace>(problem, stream(seed, streams::states));
  tree_ = std::make_unique<RolloutTree>(problem, *space_, nodes, limit, captured, threads);
  if (captured) {
    captured_.emplace(*captured, problem.scene);
    problem_ = problem;
    captured_region_ = *captured;
  }
  if (captured && problem.within) within_.emplace(*problem.within, problem.scene);
  const auto controls = std::make_shared<WrenchSpace>(space_, problem, stream(seed, streams::controls), sampling);
  si_ = search::space_information(controls, *tree_, *this);
  definition_ = search::definition(si_, *this);
}

BoundedProblem::~BoundedProblem() = default;

void BoundedProblem::set_nodes_per_edge(int count) { tree_->set_nodes_per_edge(count); }

void BoundedProblem::count_in(std::atomic<int>* node_counter) { tree_->count_in(node_counter); }

void BoundedProblem::stop_at_escape() {
  if (captured_ && !horizon()) tree_->end_where([this](const State& state) { return !(*captured_)(state); });
}

ompl::base::PlannerTerminationCondition BoundedProblem::termination(int nodes) const {
  return ompl::base::PlannerTerminationCondition([this, nodes] { return this->nodes() >= nodes || spent(); });
}

bool BoundedProblem::spent() const { return nodes_are_spent() || limit_.reached() || failure_; }

void BoundedProblem::rethrow() const {
  if (failure_) std::rethrow_exception(failure_);
}

double BoundedProblem::bound() const { return space_->bound(); }

void BoundedProblem::lower_bound(double cost) { space_->lower_bound(cost); }

int BoundedProblem::nodes() const { return tree_->nodes(); }

int BoundedProblem::rollouts_left() const {
  const int per_edge = tree_->nodes_per_edge();
  return (most_nodes_ - nodes() + per_edge - 1) / per_edge;
}

StepCounts BoundedProblem::counts(int nodes) const { return tree_->counts(nodes); }

int BoundedProblem::diverged() const { return tree_->diverged(); }

void BoundedProblem::describe(int node, ompl::base::State* state) const {
  tree_->describe(node, *state->as<CostSpace::StateType>());
}

State BoundedProblem::state(int node) const { return tree_->state(node); }

double BoundedProblem::cost(int node) const { return tree_->cost(node); }

int BoundedProblem::time(int node) const { return tree_->time(node); }

std::optional<int> BoundedProblem::horizon() const {
  const std::optional<Horizon>& horizon = tree_->horizon();
  return horizon ? std::optional(horizon->end()) : std::nullopt;
}

Edge BoundedProblem::edge(int node) const { return tree_->edge(node); }

std::vector<int> BoundedProblem::path_to(int node) const { return tree_->path_to(node); }

bool BoundedProblem::allowed(int node) const { return allowed(node, bound()); }

bool BoundedProblem::allowed(int node, double bound) const {
  if (node >= 0 && horizon() && time(node) >= *horizon() && !escaped(node)) return false;
  if (node > 0 && (discarded_.count(node) > 0 || discarded_.count(tree_->parent(node)) > 0)) return false;
  return node >= 0 && cost(node) < bound && (!within_ || (*within_)(State(tree_->state(node))));
}

bool BoundedProblem::escaped(int node) const {
  if (discarded_.count(node) > 0) return false;
  if (node > 0 && horizon()) return tree_->escaped(node);
  return node >= 0 && captured_ && !(*captured_)(State(tree_->state(node)));
}

bool BoundedProblem::at_rest(int node) const {
  return node > 0 && (tree_->state(node) - tree_->state(tree_->parent(node))).cwiseAbs().maxCoeff() < still;
}

bool BoundedProblem::worth_keeping(int node, double bound) const {
  return cost(node) < bound && discarded_.count(node) == 0 && !spent();
}

int BoundedProblem::extend(int node, const Edge& edge) { return extend(node, edge, bound()); }

int BoundedProblem::extend(int node, const Edge& edge, double bound) { return tree_->extend(node, edge, bound); }

std::vector<int> BoundedProblem::extend(const std::vector<EdgeFrom>& round) { return tree_->extend(round); }

int BoundedProblem::extend_undisturbed() {
  if (!horizon() || !captured_) return -1;
  ++most_nodes_;
  return tree_->extend_undisturbed();
}

std::optional<bool> BoundedProblem::confirm(int node) {
  if (!confirmation_) confirmation_ = std::make_unique<Confirmation>(*problem_, *captured_region_);
  std::vector<int> nodes = path_to(node);
  nodes.erase(nodes.begin());
  std::vector<Edge> edges;
  for (const int next : nodes) edges.push_back(edge(next));
  const std::optional<bool> leads_out = confirmation_->leads_out(nodes, edges, limit_);
  return leads_out ? leads_out : confirmation_->leads_out(nodes, edges, Limit(nullptr, grace));
}

Tree BoundedProblem::take_tree(int nodes) { return tree_->take_tree(nodes); }

}  // namespace energymargin::search
