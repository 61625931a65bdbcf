#pragma once
// What probabilities of capture share: when the sets are checked, and how many rollouts may diverge.

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin {

//! Steps after which the sets are checked, from 0 to the horizon.
inline std::vector<int> check_steps(const Timing& timing) {
  std::vector<int> steps;
  for (int step = 0; step < timing.horizon; step += timing.check) steps.push_back(step);
  steps.push_back(timing.horizon);
  return steps;
}

//! Their times [s].
inline Eigen::VectorXd times_of(const std::vector<int>& steps, double step) {
  Eigen::VectorXd times(static_cast<Eigen::Index>(steps.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) times[static_cast<Eigen::Index>(i)] = step * steps[i];
  return times;
}

//! Whether more rollouts have diverged than a result may have: one and this share, if others are left; none if it is 0,
//! any number if it is 1.
inline bool too_many_diverged(int diverged, int rollouts, double most) {
  if (most >= 1.0 || diverged == 0) return false;
  return diverged == rollouts || diverged > (most > 0.0 ? std::max(1.0, most * rollouts) : 0.0);
}

//! Throws std::runtime_error on too many.
inline void require_few_diverged(int diverged, int rollouts, double most) {
  if (!too_many_diverged(diverged, rollouts, most)) return;
  throw std::runtime_error(std::to_string(diverged) + " of " + std::to_string(rollouts) +
                           " rollouts diverged, which is too many for a probability: a shorter step of the scene, "
                           "or a weaker disturbance");
}

}  // namespace energymargin
