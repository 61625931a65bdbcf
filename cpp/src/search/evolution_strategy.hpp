#pragma once
// A (1+1)-CMA-ES with constraints.

#include <ompl/util/RandomNumbers.h>

#include <Eigen/Core>

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
  const Eigen::VectorXd& draw();

  //! Of the step drawn last.
  void tell(Outcome outcome);

  Eigen::Index dimension() const { return step_.size(); }

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
  Eigen::VectorXd drawn_;      // with it
  Eigen::VectorXd path_;       // s, of the steps that succeeded
  Eigen::VectorXd violation_;  // v, of the steps that broke the constraint
};

}  // namespace energymargin::search
