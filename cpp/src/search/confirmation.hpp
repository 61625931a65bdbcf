#pragma once
// Whether an escape is one in a finer simulation too.

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/edge.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"
#include "search/horizon.hpp"

namespace energymargin::search {

//! Plays escapes again with a quarter of the step. A simulation may let an object out where its steps are too long;
//! then the finer one does not.
class Confirmation {
 public:
  //! It plays escapes from `captured`.
  Confirmation(const Problem& problem, const Region& captured);

  //! Whether the edges lead out, with their wrenches or, if these fall short, with up to 1.2 times as strong ones; at
  //! their end the object may go on without a wrench for as long as a longest edge. None if the limit was reached
  //! first. With a clock they follow the plan, and end at the horizon. `nodes` are those to which the edges lead: what
  //! two paths have in common is played once.
  std::optional<bool> leads_out(const std::vector<int>& nodes, const std::vector<Edge>& edges, const Limit& limit);

 private:
  struct Checkpoint {  // where a replay was at a node
    int node;
    State state;
    int time;
  };

  std::optional<bool> play(const std::vector<int>& nodes, const std::vector<Edge>& edges, double strength,
                           const Limit& limit);
  Stretch play(const State& from, int time, Edge edge, double strength, const Limit& limit);
  Stretch play_with_clock(const State& from, int time, Edge edge, const Limit& limit);

  int parts_;  // of a step
  World world_;
  std::optional<Horizon> horizon_;
  State start_;
  EdgeStart edge_start_;
  Membership captured_;
  Edge rest_;
  std::vector<Checkpoint> checkpoints_;  // on the last path, under the wrenches themselves
};

}  // namespace energymargin::search
