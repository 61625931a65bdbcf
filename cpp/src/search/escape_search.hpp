#pragma once
// The search behind the effort of escape, Algorithm 1: AO-x over EST or RRT.

#include <atomic>
#include <cstdint>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/escape.hpp"
#include "energymargin/search/sampling.hpp"

namespace energymargin::search {

//! The x of AO-x.
enum class FeasiblePlanner { est, rrt };

struct EscapeSearchOptions {
  FeasiblePlanner planner = FeasiblePlanner::est;
  int nodes = 1000;  //!< besides the root and the undisturbed future
  std::uint64_t seed = 0;
  Limit limit{};
  Sampling sampling = Sampling::mixed;
  bool shorten = true;                       //!< most nodes make the best escape cheaper
  bool stop_at_escape = false;               //!< a rollout ends where it is seen outside
  std::atomic<int>* node_counter = nullptr;  //!< goes up with each node, and falls to 0 if the search is done again
};

//! The cheapest escape from `captured` that the search finds. The problem is valid.
Escape find_escape(const Problem& problem, const Region& captured, const EscapeSearchOptions& options);

}  // namespace energymargin::search
