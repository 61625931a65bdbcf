#pragma once
// Changes all edges of an escape at once, and learns from those changes that made it cheaper.

#include <ompl/util/RandomNumbers.h>

#include <optional>
#include <utility>
#include <vector>

#include "search/edge_changes.hpp"
#include "search/evolution_strategy.hpp"

namespace energymargin::search {

//! A (1+1)-CMA-ES over the wrenches and durations of an escape, one edge of which is cut in two first: what one push
//! does may cost less as two. An edge without a wrench stays one, and an object that an edge leaves alone is left
//! alone.
class Polish {
 public:
  //! `largest` bounds the edges. It and the generator have to outlive this.
  Polish(const Edge& largest, ompl::RNG& rng) : largest_(largest), rng_(rng) {}

  //! Begins with the edges of an escape; there is at least one.
  void start(TimedEdges escape);

  //! Until the changes have become too small to matter, or too many have failed one after the other.
  bool goes_on() const;

  //! The edges, changed.
  const TimedEdges& draw();

  //! What came of the edges drawn last: if they lead out for less, the next changes are to them.
  void tell(Outcome outcome);

 private:
  using Variable = std::pair<std::size_t, int>;  // an edge, and one of its axes, or its duration

  void cut_one();
  std::vector<Variable> variables() const;
  Eigen::VectorXd first_deviations();

  const Edge& largest_;
  ompl::RNG& rng_;
  TimedEdges best_;
  TimedEdges drawn_;
  std::vector<Variable> variables_;  // in units of the largest edge
  std::optional<EvolutionStrategy> strategy_;
  int failures_ = 0;  // one after the other
};

}  // namespace energymargin::search
