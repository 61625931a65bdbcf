#include "energymargin/search/ao.hpp"

#include <ompl/control/PathControl.h>

#include <limits>
#include <utility>

#include "energymargin/search/prunable.hpp"

namespace energymargin::search {
namespace {

// Nodes of a turn, once there is an escape.
constexpr int planner_turn = 50;
constexpr int shortening_turn = 50;

// AO-x, turn by turn.
class Search {
 public:
  Search(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening)
      : problem_(problem), planner_(planner), shortening_(shortening) {
    escape_.effort = std::numeric_limits<double>::infinity();
    if (problem_.escaped(0)) improve(0);
  }

  bool finished() const { return problem_.spent() || gave_up_ || escape_.effort == 0.0; }

  void plan() {
    const int before = problem_.nodes();
    const bool take_turns = shortening_ && last_ >= 0;
    planner_.solve(take_turns ? problem_.termination(problem_.nodes() + planner_turn) : problem_.termination());
    gave_up_ = problem_.nodes() == before;
    const ompl::base::ProblemDefinitionPtr& definition = problem_.definition();
    if (!definition->hasExactSolution()) return;
    improve(solution(*definition));
    definition->clearSolutionPaths();
    if (shortening_) shortening_->start(last_);
    prune();
  }

  void shorten() {
    if (!shortening_ || last_ < 0) return;
    const int end = problem_.nodes() + shortening_turn;
    const double before = escape_.effort;
    while (problem_.nodes() < end && !finished()) {
      if (shortening_->attempt()) improve(shortening_->end());
    }
    if (escape_.effort < before) prune();
  }

  Escape result() {
    escape_.complete = problem_.nodes_are_spent() || escape_.effort == 0.0;
    escape_.tree = problem_.take_tree();
    escape_.path = escape_.tree.path_to(last_);
    return std::move(escape_);
  }

 private:
  // The node in which the planner's solution ends.
  static int solution(const ompl::base::ProblemDefinition& definition) {
    const auto& states = definition.getSolutionPath()->as<ompl::control::PathControl>()->getStates();
    return states.back()->as<CostSpace::StateType>()->node;
  }

  void improve(int node) {
    last_ = node;
    escape_.effort = problem_.cost(node);
    escape_.history.emplace_back(problem_.nodes(), escape_.effort);
    problem_.lower_bound(escape_.effort);
  }

  void prune() {
    if (auto* prunable = dynamic_cast<Prunable*>(&planner_)) prunable->prune(escape_.effort);
  }

  BoundedProblem& problem_;
  ompl::base::Planner& planner_;
  Shortening* shortening_;
  Escape escape_;
  int last_ = -1;         // where the best escape ends
  bool gave_up_ = false;  // the planner has nothing left to extend
};

}  // namespace

Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening) {
  Search search(problem, planner, shortening);
  while (!search.finished()) {
    search.plan();
    search.shorten();
  }
  return search.result();
}

}  // namespace energymargin::search
