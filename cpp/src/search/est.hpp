#pragma once
// EST with pruning: nodes in thinly settled regions are extended first.

#include <ompl/control/planners/est/EST.h>

#include <cstdint>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/prunable.hpp"

namespace energymargin::search {

//! The density is counted in a grid over each object's change of position and orientation, with a horizon the time and,
//! below a finite bound, the cost.
class Est : public ompl::control::EST, public Prunable {
 public:
  Est(const BoundedProblem& problem, std::uint64_t seed);

  void prune(double bound) override;

 private:
  void forget(Motion* motion);

  const BoundedProblem& problem_;
};

}  // namespace energymargin::search
