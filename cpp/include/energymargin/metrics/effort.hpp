#pragma once
// Effort of escape, Section IV-A and Algorithm 1.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/escape.hpp"
#include "energymargin/search/sampling.hpp"

namespace energymargin {

//! How an escape is searched for.
enum class Search {
  published,  //!< the paper's: controls drawn evenly, nothing shortened
  improved    //!< mixed controls, and half of the nodes spent on making the best escape cheaper
};

struct EffortOptions {
  std::string planner = "est";  //!< "est" or "rrt": the x of AO-x
  int nodes = 1000;  //!< nodes of the tree besides its root and the undisturbed future, over all iterations of AO-x
  std::uint64_t seed = 0;
  Captured captured = Captured::all;  //!< of several objects, which have to leave
  Limit limit{};                      //!< ends the search early; what it has found counts
  Search search = Search::improved;
  std::optional<Sampling> sampling{};  //!< how controls are drawn; by default as the search does
  std::optional<bool> shorten{};       //!< make the best escape cheaper; by default as the search does
  bool stop_at_escape = false;         //!< a rollout ends where it is seen outside, every few steps, and not later
  std::atomic<int>* made = nullptr;    //!< goes up with each node, for a bar of progress; null: not counted
};

//! Least effort found that leads out of the capture set; inf if none was. With a horizon it has to lead out in time,
//! and to stay outside for `dwell` without a wrench; its cost is that up to there, and an object that leaves by itself
//! needs none. A search that reaches its limit gives the tree as far as it is, the bits of one of so many nodes. Throws
//! std::invalid_argument on bad input.
Escape escape_effort(const Problem& problem, const EffortOptions& options = {});

}  // namespace energymargin
