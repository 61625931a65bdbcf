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
  published,  //!< the paper's: controls drawn evenly, nothing shortened
  improved    //!< mixed controls, and most nodes make the best escape cheaper
};

//! The search of a problem where none is asked for. With a clock it is `improved`. Without one it is `published`: since
//! a wait of any length is free there, the least efforts of states hardly differ, and do not rank them.
Search search_of(const Problem& problem);

struct EffortOptions {
  std::string planner = "est";  //!< "est" or "rrt": the x of AO-x
  int nodes = 1000;  //!< of the tree besides its root and the undisturbed future, over all iterations of AO-x
  std::uint64_t seed = 0;
  Captured captured = Captured::all;         //!< of several objects, which have to leave
  Limit limit{};                             //!< ends the search early; the best escape so far counts
  std::optional<Search> search{};            //!< by default as `search_of` has it
  std::optional<Sampling> sampling{};        //!< how controls are drawn; by default as the search does
  std::optional<bool> shorten{};             //!< make the best escape cheaper; by default as the search does
  bool stop_at_escape = false;               //!< a rollout ends where it is seen outside, every few steps
  std::atomic<int>* node_counter = nullptr;  //!< goes up with each node, for a bar of progress
  bool check_undisturbed = false;            //!< without a clock, also when the state leaves without a disturbance
  int searches = 1;  //!< independent ones, which share the nodes; the one of least effort is the result
  int threads = 1;   //!< for several searches
};

//! An upper bound of the least effort that leads out of the capture set; inf without an escape. With a horizon it has
//! to be outside in time, and to stay so for `dwell`. At its limit one search has the bits of a search of so many
//! nodes.
Escape escape_effort(const Problem& problem, const EffortOptions& options = {});

}  // namespace energymargin
