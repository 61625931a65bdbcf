#pragma once
// An escape at a lower speed.

#include <vector>

#include "energymargin/problem.hpp"
#include "scene/energy.hpp"
#include "search/edge_changes.hpp"

namespace energymargin::search {

//! An edge of an escape, and the states between which it leads.
struct Passage {
  Edge edge;
  State from, to;
};

//! The same way at a lower speed. The kinetic energy falls with the square of the speed and what friction, impacts and
//! the top of a barrier take of it is saved; the potential energy is that of the poses. So each push has to do the work
//! that it did, less the kinetic energy that it need not give any more. Where the object coasted it is pushed on.
class SlowMotion {
 public:
  //! `largest` bounds the edges, and has to outlive this.
  SlowMotion(const Problem& problem, const Edge& largest);

  //! The edges at the `slowdown`-th part of the speed that a frame sees which moves with the velocities of `frame`. The
  //! first push does `surplus` times more work, relative to that.
  TimedEdges operator()(const std::vector<Passage>& escape, const State& frame, double slowdown, double surplus) const;

 private:
  double work(const Eigen::VectorXd& wrenches, const Passage& passage, const State& frame) const;

  Energy energy_;
  const Edge& largest_;
  double step_;               // [s]
  std::vector<int> objects_;  // where their numbers begin in a state
};

}  // namespace energymargin::search
