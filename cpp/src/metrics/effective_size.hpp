#pragma once
// How much estimates of a rare probability are worth.

#include <Eigen/Core>

namespace energymargin {

//! How many rollouts of equal weight say as much about a probability as these independent estimates of it. At least as
//! many as the replicas, whose first rollouts are independent, and at most what the best of all levels gives, with a
//! relative variance of -log(p) / replicas.
double effective_size(const Eigen::VectorXd& estimates, int replicas);

}  // namespace energymargin
