#pragma once
// Changes all edges of an escape at once, and learns from those changes that made it cheaper.

#include <ompl/util/RandomNumbers.h>

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "search/edge_changes.hpp"

namespace energymargin::search {

//! What came of a trial.
enum class Outcome {
  better,      ///< than the best point: it is the new one
  worse,       ///< than it
  infeasible,  ///< it breaks the constraint
};

//! Steps from the best point, normal with a covariance that adapts to the steps that succeed, and shrinks along those
//! that break the constraint: the least is sought where it is, at the constraint's edge. D. V. Arnold and N. Hansen, A
//! (1+1)-CMA-ES for Constrained Optimisation, GECCO 2012.
class EvolutionStrategy {
 public:
  //! Steps are drawn by `rng`, which has to outlive this. The first have this standard deviation in each coordinate.
  EvolutionStrategy(const Eigen::VectorXd& deviations, ompl::RNG& rng);

  //! The next step.
  Eigen::VectorXd draw();

  //! Of the step drawn last.
  void tell(Outcome outcome);

  //! Of the steps now, as a share of those at first.
  double size() const { return size_; }

 private:
  void learn_success();
  void learn_violation();

  ompl::RNG& rng_;
  double size_ = 1.0;
  double success_rate_;
  Eigen::MatrixXd factor_;     // A, with A A^T the covariance
  Eigen::VectorXd step_;       // A z, without its size
  Eigen::VectorXd path_;       // s, of the steps that succeeded
  Eigen::VectorXd violation_;  // v, of the steps that broke the constraint
};

//! A (1+1)-CMA-ES over the wrenches and durations of an escape, one edge of which is cut in two first: what one push
//! does may cost less as two. An edge without a wrench stays one, and an object that an edge leaves alone is left
//! alone.
class Polish {
 public:
  //! `largest` bounds the edges. It and the generator have to outlive this.
  Polish(const Edge& largest, ompl::RNG& rng) : largest_(largest), rng_(rng) {}

  //! Begins with the edges of an escape; there is at least one.
  void start(TimedEdges escape);

  //! Until the changes have become too small to matter, or too many have failed one after the other.
  bool goes_on() const;

  //! The edges, changed.
  const TimedEdges& draw();

  //! What came of the edges drawn last: if they lead out for less, the next changes are to them.
  void tell(Outcome outcome);

 private:
  using Variable = std::pair<std::size_t, int>;  // an edge, and one of its axes, or its duration

  void cut_one();
  std::vector<Variable> variables() const;
  Eigen::VectorXd first_deviations();

  const Edge& largest_;
  ompl::RNG& rng_;
  TimedEdges best_;
  TimedEdges drawn_;
  std::vector<Variable> variables_;  // in units of the largest edge
  std::optional<EvolutionStrategy> strategy_;
  int failures_ = 0;  // one after the other
};

}  // namespace energymargin::search
