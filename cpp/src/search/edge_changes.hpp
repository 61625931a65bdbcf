#pragma once
// Changes to the edges of an escape: small random ones, and the same way at a lower speed.

#include <ompl/util/RandomNumbers.h>

#include <functional>
#include <optional>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "scene/energy.hpp"

namespace energymargin::search {

//! An edge and when it starts.
struct TimedEdge : Edge {
  int start = 0;  //!< steps since the root; without a clock edges follow one another, and it means nothing
};
using TimedEdges = std::vector<TimedEdge>;

//! Puts a push in front of other edges, as edges of at most `longest` steps.
void prepend(TimedEdges& edges, const TimedEdge& push, int longest);

class EdgeChanges {
 public:
  //! `largest` bounds the edges; `horizon` is in steps, none without a clock. `largest` and the generator have to
  //! outlive this.
  EdgeChanges(const Edge& largest, std::optional<int> horizon, ompl::RNG& rng);

  EdgeChanges(const EdgeChanges&) = delete;
  EdgeChanges& operator=(const EdgeChanges&) = delete;

  //! A change of the first of some edges, or of several of them. There is at least one; afterwards there may be none.
  struct Change {
    std::function<void(TimedEdges&)> apply;
    bool concerns_all = false;  //!< it is one of all edges of an escape
  };

  //! Any change, all equally likely.
  const Change& draw();

 private:
  void weaken_all(TimedEdges& edges);
  void cut(TimedEdges& edges);
  void merge(TimedEdges& edges);
  void silence(TimedEdges& edges);
  void shift(TimedEdges& edges);
  void hasten(TimedEdges& edges);

  TimedEdge nudge(TimedEdge edge);
  void nudge_wrenches(Eigen::VectorXd& wrenches, double size);
  int draw_axis();
  double draw_size();

  const Edge& largest_;
  std::optional<int> horizon_;
  ompl::RNG& rng_;
  std::vector<Change> changes_;
  std::vector<int> axes_;  // that have bounds above 0
};

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
