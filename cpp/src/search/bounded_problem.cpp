#include "energymargin/search/bounded_problem.hpp"

#include <ompl/base/Goal.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/ValidStateSampler.h>
#include <ompl/util/Console.h>

#include "base/check.hpp"
#include "energymargin/random.hpp"

namespace energymargin::search {
namespace {

// Streams of one search's seed.
constexpr std::uint64_t sampler_stream = 1;
constexpr std::uint64_t control_stream = 2;

// Once the limit is reached, an escape may still be confirmed, if that is quick [s].
constexpr double grace = 0.1;

int node_of(const ompl::base::State* state) { return state->as<CostSpace::StateType>()->node; }

// Below the bound, and within Z_b.
class Allowed : public ompl::base::StateValidityChecker {
 public:
  Allowed(const ompl::base::SpaceInformationPtr& si, const BoundedProblem& problem)
      : StateValidityChecker(si), problem_(problem) {}
  bool isValid(const ompl::base::State* state) const override { return problem_.allowed(node_of(state)); }

 private:
  const BoundedProblem& problem_;
};

// The complement of the capture set.
class Outside : public ompl::base::Goal {
 public:
  Outside(const ompl::base::SpaceInformationPtr& si, const BoundedProblem& problem) : Goal(si), problem_(problem) {}
  bool isSatisfied(const ompl::base::State* state) const override { return problem_.escaped(node_of(state)); }

 private:
  const BoundedProblem& problem_;
};

// EST asks for a target before it extends; a random control needs none.
class NoTarget : public ompl::base::ValidStateSampler {
 public:
  using ValidStateSampler::ValidStateSampler;
  bool sample(ompl::base::State*) override { return true; }
  bool sampleNear(ompl::base::State*, const ompl::base::State*, double) override { return true; }
};

}  // namespace

BoundedProblem::BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed,
                               const Limit& limit, Sampling sampling)
    : most_nodes_(nodes), limit_(limit) {
  require_at_least("nodes", nodes, 1);
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  space_ = std::make_shared<CostSpace>(problem, stream(seed, sampler_stream));
  const auto controls = std::make_shared<WrenchSpace>(space_, problem, stream(seed, control_stream), sampling);
  si_ = std::make_shared<ompl::control::SpaceInformation>(space_, controls);
  propagator_ = std::make_shared<Propagator>(si_, problem, nodes, limit, captured);
  si_->setStatePropagator(propagator_);
  // The control carries its own duration, so OMPL's counts as one.
  si_->setPropagationStepSize(1.0);
  si_->setMinMaxControlDuration(1, 1);
  si_->setValidStateSamplerAllocator(
      [](const ompl::base::SpaceInformation* si) { return std::make_shared<NoTarget>(si); });
  if (captured) {
    captured_.emplace(*captured, problem.scene);
    problem_ = problem;
    captured_region_ = *captured;
  }
  if (captured && problem.within) within_.emplace(*problem.within, problem.scene);
  si_->setStateValidityChecker(std::make_shared<Allowed>(si_, *this));
  si_->setup();

  definition_ = std::make_shared<ompl::base::ProblemDefinition>(si_);
  definition_->setGoal(std::make_shared<Outside>(si_, *this));
  CostSpace::StateType root;
  root.objects = space_->starts();
  root.node = 0;
  definition_->addStartState(&root);
}

void BoundedProblem::stop_at_escape() {
  if (captured_ && !horizon()) propagator_->end_where([this](const State& state) { return !(*captured_)(state); });
}

ompl::base::PlannerTerminationCondition BoundedProblem::termination(int nodes) const {
  return ompl::base::PlannerTerminationCondition([this, nodes] { return this->nodes() >= nodes || spent(); });
}

std::optional<int> BoundedProblem::horizon() const {
  const std::optional<Horizon>& horizon = propagator_->horizon();
  return horizon ? std::optional(horizon->end()) : std::nullopt;
}

int BoundedProblem::extend_undisturbed() {
  if (!horizon() || !captured_) return -1;
  ++most_nodes_;
  return propagator_->extend_undisturbed();
}

bool BoundedProblem::allowed(int node) const {
  if (node >= 0 && horizon() && time(node) >= *horizon() && !escaped(node)) return false;
  return node >= 0 && cost(node) < bound() && (!within_ || (*within_)(State(propagator_->state(node))));
}

bool BoundedProblem::escaped(int node) const {
  if (node > 0 && horizon()) return propagator_->escaped(node);
  return node >= 0 && captured_ && !(*captured_)(State(propagator_->state(node)));
}

std::optional<bool> BoundedProblem::confirmed(int node) {
  if (!confirmation_) confirmation_.emplace(*problem_, *captured_region_);
  std::vector<int> nodes = path_to(node);
  nodes.erase(nodes.begin());
  std::vector<Edge> edges;
  for (const int next : nodes) edges.push_back(edge(next));
  const std::optional<bool> leads_out = confirmation_->leads_out(nodes, edges, limit_);
  return leads_out ? leads_out : confirmation_->leads_out(nodes, edges, Limit(nullptr, grace));
}

bool BoundedProblem::spent() const { return nodes_are_spent() || limit_.reached(); }

}  // namespace energymargin::search
