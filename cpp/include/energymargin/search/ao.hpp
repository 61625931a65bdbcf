#pragma once
// AO-x (Hauser and Zhou), Algorithm 1: a feasible planner x, asked again and again for a cheaper escape.

#include <ompl/base/Planner.h>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/escape.hpp"

namespace energymargin::search {

//! A planner that drops what AO-x no longer needs.
class Prunable {
 public:
  virtual ~Prunable() = default;

  //! Forgets the nodes whose cost is not below `bound`: nothing that grows from them can be better.
  virtual void prune(double bound) = 0;
};

class Shortening;

//! When best escapes are played again with a quarter of the step. One that does not lead out there is no escape.
enum class Confirm {
  best,       ///< the last one, and a few on the way; the search ends if one is none, since its cost bounded the search
  each_turn,  ///< after each turn of the planner and of shortening, before it bounds the search any longer
};

//! Runs any OMPL control planner until its nodes are spent. It keeps its tree between turns, and prunes it if it is
//! Prunable. With `shortening` a wait comes first, then both take turns; the planner keeps a tenth of the nodes, with
//! a clock half: AO-x stays asymptotically optimal. If Confirm::best discards an escape, search with
//! Confirm::each_turn.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening = nullptr,
          Confirm confirm = Confirm::each_turn);

}  // namespace energymargin::search
