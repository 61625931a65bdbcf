#include "energymargin/search/ao.hpp"

#include <ompl/control/PathControl.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "search/cost_space.hpp"
#include "search/shortening.hpp"

namespace energymargin::search {
namespace {

// Nodes of a turn, the planner's and shortening's: before there is an escape, and always with a clock; after that.
constexpr int planner_turn = 50;
constexpr int short_turn = 50;
constexpr int late_planner_turn = 20;
constexpr int long_turn = 180;

// Under Confirm::best a best escape is confirmed at the end, and before it whenever there are so many times the nodes.
constexpr int confirmation_growth = 4;

// Algorithm 1, turn by turn.
class Search {
 public:
  Search(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening, Confirm confirm)
      : problem_(problem), planner_(planner), shortening_(shortening), confirm_(confirm) {
    const int first = problem_.escaped(0) ? 0 : problem_.extend_undisturbed();
    futures_ = problem_.nodes();
    if (problem_.escaped(first)) add_undisturbed(first);
  }

  bool finished() const { return problem_.spent() || ended_ || effort() == 0.0; }

  void wait() {
    if (finished() || !shortening_ || !shortening_->wait()) return;
    add_undisturbed(shortening_->end());
    confirm();
  }

  void plan() {
    const int before = problem_.nodes();
    const int turn = mostly_shortens() ? late_planner_turn : planner_turn;
    planner_.solve(shortening_ ? problem_.termination(problem_.nodes() + turn) : problem_.termination());
    problem_.rethrow();
    ended_ = problem_.nodes() == before;
    nothing_left_ = ended_ && !problem_.spent();  // to extend
    const ompl::base::ProblemDefinitionPtr& definition = problem_.definition();
    if (definition->hasExactSolution()) {
      add(node_of(definition->getSolutionPath()->as<ompl::control::PathControl>()->getStates().back()));
    }
    definition->clearSolutionPaths();
  }

  void shorten() {
    if (!shortening_) return;
    const int end = problem_.nodes() + (mostly_shortens() ? long_turn : short_turn);
    while (problem_.nodes() < end && !finished()) {
      if (shortening_->attempt()) add(shortening_->end());
    }
  }

  // The best escape counts if a finer simulation confirms it; those before it lowered the bound less.
  void confirm() {
    const bool due = confirm_ == Confirm::each_turn || problem_.nodes() >= next_confirmation_ || finished();
    if (!due || candidates_.size() == first_unconfirmed_) return;
    while (candidates_.size() > first_unconfirmed_) {
      const std::optional<bool> leads_out = problem_.confirm(candidates_.back().node);
      if (!leads_out) {  // nothing is known of the nodes from the first unconfirmed one on
        last_node_ = std::max(candidates_[first_unconfirmed_].node - 1, 0);
        candidates_.resize(first_unconfirmed_);
        ended_ = true;
      } else if (*leads_out) {
        first_unconfirmed_ = candidates_.size();
        next_confirmation_ = confirmation_growth * problem_.nodes();
        return;
      } else {
        discard_best();
      }
    }
    problem_.lower_bound(effort());
    if (shortening_) shortening_->start(candidates_.empty() ? 0 : candidates_.back().node);
  }

  // Only by an escape that counts: pruning by one that is discarded later would take too much.
  void prune() {
    if (effort() == prune_bound_ && discards_ == pruned_discards_) return;
    prune_bound_ = effort();
    pruned_discards_ = discards_;
    if (auto* prunable = dynamic_cast<Prunable*>(&planner_)) prunable->prune(prune_bound_);
  }

  Escape result() {
    Escape escape;
    escape.effort = effort();
    for (const Candidate& best : candidates_) escape.history.emplace_back(best.nodes, problem_.cost(best.node));
    escape.complete = !last_node_ && (problem_.nodes_are_spent() || escape.effort == 0.0 || nothing_left_);
    escape.discarded = discards_;
    escape.discarded_effort = discarded_effort_;
    escape.diverged = problem_.diverged();
    const int nodes = last_node_.value_or(problem_.nodes());
    static_cast<StepCounts&>(escape) = problem_.counts(nodes);
    escape.tree = problem_.take_tree(nodes);
    escape.undisturbed = futures_ > 0;
    if (undisturbed_exit_ && *undisturbed_exit_ <= nodes) {
      escape.undisturbed_exit = escape.tree.times()[*undisturbed_exit_];
    }
    escape.path = escape.tree.path_to(candidates_.empty() ? -1 : candidates_.back().node);
    return escape;
  }

 private:
  struct Candidate {
    int node;   // in which an escape ends
    int nodes;  // that there were
  };

  bool mostly_shortens() const { return !candidates_.empty() && !problem_.horizon(); }

  double effort() const {
    return candidates_.empty() ? std::numeric_limits<double>::infinity() : problem_.cost(candidates_.back().node);
  }

  void add(int node) {
    candidates_.push_back({node, problem_.nodes() - futures_});
    problem_.lower_bound(effort());
    if (shortening_) shortening_->start(node);
  }

  // An escape without a wrench.
  void add_undisturbed(int node) {
    undisturbed_exit_ = node;
    add(node);
  }

  void discard_best() {
    problem_.discard(candidates_.back().node);
    discarded_effort_ = std::min(discarded_effort_, effort());
    candidates_.pop_back();
    ++discards_;
    if (confirm_ == Confirm::best) ended_ = true;  // the bound was too low
  }

  BoundedProblem& problem_;
  ompl::base::Planner& planner_;
  Shortening* shortening_;
  Confirm confirm_;
  std::vector<Candidate> candidates_;  // each cheaper than the one before
  std::size_t first_unconfirmed_ = 0;  // those before it count
  int futures_ = 0;                    // nodes of the undisturbed future
  int next_confirmation_ = 0;          // nodes
  int discards_ = 0;
  double discarded_effort_ = std::numeric_limits<double>::infinity();  // least of them [J]
  std::optional<int> undisturbed_exit_;                                // node
  double prune_bound_ = std::numeric_limits<double>::infinity();       // on what is left in the planner [J]
  int pruned_discards_ = 0;
  bool ended_ = false;
  bool nothing_left_ = false;
  std::optional<int> last_node_;  // of the result, if the limit was reached while an escape was confirmed
};

}  // namespace

Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening, Confirm confirm) {
  Search search(problem, planner, shortening, confirm);
  search.wait();
  while (!search.finished()) {
    search.plan();
    search.shorten();
    search.confirm();
    search.prune();
  }
  return search.result();
}

}  // namespace energymargin::search
