#pragma once
// Effort of escape, Section IV-A and Algorithm 1.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/escape.hpp"

namespace energymargin {

//! How an escape is searched for.
enum class Search {
  improved,  //!< mixed controls, and most nodes make the best escape cheaper: the least work that is found
  published  //!< Algorithm 1 as in the paper: controls drawn evenly, nothing shortened
};

struct EffortOptions {
  std::string planner = "est";  //!< "est" or "rrt": the x of AO-x
  int nodes = 1000;  //!< of the tree besides its root and the undisturbed future, over all iterations of AO-x
  std::uint64_t seed = 0;
  Captured captured = Captured::all;         //!< of several objects, which have to leave
  Limit limit{};                             //!< ends the search early; the best escape so far counts
  Search search = Search::improved;          //!< with a clock and without
  std::optional<Sampling> sampling{};        //!< how controls are drawn; by default as the search does
  std::optional<bool> shorten{};             //!< make the best escape cheaper; by default as the search does
  bool stop_at_escape = false;               //!< a rollout ends where it is seen outside, every few steps
  std::atomic<int>* node_counter = nullptr;  //!< goes up with each node, for a bar of progress
  bool check_undisturbed = false;            //!< without a clock, also when the state leaves without a disturbance
  int searches = 1;         //!< independent ones, which share the nodes; the one of least effort is the result
  int nodes_per_round = 1;  //!< nodes that are extended at once, and changes of an escape that are tried at once
  int threads = 1;          //!< for several searches, or for the nodes of a round
};

//! An upper bound of the least effort that leads out of the capture set; inf without an escape. With a horizon it has
//! to be outside in time, and to stay so for `dwell`. At its limit one search has the bits of a search of so many
//! nodes.
Escape escape_effort(const Problem& problem, const EffortOptions& options = {});

}  // namespace energymargin
