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

//! Runs any OMPL control planner on the problem until its nodes are spent. The planner keeps its tree between
//! iterations, and prunes it if it is Prunable. An escape counts if it is one in a simulation with a quarter of the
//! step too.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner);

}  // namespace energymargin::search
